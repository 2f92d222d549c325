//! The bake record: the part of the metadata that tells whether a bake is up to date.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

/// Valid numbers of texels along a side of a cube face. RR-5779, 6.1, renders 8 to 128.
pub const FACE_SIZES: RangeInclusive<u32> = 8..=128;

/// Valid numbers of Monte Carlo rays per cell; the upper end is about the number of texels of the
/// largest cube faces.
pub const RAY_COUNTS: RangeInclusive<u32> = 1..=100_000;

/// The maximum offset of self look-ups, in cells.
pub const MAX_SELF_OFFSET: f32 = 2.0;

/// The upper bound of a flatness times k (see [`BakeRecord::flatness`]), for the bake and for renderers.
/// At 1 the far field would not fall at all; this lets it fall as that of a disc whose rim is seen 80
/// degrees off its axis.
pub const MAX_FLATNESS: f32 = 0.97;

/// Valid values of a flatness.
pub const FLATNESSES: RangeInclusive<f32> = -32.0..=4.0;

/// Everything that determines a grid's texels besides its [`GridSpec`](crate::GridSpec), encoding
/// and format: two bakes of one aogrid version with equal records have equal texels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakeRecord {
    /// ε of RR-5779 eq. 4, from which the box was computed; `None` if its half-extents were given.
    pub epsilon: Option<f32>,
    /// Offset of the sample point from the cell's center, in cells.
    pub sample_offset: [f32; 3],
    /// The sampling of visibility.
    #[serde(rename = "method")]
    pub sampling: Sampling,
    /// Distance in object units beyond which occluders were ignored; `None` if unlimited.
    pub max_distance: Option<f32>,
    /// Treatment of cells inside the object (RR-5779, 3.3.3).
    pub interior: Interior,
    /// Number of cells inside the object.
    pub interior_cells: u64,
    /// Certainty of the interior of an open mesh; `None` for a mesh without holes, and where only
    /// enclosed cells count as interior.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside: Option<Inside>,
    /// Treatment of values at the grid's boundary (RR-5779, 3.3.2).
    pub boundary: Boundary,
    /// Whether the box was adjusted so that layers of cell centers lie just outside the faces of
    /// the object's bounding box.
    #[serde(default, skip_serializing_if = "is_off")]
    pub snap: bool,
    /// Whether cells near the surface were fitted so that interpolated values are right.
    #[serde(default, skip_serializing_if = "is_off")]
    pub fit: bool,
    /// The distance along its normal, in cells, at which a receiver on the occluder itself looks
    /// up the grid, 0..=[`MAX_SELF_OFFSET`].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub self_offset: f32,
    /// The object's flatness, which tells how fast its occlusion falls beyond the box. Where sin²α = k
    /// is that of a sphere with the same solid angle, 1/k less the flatness grows with the distance
    /// squared: 0 for a sphere, 1 for a disc that faces the receiver, negative for one seen from its
    /// edge. In the direction of the point (x, y, z) on the hull of the outer cells' centers, \[−1,1\]³,
    /// it is f₀ x² + f₁ y² + f₂ z² + f₃, each of these numbers in [`FLATNESSES`].
    #[serde(default, skip_serializing_if = "is_spherical")]
    pub flatness: [f32; 4],
    /// The error of shading with the grid, if it was measured. It does not determine the texels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub check: Option<Check>,
    /// The names of the file's parts that were left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// The mesh that was baked.
    pub source: Source,
}

/// The error of AO that a grid's cones give, against ray tracing, in areas around the object. Areas
/// are relative to the box of the papers (32³ cells, ε = 0.1); `None` where no receiver was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Number of rays for the truth of a receiver.
    pub rays: u32,
    /// On a floor and a wall that touch the object's bounding box, within a cell's diagonal.
    pub near: Option<AreaError>,
    /// The same on tilted planes that touch the object.
    pub tilted: Option<AreaError>,
    /// At free points as near, facing the object any way.
    pub any_way: Option<AreaError>,
    /// On the planes, in the rest of the box.
    pub rest: Option<AreaError>,
    /// On the planes, beyond the box, up to three of its half-extents.
    pub beyond: Option<AreaError>,
    /// On the object itself.
    pub itself: Option<AreaError>,
}

/// The error of AO over the receivers of an area.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AreaError {
    /// Number of receivers.
    pub receivers: u32,
    /// Root mean square error.
    pub rmse: f32,
    /// The absolute error that 95 % of the receivers do not exceed.
    pub p95: f32,
}

/// The sampling of visibility: the set of directions that a cell tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// Six cube faces of `size` × `size` texels per cell.
    #[serde(rename = "faces")]
    CubeFaces {
        /// Texels along a face's side.
        size: u32,
    },
    /// Monte Carlo: `count` random directions per cell (RR-5779, 6.1).
    #[serde(rename = "rays")]
    MonteCarlo {
        /// Rays per cell.
        count: u32,
        /// The seed of the random directions.
        seed: u64,
    },
}

