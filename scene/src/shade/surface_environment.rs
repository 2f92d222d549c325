//! Mode `surface-environment`: light around the bent normals of each object's surface bake (GPU Gems,
//! chapter 17), except from the directions of its neighbors' cones.

use super::casters::GridShading;
use super::{Mode, light};

pub(super) static MODE: Mode = Mode {
    name: "surface-environment",
    summary: "Light around the bent normals of each object's surface bake, less its neighbors' cones",
    needs_light: true,
    on_cpu: |input| light::shade(input, GridShading::Neighbors),
    on_gpu: None,
};
