//! The two ways to test directions, and the choice between them: the same for all bakers.

use aogrid_grid_format::Method;

use crate::{BakeOptions, PrepareError};

/// How directions are tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// All cells at once, direction by direction.
    Sweep,
    /// One by one, over a hierarchy.
    Rays,
}

impl Kernel {
    /// The name on command lines and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sweep => "sweep",
            Self::Rays => "rays",
        }
    }
}

/// Why rays are used where nobody asked for them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WhyRays {
    /// Its directions differ from cell to cell.
    #[error("random rays share no directions")]
    MonteCarlo,
    /// The sweep does not know how far away a layer is.
    #[error("the sweep sees without limit, and there is a maximum distance")]
    MaxDistance,
    /// Every triangle by itself costs more than a hierarchy.
    #[error("{0} unconnected edges are too many for the sweep")]
    Soup(usize),
    /// The mesh does not fit the grid's lattice.
    #[error(transparent)]
    Prepare(PrepareError),
}

/// Unconnected edges up to which the sweep is taken: those of half a million triangles that
/// share none. Where the two ways really meet differs from machine to machine and has not been
/// measured; both give the same grid.
const FEW_LONE_EDGES: usize = 1_500_000;

impl WhyRays {
    /// Whether the options leave no choice.
    pub fn of_options(options: &BakeOptions) -> Option<Self> {
        match options.method {
            Method::Rays { .. } => Some(Self::MonteCarlo),
            Method::Faces { .. } if options.max_distance.is_some() => Some(Self::MaxDistance),
            Method::Faces { .. } => None,
        }
    }

    /// Whether a soup as large as this is faster with rays: each of its edges is a silhouette
    /// for every direction, where of a connected mesh a few in a hundred are.
    pub fn of_counts(lone_edges: usize) -> Option<Self> {
        (lone_edges > FEW_LONE_EDGES).then_some(Self::Soup(lone_edges))
    }
}
