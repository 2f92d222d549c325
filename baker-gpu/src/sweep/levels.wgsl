// The rank of each vertex among the planes in which the rows of cells lie: the one question on
// which everything else hangs. It is asked once for each vertex and row of texels and kept as
// an integer, so that no kernel can round it differently from another.

/// The fractions of levels, found by a fraction's leading bits.
struct Bucket {
    /// The first three that are not below the bucket.
    fractions: vec3<f32>,
    /// How many are.
    start: u32,
}

/// Of each row of texels.
@group(0) @binding(2) var<uniform> levels: array<Level, TABLE>;
/// Of each row of texels.
@group(0) @binding(3) var<uniform> buckets: array<Bucket, TABLE>;
/// In lattice steps: all x, then all y, then all z.
@group(0) @binding(4) var<storage, read> positions: array<i32>;
/// Above the brick's lowest level; a vertex' ranks together.
@group(0) @binding(5) var<storage, read_write> ranks: array<u32>;

fn rank(v: f32, w: f32, row: u32) -> u32 {
    let q = v - row_slope(row) * w;
    let whole = floor(q);
    let fraction = q - whole;
    let n = frame.cells.z;
    let last = frame.buckets - 1u;
    let bucket = buckets[row * frame.buckets + min(u32(fraction * f32(frame.buckets)), last)];
    let is_below = bucket.fractions < vec3(fraction);
    var below = bucket.start + u32(is_below.x) + u32(is_below.y) + u32(is_below.z);
    if is_below.z {
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
