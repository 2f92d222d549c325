// The volume pass: a prism around each triangle, in which it occludes. Behind `volumes.wgsl` and
// `gbuffer.wgsl`.

struct Object {
    clip_from_world: mat4x4f,
    /// The rows of world_from_object.
    world_x: vec4f,
    world_y: vec4f,
    world_z: vec4f,
    /// The ids of receivers that it does not shade.
    excluded: vec4u,
    volume: AogridVolume,
    layers: u32,
    strength: f32,
    /// The distance between two positions, in floats.
    stride: u32,
    /// Whether the transform is a reflection, which turns triangles around.
    is_mirrored: u32,
}

/// A triangle in world space, the same at all corners of its prism.
struct Prism {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, first) a: vec3f,
    @location(1) @interpolate(flat, first) b: vec3f,
    @location(2) @interpolate(flat, first) c: vec3f,
}

/// The object, at a dynamic offset.
@group(1) @binding(0) var<uniform> object: Object;
/// The positions of its vertices in object space, three floats at the start of each.
@group(2) @binding(0) var<storage, read> vertices: array<f32>;
/// Its triangles, three vertices each.
@group(2) @binding(1) var<storage, read> indices: array<u32>;

/// The distance of the target's pixels in the G-buffer's texels.
override divisor: u32;

/// The share by which a prism is larger than the volume, so that every pixel whose receiver is inside
/// is covered despite the rasterizer's rounding.
const GROWTH: f32 = 1e-3;

/// The squared area of a triangle from which its normal is no longer finite in single precision.
const MAX_AREA: f32 = 1e37;

@vertex
fn prism_with_depth(@builtin(vertex_index) corner: u32, @builtin(instance_index) triangle: u32)
    -> Prism {
    return prism(corner, triangle);
}

/// A constant depth, so that neither the near nor the far plane clips the prism.
@vertex
fn prism_without_depth(@builtin(vertex_index) corner: u32, @builtin(instance_index) triangle: u32)
    -> Prism {
    var at = prism(corner, triangle);
    at.clip.z = 0.5 * at.clip.w;
    return at;
}

/// A vertex of a triangle's prism: 20 triangles, counter-clockwise from outside.
fn prism(corner: u32, triangle: u32) -> Prism {
    let a = vertex(triangle, 0u);
    let turned = 1u + object.is_mirrored;
    let b = vertex(triangle, turned);
    let c = vertex(triangle, 3u - turned);
    let scaled_normal = cross(b.xyz - a.xyz, c.xyz - a.xyz);
    let area = dot(scaled_normal, scaled_normal);
    if !(area > AOGRID_SQUARE_EPSILON && area < MAX_AREA && a.w * b.w * c.w > 0.0) {
        // Nothing: all corners at one point beyond the clip volume.
        return Prism(vec4f(2.0, 2.0, 2.0, 1.0), a.xyz, b.xyz, c.xyz);
    }
    let facing = scaled_normal * inverseSqrt(area);
    let place = prism_corner(corner);
    let rim = rim_corner(array(a.xyz, b.xyz, c.xyz), facing, place.x);
    let world = fma(facing, vec3f(prism_height(place.y)), rim);
    return Prism(object.clip_from_world * vec4f(world, 1.0), a.xyz, b.xyz, c.xyz);
}

/// The world position of a triangle's corner; w is 0 for an index out of range.
fn vertex(triangle: u32, corner: u32) -> vec4f {
    let idx = 3u * triangle + corner;
    if idx >= arrayLength(&indices) {
        return vec4f();
    }
    let floats = arrayLength(&vertices);
    let chosen = indices[idx];
    if floats < 3u || chosen > (floats - 3u) / object.stride {
        return vec4f();
    }
    let at = chosen * object.stride;
    let p = vec3f(vertices[at], vertices[at + 1u], vertices[at + 2u]);
    return vec4f(aogrid_row(object.world_x, p), aogrid_row(object.world_y, p),
                 aogrid_row(object.world_z, p), 1.0);
}

/// The corner of the rim, 0..5, and whether it is on the lower (0) or the upper side (1).
fn prism_corner(corner: u32) -> vec2u {
    let triangle = corner / 3u;
    let of_triangle = corner % 3u;
    if triangle < 8u {
        // Two fans around corner 0; the lower one is turned around.
        let is_upper = triangle / 4u;
        let along = triangle % 4u + select(3u - of_triangle, of_triangle, is_upper == 1u);
        return vec2u(select(along, 0u, of_triangle == 0u), is_upper);
    }
    // Six sides of two triangles: lower, next lower, next upper; lower, next upper, upper.
    let side = (triangle - 8u) / 2u;
    let is_second = (triangle - 8u) % 2u;
    let is_next = select(of_triangle != 0u, of_triangle == 1u, is_second == 1u);
    let is_upper = select(of_triangle == 2u, of_triangle != 0u, is_second == 1u);
    return vec2u((side + u32(is_next)) % 6u, u32(is_upper));
}

/// The height over the triangle's plane of the lower or the upper side.
fn prism_height(side: u32) -> f32 {
    let extent = object.volume.extent;
    let low = select(0.0, extent, object.volume.two_sided != 0u);
    return select(fma(-GROWTH, extent, -low), fma(GROWTH, extent, extent), side == 1u);
}

/// A corner of the triangle's outline at the extent's distance in its plane, cut off at each corner by
/// the tangent of the circle around it.
fn rim_corner(corners: array<vec3f, 3>, facing: vec3f, corner: u32) -> vec3f {
    let edge = corner / 2u;
    let first = corners[edge];
    let second = corners[(edge + 1u) % 3u];
    let third = corners[(edge + 2u) % 3u];
    let along = normalize(second - first);
    let extent = fma(GROWTH, object.volume.extent, object.volume.extent);
    // The edge's end, and the direction of the edge that meets it there, away from it.
    let is_end = corner % 2u == 1u;
    let at = select(first, second, is_end);
    let forward = select(-along, along, is_end);
    let other = normalize(third - at);
    // The tangent of half the angle by which the outline turns, from its cosine.
    let cosine = clamp(dot(forward, other), -1.0, 1.0);
    let half_tangent = sqrt((1.0 - cosine) / max(1.0 + cosine, AOGRID_FRACTION_EPSILON));
    // The tangent of the quarter.
    let quarter_tangent = half_tangent / (1.0 + sqrt(fma(half_tangent, half_tangent, 1.0)));
    let outward = cross(along, facing);
    return at + extent * fma(forward, vec3f(quarter_tangent), outward);
}

@fragment
fn occlusion(at: Prism) -> @location(0) vec4f {
    let texel = divisor * vec2u(at.clip.xy);
    let receiver = receiver_object(texel);
    if !is_shaded_by(receiver) {
        discard;
    }
    let p = receiver_position(texel);
    let n = receiver_normal(texel);
    let found = aogrid_volume_occlusion(object.volume, at.a - p, at.b - p, at.c - p, n);
    return vec4f(object.strength * found);
}

/// Whether the object shades the receiver, by ids and layers.
fn is_shaded_by(receiver: vec2u) -> bool {
    return receiver_channels == 0u
        || ((object.layers & receiver.y) != 0u && all(object.excluded != vec4u(receiver.x)));
}
