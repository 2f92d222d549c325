//! Mode `surface-cone`: each object's surface bake for itself, and the grids of its neighbors.

use super::casters::{GridShading, any_mesh};
use super::light::with_light;
use super::own_surface::own_surfaces;
use super::{Mode, ShadeInput, Shaded, lookups, raster};
use crate::error::Result;

pub(super) static MODE: Mode = Mode {
    name: "surface-cone",
    summary: "Each object's own surface bake, times its neighbors' grids as in mode cone",
    needs_light: false,
    on_cpu: |input| {
        shade(
            input,
            lookups::occlusion(input, GridShading::Neighbors, any_mesh)?,
        )
    },
    on_gpu: Some(|input, gpu| {
        shade(
            input,
            raster::occlusion(input, gpu, GridShading::Neighbors, any_mesh)?,
        )
    }),
};

fn shade(input: &ShadeInput<'_>, neighbors: Vec<f32>) -> Result<Shaded> {
    let own = own_surfaces(input)?;
    let pairs = own.iter().zip(neighbors);
    let occlusion = pairs.map(|(own, neighbors)| 1.0 - own.accessibility * (1.0 - neighbors));
    with_light(input, occlusion.collect())
}
