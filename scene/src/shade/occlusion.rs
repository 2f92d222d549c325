//! Mode `occlusion`: the solid angles of the grids (RR-5779, section 4).

use super::casters::GridShading;
use super::{Mode, lookups, raster};

pub(super) static MODE: Mode = Mode {
    name: "occlusion",
    summary: "The occluders' grids without regard to normals, multiplied",
    needs_light: false,
    on_cpu: |input| lookups::shade(input, GridShading::Occlusion),
    on_gpu: Some(|input, gpu| raster::shade(input, gpu, GridShading::Occlusion)),
};
