//! The choice between the sweep and rays, and one object for both: as the CPU's baker.

use aogrid_bake_core::{
    BakeOptions, Kernel, Observer, PreparedMesh, RawGrid, SignedLayers, TriangleMesh, WhyRays,
};
use aogrid_grid_format::{Encoding, GridSpec, Method};

use crate::rays::{Caster, UploadedTree};
use crate::sweep::{Sweeper, UploadedMesh};
use crate::{BakeError, Context};

/// Bakes by the sweep or by rays, and keeps what it has compiled and allocated.
pub struct Baker {
    choice: Option<Kernel>,
    sweeper: Sweeper,
    caster: Caster,
}

/// A mesh made ready, and uploaded, for one bake.
pub struct Prepared<'a> {
    options: &'a BakeOptions,
    ready: Ready<'a>,
    /// Counted on the CPU: it takes a moment, and gives the same for all bakers.
    layers: Option<SignedLayers>,
    why_rays: Option<WhyRays>,
}

enum Ready<'a> {
    Sweep(&'a mut Sweeper, Box<UploadedMesh>, u32),
    Rays(&'a mut Caster, UploadedTree),
}

impl Baker {
    /// With the kernel that is chosen; none: the sweep wherever it can be used and is faster.
    pub fn new(context: &Context, choice: Option<Kernel>) -> Self {
        Self {
            choice,
            sweeper: Sweeper::new(context),
            caster: Caster::new(context),
        }
    }

    /// Everything before the first direction: on the CPU, and the upload.
    ///
    /// # Errors
    ///
    /// An option out of its range; the sweep was chosen and cannot be used; the device fails.
    pub fn prepare<'a>(
        &'a mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        options: &'a BakeOptions,
    ) -> Result<Prepared<'a>, BakeError> {
        options.validate()?;
        let why_rays = match self.choice {
            Some(Kernel::Rays) => None,
            choice => match ready_to_sweep(mesh, spec, options, choice.is_none()) {
                Ok((mesh, size)) => {
                    let layers = options.layers_of(&mesh);
                    let uploaded = Box::new(self.sweeper.upload(mesh)?);
                    return Ok(Prepared {
                        options,
                        layers,
                        ready: Ready::Sweep(&mut self.sweeper, uploaded, size),
                        why_rays: None,
                    });
                }
                Err(why) if choice.is_some() => return Err(BakeError::NoSweep(why)),
                Err(why) => Some(why),
            },
        };
        let uploaded = self.caster.upload(mesh, spec, options.sample_offset)?;
        Ok(Prepared {
            options,
            layers: options.layers(mesh, spec),
            ready: Ready::Rays(&mut self.caster, uploaded),
            why_rays,
        })
    }
}

fn ready_to_sweep(
    mesh: &TriangleMesh,
    spec: GridSpec,
    options: &BakeOptions,
    only_if_faster: bool,
) -> Result<(PreparedMesh, u32), WhyRays> {
    let size = match (WhyRays::of_options(options), options.method) {
        (None, Method::Faces { size }) => size,
        (Some(why), _) => return Err(why),
        (None, Method::Rays { .. }) => return Err(WhyRays::MonteCarlo),
    };
    let prepared =
        PreparedMesh::new(mesh, spec, options.sample_offset).map_err(WhyRays::Prepare)?;
    match WhyRays::of_counts(prepared.lone_edges().len()) {
        Some(why) if only_if_faster => Err(why),
        _ => Ok((prepared, size)),
    }
}

impl Prepared<'_> {
    /// What will test the directions.
    pub fn kernel(&self) -> Kernel {
        match self.ready {
            Ready::Sweep(..) => Kernel::Sweep,
            Ready::Rays(..) => Kernel::Rays,
        }
    }

    /// Why it is rays, where nothing was chosen.
    pub fn why_rays(&self) -> Option<&WhyRays> {
        self.why_rays.as_ref()
    }

    /// Bakes; without directions (every moment 1 zero) where the encoding keeps none. The same
    /// input gives the same bits on one device.
    ///
    /// # Errors
    ///
    /// Cancellation, or the device fails.
    pub fn bake(&mut self, observer: Observer<'_>) -> Result<RawGrid, BakeError> {
        let directions = self.options.encoding != Encoding::Occlusion;
        let mut raw = match &mut self.ready {
            Ready::Sweep(sweeper, mesh, size) => sweeper.bake(mesh, *size, directions, observer),
            Ready::Rays(caster, mesh) => caster.bake(mesh, self.options, directions, observer),
        }?;
        raw.layers = self.layers.clone();
        Ok(raw)
    }
}
