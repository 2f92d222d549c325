//! Error measurements: integration, table nodes and look-ups against the closed forms.

use crate::clip::{self, Clip};
use crate::format::Format;
use crate::merge;
use crate::table::{ClipTable, MergeTable};
use std::f64::consts::PI;
use std::fmt;
use std::ops::RangeInclusive;

/// The largest and the root-mean-square error of one channel of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorRow {
    /// The table's name, `T_clip` or `T_merge`.
    pub table: &'static str,
    /// The channel's name: `AO`, `a'`, `f` or `(AO/2)d'` of `T_clip`, `union` of `T_merge`.
    /// `(AO/2)d'` is the vector that a merge adds up for this cone (d′ the clipped axis); its error
    /// is the length of the difference.
    pub channel: &'static str,
    /// The values that were compared with the closed form in f64.
    pub measured: Measured,
    /// Largest absolute error.
    pub max: f64,
    /// Arguments of the table at the largest error, in their order.
    pub at: Vec<f64>,
    /// Root mean square over the table's domain, uniform along its texture's axes.
    pub rms: f64,
}

/// The values that an [`ErrorRow`] compares with the closed form in f64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// The integration in f64, mostly between the nodes.
    Integration,
    /// The nodes, in a format or (`None`) in the f32 master.
    Nodes(Option<Format>),
    /// Look-ups between the nodes, in a format or (`None`) in the f32 master.
    LookUps(Option<Format>),
}

impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, format) = match self {
            Self::Integration => return f.write_str("integration"),
            Self::Nodes(format) => ("nodes", format),
            Self::LookUps(format) => ("look-ups", format),
        };
        match format {
            None => write!(f, "{what}, f32"),
            Some(Format::F16) => write!(f, "{what}, f16"),
            Some(Format::Unorm8) => write!(f, "{what}, unorm8"),
        }
    }
}

/// The domain of each table.
const CLIP_DOMAIN: [RangeInclusive<f64>; 2] = [0.0..=1.0, -1.0..=1.0];
const MERGE_DOMAIN: [RangeInclusive<f64>; 3] = [0.0..=1.0, 0.0..=1.0, 0.0..=PI];

/// Steps per axis at which the integration is measured. Primes, so that the points miss the nodes.
const CLIP_STEPS: usize = 101;
const MERGE_STEPS: usize = 23;

/// Steps per cell at which look-ups are measured. Even, so that the points include the middle of
/// the cell, where linear filtering errs most.
const CLIP_STEPS_PER_CELL: usize = 8;
const MERGE_STEPS_PER_CELL: usize = 4;

/// Measures the errors of both tables. Takes a few seconds.
pub fn error_report(clip: &ClipTable, merge: &MergeTable) -> Vec<ErrorRow> {
    let precisions = [None, Some(Format::F16), Some(Format::Unorm8)];
    let mut rows = clip_integration();
    rows.extend(
        precisions
            .iter()
            .flat_map(|&precision| clip_errors(clip, precision)),
    );
    rows.push(merge_integration());
    rows.extend(
        precisions
            .iter()
            .flat_map(|&precision| merge_errors(merge, precision)),
    );
    rows
}

fn clip_integration() -> Vec<ErrorRow> {
    clip_rows(Measured::Integration, [CLIP_STEPS; 2], |point| {
        let [a, cos_beta] = point.arguments;
        clip::integrate(a, cos_beta)
    })
}

fn merge_integration() -> ErrorRow {
    merge_row(Measured::Integration, [MERGE_STEPS; 3], |point| {
        let [a1, a2, gamma] = point.arguments;
        merge::integrate(a1, a2, gamma)
    })
}

fn clip_errors(master: &ClipTable, precision: Option<Format>) -> Vec<ErrorRow> {
    let table = precision.map_or_else(|| master.clone(), |format| master.quantized(format));
    let cells = table.size().map(|nodes| nodes - 1);
    let nodes = clip_rows(Measured::Nodes(precision), cells, |point| {
        let [x, y] = point.index;
        widen(table.node(x, y))
    });
    let steps = cells.map(|cells| CLIP_STEPS_PER_CELL * cells);
    let look_ups = clip_rows(Measured::LookUps(precision), steps, |point| {
        let [a, cos_beta] = point.arguments.map(|x| x as f32);
        widen(table.sample(a, cos_beta))
    });
    [nodes, look_ups].concat()
}

fn merge_errors(master: &MergeTable, precision: Option<Format>) -> [ErrorRow; 2] {
    let table = precision.map_or_else(|| master.clone(), |format| master.quantized(format));
    let cells = table.size().map(|nodes| nodes - 1);
    let nodes = merge_row(Measured::Nodes(precision), cells, |point| {
        let [x, y, z] = point.index;
        table.node(x, y, z).into()
    });
    let steps = cells.map(|cells| MERGE_STEPS_PER_CELL * cells);
    let look_ups = merge_row(Measured::LookUps(precision), steps, |point| {
        let [a1, a2, gamma] = point.arguments.map(|x| x as f32);
        table.sample(a1, a2, gamma).into()
    });
    [nodes, look_ups]
}

