//! The occluder's triangle mesh, validated once.

mod area;
mod bounds;
mod load;
mod report;
mod weld;

pub use bounds::Bounds;
pub(crate) use load::local_pose;
pub use load::{
    AnimationTime, GltfError, LoadError, LoadedMesh, MeshFile, ObjError, OwnAttributes, PartMesh,
    PlyError, Pose, PosedPrimitive, Resolver, StlError, load, read_obj,
};
pub use report::MeshReport;
pub(crate) use weld::first_duplicate;

use std::ops::Range;

use area::has_area;
use bounds::origin;

/// A mesh of one or more triangles in object space, divided into parts. Every index is valid, every
/// corner of a triangle is finite, and at least one triangle has an area. Winding does not matter for
/// occlusion: a triangle occludes from both sides.
///
/// Positions are relative to an [origin](TriangleMesh::origin), which is zero unless the mesh is far
/// from its coordinates' own: single floats there would be too coarse for it.
///
/// Triangles without area occlude nothing. Those that reach beyond all others are left out, so that
/// they do not shape the box; they are [counted](TriangleMesh::left_out).
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<Part>,
    bounds: Bounds,
    left_out: usize,
}

/// A named range of triangles: an object or group of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The name in the file, made unique within the mesh by the readers of files; not necessarily
    /// usable as a file's name.
    pub name: String,
    /// The range of the part's triangles.
    pub triangles: Range<usize>,
}

/// The reason that triangles are not a valid mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// There are no triangles to bake.
    #[error("it has no triangles: no face has three or more corners")]
    Empty,
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to vertex {vertex}, but there are only {count} vertices")]
    Index {
        /// The triangle's index.
        triangle: usize,
        /// The invalid vertex index.
        vertex: u32,
        /// The number of vertices.
        count: usize,
    },
    /// A vertex of a triangle is infinite or NaN.
    #[error("vertex {0} of the mesh is not finite")]
    NotFinite(u32),
    /// No triangle has an area.
    #[error("it has no area: all its triangles are points or lines")]
    NoArea,
    /// The parts do not cover all triangles in order.
    #[error("part {0} does not begin where the part before it ends")]
    Parts(usize),
}

impl TriangleMesh {
    /// Creates a mesh from validated triangles. `parts` must cover them in order, without gaps.
    ///
    /// # Errors
    ///
    /// There are no triangles or none with an area, an index is out of range, a used vertex is not
    /// finite, or the parts have gaps.
    pub fn new(
        mut positions: Vec<[f32; 3]>,
        triangles: Vec<[u32; 3]>,
        parts: Vec<Part>,
    ) -> Result<Self, MeshError> {
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        check_vertices(&positions, &triangles)?;
        // Unused vertices may be anything in a file, but nothing that reads positions expects that.
        for unused in positions
            .iter_mut()
            .filter(|p| p.iter().any(|v| !v.is_finite()))
        {
            *unused = [0.0; 3];
        }
        check_parts(&parts, triangles.len())?;
        let bounds = Bounds::of_triangles(&positions, &triangles).ok_or(MeshError::NoArea)?;
        let mut mesh = Self {
            positions,
            triangles,
            parts,
            bounds,
            left_out: 0,
        };
        mesh.leave_out_flat_outliers();
        Ok(mesh)
    }

    /// Creates a mesh like [`TriangleMesh::new`] from positions in double precision, relative to
    /// the mesh's center where single precision would be too coarse for it.
    ///
    /// # Errors
    ///
    /// Those of [`TriangleMesh::new`]; a coordinate beyond the range of single floats is not finite.
    pub fn from_f64(
        positions: &[[f64; 3]],
        triangles: Vec<[u32; 3]>,
        parts: Vec<Part>,
    ) -> Result<Self, MeshError> {
        let origin = origin(positions, &triangles);
        let relative = positions.iter();
        let relative = relative.map(|p| std::array::from_fn(|x| (p[x] - origin[x]) as f32));
        let mut mesh = Self::new(relative.collect(), triangles, parts)?;
        mesh.bounds.origin = origin;
        Ok(mesh)
    }

