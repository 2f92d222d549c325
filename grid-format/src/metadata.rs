//! How a grid was made: the part of the metadata that decides whether a bake is up to date.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

/// Texels along a cube face's side. RR-5779, 6.1, renders 8 to 128.
pub const FACE_SIZES: RangeInclusive<u32> = 8..=128;

/// Monte Carlo rays a cell; the upper end is about what the largest faces have.
pub const RAY_COUNTS: RangeInclusive<u32> = 1..=100_000;

/// Everything that decided a grid's texels, besides its [`GridSpec`](crate::GridSpec), encoding
/// and format: two bakes with equal records of one aogrid version have equal texels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakeRecord {
    /// ε of RR-5779 eq. 4, from which the box came; none if its half-extents were given.
    pub epsilon: Option<f32>,
    /// Where in a cell its sample lies, in cells from the cell's centre.
    pub sample_offset: [f32; 3],
    /// How visibility was sampled.
    pub method: Method,
    /// Occluders farther than this, in object units, were ignored; none: unlimited.
    pub max_distance: Option<f32>,
    /// What happened to cells inside the object (RR-5779, 3.3.3).
    pub interior: Interior,
    /// How many cells are inside the object.
    pub interior_cells: u64,
    /// What is known of an open mesh's inside; none for a mesh without holes, and where only
    /// enclosed cells count as interior.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside: Option<Inside>,
    /// What happened to values at the grid's boundary (RR-5779, 3.3.2).
    pub boundary: Boundary,
    /// The mesh.
    pub source: Source,
}

/// How visibility was sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Six cube faces of `size` × `size` texels a cell.
    Faces {
        /// Texels along a face's side.
        size: u32,
    },
    /// `count` random directions a cell (RR-5779, 6.1).
    Rays {
        /// Rays per cell.
        count: u32,
        /// The seed of the directions.
        seed: u64,
    },
}

impl Method {
    /// Whether the size or count is in [`FACE_SIZES`] or [`RAY_COUNTS`].
    pub fn is_in_range(self) -> bool {
        match self {
            Self::Faces { size } => FACE_SIZES.contains(&size),
            Self::Rays { count, .. } => RAY_COUNTS.contains(&count),
        }
    }

    /// How many directions are tested per cell, for a method that [is in
    /// range](Method::is_in_range).
    pub fn directions(self) -> u32 {
        match self {
            Self::Faces { size } => 6 * size * size,
            Self::Rays { count, .. } => count,
        }
    }
}

/// Which cells are inside the object, and what happens to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interior {
    /// Cells whose every direction is occluded, and those that signed layers of surface show to be
    /// inside a mesh with holes. They take the average of their neighbours, so that interpolation
    /// at the surface is right.
    Signed,
    /// Only cells whose every direction is occluded (RR-5779, 3.3.3), filled in the same way.
    /// Files call it `fill`.
    #[serde(rename = "fill", alias = "enclosed")]
    Enclosed,
    /// They stay as they are baked.
    Keep,
}

/// The inside of a mesh that has holes, or whose windings contradict each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inside {
    /// Cells of which it is in doubt whether they are inside: beside a sheet or in a bowl.
    pub doubtful_cells: u64,
    /// Doubtful cells over all that are doubtful or inside, 0..1; 1 for a sheet, 0 for a solid
    /// with small holes.
    pub doubt: f32,
    /// Interior cells that more faces point towards than away from: the mesh is inside out, or
    /// the walls of a room.
    pub inward_cells: u64,
}

/// How values are rescaled so that they fade out at the grid's boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BoundaryMode {
    /// V' = V if V > 0.3, else 0.3 (V − V_M)/(0.3 − V_M) (JGT 2007, section 3.2).
    Jgt,
    /// V' = (V − V_M)/(1 − V_M) (RR-5779, 3.3.2).
    Rr,
    /// V' = V.
    None,
}

/// The boundary treatment that was asked for and the one that was possible.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Boundary {
    /// What the user asked for.
    pub requested: BoundaryMode,
    /// What was done: `jgt` becomes `rr` where V_M ≥ 0.3.
    pub applied: BoundaryMode,
    /// V_M, the largest occlusion of the grid's outer cells before the treatment.
    pub v_m: f32,
}

/// The mesh a grid was baked from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// The file's name, without folders.
    pub name: String,
    /// The part of the file that was baked; none: the whole.
    pub part: Option<String>,
    /// BLAKE3 of the file's bytes, 64 hexadecimal digits.
    pub blake3: String,
    /// Triangles baked.
    pub triangles: u64,
}

impl BakeRecord {
    /// The name of the first number that is out of its range.
    pub(crate) fn out_of_range(&self) -> Option<&'static str> {
        let positive = |v: Option<f32>| v.is_none_or(|v| v > 0.0 && v.is_finite());
        let checks = [
            (positive(self.epsilon), "epsilon"),
            (
                self.sample_offset.iter().all(|v| v.abs() <= 0.5),
                "sample_offset",
            ),
            (self.method.is_in_range(), "method"),
            (positive(self.max_distance), "max_distance"),
            ((0.0..=1.0).contains(&self.boundary.v_m), "boundary"),
            (
                self.inside
                    .is_none_or(|inside| (0.0..=1.0).contains(&inside.doubt)),
                "inside",
            ),
        ];
        checks.into_iter().find(|(ok, _)| !ok).map(|(_, name)| name)
    }
}
