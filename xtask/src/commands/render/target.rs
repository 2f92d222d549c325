//! What is shaded, and what comes out of shading.

use aogrid_baker_cpu::truth::Receiver;

use crate::scene::{GBuffer, ReceiverList};

/// Points to shade: those of a list, or what a picture's pixels see.
pub(crate) struct Target {
    /// Where rays may start.
    pub receivers: Vec<Receiver>,
    /// The instance that each lies on; 0 if none is known.
    pub ids: Vec<u32>,
    /// For a picture: what the camera sees, and the pixel of each receiver.
    pub picture: Option<(GBuffer, Vec<usize>)>,
}

/// What a mode makes of a target: an entry a receiver.
pub(crate) struct Shaded {
    /// AO: 0 open, 1 hidden.
    pub occlusion: Vec<f32>,
    /// Standard errors of it, where the mode has them.
    pub occlusion_error: Option<Vec<f32>>,
    /// What a white surface reflects, where the scene is lit.
    pub light: Option<Vec<[f32; 3]>>,
    /// Standard errors of it, where the mode has them.
    pub light_error: Option<Vec<[f32; 3]>>,
}

impl Target {
    pub(super) fn of_list(list: &ReceiverList) -> Self {
        Self {
            receivers: list.lifted(),
            ids: vec![list.object.unwrap_or(0); list.points.len()],
            picture: None,
        }
    }

    pub(super) fn of_picture(gbuffer: GBuffer) -> Self {
        let (pixels, receivers): (Vec<_>, Vec<_>) = gbuffer.receivers().into_iter().unzip();
        Self {
            receivers,
            ids: pixels.iter().map(|&pixel| gbuffer.ids[pixel]).collect(),
            picture: Some((gbuffer, pixels)),
        }
    }
}
