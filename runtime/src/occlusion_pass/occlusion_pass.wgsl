// The raster pass: back faces of each occluder's box over a G-buffer, blended (RR-5779, 3.2).
// Behind `constants.wgsl` and `shading.wgsl`.

/// Whether `positions` holds depths instead of world positions.
override positions_are_depths: bool;
/// Normals are scale * texel + offset.
override normal_scale: f32;
override normal_offset: f32;
/// What of `receivers` is there: 0 nothing, 1 ids, 2 ids and layers.
override receiver_channels: u32;
/// Whether the grids hold cones; else occlusion alone.
override grids_hold_cones: bool;

struct Frame {
    world_from_clip: mat4x4f,
}

struct Draw {
    clip_from_box: mat4x4f,
    occluder: AogridOccluder,
}

/// Written once a frame.
@group(0) @binding(0) var<uniform> frame: Frame;
/// World positions (xyz), or depths (x), of what each pixel shows.
@group(0) @binding(1) var positions: texture_2d<f32>;
/// World normals of what each pixel shows.
@group(0) @binding(2) var normals: texture_2d<f32>;
/// Object id and layers of what each pixel shows.
@group(0) @binding(3) var receivers: texture_2d<u32>;
/// T_clip as transmittance; with axes the whole of it.
@group(0) @binding(4) var t_clip: texture_2d<f32>;
/// Linear, clamped.
@group(0) @binding(5) var linear_clamp: sampler;
/// The occluder, at a dynamic offset.
@group(1) @binding(0) var<uniform> draw: Draw;
/// The occluder's grid.
@group(2) @binding(0) var grid: texture_3d<f32>;

@vertex
fn box_with_depth(@builtin(vertex_index) idx: u32) -> @builtin(position) vec4f {
    return box_corner(idx);
}

/// At no depth that a near or far plane could clip.
@vertex
fn box_without_depth(@builtin(vertex_index) idx: u32) -> @builtin(position) vec4f {
    let corner = box_corner(idx);
    return vec4f(corner.xy, 0.5 * corner.w, corner.w);
}

@fragment
fn cone(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p_grid = aogrid_grid_position(draw.occluder, receiver_position(texel));
    if !(aogrid_is_inside(p_grid) && is_shaded(texel)) {
        discard;
    }
    let n = receiver_normal(texel);
    return vec4f(aogrid_cone_at(draw.occluder, grid, t_clip, linear_clamp, p_grid, n));
}

@fragment
fn cone_with_axis(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p_grid = aogrid_grid_position(draw.occluder, receiver_position(texel));
    if !(aogrid_is_inside(p_grid) && is_shaded(texel)) {
        discard;
    }
    let n = receiver_normal(texel);
    return aogrid_cone_with_axis_at(draw.occluder, grid, t_clip, linear_clamp, p_grid, n);
}

@fragment
fn occlusion(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p_grid = aogrid_grid_position(draw.occluder, receiver_position(texel));
    if !(aogrid_is_inside(p_grid) && is_shaded(texel)) {
        discard;
    }
    let stored = textureSampleLevel(grid, linear_clamp, p_grid, 0.0);
    let a = select(stored.r, stored.a, grids_hold_cones);
    let t = aogrid_occlusion_transmittance(a, is_on_itself(texel));
    return vec4f(aogrid_strengthen(draw.occluder, t));
}

/// The box as a strip of 14 corners, counter-clockwise from outside.
fn box_corner(idx: u32) -> vec4f {
    let bits = vec3u(0x287au, 0x02afu, 0x31e3u) >> vec3u(idx);
    return draw.clip_from_box * vec4f(vec3f(bits & vec3u(1u)), 1.0);
}

fn receiver_position(texel: vec2u) -> vec3f {
    let stored = textureLoad(positions, texel, 0);
    if !positions_are_depths {
        return stored.xyz;
    }
    let uv = (vec2f(texel) + 0.5) / vec2f(textureDimensions(positions));
    let ndc = vec2f(2.0, -2.0) * uv + vec2f(-1.0, 1.0);
    return aogrid_world_position(frame.world_from_clip, ndc, stored.x);
}

fn receiver_normal(texel: vec2u) -> vec3f {
    return fma(textureLoad(normals, texel, 0).xyz, vec3f(normal_scale), vec3f(normal_offset));
}

fn is_shaded(texel: vec2u) -> bool {
    if receiver_channels == 0u {
        return true;
    }
    let receiver = textureLoad(receivers, texel, 0);
    let layers = select(0xffffffffu, receiver.g, receiver_channels == 2u);
    return aogrid_shades(draw.occluder, receiver.r, layers);
}

fn is_on_itself(texel: vec2u) -> bool {
    if receiver_channels == 0u || draw.occluder.object_id == AOGRID_NO_OBJECT {
        return false;
    }
    return textureLoad(receivers, texel, 0).r == draw.occluder.object_id;
}
