// aogrid: ambient-occlusion volumes; include it behind `aogrid`.
//
// Generated from WGSL by naga: do not edit. For GLSL ES 3.00 and GLSL 3.30
// or later: write `#version` and, for ES, `precision highp float; precision highp int;` before it.

#ifndef AOGRID_VOLUMES_GLSL
#define AOGRID_VOLUMES_GLSL

// The extent and weight of volumes, in a uniform: 16 bytes. Rust: `AogridVolume`.
struct AogridVolume {
    float extent;
    float exponent;
    uint weight;
    uint two_sided;
};

// A polygon of up to four corners relative to a receiver. Fewer repeat the last one.
struct AogridPolygon {
    vec3 corners[4];
};

// The signed distance of the origin beyond the edge from a to b in the plane with this normal.
float aogrid_edge_distance(vec3 a, vec3 b, vec3 facing) {
    vec3 along = (b - a);
    vec3 outward = cross(along, facing);
    return (-(dot(a, outward)) * inversesqrt(max(dot(outward, outward), 1e-30)));
}

// The fall-off along the triangle's normal, 1 on its plane.
float aogrid_fall_off(AogridVolume volume, float height) {
    float left = clamp((1.0 - (abs(height) / volume.extent)), 0.0, 1.0);
    return ((left > 0.0) ? pow(left, volume.exponent) : 0.0);
}

// The squared distance of the origin from a segment.
float aogrid_segment(vec3 a, vec3 b) {
    vec3 along = (b - a);
    float t = clamp((-(dot(a, along)) / max(dot(along, along), 1e-30)), 0.0, 1.0);
    vec3 closest = (along * vec3(t) + a);
    return dot(closest, closest);
}

// The distance of the origin from the edges of a triangle.
float aogrid_distance(vec3 a, vec3 b, vec3 c) {
    float _e1 = aogrid_segment(a, b);
    float _e2 = aogrid_segment(b, c);
    float _e3 = aogrid_segment(c, a);
    float squared = min(min(_e1, _e2), _e3);
    return sqrt(squared);
}

// The weight of a triangle's volume at a receiver at a signed height over its plane, 0..1.
float aogrid_volume_weight(AogridVolume volume, vec3 a, vec3 b, vec3 c, vec3 facing, float height) {
    float per_extent = (1.0 / volume.extent);
    vec3 foot = (height * facing);
    float _e1 = aogrid_edge_distance((a + foot), (b + foot), facing);
    float _e2 = aogrid_edge_distance((b + foot), (c + foot), facing);
    float _e3 = aogrid_edge_distance((c + foot), (a + foot), facing);
    vec3 outside = vec3(_e1, _e2, _e3);
    if ((volume.weight == AOGRID_WEIGHT_EDGES)) {
        vec3 ramps = clamp((vec3(1.0) - (outside * per_extent)), vec3(0.0), vec3(1.0));
        float _e4 = aogrid_fall_off(volume, height);
        return (((ramps.x * ramps.y) * ramps.z) * _e4);
    }
    bool is_inside = all(lessThanEqual(outside, vec3(0.0)));
    float _e5 = aogrid_distance((a + foot), (b + foot), (c + foot));
    float distance = (is_inside ? 0.0 : _e5);
    if ((volume.weight == AOGRID_WEIGHT_NONE)) {
        return ((distance < volume.extent) ? 1.0 : 0.0);
    }
    float _e6 = aogrid_fall_off(volume, height);
    return (clamp((-(distance) * per_extent + 1.0), 0.0, 1.0) * _e6);
}

// The angle of an edge as seen from the receiver, times the cosine between its plane's normal and the
// receiver's; 0 for an edge without length or through the receiver. By an arc tangent, since an arc
// cosine loses small polygons.
float aogrid_edge_factor(vec3 a, vec3 b, vec3 normal) {
    vec3 across = cross(a, b);
    float length = sqrt(dot(across, across));
    float angle = atan(length, dot(a, b));
    return ((length > 1e-18) ? ((angle * dot(normal, across)) / length) : 0.0);
}

// The form factor of a polygon above the horizon: the share of the receiver's cosine-weighted
// hemisphere that it covers (Lambert; McGuire 2010, equation 1).
float aogrid_form_factor(AogridPolygon polygon, vec3 normal) {
    vec3 p[4] = polygon.corners;
    float _e1 = aogrid_edge_factor(p[0], p[1], normal);
    float _e2 = aogrid_edge_factor(p[1], p[2], normal);
    float _e3 = aogrid_edge_factor(p[2], p[3], normal);
    float _e4 = aogrid_edge_factor(p[3], p[0], normal);
    float sum = (((_e1 + _e2) + _e3) + _e4);
    return (abs(sum) / 6.2831855);
}

