// aogrid: light from an environment, less what occluders hide of it (RR-5779, 5.3).
//
// Pure functions, all named aogrid_*: no bindings, no entry points, no directives. Paste this
// file behind the shading library and call
//
//     aogrid_lambertian or aogrid_glossy
//
// with what the occluders add up to at a pixel: xyz the sum of all (AO/2) d', w the product of
// all 1 - AO. The map is one that `EnvironmentMap` made, its sampler linear, repeated across,
// clamped down. The CPU twin, `environment.rs`, has the same functions under the same names.

/// How a scene stands in its environment, in a uniform buffer: 64 bytes.
struct AogridEnvironment {
    /// Rows of map_from_world, a rotation; w is not used.
    map_x: vec4f,
    map_y: vec4f,
    map_z: vec4f,
    /// Multiplies the map's radiance: red, green, blue; w is not used.
    scale: vec4f,
}

/// Directions around a unit axis that cover a fraction of the sphere, up to half of it; of them so
/// many are meant, everywhere alike.
struct AogridCone {
    axis: vec3f,
    fraction: f32,
    density: f32,
}

// ---- One call per pixel ------------------------------------------------------------------------

/// What a white diffuse surface reflects: the mean radiance of its hemisphere, less AO times that
/// of the occluded cone.
fn aogrid_lambertian(environment: AogridEnvironment, map: texture_2d<f32>, map_sampler: sampler,
                     hidden: vec4f, normal: vec3f) -> vec3f {
    let all = aogrid_irradiance(environment, map, map_sampler, normal);
    let cone = aogrid_cosine_weighted_cone(aogrid_occluded_cone(hidden, normal), normal);
    let lost = aogrid_cone_radiance(environment, map, map_sampler, cone);
    return max(all - (1.0 - hidden.w) * lost, vec3f());
}

/// What a glossy surface reflects: the mean radiance of a lobe, a cone of `lobe_fraction` about
/// the mirrored direction in so far as it is above the surface, less the hidden share of the
/// lobe times the mean radiance there.
fn aogrid_glossy(environment: AogridEnvironment, map: texture_2d<f32>, map_sampler: sampler,
                 hidden: vec4f, normal: vec3f, mirrored: vec3f, lobe_fraction: f32) -> vec3f {
    let whole = AogridCone(mirrored, lobe_fraction, 1.0);
    let lobe = aogrid_shared_cone(whole, AogridCone(normal, 0.5, 1.0));
    let lost_cone = aogrid_shared_cone(whole, aogrid_occluded_cone(hidden, normal));
    let covered = lost_cone.fraction / max(lobe.fraction, AOGRID_FRACTION_GUARD);
    let share = lost_cone.density * saturate(covered);
    let all = aogrid_cone_radiance(environment, map, map_sampler, lobe);
    let lost = aogrid_cone_radiance(environment, map, map_sampler, lost_cone);
    return max(all - share * lost, vec3f());
}

/// The direction in which a surface mirrors a viewer: `eye` is a place with w = 1, or a direction
/// towards the viewer with w = 0.
fn aogrid_mirrored(eye: vec4f, position: vec3f, normal: vec3f) -> vec3f {
    let towards = eye.xyz - eye.w * position;
    let view = towards * aogrid_inverse_length(towards);
    return 2.0 * dot(view, normal) * normal - view;
}

// ---- Cones -------------------------------------------------------------------------------------

/// The cone that a pixel's occluders hide, as the receiver sees it. The sum of (AO/2) d' is as long
/// as AO/2 for occluders in one direction, and shorter for several around: the cone is then as wide
/// as makes the mean of its directions shorter by that, and as much less dense.
fn aogrid_occluded_cone(hidden: vec4f, normal: vec3f) -> AogridCone {
    let occlusion = 1.0 - hidden.w;
    let axis_length = length(hidden.xyz);
    let has_axis = axis_length * axis_length > AOGRID_AXIS_GUARD;
    let axis = select(normal, hidden.xyz * aogrid_inverse_length(hidden.xyz), has_axis);
    let together = saturate(2.0 * axis_length / max(occlusion, AOGRID_FRACTION_GUARD));
    let fraction = aogrid_occluded_fraction(occlusion, dot(axis, normal));
    let wide = min(1.0 - together * (1.0 - fraction), 0.5);
    return AogridCone(axis, wide, fraction / max(wide, AOGRID_FRACTION_GUARD));
}

