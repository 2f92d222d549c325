//! Mean radiance over cones, by integration.
//!
//! A cone of half-angle α about an axis at colatitude θ₀ and azimuth φ₀ contains, on the parallel
//! at colatitude θ, the azimuths within φ(θ) = acos((cos α − cos θ cos θ₀)/(sin θ sin θ₀)) of φ₀. A
//! direction there has the cosine cos θ cos θ₀ + sin θ sin θ₀ cos(φ − φ₀) to the axis. Along a
//! parallel the map is a step function, and its integrals are differences of prefix sums: exact, at
//! the same cost for every cone. Only the integral over θ is a quadrature, by the midpoint rule.
//! The same rule sums the weights, so that a constant sky stays constant.

use std::f64::consts::{PI, TAU};
use std::thread;

use glam::DVec3;

use super::source::{Azimuth, Row, SourceImage};

/// The minimum number of slices of a cone from its axis to its rim.
const MIN_SLICES: f64 = 24.0;

/// The value of sin θ sin θ₀ below which a parallel lies completely inside or outside the cone.
const POLE_EPSILON: f64 = 1e-12;

/// The contribution of a parallel to the means of all cones in a row of a level.
struct Slice<'a> {
    row: &'a Row,
    /// Half of the range of azimuths inside the cone: in turns, its sine and cosine.
    half: Azimuth,
    /// The weights of the integrals of L and of L cos(φ − φ₀).
    weights: [f64; 2],
}

/// The mean radiance over cones of the fraction `a`, weighted by the cosine to their axes, for
/// columns at (i + ½)/width of a turn and rows from pole to pole.
pub(super) fn cones(source: &SourceImage, [width, height]: [usize; 2], a: f32) -> Vec<[f32; 3]> {
    let cos_alpha = 1.0 - 2.0 * f64::from(a);
    compute_rows(height, |row| {
        let colatitude = PI * row as f64 / (height - 1) as f64;
        let (slices, total) = slices(source, colatitude, cos_alpha);
        let column = |column: usize| {
            let azimuth = Azimuth::new((column as f64 + 0.5) / width as f64);
            let sum: DVec3 = slices.iter().map(|slice| slice.sum(azimuth)).sum();
            (sum / total).max(DVec3::ZERO).as_vec3().to_array()
        };
        (0..width).map(column).collect()
    })
}

/// The parallels of cones about axes at a colatitude, and the sum of all weights.
fn slices(source: &SourceImage, colatitude: f64, cos_alpha: f64) -> (Vec<Slice<'_>>, f64) {
    let alpha = cos_alpha.acos();
    let cone = [(colatitude - alpha).max(0.0), (colatitude + alpha).min(PI)];
    let (mut slices, mut total) = (vec![], 0.0);
    for (row, [top, bottom]) in source.rows() {
        let (from, to) = (top.max(cone[0]), bottom.min(cone[1]));
        if to <= from {
            continue;
        }
        // A slice never crosses a row of the map, whose radiance is a step function.
        let count = ((to - from) / alpha * MIN_SLICES).ceil().max(1.0);
        let step = (to - from) / count;
        for idx in 0..count as usize {
            let theta = from + (idx as f64 + 0.5) * step;
            let slice = Slice::new(row, [theta, colatitude], cos_alpha, step);
            total += slice.total_weight();
            slices.push(slice);
        }
    }
    (slices, total)
}

impl<'a> Slice<'a> {
    fn new(row: &'a Row, [theta, axis]: [f64; 2], cos_alpha: f64, step: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        let (sin_axis, cos_axis) = axis.sin_cos();
        // The cosine to the axis is along + across · cos(φ − φ₀).
        let (along, across) = (cos * cos_axis, sin * sin_axis);
        let half = match across > POLE_EPSILON {
            true => ((cos_alpha - along) / across).clamp(-1.0, 1.0).acos(),
            false if along >= cos_alpha => PI,
            false => 0.0,
        };
        Self {
            row,
            half: Azimuth::new(half / TAU),
            weights: [along * sin * step, across * sin * step],
        }
    }

    /// The weighted integral of 1.
    fn total_weight(&self) -> f64 {
        let [plain, with_cosine] = self.weights;
        2.0 * (plain * TAU * self.half.turns + with_cosine * self.half.sin)
    }

    /// The weighted integral of the radiance, for an axis at an azimuth.
    fn sum(&self, axis: Azimuth) -> DVec3 {
        let around = [axis.minus(self.half), axis.plus(self.half)];
        let [plain, cosine, sine] = self.row.integrals(around);
        self.weights[0] * plain + self.weights[1] * (axis.cos * cosine + axis.sin * sine)
    }
}

impl Azimuth {
    fn new(turns: f64) -> Self {
        let (sin, cos) = (TAU * turns).sin_cos();
        Self { turns, sin, cos }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            turns: self.turns + other.turns,
            sin: self.sin * other.cos + self.cos * other.sin,
            cos: self.cos * other.cos - self.sin * other.sin,
        }
    }

    fn minus(self, other: Self) -> Self {
        self.plus(Self {
            turns: -other.turns,
            sin: -other.sin,
            cos: other.cos,
        })
    }
}

/// Returns the number of threads to compute with.
#[cfg(feature = "native")]
fn thread_count() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
#[cfg(not(feature = "native"))]
fn thread_count() -> usize {
    1
}

/// Computes all rows on all processors and concatenates them.
fn compute_rows(count: usize, row: impl Fn(usize) -> Vec<[f32; 3]> + Sync) -> Vec<[f32; 3]> {
    let threads = thread_count();
    let mut rows = vec![vec![]; count];
    let rows_per_thread = count.div_ceil(threads);
    let fill = |first: usize, rows: &mut [Vec<[f32; 3]>]| {
        let numbered = (first..).zip(rows);
        numbered.for_each(|(idx, texels)| *texels = row(idx));
    };
    if threads == 1 {
        fill(0, &mut rows);
    } else {
        thread::scope(|scope| {
            for (part, rows) in rows.chunks_mut(rows_per_thread).enumerate() {
                let fill = &fill;
                scope.spawn(move || fill(part * rows_per_thread, rows));
            }
        });
    }
    rows.concat()
}
