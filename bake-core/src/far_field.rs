//! The object's flatness, which tells how its occlusion falls beyond the grid's box.
//!
//! # Theory
//!
//! Renderers continue a grid along rays from its center. Let k = sin²α be that of the sphere which
//! covers the occluded fraction a: k = 4 a (1 − a). A sphere at a distance s has k ∝ 1/s². A disc that
//! faces the receiver has tan²α ∝ 1/s², that is 1/k − 1 ∝ s². Both are
//!
//! 1/k(s) = (1/k(1) − w) s² + w
//!
//! with a flatness w of 0 and 1. A disc's rim is seen from nearer than its center, so that k falls
//! faster than a sphere's: w is negative there. The flatness in the direction h on the hull of the
//! outer cells' centers, which is [−1,1]³, is taken to be Σ wᵢ hᵢ² + w₃, and the four numbers are fitted
//! to a coarse lattice of points around the box.

use aogrid_grid_format::{
    BoundaryMode, Encoding, FLATNESSES, GridSpec, Interior, MAX_FLATNESS, Sampling, SpecError,
};

use glam::{DMat4, DVec4};

use crate::{BakeOptions, RawGrid};

/// The points of the lattice along each axis. 8 are enough for most objects; 16 gain nothing.
const POINTS: u32 = 12;

/// The extent of the lattice, relative to the grid's box. The law holds for any distance, so that it
/// may be fitted near the box, where much is occluded; further away the error rises less than 3 %.
const REACH: f32 = 2.0;

/// The face size of the lattice's points. Their errors average out over the points.
const FACE_SIZE: u32 = 8;

/// The points' distance from the center below which they are left out, in half-extents of the hull:
/// they would tell nothing about the law.
const MIN_DISTANCE: f64 = 1.05;

/// The steps of the Levenberg-Marquardt iteration, which converges in three to eight.
const MAX_STEPS: usize = 12;

/// The unit to which a flatness is rounded, so that bakes by different devices mostly agree. A change
/// of this size changes AO by less than 1e-4.
const UNIT: f64 = 1e-3;

/// Whether renderers continue a grid with these options beyond its box by default, for which the
/// bake looks at a few points around it.
pub fn has_far_field(options: &BakeOptions) -> bool {
    options.encoding == Encoding::Moment
        && options.boundary == BoundaryMode::None
        && options.max_distance.is_none()
}

/// Returns the lattice around the box of the grid `spec`, as a grid whose cells' centers are its
/// points.
///
/// # Errors
///
/// Its box is too large for single floats.
pub(crate) fn lattice(spec: &GridSpec) -> Result<GridSpec, SpecError> {
    GridSpec::new(
        [POINTS; 3],
        spec.center(),
        spec.half_extents().map(|e| REACH * e),
    )
}

/// Returns the options with which the points of the lattice are baked: the fractions alone.
pub(crate) fn point_options(options: &BakeOptions) -> BakeOptions {
    BakeOptions {
        sampling: Sampling::CubeFaces { size: FACE_SIZE },
        encoding: Encoding::Occlusion,
        interior: Interior::Keep,
        fit: false,
        ..*options
    }
}

/// Returns the flatness of the object with grid `raw` (see [`BakeRecord::flatness`]) from the fractions
/// at the `points` of the lattice. Zero where no flatness is better than that of a sphere.
///
/// [`BakeRecord::flatness`]: aogrid_grid_format::BakeRecord::flatness
pub(crate) fn flatness(raw: &RawGrid, points: &RawGrid) -> [f32; 4] {
    let points = samples(raw, points);
    let (mut flatness, mut damping) = ([0.0; 4], 1e-2);
    let mut normal = NormalEquations::at(flatness, &points);
    for _ in 0..MAX_STEPS {
        let step = normal.step(damping);
        let next = [0, 1, 2, 3].map(|x| bounded(flatness[x] + step[x]));
        let there = NormalEquations::at(next, &points);
        if there.error < normal.error {
            (flatness, normal, damping) = (next, there, damping / 3.0);
        } else {
            damping *= 5.0;
        }
    }
    flatness.map(|w| (UNIT * (w / UNIT).round()) as f32)
}

fn bounded(w: f64) -> f64 {
    w.clamp(f64::from(*FLATNESSES.start()), f64::from(*FLATNESSES.end()))
}

/// A point of the lattice beyond the hull.
struct Sample {
    /// 1/s², where s is its distance in half-extents of the hull.
    remainder: f64,
    /// hᵢ² of the point of the hull on the ray from the center, and 1.
    squares: [f64; 4],
    /// k at that point.
    at_hull: f64,
    /// The exact fraction.
    a: f64,
}