fn widen(clip: Clip<f32>) -> Clip<f64> {
    Clip::from_array(clip.to_array().map(f64::from))
}

/// Returns one row for each channel of `T_clip`.
fn clip_rows(
    measured: Measured,
    steps: [usize; 2],
    value: impl Fn(&Point<2>) -> Clip<f64>,
) -> Vec<ErrorRow> {
    let channel_errors = sweep(CLIP_DOMAIN, steps, |point| {
        let [a, cos_beta] = point.arguments;
        let (exact, value) = (clip::closed_form(a, cos_beta), value(point));
        let (exact_axis, axis) = (merged_axis(exact, cos_beta), merged_axis(value, cos_beta));
        [
            value.occlusion - exact.occlusion,
            value.fraction - exact.fraction,
            value.axis_weight - exact.axis_weight,
            f64::hypot(axis[0] - exact_axis[0], axis[1] - exact_axis[1]),
        ]
    });
    let channels = ["AO", "a'", "f", "(AO/2)d'"].into_iter();
    channels
        .zip(channel_errors)
        .map(|(channel, errors)| errors.row("T_clip", channel, measured))
        .collect()
}

/// Returns the row of `T_merge`.
fn merge_row(measured: Measured, steps: [usize; 3], value: impl Fn(&Point<3>) -> f64) -> ErrorRow {
    let [errors] = sweep(MERGE_DOMAIN, steps, |point| {
        let [a1, a2, gamma] = point.arguments;
        [value(point) - merge::closed_form(a1, a2, gamma)]
    });
    errors.row("T_merge", "union", measured)
}

/// Returns (AO/2) d′ in the plane of the cone's axis and the normal, as its components
/// perpendicular to the normal and along it.
fn merged_axis(clip: Clip<f64>, cos_beta: f64) -> [f64; 2] {
    let sin_beta = ((1.0 - cos_beta) * (1.0 + cos_beta)).sqrt();
    let f = clip.axis_weight;
    let axis = [f * sin_beta, f * cos_beta + 1.0 - f];
    let length = f64::hypot(axis[0], axis[1]);
    let scale = if length > 0.0 {
        0.5 * clip.occlusion / length
    } else {
        0.0
    };
    axis.map(|component| scale * component)
}

/// A point of a sweep: its indices, and the table's arguments there.
struct Point<const D: usize> {
    index: [usize; D],
    arguments: [f64; D],
}

/// The accumulated errors of one channel over a sweep.
#[derive(Clone, Copy)]
struct ErrorSums<const D: usize> {
    max: f64,
    at: [f64; D],
    sum_of_squares: f64,
    sum_of_weights: f64,
}

/// Measures errors at the points of a lattice that divides every axis into equal steps, both ends
/// included. Ends have half the weight (the trapezoidal rule), or the mean would overweight the
/// boundary.
fn sweep<const D: usize, const C: usize>(
    domain: [RangeInclusive<f64>; D],
    steps: [usize; D],
    errors: impl Fn(&Point<D>) -> [f64; C],
) -> [ErrorSums<D>; C] {
    let zero = ErrorSums {
        max: 0.0,
        at: [0.0; D],
        sum_of_squares: 0.0,
        sum_of_weights: 0.0,
    };
    let mut sums = [zero; C];
    for number in 0..steps.iter().map(|steps| steps + 1).product() {
        // The digits of the point's number in mixed radix are its indices, the first axis fastest.
        let mut rest = number;
        let index = steps.map(|steps| {
            let index = rest % (steps + 1);
            rest /= steps + 1;
            index
        });
        let arguments = std::array::from_fn(|axis| {
            let t = index[axis] as f64 / steps[axis] as f64;
            domain[axis].start() + t * (domain[axis].end() - domain[axis].start())
        });
        let ends = (0..D)
            .filter(|&axis| index[axis] == 0 || index[axis] == steps[axis])
            .count();
        let point = Point { index, arguments };
        for (sums, error) in sums.iter_mut().zip(errors(&point)) {
            sums.add(error.abs(), arguments, 0.5f64.powi(ends as i32));
        }
    }
    sums
}

impl<const D: usize> ErrorSums<D> {
    fn add(&mut self, error: f64, at: [f64; D], weight: f64) {
        if error > self.max {
            (self.max, self.at) = (error, at);
        }
        self.sum_of_squares += weight * error * error;
        self.sum_of_weights += weight;
    }

    fn row(&self, table: &'static str, channel: &'static str, measured: Measured) -> ErrorRow {
        let rms = (self.sum_of_squares / self.sum_of_weights).sqrt();
        ErrorRow {
            table,
            channel,
            measured,
            max: self.max,
            at: self.at.to_vec(),
            rms,
        }
    }
}
