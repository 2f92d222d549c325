//! The CPU baker: chooses between the direction sweep and ray casting.

use aogrid_bake_core::{
    Algorithm, BakeOptions, Observer, PreparedMesh, RawGrid, RayFallbackReason, SignedLayers,
    TriangleMesh,
};
use aogrid_grid_format::{GridSpec, Sampling};

use crate::{BakeError, RayScene, Sweeper};

/// Bakes by the direction sweep or by ray casting, and keeps its buffers for later bakes.
pub struct Baker {
    requested: Option<Algorithm>,
    sweeper: Sweeper,
}

/// A mesh, a grid and options prepared for a bake.
pub struct Prepared<'a> {
    spec: GridSpec,
    options: &'a BakeOptions,
    algorithm: PreparedAlgorithm<'a>,
    fallback_reason: Option<RayFallbackReason>,
}

/// The prepared data of each algorithm.
enum PreparedAlgorithm<'a> {
    Sweep {
        sweeper: &'a mut Sweeper,
        mesh: PreparedMesh,
        size: u32,
    },
    Rays {
        occluder: RayScene,
        layers: Option<SignedLayers>,
    },
}

impl Baker {
    /// Creates a baker that uses the given algorithm, or with `None` the direction sweep wherever
    /// it is supported and faster.
    pub fn new(requested: Option<Algorithm>) -> Self {
        Self::with_sweeper(requested, Sweeper::new())
    }

    /// Creates a baker like [`Baker::new`], but with an existing sweeper.
    pub fn with_sweeper(requested: Option<Algorithm>, sweeper: Sweeper) -> Self {
        Self { requested, sweeper }
    }

    /// Prepares a bake: validates the options and builds the data structures, on all threads.
    ///
    /// # Errors
    ///
    /// An option is out of range, or the direction sweep was requested and does not support
    /// this bake.
    pub fn prepare<'a>(
        &'a mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &'a BakeOptions,
    ) -> Result<Prepared<'a>, BakeError> {
        options.validate()?;
        let rays = || PreparedAlgorithm::Rays {
            occluder: RayScene::new(mesh),
            layers: options.layers(mesh, spec),
        };
        let (algorithm, fallback_reason) = match self.requested {
            Some(Algorithm::RayCasting) => (rays(), None),
            requested => match prepare_sweep(mesh, spec, options, requested.is_none()) {
                Ok((mesh, size)) => {
                    let sweeper = &mut self.sweeper;
                    let algorithm = PreparedAlgorithm::Sweep {
                        sweeper,
                        mesh,
                        size,
                    };
                    (algorithm, None)
                }
                Err(why) if requested.is_some() => return Err(BakeError::NoSweep(why)),
                Err(why) => (rays(), Some(why)),
            },
        };
        Ok(Prepared {
            spec,
            options,
            algorithm,
            fallback_reason,
        })
    }
}

/// Returns the mesh prepared for the direction sweep and the size of a cube face, or the reason to
/// use ray casting instead.
fn prepare_sweep(
    mesh: &TriangleMesh,
    spec: GridSpec,
    options: &BakeOptions,
    only_if_faster: bool,
) -> Result<(PreparedMesh, u32), RayFallbackReason> {
    let size = match (RayFallbackReason::of_options(options), options.sampling) {
        (None, Sampling::CubeFaces { size }) => size,
        (Some(why), _) => return Err(why),
        (None, Sampling::MonteCarlo { .. }) => return Err(RayFallbackReason::MonteCarlo),
    };
    let prepared =
        PreparedMesh::new(mesh, spec, options.sample_offset).map_err(RayFallbackReason::Prepare)?;
    match RayFallbackReason::of_counts(prepared.boundary_edges().len()) {
        Some(why) if only_if_faster => Err(why),
        _ => Ok((prepared, size)),
    }
}

