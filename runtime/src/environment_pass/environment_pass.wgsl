// The environment pass: one triangle over the target computes the light of each pixel from its
// accumulated occluders. Behind `constants.wgsl`, `shading.wgsl` and `environment.wgsl`.

/// Whether `positions` holds depths instead of world positions.
override positions_are_depths: bool;
/// Normals are scale * texel + offset.
override normal_scale: f32;
override normal_offset: f32;

struct Frame {
    world_from_clip: mat4x4f,
    environment: AogridEnvironment,
    /// The viewer's position with w = 1, or the direction towards the viewer with w = 0.
    eye: vec4f,
    /// x: the fraction of the lobe's cone.
    lobe: vec4f,
}

/// The uniforms, written once a frame.
@group(0) @binding(0) var<uniform> frame: Frame;
/// The world positions (xyz), or depths (x), of the receivers.
@group(0) @binding(1) var positions: texture_2d<f32>;
/// The world normals of the receivers.
@group(0) @binding(2) var normals: texture_2d<f32>;
/// The accumulated occluders: the sum of (AO/2) d' and the product of 1 - AO.
@group(0) @binding(3) var occlusion: texture_2d<f32>;
/// The prefiltered environment.
@group(0) @binding(4) var map: texture_2d<f32>;
/// The map's sampler: linear, repeating horizontally, clamped vertically.
@group(0) @binding(5) var map_sampler: sampler;

@vertex
fn whole_target(@builtin(vertex_index) idx: u32) -> @builtin(position) vec4f {
    return vec4f(f32(idx & 1u) * 4.0 - 1.0, f32(idx >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn lambertian(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let accumulated = textureLoad(occlusion, texel, 0);
    let n = receiver_normal(texel);
    return vec4f(aogrid_lambertian(frame.environment, map, map_sampler, accumulated, n), 1.0);
}

@fragment
fn glossy(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let accumulated = textureLoad(occlusion, texel, 0);
    let n = receiver_normal(texel);
    let mirrored = aogrid_mirrored(frame.eye, receiver_position(texel), n);
    let light = aogrid_glossy(frame.environment, map, map_sampler, accumulated, n, mirrored,
                              frame.lobe.x);
    return vec4f(light, 1.0);
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
