// aogrid: an occluder, the place at which a receiver looks up its grid, and what is left of a cone in
// the far field. Behind the constants; `shading.wgsl` follows. The CPU twin is `lookup.rs`.

/// One occluder, in a uniform or storage buffer: 176 bytes. Rust: `AogridOccluder::new`.
struct AogridOccluder {
    /// The rows of grid_from_world, which maps world positions to [0,1]^3 of the grid's box.
    grid_x: vec4f,
    grid_y: vec4f,
    grid_z: vec4f,
    /// The rows of the map from a texel's rgb to the cone's axis in world space, towards the
    /// occluder. The map includes the decoding of the direction and about keeps the stored axis's
    /// length.
    axis_x: vec4f,
    axis_y: vec4f,
    axis_z: vec4f,
    /// The ids of receivers that it does not shade; AOGRID_NO_OBJECT in unused slots.
    excluded: vec4u,
    /// Its own id, for occlusion-only shading; AOGRID_NO_OBJECT if it has none.
    object_id: u32,
    /// A mask: the occluder shades receivers that share a bit with it.
    layers: u32,
    /// The strength of the occlusion: 0 for none, 1 as baked.
    strength: f32,
    /// The length that axes have at least: 0 for soft cones, 1 for hard ones.
    min_axis_length: f32,
    /// The factors of a position relative to the box's center, in [-1/2,1/2]^3, that reach 1 where
    /// the occluder's effect ends.
    per_extent: vec3f,
    /// The distance from the center at which the effect ends, in half-extents of the hull of the
    /// outer cells' centers; 1 without a far field, where it ends at the box.
    reach: f32,
    /// The box's center in world space.
    center: vec3f,
    /// 1 if the grid stores the root of a, 0 if it stores a.
    stores_root: f32,
    /// The number of cells along each axis.
    cells: vec3f,
    /// The distance along its normal, in cells, at which a receiver on the occluder itself looks up
    /// the grid.
    self_offset: f32,
}

/// The place at which a receiver looks up a grid, see `aogrid_lookup`.
struct AogridLookup {
    /// The position in the grid's box, [0,1]^3. Beyond the hull of the outer cells' centers it is
    /// the point of the hull in the direction of the receiver.
    position: vec3f,
    /// Whether the occluder has an effect on the receiver.
    is_reached: bool,
    /// The direction from the box's center to the receiver in world space, times the distance beyond
    /// the hull in its half-extents; zero in the hull.
    outward: vec3f,
    /// The share that is left of the hull's squared sine of alpha: 1 in the hull, 0 where the effect
    /// ends.
    remainder: f32,
}

/// Whether the occluder shades a receiver with this id and these layers.
fn aogrid_shades(occluder: AogridOccluder, object_id: u32, layers: u32) -> bool {
    return (occluder.layers & layers) != 0u && all(occluder.excluded != vec4u(object_id));
}

/// Whether a receiver with this id belongs to the occluder.
fn aogrid_is_on_itself(occluder: AogridOccluder, object_id: u32) -> bool {
    return object_id == occluder.object_id && object_id != AOGRID_NO_OBJECT;
}

/// Applies a row of an affine map to a point: three fused multiply-adds.
fn aogrid_row(row: vec4f, v: vec3f) -> f32 {
    return fma(row.x, v.x, fma(row.y, v.y, fma(row.z, v.z, row.w)));
}

/// The position of a world-space point in the grid's box, [0,1]^3.
fn aogrid_grid_position(occluder: AogridOccluder, position: vec3f) -> vec3f {
    return vec3f(
        aogrid_row(occluder.grid_x, position),
        aogrid_row(occluder.grid_y, position),
        aogrid_row(occluder.grid_z, position),
    );
}

/// The place at which a receiver at a world-space position looks up the grid; not reached for NaN.
/// In the far field it is on the hull of the outer cells' centers, on the ray from the box's center.
fn aogrid_lookup(occluder: AogridOccluder, position: vec3f) -> AogridLookup {
    let p_grid = aogrid_grid_position(occluder, position);
    let off_center = p_grid - 0.5;
    let scaled = abs(off_center) * occluder.per_extent;
    // 1 where the effect ends.
    let distance = max(max(scaled.x, scaled.y), scaled.z);
    // The same in half-extents of the hull.
    let s = distance * occluder.reach;
    var lookup = AogridLookup(p_grid, distance <= 1.0, vec3f(), 1.0);
    if lookup.is_reached && s > 1.0 {
        let fade = saturate(fma(4.0, distance, -3.0));
        lookup.position = off_center / s + 0.5;
        lookup.outward = (s - 1.0) * normalize(position - occluder.center);
        lookup.remainder = fma(fade * fade, fma(2.0, fade, -3.0), 1.0) / (s * s);
    }
    return lookup;
}

/// `aogrid_lookup` for a receiver that belongs to the occluder itself. Cells inside the object are
/// filled from outside; a fraction of a cell along the unit normal they weigh little.
fn aogrid_lookup_on_itself(occluder: AogridOccluder, position: vec3f, normal: vec3f)
    -> AogridLookup {
    let cells = occluder.cells * vec3f(
        dot(occluder.grid_x.xyz, normal),
        dot(occluder.grid_y.xyz, normal),
        dot(occluder.grid_z.xyz, normal),
    );
    let distance = occluder.self_offset * inverseSqrt(max(dot(cells, cells), AOGRID_SQUARE_EPSILON));
    return aogrid_lookup(occluder, fma(normal, vec3f(distance), position));
}

/// The fraction that a sphere occludes farther away, where a share `remainder` is left of its
/// squared sine of alpha. The part of a fraction beyond one half fades as fast.
fn aogrid_distant_fraction(a: f32, remainder: f32) -> f32 {
    let cos_alpha = fma(-2.0, a, 1.0);
    let in_front = max(cos_alpha, 0.0);
    let square = fma(fma(in_front, in_front, -1.0), remainder, 1.0);
    let behind = min(cos_alpha, 0.0) * remainder;
    return fma(-0.5, sqrt(max(square, 0.0)) + behind, 0.5);
}

/// The axis towards what an axis at the hull points to, from farther away (see
/// `AogridLookup.outward`). It keeps its length.
fn aogrid_distant_axis(axis: vec3f, outward: vec3f) -> vec3f {
    let per_length = aogrid_inverse_length(axis);
    let towards = axis * per_length - outward;
    return towards * (aogrid_inverse_length(towards) * dot(axis, axis) * per_length);
}

/// 1 / |axis|, bounded for axes below the length that counts as no axis.
fn aogrid_inverse_length(axis: vec3f) -> f32 {
    let square = fma(axis.x, axis.x, fma(axis.y, axis.y, axis.z * axis.z));
    return inverseSqrt(max(square, AOGRID_AXIS_EPSILON));
}
