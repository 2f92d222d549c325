//! The six cube faces around a cell and the directions of their texels.
//!
//! Faces come in the order +X −X +Y −Y +Z −Z with the (s, t) orientation of cube maps in
//! Vulkan, Direct3D and OpenGL. Texel (column, row) has its center at
//! `s = (2·column + 1)/size − 1`, `t = (2·row + 1)/size − 1`, both in −1..1.

/// The number of faces.
pub const FACES: u32 = 6;

/// The major axis, s axis and t axis of each face, each as (coordinate, sign).
const AXES: [[(usize, f64); 3]; FACES as usize] = [
    [(0, 1.0), (2, -1.0), (1, -1.0)],
    [(0, -1.0), (2, 1.0), (1, -1.0)],
    [(1, 1.0), (0, 1.0), (2, 1.0)],
    [(1, -1.0), (0, 1.0), (2, -1.0)],
    [(2, 1.0), (0, 1.0), (1, -1.0)],
    [(2, -1.0), (0, -1.0), (1, -1.0)],
];

/// One texel of the six faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Direction from the cell through the texel's center; the major component is ±1, the vector is
    /// not normalized.
    pub direction: [f64; 3],
    /// The exact solid angle of the texel, divided by 4π: the weights of all texels sum to 1.
    pub weight: f64,
}

/// Returns the texels of six faces of `size` × `size`: face by face, row by row.
pub fn texels(size: u32) -> Vec<Texel> {
    // The difference is exact and divided once, so opposite texels get exactly opposite values.
    let center = |i: u32| (f64::from(2 * i + 1) - f64::from(size)) / f64::from(size);
    let mut texels = Vec::with_capacity((FACES * size * size) as usize);
    for axes in AXES {
        for row in 0..size {
            for column in 0..size {
                let mut direction = [0.0; 3];
                for ((axis, sign), value) in
                    axes.into_iter().zip([1.0, center(column), center(row)])
                {
                    direction[axis] = sign * value;
                }
                let weight = solid_angle(column, row, size) / (4.0 * std::f64::consts::PI);
                texels.push(Texel { direction, weight });
            }
        }
    }
    texels
}

/// Returns the index in [`texels`] of a direction whose major axis is `major`, with the sign
/// `positive`, and whose other two components are those of texel centers `i` and `j`, counted from
/// −1: `i` along the axis that follows `major` cyclically, `j` along the one after.
pub fn texel_idx(size: u32, major: usize, positive: bool, [i, j]: [u32; 2]) -> usize {
    let face = 2 * major + usize::from(!positive);
    let [_, s, t] = AXES[face];
    let number = |(axis, sign): (usize, f64)| {
        let number = if axis == (major + 1) % 3 { i } else { j };
        if sign > 0.0 {
            number
        } else {
            size - 1 - number
        }
    };
    ((face as u32 * size + number(t)) * size + number(s)) as usize
}

/// Returns the solid angle of a texel, in steradians. The corner term `atan2(st, √(s² + t² + 1))`
/// is the solid angle of the rectangle from the face's center to (s, t).
fn solid_angle(column: u32, row: u32, size: u32) -> f64 {
    let edge = |i: u32| (f64::from(2 * i) - f64::from(size)) / f64::from(size);
    let corner = |s: f64, t: f64| (s * t).atan2((s * s + t * t + 1.0).sqrt());
    let (s0, s1, t0, t1) = (edge(column), edge(column + 1), edge(row), edge(row + 1));
    corner(s1, t1) - corner(s0, t1) - corner(s1, t0) + corner(s0, t0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a sum of at most 6·128² terms, each at most 1/6.
    const SUM_ROUNDING: f64 = 1e-12;

    #[test]
    fn weights_sum_to_one_and_the_moment_to_zero() {
        for size in [8, 9, 16, 128] {
            let texels = texels(size);
            assert_eq!(texels.len(), 6 * (size * size) as usize);
            let sum: f64 = texels.iter().map(|t| t.weight).sum();
            assert!((sum - 1.0).abs() < SUM_ROUNDING, "{size}: {sum}");
            for axis in 0..3 {
                let m: f64 = texels.iter().map(|t| t.weight * t.direction[axis]).sum();
                assert!(m.abs() < SUM_ROUNDING, "{size}: {m}");
            }
        }
    }

    #[test]
    fn every_face_is_a_sixth_of_the_sphere() {
        for face in texels(16).chunks(256) {
            let sum: f64 = face.iter().map(|t| t.weight).sum();
            assert!((sum - 1.0 / 6.0).abs() < SUM_ROUNDING);
        }
    }

    #[test]
    fn orientation_is_that_of_cube_maps() {
        // First and last texel of each face, from the table in the specification.
        let near = 1.0 - 1.0 / 16.0;
        let expected = [
            ([1.0, near, near], [1.0, -near, -near]),
            ([-1.0, near, -near], [-1.0, -near, near]),
            ([-near, 1.0, -near], [near, 1.0, near]),
            ([-near, -1.0, near], [near, -1.0, -near]),
            ([-near, near, 1.0], [near, -near, 1.0]),
            ([near, near, -1.0], [-near, -near, -1.0]),
        ];
        for (face, (first, last)) in texels(16).chunks(256).zip(expected) {
            assert_eq!(face[0].direction, first);
            assert_eq!(face[255].direction, last);
        }
    }

    #[test]
    fn texel_idx_finds_texels_by_their_directions() {
        let size = 9;
        let texels = texels(size);
        let mut seen = vec![false; texels.len()];
        for (major, positive) in [0, 1, 2].into_iter().flat_map(|m| [(m, true), (m, false)]) {
            for (i, j) in (0..size).flat_map(|i| (0..size).map(move |j| (i, j))) {
                let idx = texel_idx(size, major, positive, [i, j]);
                let mut direction = [0.0; 3];
                direction[major] = if positive { 1.0 } else { -1.0 };
                for (number, next) in [(i, 1), (j, 2)] {
                    let center = f64::from(2 * number + 1) - f64::from(size);
                    direction[(major + next) % 3] = center / f64::from(size);
                }
                assert_eq!(texels[idx].direction, direction);
                assert!(!std::mem::replace(&mut seen[idx], true));
            }
        }
    }

    #[test]
    fn mirrored_directions_are_exact() {
        let texels = texels(9);
        for axis in 0..3 {
            for texel in &texels {
                let mut mirrored = *texel;
                mirrored.direction[axis] = -mirrored.direction[axis];
                let found = texels
                    .iter()
                    .find(|t| t.direction == mirrored.direction)
                    .expect("every direction has its mirror image");
                assert!((found.weight - texel.weight).abs() < 1e-15);
            }
        }
    }
}
