//! Values at vertices: means of their faces, or rays of their own.

use super::vector::{normalized, plus};
use super::{FaceCenters, SurfacePoint, SurfaceRecord, VertexGroups};
use crate::TriangleMesh;

/// The weights of a vertex's faces in its mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexMean {
    /// By their areas.
    Area,
    /// All alike, as printed in the chapter.
    Plain,
}

/// The records of all vertices.
#[derive(Clone, Debug)]
pub struct VertexRecords {
    /// A record for each vertex of the mesh.
    pub records: Vec<SurfaceRecord>,
    /// The number of vertices all of whose faces have no area: they have the mean of their neighbors.
    pub filled: usize,
    /// The number of vertices of no face, or without a neighbor that has a value: they are open.
    pub unused: usize,
}

/// The points of vertices that trace rays of their own.
#[derive(Clone, Debug)]
pub struct VertexPoints {
    /// The points.
    pub points: Vec<SurfacePoint>,
    /// The vertex of each point: the first of its group.
    vertices: Vec<u32>,
}

/// The bent normal of a vertex that has neither faces nor a normal.
const UP: [f64; 3] = [0.0, 1.0, 0.0];

/// The sum of records by their weights.
#[derive(Clone, Copy, Default)]
struct Mean {
    weight: f64,
    accessibility: f64,
    bent_normal: [f64; 3],
}

impl Mean {
    fn add(&mut self, record: &SurfaceRecord, weight: f64) {
        self.weight += weight;
        self.accessibility += weight * f64::from(record.accessibility);
        let bent_normal = record.bent_normal.map(f64::from);
        self.bent_normal = plus(self.bent_normal, weight, bent_normal);
    }

    fn finish(&self) -> Option<SurfaceRecord> {
        let bent_normal = normalized(self.bent_normal).unwrap_or(UP);
        (self.weight > 0.0).then(|| SurfaceRecord {
            // The weights' sums may round apart by some ulps of f64, far less than one of f32.
            accessibility: (self.accessibility / self.weight) as f32,
            bent_normal: bent_normal.map(|v| v as f32),
        })
    }
}

/// Returns the means of the records of each vertex's faces. Vertices whose faces have no area have
/// the mean of their neighbors, and those of no face are open.
///
/// # Panics
///
/// If there is not a record for each point of `faces`.
pub fn vertex_means(
    mesh: &TriangleMesh,
    groups: &VertexGroups,
    faces: &FaceCenters,
    records: &[SurfaceRecord],
    mean: VertexMean,
) -> VertexRecords {
    assert_eq!(faces.points.len(), records.len(), "a record for each face");
    let mut sums = vec![Mean::default(); groups.len()];
    // Weights relative to the largest: areas of very small meshes leave the range of numbers.
    let largest = faces.areas.iter().copied().fold(0.0, f64::max);
    for ((&triangle, area), record) in faces.triangles.iter().zip(&faces.areas).zip(records) {
        let weight = match mean {
            VertexMean::Area => area / largest,
            VertexMean::Plain => 1.0,
        };
        for vertex in groups.corners(mesh.triangles()[triangle as usize]) {
            sums[vertex].add(record, weight);
        }
    }
    spread(mesh, groups, sums.iter().map(Mean::finish).collect())
}

