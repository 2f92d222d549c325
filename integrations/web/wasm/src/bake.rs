//! Baking one model with what a page lets people choose.

use std::ops::ControlFlow;

use aogrid_bake_core::{Extent, Preset, mesh_warnings};
use aogrid_baker_cpu::{BakeError, Baker};
use aogrid_grid_format::{Encoding, Source, TexelFormat};

use crate::model::{Model, with_sources};

/// The settings of a bake: a preset, and what differs from it.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// The preset.
    pub preset: Preset,
    /// Cells along each axis.
    pub resolution: Option<[u32; 3]>,
    /// ε of RR-5779 eq. 4.
    pub epsilon: Option<f32>,
    /// The quantities that a texel holds.
    pub encoding: Option<Encoding>,
    /// The storage format of a channel.
    pub format: TexelFormat,
}

/// Bakes a model and returns the bytes of its grid file and notes, a sentence each. `progress` is called
/// with the finished share, 0..1.
///
/// # Errors
///
/// A sentence that says why the model cannot be baked.
pub fn bake(
    model: &Model,
    settings: &Settings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<(Vec<u8>, Vec<String>), String> {
    let mut placement = settings.preset.placement();
    let mut options = settings.preset.options();
    placement.resolution = settings.resolution.unwrap_or(placement.resolution);
    if let Some(epsilon) = settings.epsilon {
        placement.extent = Extent::Epsilon(epsilon);
    }
    options.encoding = settings.encoding.unwrap_or(options.encoding);
    options.format = settings.format;
    // The fit is of moments alone.
    options.fit &= options.encoding == Encoding::Moment;
    let mesh = &model.loaded.mesh;
    let mut baker = Baker::new(None);
    let mut stage = 0;
    let grid = aogrid_bake_core::bake_grid(
        mesh,
        &placement,
        &options,
        Source::from(&model.loaded),
        |spec, options| {
            let from = STAGES[stage.min(STAGES.len() - 1)];
            let to = STAGES[(stage + 1).min(STAGES.len() - 1)];
            stage += 1;
            let report = |done: aogrid_bake_core::Progress| {
                let share = done.done as f32 / done.total.max(1) as f32;
                progress(from + (to - from) * share);
                ControlFlow::Continue(())
            };
            baker.prepare(mesh, spec, options)?.bake(&report)
        },
    );
    let grid = grid
        .map_err(|error: BakeError| format!("{}: {}", model.loaded.name, with_sources(&error)))?;
    progress(1.0);
    let mut notes = model.loaded.warnings.clone();
    notes.extend(mesh_warnings(mesh, grid.spec(), model.loaded.rounding));
    Ok((grid.to_bytes(), notes))
}

/// The shares of the time at which the grid, the finer lattice of the fit and the points of the far
/// field begin, and the end: their numbers of cells are about as 1 to 1.3 to 0.2.
const STAGES: [f32; 4] = [0.0, 0.4, 0.92, 1.0];