impl Sample {
    /// Returns the fraction by the law, and its derivative by the flatness in this direction.
    fn continued(&self, flatness: [f64; 4]) -> [f64; 2] {
        let w: f64 = (0..4).map(|x| self.squares[x] * flatness[x]).sum();
        let flat = w * self.at_hull;
        let bounded = flat.min(f64::from(MAX_FLATNESS));
        let lost = 1.0 - self.remainder;
        let divisor = 1.0 - bounded * lost;
        let k = self.at_hull * self.remainder / divisor;
        let cosine = (1.0 - k).max(0.0).sqrt();
        let slope = match flat < f64::from(MAX_FLATNESS) {
            true => k * self.at_hull * lost / divisor,
            false => 0.0,
        };
        [0.5 * (1.0 - cosine), 0.25 * slope / cosine.max(1e-3)]
    }
}

/// Returns the points of the lattice beyond the hull of the cells' centers.
fn samples(raw: &RawGrid, points: &RawGrid) -> Vec<Sample> {
    let n = raw.spec.resolution();
    // Half-extents of the hull in steps of the lattice.
    let half = [0, 1, 2].map(|x| {
        let cells = f64::from(n[x]);
        (cells - 1.0) / cells * f64::from(POINTS) / (2.0 * f64::from(REACH))
    });
    let mut samples = Vec::new();
    for (idx, moments) in points.moments.iter().enumerate() {
        let cell = points.spec.cell_at(idx);
        let p = [0, 1, 2].map(|x| (f64::from(cell[x]) + 0.5 - 0.5 * f64::from(POINTS)) / half[x]);
        let distance = p.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
        if distance < MIN_DISTANCE {
            continue;
        }
        let [x, y, z] = p.map(|v| v / distance);
        let a = interpolated(raw, [x, y, z]).min(0.5);
        samples.push(Sample {
            remainder: distance.powi(-2),
            squares: [x * x, y * y, z * z, 1.0],
            at_hull: 4.0 * a * (1.0 - a),
            a: f64::from(moments.a),
        });
    }
    samples
}

/// Returns a at a point of the hull, [−1,1]³, as a linear filter does.
fn interpolated(raw: &RawGrid, point: [f64; 3]) -> f64 {
    let axes = [0, 1, 2].map(|x| {
        let last = raw.spec.resolution()[x] - 1;
        let at = 0.5 * (point[x] + 1.0) * f64::from(last);
        let low = (at.floor().max(0.0) as u32).min(last - 1);
        (low, at - f64::from(low))
    });
    let mut sum = 0.0;
    for corner in 0..8_u32 {
        let mut weight = 1.0;
        let cell = [0, 1, 2].map(|x| {
            let (low, share) = axes[x];
            let is_high = corner >> x & 1;
            weight *= if is_high == 1 { share } else { 1.0 - share };
            low + is_high
        });
        sum += weight * f64::from(raw.moments[raw.spec.cell_idx(cell)].a);
    }
    sum
}

/// The least-squares problem around a flatness: points weigh like the area of a plane seen from the
/// center, 1/s².
struct NormalEquations {
    matrix: DMat4,
    right: DVec4,
    error: f64,
}

impl NormalEquations {
    fn at(flatness: [f64; 4], points: &[Sample]) -> Self {
        let mut sums = Self {
            matrix: DMat4::ZERO,
            right: DVec4::ZERO,
            error: 0.0,
        };
        for point in points {
            let [a, slope] = point.continued(flatness);
            let (weight, missing) = (point.remainder, point.a - a);
            let slopes = slope * DVec4::from(point.squares);
            let weighted = weight * slopes;
            let columns = slopes.to_array().map(|slope| (slope * weighted).to_array());
            sums.matrix += DMat4::from_cols_array_2d(&columns);
            sums.right += missing * weighted;
            sums.error += weight * missing * missing;
        }
        sums
    }

