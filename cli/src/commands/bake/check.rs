//! The error of a fresh grid against ray tracing.

use std::sync::Arc;

use aogrid_bake_core::TriangleMesh;
use aogrid_grid_format::{AreaError, Check, Grid, Source};
use aogrid_scene::shade::Mode;
use aogrid_scene::suite::{Area, ErrorStats, Subject, SuiteOptions, Truth, judge_grid};

use crate::console::Console;

/// Receivers an area and rays a receiver: their noise is a twentieth of the errors measured, and
/// they take a second or two.
const OPTIONS: SuiteOptions = SuiteOptions {
    receivers: 240,
    samples: 1024,
    seed: 0,
};

/// The rays of a check, of six areas.
pub(super) const RAYS: f64 = 6.0 * OPTIONS.receivers as f64 * OPTIONS.samples as f64;

/// The receivers around a mesh with their truth, for the check of any number of grids.
pub(super) struct Checker {
    subject: Subject,
    truth: Arc<Truth>,
}

impl Checker {
    /// Traces the truth around `mesh`.
    pub(super) fn new(
        title: &str,
        mesh: &TriangleMesh,
        source: &Source,
        console: &Console,
    ) -> anyhow::Result<Self> {
        let subject = Subject::new(title, mesh.clone(), source.clone());
        let truth = Truth::trace(&subject, &OPTIONS, &|stage| console.stage(stage))?;
        let truth = Arc::new(truth);
        Ok(Self { subject, truth })
    }

    /// Measures the error of a grid by its cones, or by occlusion alone if it has none.
    pub(super) fn check(&self, grid: &Grid) -> anyhow::Result<Check> {
        let name = match grid.encoding().has_direction() {
            true => "cone",
            false => "occlusion",
        };
        let mode = Mode::named(name).expect("the mode exists");
        let stats = judge_grid(&self.subject, &self.truth, mode, grid.clone())?;
        let area = |area: Area| {
            stats[area as usize].map(
                |ErrorStats {
                     receivers,
                     rmse,
                     p95,
                     ..
                 }| AreaError {
                    receivers: receivers as u32,
                    rmse: rmse as f32,
                    p95: p95 as f32,
                },
            )
        };
        Ok(Check {
            rays: OPTIONS.samples,
            near: area(Area::Near),
            tilted: area(Area::Tilted),
            any_way: area(Area::AnyWay),
            rest: area(Area::Rest),
            beyond: area(Area::Beyond),
            itself: area(Area::Itself),
        })
    }
}

/// Returns the error that `--max-error` bounds: the larger RMSE of the planes that touch the model.
pub(super) fn contact_error(check: &Check) -> f32 {
    let areas = [check.near, check.tilted].into_iter().flatten();
    areas.map(|area| area.rmse).fold(0.0, f32::max)
}
