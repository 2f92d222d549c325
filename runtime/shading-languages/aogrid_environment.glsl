// aogrid: light from an environment; include it behind `aogrid`.
//
// Generated from WGSL by naga: do not edit. For GLSL ES 3.00 and GLSL 3.30
// or later: write `#version` and, for ES, `precision highp float; precision highp int;` before it.

#ifndef AOGRID_ENVIRONMENT_GLSL
#define AOGRID_ENVIRONMENT_GLSL

// The orientation and scale of an environment map, in a uniform buffer: 64 bytes.
struct AogridEnvironment {
    vec4 map_x;
    vec4 map_y;
    vec4 map_z;
    vec4 scale;
};

// The latitude-longitude coordinates of a direction of any length: turns from the left edge, and
// half turns from the north pole.
vec2 aogrid_environment_coordinate(vec3 direction) {
    bool local = false;
    float level = length(direction.xz);
    float azimuth = atan(direction.x, ((level > 0.0) ? direction.z : 1.0));
    if (!((level > 0.0))) {
        local = (direction.y != 0.0);
    } else {
        local = true;
    }
    bool _e1 = local;
    float colatitude = atan(level, (_e1 ? direction.y : 1.0));
    return vec2((azimuth * -0.15915494 + 0.5), (colatitude / 3.1415927));
}

// Rotates a world direction into the map's axes.
vec3 aogrid_map_direction(AogridEnvironment environment, vec3 direction) {
    return vec3(dot(environment.map_x.xyz, direction), dot(environment.map_y.xyz, direction), dot(environment.map_z.xyz, direction));
}

// Samples a level of the map, whose rows lie on colatitudes from pole to pole.
vec3 aogrid_environment_at(highp sampler2D map, vec2 at, float level) {
    float row = (exp2(level) / 256.0);
    float v = (at.y * (1.0 - row) + (0.5 * row));
    vec4 _e1 = textureLod(map, vec2(vec2(at.x, v)), level);
    return _e1.xyz;
}

// The irradiance divided by pi: the mean radiance of a hemisphere, weighted by the cosine.
vec3 aogrid_irradiance(AogridEnvironment environment, highp sampler2D map, vec3 normal) {
    vec3 _e1 = aogrid_map_direction(environment, normal);
    vec2 _e2 = aogrid_environment_coordinate(_e1);
    vec3 _e3 = aogrid_environment_at(map, _e2, 4.0);
    return (_e3 * environment.scale.xyz);
}

// The cone as a diffuse receiver weights it: around the mean of its directions, each weighted by
// its cosine to the normal. With c = 1 - 2a that mean points along 3c(1 + c)(d.n) d + (1 - c)(2 +
// c) n. The fraction a is the one that the cone covers, not the one over which it is spread:
// several occluders' sum of (AO/2) d' already contains the cosine of each.
AogridCone aogrid_cosine_weighted_cone(AogridCone cone, vec3 normal) {
    float c = ((-2.0 * cone.fraction) * cone.density + 1.0);
    float along = (((3.0 * c) * (1.0 + c)) * max(dot(cone.axis, normal), 1e-6));
    vec3 sum = ((along * cone.axis) + (((1.0 - c) * (2.0 + c)) * normal));
    float _e1 = aogrid_inverse_length(sum);
    return AogridCone((sum * _e1), cone.fraction, cone.density);
}

// The fraction a of a cone with this AO and its axis at `cos_beta` to the normal: AO = 4a(1 - a)
// cos beta, exact for a cone above the horizon.
float aogrid_occluded_fraction(float occlusion, float cos_beta) {
    float sin_alpha_squared = clamp((occlusion / max(cos_beta, 1e-6)), 0.0, 1.0);
    return (0.5 - (0.5 * sqrt((1.0 - sin_alpha_squared))));
}

