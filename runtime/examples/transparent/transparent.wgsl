// A renderer with a G-buffer for what is opaque, and one pane of frosted glass that it knows
// nothing of. Behind `aogrid_runtime::wgsl::SHADING` and `tile_lists(1)`.

@group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;
/// What all occluders left, by the tiled pass.
@group(0) @binding(1) var left: texture_2d<f32>;
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

/// Ambient light, which is what occlusion darkens, and a lamp, which it does not touch.
@fragment
fn opaque(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let n = textureLoad(normals, vec2u(pixel.xy), 0);
    if n.w == 0.0 {
        return vec4f(0.80, 0.86, 0.92, 1.0);
    }
    let t = textureLoad(left, vec2u(pixel.xy), 0).w;
    return vec4f(vec3f(0.66, 0.68, 0.72) * t + lamp(n.xyz), 1.0);
}

/// The glass is shaded where it stands, by the same occluders. The G-buffer shows what is behind it:
/// its list is that of anything seen through the tile.
@fragment
fn glass(in: Surface) -> @location(0) vec4f {
    let everyone = vec2u(AOGRID_NO_OBJECT - 1u, 0xffffffffu);
    let shown = aogrid_merge_listed(AOGRID_LIST_OF_ANYTHING, vec2u(in.clip.xy), in.world, in.normal,
                                    everyone);
    return vec4f(vec3f(0.62, 0.80, 0.78) * shown.w + 0.5 * lamp(in.normal), 0.85);
}

fn lamp(n: vec3f) -> vec3f {
    return vec3f(0.24, 0.22, 0.18) * max(0.0, dot(n, normalize(vec3f(0.4, 0.8, 0.5))));
}
