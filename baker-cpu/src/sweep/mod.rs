//! The direction sweep: bakes the six faces of all cells together, one direction at a time.
//!
//! # Theory
//!
//! Ray casting asks of each cell which of its directions meet the mesh. All cells share their
//! directions, so one may as well ask of each direction d which cells see the mesh along it.
//! The rays of one direction are parallel, and the surface ahead of parallel rays changes only
//! where a ray passes a *silhouette*. Counting silhouettes along a row of cells therefore gives
//! the answer for all its cells: exactly, without rays or a hierarchy, at a cost that grows
//! with the length of the silhouettes and not with the number of cells times directions.
//!
//! Choose an axis w; d = (a, b, 1) in the frame (u, v, w). Rows of cells run along u. The rays
//! of one row, for every a, lie in one plane, which cuts the mesh in a curve:
//!
//! ```text
//!   height                 d          A and B are the silhouettes: the points where the
//!    above  ,--A---.      /           curve turns back as seen along d. Seen along d, each
//!     the   |       '.   /            projects to a point of the row, c(A) and c(B). The
//!     row    \        B /             first cell right of c(A) has two more layers ahead,
//!             '--.___/ /              the first cell right of c(B) two fewer.
//!   ··o····o····o·+··o···+o····o···   cells of the row; + is c(A), c(B)
//!     0    0    0 ↑  2   ↑0    0      running sum of +2 and −2: layers ahead of each cell
//! ```
//!
//! A cell is occluded in direction d if the sum is not 0. Silhouettes below the row count the
//! same way for −d, so a row has two sums. Where the row itself meets the mesh, at a *row hit*,
//! a layer moves from one side of the row to the other.
//!
//! 1. **Batches.** A batch is an axis w and a slope b: the `size` directions (a, b, 1) and their
//!    opposites. All share the planes of the rows. Threads take the 3 × `size` batches in turn.
//! 2. **[Levels](data::Levels).** Row (j, k) lies in the plane V − b·W = j − k·b. Each vertex gets a
//!    rank among these planes; an edge crosses exactly those between the ranks of its ends.
//! 3. **[Silhouettes](silhouettes).** A triangle faces d or not, by sign(n·d). Each of its edges,
//!    on its own, begins or ends a layer there. The two triangles of an edge cancel unless one
//!    faces d and the other does not. None of this requires a closed mesh or consistent winding:
//!    the sum over half-edges is right for any triangles, only fewer edges cancel.
//! 4. **[Crossings](simd::portable::crossings).** An edge crosses a level at one point, shared by
//!    all directions of the batch; the first cell that it affects is ⌈u − height·a⌉.
//! 5. **[Row hits](row_hits)** are found once per axis, in exact integers.
//! 6. **[Summation](simd::portable::summation)** runs along the row and adds to the cells'
//!    moments.
//!
//! No row ends with a layer that never closes, a *streak*. A triangle crosses a level with two
//! edges or none, because it has three vertices and each has one rank. The two edges add opposite
//! deltas, because the triangle has one facing. If they are on different sides of the row, there
//! is a row hit between them. Deltas therefore always cancel by the end of the row, however values
//! are rounded; rounding moves a delta by one cell at most. Crossings and row hits must agree on
//! which side of the row an edge passes. Row hits decide it in exact integers unless the row's
//! line passes so close to an edge that rounding could matter; then they evaluate the same
//! expression as the crossings.
//!
//! Columns are computed in single precision twice, from slightly before the crossing and from
//! slightly behind it. If the two differ, double precision decides, as it does for rays. The
//! remaining errors are rays that pass an edge more closely than doubles can resolve, and rows
//! that touch a vertex. See also the limits of a [`PreparedMesh`].
//!
//! # Practice
//!
//! A [`Sweeper`] owns the buffers and is kept between bakes. Moments are integer sums
//! ([`FaceSums`](aogrid_bake_core::FaceSums)), so neither threads nor tiles nor SIMD levels
//! change a bit of them. Crossings arrive in the order of edges, all over the grid: their
//! [deltas](data::DeltaBuffer) are buffered by groups of rows, and each group is counted and summed
//! while it is in the L1 cache. Counters are bytes; an overflow is detected, and the group is counted
//! again in 32 bits. The [SIMD levels](simd) describe the code for wide registers.

mod batch;
mod data;
mod job;
mod moments;
mod pass;
mod row_hits;
mod silhouettes;
mod simd;
mod workspace;

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize};