impl Prepared<'_> {
    /// Returns the algorithm that finds visibility.
    pub fn algorithm(&self) -> Algorithm {
        match self.algorithm {
            PreparedAlgorithm::Sweep { .. } => Algorithm::DirectionSweep,
            PreparedAlgorithm::Rays { .. } => Algorithm::RayCasting,
        }
    }

    /// Returns the reason for ray casting, if the baker fell back to it. `None` if the algorithm
    /// was requested or is the direction sweep.
    pub fn fallback_reason(&self) -> Option<&RayFallbackReason> {
        self.fallback_reason.as_ref()
    }

    /// Bakes the grid. The result is bit-identical for any number of threads.
    ///
    /// # Errors
    ///
    /// The observer cancelled.
    pub fn bake(&mut self, observer: Observer<'_>) -> Result<RawGrid, BakeError> {
        let options = self.options;
        let (raw, layers) = match &mut self.algorithm {
            // The layers are only a few tasks. Running them beside the sweep keeps all threads
            // busy.
            PreparedAlgorithm::Sweep {
                sweeper,
                mesh,
                size,
            } => rayon::join(
                || sweeper.bake(mesh, *size, observer),
                || options.layers_of(mesh),
            ),
            PreparedAlgorithm::Rays { occluder, layers } => {
                (occluder.bake(self.spec, options, observer), layers.clone())
            }
        };
        Ok(RawGrid { layers, ..raw? })
    }
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::models::Model;
    use aogrid_bake_core::{Extent, Placement, UNOBSERVED};

    use super::*;

    fn spec(mesh: &TriangleMesh, extent: Extent) -> GridSpec {
        let resolution = [8; 3];
        let placement = Placement { resolution, extent };
        placement.place(&mesh.bounds()).unwrap()
    }

    #[test]
    fn the_sweep_is_used_where_it_is_supported() {
        let mesh = Model::Table.mesh(None).unwrap();
        let placed = spec(&mesh, Extent::Epsilon(0.1));
        let faces = BakeOptions::recommended();
        let near = BakeOptions {
            max_distance: Some(1.0),
            ..faces
        };
        let random = BakeOptions {
            sampling: Sampling::MonteCarlo { count: 10, seed: 1 },
            ..faces
        };
        let tiny = spec(&mesh, Extent::HalfExtents([1e-4; 3]));
        let why = |spec, options: &BakeOptions| {
            let mut baker = Baker::new(None);
            let mut prepared = baker.prepare(&mesh, spec, options).unwrap();
            let expected = match prepared.fallback_reason() {
                None => Algorithm::DirectionSweep,
                Some(_) => Algorithm::RayCasting,
            };
            assert_eq!(prepared.algorithm(), expected);
            prepared.bake(UNOBSERVED).unwrap();
            prepared.fallback_reason().cloned()
        };
        assert_eq!(why(placed, &faces), None);
        assert_eq!(why(placed, &near), Some(RayFallbackReason::MaxDistance));
        assert_eq!(why(placed, &random), Some(RayFallbackReason::MonteCarlo));
        assert!(matches!(
            why(tiny, &faces),
            Some(RayFallbackReason::Prepare(_))
        ));
        assert!(RayFallbackReason::of_counts(14_000_000).is_none());
        assert!(RayFallbackReason::of_counts(16_000_000).is_some());
    }

    #[test]
    fn a_requested_algorithm_is_used_or_refused() {
        let mesh = Model::Table.mesh(None).unwrap();
        let placed = spec(&mesh, Extent::Epsilon(0.1));
        let faces = BakeOptions::recommended();
        let kernel = |requested| {
            let mut baker = Baker::new(Some(requested));
            baker.prepare(&mesh, placed, &faces).unwrap().algorithm()
        };
        assert_eq!(kernel(Algorithm::DirectionSweep), Algorithm::DirectionSweep);
        assert_eq!(kernel(Algorithm::RayCasting), Algorithm::RayCasting);
        let near = BakeOptions {
            max_distance: Some(1.0),
            ..faces
        };
        let mut baker = Baker::new(Some(Algorithm::DirectionSweep));
        let refused = baker.prepare(&mesh, placed, &near).map(|p| p.algorithm());
        assert_eq!(
            refused,
            Err(BakeError::NoSweep(RayFallbackReason::MaxDistance))
        );
    }
}
