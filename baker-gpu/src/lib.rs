//! Bakes ambient-occlusion grids with wgpu compute: the same faces, moments and integer counts
//! as the CPU baker, from the same prepared mesh and options.
//!
//! ```no_run
//! use aogrid_bake_core::{BakeOptions, Placement, UNOBSERVED, models::Model};
//! use aogrid_baker_gpu::{Baker, AdapterSelector, Context};
//! let context = Context::new(&AdapterSelector::Real)?;
//! let mesh = Model::Table.mesh(None)?;
//! let spec = Placement::paper().place(&mesh.bounds())?;
//! let options = BakeOptions::paper();
//! let mut baker = Baker::new(&context, None);
//! let raw = context.block_on(async {
//!     let mut prepared = baker.prepare(&mesh, spec, &options).await?;
//!     prepared.bake(UNOBSERVED).await
//! })?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Theory
//!
//! RR-5779, 6.1 renders six faces of 16×16 pixels around each cell on the GPU, one cell after
//! the other, and reads them back or reduces them there, with directions or without. Compute
//! shaders need not draw. The *direction sweep* finds the layers of surface ahead of whole rows
//! of cells, one direction at a time; its cost grows more slowly than the number of triangles.
//! Ray casting over a BVH handles what the sweep cannot: a maximum distance, Monte Carlo
//! directions, and very large meshes of unconnected triangles. Both reduce on the GPU to integer
//! sums, which do not depend on the order of summation; five numbers per cell are read back. A
//! brute-force kernel that tests every triangle for every texel serves as the reference.
//!
//! # Practice
//!
//! A [`Context`] holds a device that somebody else has made, with the [`required_limits`]
//! ([`Context::from_device`]); nothing below it blocks or reads a clock, so that it also runs in a
//! browser. With the feature `native`, which is on by default, `Context::new` selects an adapter of
//! the machine and opens a device on it, and `Context::block_on` waits for the results. A [`Baker`] keeps its pipelines and buffers between bakes and
//! reports which algorithm it uses; below it are a [`Sweeper`] and a [`Caster`], which also
//! return the bits of the cube faces. All of them run within WebGPU's default limits and use
//! larger buffers where the device has them.
//!
//! Work is split into submissions of a few hundredths of a second, sized from measured times, so
//! that no driver's watchdog fires; between submissions the observer is called and may cancel.
//! A bake returns whatever the device does ([`BakeError`]). The WGSL files lie beside the Rust
//! that dispatches them; their constants are generated from Rust, and [`shaders()`] lists the
//! complete sources.

mod baker;
mod clock;
mod context;
mod error;
mod kernel;
#[cfg(test)]
mod layout_test;
#[cfg(feature = "native")]
mod native;
mod pace;
mod rays;
mod shaders;
mod signal;
mod store;
mod sweep;
mod work;

pub use aogrid_bake_core::{Algorithm, PlanError, RayFallbackReason};
pub use baker::{Baker, Prepared};
pub use clock::Clock;
pub use context::{Context, LimitError, required_limits};
pub use error::BakeError;
#[cfg(feature = "native")]
pub use native::{AdapterSelector, ContextError, adapters};
pub use rays::{Caster, PointBake, UploadedTree};
pub use shaders::Shader;
pub use sweep::{Sweeper, UploadedMesh};
pub use wgpu;

/// Returns every shader of this crate, in every variant that a bake may use.
pub fn shaders() -> Vec<Shader> {
    let mut all = sweep::shaders();
    all.extend(rays::shaders());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shader_is_valid_and_every_wgsl_file_is_used() {
        let all = shaders();
        for shader in &all {
            let module = naga::front::wgsl::parse_str(&shader.source).unwrap_or_else(|e| {
                panic!("{}: {}", shader.name, e.emit_to_string(&shader.source))
            });
            let mut validator = naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::empty(),
            );
            if let Err(e) = validator.validate(&module) {
                panic!("{}: {}", shader.name, e.emit_to_string(&shader.source));
            }
            let found: Vec<_> = module
                .entry_points
                .iter()
                .map(|e| e.name.as_str())
                .collect();
            assert_eq!(found, [shader.entry_point], "{}", shader.name);
        }
        let mut files = 0;
        for folder in ["", "sweep", "rays"] {
            let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("src")
                .join(folder);
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.extension().is_some_and(|e| e == "wgsl") {
                    let text = std::fs::read_to_string(&path).unwrap();
                    assert!(
                        all.iter().any(|s| s.source.contains(&text)),
                        "{}",
                        path.display()
                    );
                    files += 1;
                }
            }
        }
        assert!(files >= 15, "{files}");
    }
}