// The cone that a pixel's occluders block, as seen by the receiver. The sum of all (AO/2) d' has
// the length AO/2 for occluders in one direction and is shorter for occluders in several. The cone
// is then widened until the mean of its directions is shorter by the same factor, and its density
// lowered accordingly.
AogridCone aogrid_occluded_cone(vec4 accumulated, vec3 normal) {
    float occlusion = (1.0 - accumulated.w);
    float axis_length = length(accumulated.xyz);
    bool has_axis = ((axis_length * axis_length) > 1e-8);
    float _e1 = aogrid_inverse_length(accumulated.xyz);
    vec3 axis = (has_axis ? (accumulated.xyz * _e1) : normal);
    float alignment = clamp(((2.0 * axis_length) / max(occlusion, 1e-6)), 0.0, 1.0);
    float _e2 = aogrid_occluded_fraction(occlusion, dot(axis, normal));
    float widened = min((1.0 - (alignment * (1.0 - _e2))), 0.5);
    return AogridCone(axis, widened, (_e2 / max(widened, 1e-6)));
}

// The level of the map whose cones cover this fraction, interpolated by its logarithm.
float aogrid_environment_level(float fraction) {
    float doubled = max((2.0 * fraction), 1e-6);
    float level = (4.0 + (0.5 * log2(doubled)));
    return clamp(level, 0.0, 4.0);
}

// The mean radiance of a cone, weighted by the cosine to its axis. Cones narrower than those of
// level 0 use level 0.
vec3 aogrid_cone_radiance(AogridEnvironment environment, highp sampler2D map, AogridCone cone) {
    vec3 _e1 = aogrid_map_direction(environment, cone.axis);
    vec2 _e2 = aogrid_environment_coordinate(_e1);
    float _e3 = aogrid_environment_level(cone.fraction);
    float below = min(floor(_e3), 3.0);
    vec3 _e4 = aogrid_environment_at(map, _e2, below);
    vec3 _e5 = aogrid_environment_at(map, _e2, (below + 1.0));
    return (mix(_e4, _e5, (_e3 - below)) * environment.scale.xyz);
}

// The light that a white diffuse surface reflects: the mean radiance of its hemisphere, less AO
// times that of the occluded cone.
vec3 aogrid_lambertian(AogridEnvironment environment, highp sampler2D map, vec4 accumulated, vec3 normal) {
    vec3 _e1 = aogrid_irradiance(environment, map, normal);
    AogridCone _e2 = aogrid_occluded_cone(accumulated, normal);
    AogridCone _e3 = aogrid_cosine_weighted_cone(_e2, normal);
    vec3 _e4 = aogrid_cone_radiance(environment, map, _e3);
    return max((_e1 - ((1.0 - accumulated.w) * _e4)), vec3(0.0));
}

// The half-angle of a cone of this fraction.
float aogrid_half_angle(float fraction) {
    return (2.0 * atan(sqrt(fraction), sqrt((1.0 - fraction))));
}

// The fraction of the sphere inside two cones, each of at most a hemisphere, with these fractions
// and half-angles and with axes gamma apart. The derivation is that of `aogrid_tables::merge`.
float aogrid_shared_fraction(vec2 a, vec2 alpha, float gamma) {
    bool local = false;
    float pi_minus_s = (3.1415927 - (0.5 * ((alpha.x + alpha.y) + gamma)));
    vec2 s_minus_alpha = (0.5 * ((alpha.yx + vec2(gamma)) - alpha));
    float s_minus_gamma = (0.5 * ((alpha.x + alpha.y) - gamma));
    if (!((s_minus_gamma <= 0.0))) {
        local = (pi_minus_s <= 0.0);
    } else {
        local = true;
    }
    bool _e1 = local;
    if (_e1) {
        return 0.0;
    }
    if ((min(s_minus_alpha.x, s_minus_alpha.y) <= 0.0)) {
        return min(a.x, a.y);
    }
    vec4 half_sin = sin((0.5 * vec4(pi_minus_s, s_minus_alpha, s_minus_gamma)));
    vec4 half_cos = cos((0.5 * vec4(pi_minus_s, s_minus_alpha, s_minus_gamma)));
    vec4 sines = ((2.0 * half_sin) * half_cos);
    float angle_x = (2.0 * atan(sqrt((sines.y * sines.w)), sqrt((sines.x * sines.z))));
    float angle_y = (2.0 * atan(sqrt((sines.z * sines.w)), sqrt((sines.x * sines.y))));
    float numerator = sqrt((((half_cos.x * half_sin.y) * half_sin.z) * half_sin.w));
    float denominator = sqrt((((half_sin.x * half_cos.y) * half_cos.z) * half_cos.w));
    float triangle = (4.0 * atan(numerator, denominator));
    float lens = ((((a.x * angle_x) + (a.y * angle_y)) - (0.5 * triangle)) / 3.1415927);
    return clamp(lens, 0.0, min(a.x, a.y));
}

