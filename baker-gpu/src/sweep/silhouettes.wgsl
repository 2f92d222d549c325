// How triangles face the directions of each row of texels: n·d is linear in the texel's number
// and changes its sign once. Found once for each triangle and row, so that all its edges agree.

/// Exact normals, rounded once: all x, then all y, then all z.
@group(0) @binding(2) var<storage, read> normals: array<f32>;
/// Four rows' bytes a word, a triangle's words together.
@group(0) @binding(3) var<storage, read_write> facings: array<u32>;

/// n_u·a + n_v·b + n_w > 0 is z > T for n_u > 0 and z < T for n_u < 0.
fn facing(normal: vec3<f32>, steep: f32, slope: f32) -> u32 {
    let first = select(0u, 1u, normal.x < 0.0);
    let size = f32(frame.size);
    let threshold = (size - 1.0) / 2.0 - steep * (normal.z + normal.y * slope);
    // The number of z ≤ T, 0..=size.
    let turn = u32(clamp(threshold, -1.0, size - 1.0) + 1.0);
    // "None" is "all, the other way round".
    return select(turn | (first << 7u), (first ^ 1u) << 7u, turn == frame.size);
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
    let least = max(LEAST_SHARE * (abs(normal.y) + abs(normal.z)), LEAST_NORMAL);
    let steepness = 0.5 / (frame.half_slope * max(abs(normal.x), least));
    let steep = select(steepness, -steepness, normal.x < 0.0);
    let words = facing_words();
    for (var word = 0u; word < words; word++) {
        let slopes = frame.row_slopes[word];
        facings[triangle * words + word] = facing(normal, steep, slopes.x)
            | (facing(normal, steep, slopes.y) << 8u)
            | (facing(normal, steep, slopes.z) << 16u)
            | (facing(normal, steep, slopes.w) << 24u);
    }
}
