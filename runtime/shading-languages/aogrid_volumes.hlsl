// aogrid: ambient-occlusion volumes; include it behind `aogrid`.
//
// Generated from WGSL by naga: do not edit. For shader model 5.0 or later.

#ifndef AOGRID_VOLUMES_HLSL
#define AOGRID_VOLUMES_HLSL

// The extent and weight of volumes, in a uniform: 16 bytes. Rust: `AogridVolume`.
struct AogridVolume {
    float extent;
    float exponent;
    uint weight;
    uint two_sided;
};

// A polygon of up to four corners relative to a receiver. Fewer repeat the last one.
struct AogridPolygon {
    float3 corners[4];
    int _end_pad_0;
};

// The signed distance of the origin beyond the edge from a to b in the plane with this normal.
float aogrid_edge_distance(float3 a, float3 b, float3 facing)
{
    float3 along = (b - a);
    float3 outward = cross(along, facing);
    return (-(dot(a, outward)) * rsqrt(max(dot(outward, outward), 1e-30)));
}

// The fall-off along the triangle's normal, 1 on its plane.
float aogrid_fall_off(AogridVolume volume, float height)
{
    float left = saturate((1.0 - (abs(height) / volume.extent)));
    return ((left > 0.0) ? pow(left, volume.exponent) : 0.0);
}

// The squared distance of the origin from a segment.
float aogrid_segment(float3 a, float3 b)
{
    float3 along = (b - a);
    float t = saturate((-(dot(a, along)) / max(dot(along, along), 1e-30)));
    float3 closest = mad(along, (t).xxx, a);
    return dot(closest, closest);
}

// The distance of the origin from the edges of a triangle.
float aogrid_distance(float3 a, float3 b, float3 c)
{
    const float _e1 = aogrid_segment(a, b);
    const float _e2 = aogrid_segment(b, c);
    const float _e3 = aogrid_segment(c, a);
    float squared = min(min(_e1, _e2), _e3);
    return sqrt(squared);
}

// The weight of a triangle's volume at a receiver at a signed height over its plane, 0..1.
float aogrid_volume_weight(AogridVolume volume, float3 a, float3 b, float3 c, float3 facing, float height)
{
    float per_extent = (1.0 / volume.extent);
    float3 foot = (height * facing);
    const float _e1 = aogrid_edge_distance((a + foot), (b + foot), facing);
    const float _e2 = aogrid_edge_distance((b + foot), (c + foot), facing);
    const float _e3 = aogrid_edge_distance((c + foot), (a + foot), facing);
    float3 outside = float3(_e1, _e2, _e3);
    if ((volume.weight == AOGRID_WEIGHT_EDGES)) {
        float3 ramps = saturate(((1.0).xxx - (outside * per_extent)));
        const float _e4 = aogrid_fall_off(volume, height);
        return (((ramps.x * ramps.y) * ramps.z) * _e4);
    }
    bool is_inside = all((outside <= (0.0).xxx));
    const float _e5 = aogrid_distance((a + foot), (b + foot), (c + foot));
    float distance = (is_inside ? 0.0 : _e5);
    if ((volume.weight == AOGRID_WEIGHT_NONE)) {
        return ((distance < volume.extent) ? 1.0 : 0.0);
    }
    const float _e6 = aogrid_fall_off(volume, height);
    return (saturate(mad(-(distance), per_extent, 1.0)) * _e6);
}

// The angle of an edge as seen from the receiver, times the cosine between its plane's normal and the
// receiver's; 0 for an edge without length or through the receiver. By an arc tangent, since an arc
// cosine loses small polygons.
float aogrid_edge_factor(float3 a, float3 b, float3 normal)
{
    float3 across = cross(a, b);
    float length = sqrt(dot(across, across));
    float angle = atan2(length, dot(a, b));
    return ((length > 1e-18) ? ((angle * dot(normal, across)) / length) : 0.0);
}

// The form factor of a polygon above the horizon: the share of the receiver's cosine-weighted
// hemisphere that it covers (Lambert; McGuire 2010, equation 1).
float aogrid_form_factor(AogridPolygon polygon, float3 normal)
{
    float3 p[4] = polygon.corners;
    const float _e1 = aogrid_edge_factor(p[0], p[1], normal);
    const float _e2 = aogrid_edge_factor(p[1], p[2], normal);
    const float _e3 = aogrid_edge_factor(p[2], p[3], normal);
    const float _e4 = aogrid_edge_factor(p[3], p[0], normal);
    float sum = (((_e1 + _e2) + _e3) + _e4);
    return (abs(sum) / 6.2831855);
}

// The point of the horizon between a point above it and one that is not.
float3 aogrid_crossing(float3 above, float3 below, float height, float depth)
{
    return mad((below - above), ((height / (height - depth))).xxx, above);
}

typedef float3 ret_Constructarray4_float3_[4];

ret_Constructarray4_float3_ Constructarray4_float3_(float3 arg0, float3 arg1, float3 arg2, float3 arg3) {
    float3 ret[4] = { arg0, arg1, arg2, arg3 };
    return ret;
}

