//! The direction sweep: the six faces of all cells at once, one direction at a time.
//!
//! # Theory
//!
//! Casting rays asks for each cell: which of my directions meet the mesh? But all cells share
//! their directions, so one may as well ask for each direction d: which cells see the mesh?
//! Rays of one direction are parallel, and what lies ahead along parallel rays only changes
//! where one of them passes a *silhouette*. Counting silhouettes along a row of cells gives
//! the answer for all its cells: exactly, without a ray or a hierarchy, at a cost that grows
//! with the length of silhouettes and not with the number of cells times directions.
//!
//! Choose an axis w; d = (a, b, 1) in the frame (u, v, w). Rows of cells run along u. The rays
//! of one row, for every a, lie in one plane, which cuts the mesh in a curve:
//!
//! ```text
//!   height                 d          the curve's points where it turns back as seen
//!    above  ,--A---.      /           along d are its silhouettes, A and B. Seen along d
//!     the   |       '.   /            each falls on a place in the row, at c(A), c(B): from
//!     row    \        B /             the first cell right of c(A) on there are two layers
//!             '--.___/ /              more ahead, from the first right of c(B) on two fewer.
//!   ··o····o····o·+··o···+o····o···   cells of the row; + is c(A), c(B)
//!     0    0    0 ↑  2   ↑0    0      running sum of +2 and −2: layers ahead of each cell
//! ```
//!
//! A cell is occluded in direction d if the sum is not 0. Silhouettes below the row count the
//! same way for −d: two sums a row. And where the row itself enters the mesh, a layer changes
//! from one side of the row to the other: the *piercings*.
//!
//! 1. **Batches.** An axis w and a slope b: the `size` directions (a, b, 1) and their opposites.
//!    All share the rows' planes. 3 × `size` batches are the work of threads.
//! 2. **[Levels](levels).** Row (j, k) lies in the plane V − b·W = j − k·b. Each vertex gets a
//!    rank among these planes; an edge crosses exactly those between the ranks of its ends.
//! 3. **[Silhouettes](silhouettes).** A triangle faces d or not, sign(n·d). Each of its edges,
//!    by itself, begins or ends a layer there. Two triangles at an edge cancel unless the one
//!    faces d and the other does not. Nothing here asks for a closed mesh or for consistent
//!    winding: the sum over half-edges is right for any triangles, they only cancel less.
//! 4. **[Crossings](crossings).** An edge crosses a level at one point, shared by all
//!    directions of the batch; the first cell that it matters to is ⌈u − height·a⌉.
//! 5. **[Piercings](piercings)**, found once an axis in exact integers.
//! 6. **[Summation](summation)** along the row, and into the cells' moments.
//!
//! Why no row ends up with a layer that never closes, a *streak*: a triangle crosses a level
//! with two edges or none, because it has three vertices and each has one rank; the two add
//! opposite steps, because the triangle has one facing; and if they are on different sides of
//! the row, there is a piercing between them. So steps always cancel by the end of the row,
//! whatever is rounded how; rounding moves a step by a cell at the most. The one question with
//! two askers is on which side of the row an edge passes: crossings ask for the edge, piercings
//! for the triangle. Piercings know the answer in exact integers unless the row's line passes
//! so close to an edge that rounding could matter; then they ask the crossings' own expression.
//!
//! Columns are found in single floats twice, from a little before the crossing and from a little
//! behind it. Where the two differ, double precision decides, as it does for rays: what is left is
//! a ray that passes an edge more closely than doubles tell, or a row that a vertex touches. See
//! also the limits of a [`PreparedMesh`].
//!
//! # Practice
//!
//! A [`Sweeper`] owns the buffers and is kept between bakes. Moments are sums of integers
//! ([`FaceSums`](aogrid_bake_core::FaceSums)), so that neither threads nor tiles nor instructions change a bit of them.
//! Crossings come in the order of edges, all over the grid: their [steps] are kept by groups of
//! rows, and each group is counted and summed while it is in a core's first cache. Counters are
//! bytes; one that is too small for its layers is noticed, and its group is counted again in 32
//! bits. [Instructions](instructions) says what is done for wide registers.

mod batch;
mod counters;
mod crossings;
mod frame;
mod instructions;
mod levels;
mod pass;
mod piercings;
mod silhouettes;
mod steps;
mod summation;
mod sums;

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize};

use aogrid_bake_core::{FaceBits, FixedTexel, Observer, PreparedMesh, RawGrid, fixed_texels};
use aogrid_grid_format::{FACE_SIZES, Method};
use rayon::prelude::*;

use crate::BakeError;
use batch::Workspace;
use counters::Tile;
use frame::Frame;
use instructions::Instructions;
use pass::{Job, Pass};
use piercings::Piercings;
use silhouettes::Silhouettes;
use sums::Totals;

/// Bakes faces by the direction sweep, again and again with the same buffers.
pub struct Sweeper {
    instructions: Instructions,
    /// Of the last face size.
    texels: Vec<FixedTexel>,
    vertices: Vertices,
    silhouettes: [Silhouettes; 3],
    workspaces: Mutex<Vec<Workspace>>,
    totals: Mutex<Totals>,
}

/// Positions in cells, twice: by vertex for edges, which jump from vertex to vertex, and by axis
/// for ranks, which take one after the other.
#[derive(Default)]
struct Vertices {
    positions: Vec<[f32; 3]>,
    by_axis: [Vec<f32>; 3],
}

