//! Silhouettes: the edges at which the mesh changes from facing a direction to facing away.

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::sweep::{AxisFrame, LANES};
use rayon::prelude::*;

use super::data::{
    FacingInterval, RowSilhouettes, SilhouetteList, SilhouetteSearch, TriangleFacing,
};
use super::simd::{Simd, SimdKernel, SimdLevel};

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
        (mesh, simd_level): (&PreparedMesh, SimdLevel),
        frame: &AxisFrame,
        first_row: u32,
        n_rows: usize,
    ) {
        let Self { facings, lists } = self;
        compute_facings(mesh, simd_level, frame, first_row, facings);
        find_silhouettes(mesh, simd_level, (facings, n_rows), lists);
    }
}

/// Computes the facings of every triangle, for [`LANES`] texel rows from `first_row` on.
fn compute_facings(
    mesh: &PreparedMesh,
    simd_level: SimdLevel,
    frame: &AxisFrame,
    first_row: u32,
    out: &mut Vec<TriangleFacing>,
) {
    let row_slopes: [f32; LANES] =
        std::array::from_fn(|row| frame.row_slope(first_row + row as u32) as f32);
    out.resize(mesh.triangles().len(), TriangleFacing::default());
    out.par_chunks_mut(ELEMENT_CHUNK)
        .zip(mesh.triangles().par_chunks(ELEMENT_CHUNK))
        .for_each(|(out, triangles)| {
            simd_level.run(FacingKernel {
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
    let [n_u, n_v, n_w] = frame.axes.map(component);
    let size = f64::from(frame.size);
    let min_n_u = MIN_U_SHARE * (n_v.abs() + n_w.abs());
    // T = constant + per_slope · b, with the slope computed once for all rows.
    let steep = size / (2.0 * frame.shear[0] * n_u.abs().max(min_n_u).max(f64::MIN_POSITIVE));
    let steep = if n_u < 0.0 { -steep } else { steep };
    let constant = ((size - 1.0) / 2.0 - steep * n_w) as f32;
    let per_slope = (-steep * n_v) as f32;
    let first = n_u < 0.0;
    let last = frame.size as f32 - 1.0;
    let mut facings = TriangleFacing::default();
    for (facing, slope) in facings.iter_mut().zip(row_slopes) {
        let threshold = constant + per_slope * slope;
        // The number of z ≤ T, 0..=size.
        let flip_texel = floor_to_u32(threshold.max(-1.0).min(last) + 1.0);
        let all = flip_texel == frame.size;
        let flip_texel = if all { 0 } else { flip_texel };
        *facing = FacingInterval::new(flip_texel as u8, first != all);
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
    // Nothing wraps, but checks of that would keep the loop from being vectorized.
    let nearest = nearest.to_bits().wrapping_sub(ROUNDING_BIAS.to_bits());
    nearest.wrapping_sub(u32::from(above))
}

/// Finds the silhouettes of the first `n_rows` texel rows: lists for each chunk of the edges.
fn find_silhouettes(
    mesh: &PreparedMesh,
    simd_level: SimdLevel,
    (facings, n_rows): (&[TriangleFacing], usize),
    lists: &mut Vec<RowSilhouettes>,
) {
    let edges = mesh.edges();
    lists.resize_with(edges.len().div_ceil(ELEMENT_CHUNK), RowSilhouettes::default);
    lists
        .par_iter_mut()
        .zip(edges.par_chunks(ELEMENT_CHUNK))
        .for_each(|(lists, edges)| {
            lists.iter_mut().for_each(SilhouetteList::clear);
            simd_level.run(SilhouetteSearch {
                edges,
                facings,
                n_rows,
                lists,
            });
        });
}

impl SimdKernel for SilhouetteSearch<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        simd.find_silhouettes(self);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facing_is_the_sign_of_n_dot_d() {
        for (size, shear) in [(16, [1.0, 1.0]), (8, [0.3, 2.0]), (128, [1.7, 0.9])] {
            let frame = AxisFrame {
                axes: [1, 2, 0],
                first: [0; 3],
                cells: [8; 3],
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
                        let n = frame.axes.map(|x| normal[x] as f64);
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
}
