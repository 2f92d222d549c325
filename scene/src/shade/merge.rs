//! Mode `merge`: the grids' clipped cones, merged (RR-5779, 5.2.2).

use super::casters::GridShading;
use super::{Mode, lookups, raster};

pub(super) static MODE: Mode = Mode {
    name: "merge",
    summary: "The same cones merged, one after the other in the scene's order",
    needs_light: false,
    on_cpu: |input| lookups::shade(input, GridShading::Merge),
    on_gpu: Some(|input, gpu| raster::shade(input, gpu, GridShading::Merge)),
};
