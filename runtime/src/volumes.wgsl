// aogrid: ambient occlusion volumes (McGuire 2010), the analytic occlusion of single triangles.
//
// Pure functions, to paste behind `constants.wgsl`. Sum aogrid_volume_occlusion over the triangles
// near a receiver, and multiply ambient light by 1 - min(sum, 1). The CPU twin, `volumes.rs`, has the
// same functions under the same names.

/// The extent and weight of volumes, in a uniform: 16 bytes. Rust: `AogridVolume`.
struct AogridVolume {
    /// The distance at which occlusion ends, in world units.
    extent: f32,
    /// The exponent of the fall-off along the triangle's normal.
    exponent: f32,
    /// AOGRID_WEIGHT_NONE, AOGRID_WEIGHT_LINEAR or AOGRID_WEIGHT_EDGES.
    weight: u32,
    /// Whether triangles occlude on both sides; otherwise only where they face the receiver.
    two_sided: u32,
}

/// A polygon of up to four corners relative to a receiver. Fewer repeat the last one.
struct AogridPolygon {
    corners: array<vec3f, 4>,
}

/// The occlusion of a receiver by a triangle, 0..1: its form factor times the weight of its volume.
/// The corners are relative to the receiver, counter-clockwise as seen from the front; `normal` is the
/// receiver's unit normal.
fn aogrid_volume_occlusion(volume: AogridVolume, a: vec3f, b: vec3f, c: vec3f, normal: vec3f) -> f32 {
    let scaled_normal = cross(b - a, c - a);
    let area = dot(scaled_normal, scaled_normal);
    if !(area > AOGRID_SQUARE_EPSILON) {
        return 0.0;
    }
    let facing = scaled_normal * inverseSqrt(area);
    let height = -dot(a, facing);
    let above = select(height, abs(height), volume.two_sided != 0u);
    if !(above > 0.0 && above < volume.extent) {
        return 0.0;
    }
    let weight = aogrid_volume_weight(volume, a, b, c, facing, height);
    return weight * aogrid_form_factor(aogrid_above_horizon(a, b, c, normal), normal);
}

/// The weight of a triangle's volume at a receiver at a signed height over its plane, 0..1.
fn aogrid_volume_weight(volume: AogridVolume, a: vec3f, b: vec3f, c: vec3f, facing: vec3f,
                        height: f32) -> f32 {
    let per_extent = 1.0 / volume.extent;
    // The corners relative to the receiver's foot in the triangle's plane.
    let foot = height * facing;
    let outside = vec3f(
        aogrid_edge_distance(a + foot, b + foot, facing),
        aogrid_edge_distance(b + foot, c + foot, facing),
        aogrid_edge_distance(c + foot, a + foot, facing),
    );
    if volume.weight == AOGRID_WEIGHT_EDGES {
        let ramps = saturate(1.0 - outside * per_extent);
        return ramps.x * ramps.y * ramps.z * aogrid_fall_off(volume, height);
    }
    let is_inside = all(outside <= vec3f(0.0));
    let distance = select(aogrid_distance(a + foot, b + foot, c + foot), 0.0, is_inside);
    if volume.weight == AOGRID_WEIGHT_NONE {
        return select(0.0, 1.0, distance < volume.extent);
    }
    return saturate(fma(-distance, per_extent, 1.0)) * aogrid_fall_off(volume, height);
}

/// The fall-off along the triangle's normal, 1 on its plane.
fn aogrid_fall_off(volume: AogridVolume, height: f32) -> f32 {
    let left = saturate(1.0 - abs(height) / volume.extent);
    return select(0.0, pow(left, volume.exponent), left > 0.0);
}

/// The signed distance of the origin beyond the edge from a to b in the plane with this normal.
fn aogrid_edge_distance(a: vec3f, b: vec3f, facing: vec3f) -> f32 {
    let along = b - a;
    let outward = cross(along, facing);
    return -dot(a, outward) * inverseSqrt(max(dot(outward, outward), AOGRID_SQUARE_EPSILON));
}

/// The distance of the origin from the edges of a triangle.
fn aogrid_distance(a: vec3f, b: vec3f, c: vec3f) -> f32 {
    let squared = min(min(aogrid_segment(a, b), aogrid_segment(b, c)), aogrid_segment(c, a));
    return sqrt(squared);
}

