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

/// Unconnected edges up to which the sweep is taken: those of five million triangles that share
/// none. Measured with small random triangles on two cores, the CPU's sweep is 23 times faster
/// than its rays at 10⁵ of them and 32³ cells, and still 5.5 times at 10⁶ and 12³ cells, where it
/// gains least (docs/cpu-bake.md). Its time grows with their number, and that of rays hardly does:
/// they meet here at the earliest.
const FEW_LONE_EDGES: usize = 15_000_000;

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
