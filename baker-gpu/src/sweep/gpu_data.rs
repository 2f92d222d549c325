//! Mirror structs of the sweep's shaders; their layout is asserted against naga's.

use bytemuck::{Pod, Zeroable};

/// The largest number of rows of texels in a pass.
pub(super) const MAX_ROWS: u32 = 16;

/// The largest number of batches in a pass: as many as a pair in `crossings.wgsl` has bits for.
/// More batches would occupy more of a large GPU, but fit less well into its cache.
pub(super) const MAX_BATCHES: u32 = 16;

/// The number of subset sums per batch: the 16 subsets of each of the eight groups of four bits of
/// a mask.
pub(super) const SUBSET_SUMS: u32 = 128;
const _: () = assert!((MAX_BATCHES * SUBSET_SUMS) as usize <= TABLE_LEN && MAX_ROWS <= MAX_BATCHES);

/// The number of entries of a uniform table, 16 bytes each: all that WebGPU guarantees.
pub(super) const TABLE_LEN: usize = 4096;

/// `Frame` of `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Frame {
    pub cells: [u32; 3],
    pub bits: u32,
    pub first_cell: [i32; 3],
    pub size: u32,
    pub axes: [u32; 3],
    pub buckets_per_row: u32,
    pub lowest_whole: i32,
    pub n_ranks: u32,
    pub half_slope: f32,
    pub piece_bits: u32,
    pub n_vertices: u32,
    pub n_triangles: u32,
    pub n_interior_edges: u32,
    pub n_edges: u32,
    pub n_candidates: u32,
    pub n_rows: u32,
    pub first_block: u32,
    pub n_blocks: u32,
    pub mesh_low: [f32; 3],
    pub n_parts: u32,
    pub mesh_high: [f32; 3],
    pub rows_per_workgroup: u32,
    pub row_slopes: [f32; MAX_ROWS as usize],
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

/// `RowHitCandidate` of `row_hits.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(super) struct RowHitCandidate {
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

    fn shader(name: &str) -> crate::Shader {
        let mut shaders = crate::shaders().into_iter();
        shaders.find(|s| s.name == name).unwrap()
    }

    #[test]
    fn uniforms_have_the_layout_of_the_shaders() {
        let frame = [
            ("cells", offset_of!(Frame, cells)),
            ("bits", offset_of!(Frame, bits)),
            ("first_cell", offset_of!(Frame, first_cell)),
            ("size", offset_of!(Frame, size)),
            ("axes", offset_of!(Frame, axes)),
            ("buckets_per_row", offset_of!(Frame, buckets_per_row)),
            ("lowest_whole", offset_of!(Frame, lowest_whole)),
            ("n_ranks", offset_of!(Frame, n_ranks)),
            ("half_slope", offset_of!(Frame, half_slope)),
            ("piece_bits", offset_of!(Frame, piece_bits)),
            ("n_vertices", offset_of!(Frame, n_vertices)),
            ("n_triangles", offset_of!(Frame, n_triangles)),
            ("n_interior_edges", offset_of!(Frame, n_interior_edges)),
            ("n_edges", offset_of!(Frame, n_edges)),
            ("n_candidates", offset_of!(Frame, n_candidates)),
            ("n_rows", offset_of!(Frame, n_rows)),
            ("first_block", offset_of!(Frame, first_block)),
            ("n_blocks", offset_of!(Frame, n_blocks)),
            ("mesh_low", offset_of!(Frame, mesh_low)),
            ("n_parts", offset_of!(Frame, n_parts)),
            ("mesh_high", offset_of!(Frame, mesh_high)),
            ("rows_per_workgroup", offset_of!(Frame, rows_per_workgroup)),
            ("row_slopes", offset_of!(Frame, row_slopes)),
        ];
        let crossings = shader("sweep: crossings");
        assert_layout(&crossings, "Frame", size_of::<Frame>(), &frame);
    }

    #[test]
    fn tables_and_candidates_have_the_layout_of_the_shaders() {
        let level = [
            ("fraction", offset_of!(Level, fraction)),
            ("k", offset_of!(Level, k)),
            ("whole", offset_of!(Level, whole)),
            ("order", offset_of!(Level, order)),
        ];
        let crossings = shader("sweep: crossings");
        assert_layout(&crossings, "Level", size_of::<Level>(), &level);
        let bucket = [
            ("fractions", offset_of!(Bucket, fractions)),
            ("start", offset_of!(Bucket, start)),
        ];
        assert_layout(
            &shader("sweep: levels"),
            "Bucket",
            size_of::<Bucket>(),
            &bucket,
        );
        let candidate = [
            ("corners", offset_of!(RowHitCandidate, corners)),
            ("triangle", offset_of!(RowHitCandidate, triangle)),
            ("row", offset_of!(RowHitCandidate, row)),
            ("column", offset_of!(RowHitCandidate, column)),
            ("edges", offset_of!(RowHitCandidate, edges)),
            ("unused", offset_of!(RowHitCandidate, unused)),
        ];
        let size = size_of::<RowHitCandidate>();
        let row_hits = shader("sweep: piercings");
        assert_layout(&row_hits, "RowHitCandidate", size, &candidate);
    }
}
