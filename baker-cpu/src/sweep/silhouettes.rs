//! Silhouettes: the edges at which the mesh changes from facing a direction to facing away.

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::prepared::{Edge, HalfEdge};
use rayon::prelude::*;

use super::frame::{AxisFrame, LANES};
use super::instructions::{Simd, SimdKernel};
use super::pass::SweepJob;

/// The directions of a texel row that a triangle faces: n·d is linear in the texel's index z and
/// changes its sign once. Bits 0–6: the flip texel, the first z of the second part (never `size`
/// itself: an empty second part is stored as an empty first part with bit 7 inverted). Bit 7: set
/// if the first part faces d and the second faces away.
///
/// It is computed once for each triangle and texel row, so that all edges of a triangle agree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct FacingInterval(u8);

const FRONT_FIRST: u8 = 1 << 7;

impl FacingInterval {
    /// Returns the first texel of the second part.
    #[inline(always)]
    fn flip_texel(self) -> u8 {
        self.0 & !FRONT_FIRST
    }

    /// Returns +1 where n·d > 0, else −1.
    #[cfg(test)]
    fn sign(self, z: u8) -> i8 {
        let front_first = (self.0 & FRONT_FIRST) >> 7;
        let front = u8::from(z >= self.flip_texel()) ^ front_first;
        (2 * front).cast_signed() - 1
    }

    /// Returns the lanes of a block where n·d > 0.
    #[inline(always)]
    pub(super) fn front_lanes(self, block: usize) -> u16 {
        let flip_texel = u32::from(self.flip_texel()).saturating_sub((block * LANES) as u32);
        let second = (0xffff_u32 << flip_texel.min(LANES as u32)) as u16;
        let front_first = self.0 & FRONT_FIRST != 0;
        if front_first { !second } else { second }
    }

    /// Returns the sign times that of the half-edge's direction: what it adds to an edge's sum.
    #[inline(always)]
    pub(super) fn oriented(self, half_edge: HalfEdge) -> Self {
        Self(self.0 ^ u8::from(half_edge.is_reversed()) << 7)
    }
}

/// The facing of a triangle, for each of [`LANES`] texel rows of a face.
pub(super) type TriangleFacing = [FacingInterval; LANES];

/// The facings of triangles and the silhouette edges of one pass.
#[derive(Default)]
pub(super) struct Silhouettes {
    /// The facings of every triangle.
    pub facings: Vec<TriangleFacing>,
    /// The silhouettes of each chunk of the edges.
    pub lists: Vec<RowSilhouettes>,
}

impl Silhouettes {
    /// Finds the silhouettes of `n_rows` texel rows from `first_row` on.
    pub(super) fn find(
        &mut self,
        job: &SweepJob<'_>,
        frame: &AxisFrame,
        first_row: u32,
        n_rows: usize,
    ) {
        compute_facings(job, frame, first_row, &mut self.facings);
        find_silhouettes(job, &self.facings, n_rows, &mut self.lists);
    }
}

/// Computes the facings of every triangle, for [`LANES`] texel rows from `first_row` on.
fn compute_facings(
    job: &SweepJob<'_>,
    frame: &AxisFrame,
    first_row: u32,
    out: &mut Vec<TriangleFacing>,
) {
    let mesh = job.mesh;
    let row_slopes: [f32; LANES] =
        std::array::from_fn(|row| frame.row_slope(first_row + row as u32) as f32);
    out.resize(mesh.triangles().len(), TriangleFacing::default());
    out.par_chunks_mut(ELEMENT_CHUNK)
        .zip(mesh.triangles().par_chunks(ELEMENT_CHUNK))
        .for_each(|(out, triangles)| {
            job.simd_level.run(FacingKernel {
                mesh,
                frame,
                row_slopes: &row_slopes,
                triangles,
                out,
            });
        });
}

/// The number of triangles, or edges, in one unit of a thread's work.
const ELEMENT_CHUNK: usize = 1 << 13;

struct FacingKernel<'a> {
    mesh: &'a PreparedMesh,
    frame: &'a AxisFrame,
    row_slopes: &'a [f32; LANES],
    triangles: &'a [[u32; 3]],
    out: &'a mut [TriangleFacing],
}

