// The back faces of an occluder's box. Behind `gbuffer.wgsl`.

struct Draw {
    clip_from_box: mat4x4f,
    occluder: AogridOccluder,
}

/// The occluder, at a dynamic offset.
@group(1) @binding(0) var<uniform> draw: Draw;
/// The occluder's grid.
@group(2) @binding(0) var grid: texture_3d<f32>;

@vertex
fn box_with_depth(@builtin(vertex_index) idx: u32) -> @builtin(position) vec4f {
    return box_corner(idx);
}

/// A constant depth, so that neither the near nor the far plane clips the box.
@vertex
fn box_without_depth(@builtin(vertex_index) idx: u32) -> @builtin(position) vec4f {
    let corner = box_corner(idx);
    return vec4f(corner.xy, 0.5 * corner.w, corner.w);
}

/// A corner of the box as a triangle strip of 14 vertices, counter-clockwise from outside.
fn box_corner(idx: u32) -> vec4f {
    let bits = vec3u(0x287au, 0x02afu, 0x31e3u) >> vec3u(idx);
    return draw.clip_from_box * vec4f(vec3f(bits & vec3u(1u)), 1.0);
}
