// The uniforms of a pass, shared by all kernels of the sweep: the brick of cells, the axis w and
// the rows of texels that the pass covers. Rows of cells run along u; (u, v, w) is right-handed.

struct Frame {
    /// Cells of the brick along u, v and w.
    cells: vec3<u32>,
    /// A cell is 2^bits lattice steps long.
    bits: u32,
    /// The brick's first cell along u, v and w.
    first_cell: vec3<i32>,
    /// Texels along the side of a face.
    size: u32,
    /// The indices of the axes u, v and w: 0 is x, 1 is y, 2 is z.
    axes: vec3<u32>,
    /// Buckets per row of texels, in which the fractions of levels are looked up.
    buckets_per_row: u32,
    /// The whole part of the brick's lowest level, and the number of levels from there on.
    lowest_whole: i32,
    n_ranks: u32,
    /// Half of the increase of a from one texel to the next, in cells along u per cell along w.
    half_slope: f32,
    /// A piece has at most 2^piece_bits deltas; that is at least the number of directions of a
    /// block.
    piece_bits: u32,
    n_vertices: u32,
    n_triangles: u32,
    /// Interior edges, which have two triangles. They precede the boundary edges.
    n_interior_edges: u32,
    n_edges: u32,
    /// Candidates for row hits.
    n_candidates: u32,
    /// Rows of texels (values of b) in this pass.
    n_rows: u32,
    /// The first block of directions in this pass, and their number.
    first_block: u32,
    n_blocks: u32,
    /// Bounds of the mesh along u, v and w in cells, enlarged by a cell, relative to the brick's
    /// first cell.
    mesh_low: vec3<f32>,
    /// Workgroups (along z) that share the pieces of the same edges.
    n_parts: u32,
    mesh_high: vec3<f32>,
    /// Rows of texels for which a workgroup searches its edges.
    rows_per_workgroup: u32,
    /// b of each row, in cells along v per cell along w.
    row_slopes: array<vec4<f32>, ROW_SLOPE_VECTORS>,
}

/// The uniforms of the pass.
@group(0) @binding(1) var<uniform> frame: Frame;

/// a of a texel in cells along u per cell along w. Rounded at most twice, like b of a row.
fn texel_slope(texel: u32) -> f32 {
    return f32(2 * i32(texel) + 1 - i32(frame.size)) * frame.half_slope;
}

/// b of a row of texels in cells along v per cell along w.
fn row_slope(row: u32) -> f32 {
    return frame.row_slopes[row / 4u][row % 4u];
}

/// The number of words that hold the facing intervals of a triangle, a byte per row of texels.
fn interval_words() -> u32 {
    return (frame.n_rows + 3u) / 4u;
}

/// A level: the plane V − b·W that holds rows (j, k) of cells. A table of levels is sorted by
/// their fractions.
struct Level {
    /// The fractional part of −k·b, 0..1.
    fraction: f32,
    /// The k that has this fraction.
    k: u32,
    /// The whole part of −k·b.
    whole: i32,
    /// The inverse permutation: entry number k holds the index of that k in the sorted table.
    order: u32,
}

/// The lanes of a block whose directions a triangle faces. A facing interval holds in bits 0–6
/// the texel from which on the facing flips, and in bit 7 whether the triangle faces the
/// directions before it.
fn facing_mask(interval: u32, block: u32) -> u32 {
    let flip_lane = clamp(i32(interval & 127u) - i32(block * LANES), 0, i32(LANES));
    let after_flip = (LANE_MASK << u32(flip_lane)) & LANE_MASK;
    return select(after_flip, after_flip ^ LANE_MASK, (interval & 128u) != 0u);
}

/// The lanes of a block that are texels of the face.
fn lanes_of(block: u32) -> u32 {
    return LANE_MASK >> (LANES - min(frame.size - block * LANES, LANES));
}