impl SimdKernel for FacingKernel<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        for (facings, &triangle) in self.out.iter_mut().zip(self.triangles) {
            *facings = triangle_facing(self.mesh.normal(triangle), self.frame, self.row_slopes);
        }
    }
}

/// The smallest share of n_u in a normal at which its facings depend on u. Below it the threshold
/// is beyond both ends of a texel row, or the triangle is seen edge-on.
const MIN_U_SHARE: f64 = 1e-12;

/// Solves n·d = n_u·a + n_v·b + n_w > 0 for z, with a = shear·(2z + 1 − size)/size: z > T for n_u >
/// 0 and z < T for n_u < 0, where T = (size − 1)/2 − (n_v·b + n_w) · size/(2·shear·n_u).
#[inline(always)]
fn triangle_facing(
    normal: [i64; 3],
    frame: &AxisFrame,
    row_slopes: &[f32; LANES],
) -> TriangleFacing {
    let component = |axis: usize| normal[axis] as f64;
    let [n_u, n_v, n_w] = [component(frame.u), component(frame.v), component(frame.w)];
    let size = f64::from(frame.size);
    let min_n_u = MIN_U_SHARE * (n_v.abs() + n_w.abs());
    // T = constant + per_slope · b, with the slope computed once for all rows.
    let steep = size / (2.0 * frame.shear[0] * n_u.abs().max(min_n_u).max(f64::MIN_POSITIVE));
    let steep = if n_u < 0.0 { -steep } else { steep };
    let constant = ((size - 1.0) / 2.0 - steep * n_w) as f32;
    let per_slope = (-steep * n_v) as f32;
    let first = u8::from(n_u < 0.0);
    let last = frame.size as f32 - 1.0;
    let mut facings = TriangleFacing::default();
    for (facing, slope) in facings.iter_mut().zip(row_slopes) {
        let threshold = constant + per_slope * slope;
        // The number of z ≤ T, 0..=size.
        let flip_texel = floor_to_u32(threshold.max(-1.0).min(last) + 1.0);
        let all = flip_texel == frame.size;
        let flip_texel = if all { 0 } else { flip_texel };
        *facing = FacingInterval(flip_texel as u8 | (first ^ u8::from(all)) << 7);
    }
    facings
}

/// 2²³: added to a float in 0..2²², it leaves the nearest whole number in the lowest bits.
const ROUNDING_BIAS: f32 = (1 << 23) as f32;

/// Returns ⌊x⌋ of a small, non-negative number. A cast would also check the range.
#[inline(always)]
fn floor_to_u32(x: f32) -> u32 {
    let nearest = x + ROUNDING_BIAS;
    let above = nearest - ROUNDING_BIAS > x;
    (nearest.to_bits() - ROUNDING_BIAS.to_bits()) - u32::from(above)
}

/// The edges that are silhouettes for some texel of a texel row.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct SilhouetteList {
    /// Their vertices, copied here because a look-up among all edges would miss the cache.
    pub vertices: Vec<[u32; 2]>,
    /// The oriented facings of each edge's triangles.
    pub facings: Vec<EdgeFacing>,
}

impl SilhouetteList {
    fn clear(&mut self) {
        self.vertices.clear();
        self.facings.clear();
    }
}

/// The oriented facings of an edge's two triangles, in bits 0–7 and 8–15.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct EdgeFacing(u16);

impl EdgeFacing {
    #[inline(always)]
    pub(super) fn new(one: FacingInterval, other: FacingInterval) -> Self {
        Self(u16::from_le_bytes([one.0, other.0]))
    }

    #[inline(always)]
    pub(super) fn intervals(self) -> [FacingInterval; 2] {
        self.0.to_le_bytes().map(FacingInterval)
    }
}

/// The silhouettes of each texel row of a pass.
pub(super) type RowSilhouettes = [SilhouetteList; LANES];

/// Finds the silhouettes of the first `n_rows` texel rows: lists for each chunk of the edges.
fn find_silhouettes(
    job: &SweepJob<'_>,
    facings: &[TriangleFacing],
    n_rows: usize,
    lists: &mut Vec<RowSilhouettes>,
) {
    let edges = job.mesh.edges();
    lists.resize_with(edges.len().div_ceil(ELEMENT_CHUNK), RowSilhouettes::default);
    lists
        .par_iter_mut()
        .zip(edges.par_chunks(ELEMENT_CHUNK))
        .for_each(|(lists, edges)| {
            lists.iter_mut().for_each(SilhouetteList::clear);
            job.simd_level.run(SilhouetteSearch {
                edges,
                facings,
                n_rows,
                lists,
            });
        });
}

