//! The data of a batch: plain buffers, slices and small values on which the code for all SIMD levels
//! works.

mod batch;
mod counters;
mod delta_buffer;
mod edges;
mod facing;
mod lane_deltas;
mod levels;
mod line;
mod texels;

pub(super) use batch::Batch;
pub(super) use counters::{COLUMN, Counter, Layout, MAX_GROUP_COUNTERS, Tile};
pub(super) use delta_buffer::{ByteCounters, DeltaBuffer, GroupCounters};
pub(super) use edges::{
    EDGE_CHUNK, EdgeBuffer, RowSilhouettes, SilhouetteChunk, SilhouetteList, SilhouetteSearch,
};
pub(super) use facing::{EdgeFacing, FacingInterval, TriangleFacing};
pub(super) use lane_deltas::LaneDeltas;
pub(super) use levels::Levels;
pub(super) use line::{End, Line, first_columns, row_side};
pub(super) use texels::{
    BlockTexels, Mask, QUANTITIES, RowMoments, TexelMoment, block_texels, subset_sums,
};
// The hand-written SIMD versions need more.
#[cfg(target_arch = "x86_64")]
pub(super) use {
    delta_buffer::{Delta, delta_bits},
    levels::{FRACTION_BITS, FRACTIONS},
    line::MAX_COLUMN_ERROR,
};