impl Vertices {
    fn fill(&mut self, mesh: &PreparedMesh) {
        let in_cells = |p: &[i32; 3]| p.map(|v| mesh.lattice().in_cells(v));
        mesh.vertices()
            .par_iter()
            .with_min_len(4096)
            .map(in_cells)
            .collect_into_vec(&mut self.positions);
        for (axis, coordinates) in self.by_axis.iter_mut().enumerate() {
            self.positions
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
    /// Without buffers yet; with the best instructions that the machine has.
    pub fn new() -> Self {
        Self::with(Instructions::available()[0])
    }

    /// The sets of instructions that this machine has and the sweep knows, the best first:
    /// `avx512`, `avx2`, and always `portable`. All give the same bits.
    pub fn instruction_sets() -> Vec<&'static str> {
        let sets = Instructions::available().into_iter();
        sets.map(Instructions::name).collect()
    }

    /// With one of [`Sweeper::instruction_sets`], to compare them; none if it is no such.
    pub fn with_instructions(name: &str) -> Option<Self> {
        let mut sets = Instructions::available().into_iter();
        sets.find(|set| set.name() == name).map(Self::with)
    }

    fn with(instructions: Instructions) -> Self {
        Self {
            instructions,
            texels: Vec::new(),
            vertices: Vertices::default(),
            silhouettes: Default::default(),
            workspaces: Mutex::default(),
            totals: Mutex::default(),
        }
    }

    /// Bakes six faces of `size` × `size` texels around every cell of the mesh's grid, on all
    /// threads; without its signed layers, which are [the mesh's](PreparedMesh::signed_layers). The same input gives the same bits, for any number of threads.
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

    /// [`Sweeper::bake`], and the faces themselves: `size`² · 6 bits a cell.
    ///
    /// # Errors
    ///
    /// As [`Sweeper::bake`].
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
            return Err(aogrid_bake_core::OptionsError::FaceSize(size).into());
        }
        // From here on in the pool: each loop over all threads that is begun outside of it has
        // to wake one first.
        rayon::scope(|_| self.sweep(mesh, size, bits, observer))
    }

    fn sweep(
        &mut self,
        mesh: &PreparedMesh,
        size: u32,
        bits: Option<&Mutex<FaceBits>>,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        let directions = Method::Faces { size }.directions();
        if self.texels.len() != directions as usize {
            self.texels = fixed_texels(size);
        }
        self.vertices.fill(mesh);
        let totals = self.totals.get_mut().expect("no thread has panicked");
        totals.start(mesh.spec().resolution());
        let job = Job {
            mesh,
            instructions: self.instructions.fitting(mesh),
            size,
            texels: &self.texels,
            vertices: &self.vertices,
            workspaces: &self.workspaces,
            totals: &self.totals,
            bits,
            observer,
            done: AtomicUsize::new(0),
            cancelled: AtomicBool::new(false),
        };
        run(&job, &mut self.silhouettes)?;
        let totals = self.totals.get_mut().expect("no thread has panicked");
        let (moments, counts) = totals.moments(directions);
        Ok(RawGrid {
            spec: *mesh.spec(),
            moments,
            counts,
            directions,
            layers: None,
        })
    }
}

/// Edges up to which several passes are run at once, so that threads wait for each other less
/// often. Those of larger meshes take their time, and their silhouettes much memory.
const FEW_EDGES: usize = 1 << 19;

/// All passes: three, or as many at once as there are buffers for silhouettes.
fn run(job: &Job<'_>, silhouettes: &mut [Silhouettes; 3]) -> Result<(), BakeError> {
    let frames = [0, 1, 2].map(|w| Frame::new(job.mesh, w, job.size));
    let piercings = Piercings::all(job.mesh, &frames);
    let axes = || frames.iter().zip(&piercings);
    let passes: Vec<_> = Pass::rows(job.size)
        .flat_map(|rows| axes().map(move |axis| (axis, rows)))
        .collect();
    let few = job.mesh.edges().len() <= FEW_EDGES;
    let at_once = if few { silhouettes.len() } else { 1 };
    for some in passes.chunks(at_once) {
        let passes: Vec<_> = some
            .par_iter()
            .zip(&mut silhouettes[..])
            .map(
                |(&((frame, piercings), (first_row, n_rows)), silhouettes)| {
                    silhouettes.find(job, frame, first_row, n_rows);
                    Pass {
                        job,
                        frame,
                        piercings,
                        tiles: Tile::all(frame),
                        first_row,
                        n_rows,
                        silhouettes,
                    }
                },
            )
            .collect();
        job.run(&passes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::samples::Sample;
    use aogrid_bake_core::{BakeOptions, Placement, UNOBSERVED};

    use super::*;

    #[test]
    fn every_set_of_instructions_gives_the_same_bits() {
        let sets = Instructions::available();
        for (sample, resolution, size) in [
            (Sample::SpaceShip, [16, 12, 33], 16),
            (Sample::Robot, [33, 8, 9], 21),
        ] {
            let mesh = sample.mesh(Some(3000)).unwrap();
            let placement = Placement {
                resolution,
                ..Placement::default()
            };
            let spec = placement.place(&mesh.bounds()).unwrap();
            let mesh = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
            let bake = |set| Sweeper::with(set).bake_with_bits(&mesh, size, UNOBSERVED);
            let portable = bake(sets[sets.len() - 1]).unwrap();
            assert!(portable.0.counts.iter().any(|n| *n > 0));
            for set in &sets {
                assert!(bake(*set).unwrap() == portable, "{set:?}");
            }
        }
    }
}
