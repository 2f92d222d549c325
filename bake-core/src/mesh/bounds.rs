//! The box around a mesh, and the origin of its coordinates.

use super::area::{cross, has_area};

/// The distance of a mesh from the origin, in its own largest half-extents, from which positions
/// become relative to its center. Nearer, a single float has at least 19 of its 24 bits for the
/// mesh itself; that is the precision of the baker's lattice across a grid of 32 cells.
const MAX_OFF_CENTER: f64 = 16.0;

/// An axis-aligned box around the triangles, in object units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: [f32; 3],
    /// Largest coordinates.
    pub max: [f32; 3],
    /// The point in object space that the coordinates are relative to: zero, but for a mesh that is
    /// far from zero.
    pub origin: [f64; 3],
}

impl Bounds {
    const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
        origin: [0.0; 3],
    };

    /// Returns the bounds of the triangles that have an area, if there are any.
    pub(crate) fn of_triangles(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Option<Self> {
        let mut bounds = Self::EMPTY;
        let mut any = false;
        for t in triangles {
            let corners = t.map(|v| positions[v as usize]);
            // A corner within the bounds need not be measured.
            if any && corners.iter().all(|p| bounds.contains(*p)) {
                continue;
            }
            if has_area(corners) {
                any = true;
                corners.into_iter().for_each(|p| bounds.add(p));
            }
        }
        any.then_some(bounds)
    }

    fn add(&mut self, position: [f32; 3]) {
        for (axis, v) in position.into_iter().enumerate() {
            self.min[axis] = self.min[axis].min(v);
            self.max[axis] = self.max[axis].max(v);
        }
    }

    pub(super) fn contains(&self, position: [f32; 3]) -> bool {
        (0..3).all(|x| (self.min[x]..=self.max[x]).contains(&position[x]))
    }

    /// Returns the center of the box, relative to the origin.
    pub fn center(&self) -> [f32; 3] {
        std::array::from_fn(|x| ((f64::from(self.min[x]) + f64::from(self.max[x])) / 2.0) as f32)
    }

    /// Returns half the size along each axis, measured from [`Bounds::center`].
    pub fn half_extents(&self) -> [f64; 3] {
        let center = self.center();
        std::array::from_fn(|x| {
            let c = f64::from(center[x]);
            (f64::from(self.max[x]) - c).max(c - f64::from(self.min[x]))
        })
    }
}

/// Returns the origin for positions in double precision: zero, or the center of the triangles with
/// an area if they are far from zero.
pub(super) fn origin(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> [f64; 3] {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for t in triangles {
        let Some([a, b, c]) = corners_f64(positions, *t) else {
            return [0.0; 3];
        };
        if cross(a, b, c) == [0.0; 3] {
            continue;
        }
        for p in [a, b, c] {
            min = std::array::from_fn(|x| min[x].min(p[x]));
            max = std::array::from_fn(|x| max[x].max(p[x]));
        }
    }
    let center: [f64; 3] = std::array::from_fn(|x| (min[x] + max[x]) / 2.0);
    let half = (0..3).map(|x| (max[x] - min[x]) / 2.0).fold(0.0, f64::max);
    let is_far = center.iter().any(|c| c.abs() > MAX_OFF_CENTER * half);
    match is_far && center.iter().all(|c| c.is_finite()) {
        true => center,
        false => [0.0; 3],
    }
}

/// Returns the corners of a triangle; `None` if one does not exist.
fn corners_f64(positions: &[[f64; 3]], triangle: [u32; 3]) -> Option<[[f64; 3]; 3]> {
    let [a, b, c] = triangle.map(|v| positions.get(v as usize).copied());
    Some([a?, b?, c?])
}
