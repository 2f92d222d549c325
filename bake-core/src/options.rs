//! The options of a bake.

use aogrid_grid_format::{
    BoundaryMode, Encoding, FACE_SIZES, GridSpec, Inside, Interior, MAX_SELF_OFFSET, RAY_COUNTS,
    Sampling, TexelFormat,
};

use crate::warnings::MAX_DOUBT;
use crate::{PreparedMesh, SignedLayers, TriangleMesh};

/// The options that determine a grid besides the mesh and the [`Placement`](crate::Placement),
/// shared by all bakers. There is no `Default`: [`BakeOptions::recommended`] makes the choice
/// explicit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BakeOptions {
    /// The sampling of visibility.
    pub sampling: Sampling,
    /// Distance in object units beyond which occluders are ignored; `None` for unlimited.
    pub max_distance: Option<f32>,
    /// Offset of the sample point from the cell's center, in cells, each component within ±½.
    pub sample_offset: [f32; 3],
    /// Treatment of cells inside the object.
    pub interior: Interior,
    /// Treatment of values at the grid's boundary.
    pub boundary: BoundaryMode,
    /// The channels of a texel.
    pub encoding: Encoding,
    /// The storage format of a channel.
    pub format: TexelFormat,
    /// Whether cells near the surface are fitted so that interpolated values are right. It needs
    /// the moment encoding and no boundary treatment.
    pub fit: bool,
    /// The distance along its normal, in cells, at which a receiver on the occluder itself looks
    /// up the grid, 0..=2; `None` lets the bake choose (see [`BakeOptions::self_offset_for`]). The
    /// file carries it to renderers.
    pub self_offset: Option<f32>,
}

/// The reason that options are invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionsError {
    /// The faces are too small or too large.
    #[error("face size {0} is outside {lo}..={hi} texels", lo = FACE_SIZES.start(), hi = FACE_SIZES.end())]
    FaceSize(u32),
    /// There are too few or too many rays.
    #[error("{0} rays per cell are outside {lo}..={hi}", lo = RAY_COUNTS.start(), hi = RAY_COUNTS.end())]
    RayCount(u32),
    /// The maximum distance is not positive and finite.
    #[error("maximum distance {0} must be greater than zero and finite")]
    MaxDistance(f32),
    /// The sample point is outside its cell.
    #[error("sample offset {0} is outside -0.5..=0.5 cells")]
    SampleOffset(f32),
    /// The fit is asked for with an encoding or a boundary treatment that it does not support.
    #[error(
        "the near-surface fit needs the moment encoding and no boundary treatment, not {} with {}",
        encoding.name(), boundary.name()
    )]
    Fit {
        /// The encoding.
        encoding: Encoding,
        /// The boundary treatment.
        boundary: BoundaryMode,
    },
    /// The offset of self look-ups is out of range.
    #[error("self offset {0} is outside 0..={MAX_SELF_OFFSET} cells")]
    SelfOffset(f32),
}

impl BakeOptions {
    /// The recommended sample offset, in cells. It is not zero because CAD models often have faces
    /// exactly at cell centers, and a sample on a face is ambiguous.
    pub const SAMPLE_OFFSET: [f32; 3] = [3.1e-4, -1.7e-4, 4.3e-4];

    /// Returns the recommended options: six 16×16 faces, unlimited distance, JGT boundary and cones
    /// in 8 bits, as in the papers; the interior is filled, also that of meshes with holes.
    pub fn recommended() -> Self {
        Self {
            sampling: Sampling::CubeFaces { size: 16 },
            max_distance: None,
            sample_offset: Self::SAMPLE_OFFSET,
            interior: Interior::Signed,
            boundary: BoundaryMode::Jgt,
            encoding: Encoding::Cone,
            format: TexelFormat::Unorm8,
            fit: false,
            self_offset: Some(0.0),
        }
    }

