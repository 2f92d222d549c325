//! Coordinates: scaled once, and projected along a direction.

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::surface::{SurfacePoint, dot};

use super::order::z_curve;
use crate::surface::directions::tangents;

/// The mesh and the points, relative to the mesh's center and scaled by a power of two so that all
/// coordinates are within ±1.
pub(super) struct Scaled {
    pub vertices: Vec<[f64; 3]>,
    /// The triangles whose corners are different vertices: others are never hit.
    pub triangles: Vec<[u32; 3]>,
    pub points: Vec<[f64; 3]>,
    pub scale: f64,
}

impl Scaled {
    pub(super) fn new(mesh: &TriangleMesh, points: &[SurfacePoint]) -> Self {
        let center = mesh.bounds().center().map(f64::from);
        let relative = |p: [f64; 3]| [0, 1, 2].map(|x| p[x] - center[x]);
        let different = |t: &&[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let triangles: Vec<_> = mesh.triangles().iter().filter(different).copied().collect();
        // Vertices of no triangle may be anywhere, or not finite.
        let mut vertices = vec![[0.0; 3]; mesh.positions().len()];
        for &vertex in triangles.iter().flatten() {
            let position = mesh.positions()[vertex as usize];
            vertices[vertex as usize] = relative(position.map(f64::from));
        }
        let mut points: Vec<_> = points.iter().map(|p| relative(p.position)).collect();
        let all = vertices.iter().chain(&points).flatten();
        let largest = all.fold(0.0, |max: f64, v| max.max(v.abs()));
        let scale = match largest > 0.0 {
            true => (-largest.log2().ceil()).exp2(),
            false => 1.0,
        };
        let all = vertices.iter_mut().chain(&mut points).flatten();
        all.for_each(|v| *v *= scale);
        Self {
            vertices,
            triangles,
            points,
            scale,
        }
    }

    /// Sorts the triangles by their centers, and the vertices by their first triangles.
    pub(super) fn sort_triangles(&mut self) {
        let center = |[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|v| self.vertices[*v as usize]);
            [0, 1, 2].map(|x| (a[x] + b[x] + c[x]) / 3.0)
        };
        let order = z_curve(self.triangles.iter().map(center));
        let (mut vertices, mut new) = (Vec::new(), vec![u32::MAX; self.vertices.len()]);
        let mut renumber = |vertex: u32| {
            let new = &mut new[vertex as usize];
            if *new == u32::MAX {
                *new = vertices.len() as u32;
                vertices.push(self.vertices[vertex as usize]);
            }
            *new
        };
        let triangles = order.into_iter().map(|idx| self.triangles[idx as usize]);
        self.triangles = triangles.map(|t| t.map(&mut renumber)).collect();
        self.vertices = vertices;
    }
}

/// The axes of a projection: two across the direction, and the direction.
pub(super) struct Frame([[f64; 3]; 3]);

impl Frame {
    pub(super) fn new(direction: [f64; 3]) -> Self {
        let [s, t] = tangents(direction);
        Self([s, t, direction])
    }

    /// Returns the two coordinates across the direction and the depth along it. They are within ±√3,
    /// and wrong by 2⁻²⁴ at most: half a step of single floats from 1 to 2.
    #[inline(always)]
    pub(super) fn project(&self, p: [f64; 3]) -> [f32; 3] {
        let [s, t, d] = &self.0;
        [dot(*s, p) as f32, dot(*t, p) as f32, dot(*d, p) as f32]
    }
}
