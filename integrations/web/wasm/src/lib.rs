//! The baker for browsers: models in, meshes, grids and ray-traced images out.
//!
//! The interface is that of C, so that no binding generator is needed; `src/wasm.ts` of the npm package
//! calls it. Everything runs on the calling thread: a page calls it in a Worker.

mod abi;
mod bake;
mod corners;
mod model;
mod truth;

pub use bake::{Settings, bake};
pub use model::Model;
pub use truth::{Instance, Plane, Truth, View};
