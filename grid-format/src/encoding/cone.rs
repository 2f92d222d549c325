//! A cone: its unit axis d in object axes, and the occluded fraction a (RR-5779, section 5).

use super::{Channel, Facts, channel};
use crate::ChannelRange::{Signed, Unit};
use crate::TexelFormat;

pub(super) struct Cone;

impl Facts for Cone {
    const NAME: &'static str = "cone";
    const CHANNELS: &'static [Channel] = &[
        channel("dx", Signed),
        channel("dy", Signed),
        channel("dz", Signed),
        channel("a", Unit),
    ];
    const HAS_DIRECTION: bool = true;

    #[inline(always)]
    fn push_cell(format: TexelFormat, [x, y, z, a]: [f32; 4], out: &mut Vec<u8>) {
        for d in [x, y, z] {
            format.push(Signed, d, out);
        }
        format.push(Unit, a, out);
    }

    #[inline(always)]
    fn values(format: TexelFormat, texel: &[u8]) -> [f32; 4] {
        let channel = |c: usize| &texel[c * format.channel_bytes()..];
        let d = |c| format.read(Signed, channel(c));
        [d(0), d(1), d(2), format.read(Unit, channel(3))]
    }

    #[inline(always)]
    fn cell_from_values(values: [f32; 4]) -> [f32; 4] {
        values
    }

    fn max_error(format: TexelFormat) -> [f32; 2] {
        [Unit, Signed].map(|range| format.max_error(range))
    }
}

#[cfg(test)]
mod tests {
    use crate::{Encoding, TexelFormat};

    #[test]
    fn the_documented_angular_error_of_the_axis_is_tight() {
        for (format, degrees) in [(TexelFormat::Unorm8, 0.39), (TexelFormat::F16, 0.024)] {
            let mut worst = 0.0_f64;
            for step in 0..20_000 {
                // A spiral over the sphere: its height and azimuth are incommensurable.
                let z = (f64::from(step) + 0.5) / 10_000.0 - 1.0;
                let (sin, cos) = (f64::from(step) * 2.399_963).sin_cos();
                let r = (1.0 - z * z).sqrt();
                let d = [r * cos, r * sin, z];
                let mut texel = Vec::new();
                let [x, y, z] = d.map(|v| v as f32);
                Encoding::Cone.push_cell(format, [x, y, z, 0.5], &mut texel);
                let stored = Encoding::Cone.cell(format, &texel).map(f64::from);
                let dot: f64 = (0..3).map(|x| d[x] * stored[x]).sum();
                let cross = [0, 1, 2].map(|x| {
                    let (y, z) = ((x + 1) % 3, (x + 2) % 3);
                    d[y] * stored[z] - d[z] * stored[y]
                });
                let sin = cross.iter().map(|v| v * v).sum::<f64>().sqrt();
                worst = worst.max(sin.atan2(dot).to_degrees());
            }
            assert!(
                worst <= degrees && worst > 0.8 * degrees,
                "{format:?}: {worst}"
            );
        }
    }
}