/// The fraction of a cone that hides so much, its axis at `cos_beta` to the normal:
/// AO = 4a(1 - a) cos beta, exactly so for a cone above the horizon.
fn aogrid_occluded_fraction(occlusion: f32, cos_beta: f32) -> f32 {
    let of_overhead = saturate(occlusion / max(cos_beta, AOGRID_FRACTION_GUARD));
    return 0.5 - 0.5 * sqrt(1.0 - of_overhead);
}

/// A cone as a diffuse receiver weighs it: around the mean of its directions, each counted by its
/// cosine to the normal. With c = 1 - 2a that is along 3c(1 + c)(d.n) d + (1 - c)(2 + c) n, where
/// a is what the cone covers, not what it is spread over: several occluders' sum of (AO/2) d' has
/// counted each by its cosine already.
fn aogrid_cosine_weighted_cone(cone: AogridCone, normal: vec3f) -> AogridCone {
    let c = fma(-2.0 * cone.fraction, cone.density, 1.0);
    let along = 3.0 * c * (1.0 + c) * max(dot(cone.axis, normal), AOGRID_FRACTION_GUARD);
    let sum = along * cone.axis + (1.0 - c) * (2.0 + c) * normal;
    return AogridCone(sum * aogrid_inverse_length(sum), cone.fraction, cone.density);
}

/// What two cones share, as a cone: with the fraction that they share, around its middle. That lies
/// on the arc between the axes. Halfway along what both cover of the arc it does only for
/// cones of one size; of a small cone that a larger one cuts, the less is cut off the nearer it
/// is to the small one's axis: by the fourth root of what is cut off, within 0.02 of its radius.
fn aogrid_shared_cone(first: AogridCone, second: AogridCone) -> AogridCone {
    let cos_gamma = dot(first.axis, second.axis);
    let across = second.axis - cos_gamma * first.axis;
    let gamma = atan2(length(across), cos_gamma);
    let a = vec2f(first.fraction, second.fraction);
    let alpha = vec2f(aogrid_half_angle(a.x), aogrid_half_angle(a.y));
    let fraction = aogrid_shared_fraction(a, alpha, gamma);
    let halfway = 0.5 * (max(-alpha.x, gamma - alpha.y) + min(alpha.x, gamma + alpha.y));
    let smaller = select(gamma, 0.0, a.x <= a.y);
    let cut_off = saturate(1.0 - fraction / max(min(a.x, a.y), AOGRID_FRACTION_GUARD));
    let middle = mix(smaller, halfway, sqrt(sqrt(cut_off)));
    let towards = across * aogrid_inverse_length(across);
    let axis = cos(middle) * first.axis + sin(middle) * towards;
    return AogridCone(axis, fraction, first.density * second.density);
}

/// The half-angle of a cone.
fn aogrid_half_angle(fraction: f32) -> f32 {
    return 2.0 * atan2(sqrt(fraction), sqrt(1.0 - fraction));
}

