// aogrid: environment light, less the part that occluders block (RR-5779, 5.3).
//
// Pure functions, all named aogrid_*: no bindings, no entry points, no directives. Paste this
// file behind the shading library and call
//
//     aogrid_lambertian or aogrid_glossy
//
// with the accumulated occluders of a pixel: the sum of all (AO/2) d' in xyz, the product of all 1
// - AO in w. The map comes from `EnvironmentMap`; its sampler is linear, repeating horizontally and
// clamped vertically. The CPU twin, `environment.rs`, has the same functions under the same names.

/// The orientation and scale of an environment map, in a uniform buffer: 64 bytes.
struct AogridEnvironment {
    /// Rows of map_from_world, a rotation; w is not used.
    map_x: vec4f,
    map_y: vec4f,
    map_z: vec4f,
    /// Multiplies the map's radiance: red, green, blue; w is not used.
    scale: vec4f,
}

// ---- One call per pixel ------------------------------------------------------------------------

/// The light that a white diffuse surface reflects: the mean radiance of its hemisphere, less AO
/// times that of the occluded cone.
fn aogrid_lambertian(environment: AogridEnvironment, map: texture_2d<f32>, map_sampler: sampler,
                     accumulated: vec4f, normal: vec3f) -> vec3f {
    let unoccluded = aogrid_irradiance(environment, map, map_sampler, normal);
    let cone = aogrid_cosine_weighted_cone(aogrid_occluded_cone(accumulated, normal), normal);
    let blocked = aogrid_cone_radiance(environment, map, map_sampler, cone);
    return max(unoccluded - (1.0 - accumulated.w) * blocked, vec3f());
}

/// The light that a glossy surface reflects: the mean radiance of a lobe, less the occluded share
/// of the lobe times the mean radiance of that share. The lobe is a cone of `lobe_fraction` around
/// the mirror direction, as far as it lies above the surface.
fn aogrid_glossy(environment: AogridEnvironment, map: texture_2d<f32>, map_sampler: sampler,
                 accumulated: vec4f, normal: vec3f, mirrored: vec3f, lobe_fraction: f32) -> vec3f {
    let full_lobe = AogridCone(mirrored, lobe_fraction, 1.0);
    let lobe = aogrid_shared_cone(full_lobe, AogridCone(normal, 0.5, 1.0));
    let blocked_cone = aogrid_shared_cone(full_lobe, aogrid_occluded_cone(accumulated, normal));
    let covered = blocked_cone.fraction / max(lobe.fraction, AOGRID_FRACTION_EPSILON);
    let share = blocked_cone.density * saturate(covered);
    let unoccluded = aogrid_cone_radiance(environment, map, map_sampler, lobe);
    let blocked = aogrid_cone_radiance(environment, map, map_sampler, blocked_cone);
    return max(unoccluded - share * blocked, vec3f());
}

/// The direction in which a surface mirrors a viewer: `eye` is a position with w = 1, or a
/// direction towards the viewer with w = 0.
fn aogrid_mirrored(eye: vec4f, position: vec3f, normal: vec3f) -> vec3f {
    let towards = eye.xyz - eye.w * position;
    let view = towards * aogrid_inverse_length(towards);
    return 2.0 * dot(view, normal) * normal - view;
}

// ---- Cones -------------------------------------------------------------------------------------

/// The cone that a pixel's occluders block, as seen by the receiver. The sum of all (AO/2) d' has
/// the length AO/2 for occluders in one direction and is shorter for occluders in several. The cone
/// is then widened until the mean of its directions is shorter by the same factor, and its density
/// lowered accordingly.
fn aogrid_occluded_cone(accumulated: vec4f, normal: vec3f) -> AogridCone {
    let occlusion = 1.0 - accumulated.w;
    let axis_length = length(accumulated.xyz);
    let has_axis = axis_length * axis_length > AOGRID_AXIS_EPSILON;
    let axis = select(normal, accumulated.xyz * aogrid_inverse_length(accumulated.xyz), has_axis);
    let alignment = saturate(2.0 * axis_length / max(occlusion, AOGRID_FRACTION_EPSILON));
    let fraction = aogrid_occluded_fraction(occlusion, dot(axis, normal));
    let widened = min(1.0 - alignment * (1.0 - fraction), 0.5);
    return AogridCone(axis, widened, fraction / max(widened, AOGRID_FRACTION_EPSILON));
}

