// The facing intervals of the triangles: for each row of texels, the directions that a triangle
// faces. n·d is linear in the texel index and changes its sign once. It is computed once for each
// triangle and row, so that all edges of the triangle agree.

/// Exact normals, rounded once: all x, then all y, then all z.
@group(0) @binding(2) var<storage, read> normals: array<f32>;
/// A byte per row of texels, see `facing_mask`; a triangle's words are consecutive.
@group(0) @binding(3) var<storage, read_write> facing_intervals: array<u32>;

/// The facing interval of a triangle and a row of texels. n_u·a + n_v·b + n_w > 0 holds for
/// texels z > T if n_u > 0, and for z < T if n_u < 0.
fn facing_interval(normal: vec3<f32>, texels_per_normal: f32, slope: f32) -> u32 {
    let faces_first = select(0u, 1u, normal.x < 0.0);
    let size = f32(frame.size);
    let threshold = (size - 1.0) / 2.0 - texels_per_normal * (normal.z + normal.y * slope);
    // The number of texels z ≤ T, 0..=size.
    let flip_texel = u32(clamp(threshold, -1.0, size - 1.0) + 1.0);
    // A flip after the last texel is stored as the inverse facing that flips before the first:
    // `size` may not fit in seven bits.
    return select(
        flip_texel | (faces_first << 7u),
        (faces_first ^ 1u) << 7u,
        flip_texel == frame.size,
    );
}

@compute @workgroup_size(WORKGROUP)
fn silhouettes(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let triangle = (chunk.first + group.x) * WORKGROUP + local;
    if triangle >= frame.n_triangles {
        return;
    }
    let n = frame.n_triangles;
    let axes = frame.axes * n + triangle;
    let normal = vec3(normals[axes.x], normals[axes.y], normals[axes.z]);
    // Avoid a division by zero for normals perpendicular to u.
    let min_normal_u = max(MIN_NORMAL_RATIO * (abs(normal.y) + abs(normal.z)), MIN_NORMAL);
    let magnitude = 0.5 / (frame.half_slope * max(abs(normal.x), min_normal_u));
    let texels_per_normal = select(magnitude, -magnitude, normal.x < 0.0);
    let words = interval_words();
    for (var word = 0u; word < words; word++) {
        let slopes = frame.row_slopes[word];
        facing_intervals[triangle * words + word] =
            facing_interval(normal, texels_per_normal, slopes.x)
            | (facing_interval(normal, texels_per_normal, slopes.y) << 8u)
            | (facing_interval(normal, texels_per_normal, slopes.z) << 16u)
            | (facing_interval(normal, texels_per_normal, slopes.w) << 24u);
    }
}