// The intersection of two cones, as a cone of the shared fraction around the middle of the lens.
// The middle lies on the arc between the axes. For cones of one size it is halfway along the part
// of the arc that both cover. If a larger cone cuts a smaller one, it is nearer to the smaller
// one's axis the less is cut off: we interpolate by the fourth root of the fraction cut off, which
// is within 0.02 of the smaller cone's radius.
AogridCone aogrid_shared_cone(AogridCone first, AogridCone second) {
    float cos_gamma = dot(first.axis, second.axis);
    vec3 across = (second.axis - (cos_gamma * first.axis));
    float gamma = atan(length(across), cos_gamma);
    vec2 a = vec2(first.fraction, second.fraction);
    float _e1 = aogrid_half_angle(a.x);
    float _e2 = aogrid_half_angle(a.y);
    vec2 alpha = vec2(_e1, _e2);
    float _e3 = aogrid_shared_fraction(a, alpha, gamma);
    float halfway = (0.5 * (max(-(alpha.x), (gamma - alpha.y)) + min(alpha.x, (gamma + alpha.y))));
    float smaller_center = ((a.x <= a.y) ? 0.0 : gamma);
    float fraction_cut_off = clamp((1.0 - (_e3 / max(min(a.x, a.y), 1e-6))), 0.0, 1.0);
    float middle = mix(smaller_center, halfway, sqrt(sqrt(fraction_cut_off)));
    float _e4 = aogrid_inverse_length(across);
    vec3 towards = (across * _e4);
    vec3 axis = ((cos(middle) * first.axis) + (sin(middle) * towards));
    return AogridCone(axis, _e3, (first.density * second.density));
}

// The light that a glossy surface reflects: the mean radiance of a lobe, less the occluded share
// of the lobe times the mean radiance of that share. The lobe is a cone of `lobe_fraction` around
// the mirror direction, as far as it lies above the surface.
vec3 aogrid_glossy(AogridEnvironment environment, highp sampler2D map, vec4 accumulated, vec3 normal, vec3 mirrored, float lobe_fraction) {
    AogridCone full_lobe = AogridCone(mirrored, lobe_fraction, 1.0);
    AogridCone _e1 = aogrid_shared_cone(full_lobe, AogridCone(normal, 0.5, 1.0));
    AogridCone _e2 = aogrid_occluded_cone(accumulated, normal);
    AogridCone _e3 = aogrid_shared_cone(full_lobe, _e2);
    float covered = (_e3.fraction / max(_e1.fraction, 1e-6));
    float share = (_e3.density * clamp(covered, 0.0, 1.0));
    vec3 _e4 = aogrid_cone_radiance(environment, map, _e1);
    vec3 _e5 = aogrid_cone_radiance(environment, map, _e3);
    return max((_e4 - (share * _e5)), vec3(0.0));
}

// The direction in which a surface mirrors a viewer: `eye` is a position with w = 1, or a
// direction towards the viewer with w = 0.
vec3 aogrid_mirrored(vec4 eye, vec3 position, vec3 normal) {
    vec3 towards = (eye.xyz - (eye.w * position));
    float _e1 = aogrid_inverse_length(towards);
    vec3 view = (towards * _e1);
    return (((2.0 * dot(view, normal)) * normal) - view);
}

#endif