// The point of the horizon between a point above it and one that is not.
vec3 aogrid_crossing(vec3 above, vec3 below, float height, float depth) {
    return ((below - above) * vec3((height / (height - depth))) + above);
}

// The part above the horizon of a triangle whose first corner is above it and whose last is not.
AogridPolygon aogrid_cut(vec3 a, vec3 b, vec3 c, vec3 heights) {
    vec3 _e1 = aogrid_crossing(a, c, heights.x, heights.z);
    if ((heights.y > 0.0)) {
        vec3 _e2 = aogrid_crossing(b, c, heights.y, heights.z);
        return AogridPolygon(vec3[4](a, b, _e2, _e1));
    }
    vec3 _e3 = aogrid_crossing(a, b, heights.x, heights.y);
    return AogridPolygon(vec3[4](a, _e3, _e1, _e1));
}

// The part of a triangle above the horizon of a receiver with this unit normal.
AogridPolygon aogrid_above_horizon(vec3 a, vec3 b, vec3 c, vec3 normal) {
    bool local = false;
    bool local_1 = false;
    vec3 heights = vec3(dot(a, normal), dot(b, normal), dot(c, normal));
    bvec3 is_above = greaterThan(heights, vec3(0.0));
    if (all(is_above)) {
        return AogridPolygon(vec3[4](a, b, c, c));
    }
    if (!(any(is_above))) {
        return AogridPolygon(vec3[4](a, a, a, a));
    }
    if (is_above.x) {
        local = !(is_above.z);
    } else {
        local = false;
    }
    bool _e1 = local;
    if (_e1) {
        AogridPolygon _e2 = aogrid_cut(a, b, c, heights);
        return _e2;
    }
    if (is_above.y) {
        local_1 = !(is_above.x);
    } else {
        local_1 = false;
    }
    bool _e3 = local_1;
    if (_e3) {
        AogridPolygon _e4 = aogrid_cut(b, c, a, heights.yzx);
        return _e4;
    }
    AogridPolygon _e5 = aogrid_cut(c, a, b, heights.zxy);
    return _e5;
}

// The occlusion of a receiver by a triangle, 0..1: its form factor times the weight of its volume.
// The corners are relative to the receiver, counter-clockwise as seen from the front; `normal` is the
// receiver's unit normal.
float aogrid_volume_occlusion(AogridVolume volume, vec3 a, vec3 b, vec3 c, vec3 normal) {
    bool local = false;
    vec3 scaled_normal = cross((b - a), (c - a));
    float area = dot(scaled_normal, scaled_normal);
    if (!((area > 1e-30))) {
        return 0.0;
    }
    vec3 facing = (scaled_normal * inversesqrt(area));
    float height = -(dot(a, facing));
    float above = ((volume.two_sided != 0u) ? abs(height) : height);
    if ((above > 0.0)) {
        local = (above < volume.extent);
    } else {
        local = false;
    }
    bool _e1 = local;
    if (!(_e1)) {
        return 0.0;
    }
    float _e2 = aogrid_volume_weight(volume, a, b, c, facing, height);
    AogridPolygon _e3 = aogrid_above_horizon(a, b, c, normal);
    float _e4 = aogrid_form_factor(_e3, normal);
    return (_e2 * _e4);
}

// The weight of the occlusion at a neighbor q with unit normal m for a receiver p with unit normal n,
// 0..1: 0 for a neighbor that is `tolerance` off the receiver's plane or faces away.
float aogrid_upsample_weight(vec3 p, vec3 n, vec3 q, vec3 m, float tolerance) {
    float away = abs(dot((q - p), n));
    float alike = clamp(dot(n, m), 0.0, 1.0);
    float squared = (alike * alike);
    float weight = (((1.0 - (away / tolerance)) * squared) * squared);
    return ((away < tolerance) ? weight : 0.0);
}

// The occlusion between four neighbors, from their bilinear shares and weights: that of the nearest
// one if none has a weight.
float aogrid_upsampled(vec4 values, vec4 shares, vec4 weights) {
    vec4 all_ = (shares * weights);
    float sum = (((all_.x + all_.y) + all_.z) + all_.w);
    if ((sum > 1e-6)) {
        vec4 weighted = (all_ * values);
        return ((((weighted.x + weighted.y) + weighted.z) + weighted.w) / sum);
    }
    float largest = max(max(shares.x, shares.y), max(shares.z, shares.w));
    float of_last_two = ((shares.z == largest) ? values.z : values.w);
    float of_last_three = ((shares.y == largest) ? values.y : of_last_two);
    return ((shares.x == largest) ? values.x : of_last_three);
}

#endif