/// Returns the points of all vertices with a normal, `offset` object units along it. A vertex without
/// one in the file has the area-weighted mean of its faces' normals.
pub fn vertex_points(
    mesh: &TriangleMesh,
    groups: &VertexGroups,
    faces: &FaceCenters,
    offset: f64,
) -> VertexPoints {
    let mut normals = vec![[0.0; 3]; groups.len()];
    let largest = faces.areas.iter().copied().fold(0.0, f64::max);
    for ((&triangle, area), point) in faces.triangles.iter().zip(&faces.areas).zip(&faces.points) {
        for vertex in groups.corners(mesh.triangles()[triangle as usize]) {
            normals[vertex] = plus(normals[vertex], area / largest, point.face);
        }
    }
    let mut own = VertexPoints {
        points: vec![],
        vertices: vec![],
    };
    for (vertex, normal) in normals.into_iter().enumerate() {
        // A vertex of no face has a sum of zero, as has each but the first of a group.
        let Some(of_faces) = normalized(normal) else {
            continue;
        };
        let axis = groups.normal(vertex).unwrap_or(of_faces);
        let position = mesh.positions()[vertex].map(f64::from);
        own.points.push(SurfacePoint {
            position: plus(position, offset, axis),
            axis,
            face: axis,
        });
        own.vertices.push(vertex as u32);
    }
    own
}

impl VertexPoints {
    /// Returns the records of all vertices from those of the points.
    ///
    /// # Panics
    ///
    /// If there is not a record for each point.
    pub fn spread(
        &self,
        mesh: &TriangleMesh,
        groups: &VertexGroups,
        records: &[SurfaceRecord],
    ) -> VertexRecords {
        assert_eq!(self.points.len(), records.len(), "a record for each point");
        let mut of_groups = vec![None; groups.len()];
        for (&vertex, record) in self.vertices.iter().zip(records) {
            of_groups[vertex as usize] = Some(*record);
        }
        spread(mesh, groups, of_groups)
    }
}

/// Gives each vertex the record of its group, fills those without one from their neighbors, and opens
/// the rest.
fn spread(
    mesh: &TriangleMesh,
    groups: &VertexGroups,
    mut of_groups: Vec<Option<SurfaceRecord>>,
) -> VertexRecords {
    let filled = fill(mesh, groups, &mut of_groups);
    let mut unused = 0;
    let mut n_filled = 0;
    let records = (0..groups.len() as u32).map(|vertex| {
        let first = groups.first(vertex);
        n_filled += usize::from(filled[first]);
        of_groups[first].unwrap_or_else(|| {
            unused += 1;
            SurfaceRecord::open(groups.normal(vertex as usize).unwrap_or(UP))
        })
    });
    VertexRecords {
        records: records.collect(),
        filled: n_filled,
        unused,
    }
}

/// Fills groups without a record with the mean of those that they share a triangle with, from the
/// outside inward. Returns which were filled.
fn fill(
    mesh: &TriangleMesh,
    groups: &VertexGroups,
    of_groups: &mut [Option<SurfaceRecord>],
) -> Vec<bool> {
    let mut filled = vec![false; groups.len()];
    let corners = mesh.triangles().iter().map(|t| groups.corners(*t));
    let mut partial: Vec<_> = corners
        .filter(|t| t.iter().any(|&v| of_groups[v].is_none()))
        .collect();
    loop {
        // All of a round see the values before it, so that the order of triangles does not matter.
        let mut means: Vec<(usize, Mean)> = Vec::new();
        for corners in &partial {
            for &to in corners.iter().filter(|&&to| of_groups[to].is_none()) {
                let mut mean = Mean::default();
                let known = corners.iter().filter_map(|&v| of_groups[v].as_ref());
                known.for_each(|record| mean.add(record, 1.0));
                means.push((to, mean));
            }
        }
        means.sort_by_key(|(to, _)| *to);
        let mut changed = false;
        for chunk in means.chunk_by(|a, b| a.0 == b.0) {
            let mut sum = Mean::default();
            for (_, mean) in chunk {
                sum.weight += mean.weight;
                sum.accessibility += mean.accessibility;
                sum.bent_normal = plus(sum.bent_normal, 1.0, mean.bent_normal);
            }
            if let Some(record) = sum.finish() {
                of_groups[chunk[0].0] = Some(record);
                filled[chunk[0].0] = true;
                changed = true;
            }
        }
        partial.retain(|t| t.iter().any(|&v| of_groups[v].is_none()));
        if !changed || partial.is_empty() {
            return filled;
        }
    }
}
