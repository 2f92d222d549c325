//! Mode `environment-merge`: light less what merged cones hide (RR-5779, 5.3).

use super::casters::GridShading;
use super::{Mode, light, raster};

pub(super) static MODE: Mode = Mode {
    name: "environment-merge",
    summary: "The same with the cones merged",
    needs_light: true,
    on_cpu: |input| light::shade(input, GridShading::Merge),
    on_gpu: Some(|input, gpu| raster::environment::shade(input, gpu, GridShading::Merge)),
};
