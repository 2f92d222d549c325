//! Silhouettes: the edges at which the mesh turns from facing a direction to facing away.

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::prepared::{Edge, HalfEdge};
use rayon::prelude::*;

use super::frame::{Frame, LANES};
use super::instructions::{Vectors, Work};
use super::pass::Job;

/// How a triangle faces the directions of a face's row: n·d is linear in the texel's number z
/// and changes its sign once. Bits 0–6: the first z of the second part (never the side's
/// length itself: "none" is "all, the other way round"); bit 7: set if the first part faces
/// d, and the second away.
///
/// It is found once for each triangle and row, so that all edges of a triangle agree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Facing(u8);

const TOWARDS_FIRST: u8 = 1 << 7;

impl Facing {
    /// The first texel of the second part.
    #[inline(always)]
    fn turn(self) -> u8 {
        self.0 & !TOWARDS_FIRST
    }

    /// +1 where n·d > 0, else −1.
    #[cfg(test)]
    fn sign(self, z: u8) -> i8 {
        let first_towards = (self.0 & TOWARDS_FIRST) >> 7;
        let towards = u8::from(z >= self.turn()) ^ first_towards;
        (2 * towards).cast_signed() - 1
    }

    /// The lanes of a block where n·d > 0.
    #[inline(always)]
    pub(super) fn towards(self, block: usize) -> u16 {
        let turn = u32::from(self.turn()).saturating_sub((block * LANES) as u32);
        let second = (0xffff_u32 << turn.min(LANES as u32)) as u16;
        let first_towards = self.0 & TOWARDS_FIRST != 0;
        if first_towards { !second } else { second }
    }

    /// The sign times that of the half-edge's direction: what it adds to an edge's sum.
    #[inline(always)]
    pub(super) fn along(self, half_edge: HalfEdge) -> Self {
        Self(self.0 ^ u8::from(half_edge.is_reversed()) << 7)
    }
}

/// Facings of a row of texels for each of [`LANES`] rows of a face.
pub(super) type Facings = [Facing; LANES];

/// What a pass has to know of triangles and edges.
#[derive(Default)]
pub(super) struct Silhouettes {
    /// Of every triangle.
    pub facings: Vec<Facings>,
    /// Of each piece of the edges.
    pub lists: Vec<Lists>,
}

impl Silhouettes {
    /// For `n_rows` of a face from the first on.
    pub(super) fn find(&mut self, job: &Job<'_>, frame: &Frame, first_row: u32, n_rows: usize) {
        facings(job, frame, first_row, &mut self.facings);
        find(job, &self.facings, n_rows, &mut self.lists);
    }
}

/// Facings of every triangle, for [`LANES`] rows of a face from `first_row` on.
fn facings(job: &Job<'_>, frame: &Frame, first_row: u32, out: &mut Vec<Facings>) {
    let mesh = job.mesh;
    let row_slopes: [f32; LANES] =
        std::array::from_fn(|row| frame.row_slope(first_row + row as u32) as f32);
    out.resize(mesh.triangles().len(), Facings::default());
    out.par_chunks_mut(AT_ONCE)
        .zip(mesh.triangles().par_chunks(AT_ONCE))
        .for_each(|(out, triangles)| {
            job.instructions.run(FacingsOf {
                mesh,
                frame,
                row_slopes: &row_slopes,
                triangles,
                out,
            });
        });
}

/// Triangles, or edges, that a thread looks at in one piece.
const AT_ONCE: usize = 1 << 13;

struct FacingsOf<'a> {
    mesh: &'a PreparedMesh,
    frame: &'a Frame,
    row_slopes: &'a [f32; LANES],
    triangles: &'a [[u32; 3]],
    out: &'a mut [Facings],
}

impl Work for FacingsOf<'_> {
    #[inline(always)]
    fn run<V: Vectors>(self, _: V) {
        for (facings, &triangle) in self.out.iter_mut().zip(self.triangles) {
            *facings = facing(self.mesh.normal(triangle), self.frame, self.row_slopes);
        }
    }
}

/// The least share of a normal along u that its facings depend on u: below it the threshold is
/// beyond both ends of a row of texels, or the triangle is seen edge-on.
const LEAST: f64 = 1e-12;

