// Visibility of points on surfaces in shared directions, by ray casting. A workgroup takes a point and
// some of the directions. Of a direction and its opposite one is above a point.

/// The axis of each point's hemisphere and the normal of its face, two vectors each.
@group(0) @binding(5) var<storage, read> axes: array<vec4<f32>>;
/// The directions, of length 1.
@group(0) @binding(6) var<storage, read> directions: array<vec4<f32>>;
/// The occluded directions of each point as bits.
@group(0) @binding(7) var<storage, read_write> bits: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn points(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let point = chunk.first + group.x;
    let origin = vec3(samples[3u * point], samples[3u * point + 1u], samples[3u * point + 2u]);
    let axis = axes[2u * point].xyz;
    let face = axes[2u * point + 1u].xyz;
    let words = (scene.n_directions + 31u) / 32u;
    let end = min((group.y + 1u) * RAYS_PER_WORKGROUP, scene.n_directions);
    for (var idx = group.y * RAYS_PER_WORKGROUP + local; idx < end; idx += WORKGROUP) {
        let direction = directions[idx].xyz;
        let along = dot(axis, direction);
        // Below the face's own plane a direction counts neither as open nor as occluded.
        if along * dot(face, direction) <= 0.0 {
            continue;
        }
        if is_occluded(ray_from(origin, select(-direction, direction, along > 0.0), 1.0)) {
            atomicOr(&bits[point * words + idx / 32u], 1u << (idx % 32u));
        }
    }
}
