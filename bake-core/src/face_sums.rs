//! Sums over the texels of six faces that do not depend on the order of adding.
//!
//! Floats round differently in another order, and every fast way has its own order. So a
//! texel's share of the moments is rounded once, to a whole number of 2⁻³⁰, and sums are of
//! integers: two bakers that see the same texels produce the same bits. A share is off by
//! half a step, 5·10⁻¹⁰, at most; the sum over a face of 128² by some 10⁻⁷ at random signs,
//! which is what a single float resolves.

use crate::Moments;
use crate::cube_face::texels;

/// Steps in 1: the whole sphere fits 31 bits.
const STEPS: f64 = (1_u32 << 30) as f64;

/// A texel's share of the moments, in steps of 2⁻³⁰.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FixedTexel {
    /// Of moment 0: the texel's share of the sphere.
    pub a: i32,
    /// Of moment 1: that times the unit vector through the texel's centre.
    pub m: [i32; 3],
}

/// The shares of [`texels`], in their order.
pub fn fixed_texels(size: u32) -> Vec<FixedTexel> {
    let fixed = |v: f64| (v * STEPS).round() as i32;
    let texels = texels(size).into_iter().map(|texel| {
        let length = texel.direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        FixedTexel {
            a: fixed(texel.weight),
            m: texel.direction.map(|v| fixed(texel.weight * v / length)),
        }
    });
    texels.collect()
}

/// What is known of a cell while its texels are tested.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaceSums {
    /// Occluded texels.
    pub count: u32,
    /// Sum of [`FixedTexel::a`].
    pub a: i32,
    /// Sum of [`FixedTexel::m`].
    pub m: [i32; 3],
}

impl FaceSums {
    /// Counts an occluded texel.
    pub fn add(&mut self, texel: &FixedTexel) {
        self.count += 1;
        self.a += texel.a;
        for (sum, m) in self.m.iter_mut().zip(texel.m) {
            *sum += m;
        }
    }

    /// The moments, of `directions` texels in all.
    #[inline]
    pub fn moments(&self, directions: u32) -> Moments {
        // The shares sum to 1 and to no direction but for rounding; a full cell is full.
        if self.count == directions {
            return Moments {
                a: 1.0,
                m: [0.0; 3],
            };
        }
        let float = |v: i32| (f64::from(v) / STEPS) as f32;
        Moments {
            a: float(self.a).min(1.0),
            m: self.m.map(float),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_the_sphere_and_has_no_axis() {
        for size in [8, 9, 16, 128] {
            let mut sums = FaceSums::default();
            let texels = fixed_texels(size);
            texels.iter().for_each(|texel| sums.add(texel));
            // Half a step a texel at the very most, and the sum must fit.
            let worst = texels.len() as i64 / 2;
            assert!((i64::from(sums.a) - (1 << 30)).abs() <= worst, "{size}");
            assert!(sums.m.iter().all(|m| i64::from(*m).abs() <= worst));
            let moments = sums.moments(texels.len() as u32);
            assert_eq!((moments.a, moments.m), (1.0, [0.0; 3]));
        }
    }

    #[test]
    fn half_the_sky_is_half() {
        let mut sums = FaceSums::default();
        for (texel, fixed) in texels(16).iter().zip(fixed_texels(16)) {
            if texel.direction[1] > 0.0 {
                sums.add(&fixed);
            }
        }
        let moments = sums.moments(1536);
        // A half-space: a = ½, m = ¼ but for the texels' centres standing for all of them.
        assert!((moments.a - 0.5).abs() < 1e-6);
        assert!((moments.m[1] - 0.25).abs() < 1e-3 && moments.m[0].abs() < 1e-6);
    }
}
