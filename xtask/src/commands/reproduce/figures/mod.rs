//! The figures and tables of the papers.

mod bakes;
mod costs;
mod others;
mod shading;
mod suite;

use super::finding::{Finding, Results};
use super::steps::Step;

/// A figure or table of a paper.
pub(super) struct Figure {
    /// The name in file names and links.
    pub(super) id: &'static str,
    /// The paper and the number in it.
    pub(super) source: &'static str,
    pub(super) title: &'static str,
    /// The paper's claim, in our words.
    pub(super) claim: &'static str,
    pub(super) steps: Vec<Step>,
    /// Judges the claim by the outputs of the steps.
    pub(super) judge: fn(&Results) -> anyhow::Result<Finding>,
}

/// Returns all figures. Truth is traced to the standard error `error`; `adapter` is the GPU that is
/// measured, if there is one.
pub(super) fn all(error: f64, adapter: Option<&str>) -> Vec<Figure> {
    let mut figures = bakes::figures(adapter);
    figures.extend(shading::figures(error));
    figures.extend(costs::figures());
    figures.extend(others::figures(error));
    figures.extend(suite::figures());
    figures
}