/// The fraction of the sphere inside two cones of at most half of it, of these fractions and
/// half-angles, their axes gamma apart. The derivation is that of `aogrid_tables::merge`.
fn aogrid_shared_fraction(a: vec2f, alpha: vec2f, gamma: f32) -> f32 {
    let less_s = AOGRID_PI - 0.5 * (alpha.x + alpha.y + gamma);
    let less_alpha = 0.5 * (alpha.yx + gamma - alpha);
    let less_gamma = 0.5 * (alpha.x + alpha.y - gamma);
    if less_gamma <= 0.0 || less_s <= 0.0 {
        return 0.0;
    }
    if min(less_alpha.x, less_alpha.y) <= 0.0 {
        return min(a.x, a.y);
    }
    let half_sin = sin(0.5 * vec4f(less_s, less_alpha, less_gamma));
    let half_cos = cos(0.5 * vec4f(less_s, less_alpha, less_gamma));
    let s = 2.0 * half_sin * half_cos;
    let angle_x = 2.0 * atan2(sqrt(s.y * s.w), sqrt(s.x * s.z));
    let angle_y = 2.0 * atan2(sqrt(s.z * s.w), sqrt(s.x * s.y));
    let numerator = sqrt(half_cos.x * half_sin.y * half_sin.z * half_sin.w);
    let denominator = sqrt(half_sin.x * half_cos.y * half_cos.z * half_cos.w);
    let triangle = 4.0 * atan2(numerator, denominator);
    let lens = (a.x * angle_x + a.y * angle_y - 0.5 * triangle) / AOGRID_PI;
    return clamp(lens, 0.0, min(a.x, a.y));
}

// ---- Radiance ----------------------------------------------------------------------------------

/// The irradiance over pi: the mean radiance of a hemisphere, weighted by the cosine.
fn aogrid_irradiance(environment: AogridEnvironment, map: texture_2d<f32>, map_sampler: sampler,
                     normal: vec3f) -> vec3f {
    let at = aogrid_environment_coordinate(aogrid_map_direction(environment, normal));
    let last = AOGRID_ENVIRONMENT_LAST_LEVEL;
    return aogrid_environment_at(map, map_sampler, at, last) * environment.scale.rgb;
}

/// The mean radiance of a cone, weighted by the cosine to its axis. Cones of less than level 0's
/// fraction count as that.
fn aogrid_cone_radiance(environment: AogridEnvironment, map: texture_2d<f32>,
                        map_sampler: sampler, cone: AogridCone) -> vec3f {
    let at = aogrid_environment_coordinate(aogrid_map_direction(environment, cone.axis));
    let level = aogrid_environment_level(cone.fraction);
    let below = min(floor(level), AOGRID_ENVIRONMENT_LAST_LEVEL - 1.0);
    let narrow = aogrid_environment_at(map, map_sampler, at, below);
    let wide = aogrid_environment_at(map, map_sampler, at, below + 1.0);
    return mix(narrow, wide, level - below) * environment.scale.rgb;
}

/// A direction in the map's axes.
fn aogrid_map_direction(environment: AogridEnvironment, direction: vec3f) -> vec3f {
    return vec3f(
        dot(environment.map_x.xyz, direction),
        dot(environment.map_y.xyz, direction),
        dot(environment.map_z.xyz, direction),
    );
}

/// Where a direction of any length lies in a latitude-longitude map: turns from the left edge,
/// and half turns from the north pole.
fn aogrid_environment_coordinate(direction: vec3f) -> vec2f {
    // At a pole any azimuth will do, and where there is no direction any pole: but some number.
    let level = length(direction.xz);
    let azimuth = atan2(direction.x, select(1.0, direction.z, level > 0.0));
    let colatitude = atan2(level, select(1.0, direction.y, level > 0.0 || direction.y != 0.0));
    return vec2f(fma(azimuth, -0.5 / AOGRID_PI, 0.5), colatitude / AOGRID_PI);
}

/// The level of the map whose cones cover this fraction; between two, by its logarithm.
fn aogrid_environment_level(fraction: f32) -> f32 {
    let level = AOGRID_ENVIRONMENT_LAST_LEVEL + 0.5 * log2(max(2.0 * fraction, AOGRID_FRACTION_GUARD));
    return clamp(level, 0.0, AOGRID_ENVIRONMENT_LAST_LEVEL);
}

/// A level of the map: its rows lie on colatitudes from pole to pole.
fn aogrid_environment_at(map: texture_2d<f32>, map_sampler: sampler, at: vec2f,
                         level: f32) -> vec3f {
    let row = exp2(level) / AOGRID_ENVIRONMENT_HEIGHT;
    let v = fma(at.y, 1.0 - row, 0.5 * row);
    return textureSampleLevel(map, map_sampler, vec2f(at.x, v), level).rgb;
}
