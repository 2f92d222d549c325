// A renderer with a G-buffer of the opaque surfaces, and one pane of frosted glass that is not in
// it. Compiled after `aogrid_runtime::wgsl::SHADING` and `tile_lists(1)`.

@group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;
/// The tiled pass's result: the occluders' combined axis and transmittance.
@group(0) @binding(1) var occlusion: texture_2d<f32>;
@group(0) @binding(2) var normals: texture_2d<f32>;

struct Surface {
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
}

struct GBuffer {
    @location(0) position: vec4f,
    @location(1) normal: vec4f,
}

@vertex
fn surface(@location(0) position: vec3f, @location(1) normal: vec3f) -> Surface {
    return Surface(clip_from_world * vec4f(position, 1.0), position, normal);
}

@fragment
fn gbuffer(in: Surface) -> GBuffer {
    return GBuffer(vec4f(in.world, 1.0), vec4f(in.normal, 1.0));
}

@vertex
fn whole_screen(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

/// Adds ambient light, which occlusion darkens, and a lamp, which it does not.
@fragment
fn opaque(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let n = textureLoad(normals, vec2u(pixel.xy), 0);
    if n.w == 0.0 {
        return vec4f(0.80, 0.86, 0.92, 1.0);
    }
    let t = textureLoad(occlusion, vec2u(pixel.xy), 0).w;
    return vec4f(vec3f(0.66, 0.68, 0.72) * t + lamp(n.xyz), 1.0);
}

/// Shades the glass at its own position, by the same occluders. The G-buffer holds the surface
/// behind it, so the glass uses the list of occluders at all depths of the tile.
@fragment
fn glass(in: Surface) -> @location(0) vec4f {
    let receiver = vec2u(AOGRID_NO_OBJECT - 1u, 0xffffffffu);
    let merged = aogrid_merge_listed(AOGRID_LIST_ALL_DEPTHS, vec2u(in.clip.xy), in.world, in.normal,
                                    receiver);
    return vec4f(vec3f(0.62, 0.80, 0.78) * merged.w + 0.5 * lamp(in.normal), 0.85);
}

fn lamp(n: vec3f) -> vec3f {
    return vec3f(0.24, 0.22, 0.18) * max(0.0, dot(n, normalize(vec3f(0.4, 0.8, 0.5))));
}
