//! The device buffers of a prepared mesh.

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::prepared::HalfEdge;
use rayon::prelude::*;
use wgpu::{Buffer, BufferUsages};

use crate::BakeError;
use crate::work::Submitter;

/// The flag of a half-edge that runs from the edge's second vertex to its first.
pub(super) const REVERSED: u32 = 1 << 31;

/// The number of edges that are sampled to estimate the mean edge length.
const EDGE_SAMPLES: usize = 1024;

/// The buffers and figures of a mesh that all passes share.
pub(super) struct MeshBuffers {
    pub positions: Buffer,
    pub normals: Buffer,
    pub edges: Buffer,
    pub n_interior_edges: u32,
    pub n_edges: u32,
    /// The minimum and maximum coordinates of the triangles, in cells.
    pub bounds: [[f64; 3]; 2],
    /// The mean length of an edge along each axis, in cells.
    pub edge_cells: [f64; 3],
}

impl MeshBuffers {
    pub(super) fn new(submitter: &Submitter<'_>, mesh: &PreparedMesh) -> Result<Self, BakeError> {
        let n_edges = mesh.edges().len() + mesh.boundary_edges().len();
        let limit = submitter
            .context()
            .device
            .limits()
            .max_storage_buffer_binding_size;
        let check_size = |what, bytes: usize| match bytes as u64 <= limit {
            true => Ok(()),
            false => Err(BakeError::TooLarge {
                what,
                bytes: bytes as u64,
                limit,
            }),
        };
        check_size("the mesh's vertices", 12 * mesh.vertices().len())?;
        check_size("the mesh's triangles", 12 * mesh.triangles().len())?;
        check_size("the mesh's edges", 16 * n_edges)?;
        let storage = |label, bytes: &[u8]| submitter.upload(label, BufferUsages::STORAGE, bytes);
        let positions = by_axis(mesh.vertices(), |p, x| p[x]);
        let normals = normals(mesh);
        Ok(Self {
            positions: storage("positions", bytemuck::cast_slice(&positions)),
            normals: storage("normals", bytemuck::cast_slice(&normals)),
            edges: storage("edges", bytemuck::cast_slice(&edges(mesh))),
            n_interior_edges: mesh.edges().len() as u32,
            n_edges: n_edges as u32,
            bounds: bounds(mesh),
            edge_cells: edge_cells(mesh),
        })
    }
}

/// Returns all x, then all y, then all z, so that neighboring invocations read neighboring
/// numbers.
fn by_axis<T: Sync, U: Send>(items: &[T], component: impl Fn(&T, usize) -> U + Sync) -> Vec<U> {
    let component = &component;
    (0..3)
        .into_par_iter()
        .flat_map(|x| {
            items
                .par_iter()
                .with_min_len(4096)
                .map(move |item| component(item, x))
        })
        .collect()
}

/// Returns the normals, rounded from exact ones: facing intervals depend on them, and those of
/// slivers would be lost to cancellation.
fn normals(mesh: &PreparedMesh) -> Vec<f32> {
    let normals: Vec<[f32; 3]> = mesh
        .triangles()
        .par_iter()
        .with_min_len(4096)
        .map(|&triangle| mesh.normal(triangle).map(|v| v as f32))
        .collect();
    by_axis(&normals, |n, x| n[x])
}

fn edges(mesh: &PreparedMesh) -> Vec<[u32; 4]> {
    let half_edge = |h: HalfEdge| h.triangle() as u32 | if h.is_reversed() { REVERSED } else { 0 };
    let interior = mesh.edges().par_iter().with_min_len(4096).map(|e| {
        let [a, b] = e.vertices;
        [a, b, half_edge(e.sides[0]), half_edge(e.sides[1])]
    });
    let boundary = mesh
        .boundary_edges()
        .par_iter()
        .with_min_len(4096)
        .map(|e| {
            let [a, b] = e.vertices;
            [a, b, half_edge(e.side), 0]
        });
    interior.chain(boundary).collect()
}

fn bounds(mesh: &PreparedMesh) -> [[f64; 3]; 2] {
    let union = |a: [[i32; 3]; 2], b: [[i32; 3]; 2]| {
        [
            std::array::from_fn(|x| a[0][x].min(b[0][x])),
            std::array::from_fn(|x| a[1][x].max(b[1][x])),
        ]
    };
    let lattice_bounds = mesh
        .triangles()
        .par_iter()
        .with_min_len(4096)
        .flat_map_iter(|t| t.map(|v| [mesh.vertices()[v as usize]; 2]))
        .reduce(|| [[i32::MAX; 3], [i32::MIN; 3]], union);
    lattice_bounds
        .map(|corner| corner.map(|v| f64::from(v) / f64::from(1_u32 << mesh.lattice().bits())))
}

/// Estimates the mean length of an edge along each axis, in cells.
fn edge_cells(mesh: &PreparedMesh) -> [f64; 3] {
    let interior = mesh.edges().iter().map(|e| e.vertices);
    let boundary = mesh.boundary_edges().iter().map(|e| e.vertices);
    let step = ((mesh.edges().len() + mesh.boundary_edges().len()) / EDGE_SAMPLES).max(1);
    let (mut sum, mut n) = ([0.0; 3], 0.0_f64);
    for [a, b] in interior.chain(boundary).step_by(step) {
        let [a, b] = [a, b].map(|v| mesh.vertices()[v as usize]);
        for x in 0..3 {
            sum[x] += (f64::from(a[x]) - f64::from(b[x])).abs();
        }
        n += 1.0;
    }
    sum.map(|v| v / n.max(1.0) / f64::from(1_u32 << mesh.lattice().bits()))
}
