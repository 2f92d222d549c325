//! Silhouettes: the edges at which the mesh turns from facing a direction to facing away.

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::prepared::{Edge, HalfEdge};
use rayon::prelude::*;

use super::frame::{Frame, LANES};

/// How a triangle faces the directions of a face's row: n·d is linear in the texel's number z
/// and changes its sign once. Bits 0–6: the first z of the second part (never the side's
/// length itself: "none" is "all, the other way round"); bit 7: set if the first part faces
/// d, and the second away.
///
/// It is found once for each triangle and row, so that all edges of a triangle agree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Facing(u8);

const TOWARDS_FIRST: u8 = 1 << 7;

impl Facing {
    /// The first texel of the second part.
    #[inline(always)]
    fn turn(self) -> u8 {
        self.0 & !TOWARDS_FIRST
    }

    /// +1 where n·d > 0, else −1.
    #[inline(always)]
    pub(super) fn sign(self, z: u8) -> i8 {
        let first_towards = (self.0 & TOWARDS_FIRST) >> 7;
        let towards = u8::from(z >= self.turn()) ^ first_towards;
        (2 * towards).cast_signed() - 1
    }

    /// The triangle wound the other way.
    #[inline(always)]
    pub(super) fn reversed(self) -> Self {
        Self(self.0 ^ TOWARDS_FIRST)
    }

    /// The sign times that of the half-edge's direction: what it adds to an edge's sum.
    #[inline(always)]
    pub(super) fn along(self, half_edge: HalfEdge) -> Self {
        Self(self.0 ^ u8::from(half_edge.is_reversed()) << 7)
    }
}

/// Facings of every triangle, for [`LANES`] rows of a face from `first_row` on.
pub(super) fn facings(
    mesh: &PreparedMesh,
    frame: &Frame,
    first_row: u32,
    out: &mut Vec<[Facing; LANES]>,
) {
    let row_slopes: [f32; LANES] =
        std::array::from_fn(|row| frame.row_slope(first_row + row as u32));
    out.clear();
    mesh.triangles()
        .par_iter()
        .with_min_len(1024)
        .map(|&triangle| facing(mesh.normal(triangle), frame, &row_slopes))
        .collect_into_vec(out);
}

/// The least share of a normal along u that its facings depend on u: below it the threshold is
/// beyond both ends of a row of texels, or the triangle is seen edge-on.
const LEAST: f64 = 1e-12;

/// n·d = n_u·a + n_v·b + n_w > 0, with a = shear·(2z + 1 − size)/size, is z > T for n_u > 0 and
/// z < T for n_u < 0, where T = (size − 1)/2 − (n_v·b + n_w) · size/(2·shear·n_u).
fn facing(normal: [i64; 3], frame: &Frame, row_slopes: &[f32; LANES]) -> [Facing; LANES] {
    let [n_u, n_v, n_w] = [frame.u, frame.v, frame.w].map(|axis| normal[axis] as f64);
    let size = f64::from(frame.size);
    let least = LEAST * (n_v.abs() + n_w.abs());
    let steep = size / (2.0 * frame.shear[0] * n_u.abs().max(least).max(f64::MIN_POSITIVE));
    let steep = if n_u < 0.0 { -steep } else { steep };
    let constant = ((size - 1.0) / 2.0 - steep * n_w) as f32;
    let per_slope = (-steep * n_v) as f32;
    let first = u8::from(n_u < 0.0);
    let last = frame.size as f32 - 1.0;
    let size = frame.size as u8;
    row_slopes.map(|slope| {
        let threshold = constant + per_slope * slope;
        // The number of z ≤ T, 0..=size.
        let low = threshold.clamp(-1.0, last) + 1.0;
        let turn = low as u8;
        match turn == size {
            true => Facing((first ^ 1) << 7),
            false => Facing(turn | first << 7),
        }
    })
}

/// An edge that is a silhouette for some texel of a face's row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Silhouette {
    /// The edge's number.
    pub edge: u32,
    /// Its triangles' facings along it: here, and not looked up again among all triangles.
    pub sides: [Facing; 2],
}

/// The silhouettes of each row of a face.
pub(super) type Lists = [Vec<Silhouette>; LANES];

/// Finds silhouettes for the first `n_rows` rows among `edges`, whose first has the number
/// `first`.
pub(super) fn find(
    edges: &[Edge],
    first: u32,
    facings: &[[Facing; LANES]],
    n_rows: usize,
    lists: &mut Lists,
) {
    let rows = u128::MAX >> (8 * (LANES - n_rows));
    for (edge_idx, edge) in (first..).zip(edges) {
        let [one, other] = edge.sides.map(|side| {
            let bytes = facings[side.triangle()].map(|f| f.along(side).0);
            u128::from_le_bytes(bytes)
        });
        // Two half-edges add nothing where one is the other, reversed.
        let mut odd = (one ^ other ^ u128::from_le_bytes([TOWARDS_FIRST; LANES])) & rows;
        while odd != 0 {
            let row = odd.trailing_zeros() / 8;
            let facing = |all: u128| Facing((all >> (8 * row)) as u8);
            lists[row as usize].push(Silhouette {
                edge: edge_idx,
                sides: [facing(one), facing(other)],
            });
            odd &= !(0xff << (8 * row));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facings_are_the_sign_of_the_normal_along_the_direction() {
        for (size, shear) in [(16, [1.0, 1.0]), (8, [0.3, 2.0]), (128, [1.7, 0.9])] {
            let frame = Frame {
                u: 1,
                v: 2,
                w: 0,
                n: [8; 3],
                size,
                shear,
            };
            let rows: [f32; LANES] = std::array::from_fn(|b| frame.row_slope(b as u32 % size));
            let mut state = 1_i64;
            let mut next = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                state >> 44
            };
            let axes = [
                [1, 0, 0],
                [0, 1, 0],
                [0, 0, 1],
                [-1, 0, 0],
                [0, -1, 0],
                [0, 0, -1],
            ];
            let normals = (0..500).map(|_| [next(), next(), next()]).chain(axes);
            for normal in normals {
                let facing = facing(normal, &frame, &rows);
                for (b, facing) in facing.iter().enumerate() {
                    for z in 0..size as u8 {
                        let a = shear[0] * ((2.0 * f64::from(z) + 1.0) / f64::from(size) - 1.0);
                        let n = [frame.u, frame.v, frame.w].map(|x| normal[x] as f64);
                        let along = n[0] * a + n[1] * f64::from(rows[b]) + n[2];
                        // Nearer to edge-on than single floats tell apart.
                        if along.abs() > 1e-5 * (n[0].abs() + n[1].abs() + n[2].abs()) {
                            assert_eq!(facing.sign(z), along.signum() as i8, "{normal:?} {z}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_crease_is_a_silhouette_where_one_side_faces_away() {
        let facing = |turn: u8, first: u8| Facing(turn | first << 7);
        assert_eq!(facing(3, 0).turn(), 3);
        let signs = |f: Facing| [0, 2, 3, 15].map(|z| f.sign(z));
        assert_eq!(signs(facing(3, 0)), [-1, -1, 1, 1]);
        assert_eq!(signs(facing(3, 1)), [1, 1, -1, -1]);
        assert_eq!(signs(facing(0, 0)), [1; 4]);
    }
}
