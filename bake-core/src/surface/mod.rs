//! Ambient occlusion on surfaces: the points of a surface bake, their directions, and the records
//! that visibility is reduced to (Pharr and Green, *Ambient Occlusion*, GPU Gems, chapter 17, 2004).
//!
//! # Theory
//!
//! A point's *accessibility* is the share of the hemisphere over it that no surface hides, and its
//! *bent normal* the mean of the open directions. The chapter weighs all directions alike. Under a
//! constant sky a diffuse surface receives 1 − AO, the share weighted by the cosine to the normal,
//! so that [`Weights::Cosine`] is the default of the command and [`Weights::Uniform`] is as printed:
//! on the floor of a square pit half as deep as it is wide they are .415 and .259.
//!
//! Directions are shared by all points ([`shared_directions`]): a Fibonacci hemisphere and its mirror
//! image in the origin, so that each point has as many above as below. Sharing makes every direction a problem in
//! a plane, and has no noise that differs between neighbors.
//!
//! # Practice
//!
//! [`face_centers`] or [`vertex_points`] → [`SurfacePoint`]s → a baker with [`SurfaceOptions`] →
//! [`SurfaceRecord`]s → [`vertex_means`] where values of faces are wanted at vertices.

mod directions;
mod faces;
pub mod glb;
mod groups;
mod options;
mod record;
mod tangents;
mod texels;
mod vector;
mod vertices;

pub use directions::{Directions, shared_directions};
pub use faces::{FaceCenters, face_centers};
pub use groups::VertexGroups;
pub use options::{SURFACE_RAYS, SurfaceOptions, SurfaceOptionsError};
pub use record::{Accumulator, SurfaceRecord, Weights};
pub use tangents::TangentFrames;
pub use texels::{
    MAX_TEXEL_SAMPLES, TexelPoints, TexelSampling, dilate, texel_means, texel_points,
};
pub use vector::{cross, dot, normalized};
pub use vertices::{VertexMean, VertexPoints, VertexRecords, vertex_means, vertex_points};

use crate::TriangleMesh;

/// The offset of points along the normals of their faces, relative to the diagonal of the bounding
/// box, where the user names none: far more than the rounding of single floats (1e-7), far less than
/// what a picture shows.
pub const RELATIVE_OFFSET: f64 = 1e-4;

/// Returns the offset of points where the user names none, in object units.
pub fn default_offset(mesh: &TriangleMesh) -> f64 {
    let half = mesh.bounds().half_extents();
    2.0 * RELATIVE_OFFSET * dot(half, half).sqrt()
}

/// A point of a surface from which rays start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The start of the rays, offset from the surface, in object units relative to the
    /// [origin](TriangleMesh::origin) of the mesh.
    pub position: [f64; 3],
    /// The axis of the hemisphere of directions, of length 1.
    pub axis: [f64; 3],
    /// The normal of the face that the point is on, of length 1. Directions that are not above its
    /// plane count neither as open nor as occluded: an axis that is interpolated between vertices
    /// would have a part of its hemisphere within the surface.
    pub face: [f64; 3],
}

impl SurfacePoint {
    /// Returns 1 if `direction` is above the point, −1 if the opposite direction is, and 0 if neither
    /// counts.
    #[inline]
    pub fn side(&self, direction: [f64; 3]) -> i8 {
        let (along, above) = (dot(self.axis, direction), dot(self.face, direction));
        i8::from(along > 0.0 && above > 0.0) - i8::from(along < 0.0 && above < 0.0)
    }
}
