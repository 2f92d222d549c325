//! A prepared mesh in the device's memory.

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::prepared::HalfEdge;
use rayon::prelude::*;
use wgpu::{Buffer, BufferUsages};

use crate::BakeError;
use crate::work::Work;

/// Marks a half-edge that runs from the edge's second vertex to its first.
pub(super) const REVERSED: u32 = 1 << 31;

/// Edges that are looked at to tell how long they are.
const SAMPLE: usize = 1024;

/// Everything that does not depend on a pass.
pub(super) struct Mesh {
    pub positions: Buffer,
    pub normals: Buffer,
    pub edges: Buffer,
    pub n_pairs: u32,
    pub n_edges: u32,
    /// The least and the largest coordinates of triangles, in cells.
    pub bounds: [[f64; 3]; 2],
    /// The mean length of an edge along each axis, in cells.
    pub edge_cells: [f64; 3],
}

impl Mesh {
    pub(super) fn new(work: &Work<'_>, mesh: &PreparedMesh) -> Result<Self, BakeError> {
        let n_edges = mesh.edges().len() + mesh.lone_edges().len();
        let limit = work
            .context()
            .device
            .limits()
            .max_storage_buffer_binding_size;
        let fit = |what, bytes: usize| match bytes as u64 <= limit {
            true => Ok(()),
            false => Err(BakeError::TooLarge {
                what,
                bytes: bytes as u64,
                limit,
            }),
        };
        fit("the mesh's vertices", 12 * mesh.vertices().len())?;
        fit("the mesh's triangles", 12 * mesh.triangles().len())?;
        fit("the mesh's edges", 16 * n_edges)?;
        let storage = |label, bytes: &[u8]| work.upload(label, BufferUsages::STORAGE, bytes);
        let by_axis = by_axis(mesh.vertices(), |p, x| p[x]);
        let normals = normals(mesh);
        Ok(Self {
            positions: storage("positions", bytemuck::cast_slice(&by_axis)),
            normals: storage("normals", bytemuck::cast_slice(&normals)),
            edges: storage("edges", bytemuck::cast_slice(&edges(mesh))),
            n_pairs: mesh.edges().len() as u32,
            n_edges: n_edges as u32,
            bounds: bounds(mesh),
            edge_cells: edge_cells(mesh),
        })
    }

    /// The largest coordinate along each axis, whatever its sign, in cells.
    pub(super) fn reach(&self) -> [f64; 3] {
        let [low, high] = self.bounds;
        std::array::from_fn(|x| low[x].abs().max(high[x].abs()))
    }
}

/// All x, then all y, then all z: neighbouring invocations read neighbouring numbers.
fn by_axis<T: Sync, U: Send>(items: &[T], of: impl Fn(&T, usize) -> U + Sync) -> Vec<U> {
    let of = &of;
    (0..3)
        .into_par_iter()
        .flat_map(|x| {
            items
                .par_iter()
                .with_min_len(4096)
                .map(move |item| of(item, x))
        })
        .collect()
}

/// Exact ones, rounded: facings hang on them, and slivers have hardly any.
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
    let side = |s: HalfEdge| s.triangle() as u32 | if s.is_reversed() { REVERSED } else { 0 };
    let pairs = mesh.edges().par_iter().with_min_len(4096).map(|e| {
        let [a, b] = e.vertices;
        [a, b, side(e.sides[0]), side(e.sides[1])]
    });
    let lone = mesh.lone_edges().par_iter().with_min_len(4096).map(|e| {
        let [a, b] = e.vertices;
        [a, b, side(e.side), 0]
    });
    pairs.chain(lone).collect()
}

fn bounds(mesh: &PreparedMesh) -> [[f64; 3]; 2] {
    let wider = |a: [[i32; 3]; 2], b: [[i32; 3]; 2]| {
        [
            std::array::from_fn(|x| a[0][x].min(b[0][x])),
            std::array::from_fn(|x| a[1][x].max(b[1][x])),
        ]
    };
    let found = mesh
        .triangles()
        .par_iter()
        .with_min_len(4096)
        .flat_map_iter(|t| t.map(|v| [mesh.vertices()[v as usize]; 2]))
        .reduce(|| [[i32::MAX; 3], [i32::MIN; 3]], wider);
    found.map(|corner| corner.map(|v| f64::from(v) / f64::from(1_u32 << mesh.lattice().bits())))
}

fn edge_cells(mesh: &PreparedMesh) -> [f64; 3] {
    let pairs = mesh.edges().iter().map(|e| e.vertices);
    let lone = mesh.lone_edges().iter().map(|e| e.vertices);
    let step = ((mesh.edges().len() + mesh.lone_edges().len()) / SAMPLE).max(1);
    let (mut sum, mut n) = ([0.0; 3], 0.0_f64);
    for [a, b] in pairs.chain(lone).step_by(step) {
        let [a, b] = [a, b].map(|v| mesh.vertices()[v as usize]);
        for x in 0..3 {
            sum[x] += (f64::from(a[x]) - f64::from(b[x])).abs();
        }
        n += 1.0;
    }
    sum.map(|v| v / n.max(1.0) / f64::from(1_u32 << mesh.lattice().bits()))
}