/// n·d = n_u·a + n_v·b + n_w > 0, with a = shear·(2z + 1 − size)/size, is z > T for n_u > 0 and
/// z < T for n_u < 0, where T = (size − 1)/2 − (n_v·b + n_w) · size/(2·shear·n_u).
#[inline(always)]
fn facing(normal: [i64; 3], frame: &Frame, row_slopes: &[f32; LANES]) -> Facings {
    let along = |axis: usize| normal[axis] as f64;
    let [n_u, n_v, n_w] = [along(frame.u), along(frame.v), along(frame.w)];
    let size = f64::from(frame.size);
    let least = LEAST * (n_v.abs() + n_w.abs());
    let steep = size / (2.0 * frame.shear[0] * n_u.abs().max(least).max(f64::MIN_POSITIVE));
    let steep = if n_u < 0.0 { -steep } else { steep };
    let constant = ((size - 1.0) / 2.0 - steep * n_w) as f32;
    let per_slope = (-steep * n_v) as f32;
    let first = u8::from(n_u < 0.0);
    let last = frame.size as f32 - 1.0;
    let mut facings = Facings::default();
    for (facing, slope) in facings.iter_mut().zip(row_slopes) {
        let threshold = constant + per_slope * slope;
        // The number of z ≤ T, 0..=size.
        let turn = whole_part(threshold.max(-1.0).min(last) + 1.0);
        let all = turn == frame.size;
        let turn = if all { 0 } else { turn };
        *facing = Facing(turn as u8 | (first ^ u8::from(all)) << 7);
    }
    facings
}

/// 2²³: adding it to a float in 0..2²² leaves the nearest whole number in the lowest bits.
const WHOLE: f32 = (1 << 23) as f32;

/// Of a small number that is not negative. A cast would look for those that do not fit.
#[inline(always)]
fn whole_part(x: f32) -> u32 {
    let nearest = x + WHOLE;
    let above = nearest - WHOLE > x;
    (nearest.to_bits() - WHOLE.to_bits()) - u32::from(above)
}

/// The edges that are silhouettes for some texel of a face's row.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct List {
    /// Their vertices: here, and not looked up again among all edges, for which one would have
    /// to wait.
    pub vertices: Vec<[u32; 2]>,
    /// The facings of each one's triangles along it.
    pub sides: Vec<Sides>,
}

impl List {
    fn clear(&mut self) {
        self.vertices.clear();
        self.sides.clear();
    }
}

/// The facings of an edge's two triangles along it, in bits 0–7 and 8–15.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Sides(u16);

impl Sides {
    #[inline(always)]
    pub(super) fn new(one: Facing, other: Facing) -> Self {
        Self(u16::from_le_bytes([one.0, other.0]))
    }

    #[inline(always)]
    pub(super) fn facings(self) -> [Facing; 2] {
        self.0.to_le_bytes().map(Facing)
    }
}

/// The silhouettes of each row of a face.
pub(super) type Lists = [List; LANES];

/// Finds silhouettes for the first `n_rows` rows: lists for each piece of the edges.
fn find(job: &Job<'_>, facings: &[Facings], n_rows: usize, lists: &mut Vec<Lists>) {
    let edges = job.mesh.edges();
    lists.resize_with(edges.len().div_ceil(AT_ONCE), Lists::default);
    lists
        .par_iter_mut()
        .zip(edges.par_chunks(AT_ONCE))
        .for_each(|(lists, edges)| {
            lists.iter_mut().for_each(List::clear);
            job.instructions.run(Find {
                edges,
                facings,
                n_rows,
                lists,
            });
        });
}

/// Some edges, of which the silhouettes of some rows are sought.
pub(super) struct Find<'a> {
    pub edges: &'a [Edge],
    pub facings: &'a [Facings],
    pub n_rows: usize,
    pub lists: &'a mut Lists,
}

impl Work for Find<'_> {
    #[inline(always)]
    fn run<V: Vectors>(self, vectors: V) {
        vectors.find(self);
    }
}

impl<'a> Find<'a> {
    /// The facings of an edge's triangles, and whether they run along it backwards.
    #[inline(always)]
    pub(super) fn sides(&self, edge: &Edge) -> [(&'a Facings, bool); 2] {
        let [one, other] = edge.sides;
        let facings = self.facings;
        let side = |side: HalfEdge| (&facings[side.triangle()], side.is_reversed());
        [side(one), side(other)]
    }

    /// One edge after the other. This is what faster ways have to agree with.
    #[inline(always)]
    pub(super) fn run_portable(self) {
        let rows = u16::MAX >> (LANES - self.n_rows);
        for edge in self.edges {
            let sides = self.sides(edge);
            let mut odd = rows & silhouette_rows(sides);
            while odd != 0 {
                let row = odd.trailing_zeros() as usize & (LANES - 1);
                odd &= odd - 1;
                let [one, other] = edge.sides;
                let [one, other] = [sides[0].0[row].along(one), sides[1].0[row].along(other)];
                let list = &mut self.lists[row];
                list.vertices.push(edge.vertices);
                list.sides.push(Sides::new(one, other));
            }
        }
    }
}

/// The rows where two half-edges are not one the other, reversed: there they add nothing.
#[inline(always)]
fn silhouette_rows([one, other]: [(&Facings, bool); 2]) -> u16 {
    let reversed = if one.1 == other.1 { TOWARDS_FIRST } else { 0 };
    let mut rows = 0;
    for row in 0..LANES {
        let differ = one.0[row].0 ^ other.0[row].0 != reversed;
        rows |= u16::from(differ) << row;
    }
    rows
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
            let rows: [f32; LANES] =
                std::array::from_fn(|b| frame.row_slope(b as u32 % size) as f32);
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