use aogrid_bake_core::sweep::AxisFrame;
use aogrid_bake_core::{
    FaceBits, FixedTexel, Observer, OptionsError, PlanError, PreparedMesh, RawGrid, fixed_texels,
};
use aogrid_grid_format::{FACE_SIZES, Sampling};
use rayon::prelude::*;

use crate::error::BakeError;
use data::Tile;
use job::{SweepJob, SweepPass};
use moments::GridMoments;
use row_hits::RowHits;
use silhouettes::Silhouettes;
use simd::SimdLevel;
use workspace::Workspace;

/// Bakes cube faces by the direction sweep; buffers are reused from bake to bake.
pub struct Sweeper {
    simd_level: SimdLevel,
    /// The texels of the last face size.
    texels: Vec<FixedTexel>,
    vertices: VertexPositions,
    silhouettes: [Silhouettes; 3],
    workspaces: Mutex<Vec<Workspace>>,
    grid_moments: Mutex<GridMoments>,
}

/// Vertex positions in cells, stored twice: per vertex for edges, which access vertices at random,
/// with a spare one at the end, and per axis for ranks, which read them in sequence.
#[derive(Default)]
struct VertexPositions {
    positions: Vec<[f32; 3]>,
    by_axis: [Vec<f32>; 3],
}

impl VertexPositions {
    fn fill(&mut self, mesh: &PreparedMesh) {
        let in_cells = |p: &[i32; 3]| p.map(|v| mesh.lattice().in_cells(v));
        mesh.vertices()
            .par_iter()
            .with_min_len(4096)
            .map(in_cells)
            .collect_into_vec(&mut self.positions);
        // Wide loads of the last position reach beyond it.
        self.positions.push([0.0; 3]);
        for (axis, coordinates) in self.by_axis.iter_mut().enumerate() {
            self.positions[..mesh.vertices().len()]
                .par_iter()
                .with_min_len(4096)
                .map(|p| p[axis])
                .collect_into_vec(coordinates);
        }
    }
}

impl Default for Sweeper {
    fn default() -> Self {
        Self::new()
    }
}

impl Sweeper {
    /// Returns a sweeper without buffers, for the best SIMD level of this machine.
    pub fn new() -> Self {
        Self::with(SimdLevel::available()[0])
    }

    /// Returns the SIMD levels that this machine has and the sweep supports, the best first:
    /// `avx512`, `avx2`, and always `portable`. All give bit-identical results.
    pub fn simd_levels() -> Vec<&'static str> {
        let levels = SimdLevel::available().into_iter();
        levels.map(SimdLevel::name).collect()
    }

    /// Returns a sweeper for one of [`Sweeper::simd_levels`], to compare them; `None` if this
    /// machine has no SIMD level of that name.
    pub fn with_simd_level(name: &str) -> Option<Self> {
        let mut levels = SimdLevel::available().into_iter();
        levels.find(|level| level.name() == name).map(Self::with)
    }

    fn with(simd_level: SimdLevel) -> Self {
        Self {
            simd_level,
            texels: Vec::new(),
            vertices: VertexPositions::default(),
            silhouettes: Default::default(),
            workspaces: Mutex::default(),
            grid_moments: Mutex::default(),
        }
    }

    /// Bakes six faces of `size` × `size` texels around every cell of the mesh's grid, on all
    /// threads. The result has no signed layers; those are [the
    /// mesh's](PreparedMesh::signed_layers). The same input gives the same bits for any number of
    /// threads.
    ///
    /// # Errors
    ///
    /// A face size out of its range, or cancellation.
    pub fn bake(
        &mut self,
        mesh: &PreparedMesh,
        size: u32,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        self.run(mesh, size, None, observer)
    }

    /// Bakes as [`Sweeper::bake`] does and also returns the faces themselves: `size`² · 6 bits a
    /// cell.
    ///
    /// # Errors
    ///
    /// The same as [`Sweeper::bake`].
    pub fn bake_with_bits(
        &mut self,
        mesh: &PreparedMesh,
        size: u32,
        observer: Observer<'_>,
    ) -> Result<(RawGrid, FaceBits), BakeError> {
        let bits = Mutex::new(FaceBits::new(mesh.spec().cell_count(), size));
        let raw = self.run(mesh, size, Some(&bits), observer)?;
        Ok((raw, bits.into_inner().expect("no thread has panicked")))
    }

    fn run(
        &mut self,
        mesh: &PreparedMesh,
        size: u32,
        bits: Option<&Mutex<FaceBits>>,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        if !FACE_SIZES.contains(&size) {
            return Err(PlanError::from(OptionsError::FaceSize(size)).into());
        }
        // Enter the thread pool once: each parallel loop started from outside has to wake a worker.
        rayon::scope(|_| self.sweep(mesh, size, bits, observer))
    }

    fn sweep(
        &mut self,
        mesh: &PreparedMesh,
        size: u32,
        bits: Option<&Mutex<FaceBits>>,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        let directions = Sampling::CubeFaces { size }.directions();
        if self.texels.len() != directions as usize {
            self.texels = fixed_texels(size);
        }
        self.vertices.fill(mesh);
        let grid_moments = self.grid_moments.get_mut().expect("no thread has panicked");
        grid_moments.reset(mesh.spec().resolution());
        let job = SweepJob {
            mesh,
            simd_level: self.simd_level.supported_for(mesh),
            size,
            texels: &self.texels,
            vertices: &self.vertices,
            workspaces: &self.workspaces,
            grid_moments: &self.grid_moments,
            bits,
            observer,
            done: AtomicUsize::new(0),
            cancelled: AtomicBool::new(false),
        };
        run(&job, &mut self.silhouettes)?;
        // Integer sums are converted to moments only once all passes are done.
        let grid_moments = self.grid_moments.get_mut().expect("no thread has panicked");
        let (moments, counts) = grid_moments.moments(directions);
        Ok(RawGrid {
            spec: *mesh.spec(),
            moments,
            counts,
            directions,
            layers: None,
        })
    }
}

