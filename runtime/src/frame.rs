//! The input of the raster passes for one frame: the G-buffer and the occluders.

use aogrid_grid_format::Encoding;

use crate::{GBufferError, GBufferViews, GridTexture, Instance, InstanceError};

/// The G-buffer and occluders of one frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The camera and the G-buffer's textures.
    pub gbuffer: GBufferViews<'a>,
    /// All occluders, including those off screen, which may shade visible receivers. The order must
    /// be the same in each frame for bit-identical results.
    pub occluders: &'a [(&'a GridTexture, Instance)],
}

/// The reasons why a frame cannot be prepared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// The pass cannot read the G-buffer.
    #[error(transparent)]
    GBuffer(#[from] GBufferError),
    /// An occluder's transform or strength is invalid.
    #[error("occluder {occluder}: {source}")]
    Instance {
        /// Its index in the frame's occluders.
        occluder: usize,
        /// The reason.
        source: InstanceError,
    },
    /// An occluder's grid has no cones, which the pass shades with.
    #[error(
        "occluder {0}: its grid has occlusion alone and cannot be shaded as cones: bake with \
         --encoding cone"
    )]
    NoCones(usize),
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

impl Frame<'_> {
    /// Rejects grids that hold occlusion alone.
    pub(crate) fn require_cones(&self) -> Result<(), PrepareError> {
        let mut encodings = self.occluders.iter().map(|(grid, _)| grid.encoding());
        match encodings.position(|encoding| encoding == Encoding::Occlusion) {
            Some(occluder) => Err(PrepareError::NoCones(occluder)),
            None => Ok(()),
        }
    }
}
