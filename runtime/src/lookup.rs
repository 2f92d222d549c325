//! The CPU twin of `lookup.wgsl`: the place at which a receiver looks up a grid, and what is left of
//! a cone in the far field.

use crate::AogridOccluder;
use crate::wgsl::{
    AOGRID_AXIS_EPSILON, AOGRID_MAX_FLATNESS, AOGRID_NO_OBJECT, AOGRID_SQUARE_EPSILON,
};

/// The place at which a receiver looks up a grid, see [`aogrid_lookup`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AogridLookup {
    /// The position in the grid's box, \[0,1\]³. Beyond the hull of the outer cells' centers it is
    /// the point of the hull in the direction of the receiver.
    pub position: [f32; 3],
    /// Whether the occluder has an effect on the receiver.
    pub is_reached: bool,
    /// The vector from the box's center to the receiver in world space.
    pub outward: [f32; 3],
    /// The distance from the center in half-extents of the hull, at least 1.
    pub distance: f32,
    /// The share that is left of the hull's solid angle, to first order: it falls with the distance
    /// squared, and fades to nothing over the last quarter of the reach.
    pub remainder: f32,
    /// The object's flatness from this direction.
    pub flatness: f32,
}

/// Whether the occluder shades a receiver with this id and these layers.
pub fn aogrid_shades(occluder: &AogridOccluder, object_id: u32, layers: u32) -> bool {
    occluder.layers & layers != 0 && occluder.excluded.iter().all(|&id| id != object_id)
}

/// Whether a receiver with this id belongs to the occluder.
pub fn aogrid_is_on_itself(occluder: &AogridOccluder, object_id: u32) -> bool {
    object_id == occluder.object_id && object_id != AOGRID_NO_OBJECT
}

/// Applies a row of an affine map to a point.
pub fn aogrid_row(row: [f32; 4], v: [f32; 3]) -> f32 {
    row[0] * v[0] + (row[1] * v[1] + (row[2] * v[2] + row[3]))
}

/// The position of a world-space point in the grid's box, \[0,1\]³.
pub fn aogrid_grid_position(occluder: &AogridOccluder, position: [f32; 3]) -> [f32; 3] {
    [
        aogrid_row(occluder.grid_x, position),
        aogrid_row(occluder.grid_y, position),
        aogrid_row(occluder.grid_z, position),
    ]
}

/// The place at which a receiver at a world-space position looks up the grid; not reached for NaN.
/// In the far field it is on the hull of the outer cells' centers, on the ray from the box's center.
pub fn aogrid_lookup(occluder: &AogridOccluder, position: [f32; 3]) -> AogridLookup {
    let off_center = aogrid_grid_position(occluder, position).map(|p| p - 0.5);
    let scaled: [f32; 3] = std::array::from_fn(|x| off_center[x].abs() * occluder.per_hull[x]);
    let distance = scaled.into_iter().fold(1.0, f32::max);
    let per_distance = 1.0 / distance;
    let of_reach: [f32; 3] = std::array::from_fn(|x| off_center[x].abs() * occluder.per_reach[x]);
    let share = of_reach.into_iter().fold(0.0, f32::max);
    let fade = (share * occluder.fade_scale - 3.0).clamp(0.0, 1.0);
    let square = per_distance * per_distance;
    let [x, y, z, around] = occluder.flatness;
    AogridLookup {
        position: off_center.map(|x| x * per_distance + 0.5),
        is_reached: of_reach.iter().all(|s| *s <= 1.0),
        outward: std::array::from_fn(|axis| position[axis] - occluder.center[axis]),
        distance,
        remainder: (fade * fade * (2.0 * fade - 3.0) + 1.0) * square,
        flatness: dot(scaled.map(|s| s * s), [x, y, z]) * square + around,
    }
}

/// [`aogrid_lookup`] for a receiver that belongs to the occluder itself. Cells inside the object are
/// filled from outside; a fraction of a cell along the unit normal they weigh little.
pub fn aogrid_lookup_on_itself(
    occluder: &AogridOccluder,
    position: [f32; 3],
    normal: [f32; 3],
) -> AogridLookup {
    let rows = [occluder.grid_x, occluder.grid_y, occluder.grid_z];
    let steps: [f32; 3] = std::array::from_fn(|x| {
        let [a, b, c, _] = rows[x];
        occluder.per_step[x] * dot([a, b, c], normal)
    });
    let distance = 1.0 / dot(steps, steps).max(AOGRID_SQUARE_EPSILON).sqrt();
    let moved = std::array::from_fn(|x| normal[x] * distance + position[x]);
    aogrid_lookup(occluder, moved)
}

/// The fraction that an object occludes farther away, which occludes the fraction `a` at the hull. A
/// sphere's sin²α, k, falls with the distance squared, a disc's tan²α does: 1/k is the flatness and a
/// multiple of the distance squared. The part of a fraction beyond one half falls with the remainder.
pub fn aogrid_distant_fraction(a: f32, lookup: AogridLookup) -> f32 {
    // cos α, its positive and its negative part.
    let in_front = (-2.0 * a + 1.0).clamp(0.0, 1.0);
    let behind = (2.0 * a - 1.0).clamp(0.0, 1.0);
    let at_hull = 1.0 - in_front * in_front;
    let flat = (lookup.flatness * at_hull).min(AOGRID_MAX_FLATNESS);
    let k = at_hull * lookup.remainder / (lookup.remainder * flat + (1.0 - flat));
    -0.5 * ((1.0 - k).clamp(0.0, 1.0).sqrt() - behind * lookup.remainder) + 0.5
}

/// The unit axis towards what a unit axis at the hull points to, from where the look-up is.
pub fn aogrid_distant_axis(axis: [f32; 3], lookup: AogridLookup) -> [f32; 3] {
    let scale = (1.0 - lookup.distance) / dot(lookup.outward, lookup.outward).sqrt();
    let towards: [f32; 3] = std::array::from_fn(|x| lookup.outward[x] * scale + axis[x]);
    towards.map(|x| x * aogrid_inverse_length(towards))
}

/// 1 / |axis|, bounded for axes below the length that counts as no axis.
pub fn aogrid_inverse_length(axis: [f32; 3]) -> f32 {
    1.0 / dot(axis, axis).max(AOGRID_AXIS_EPSILON).sqrt()
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + (a[1] * b[1] + a[2] * b[2])
}
