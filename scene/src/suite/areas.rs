//! The areas around an occluder in which its receivers lie.

use aogrid_bake_core::{Placement, TriangleMesh};
use aogrid_grid_format::GridSpec;
use glam::DVec3;

use crate::error::Result;

/// A part of the space around an occluder. Distances are relative to the grid of the papers, 32³
/// cells at ε = 0.1, whatever grid is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Area {
    /// On a floor and a wall that touch the occluder's bounding box, nearer to the occluder than
    /// one cell's diagonal.
    Near,
    /// The same on planes of no axis that touch the occluder.
    Tilted,
    /// Free points as near, facing the occluder any way.
    AnyWay,
    /// On the planes of the first two, farther away, in the grid's box.
    Rest,
    /// On the same planes, outside the box, up to three of its half-extents.
    Beyond,
    /// On the occluder itself.
    Itself,
    /// On a floor and a wall around two occluders, one on top of the other, in the box of one of
    /// them.
    Stacked,
}

impl Area {
    /// Every area, in the order of tables.
    pub const ALL: [Self; 7] = [
        Self::Near,
        Self::Tilted,
        Self::AnyWay,
        Self::Rest,
        Self::Beyond,
        Self::Itself,
        Self::Stacked,
    ];

    /// Returns the name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Near => "near",
            Self::Tilted => "tilted",
            Self::AnyWay => "any way",
            Self::Rest => "rest",
            Self::Beyond => "beyond",
            Self::Itself => "itself",
            Self::Stacked => "stacked",
        }
    }
}

/// The number of half-extents of the grid's box up to which receivers are beyond it.
pub(crate) const BEYOND: f64 = 3.0;

/// The papers' grid around an occluder, in object space.
pub(crate) struct PaperGrid {
    pub center: DVec3,
    pub half_extents: DVec3,
    /// The diagonal of a cell.
    pub near: f64,
}

impl PaperGrid {
    pub(crate) fn around(mesh: &TriangleMesh) -> Result<Self> {
        let spec: GridSpec = Placement::default().place(&mesh.bounds())?;
        let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let half_extents = vector(spec.half_extents());
        let cells = DVec3::from(spec.resolution().map(f64::from));
        Ok(Self {
            center: vector(spec.center()),
            half_extents,
            near: (2.0 * half_extents / cells).length(),
        })
    }

    /// Returns the largest coordinate of a point relative to the box: 1 on its surface.
    pub(crate) fn half_extents_away(&self, point: DVec3) -> f64 {
        ((point - self.center) / self.half_extents)
            .abs()
            .max_element()
    }
}