/// The fraction a of a cone with this AO and its axis at `cos_beta` to the normal: AO = 4a(1 - a)
/// cos beta, exact for a cone above the horizon.
fn aogrid_occluded_fraction(occlusion: f32, cos_beta: f32) -> f32 {
    let sin_alpha_squared = saturate(occlusion / max(cos_beta, AOGRID_FRACTION_EPSILON));
    return 0.5 - 0.5 * sqrt(1.0 - sin_alpha_squared);
}

/// The cone as a diffuse receiver weights it: around the mean of its directions, each weighted by
/// its cosine to the normal. With c = 1 - 2a that mean points along 3c(1 + c)(d.n) d + (1 - c)(2 +
/// c) n. The fraction a is the one that the cone covers, not the one over which it is spread:
/// several occluders' sum of (AO/2) d' already contains the cosine of each.
fn aogrid_cosine_weighted_cone(cone: AogridCone, normal: vec3f) -> AogridCone {
    let c = fma(-2.0 * cone.fraction, cone.density, 1.0);
    let along = 3.0 * c * (1.0 + c) * max(dot(cone.axis, normal), AOGRID_FRACTION_EPSILON);
    let sum = along * cone.axis + (1.0 - c) * (2.0 + c) * normal;
    return AogridCone(sum * aogrid_inverse_length(sum), cone.fraction, cone.density);
}

/// The intersection of two cones, as a cone of the shared fraction around the middle of the lens.
/// The middle lies on the arc between the axes. For cones of one size it is halfway along the part
/// of the arc that both cover. If a larger cone cuts a smaller one, it is nearer to the smaller
/// one's axis the less is cut off: we interpolate by the fourth root of the fraction cut off, which
/// is within 0.02 of the smaller cone's radius.
fn aogrid_shared_cone(first: AogridCone, second: AogridCone) -> AogridCone {
    let cos_gamma = dot(first.axis, second.axis);
    let across = second.axis - cos_gamma * first.axis;
    let gamma = atan2(length(across), cos_gamma);
    let a = vec2f(first.fraction, second.fraction);
    let alpha = vec2f(aogrid_half_angle(a.x), aogrid_half_angle(a.y));
    let fraction = aogrid_shared_fraction(a, alpha, gamma);
    // Positions on the arc, as angles from the first axis.
    let halfway = 0.5 * (max(-alpha.x, gamma - alpha.y) + min(alpha.x, gamma + alpha.y));
    let smaller_center = select(gamma, 0.0, a.x <= a.y);
    let fraction_cut_off = saturate(1.0 - fraction / max(min(a.x, a.y), AOGRID_FRACTION_EPSILON));
    let middle = mix(smaller_center, halfway, sqrt(sqrt(fraction_cut_off)));
    let towards = across * aogrid_inverse_length(across);
    let axis = cos(middle) * first.axis + sin(middle) * towards;
    return AogridCone(axis, fraction, first.density * second.density);
}

/// The half-angle of a cone of this fraction.
fn aogrid_half_angle(fraction: f32) -> f32 {
    return 2.0 * atan2(sqrt(fraction), sqrt(1.0 - fraction));
}

/// The fraction of the sphere inside two cones, each of at most a hemisphere, with these fractions
/// and half-angles and with axes gamma apart. The derivation is that of `aogrid_tables::merge`.
fn aogrid_shared_fraction(a: vec2f, alpha: vec2f, gamma: f32) -> f32 {
    // The spherical triangle of both axes and a crossing of the rims has the sides alpha.x, alpha.y
    // and gamma; s is half of their sum.
    let pi_minus_s = AOGRID_PI - 0.5 * (alpha.x + alpha.y + gamma);
    let s_minus_alpha = 0.5 * (alpha.yx + gamma - alpha);
    let s_minus_gamma = 0.5 * (alpha.x + alpha.y - gamma);
    if s_minus_gamma <= 0.0 || pi_minus_s <= 0.0 {
        return 0.0;
    }
    if min(s_minus_alpha.x, s_minus_alpha.y) <= 0.0 {
        return min(a.x, a.y);
    }
    // Half-angle formulas: the triangle's angles at both axes, then its area (L'Huilier).
    let half_sin = sin(0.5 * vec4f(pi_minus_s, s_minus_alpha, s_minus_gamma));
    let half_cos = cos(0.5 * vec4f(pi_minus_s, s_minus_alpha, s_minus_gamma));
    let sines = 2.0 * half_sin * half_cos;
    let angle_x = 2.0 * atan2(sqrt(sines.y * sines.w), sqrt(sines.x * sines.z));
    let angle_y = 2.0 * atan2(sqrt(sines.z * sines.w), sqrt(sines.x * sines.y));
    let numerator = sqrt(half_cos.x * half_sin.y * half_sin.z * half_sin.w);
    let denominator = sqrt(half_sin.x * half_cos.y * half_cos.z * half_cos.w);
    let triangle = 4.0 * atan2(numerator, denominator);
    let lens = (a.x * angle_x + a.y * angle_y - 0.5 * triangle) / AOGRID_PI;
    return clamp(lens, 0.0, min(a.x, a.y));
}

