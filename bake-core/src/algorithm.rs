//! The two visibility algorithms, the choice between them and its reasons, shared by all bakers.

use aogrid_grid_format::{GridSpec, Sampling};

use crate::{
    BakeOptions, Observer, OptionsError, PrepareError, PreparedMesh, TriangleMesh, UNOBSERVED,
};

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

/// The choice for one bake; see [`Plan::new`].
#[derive(Debug)]
pub enum Plan {
    /// Bake by the direction sweep.
    Sweep {
        /// The mesh, prepared for the sweep.
        mesh: Box<PreparedMesh>,
        /// Texels along a side of a cube face.
        size: u32,
    },
    /// Bake by ray casting.
    Rays {
        /// The reason, unless ray casting was requested.
        fallback_reason: Option<RayFallbackReason>,
    },
}

/// The reason that there is no [`Plan`] for a bake.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// An option is out of range.
    #[error(transparent)]
    Options(#[from] OptionsError),
    /// The direction sweep was requested, but only ray casting supports this bake.
    #[error("the sweep cannot bake this: {0}")]
    NoSweep(RayFallbackReason),
    /// The observer cancelled the preparation.
    #[error("the bake was cancelled")]
    Cancelled,
}

impl Plan {
    /// Validates the options and chooses the requested algorithm, or without a request the
    /// direction sweep wherever it is supported and faster. Prepares the mesh for the sweep.
    ///
    /// # Errors
    ///
    /// An option is out of range, or the direction sweep was requested and does not support this
    /// bake.
    pub fn new(
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &BakeOptions,
        requested: Option<Algorithm>,
    ) -> Result<Self, PlanError> {
        Self::observed(mesh, spec, options, requested, UNOBSERVED)
    }

    /// Makes a plan like [`Plan::new`], and calls the observer while the mesh is prepared.
    ///
    /// # Errors
    ///
    /// The same as [`Plan::new`], or the observer cancelled.
    pub fn observed(
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &BakeOptions,
        requested: Option<Algorithm>,
        observer: Observer<'_>,
    ) -> Result<Self, PlanError> {
        options.validate()?;
        if requested == Some(Algorithm::RayCasting) {
            return Ok(Self::Rays {
                fallback_reason: None,
            });
        }
        match prepare_sweep(mesh, spec, options, requested.is_none(), observer) {
            Ok((mesh, size)) => Ok(Self::Sweep {
                mesh: Box::new(mesh),
                size,
            }),
            Err(RayFallbackReason::Prepare(PrepareError::Cancelled)) => Err(PlanError::Cancelled),
            Err(reason) if requested.is_some() => Err(PlanError::NoSweep(reason)),
            Err(reason) => Ok(Self::Rays {
                fallback_reason: Some(reason),
            }),
        }
    }
}

/// Returns the mesh prepared for the direction sweep and the size of a cube face, or the reason to
/// use ray casting instead.
fn prepare_sweep(
    mesh: &TriangleMesh,
    spec: GridSpec,
    options: &BakeOptions,
    only_if_faster: bool,
    observer: Observer<'_>,
) -> Result<(PreparedMesh, u32), RayFallbackReason> {
    let size = match options.sampling {
        Sampling::MonteCarlo { .. } => return Err(RayFallbackReason::MonteCarlo),
        Sampling::CubeFaces { .. } if options.max_distance.is_some() => {
            return Err(RayFallbackReason::MaxDistance);
        }
        Sampling::CubeFaces { size } => size,
    };
    let prepared = PreparedMesh::observed(mesh, spec, options.sample_offset, observer)
        .map_err(RayFallbackReason::Prepare)?;
    match too_many(prepared.boundary_edges().len()) {
        Some(reason) if only_if_faster => Err(reason),
        _ => Ok((prepared, size)),
    }
}

/// Returns the reason that a mesh with this many boundary edges is baked faster by ray casting, if
/// it is: a boundary edge is a silhouette for every direction, whereas only a few percent of the
/// edges of a connected mesh are.
fn too_many(boundary_edges: usize) -> Option<RayFallbackReason> {
    let is_slow = boundary_edges > MAX_BOUNDARY_EDGES;
    is_slow.then_some(RayFallbackReason::TooManyBoundaryEdges(boundary_edges))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::Model;
    use crate::{Extent, Placement};

    fn spec(mesh: &TriangleMesh, extent: Extent) -> GridSpec {
        let resolution = [8; 3];
        let placement = Placement {
            resolution,
            extent,
            snap: false,
        };
        placement.place(&mesh.bounds()).unwrap()
    }

    #[test]
    fn the_sweep_is_used_where_it_is_supported() {
        let mesh = Model::Table.mesh(None).unwrap();
        let placed = spec(&mesh, Extent::Epsilon(0.1));
        let faces = BakeOptions::paper();
        let near = BakeOptions {
            max_distance: Some(1.0),
            ..faces
        };
        let random = BakeOptions {
            sampling: Sampling::MonteCarlo { count: 10, seed: 1 },
            ..faces
        };
        let tiny = spec(&mesh, Extent::HalfExtents([1e-4; 3]));
        let reason = |spec, options: &BakeOptions| {
            let plan = Plan::new(&mesh, spec, options, None).unwrap();
            match plan {
                Plan::Sweep { .. } => None,
                Plan::Rays { fallback_reason } => fallback_reason,
            }
        };
        assert_eq!(reason(placed, &faces), None);
        assert_eq!(reason(placed, &near), Some(RayFallbackReason::MaxDistance));
        assert_eq!(reason(placed, &random), Some(RayFallbackReason::MonteCarlo));
        assert!(matches!(
            reason(tiny, &faces),
            Some(RayFallbackReason::Prepare(_))
        ));
        assert!(too_many(14_000_000).is_none());
        assert!(too_many(16_000_000).is_some());
    }

    #[test]
    fn a_requested_algorithm_is_used_or_refused() {
        let mesh = Model::Table.mesh(None).unwrap();
        let placed = spec(&mesh, Extent::Epsilon(0.1));
        let faces = BakeOptions::paper();
        let plan = |options, requested| Plan::new(&mesh, placed, options, Some(requested));
        let sweep = plan(&faces, Algorithm::DirectionSweep);
        assert!(matches!(sweep, Ok(Plan::Sweep { size: 16, .. })));
        let rays = plan(&faces, Algorithm::RayCasting);
        assert!(matches!(
            rays,
            Ok(Plan::Rays {
                fallback_reason: None
            })
        ));
        let near = BakeOptions {
            max_distance: Some(1.0),
            ..faces
        };
        assert_eq!(
            plan(&near, Algorithm::DirectionSweep).err(),
            Some(PlanError::NoSweep(RayFallbackReason::MaxDistance))
        );
        let far = BakeOptions {
            max_distance: Some(-1.0),
            ..faces
        };
        assert_eq!(
            plan(&far, Algorithm::RayCasting).err(),
            Some(PlanError::Options(OptionsError::MaxDistance(-1.0)))
        );
    }
}
