// The inputs of a frame that every pass reads. Behind `constants.wgsl` and `shading.wgsl`.

/// Whether `positions` holds depths instead of world positions.
override positions_are_depths: bool;
/// Normals are scale * texel + offset.
override normal_scale: f32;
override normal_offset: f32;
/// The channels of `receivers`: 0 none, 1 ids, 2 ids and layers.
override receiver_channels: u32;

struct Frame {
    world_from_clip: mat4x4f,
}

/// The camera, written once a frame.
@group(0) @binding(0) var<uniform> frame: Frame;
/// The world positions (xyz), or depths (x), of the receivers.
@group(0) @binding(1) var positions: texture_2d<f32>;
/// The world normals of the receivers.
@group(0) @binding(2) var normals: texture_2d<f32>;
/// The object ids and layers of the receivers.
@group(0) @binding(3) var receivers: texture_2d<u32>;
/// T_clip as transmittance, or with all channels where axes are needed.
@group(0) @binding(4) var t_clip: texture_2d<f32>;
/// The linear, clamped sampler.
@group(0) @binding(5) var linear_clamp: sampler;

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

/// The object's id, and its layers: all of them if they are unknown.
fn receiver_object(texel: vec2u) -> vec2u {
    if receiver_channels == 0u {
        return vec2u(AOGRID_NO_OBJECT, 0xffffffffu);
    }
    let receiver = textureLoad(receivers, texel, 0);
    return vec2u(receiver.r, select(0xffffffffu, receiver.g, receiver_channels == 2u));
}

/// Whether the occluder shades the receiver, by ids and layers.
fn is_shaded(occluder: AogridOccluder, object: vec2u) -> bool {
    return receiver_channels == 0u || aogrid_shades(occluder, object.x, object.y);
}

/// The look-up of a receiver that an occluder shades: `found`, or that on the occluder itself.
fn shading_lookup(occluder: AogridOccluder, found: AogridLookup, position: vec3f, normal: vec3f,
                  object: vec2u) -> AogridLookup {
    if aogrid_is_on_itself(occluder, object.x) {
        return aogrid_lookup_on_itself(occluder, position, normal);
    }
    return found;
}