// ---- Radiance ----------------------------------------------------------------------------------

/// The irradiance divided by pi: the mean radiance of a hemisphere, weighted by the cosine.
fn aogrid_irradiance(environment: AogridEnvironment, map: texture_2d<f32>, map_sampler: sampler,
                     normal: vec3f) -> vec3f {
    let at = aogrid_environment_coordinate(aogrid_map_direction(environment, normal));
    let last = AOGRID_ENVIRONMENT_LAST_LEVEL;
    return aogrid_environment_at(map, map_sampler, at, last) * environment.scale.rgb;
}

/// The mean radiance of a cone, weighted by the cosine to its axis. Cones narrower than those of
/// level 0 use level 0.
fn aogrid_cone_radiance(environment: AogridEnvironment, map: texture_2d<f32>,
                        map_sampler: sampler, cone: AogridCone) -> vec3f {
    let at = aogrid_environment_coordinate(aogrid_map_direction(environment, cone.axis));
    let level = aogrid_environment_level(cone.fraction);
    let below = min(floor(level), AOGRID_ENVIRONMENT_LAST_LEVEL - 1.0);
    let narrow = aogrid_environment_at(map, map_sampler, at, below);
    let wide = aogrid_environment_at(map, map_sampler, at, below + 1.0);
    return mix(narrow, wide, level - below) * environment.scale.rgb;
}

/// Rotates a world direction into the map's axes.
fn aogrid_map_direction(environment: AogridEnvironment, direction: vec3f) -> vec3f {
    return vec3f(
        dot(environment.map_x.xyz, direction),
        dot(environment.map_y.xyz, direction),
        dot(environment.map_z.xyz, direction),
    );
}

/// The latitude-longitude coordinates of a direction of any length: turns from the left edge, and
/// half turns from the north pole.
fn aogrid_environment_coordinate(direction: vec3f) -> vec2f {
    // The azimuth of a pole and the colatitude of a zero direction are arbitrary, but atan2(0, 0)
    // is undefined.
    let level = length(direction.xz);
    let azimuth = atan2(direction.x, select(1.0, direction.z, level > 0.0));
    let colatitude = atan2(level, select(1.0, direction.y, level > 0.0 || direction.y != 0.0));
    return vec2f(fma(azimuth, -0.5 / AOGRID_PI, 0.5), colatitude / AOGRID_PI);
}

/// The level of the map whose cones cover this fraction, interpolated by its logarithm.
fn aogrid_environment_level(fraction: f32) -> f32 {
    let doubled = max(2.0 * fraction, AOGRID_FRACTION_EPSILON);
    let level = AOGRID_ENVIRONMENT_LAST_LEVEL + 0.5 * log2(doubled);
    return clamp(level, 0.0, AOGRID_ENVIRONMENT_LAST_LEVEL);
}

/// Samples a level of the map, whose rows lie on colatitudes from pole to pole.
fn aogrid_environment_at(map: texture_2d<f32>, map_sampler: sampler, at: vec2f,
                         level: f32) -> vec3f {
    let row = exp2(level) / AOGRID_ENVIRONMENT_HEIGHT;
    let v = fma(at.y, 1.0 - row, 0.5 * row);
    return textureSampleLevel(map, map_sampler, vec2f(at.x, v), level).rgb;
}