/// The search for silhouettes among some edges.
pub(super) struct SilhouetteSearch<'a> {
    pub edges: &'a [Edge],
    pub facings: &'a [TriangleFacing],
    pub n_rows: usize,
    pub lists: &'a mut RowSilhouettes,
}

impl SimdKernel for SilhouetteSearch<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        simd.find_silhouettes(self);
    }
}

impl<'a> SilhouetteSearch<'a> {
    /// Returns the facings of an edge's triangles, and whether each triangle runs along the edge
    /// backwards.
    #[inline(always)]
    pub(super) fn facings_of(&self, edge: &Edge) -> [(&'a TriangleFacing, bool); 2] {
        let [one, other] = edge.sides;
        let facings = self.facings;
        let facing = |side: HalfEdge| (&facings[side.triangle()], side.is_reversed());
        [facing(one), facing(other)]
    }

    /// Searches one edge after the other. The SIMD versions are tested against this one.
    #[inline(always)]
    pub(super) fn run_portable(self) {
        let rows = u16::MAX >> (LANES - self.n_rows);
        for edge in self.edges {
            let facings = self.facings_of(edge);
            let mut rows_left = rows & silhouette_rows(facings);
            while rows_left != 0 {
                let row = rows_left.trailing_zeros() as usize & (LANES - 1);
                rows_left &= rows_left - 1;
                // Rows where the oriented facings differ get the edge in their list.
                let [one, other] = edge.sides;
                let [one, other] = [
                    facings[0].0[row].oriented(one),
                    facings[1].0[row].oriented(other),
                ];
                let list = &mut self.lists[row];
                list.vertices.push(edge.vertices);
                list.facings.push(EdgeFacing::new(one, other));
            }
        }
    }
}

/// Returns the texel rows where the two half-edges do not cancel.
#[inline(always)]
fn silhouette_rows([one, other]: [(&TriangleFacing, bool); 2]) -> u16 {
    let reversed = if one.1 == other.1 { FRONT_FIRST } else { 0 };
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
    fn facing_is_the_sign_of_n_dot_d() {
        for (size, shear) in [(16, [1.0, 1.0]), (8, [0.3, 2.0]), (128, [1.7, 0.9])] {
            let frame = AxisFrame {
                u: 1,
                v: 2,
                w: 0,
                n: [8; 3],
                size,
                shear,
            };
            let rows: [f32; LANES] =
                std::array::from_fn(|b| frame.row_slope(b as u32 % size) as f32);
            let mut bits = crate::random::random_bits(1);
            let mut next = || bits().cast_signed() >> 44;
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
                let facing = triangle_facing(normal, &frame, &rows);
                for (b, facing) in facing.iter().enumerate() {
                    for z in 0..size as u8 {
                        let a = shear[0] * ((2.0 * f64::from(z) + 1.0) / f64::from(size) - 1.0);
                        let n = [frame.u, frame.v, frame.w].map(|x| normal[x] as f64);
                        let n_dot_d = n[0] * a + n[1] * f64::from(rows[b]) + n[2];
                        // Closer to edge-on than single precision can tell.
                        if n_dot_d.abs() > 1e-5 * (n[0].abs() + n[1].abs() + n[2].abs()) {
                            assert_eq!(facing.sign(z), n_dot_d.signum() as i8, "{normal:?} {z}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn facing_interval_stores_flip_texel_and_first_sign() {
        let facing = |flip_texel: u8, first: u8| FacingInterval(flip_texel | first << 7);
        assert_eq!(facing(3, 0).flip_texel(), 3);
        let signs = |f: FacingInterval| [0, 2, 3, 15].map(|z| f.sign(z));
        assert_eq!(signs(facing(3, 0)), [-1, -1, 1, 1]);
        assert_eq!(signs(facing(3, 1)), [1, 1, -1, -1]);
        assert_eq!(signs(facing(0, 0)), [1; 4]);
    }
}
