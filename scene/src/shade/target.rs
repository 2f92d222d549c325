//! The points to shade, and the result of shading.

use glam::DVec3;

use crate::gbuffer::origin;
use crate::reference::Receiver;
use crate::{GBuffer, ReceiverList};

/// The points to shade: those of a list, or those that a picture's pixels see.
pub struct Target {
    /// The points with normals, lifted off their surfaces so that rays may start there.
    pub receivers: Vec<Receiver>,
    /// The point in world space that single floats are relative to; see [`GBuffer::origin`].
    pub origin: [f64; 3],
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
    /// Returns a receiver's position relative to the origin, and its normal, as shaders see them.
    pub(super) fn singles(&self, receiver: &Receiver) -> [[f32; 3]; 2] {
        let relative = DVec3::from(receiver.position) - DVec3::from(self.origin);
        [relative, receiver.normal.into()].map(|v| v.as_vec3().to_array())
    }

    /// Returns points as the target, with the id of the instance that each lies on; 0 if unknown.
    pub fn of_points(receivers: Vec<Receiver>, ids: Vec<u32>) -> Self {
        let points: Vec<DVec3> = receivers.iter().map(|r| r.position.into()).collect();
        Self {
            origin: origin(&points).to_array(),
            receivers,
            ids,
            picture: None,
        }
    }

    /// Returns the points of a list.
    pub fn of_list(list: &ReceiverList) -> Self {
        let ids = vec![list.object.unwrap_or(0); list.points.len()];
        Self::of_points(list.lifted(), ids)
    }

    /// Returns the points that a picture's pixels see.
    pub fn of_picture(gbuffer: GBuffer) -> Self {
        let (pixels, receivers): (Vec<_>, Vec<_>) = gbuffer.receivers().into_iter().unzip();
        Self {
            receivers,
            origin: gbuffer.origin,
            ids: pixels.iter().map(|&pixel| gbuffer.ids[pixel]).collect(),
            picture: Some((gbuffer, pixels)),
        }
    }
}
