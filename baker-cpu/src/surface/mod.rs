//! Ambient occlusion on surfaces (GPU Gems, chapter 17): the visibility of points in many directions.
//!
//! # Theory
//!
//! Rays find it for any directions. Where all points share the same, each direction is a problem in
//! the plane across it, which the *irregular z-buffer* solves without rays: see `zbuffer`. Both give
//! the same records, bit by bit.
//!
//! # Practice
//!
//! [`bake_surface`] takes the triangles that occlude and the points, which need not be on them.

mod directions;
mod project;
mod rays;
mod zbuffer;

use std::sync::atomic::{AtomicU64, Ordering};

use aogrid_bake_core::surface::{
    Accumulator, Directions, SurfaceOptions, SurfacePoint, SurfaceRecord,
};
use aogrid_bake_core::{Observer, TriangleMesh};

use crate::BakeError;

pub use project::Projection;

/// A way to find the visibility of points. The records are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceKernel {
    /// The irregular z-buffer, for shared directions alone.
    ZBuffer,
    /// A ray for each point and direction.
    Rays,
}

/// The triangles for each point from which rays are taken to be faster: the z-buffer projects all of them
/// for each direction. An estimate: at one triangle a point it is 2 to 5 times as fast as rays.
const MAX_TRIANGLES_PER_POINT: usize = 16;

impl SurfaceKernel {
    /// All kernels.
    pub const ALL: [Self; 2] = [Self::ZBuffer, Self::Rays];

    /// Returns the name that commands use.
    pub fn name(self) -> &'static str {
        match self {
            Self::ZBuffer => "zbuffer",
            Self::Rays => "rays",
        }
    }

    /// Returns the kernel that is expected to be the fastest.
    pub fn fastest(n_triangles: usize, n_points: usize, options: &SurfaceOptions) -> Self {
        let is_shared = options.directions == Directions::Shared;
        match is_shared && n_triangles / MAX_TRIANGLES_PER_POINT < n_points {
            true => Self::ZBuffer,
            false => Self::Rays,
        }
    }
}

/// The records of a surface bake, and what it took.
#[derive(Clone, Debug)]
pub struct SurfaceBake {
    /// A record for each point, in their order.
    pub records: Vec<SurfaceRecord>,
    /// The number of rays that counted, of all points.
    pub rays: u64,
    /// The kernel that found them.
    pub kernel: SurfaceKernel,
}

/// Bakes the records of `points`, whose positions are relative to the mesh's origin, with the mesh as
/// the occluder, by a kernel or the fastest one. The records depend neither on the kernel nor on the
/// number of threads.
///
/// # Errors
///
/// An option is out of its range, the z-buffer is asked for directions that are not shared, or the
/// observer cancelled the bake.
pub fn bake_surface(
    mesh: &TriangleMesh,
    points: &[SurfacePoint],
    options: &SurfaceOptions,
    kernel: Option<SurfaceKernel>,
    observer: Observer<'_>,
) -> Result<SurfaceBake, BakeError> {
    options.check()?;
    let fastest = || SurfaceKernel::fastest(mesh.triangles().len(), points.len(), options);
    let kernel = kernel.unwrap_or_else(fastest);
    let sums = match kernel {
        SurfaceKernel::ZBuffer if options.directions != Directions::Shared => {
            return Err(BakeError::NotShared);
        }
        SurfaceKernel::ZBuffer => zbuffer::trace(mesh, points, options, observer)?,
        SurfaceKernel::Rays => rays::trace(mesh, points, options, observer)?,
    };
    let (records, rays) = finish(points, &sums, options);
    Ok(SurfaceBake {
        records,
        rays,
        kernel,
    })
}

/// Reduces the sums of all points to records, and counts their rays.
fn finish(
    points: &[SurfacePoint],
    sums: &[Accumulator],
    options: &SurfaceOptions,
) -> (Vec<SurfaceRecord>, u64) {
    use rayon::prelude::*;
    let rays = AtomicU64::new(0);
    let records = points.par_iter().zip(sums).map(|(point, sum)| {
        rays.fetch_add(sum.rays().into(), Ordering::Relaxed);
        sum.finish(point.axis, options.weights)
    });
    (records.collect(), rays.into_inner())
}
