//! What a bake does, besides where.

use aogrid_grid_format::{
    BoundaryMode, Encoding, FACE_SIZES, GridSpec, Interior, Method, RAY_COUNTS, TexelFormat,
};

use crate::{PreparedMesh, SignedLayers, TriangleMesh};

/// All that decides a grid besides the mesh and the [`Placement`](crate::Placement). One
/// structure serves every baker. There is no default: [`BakeOptions::recommended`] says in
/// its name that it is a choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BakeOptions {
    /// How visibility is sampled.
    pub method: Method,
    /// Occluders farther than this from a sample, in object units, are ignored; none: unlimited.
    pub max_distance: Option<f32>,
    /// Where in a cell its sample lies, in cells from the cell's centre, each within ±½.
    pub sample_offset: [f32; 3],
    /// What happens to cells inside the object.
    pub interior: Interior,
    /// How values fade out at the grid's boundary.
    pub boundary: BoundaryMode,
    /// What a texel means.
    pub encoding: Encoding,
    /// How a value is stored.
    pub format: TexelFormat,
}

/// Why options cannot be baked with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionsError {
    /// Too small or too large faces.
    #[error("face size {0} is outside {lo}..={hi} texels", lo = FACE_SIZES.start(), hi = FACE_SIZES.end())]
    FaceSize(u32),
    /// Too few or too many rays.
    #[error("{0} rays a cell are outside {lo}..={hi}", lo = RAY_COUNTS.start(), hi = RAY_COUNTS.end())]
    RayCount(u32),
    /// Not a distance.
    #[error("maximum distance {0} is not above zero and finite")]
    MaxDistance(f32),
    /// A sample outside its cell.
    #[error("sample offset {0} is outside -0.5..=0.5 cells")]
    SampleOffset(f32),
}

impl BakeOptions {
    /// Where samples lie by default, in cells from the centre: CAD models like to put faces
    /// exactly on cell centres, and there is no right answer for a sample on a face.
    pub const SAMPLE_OFFSET: [f32; 3] = [3.1e-4, -1.7e-4, 4.3e-4];

    /// Six 16×16 faces, unlimited distance, JGT boundary, cones in 8 bits, the papers' choices;
    /// and the interior filled, also that of meshes with holes.
    pub fn recommended() -> Self {
        Self {
            method: Method::Faces { size: 16 },
            max_distance: None,
            sample_offset: Self::SAMPLE_OFFSET,
            interior: Interior::Signed,
            boundary: BoundaryMode::Jgt,
            encoding: Encoding::Cone,
            format: TexelFormat::Unorm8,
        }
    }

    /// Returns the signed layers around `mesh` if these options need them.
    pub fn layers(&self, mesh: &TriangleMesh, spec: GridSpec) -> Option<SignedLayers> {
        let needed = self.interior == Interior::Signed;
        needed.then(|| SignedLayers::around(mesh, spec, self.sample_offset))?
    }

    /// [`BakeOptions::layers`] around a mesh that is prepared already.
    pub fn layers_of(&self, mesh: &PreparedMesh) -> Option<SignedLayers> {
        let needed = self.interior == Interior::Signed;
        needed.then(|| mesh.signed_layers())?
    }

    /// Checks every range. Bakers call it first.
    ///
    /// # Errors
    ///
    /// The first number outside its range.
    pub fn validate(&self) -> Result<(), OptionsError> {
        match self.method {
            Method::Faces { size } if !self.method.is_in_range() => {
                return Err(OptionsError::FaceSize(size));
            }
            Method::Rays { count, .. } if !self.method.is_in_range() => {
                return Err(OptionsError::RayCount(count));
            }
            _ => {}
        }
        if let Some(distance) = self.max_distance
            && !(distance > 0.0 && distance.is_finite())
        {
            return Err(OptionsError::MaxDistance(distance));
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
        let faces = with(|o| o.method = Method::Faces { size: 7 });
        assert_eq!(faces, OptionsError::FaceSize(7));
        assert_eq!(faces.to_string(), "face size 7 is outside 8..=128 texels");
        let rays = with(|o| o.method = Method::Rays { count: 0, seed: 1 });
        assert_eq!(rays, OptionsError::RayCount(0));
        let far = with(|o| o.max_distance = Some(f32::INFINITY));
        assert_eq!(far, OptionsError::MaxDistance(f32::INFINITY));
        let offset = with(|o| o.sample_offset[2] = 0.6);
        assert_eq!(offset, OptionsError::SampleOffset(0.6));
        assert!(matches!(
            with(|o| o.sample_offset[0] = f32::NAN),
            OptionsError::SampleOffset(_)
        ));
    }
}
