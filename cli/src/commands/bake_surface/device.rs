//! The device of a bake.

use std::cell::RefCell;

use aogrid_bake_core::surface::{SurfaceOptions, SurfacePoint};
use aogrid_bake_core::{Observer, TriangleMesh};
use aogrid_baker_cpu::{SurfaceBake, SurfaceKernel, bake_surface};
use aogrid_baker_gpu::{Caster, Context, PointBake};

use super::args::Args;
use crate::commands::render::selected_gpu;

/// The CPU, or a GPU.
pub(super) struct Device(Option<(Context, RefCell<Caster>)>);

impl Device {
    pub(super) fn new(args: &Args) -> anyhow::Result<Self> {
        let Some(choice) = selected_gpu(args.backend, args.adapter.as_deref())? else {
            return Ok(Self(None));
        };
        let context = Context::new(&choice)?;
        let caster = Caster::new(&context);
        Ok(Self(Some((context, RefCell::new(caster)))))
    }

    /// Returns the name of the GPU.
    pub(super) fn adapter(&self) -> Option<String> {
        let (context, _) = self.0.as_ref()?;
        Some(context.adapter().name.clone())
    }

    /// Bakes points, with the mesh as the occluder.
    pub(super) fn bake(
        &self,
        mesh: &TriangleMesh,
        points: &[SurfacePoint],
        options: &SurfaceOptions,
        kernel: Option<SurfaceKernel>,
        observer: Observer<'_>,
    ) -> anyhow::Result<SurfaceBake> {
        let Some((context, caster)) = &self.0 else {
            return Ok(bake_surface(mesh, points, options, kernel, observer)?);
        };
        let mut caster = caster.borrow_mut();
        let bake = caster.bake_points(mesh, points, options, observer);
        let PointBake { records, rays } = context.block_on(bake)?;
        Ok(SurfaceBake {
            records,
            rays,
            kernel: SurfaceKernel::Rays,
        })
    }
}
