//! The commands for developers, one file each.

pub(crate) mod bench;
pub(crate) mod bench_shading;
pub(crate) mod ci;
pub(crate) mod reproduce;
pub(crate) mod shader_cost;
pub(crate) mod tables;
pub(crate) mod verify_bake;