AogridPolygon ConstructAogridPolygon(float3 arg0[4]) {
    AogridPolygon ret = (AogridPolygon)0;
    ret.corners = arg0;
    return ret;
}

// The part above the horizon of a triangle whose first corner is above it and whose last is not.
AogridPolygon aogrid_cut(float3 a, float3 b, float3 c, float3 heights)
{
    const float3 _e1 = aogrid_crossing(a, c, heights.x, heights.z);
    if ((heights.y > 0.0)) {
        const float3 _e2 = aogrid_crossing(b, c, heights.y, heights.z);
        const AogridPolygon aogridpolygon = ConstructAogridPolygon(Constructarray4_float3_(a, b, _e2, _e1));
        return aogridpolygon;
    }
    const float3 _e3 = aogrid_crossing(a, b, heights.x, heights.y);
    const AogridPolygon aogridpolygon_1 = ConstructAogridPolygon(Constructarray4_float3_(a, _e3, _e1, _e1));
    return aogridpolygon_1;
}

// The part of a triangle above the horizon of a receiver with this unit normal.
AogridPolygon aogrid_above_horizon(float3 a, float3 b, float3 c, float3 normal)
{
    bool local = (bool)0;
    bool local_1 = (bool)0;

    float3 heights = float3(dot(a, normal), dot(b, normal), dot(c, normal));
    bool3 is_above = (heights > (0.0).xxx);
    if (all(is_above)) {
        const AogridPolygon aogridpolygon = ConstructAogridPolygon(Constructarray4_float3_(a, b, c, c));
        return aogridpolygon;
    }
    if (!(any(is_above))) {
        const AogridPolygon aogridpolygon_1 = ConstructAogridPolygon(Constructarray4_float3_(a, a, a, a));
        return aogridpolygon_1;
    }
    if (is_above.x) {
        local = !(is_above.z);
    } else {
        local = false;
    }
    bool _e1 = local;
    if (_e1) {
        const AogridPolygon _e2 = aogrid_cut(a, b, c, heights);
        const AogridPolygon aogridpolygon_2 = _e2;
        return aogridpolygon_2;
    }
    if (is_above.y) {
        local_1 = !(is_above.x);
    } else {
        local_1 = false;
    }
    bool _e3 = local_1;
    if (_e3) {
        const AogridPolygon _e4 = aogrid_cut(b, c, a, heights.yzx);
        const AogridPolygon aogridpolygon_3 = _e4;
        return aogridpolygon_3;
    }
    const AogridPolygon _e5 = aogrid_cut(c, a, b, heights.zxy);
    const AogridPolygon aogridpolygon_4 = _e5;
    return aogridpolygon_4;
}

// The occlusion of a receiver by a triangle, 0..1: its form factor times the weight of its volume.
// The corners are relative to the receiver, counter-clockwise as seen from the front; `normal` is the
// receiver's unit normal.
float aogrid_volume_occlusion(AogridVolume volume, float3 a, float3 b, float3 c, float3 normal)
{
    bool local = (bool)0;

    float3 scaled_normal = cross((b - a), (c - a));
    float area = dot(scaled_normal, scaled_normal);
    if (!((area > 1e-30))) {
        return 0.0;
    }
    float3 facing = (scaled_normal * rsqrt(area));
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
    const float _e2 = aogrid_volume_weight(volume, a, b, c, facing, height);
    const AogridPolygon _e3 = aogrid_above_horizon(a, b, c, normal);
    const float _e4 = aogrid_form_factor(_e3, normal);
    return (_e2 * _e4);
}

// The weight of the occlusion at a neighbor q with unit normal m for a receiver p with unit normal n,
// 0..1: 0 for a neighbor that is `tolerance` off the receiver's plane or faces away.
float aogrid_upsample_weight(float3 p, float3 n, float3 q, float3 m, float tolerance)
{
    float away = abs(dot((q - p), n));
    float alike = saturate(dot(n, m));
    float squared = (alike * alike);
    float weight = (((1.0 - (away / tolerance)) * squared) * squared);
    return ((away < tolerance) ? weight : 0.0);
}

// The occlusion between four neighbors, from their bilinear shares and weights: that of the nearest
// one if none has a weight.
float aogrid_upsampled(float4 values, float4 shares, float4 weights)
{
    float4 all_ = (shares * weights);
    float sum = (((all_.x + all_.y) + all_.z) + all_.w);
    if ((sum > 1e-6)) {
        float4 weighted = (all_ * values);
        return ((((weighted.x + weighted.y) + weighted.z) + weighted.w) / sum);
    }
    float largest = max(max(shares.x, shares.y), max(shares.z, shares.w));
    float of_last_two = ((shares.z == largest) ? values.z : values.w);
    float of_last_three = ((shares.y == largest) ? values.y : of_last_two);
    return ((shares.x == largest) ? values.x : of_last_three);
}

#endif
