//! Random directions of a point's hemisphere.

use std::f64::consts::TAU;

use aogrid_bake_core::surface::{cross, dot};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The random numbers of a point. They depend on the seed and the point's index alone.
struct PointRandom(ChaCha8Rng);

impl PointRandom {
    fn new(seed: u64, point_idx: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(point_idx as u64);
        Self(rng)
    }

    /// Returns a uniform number in 0..1, a multiple of 2⁻⁵³.
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Returns `n` directions about `axis`, one in each of `n` strata of equal solid angle: rings of equal
/// widths in the cosine, or nearly, divided around the axis.
pub(super) fn stratified(seed: u64, point_idx: usize, axis: [f64; 3], n: u32) -> Vec<[f64; 3]> {
    let mut random = PointRandom::new(seed, point_idx);
    let [s, t] = tangents(axis);
    // Twice as many sectors as rings make strata about as long as wide in the middle.
    let n_rings = ((f64::from(n) / 2.0).sqrt() as u32).max(1);
    let mut directions = Vec::with_capacity(n as usize);
    for ring in 0..n_rings {
        let first = |ring: u32| (u64::from(ring) * u64::from(n) / u64::from(n_rings)) as u32;
        let (start, end) = (first(ring), first(ring + 1));
        let n_sectors = end - start;
        for sector in 0..n_sectors {
            let height = f64::from(start) + random.unit() * f64::from(n_sectors);
            let z = 1.0 - height / f64::from(n);
            let angle = TAU * (f64::from(sector) + random.unit()) / f64::from(n_sectors);
            let radius = (1.0 - z * z).sqrt();
            let (sin, cos) = angle.sin_cos();
            let sum = |x: usize| radius * (cos * s[x] + sin * t[x]) + z * axis[x];
            directions.push([0, 1, 2].map(sum));
        }
    }
    directions
}

/// Returns `n` uniform directions about `axis` by rejection (listing 17-2): points of a cube that are
/// neither outside its sphere nor below the axis.
pub(super) fn rejection(seed: u64, point_idx: usize, axis: [f64; 3], n: u32) -> Vec<[f64; 3]> {
    let mut random = PointRandom::new(seed, point_idx);
    let mut directions = Vec::with_capacity(n as usize);
    while directions.len() < n as usize {
        let p = [(); 3].map(|()| 2.0 * random.unit() - 1.0);
        let squared = dot(p, p);
        if squared > 0.0 && squared <= 1.0 && dot(p, axis) > 0.0 {
            directions.push(p.map(|v| v / squared.sqrt()));
        }
    }
    directions
}

/// Returns two unit vectors that are across `axis` and each other (Duff et al., *Building an
/// Orthonormal Basis, Revisited*, JCGT 2017).
pub(super) fn tangents(axis: [f64; 3]) -> [[f64; 3]; 2] {
    let [x, y, z] = axis;
    let sign = 1.0_f64.copysign(z);
    let a = -1.0 / (sign + z);
    let s = [1.0 + sign * x * x * a, sign * x * y * a, -sign * x];
    [s, cross(axis, s)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The axis of the tests, of length 1.
    const AXIS: [f64; 3] = [0.36, -0.48, 0.8];

    #[test]
    fn directions_are_uniform_over_the_hemisphere() {
        let n = 20_000;
        for make in [stratified, rejection] {
            let directions = make(7, 5, AXIS, n);
            assert_eq!(directions.len(), n as usize);
            assert_ne!(directions, make(7, 6, AXIS, n));
            assert_ne!(directions, make(8, 5, AXIS, n));
            let (mut mean, mut square) = ([0.0; 3], 0.0);
            for d in directions {
                let cosine = dot(d, AXIS);
                assert!(cosine > 0.0 && (dot(d, d) - 1.0).abs() < 1e-12);
                (0..3).for_each(|x| mean[x] += d[x] / f64::from(n));
                square += cosine * cosine / f64::from(n);
            }
            // The mean is ½ of the axis, that of the squared cosine ⅓. Components vary by less than
            // 1/√3 from direction to direction: four standard errors.
            let tolerance = 4.0 * (1.0 / 3.0 / f64::from(n)).sqrt();
            for x in 0..3 {
                assert!((mean[x] - AXIS[x] / 2.0).abs() < tolerance, "{mean:?}");
            }
            assert!((square - 1.0 / 3.0).abs() < tolerance, "{square}");
        }
    }

    #[test]
    fn each_stratum_has_one_direction() {
        for n in [1, 2, 7, 512] {
            let directions = stratified(1, 2, [0.0, 0.0, 1.0], n);
            assert_eq!(directions.len(), n as usize);
            let mut heights: Vec<_> = directions.iter().map(|d| d[2]).collect();
            heights.sort_by(f64::total_cmp);
            let mean = heights.iter().sum::<f64>() / f64::from(n);
            // A ring is as high as its sectors are many, and the rings' means are within it.
            let ring = (f64::from(n) / 2.0).sqrt().floor().max(1.0).recip();
            assert!((mean - 0.5).abs() < ring, "{n}: {mean}");
        }
    }
}
