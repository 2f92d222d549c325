//! The GPU baker: one interface to the direction sweep and ray casting; it mirrors the CPU's.

use aogrid_bake_core::{
    Algorithm, BakeOptions, Observer, Plan, RawGrid, RayFallbackReason, SignedLayers, TriangleMesh,
    UNOBSERVED,
};
use aogrid_grid_format::GridSpec;

use crate::rays::{Caster, UploadedTree};
use crate::sweep::{Sweeper, UploadedMesh};
use crate::{BakeError, Context};

/// Bakes by the direction sweep or by ray casting, and keeps its pipelines and buffers.
pub struct Baker {
    requested: Option<Algorithm>,
    sweeper: Sweeper,
    caster: Caster,
}

/// A mesh prepared and uploaded for one bake.
pub struct Prepared<'a> {
    options: &'a BakeOptions,
    uploaded: Uploaded<'a>,
    /// The signed layers. They are counted on the CPU: this is fast and gives every baker the
    /// same result.
    layers: Option<SignedLayers>,
    fallback_reason: Option<RayFallbackReason>,
}

/// The algorithm's baker with its uploaded mesh; for the sweep, with the face size.
enum Uploaded<'a> {
    Sweep(&'a mut Sweeper, Box<UploadedMesh>, u32),
    Rays(&'a mut Caster, UploadedTree),
}

impl Baker {
    /// Creates a baker for the requested algorithm. `None` takes the direction sweep wherever it is
    /// supported and faster.
    pub fn new(context: &Context, requested: Option<Algorithm>) -> Self {
        Self {
            requested,
            sweeper: Sweeper::new(context),
            caster: Caster::new(context),
        }
    }

    /// Prepares the mesh on the CPU and uploads it: all the work before the first direction.
    ///
    /// # Errors
    ///
    /// An option is out of range; the sweep was chosen and is not supported; the device fails.
    pub async fn prepare<'a>(
        &'a mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &'a BakeOptions,
    ) -> Result<Prepared<'a>, BakeError> {
        self.prepare_observed(mesh, spec, options, UNOBSERVED).await
    }

    /// Prepares a bake like [`Baker::prepare`], and calls the observer before each stage of the CPU's
    /// part.
    ///
    /// # Errors
    ///
    /// The same as [`Baker::prepare`], or the observer cancelled.
    pub async fn prepare_observed<'a>(
        &'a mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &'a BakeOptions,
        observer: Observer<'_>,
    ) -> Result<Prepared<'a>, BakeError> {
        let (layers, uploaded, fallback_reason) =
            match Plan::observed(mesh, spec, options, self.requested, observer)? {
                Plan::Sweep { mesh, size } => {
                    let layers = options.layers_of(&mesh);
                    let uploaded = Box::new(self.sweeper.upload(*mesh).await?);
                    (
                        layers,
                        Uploaded::Sweep(&mut self.sweeper, uploaded, size),
                        None,
                    )
                }
                Plan::Rays { fallback_reason } => {
                    let uploaded = self
                        .caster
                        .upload(mesh, spec, options.sample_offset)
                        .await?;
                    let uploaded = Uploaded::Rays(&mut self.caster, uploaded);
                    (options.layers(mesh, spec), uploaded, fallback_reason)
                }
            };
        Ok(Prepared {
            options,
            uploaded,
            layers,
            fallback_reason,
        })
    }
}

impl Prepared<'_> {
    /// Returns the algorithm that will test the directions.
    pub fn algorithm(&self) -> Algorithm {
        match self.uploaded {
            Uploaded::Sweep(..) => Algorithm::DirectionSweep,
            Uploaded::Rays(..) => Algorithm::RayCasting,
        }
    }

    /// Returns the reason for ray casting if no algorithm was chosen and the sweep is not used.
    pub fn fallback_reason(&self) -> Option<&RayFallbackReason> {
        self.fallback_reason.as_ref()
    }

    /// Bakes the grid. If the encoding stores no directions, every moment 1 is zero. The same
    /// input gives the same bits on one device.
    ///
    /// # Errors
    ///
    /// The observer cancels, or the device fails.
    pub async fn bake(&mut self, observer: Observer<'_>) -> Result<RawGrid, BakeError> {
        let directions = self.options.encoding.has_direction();
        let mut raw = match &mut self.uploaded {
            Uploaded::Sweep(sweeper, mesh, size) => {
                sweeper.bake(mesh, *size, directions, observer).await
            }
            Uploaded::Rays(caster, bvh) => {
                caster.bake(bvh, self.options, directions, observer).await
            }
        }?;
        raw.layers = self.layers.clone();
        Ok(raw)
    }
}
