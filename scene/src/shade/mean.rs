//! Mode `mean`: the mean of the grids' clipped cones merged and multiplied.

use super::casters::GridShading;
use super::{Mode, lookups, raster};

pub(super) const MODE: Mode = Mode {
    name: "mean",
    summary: "The mean of the cones merged and multiplied, in the scene's order",
    needs_light: false,
    on_cpu: |input| lookups::shade(input, GridShading::Mean),
    on_gpu: Some(|input, gpu| raster::shade(input, gpu, GridShading::Mean)),
};
