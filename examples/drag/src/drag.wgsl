// The renderer around the occlusion pass: a G-buffer, and its composition.

struct Frame {
    clip_from_world: mat4x4f,
    /// The position of the object that moves.
    object: vec4f,
}

@group(0) @binding(0) var<uniform> frame: Frame;

struct Surface {
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat, either) id: u32,
}

struct GBuffer {
    @location(0) position: vec4f,
    @location(1) normal: vec4f,
    @location(2) id: u32,
}

/// Transforms a vertex. `position.w` is the object's id; object 0 is the one that moves.
@vertex
fn surface(@location(0) position: vec4f, @location(1) normal: vec3f) -> Surface {
    let world = position.xyz + select(vec3f(), frame.object.xyz, position.w == 0.0);
    return Surface(frame.clip_from_world * vec4f(world, 1.0), world, normal, u32(position.w));
}

@fragment
fn gbuffer(in: Surface) -> GBuffer {
    return GBuffer(vec4f(in.world, 1.0), vec4f(0.5 * in.normal + 0.5, 1.0), in.id);
}

@group(0) @binding(0) var positions: texture_2d<f32>;
@group(0) @binding(1) var normals: texture_2d<f32>;
/// Ambient light.
@group(0) @binding(2) var light: texture_2d<f32>;
/// The share of ambient light that remains, 1 − AO, in one channel.
@group(0) @binding(3) var transmittances: texture_2d<f32>;
/// A mask: 1 for that channel of `transmittances`, 0 for the others.
@group(0) @binding(4) var<uniform> channel: vec4f;

@vertex
fn whole_screen(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

/// Adds ambient light, which occlusion darkens, and a lamp, which it does not.
@fragment
fn compose(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let at = vec2u(pixel.xy);
    if textureLoad(positions, at, 0).w == 0.0 {
        return vec4f(0.80, 0.86, 0.92, 1.0);
    }
    let n = 2.0 * textureLoad(normals, at, 0).xyz - 1.0;
    let transmittance = dot(textureLoad(transmittances, at, 0), channel);
    let ambient = textureLoad(light, at, 0).rgb * transmittance;
    let lamp = vec3f(0.30, 0.28, 0.24) * max(0.0, dot(n, normalize(vec3f(0.4, 0.8, 0.5))));
    return vec4f(ambient + lamp, 1.0);
}
