//! Mode `cone`: the grids' cones, clipped by the receiver's plane (RR-5779, 5.1).

use super::casters::GridShading;
use super::{Mode, lookups, raster};

pub(super) static MODE: Mode = Mode {
    name: "cone",
    summary: "The occluders' grids as cones clipped by the receiver's plane, multiplied",
    needs_light: false,
    on_cpu: |input| lookups::shade(input, GridShading::Cone),
    on_gpu: Some(|input, gpu| raster::shade(input, gpu, GridShading::Cone)),
};
