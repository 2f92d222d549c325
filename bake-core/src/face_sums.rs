//! Fixed-point sums over the texels of six faces, which do not depend on the order of summation.
//!
//! Floating-point sums depend on the order, and every fast algorithm has its own. So each texel's
//! contribution to the moments is rounded once to a multiple of 2⁻³⁰, and the sums are integers:
//! two bakers with the same occluded texels produce the same bits. The error of a contribution is
//! at most half a step, 5·10⁻¹⁰; the error of the sum over a face of 128² texels is about 10⁻⁷ at
//! random signs, the resolution of a single-precision float.

use crate::Moments;
use crate::cube_face::texels;

/// Fixed-point steps per unit: the whole sphere fits 31 bits.
const STEPS_PER_UNIT: f64 = (1_u32 << 30) as f64;

/// A texel's contribution to the moments, in fixed point with steps of 2⁻³⁰.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FixedTexel {
    /// Contribution to moment 0: the texel's fraction of the sphere.
    pub a: i32,
    /// Contribution to moment 1: the fraction times the unit vector through the texel's center.
    pub m: [i32; 3],
}

/// Returns the contributions of [`texels`], in their order.
pub fn fixed_texels(size: u32) -> Vec<FixedTexel> {
    let fixed = |v: f64| (v * STEPS_PER_UNIT).round() as i32;
    let texels = texels(size).into_iter().map(|texel| {
        let length = texel.direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        FixedTexel {
            a: fixed(texel.weight),
            m: texel.direction.map(|v| fixed(texel.weight * v / length)),
        }
    });
    texels.collect()
}

/// The fixed-point sums of a cell's occluded texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaceSums {
    /// Number of occluded texels.
    pub count: u32,
    /// Sum of [`FixedTexel::a`].
    pub a: i32,
    /// Sum of [`FixedTexel::m`].
    pub m: [i32; 3],
}

impl FaceSums {
    /// Adds an occluded texel.
    pub fn add(&mut self, texel: &FixedTexel) {
        self.count += 1;
        self.a += texel.a;
        for (sum, m) in self.m.iter_mut().zip(texel.m) {
            *sum += m;
        }
    }

    /// Returns the moments of a cell with `directions` texels in all.
    #[inline]
    pub fn moments(&self, directions: u32) -> Moments {
        // All contributions sum to a = 1, m = 0 but for rounding; a fully occluded cell is exact.
        if self.count == directions {
            return Moments {
                a: 1.0,
                m: [0.0; 3],
            };
        }
        let float = |v: i32| (f64::from(v) / STEPS_PER_UNIT) as f32;
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
    fn the_full_sphere_has_fraction_one_and_no_axis() {
        for size in [8, 9, 16, 128] {
            let mut sums = FaceSums::default();
            let texels = fixed_texels(size);
            texels.iter().for_each(|texel| sums.add(texel));
            // At most half a step per texel, and the sum must fit.
            let worst = texels.len() as i64 / 2;
            assert!((i64::from(sums.a) - (1 << 30)).abs() <= worst, "{size}");
            assert!(sums.m.iter().all(|m| i64::from(*m).abs() <= worst));
            let moments = sums.moments(texels.len() as u32);
            assert_eq!((moments.a, moments.m), (1.0, [0.0; 3]));
        }
    }

    #[test]
    fn a_half_space_has_fraction_one_half() {
        let mut sums = FaceSums::default();
        for (texel, fixed) in texels(16).iter().zip(fixed_texels(16)) {
            if texel.direction[1] > 0.0 {
                sums.add(&fixed);
            }
        }
        let moments = sums.moments(1536);
        // A half-space has a = ½ and m = ¼, up to the error of using the texels' centers.
        assert!((moments.a - 0.5).abs() < 1e-6);
        assert!((moments.m[1] - 0.25).abs() < 1e-3 && moments.m[0].abs() < 1e-6);
    }
}
