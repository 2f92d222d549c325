//! The occluder's triangle mesh, validated once.

mod file;
mod obj;
mod obj_lines;
mod polygon;
mod report;
mod weld;

pub use file::{LoadError, LoadedMesh, MeshFile, load};
pub use obj::{ObjError, read_obj};
pub use report::MeshReport;
pub(crate) use weld::first_duplicate;

use std::ops::Range;

/// A mesh of one or more triangles in object space, divided into parts. Every index is valid, and
/// every corner of a triangle is finite. Winding does not matter for occlusion: a triangle occludes
/// from both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<Part>,
    bounds: Bounds,
}

/// A named range of triangles: an object or group of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The name in the file; not necessarily unique or usable as a file's name.
    pub name: String,
    /// The range of the part's triangles.
    pub triangles: Range<usize>,
}

/// An axis-aligned box around the triangles, in object units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: [f32; 3],
    /// Largest coordinates.
    pub max: [f32; 3],
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
    /// The parts do not cover all triangles in order.
    #[error("part {0} does not begin where the part before it ends")]
    Parts(usize),
}

impl TriangleMesh {
    /// Creates a mesh from validated triangles. `parts` must cover them in order, without gaps.
    ///
    /// # Errors
    ///
    /// There are no triangles, an index is out of range, a used vertex is not finite, or the parts
    /// have gaps.
    pub fn new(
        positions: Vec<[f32; 3]>,
        triangles: Vec<[u32; 3]>,
        parts: Vec<Part>,
    ) -> Result<Self, MeshError> {
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        let mut bounds = Bounds::EMPTY;
        for (triangle, &corners) in triangles.iter().enumerate() {
            for vertex in corners {
                let count = positions.len();
                let Some(&position) = positions.get(vertex as usize) else {
                    return Err(MeshError::Index {
                        triangle,
                        vertex,
                        count,
                    });
                };
                if !position.iter().all(|v| v.is_finite()) {
                    return Err(MeshError::NotFinite(vertex));
                }
                bounds.add(position);
            }
        }
        let mut end = 0;
        for (idx, part) in parts.iter().enumerate() {
            if part.triangles.start != end || part.triangles.end < end {
                return Err(MeshError::Parts(idx));
            }
            end = part.triangles.end;
        }
        if end != triangles.len() {
            return Err(MeshError::Parts(parts.len()));
        }
        Ok(Self {
            positions,
            triangles,
            parts,
            bounds,
        })
    }

    /// Returns the vertices, in object units. Some may be unused.
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

    /// Returns the bounding box of all triangles.
    pub fn bounds(&self) -> Bounds {
        self.bounds
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
    /// The part has no triangles.
    ///
    /// # Panics
    ///
    /// If there is no part `idx`.
    pub fn part(&self, idx: usize) -> Result<Self, MeshError> {
        let part = &self.parts[idx];
        let triangles = &self.triangles[part.triangles.clone()];
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let renumber = |vertex: u32| used.partition_point(|&v| v < vertex) as u32;
        let whole = Part {
            name: part.name.clone(),
            triangles: 0..triangles.len(),
        };
        Self::new(
            used.iter().map(|&v| self.positions[v as usize]).collect(),
            triangles.iter().map(|t| t.map(renumber)).collect(),
            vec![whole],
        )
    }
}

impl Bounds {
    const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    fn add(&mut self, position: [f32; 3]) {
        for (axis, v) in position.into_iter().enumerate() {
            self.min[axis] = self.min[axis].min(v);
            self.max[axis] = self.max[axis].max(v);
        }
    }

    /// Returns the center of the box.
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
