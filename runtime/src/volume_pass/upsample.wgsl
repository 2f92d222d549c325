// The upsampling of a volume pass's smaller target: one triangle over the target. Behind `volumes.wgsl`
// and `gbuffer.wgsl`.

/// The distance of the smaller target's pixels in the G-buffer's texels.
override divisor: u32;

/// The sums of the volume pass, in the first channel.
@group(1) @binding(0) var reduced: texture_2d<f32>;
/// x: the distance from a receiver's plane at which a neighbor no longer counts.
@group(1) @binding(1) var<uniform> tolerance: vec4f;

@vertex
fn whole_target(@builtin(vertex_index) idx: u32) -> @builtin(position) vec4f {
    return vec4f(f32(idx & 1u) * 4.0 - 1.0, f32(idx >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn upsampled(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p = receiver_position(texel);
    let n = receiver_normal(texel);
    let first = texel / divisor;
    let last = textureDimensions(reduced) - 1u;
    let along = vec2f(texel - divisor * first) / f32(divisor);
    var values = vec4f();
    var shares = vec4f();
    var weights = vec4f();
    for (var i = 0u; i < 4u; i++) {
        let step = vec2u(i & 1u, i >> 1u);
        let at = min(first + step, last);
        let share = select(1.0 - along, along, step == vec2u(1u));
        let neighbor = divisor * at;
        let q = receiver_position(neighbor);
        values[i] = textureLoad(reduced, at, 0).x;
        shares[i] = share.x * share.y;
        weights[i] = aogrid_upsample_weight(p, n, q, receiver_normal(neighbor), tolerance.x);
    }
    return vec4f(aogrid_upsampled(values, shares, weights));
}