    /// Removes the triangles without area that reach beyond those with one.
    fn leave_out_flat_outliers(&mut self) {
        let Self {
            positions, bounds, ..
        } = self;
        let counts = |t: &[u32; 3]| {
            let corners = t.map(|v| positions[v as usize]);
            corners.iter().all(|p| bounds.contains(*p)) || has_area(corners)
        };
        if self.triangles.iter().all(counts) {
            return;
        }
        let (mut kept, mut end) = (Vec::with_capacity(self.triangles.len()), 0);
        for part in &mut self.parts {
            kept.extend(
                self.triangles[part.triangles.clone()]
                    .iter()
                    .filter(|t| counts(t)),
            );
            part.triangles = end..kept.len();
            end = kept.len();
        }
        self.left_out = self.triangles.len() - kept.len();
        self.triangles = kept;
    }

    /// Returns the vertices, in object units and relative to the [origin](TriangleMesh::origin). All
    /// are finite; some may be unused.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// Returns three indices into [`TriangleMesh::positions`] for each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the parts, in the order of their triangles.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Returns the bounding box of all triangles, relative to the [origin](TriangleMesh::origin).
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Returns the point in object space that positions and bounds are relative to. It is zero unless
    /// the mesh is more than sixteen times its own half-extent away from zero.
    pub fn origin(&self) -> [f64; 3] {
        self.bounds.origin
    }

    /// Returns the number of triangles that were left out: those without area beyond all others.
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Returns the corners of every triangle.
    pub fn corners(&self) -> impl ExactSizeIterator<Item = [[f32; 3]; 3]> + '_ {
        let corner = |vertex: u32| self.positions[vertex as usize];
        self.triangles.iter().map(move |t| t.map(corner))
    }

    /// Returns a part as a mesh of its own.
    ///
    /// # Errors
    ///
    /// No triangle of the part has an area.
    ///
    /// # Panics
    ///
    /// If there is no part `idx`.
    pub fn part(&self, idx: usize) -> Result<Self, MeshError> {
        self.selected(|candidate| candidate == idx)
    }

    /// Returns the mesh without the parts of these names.
    ///
    /// # Errors
    ///
    /// No triangle of the others has an area.
    pub fn without(&self, names: &[String]) -> Result<Self, MeshError> {
        self.selected(|idx| !names.contains(&self.parts[idx].name))
    }

    /// Returns the parts whose indices are chosen.
    fn selected(&self, is_chosen: impl Fn(usize) -> bool) -> Result<Self, MeshError> {
        let mut triangles = Vec::new();
        let mut parts = Vec::new();
        for (_, part) in self
            .parts
            .iter()
            .enumerate()
            .filter(|(idx, _)| is_chosen(*idx))
        {
            let start = triangles.len();
            triangles.extend_from_slice(&self.triangles[part.triangles.clone()]);
            parts.push(Part {
                name: part.name.clone(),
                triangles: start..triangles.len(),
            });
        }
        if triangles.is_empty() {
            // All that it had was left out.
            return Err(MeshError::NoArea);
        }
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let renumber = |vertex: u32| used.partition_point(|&v| v < vertex) as u32;
        let mut mesh = Self::new(
            used.iter().map(|&v| self.positions[v as usize]).collect(),
            triangles.iter().map(|t| t.map(renumber)).collect(),
            parts,
        )?;
        mesh.bounds.origin = self.origin();
        Ok(mesh)
    }
}

fn check_vertices(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    let count = positions.len();
    for (triangle, &corners) in triangles.iter().enumerate() {
        for vertex in corners {
            match positions.get(vertex as usize) {
                Some(position) if position.iter().all(|v| v.is_finite()) => {}
                Some(_) => return Err(MeshError::NotFinite(vertex)),
                None => {
                    return Err(MeshError::Index {
                        triangle,
                        vertex,
                        count,
                    });
                }
            }
        }
    }
    Ok(())
}

