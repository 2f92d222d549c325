//! Mode `environment`: light less what the grids' cones hide (RR-5779, 5.3).

use super::casters::GridShading;
use super::{Mode, light, raster};

pub(super) static MODE: Mode = Mode {
    name: "environment",
    summary: "Cones multiplied, and light from the environment except from their directions",
    needs_light: true,
    on_cpu: |input| light::shade(input, GridShading::Cone),
    on_gpu: Some(|input, gpu| raster::environment::shade(input, gpu, GridShading::Cone)),
};