    /// Returns the distance at which the object looks up its own grid: the one asked for; without
    /// one, a quarter of a cell, where filled cells weigh little, or half a cell for a mesh without
    /// an inside. A sheet lies in the middle between two layers of cells, and from half a cell on it
    /// sees the layer of its own side alone.
    pub fn self_offset_for(&self, inside: Option<&Inside>) -> f32 {
        let is_open = inside.is_some_and(|inside| inside.doubt > MAX_DOUBT);
        let chosen = if is_open { 0.5 } else { 0.25 };
        self.self_offset.unwrap_or(chosen)
    }

    /// Returns the signed layers around `mesh` if these options need them.
    pub fn layers(&self, mesh: &TriangleMesh, spec: GridSpec) -> Option<SignedLayers> {
        let needed = self.interior == Interior::Signed;
        needed.then(|| SignedLayers::around(mesh, spec, self.sample_offset))?
    }

    /// Returns the signed layers around a prepared mesh if these options need them; see
    /// [`BakeOptions::layers`].
    pub fn layers_of(&self, mesh: &PreparedMesh) -> Option<SignedLayers> {
        let needed = self.interior == Interior::Signed;
        needed.then(|| mesh.signed_layers())?
    }

    /// Checks all ranges. Every baker calls it first.
    ///
    /// # Errors
    ///
    /// An option is out of range; the error names the first one.
    pub fn validate(&self) -> Result<(), OptionsError> {
        match self.sampling {
            Sampling::CubeFaces { size } if !self.sampling.is_in_range() => {
                return Err(OptionsError::FaceSize(size));
            }
            Sampling::MonteCarlo { count, .. } if !self.sampling.is_in_range() => {
                return Err(OptionsError::RayCount(count));
            }
            _ => {}
        }
        if let Some(distance) = self.max_distance
            && !(distance > 0.0 && distance.is_finite())
        {
            return Err(OptionsError::MaxDistance(distance));
        }
        let (encoding, boundary) = (self.encoding, self.boundary);
        if self.fit && (encoding != Encoding::Moment || boundary != BoundaryMode::None) {
            return Err(OptionsError::Fit { encoding, boundary });
        }
        if let Some(offset) = self.self_offset
            && !(0.0..=MAX_SELF_OFFSET).contains(&offset)
        {
            return Err(OptionsError::SelfOffset(offset));
        }
        let outside = self
            .sample_offset
            .iter()
            .find(|v| !(-0.5..=0.5).contains(*v));
        outside.map_or(Ok(()), |&v| Err(OptionsError::SampleOffset(v)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_checked() {
        let ok = BakeOptions::recommended();
        assert_eq!(ok.validate(), Ok(()));
        let with = |change: fn(&mut BakeOptions)| {
            let mut options = ok;
            change(&mut options);
            options.validate().unwrap_err()
        };
        let faces = with(|o| o.sampling = Sampling::CubeFaces { size: 7 });
        assert_eq!(faces, OptionsError::FaceSize(7));
        assert_eq!(faces.to_string(), "face size 7 is outside 8..=128 texels");
        let rays = with(|o| o.sampling = Sampling::MonteCarlo { count: 0, seed: 1 });
        assert_eq!(rays, OptionsError::RayCount(0));
        let far = with(|o| o.max_distance = Some(f32::INFINITY));
        assert_eq!(far, OptionsError::MaxDistance(f32::INFINITY));
        let offset = with(|o| o.sample_offset[2] = 0.6);
        assert_eq!(offset, OptionsError::SampleOffset(0.6));
        let fit = with(|o| o.fit = true);
        assert!(fit.to_string().ends_with("not cone with jgt"), "{fit}");
        let offset = with(|o| o.self_offset = Some(-0.1));
        assert_eq!(offset, OptionsError::SelfOffset(-0.1));
        assert!(matches!(
            with(|o| o.sample_offset[0] = f32::NAN),
            OptionsError::SampleOffset(_)
        ));
    }
}
