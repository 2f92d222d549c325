//! The twin of `volumes.wgsl`, in single precision and under its names.

use std::f32::consts::TAU;

use glam::Vec3;

use super::{AOGRID_WEIGHT_EDGES, AOGRID_WEIGHT_NONE, AogridVolume};
use crate::wgsl::{AOGRID_FRACTION_EPSILON, AOGRID_LENGTH_EPSILON, AOGRID_SQUARE_EPSILON};

/// The occlusion of a receiver by a triangle, 0..=1: its form factor times the weight of its volume.
/// The corners are relative to the receiver, counter-clockwise as seen from the front; `normal` is the
/// receiver's unit normal.
pub fn aogrid_volume_occlusion(
    volume: AogridVolume,
    [a, b, c]: [[f32; 3]; 3],
    normal: [f32; 3],
) -> f32 {
    let corners = [a, b, c].map(Vec3::from);
    let [a, b, c] = corners;
    let scaled_normal = (b - a).cross(c - a);
    let area = scaled_normal.length_squared();
    if area.is_nan() || area <= AOGRID_SQUARE_EPSILON {
        return 0.0;
    }
    let facing = scaled_normal / area.sqrt();
    let height = -a.dot(facing);
    let above = if volume.two_sided != 0 {
        height.abs()
    } else {
        height
    };
    if !(above > 0.0 && above < volume.extent) {
        return 0.0;
    }
    let weight = aogrid_volume_weight(volume, corners.map(|p| p.to_array()), height);
    let polygon = aogrid_above_horizon(corners.map(|p| p.to_array()), normal);
    weight * aogrid_form_factor(polygon, normal)
}

/// The weight of a triangle's volume at a receiver at a signed height over its plane, 0..=1. The
/// triangle has an area.
pub fn aogrid_volume_weight(volume: AogridVolume, corners: [[f32; 3]; 3], height: f32) -> f32 {
    let [a, b, c] = corners.map(Vec3::from);
    let facing = (b - a).cross(c - a).normalize();
    // The corners relative to the receiver's foot in the triangle's plane.
    let [a, b, c] = [a, b, c].map(|p| p + height * facing);
    let edges = [[a, b], [b, c], [c, a]];
    let outside = edges.map(|edge| aogrid_edge_distance(edge, facing));
    if volume.weight == AOGRID_WEIGHT_EDGES {
        let ramps = outside.map(|d| (1.0 - d / volume.extent).clamp(0.0, 1.0));
        return ramps[0] * ramps[1] * ramps[2] * aogrid_fall_off(volume, height);
    }
    let distance = match outside.iter().all(|d| *d <= 0.0) {
        true => 0.0,
        false => aogrid_distance([a, b, c]),
    };
    if volume.weight == AOGRID_WEIGHT_NONE {
        return f32::from(u8::from(distance < volume.extent));
    }
    (1.0 - distance / volume.extent).clamp(0.0, 1.0) * aogrid_fall_off(volume, height)
}

/// The fall-off along the triangle's normal, 1 on its plane.
pub fn aogrid_fall_off(volume: AogridVolume, height: f32) -> f32 {
    let left = 1.0 - height.abs() / volume.extent;
    match left > 0.0 {
        true => left.powf(volume.exponent),
        false => 0.0,
    }
}

/// The signed distance of the origin beyond an edge in the plane with this normal.
pub fn aogrid_edge_distance([a, b]: [Vec3; 2], facing: Vec3) -> f32 {
    let outward = (b - a).cross(facing);
    -a.dot(outward) / outward.length_squared().max(AOGRID_SQUARE_EPSILON).sqrt()
}

/// The distance of the origin from the edges of a triangle.
pub fn aogrid_distance([a, b, c]: [Vec3; 3]) -> f32 {
    let squared = [[a, b], [b, c], [c, a]].map(aogrid_segment);
    squared.into_iter().fold(f32::INFINITY, f32::min).sqrt()
}

/// The squared distance of the origin from a segment.
pub fn aogrid_segment([a, b]: [Vec3; 2]) -> f32 {
    let along = b - a;
    let t = -a.dot(along) / along.length_squared().max(AOGRID_SQUARE_EPSILON);
    (a + along * t.clamp(0.0, 1.0)).length_squared()
}

