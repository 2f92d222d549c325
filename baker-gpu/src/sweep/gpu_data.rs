//! Structures as shaders see them; their layout is asserted against naga's.

use bytemuck::{Pod, Zeroable};

/// Rows of texels in a pass, at most.
pub(super) const MOST_ROWS: u32 = 16;

/// Batches in a pass, at most: as many as a pair of `crossings.wgsl` has bits for. More would
/// feed more of a large GPU, and their counters would stay in less of its cache.
pub(super) const MOST_BATCHES: u32 = 16;

/// Sums of shares a batch: of each set of four bits, for the eight fours of a mask.
pub(super) const SHARES: u32 = 128;
const _: () = assert!((MOST_BATCHES * SHARES) as usize <= TABLE && MOST_ROWS <= MOST_BATCHES);

/// Entries of the uniform tables: with 16 bytes each, all that WebGPU guarantees.
pub(super) const TABLE: usize = 4096;

/// `Frame` of `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Frame {
    pub cells: [u32; 3],
    pub bits: u32,
    pub first_cell: [i32; 3],
    pub size: u32,
    pub axes: [u32; 3],
    pub buckets: u32,
    pub lowest_whole: i32,
    pub n_ranks: u32,
    pub half_slope: f32,
    pub piece_bits: u32,
    pub n_vertices: u32,
    pub n_triangles: u32,
    pub n_pairs: u32,
    pub n_edges: u32,
    pub n_piercings: u32,
    pub n_rows: u32,
    pub first_block: u32,
    pub n_blocks: u32,
    pub mesh_low: [f32; 3],
    pub parts: u32,
    pub mesh_high: [f32; 3],
    pub rows_each: u32,
    pub row_slopes: [f32; MOST_ROWS as usize],
}

/// `Level` of `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(super) struct Level {
    pub fraction: f32,
    pub k: u32,
    pub whole: i32,
    pub order: u32,
}

/// `Bucket` of `levels.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Bucket {
    pub fractions: [f32; 3],
    pub start: u32,
}

/// `Piercing` of `piercings.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(super) struct Piercing {
    pub corners: [u32; 3],
    pub triangle: u32,
    pub row: u32,
    pub column: u32,
    pub edges: u32,
    pub unused: u32,
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::*;
    use crate::layout_test::assert_layout;

    #[test]
    fn structures_are_laid_out_as_shaders_see_them() {
        let shaders = crate::shaders();
        let shader = |name| shaders.iter().find(|s| s.name == name).unwrap();
        let frame = [
            ("cells", offset_of!(Frame, cells)),
            ("bits", offset_of!(Frame, bits)),
            ("first_cell", offset_of!(Frame, first_cell)),
            ("size", offset_of!(Frame, size)),
            ("axes", offset_of!(Frame, axes)),
            ("buckets", offset_of!(Frame, buckets)),
            ("lowest_whole", offset_of!(Frame, lowest_whole)),
            ("n_ranks", offset_of!(Frame, n_ranks)),
            ("half_slope", offset_of!(Frame, half_slope)),
            ("piece_bits", offset_of!(Frame, piece_bits)),
            ("n_vertices", offset_of!(Frame, n_vertices)),
            ("n_triangles", offset_of!(Frame, n_triangles)),
            ("n_pairs", offset_of!(Frame, n_pairs)),
            ("n_edges", offset_of!(Frame, n_edges)),
            ("n_piercings", offset_of!(Frame, n_piercings)),
            ("n_rows", offset_of!(Frame, n_rows)),
            ("first_block", offset_of!(Frame, first_block)),
            ("n_blocks", offset_of!(Frame, n_blocks)),
            ("mesh_low", offset_of!(Frame, mesh_low)),
            ("parts", offset_of!(Frame, parts)),
            ("mesh_high", offset_of!(Frame, mesh_high)),
            ("rows_each", offset_of!(Frame, rows_each)),
            ("row_slopes", offset_of!(Frame, row_slopes)),
        ];
        let crossings = shader("sweep: crossings");
        assert_layout(crossings, "Frame", size_of::<Frame>(), &frame);
        let level = [
            ("fraction", offset_of!(Level, fraction)),
            ("k", offset_of!(Level, k)),
            ("whole", offset_of!(Level, whole)),
            ("order", offset_of!(Level, order)),
        ];
        assert_layout(crossings, "Level", size_of::<Level>(), &level);
        let bucket = [
            ("fractions", offset_of!(Bucket, fractions)),
            ("start", offset_of!(Bucket, start)),
        ];
        assert_layout(
            shader("sweep: levels"),
            "Bucket",
            size_of::<Bucket>(),
            &bucket,
        );
        let piercing = [
            ("corners", offset_of!(Piercing, corners)),
            ("triangle", offset_of!(Piercing, triangle)),
            ("row", offset_of!(Piercing, row)),
            ("column", offset_of!(Piercing, column)),
            ("edges", offset_of!(Piercing, edges)),
            ("unused", offset_of!(Piercing, unused)),
        ];
        let piercings = shader("sweep: piercings");
        assert_layout(piercings, "Piercing", size_of::<Piercing>(), &piercing);
    }
}