    /// Returns the step to the minimum, damped in each number by a share of its own curvature.
    fn step(&self, damping: f64) -> [f64; 4] {
        let diagonal = DVec4::from([0, 1, 2, 3].map(|x| self.matrix.col(x)[x]));
        // A number that no point depends on keeps its value.
        let floor = 1e-9 * diagonal.max_element() + f64::MIN_POSITIVE;
        let matrix = self.matrix + DMat4::from_diagonal(damping * diagonal + floor);
        let step = matrix.inverse() * self.right;
        match step.is_finite() {
            true => step.to_array(),
            false => [0.0; 4],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Moments;

    /// The rounding of fractions to single precision, several times.
    const TOLERANCE: f64 = 1e-6;

    /// Returns a grid with these fractions by the distance s and the point of the hull.
    fn grid(spec: GridSpec, hull: [f64; 3], a: impl Fn([f64; 3]) -> f64) -> RawGrid {
        let moments = (0..spec.cell_count()).map(|idx| {
            let p = spec.sample_from_center(spec.cell_at(idx), [0.0; 3]);
            let a = a([0, 1, 2].map(|x| p[x] / hull[x])) as f32;
            Moments { a, m: [0.0; 3] }
        });
        RawGrid {
            spec,
            moments: moments.collect(),
            counts: vec![0; spec.cell_count()],
            directions: 384,
            layers: None,
        }
    }

    /// Returns the flatness that is fitted to an object whose fractions are `a` of the position in
    /// half-extents of the hull.
    fn fitted(a: impl Fn([f64; 3]) -> f64) -> [f32; 4] {
        let spec = GridSpec::new([32; 3], [1.0, 2.0, 3.0], [1.0, 2.0, 0.5]).unwrap();
        let hull = spec.half_extents().map(|e| f64::from(e) * 31.0 / 32.0);
        let lattice = lattice(&spec).unwrap();
        flatness(&grid(spec, hull, &a), &grid(lattice, hull, &a))
    }

    fn fraction(k: f64) -> f64 {
        0.5 * (1.0 - (1.0 - k).sqrt())
    }

    #[test]
    fn a_sphere_is_not_flat() {
        // sin²α = r²/s², in a space where the hull is a cube.
        let k = |p: [f64; 3]| 0.3 / p.iter().map(|v| v * v).sum::<f64>();
        let fitted = fitted(|p| fraction(k(p)));
        assert!(fitted.iter().all(|w| w.abs() <= 0.02), "{fitted:?}");
    }

    #[test]
    fn the_flatness_of_the_law_is_found() {
        for truth in [
            [-1.5, 1.0, -2.0, 0.0],
            [0.0, 0.5, 1.0, -0.5],
            [-8.0, 1.0, 0.5, 0.5],
        ] {
            let fitted = fitted(|p| {
                let s = p.iter().fold(0.0_f64, |s, v| s.max(v.abs())).max(0.2);
                let w: f64 = (0..3).map(|x| (p[x] / s).powi(2) * truth[x]).sum();
                let w = w + truth[3];
                let at_hull = 0.4;
                fraction(1.0 / ((1.0 / at_hull - w) * s * s + w))
            });
            for (w, truth) in fitted.into_iter().zip(truth) {
                let close = (f64::from(w) - truth).abs() <= 0.05 * (1.0 + truth.abs());
                assert!(close, "{fitted:?} {truth}");
            }
        }
    }

    #[test]
    fn the_slope_is_that_of_the_law() {
        let point = Sample {
            remainder: 0.4,
            squares: [1.0, 0.3, 0.1, 1.0],
            at_hull: 0.7,
            a: 0.0,
        };
        for w in [-3.0, 0.0, 0.9, 1.5] {
            let at = |w: f64| point.continued([w, 0.0, 0.0, 0.0]);
            let step = 1e-6;
            let slope = (at(w + step)[0] - at(w - step)[0]) / (2.0 * step);
            assert!((slope - at(w)[1]).abs() < 1e-8, "{w}: {slope} {}", at(w)[1]);
        }
    }

    #[test]
    fn an_object_that_hides_nothing_stays_a_sphere() {
        assert_eq!(fitted(|_| 0.0), [0.0; 4]);
    }

    #[test]
    fn values_on_the_hull_are_those_of_a_linear_filter() {
        let spec = GridSpec::new([8, 9, 10], [0.0; 3], [1.0; 3]).unwrap();
        let hull = [7.0 / 8.0, 8.0 / 9.0, 9.0 / 10.0];
        let raw = grid(spec, hull, |[x, y, z]| 0.5 + 0.1 * x - 0.05 * y + 0.2 * z);
        for [x, y, z] in [[1.0, 0.3, -0.2], [-1.0, 1.0, 1.0], [0.15, -1.0, 0.9]] {
            let expected = 0.5 + 0.1 * x - 0.05 * y + 0.2 * z;
            let difference = interpolated(&raw, [x, y, z]) - expected;
            assert!(difference.abs() <= TOLERANCE, "{difference}");
        }
    }
}
