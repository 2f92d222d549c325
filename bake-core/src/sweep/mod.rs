//! The geometry that every baker's direction sweep shares: the grid seen along an axis, the texels
//! of its directions, and the rows of cells whose lines come near a triangle.
//!
//! The sweep itself is explained by the CPU baker's `sweep` module.

mod axis_frame;
mod row_search;
mod texel_index;

pub use axis_frame::AxisFrame;
pub use row_search::{RowClass, RowSearch};
pub use texel_index::{LANES, texel_idx};
