//! The CPU baker: one interface to the direction sweep and ray casting.

use aogrid_bake_core::{
    Algorithm, BakeOptions, Observer, Placement, Plan, PreparedMesh, RawGrid, RayFallbackReason,
    SignedLayers, TriangleMesh, UNOBSERVED,
};
use aogrid_grid_format::{Grid, GridSpec, Source};

use crate::error::BakeError;
use crate::ray_scene::RayScene;
use crate::sweep::Sweeper;

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
        self.prepare_observed(mesh, spec, options, UNOBSERVED)
    }

    /// Prepares a bake like [`Baker::prepare`], and calls the observer before each of its stages: a
    /// mesh of ten million triangles takes seconds.
    ///
    /// # Errors
    ///
    /// The same as [`Baker::prepare`], or the observer cancelled.
    pub fn prepare_observed<'a>(
        &'a mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &'a BakeOptions,
        observer: Observer<'_>,
    ) -> Result<Prepared<'a>, BakeError> {
        let plan = Plan::observed(mesh, spec, options, self.requested, observer)?;
        let (algorithm, fallback_reason) = match plan {
            Plan::Sweep { mesh, size } => {
                let sweeper = &mut self.sweeper;
                let algorithm = PreparedAlgorithm::Sweep {
                    sweeper,
                    mesh: *mesh,
                    size,
                };
                (algorithm, None)
            }
            Plan::Rays { fallback_reason } => {
                let algorithm = PreparedAlgorithm::Rays {
                    occluder: RayScene::new(mesh),
                    layers: options.layers(mesh, spec),
                };
                (algorithm, fallback_reason)
            }
        };
        Ok(Prepared {
            spec,
            options,
            algorithm,
            fallback_reason,
        })
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
            PreparedAlgorithm::Sweep {
                sweeper,
                mesh,
                size,
            } => return sweep(sweeper, mesh, (*size, options), observer),
            PreparedAlgorithm::Rays { occluder, layers } => {
                (occluder.bake(self.spec, options, observer), layers.clone())
            }
        };
        Ok(RawGrid { layers, ..raw? })
    }
}

/// Bakes moments and signed layers of a prepared mesh by the direction sweep.
pub(crate) fn sweep(
    sweeper: &mut Sweeper,
    mesh: &PreparedMesh,
    (size, options): (u32, &BakeOptions),
    observer: Observer<'_>,
) -> Result<RawGrid, BakeError> {
    // The layers are only a few tasks. Running them beside the sweep keeps all threads busy.
    let (raw, layers) = rayon::join(
        || sweeper.bake(mesh, size, observer),
        || options.layers_of(mesh),
    );
    Ok(RawGrid { layers, ..raw? })
}

/// Bakes the moments of every cell of `spec` around `mesh` and reports progress to `observer`.
///
/// Uses the direction sweep if it supports the bake and is faster, otherwise ray casting. The
/// result is bit-identical for any number of threads.
///
/// # Errors
///
/// An option is out of range, or the observer cancelled.
pub fn bake(
    mesh: &TriangleMesh,
    spec: GridSpec,
    options: &BakeOptions,
    observer: Observer<'_>,
) -> Result<RawGrid, BakeError> {
    let mut baker = Baker::new(None);
    baker
        .prepare_observed(mesh, spec, options, observer)?
        .bake(observer)
}

/// Bakes the grid of `mesh` with the whole pipeline, for the record of `source`: places it, bakes
/// it, fits it near the surface if the options ask for that, and encodes it. See [`bake`].
///
/// # Errors
///
/// An option is out of range, the mesh cannot be placed or its moments cannot become a grid, or the
/// observer cancelled.
pub fn bake_grid(
    mesh: &TriangleMesh,
    placement: &Placement,
    options: &BakeOptions,
    source: Source,
    observer: Observer<'_>,
) -> Result<Grid, BakeError> {
    let mut baker = Baker::new(None);
    aogrid_bake_core::bake_grid(mesh, placement, options, source, |spec, options| {
        baker
            .prepare_observed(mesh, spec, options, observer)?
            .bake(observer)
    })
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::Placement;
    use aogrid_bake_core::models::Model;

    use super::*;

    #[test]
    fn the_planned_algorithm_bakes() {
        let mesh = Model::Table.mesh(None).unwrap();
        let placement = Placement {
            resolution: [8; 3],
            ..Placement::paper()
        };
        let spec = placement.place(&mesh.bounds()).unwrap();
        let faces = BakeOptions::paper();
        let near = BakeOptions {
            max_distance: Some(1.0),
            ..faces
        };
        let (sweep, rays) = (Algorithm::DirectionSweep, Algorithm::RayCasting);
        let too_near = Some(RayFallbackReason::MaxDistance);
        for (requested, options, algorithm, reason) in [
            (None, &faces, sweep, None),
            (None, &near, rays, too_near),
            (Some(sweep), &faces, sweep, None),
            (Some(rays), &faces, rays, None),
        ] {
            let mut baker = Baker::new(requested);
            let mut prepared = baker.prepare(&mesh, spec, options).unwrap();
            assert_eq!(prepared.algorithm(), algorithm);
            assert_eq!(prepared.fallback_reason(), reason.as_ref());
            prepared.bake(UNOBSERVED).unwrap();
        }
    }
}
