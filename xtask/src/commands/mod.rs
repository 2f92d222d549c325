//! The commands, one file each.

pub(crate) mod adapters;
pub(crate) mod bake;
pub(crate) mod bench;
pub(crate) mod ci;
pub(crate) mod diff;
pub(crate) mod export;
pub(crate) mod info;
pub(crate) mod model;
pub(crate) mod render;
pub(crate) mod shader_cost;
pub(crate) mod slices;
pub(crate) mod tables;
pub(crate) mod verify;
pub(crate) mod verify_bake;
