//! The values of a point, and the sums that they come from.

use super::SurfacePoint;
use super::vector::{dot, normalized, plus};

/// The weights of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// The cosine to the axis: accessibility is 1 − AO, what a diffuse surface receives of a constant
    /// sky.
    Cosine,
    /// All alike, as printed in the chapter: accessibility is the share of the hemisphere.
    Uniform,
}

impl Weights {
    /// All choices.
    pub const ALL: [Self; 2] = [Self::Cosine, Self::Uniform];

    /// Returns the name that commands and files use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cosine => "cosine",
            Self::Uniform => "uniform",
        }
    }

    /// Returns the choice with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|weights| weights.name() == name)
    }

    fn of(self, cosine: f64) -> f64 {
        match self {
            Self::Cosine => cosine,
            Self::Uniform => 1.0,
        }
    }

    /// Returns the length of the weighted mean of all directions of a hemisphere: ∫cos²/∫cos = ⅔, or
    /// ∫cos/∫1 = ½.
    fn mean_length(self) -> f64 {
        match self {
            Self::Cosine => 2.0 / 3.0,
            Self::Uniform => 0.5,
        }
    }
}

/// The result of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceRecord {
    /// The weighted share of the hemisphere that is open: 1 is open, 0 is buried.
    pub accessibility: f32,
    /// The direction of the weighted mean of the open directions, of length 1; the axis where nothing
    /// or everything is occluded.
    pub bent_normal: [f32; 3],
}

impl SurfaceRecord {
    /// Returns the record of a point that nothing occludes.
    pub fn open(axis: [f64; 3]) -> Self {
        Self {
            accessibility: 1.0,
            bent_normal: axis.map(|v| v as f32),
        }
    }

    /// Whether no direction is open.
    pub fn is_buried(&self) -> bool {
        self.accessibility == 0.0
    }
}

/// The sums over the directions of a point.
#[derive(Clone, Copy, Debug, Default)]
pub struct Accumulator {
    /// The weights of the directions that count, and of those of them that are open.
    counted: f64,
    open: f64,
    /// The open directions by their weights.
    open_sum: [f64; 3],
    /// The weights of all directions along the axis, and the directions by them.
    all: f64,
    all_sum: [f64; 3],
    n_counted: u32,
    n_open: u32,
    n_all: u32,
}

impl Accumulator {
    /// Adds a direction or, if that is the one along the axis, its opposite. `is_occluded` is ignored
    /// where [`SurfacePoint::side`] is 0.
    #[inline]
    pub fn add(
        &mut self,
        point: &SurfacePoint,
        direction: [f64; 3],
        weights: Weights,
        is_occluded: bool,
    ) {
        let along = dot(point.axis, direction);
        if along == 0.0 {
            return;
        }
        let cosine = along.abs();
        let weight = weights.of(cosine);
        let signed = weight * along.signum();
        self.all += weight;
        self.all_sum = plus(self.all_sum, signed, direction);
        self.n_all += 1;
        if point.side(direction) == 0 {
            return;
        }
        self.counted += weight;
        self.n_counted += 1;
        if !is_occluded {
            self.open += weight;
            self.open_sum = plus(self.open_sum, signed, direction);
            self.n_open += 1;
        }
    }

    /// Returns the number of rays that counted.
    pub fn rays(&self) -> u32 {
        self.n_counted
    }

    /// Returns the record of a point with this axis.
    ///
    /// The mean of all directions of a set is not exactly along the axis. That error is known, and the
    /// open share of it is subtracted from the sum of the open directions: their errors are about
    /// proportional to their number. On an open surface the bent normal is then the normal.
    pub fn finish(&self, axis: [f64; 3], weights: Weights) -> SurfaceRecord {
        if self.n_open == self.n_counted && self.n_counted == self.n_all {
            return SurfaceRecord::open(axis);
        }
        if self.n_open == 0 {
            // Without a direction that counts nothing is known to occlude the point.
            let accessibility = if self.n_counted == 0 { 1.0 } else { 0.0 };
            return SurfaceRecord {
                accessibility,
                ..SurfaceRecord::open(axis)
            };
        }
        let share = self.open / self.counted;
        let error = plus(self.all_sum, -weights.mean_length() * self.all, axis);
        let sum = plus(self.open_sum, -share, error);
        SurfaceRecord {
            accessibility: share as f32,
            bent_normal: normalized(sum).unwrap_or(axis).map(|v| v as f32),
        }
    }
}
