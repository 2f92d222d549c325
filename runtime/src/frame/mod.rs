//! What passes are given of a frame: the G-buffer, the camera, the occluders.

mod bindings;

use crate::{GridTexture, Instance, InstanceError};

pub(crate) use bindings::{Bindings, Reads};

/// What the G-buffer's positions are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Positions {
    /// World positions in xyz of a float texture.
    World,
    /// Values of a depth buffer, as bound for reading, or in x of a float texture. Any
    /// projection, reversed or not, with wgpu's depth range 0..1 over the whole target.
    Depth,
}

/// How the G-buffer stores normals, which are of unit length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normals {
    /// As they are.
    Signed,
    /// (n + 1)/2, as in unorm formats.
    Unsigned,
}

/// What the G-buffer says of whose pixel it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Receivers {
    /// Nothing: every occluder shades every pixel, and none knows its own.
    None,
    /// The object's id in x of an unsigned integer texture.
    Ids,
    /// The object's id in x and its layers, a mask, in y.
    IdsAndLayers,
}

/// One frame's view of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// View and projection, in columns: perspective or orthographic, depth 0..1.
    pub clip_from_world: [[f32; 4]; 4],
    /// See [`Positions`].
    pub positions: &'a wgpu::TextureView,
    /// See [`Normals`]; none for [`Mode::Occlusion`](crate::Mode::Occlusion).
    pub normals: Option<&'a wgpu::TextureView>,
    /// See [`Receivers`].
    pub receivers: Option<&'a wgpu::TextureView>,
    /// All occluders, wherever they are: those off screen shade what is on it. For the same
    /// bits each frame, in the same order each frame.
    pub occluders: &'a [(&'a GridTexture, Instance)],
}

/// Why a frame cannot be prepared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// An occluder's transform or strength.
    #[error("occluder {occluder}: {source}")]
    Instance {
        /// Its place in the frame's occluders.
        occluder: usize,
        /// What is wrong.
        source: InstanceError,
    },
    /// The camera's matrix has no inverse.
    #[error("clip_from_world cannot be inverted")]
    Camera,
    /// A grid of another encoding than the pass was made for.
    #[error("occluder {0}: its grid's encoding is not the one that the pass was made for")]
    Encoding(usize),
    /// A texture that the pass was made to read.
    #[error("the pass was made to read {0}, which the frame does not bring")]
    Missing(&'static str),
    /// More occluders than the pass, or a buffer of the device, holds.
    #[error("{0} occluders are more than the pass or a buffer of the device holds")]
    TooMany(usize),
    /// An occluder without a grid.
    #[error("occluder {0}: the atlas has no grid at the place that it names")]
    NoSuchGrid(usize),
    /// The target does not fit the G-buffer.
    #[error("the target's size is not that of the G-buffer's positions")]
    TargetSize,
}

/// What of a frame all passes read, whatever their occluders are.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) clip_from_world: [[f32; 4]; 4],
    pub(crate) positions: &'a wgpu::TextureView,
    pub(crate) normals: Option<&'a wgpu::TextureView>,
    pub(crate) receivers: Option<&'a wgpu::TextureView>,
}

impl<'a> Frame<'a> {
    pub(crate) fn view(&self) -> View<'a> {
        View {
            clip_from_world: self.clip_from_world,
            positions: self.positions,
            normals: self.normals,
            receivers: self.receivers,
        }
    }
}
