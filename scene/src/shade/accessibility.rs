//! Mode `accessibility`: what each object's surface bake says of itself (GPU Gems, chapter 17).

use super::light::with_light;
use super::own_surface::own_surfaces;
use super::{Mode, ShadeInput, Shaded};
use crate::error::Result;

pub(super) static MODE: Mode = Mode {
    name: "accessibility",
    summary: "Each object's own surface bake, without its neighbors",
    needs_light: false,
    on_cpu: shade,
    on_gpu: None,
};

fn shade(input: &ShadeInput<'_>) -> Result<Shaded> {
    let own = own_surfaces(input)?;
    with_light(
        input,
        own.iter().map(|own| 1.0 - own.accessibility).collect(),
    )
}
