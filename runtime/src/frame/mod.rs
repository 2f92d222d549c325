//! The input of the passes for one frame: the G-buffer, the camera, the occluders.

mod bindings;

use crate::{GridTexture, Instance, InstanceError};

pub(crate) use bindings::{FrameBindings, GBufferReads};

/// The contents of the G-buffer's position texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Positions {
    /// World positions in xyz of a float texture.
    World,
    /// Values of a depth buffer, as bound for reading, or in x of a float texture. Any projection
    /// is allowed, reversed or not, with wgpu's depth range 0..1 over the whole target.
    Depth,
}

/// The encoding of the G-buffer's normals, which have unit length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normals {
    /// The normal n itself.
    Signed,
    /// The value (n + 1)/2, as in unorm formats.
    Unsigned,
}

/// The information in the G-buffer about the object that a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Receivers {
    /// No information: every occluder shades every pixel, and none recognizes its own pixels.
    None,
    /// The object's id in x of an unsigned integer texture.
    Ids,
    /// The object's id in x and its layers, a mask, in y.
    IdsAndLayers,
}

/// The camera, G-buffer and occluders of one frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The view and projection matrix, in columns: perspective or orthographic, depth 0..1.
    pub clip_from_world: [[f32; 4]; 4],
    /// See [`Positions`].
    pub positions: &'a wgpu::TextureView,
    /// See [`Normals`]; none for [`Mode::Occlusion`](crate::Mode::Occlusion).
    pub normals: Option<&'a wgpu::TextureView>,
    /// See [`Receivers`].
    pub receivers: Option<&'a wgpu::TextureView>,
    /// All occluders, including those off screen, which may shade visible receivers. The order must
    /// be the same in each frame for bit-identical results.
    pub occluders: &'a [(&'a GridTexture, Instance)],
}

/// The reasons why a frame cannot be prepared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// An occluder's transform or strength is invalid.
    #[error("occluder {occluder}: {source}")]
    Instance {
        /// Its index in the frame's occluders.
        occluder: usize,
        /// The reason.
        source: InstanceError,
    },
    /// The camera's matrix has no inverse.
    #[error("clip_from_world cannot be inverted")]
    Camera,
    /// A grid's encoding differs from the one that the pass was created for.
    #[error("occluder {0}: its grid's encoding differs from the one that the pass was created for")]
    Encoding(usize),
    /// A texture that the pass reads is missing from the frame.
    #[error("the pass was created to read {0}, which are missing from the frame")]
    Missing(&'static str),
    /// There are more occluders than the pass, or a buffer of the device, can hold.
    #[error("{0} occluders are more than the pass or a buffer of the device can hold")]
    TooMany(usize),
    /// An occluder's grid index is not in the atlas.
    #[error("occluder {0}: the atlas has no grid with the occluder's grid index")]
    NoSuchGrid(usize),
    /// The target and the G-buffer differ in size.
    #[error("the target's size differs from that of the G-buffer's positions")]
    TargetSize,
}

/// The inputs of a frame that all passes read, however their occluders are given.
#[derive(Clone, Copy)]
pub(crate) struct FrameInputs<'a> {
    pub(crate) clip_from_world: [[f32; 4]; 4],
    pub(crate) positions: &'a wgpu::TextureView,
    pub(crate) normals: Option<&'a wgpu::TextureView>,
    pub(crate) receivers: Option<&'a wgpu::TextureView>,
}

impl<'a> Frame<'a> {
    pub(crate) fn view(&self) -> FrameInputs<'a> {
        FrameInputs {
            clip_from_world: self.clip_from_world,
            positions: self.positions,
            normals: self.normals,
            receivers: self.receivers,
        }
    }
}
