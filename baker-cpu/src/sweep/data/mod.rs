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
pub(super) use delta_buffer::{ByteCounters, Delta, DeltaBuffer, GroupCounters, delta_bits};
pub(super) use edges::{
    EDGE_CHUNK, EdgeBuffer, RowSilhouettes, SilhouetteChunk, SilhouetteList, SilhouetteSearch,
};
pub(super) use facing::{EdgeFacing, FacingInterval, TriangleFacing};
pub(super) use lane_deltas::LaneDeltas;
pub(super) use levels::{FRACTION_BITS, FRACTIONS, Levels};
pub(super) use line::{End, Line, MAX_COLUMN_ERROR, first_columns, row_side};
pub(super) use texels::{
    BlockTexels, Mask, QUANTITIES, RowMoments, TexelMoment, block_texels, subset_sums,
};
