// aogrid: an occluder, the place at which a receiver looks up its grid, and what is left of a cone in
// the far field. Behind the constants; `shading.wgsl` follows. The CPU twin is `lookup.rs`.

/// One occluder, in a uniform or storage buffer: 208 bytes. Rust: `AogridOccluder::new`.
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
    /// The factors of a position relative to the box's center, in [-1/2,1/2]^3, that reach 1 at the
    /// hull of the outer cells' centers; without a far field, at the box.
    per_hull: vec3f,
    /// 4, which turns distances from 3/4 to 1 of the reach into a fade; 0 without a far field.
    fade_scale: f32,
    /// The factors of the same position that reach 1 where the effect ends.
    per_reach: vec3f,
    /// a is alpha times alpha, or times this if it is larger: 0 if the grid stores the root of a, 1 if
    /// it stores a.
    min_factor: f32,
    /// The box's center in world space.
    center: vec3f,
    /// The cells along each axis over the distance along its normal, in cells, at which a receiver
    /// on the occluder itself looks up the grid.
    per_step: vec3f,
    /// The object's flatness tells how fast its far field falls: 0 like a sphere's, 1 like a disc's
    /// that faces the receiver. It is w plus x, y and z times the squares of the point on the hull.
    flatness: vec4f,
}

/// The place at which a receiver looks up a grid, see `aogrid_lookup`.
struct AogridLookup {
    /// The position in the grid's box, [0,1]^3. Beyond the hull of the outer cells' centers it is
    /// the point of the hull in the direction of the receiver.
    position: vec3f,
    /// Whether the occluder has an effect on the receiver.
    is_reached: bool,
    /// The vector from the box's center to the receiver in world space.
    outward: vec3f,
    /// The distance from the center in half-extents of the hull, at least 1.
    distance: f32,
    /// The share that is left of the hull's solid angle, to first order: it falls with the distance
    /// squared, and fades to nothing over the last quarter of the reach.
    remainder: f32,
    /// The object's flatness from this direction.
    flatness: f32,
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
    let off_center = aogrid_grid_position(occluder, position) - 0.5;
    let scaled = abs(off_center) * occluder.per_hull;
    let distance = max(max(scaled.x, scaled.y), max(scaled.z, 1.0));
    let per_distance = 1.0 / distance;
    let at = fma(off_center, vec3f(per_distance), vec3f(0.5));
    let of_reach = abs(off_center) * occluder.per_reach;
    let share = max(max(of_reach.x, of_reach.y), of_reach.z);
    let fade = saturate(fma(share, occluder.fade_scale, -3.0));
    let square = per_distance * per_distance;
    let remainder = fma(fade * fade, fma(2.0, fade, -3.0), 1.0) * square;
    let flatness = fma(dot(scaled * scaled, occluder.flatness.xyz), square, occluder.flatness.w);
    let outward = position - occluder.center;
    return AogridLookup(at, share <= 1.0, outward, distance, remainder, flatness);
}

/// `aogrid_lookup` for a receiver that belongs to the occluder itself. Cells inside the object are
/// filled from outside; a fraction of a cell along the unit normal they weigh little.
fn aogrid_lookup_on_itself(occluder: AogridOccluder, position: vec3f, normal: vec3f)
    -> AogridLookup {
    let steps = occluder.per_step * vec3f(
        dot(occluder.grid_x.xyz, normal),
        dot(occluder.grid_y.xyz, normal),
        dot(occluder.grid_z.xyz, normal),
    );
    let distance = inverseSqrt(max(dot(steps, steps), AOGRID_SQUARE_EPSILON));
    return aogrid_lookup(occluder, fma(normal, vec3f(distance), position));
}

/// The fraction that an object occludes farther away, which occludes the fraction `a` at the hull. A
/// sphere's squared sine of alpha, k, falls with the distance squared, a disc's squared tangent does:
/// 1/k is the flatness and a multiple of the distance squared. The part of a fraction beyond one half
/// falls with the remainder.
fn aogrid_distant_fraction(a: f32, lookup: AogridLookup) -> f32 {
    // The cosine of alpha, its positive and its negative part.
    let in_front = saturate(fma(-2.0, a, 1.0));
    let behind = saturate(fma(2.0, a, -1.0));
    let at_hull = fma(-in_front, in_front, 1.0);
    let flat = min(lookup.flatness * at_hull, AOGRID_MAX_FLATNESS);
    let k = at_hull * lookup.remainder / fma(lookup.remainder, flat, 1.0 - flat);
    return fma(-0.5, fma(-behind, lookup.remainder, sqrt(saturate(1.0 - k))), 0.5);
}

/// The unit axis towards what a unit axis at the hull points to, from where the look-up is.
fn aogrid_distant_axis(axis: vec3f, lookup: AogridLookup) -> vec3f {
    let scale = (1.0 - lookup.distance) * inverseSqrt(dot(lookup.outward, lookup.outward));
    let towards = fma(lookup.outward, vec3f(scale), axis);
    return towards * aogrid_inverse_length(towards);
}

/// 1 / |axis|, bounded for axes below the length that counts as no axis.
fn aogrid_inverse_length(axis: vec3f) -> f32 {
    let square = fma(axis.x, axis.x, fma(axis.y, axis.y, axis.z * axis.z));
    return inverseSqrt(max(square, AOGRID_AXIS_EPSILON));
}