/// The largest number of edges for which several passes run in parallel, so that threads wait for
/// each other less often. Larger meshes keep all threads busy within one pass, and their
/// silhouettes take much memory.
const MAX_EDGES_FOR_PARALLEL_PASSES: usize = 1 << 19;

/// Runs all passes: one at a time, or as many in parallel as there are silhouette buffers.
fn run(job: &SweepJob<'_>, silhouettes: &mut [Silhouettes; 3]) -> Result<(), BakeError> {
    let frames = [0, 1, 2].map(|w| AxisFrame::new(job.mesh.spec(), w, job.size));
    let row_hits = RowHits::all(job.mesh, &frames);
    let axes = || frames.iter().zip(&row_hits);
    let passes: Vec<_> = SweepPass::rows(job.size)
        .flat_map(|rows| axes().map(move |axis| (axis, rows)))
        .collect();
    let run_in_parallel = job.mesh.edges().len() <= MAX_EDGES_FOR_PARALLEL_PASSES;
    let n_parallel = if run_in_parallel {
        silhouettes.len()
    } else {
        1
    };
    for chunk in passes.chunks(n_parallel) {
        let passes: Vec<_> = chunk
            .par_iter()
            .zip(&mut silhouettes[..])
            .map(|(&((frame, row_hits), (first_row, n_rows)), silhouettes)| {
                silhouettes.find((job.mesh, job.simd_level), frame, first_row, n_rows);
                SweepPass {
                    job,
                    frame,
                    row_hits,
                    tiles: Tile::all(frame),
                    first_row,
                    n_rows,
                    silhouettes,
                }
            })
            .collect();
        job.run(&passes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::models::Model;
    use aogrid_bake_core::{BakeOptions, Placement, UNOBSERVED};

    use super::*;

    #[test]
    fn every_simd_level_gives_the_same_bits() {
        let levels = SimdLevel::available();
        for (sample, triangles, resolution, size) in [
            (Model::SpaceShip, 3000, [16, 12, 33], 16),
            (Model::Robot, 3000, [33, 8, 9], 21),
            // So many crossings that single precision would put some into the wrong column.
            (Model::Torus, 100_000, [32; 3], 16),
        ] {
            let mesh = sample.mesh(Some(triangles)).unwrap();
            let placement = Placement {
                resolution,
                ..Placement::paper()
            };
            let spec = placement.place(&mesh.bounds()).unwrap();
            let mesh = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
            let bake = |level| Sweeper::with(level).bake_with_bits(&mesh, size, UNOBSERVED);
            let portable = bake(levels[levels.len() - 1]).unwrap();
            assert!(portable.0.counts.iter().any(|n| *n > 0));
            for level in &levels {
                assert!(bake(*level).unwrap() == portable, "{level:?}");
            }
        }
    }
}
