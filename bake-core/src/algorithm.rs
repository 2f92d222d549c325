//! The two visibility algorithms and the choice between them, shared by all bakers.

use aogrid_grid_format::Sampling;

use crate::{BakeOptions, PrepareError};

/// The algorithm that finds the visibility of a cell's directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Algorithm {
    /// The direction sweep: direction by direction, for all cells at once.
    DirectionSweep,
    /// Ray casting: ray by ray, through a bounding volume hierarchy.
    RayCasting,
}

impl Algorithm {
    /// Returns the name on command lines and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::DirectionSweep => "sweep",
            Self::RayCasting => "rays",
        }
    }
}

/// The reason that ray casting is used although it was not requested.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RayFallbackReason {
    /// Random directions differ from cell to cell.
    #[error("the direction sweep does not support random rays")]
    MonteCarlo,
    /// The sweep does not know the distance of an occluder.
    #[error("the direction sweep does not support a maximum distance")]
    MaxDistance,
    /// The mesh has so many boundary edges that the sweep would be slower.
    #[error("{0} boundary edges are too many for the direction sweep")]
    TooManyBoundaryEdges(usize),
    /// The mesh and the grid exceed the limits of the sweep.
    #[error(transparent)]
    Prepare(PrepareError),
}

/// Maximum number of boundary edges for the sweep: those of five million triangles that share no
/// edges. Measured with small random triangles on two cores, the CPU's sweep is 23 times faster
/// than its ray casting at 10⁵ triangles and 32³ cells, and still 5.5 times faster at 10⁶ triangles
/// and 12³ cells, where it gains least (docs/cpu-bake.md). The sweep's time grows with the number
/// of triangles, and that of ray casting hardly does: extrapolated, they are equal here at the
/// earliest.
const MAX_BOUNDARY_EDGES: usize = 15_000_000;

impl RayFallbackReason {
    /// Returns the reason that the options require ray casting, if they do.
    pub fn of_options(options: &BakeOptions) -> Option<Self> {
        match options.sampling {
            Sampling::MonteCarlo { .. } => Some(Self::MonteCarlo),
            Sampling::CubeFaces { .. } if options.max_distance.is_some() => Some(Self::MaxDistance),
            Sampling::CubeFaces { .. } => None,
        }
    }

    /// Returns the reason that a mesh with this many boundary edges is baked faster by ray casting,
    /// if it is: a boundary edge is a silhouette for every direction, whereas only a few percent of
    /// the edges of a connected mesh are.
    pub fn of_counts(boundary_edges: usize) -> Option<Self> {
        (boundary_edges > MAX_BOUNDARY_EDGES).then_some(Self::TooManyBoundaryEdges(boundary_edges))
    }
}
