// What all kernels of the sweep share: the brick of cells, the axis w and the rows of texels
// that a pass is about. Rows of cells run along u; (u, v, w) is right-handed.

struct Frame {
    /// Cells of the brick along u, v and w.
    cells: vec3<u32>,
    /// A cell is 2^bits lattice steps long.
    bits: u32,
    /// The brick's first cell along u, v and w.
    first_cell: vec3<i32>,
    /// Texels along a face's side.
    size: u32,
    /// Numbers of the axes u, v and w.
    axes: vec3<u32>,
    /// Buckets a row of texels, in which fractions of levels are looked up.
    buckets: u32,
    /// The lowest level of the brick over the levels of one whole, and how many there are.
    lowest_whole: i32,
    n_ranks: u32,
    /// Half of what a grows by from one texel to the next, in cells along u per cell along w.
    half_slope: f32,
    /// A piece of work has 2^this steps at most, and at least as many as a block has directions.
    piece_bits: u32,
    n_vertices: u32,
    n_triangles: u32,
    /// Edges of two triangles; they come first.
    n_pairs: u32,
    n_edges: u32,
    n_piercings: u32,
    /// Rows of texels (values of b) in this pass.
    n_rows: u32,
    /// Blocks of directions in this pass, and the first of them.
    first_block: u32,
    n_blocks: u32,
    /// Bounds of the mesh along u, v and w, wider by a cell, relative to the brick's first cell.
    mesh_low: vec3<f32>,
    /// Workgroups that share the pieces of the same edges.
    parts: u32,
    mesh_high: vec3<f32>,
    /// Rows of texels that a workgroup searches its edges for.
    rows_each: u32,
    /// b of each row, in cells along v per cell along w.
    row_slopes: array<vec4<f32>, ROW_SLOPES>,
}

/// The pass.
@group(0) @binding(1) var<uniform> frame: Frame;

/// a of a texel: rounded twice at the most, as is the row's b.
fn texel_slope(texel: u32) -> f32 {
    return f32(2 * i32(texel) + 1 - i32(frame.size)) * frame.half_slope;
}

fn row_slope(row: u32) -> f32 {
    return frame.row_slopes[row / 4u][row % 4u];
}

/// Words that hold the facings of a triangle: a byte a row of texels.
fn facing_words() -> u32 {
    return (frame.n_rows + 3u) / 4u;
}

/// Rows of cells that share a plane V − b·W.
struct Level {
    /// Of −k·b, 0..1; sorted.
    fraction: f32,
    /// Which k has this fraction.
    k: u32,
    /// The whole part of −k·b.
    whole: i32,
    /// The other way round: the place in this order of the k with this entry's number.
    order: u32,
}

/// The directions of a block, as bits, that a triangle faces. A facing has the first texel of
/// the second part in bits 0–6; in bit 7, whether the first part faces the direction.
fn facing_mask(facing: u32, block: u32) -> u32 {
    let turn = clamp(i32(facing & 127u) - i32(block * LANES), 0, i32(LANES));
    let second = (LANE_MASK << u32(turn)) & LANE_MASK;
    return select(second, second ^ LANE_MASK, (facing & 128u) != 0u);
}

/// The lanes of a block that are texels of the face.
fn lanes_of(block: u32) -> u32 {
    return LANE_MASK >> (LANES - min(frame.size - block * LANES, LANES));
}
