// The rank of each vertex among the planes in which the rows of cells lie. All later decisions
// depend on it. It is computed once for each vertex and row of texels and stored as an integer,
// so that no two kernels can round it differently.

/// A bucket of a table that finds the levels near a fraction from the fraction's leading bits.
struct Bucket {
    /// The first three fractions of levels that are not below the bucket.
    fractions: vec3<f32>,
    /// The number of levels below the bucket.
    start: u32,
}

/// The levels of each row of texels.
@group(0) @binding(2) var<uniform> levels: array<Level, TABLE_LEN>;
/// The buckets of each row of texels.
@group(0) @binding(3) var<uniform> buckets: array<Bucket, TABLE_LEN>;
/// Vertex positions in lattice steps: all x, then all y, then all z.
@group(0) @binding(4) var<storage, read> positions: array<i32>;
/// The ranks of each vertex, one per row of texels, counted from the brick's lowest level.
@group(0) @binding(5) var<storage, read_write> ranks: array<u32>;

/// The number of levels below a position (v, w) in cells, counted from the brick's lowest level.
fn rank(v: f32, w: f32, row: u32) -> u32 {
    let q = v - row_slope(row) * w;
    let whole = floor(q);
    let fraction = q - whole;
    let n = frame.cells.z;
    let last = frame.buckets_per_row - 1u;
    // Count the levels with a smaller fraction.
    let bucket = buckets[
        row * frame.buckets_per_row + min(u32(fraction * f32(frame.buckets_per_row)), last)
    ];
    let is_below = bucket.fractions < vec3(fraction);
    var below = bucket.start + u32(is_below.x) + u32(is_below.y) + u32(is_below.z);
    if is_below.z {
        // The bucket may hold more than three.
        while below < n && levels[row * n + below].fraction < fraction {
            below++;
        }
    }
    let number = (i32(whole) - frame.lowest_whole) * i32(n) + i32(below);
    return u32(clamp(number, 0, i32(frame.n_ranks)));
}

@compute @workgroup_size(WORKGROUP)
fn levels_of_vertices(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let vertex = (chunk.first + group.x) * WORKGROUP + local;
    if vertex >= frame.n_vertices {
        return;
    }
    let axes = frame.axes * frame.n_vertices + vertex;
    let cell = 1.0 / f32(1u << frame.bits);
    let v = f32(positions[axes.y]) * cell;
    let w = f32(positions[axes.z]) * cell;
    for (var row = 0u; row < frame.n_rows; row++) {
        ranks[vertex * frame.n_rows + row] = rank(v, w, row);
    }
}