/// The squared distance of the origin from a segment.
fn aogrid_segment(a: vec3f, b: vec3f) -> f32 {
    let along = b - a;
    let t = saturate(-dot(a, along) / max(dot(along, along), AOGRID_SQUARE_EPSILON));
    let closest = fma(along, vec3f(t), a);
    return dot(closest, closest);
}

/// The weight of the occlusion at a neighbor q with unit normal m for a receiver p with unit normal n,
/// 0..1: 0 for a neighbor that is `tolerance` off the receiver's plane or faces away.
fn aogrid_upsample_weight(p: vec3f, n: vec3f, q: vec3f, m: vec3f, tolerance: f32) -> f32 {
    let away = abs(dot(q - p, n));
    let alike = saturate(dot(n, m));
    let squared = alike * alike;
    let weight = (1.0 - away / tolerance) * squared * squared;
    return select(0.0, weight, away < tolerance);
}

/// The occlusion between four neighbors, from their bilinear shares and weights: that of the nearest
/// one if none has a weight.
fn aogrid_upsampled(values: vec4f, shares: vec4f, weights: vec4f) -> f32 {
    let all = shares * weights;
    let sum = all.x + all.y + all.z + all.w;
    if sum > AOGRID_FRACTION_EPSILON {
        let weighted = all * values;
        return (weighted.x + weighted.y + weighted.z + weighted.w) / sum;
    }
    let largest = max(max(shares.x, shares.y), max(shares.z, shares.w));
    let of_last_two = select(values.w, values.z, shares.z == largest);
    let of_last_three = select(of_last_two, values.y, shares.y == largest);
    return select(of_last_three, values.x, shares.x == largest);
}

/// The part of a triangle above the horizon of a receiver with this unit normal.
fn aogrid_above_horizon(a: vec3f, b: vec3f, c: vec3f, normal: vec3f) -> AogridPolygon {
    let heights = vec3f(dot(a, normal), dot(b, normal), dot(c, normal));
    let is_above = heights > vec3f(0.0);
    if all(is_above) {
        return AogridPolygon(array(a, b, c, c));
    }
    if !any(is_above) {
        return AogridPolygon(array(a, a, a, a));
    }
    // Turned so that the first corner is above, and the last below.
    if is_above.x && !is_above.z {
        return aogrid_cut(a, b, c, heights);
    }
    if is_above.y && !is_above.x {
        return aogrid_cut(b, c, a, heights.yzx);
    }
    return aogrid_cut(c, a, b, heights.zxy);
}

/// The part above the horizon of a triangle whose first corner is above it and whose last is not.
fn aogrid_cut(a: vec3f, b: vec3f, c: vec3f, heights: vec3f) -> AogridPolygon {
    let to_last = aogrid_crossing(a, c, heights.x, heights.z);
    if heights.y > 0.0 {
        return AogridPolygon(array(a, b, aogrid_crossing(b, c, heights.y, heights.z), to_last));
    }
    return AogridPolygon(array(a, aogrid_crossing(a, b, heights.x, heights.y), to_last, to_last));
}

/// The point of the horizon between a point above it and one that is not.
fn aogrid_crossing(above: vec3f, below: vec3f, height: f32, depth: f32) -> vec3f {
    return fma(below - above, vec3f(height / (height - depth)), above);
}

/// The form factor of a polygon above the horizon: the share of the receiver's cosine-weighted
/// hemisphere that it covers (Lambert; McGuire 2010, equation 1).
fn aogrid_form_factor(polygon: AogridPolygon, normal: vec3f) -> f32 {
    let p = polygon.corners;
    let sum = aogrid_edge_factor(p[0], p[1], normal) + aogrid_edge_factor(p[1], p[2], normal)
        + aogrid_edge_factor(p[2], p[3], normal) + aogrid_edge_factor(p[3], p[0], normal);
    return abs(sum) / (2.0 * AOGRID_PI);
}

/// The angle of an edge as seen from the receiver, times the cosine between its plane's normal and the
/// receiver's; 0 for an edge without length or through the receiver. By an arc tangent, since an arc
/// cosine loses small polygons.
fn aogrid_edge_factor(a: vec3f, b: vec3f, normal: vec3f) -> f32 {
    let across = cross(a, b);
    let length = sqrt(dot(across, across));
    let angle = atan2(length, dot(a, b));
    return select(0.0, angle * dot(normal, across) / length, length > AOGRID_LENGTH_EPSILON);
}
