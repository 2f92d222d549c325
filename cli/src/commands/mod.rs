//! The commands, one file each.

pub(crate) mod adapters;
pub(crate) mod attach;
pub(crate) mod bake;
pub(crate) mod bake_surface;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod detach;
pub(crate) mod diff;
pub(crate) mod export;
pub(crate) mod info;
pub(crate) mod man;
pub(crate) mod model;
pub(crate) mod preview;
pub(crate) mod render;
pub(crate) mod slices;
pub(crate) mod verify;