fn check_parts(parts: &[Part], n_triangles: usize) -> Result<(), MeshError> {
    let mut end = 0;
    for (idx, part) in parts.iter().enumerate() {
        if part.triangles.start != end || part.triangles.end < end {
            return Err(MeshError::Parts(idx));
        }
        end = part.triangles.end;
    }
    match end == n_triangles {
        true => Ok(()),
        false => Err(MeshError::Parts(parts.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(name: &str, triangles: Range<usize>) -> Part {
        Part {
            name: name.into(),
            triangles,
        }
    }

    #[test]
    fn invalid_meshes_are_refused() {
        let corner = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let new = |positions: &[[f32; 3]], triangles: &[[u32; 3]], parts| {
            TriangleMesh::new(positions.to_vec(), triangles.to_vec(), parts).unwrap_err()
        };
        assert_eq!(new(&corner, &[], vec![]), MeshError::Empty);
        let index = new(&corner, &[[0, 1, 3]], vec![part("a", 0..1)]);
        assert!(matches!(index, MeshError::Index { vertex: 3, .. }));
        let nan = [[0.0; 3], [f32::NAN; 3], [0.0; 3]];
        let nan = new(&nan, &[[0, 1, 2]], vec![part("a", 0..1)]);
        assert_eq!(nan, MeshError::NotFinite(1));
        let gap = new(
            &corner,
            &[[0, 1, 2]; 3],
            vec![part("a", 0..1), part("b", 2..3)],
        );
        assert_eq!(gap, MeshError::Parts(1));
        let short = new(&corner, &[[0, 1, 2]; 3], vec![part("a", 0..1)]);
        assert_eq!(short, MeshError::Parts(1));
    }

    #[test]
    fn bounds_ignore_unused_vertices() {
        let positions = vec![[1.0; 3], [2.0, 1.0, 1.0], [1.0, 3.0, 1.0], [99.0; 3]];
        let parts = vec![part("a", 0..1)];
        let mesh = TriangleMesh::new(positions, vec![[0, 1, 2]], parts).unwrap();
        assert_eq!(mesh.bounds().max, [2.0, 3.0, 1.0]);
        assert_eq!(mesh.bounds().center(), [1.5, 2.0, 1.0]);
        assert_eq!(mesh.bounds().half_extents(), [0.5, 1.0, 0.0]);
    }

    /// Report 29: the lectern and one triangle without area, far away.
    #[test]
    fn what_has_no_area_does_not_shape_the_box() {
        let positions = vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 1.0],
            [400.0, 0.0, 0.0],
        ];
        let triangles = vec![[0, 1, 2], [3, 3, 3], [0, 3, 1], [0, 1, 1]];
        let parts = vec![part("a", 0..1), part("b", 1..2), part("c", 2..4)];
        let mesh = TriangleMesh::new(positions, triangles, parts).unwrap();
        assert_eq!(mesh.bounds().max, [1.0; 3]);
        assert_eq!((mesh.triangles().len(), mesh.left_out()), (2, 2));
        let kept = [part("a", 0..1), part("b", 1..1), part("c", 1..2)];
        assert_eq!(mesh.parts(), kept);
        assert_eq!(mesh.part(1).unwrap_err(), MeshError::NoArea);
        assert_eq!(mesh.part(2).unwrap_err(), MeshError::NoArea);
        assert!(mesh.part(0).is_ok());
    }

    /// Report 02: a model of one meter at map coordinates.
    #[test]
    fn a_mesh_far_from_zero_keeps_its_shape() {
        let far = [500_000.0, 4_500_000.0, 0.0];
        let corners = [[0.0; 3], [0.25, 0.0, 0.0], [0.0, 0.125, 0.5], [9e9; 3]];
        let at = |offset: [f64; 3]| {
            let moved = corners.map(|p| std::array::from_fn(|x| p[x] + offset[x]));
            let whole = vec![part("a", 0..1)];
            TriangleMesh::from_f64(&moved, vec![[0, 1, 2]], whole).unwrap()
        };
        let (near, far_mesh) = (at([0.0; 3]), at(far));
        assert_eq!(near.origin(), [0.0; 3]);
        assert_eq!(
            far_mesh.bounds().half_extents(),
            near.bounds().half_extents()
        );
        for (a, b) in near.corners().flatten().zip(far_mesh.corners().flatten()) {
            for x in 0..3 {
                let moved = f64::from(a[x]) + far[x];
                assert_eq!(f64::from(b[x]) + far_mesh.origin()[x], moved);
            }
        }
        assert_eq!(far_mesh.part(0).unwrap(), far_mesh.without_unused());
    }

    impl TriangleMesh {
        fn without_unused(mut self) -> Self {
            self.positions.truncate(3);
            self
        }
    }

    #[test]
    fn a_part_keeps_only_its_own_vertices() {
        let positions = (0..6).map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
        let parts = vec![part("a", 0..1), part("b", 1..2)];
        let mesh = TriangleMesh::new(positions, vec![[0, 1, 2], [5, 3, 1]], parts).unwrap();
        let b = mesh.part(1).unwrap();
        assert_eq!(b.positions().len(), 3);
        assert_eq!(b.corners().next(), mesh.corners().nth(1));
        assert_eq!(b.parts(), [part("b", 0..1)]);
    }
}