impl Sampling {
    /// Whether the size or count is in [`FACE_SIZES`] or [`RAY_COUNTS`].
    pub fn is_in_range(self) -> bool {
        match self {
            Self::CubeFaces { size } => FACE_SIZES.contains(&size),
            Self::MonteCarlo { count, .. } => RAY_COUNTS.contains(&count),
        }
    }

    /// Returns the number of directions per cell. The method must [be in
    /// range](Sampling::is_in_range).
    pub fn directions(self) -> u32 {
        match self {
            Self::CubeFaces { size } => 6 * size * size,
            Self::MonteCarlo { count, .. } => count,
        }
    }
}

/// The rule that tells which cells are inside the object, and their treatment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interior {
    /// Cells whose every direction is occluded are interior, and so are those that signed surface
    /// layers show to be inside a mesh with holes. They take the average of their neighbors, so
    /// that interpolation at the surface is right.
    Signed,
    /// Only cells whose every direction is occluded are interior (RR-5779, 3.3.3). They are filled
    /// in the same way. Files call it `fill`.
    #[serde(rename = "fill", alias = "enclosed")]
    Enclosed,
    /// Interior cells keep their baked values.
    Keep,
}

/// Certainty of the interior of a mesh that has holes or inconsistent winding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inside {
    /// Cells whose class is in doubt: beside a sheet or in a bowl.
    pub doubtful_cells: u64,
    /// Doubtful cells divided by those that are doubtful or interior, 0..1; 1 for a sheet, 0 for a
    /// solid with small holes.
    pub doubt: f32,
    /// Interior cells that more faces point toward than away from: the mesh is inside out, or it
    /// is the walls of a room.
    pub inward_cells: u64,
}

/// The formula that rescales values so that they fade out at the grid's boundary.
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

/// The boundary treatment that was requested and the one that was applied.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Boundary {
    /// The mode that the user requested.
    pub requested: BoundaryMode,
    /// The mode that was applied: `jgt` becomes `rr` if V_M ≥ 0.3.
    pub applied: BoundaryMode,
    /// V_M, the largest occlusion of the grid's outer cells before the treatment.
    pub v_m: f32,
}

/// The mesh a grid was baked from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// The file's name, without folders.
    pub name: String,
    /// The part of the file that was baked; `None` for the whole file.
    pub part: Option<String>,
    /// BLAKE3 hash of the file's bytes, 64 hexadecimal digits.
    pub blake3: String,
    /// Number of triangles baked.
    pub triangles: u64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_off(flag: &bool) -> bool {
    !flag
}

fn is_spherical(flatness: &[f32; 4]) -> bool {
    *flatness == [0.0; 4]
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_zero(value: &f32) -> bool {
    *value == 0.0
}

impl Interior {
    /// Every rule, the recommended one first.
    pub const ALL: [Self; 3] = [Self::Signed, Self::Enclosed, Self::Keep];

    /// Returns the name on command lines and in scenes; files call [`Interior::Enclosed`] `fill`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Signed => "signed",
            Self::Enclosed => "enclosed",
            Self::Keep => "keep",
        }
    }

    /// Returns the rule with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rule| rule.name() == name)
    }
}

impl BoundaryMode {
    /// Every mode.
    pub const ALL: [Self; 3] = [Self::Jgt, Self::Rr, Self::None];

    /// Returns the name in files and on command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jgt => "jgt",
            Self::Rr => "rr",
            Self::None => "none",
        }
    }

    /// Returns the mode with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.name() == name)
    }
}

impl BakeRecord {
    /// Returns the name of the first field that is out of range.
    pub(crate) fn out_of_range(&self) -> Option<&'static str> {
        let positive = |v: Option<f32>| v.is_none_or(|v| v > 0.0 && v.is_finite());
        let checks = [
            (positive(self.epsilon), "epsilon"),
            (
                self.sample_offset.iter().all(|v| v.abs() <= 0.5),
                "sample_offset",
            ),
            (self.sampling.is_in_range(), "method"),
            (positive(self.max_distance), "max_distance"),
            ((0.0..=1.0).contains(&self.boundary.v_m), "boundary"),
            (
                (0.0..=MAX_SELF_OFFSET).contains(&self.self_offset),
                "self_offset",
            ),
            (
                self.flatness.iter().all(|v| FLATNESSES.contains(v)),
                "flatness",
            ),
            (
                self.inside
                    .is_none_or(|inside| (0.0..=1.0).contains(&inside.doubt)),
                "inside",
            ),
        ];
        checks.into_iter().find(|(ok, _)| !ok).map(|(_, name)| name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_that_files_understand() {
        for mode in BoundaryMode::ALL {
            assert_eq!(BoundaryMode::from_name(mode.name()), Some(mode));
            let json = format!("\"{}\"", mode.name());
            assert_eq!(serde_json::from_str::<BoundaryMode>(&json).unwrap(), mode);
        }
        for rule in Interior::ALL {
            assert_eq!(Interior::from_name(rule.name()), Some(rule));
            let json = format!("\"{}\"", rule.name());
            assert_eq!(serde_json::from_str::<Interior>(&json).unwrap(), rule);
        }
        assert_eq!(Interior::from_name("fill"), None);
    }
}
