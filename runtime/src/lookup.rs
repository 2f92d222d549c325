//! The CPU twin of `lookup.wgsl`: the place at which a receiver looks up a grid, and what is left of
//! a cone in the far field.

use crate::AogridOccluder;
use crate::wgsl::{AOGRID_AXIS_EPSILON, AOGRID_NO_OBJECT, AOGRID_SQUARE_EPSILON};

/// The place at which a receiver looks up a grid, see [`aogrid_lookup`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AogridLookup {
    /// The position in the grid's box, \[0,1\]³. Beyond the hull of the outer cells' centers it is
    /// the point of the hull in the direction of the receiver.
    pub position: [f32; 3],
    /// Whether the occluder has an effect on the receiver.
    pub is_reached: bool,
    /// The direction from the box's center to the receiver in world space, times the distance beyond
    /// the hull in its half-extents; zero in the hull.
    pub outward: [f32; 3],
    /// The share that is left of the hull's sin²α: 1 in the hull, 0 where the effect ends.
    pub remainder: f32,
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
    let p_grid = aogrid_grid_position(occluder, position);
    let off_center = p_grid.map(|p| p - 0.5);
    let scaled: [f32; 3] = std::array::from_fn(|x| off_center[x].abs() * occluder.per_extent[x]);
    // 1 where the effect ends.
    let distance = scaled[0].max(scaled[1]).max(scaled[2]);
    // The same in half-extents of the hull.
    let s = distance * occluder.reach;
    let mut lookup = AogridLookup {
        position: p_grid,
        is_reached: scaled.iter().all(|x| *x <= 1.0),
        outward: [0.0; 3],
        remainder: 1.0,
    };
    if lookup.is_reached && s > 1.0 {
        let fade = (4.0 * distance - 3.0).clamp(0.0, 1.0);
        let from_center: [f32; 3] = std::array::from_fn(|x| position[x] - occluder.center[x]);
        let length = dot(from_center, from_center).sqrt();
        lookup.position = off_center.map(|x| x / s + 0.5);
        lookup.outward = from_center.map(|x| (s - 1.0) * (x / length));
        lookup.remainder = (fade * fade * (2.0 * fade - 3.0) + 1.0) / (s * s);
    }
    lookup
}

/// [`aogrid_lookup`] for a receiver that belongs to the occluder itself. Cells inside the object are
/// filled from outside; a fraction of a cell along the unit normal they weigh little.
pub fn aogrid_lookup_on_itself(
    occluder: &AogridOccluder,
    position: [f32; 3],
    normal: [f32; 3],
) -> AogridLookup {
    let rows = [occluder.grid_x, occluder.grid_y, occluder.grid_z];
    let cells: [f32; 3] = std::array::from_fn(|x| {
        let [a, b, c, _] = rows[x];
        occluder.cells[x] * dot([a, b, c], normal)
    });
    let distance = occluder.self_offset / dot(cells, cells).max(AOGRID_SQUARE_EPSILON).sqrt();
    let moved = std::array::from_fn(|x| normal[x] * distance + position[x]);
    aogrid_lookup(occluder, moved)
}

/// The fraction that a sphere occludes farther away, where a share `remainder` is left of its sin²α.
/// The part of a fraction beyond one half fades as fast.
pub fn aogrid_distant_fraction(a: f32, remainder: f32) -> f32 {
    let cos_alpha = -2.0 * a + 1.0;
    let in_front = cos_alpha.max(0.0);
    let square = (in_front * in_front - 1.0) * remainder + 1.0;
    let behind = cos_alpha.min(0.0) * remainder;
    -0.5 * (square.max(0.0).sqrt() + behind) + 0.5
}

/// The axis towards what an axis at the hull points to, from farther away (see
/// [`AogridLookup::outward`]). It keeps its length.
pub fn aogrid_distant_axis(axis: [f32; 3], outward: [f32; 3]) -> [f32; 3] {
    let per_length = aogrid_inverse_length(axis);
    let towards: [f32; 3] = std::array::from_fn(|x| axis[x] * per_length - outward[x]);
    let length = aogrid_inverse_length(towards) * dot(axis, axis) * per_length;
    towards.map(|x| x * length)
}

/// 1 / |axis|, bounded for axes below the length that counts as no axis.
pub fn aogrid_inverse_length(axis: [f32; 3]) -> f32 {
    1.0 / dot(axis, axis).max(AOGRID_AXIS_EPSILON).sqrt()
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + (a[1] * b[1] + a[2] * b[2])
}
