//! The points to shade, and the result of shading.

use crate::reference::Receiver;
use crate::{GBuffer, ReceiverList};

/// The points to shade: those of a list, or those that a picture's pixels see.
pub struct Target {
    /// The points with normals, lifted off their surfaces so that rays may start there.
    pub receivers: Vec<Receiver>,
    /// Id of the instance that each point lies on; 0 if unknown.
    pub ids: Vec<u32>,
    /// The G-buffer of a picture and the pixel of each receiver; `None` for a list.
    pub picture: Option<(GBuffer, Vec<usize>)>,
}

/// The result of a mode, with an entry for each receiver.
pub struct Shaded {
    /// AO: 0 open, 1 fully occluded.
    pub occlusion: Vec<f32>,
    /// Standard errors of AO, if the mode estimates them.
    pub occlusion_error: Option<Vec<f32>>,
    /// Radiance that a white surface reflects, if the scene is lit.
    pub light: Option<Vec<[f32; 3]>>,
    /// Standard errors of the light, if the mode estimates them.
    pub light_error: Option<Vec<[f32; 3]>>,
}

impl Target {
    /// Returns the points of a list.
    pub fn of_list(list: &ReceiverList) -> Self {
        Self {
            receivers: list.lifted(),
            ids: vec![list.object.unwrap_or(0); list.points.len()],
            picture: None,
        }
    }

    /// Returns the points that a picture's pixels see.
    pub fn of_picture(gbuffer: GBuffer) -> Self {
        let (pixels, receivers): (Vec<_>, Vec<_>) = gbuffer.receivers().into_iter().unzip();
        Self {
            receivers,
            ids: pixels.iter().map(|&pixel| gbuffer.ids[pixel]).collect(),
            picture: Some((gbuffer, pixels)),
        }
    }
}