/// The weight of the occlusion at a neighbor with a position and unit normal for a receiver with the same,
/// 0..=1: 0 for a neighbor that is `tolerance` off the receiver's plane or faces away.
pub fn aogrid_upsample_weight([p, n]: [[f32; 3]; 2], [q, m]: [[f32; 3]; 2], tolerance: f32) -> f32 {
    let [p, n, q, m] = [p, n, q, m].map(Vec3::from);
    let away = (q - p).dot(n).abs();
    let alike = n.dot(m).clamp(0.0, 1.0);
    match away < tolerance {
        true => (1.0 - away / tolerance) * alike.powi(4),
        false => 0.0,
    }
}

/// The occlusion between four neighbors, from their bilinear shares and weights: that of the nearest
/// one if none has a weight.
pub fn aogrid_upsampled(values: [f32; 4], shares: [f32; 4], weights: [f32; 4]) -> f32 {
    let all: [f32; 4] = std::array::from_fn(|i| shares[i] * weights[i]);
    let sum: f32 = all.iter().sum();
    if sum > AOGRID_FRACTION_EPSILON {
        return all.iter().zip(values).map(|(w, v)| w * v).sum::<f32>() / sum;
    }
    let largest = shares.into_iter().fold(0.0, f32::max);
    let nearest = shares.iter().position(|share| *share == largest);
    values[nearest.unwrap_or(0)]
}

/// The part of a triangle above the horizon of a receiver with this unit normal: four corners, of which
/// some repeat if there are fewer.
pub fn aogrid_above_horizon(corners: [[f32; 3]; 3], normal: [f32; 3]) -> [[f32; 3]; 4] {
    let [a, b, c] = corners.map(Vec3::from);
    let heights = [a, b, c].map(|p| p.dot(Vec3::from(normal)));
    let [x, y, z] = heights.map(|height| height > 0.0);
    let polygon = match (x, y, z) {
        (true, true, true) => [a, b, c, c],
        (false, false, false) => [a; 4],
        // Turned so that the first corner is above, and the last below.
        (true, _, false) => aogrid_cut([a, b, c], heights),
        (false, true, _) => aogrid_cut([b, c, a], [heights[1], heights[2], heights[0]]),
        (_, false, true) => aogrid_cut([c, a, b], [heights[2], heights[0], heights[1]]),
    };
    polygon.map(|p| p.to_array())
}

/// The part above the horizon of a triangle whose first corner is above it and whose last is not.
pub fn aogrid_cut([a, b, c]: [Vec3; 3], [of_a, of_b, of_c]: [f32; 3]) -> [Vec3; 4] {
    let to_last = aogrid_crossing([a, c], of_a, of_c);
    match of_b > 0.0 {
        true => [a, b, aogrid_crossing([b, c], of_b, of_c), to_last],
        false => [a, aogrid_crossing([a, b], of_a, of_b), to_last, to_last],
    }
}

/// The point of the horizon between a point above it and one that is not.
pub fn aogrid_crossing([above, below]: [Vec3; 2], height: f32, depth: f32) -> Vec3 {
    above + (below - above) * (height / (height - depth))
}

/// The form factor of a polygon above the horizon: the share of the receiver's cosine-weighted
/// hemisphere that it covers (Lambert; McGuire 2010, equation 1).
pub fn aogrid_form_factor(polygon: [[f32; 3]; 4], normal: [f32; 3]) -> f32 {
    let [p, q, r, s] = polygon.map(Vec3::from);
    let normal = Vec3::from(normal);
    let edges = [[p, q], [q, r], [r, s], [s, p]];
    let sum: f32 = edges
        .map(|edge| aogrid_edge_factor(edge, normal))
        .iter()
        .sum();
    sum.abs() / TAU
}

/// The angle of an edge as seen from the receiver, times the cosine between its plane's normal and the
/// receiver's; 0 for an edge without length or through the receiver.
pub fn aogrid_edge_factor([a, b]: [Vec3; 2], normal: Vec3) -> f32 {
    let across = a.cross(b);
    let length = across.length();
    match length > AOGRID_LENGTH_EPSILON {
        true => length.atan2(a.dot(b)) * normal.dot(across) / length,
        false => 0.0,
    }
}
