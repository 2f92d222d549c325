//! Signed layers of surface around each cell: is it inside a mesh that has holes?
//!
//! # Theory
//!
//! For a cell and a direction d let s(d) be the number of surfaces ahead that face d, less those
//! that face the cell: +1 where a ray leaves a front-facing side, −1 where it enters. Inside a
//! closed mesh s is 1 for every d, outside it is 0. Its mean over all directions is the generalized
//! winding number (Jacobson, Kavan, Sorkine-Hornung: *Robust Inside-Outside Segmentation using
//! Generalized Winding Numbers*, SIGGRAPH 2013), and its low bit is the parity of the crossings.
//! The shares of directions with s > 0, s < 0 and s odd tell inside from outside where the mean
//! does not: where layers add up or cancel. A hole lets a few directions escape and leaves the
//! shares as they are.
//!
//! Along a row of cells s(d) changes where the row itself meets a triangle (a *row hit*), and where
//! the ray passes an edge whose half-edges do not cancel (an *unbalanced* edge: the rim of a hole,
//! or neighbors that contradict each other). All other edges add nothing, whichever way their
//! triangles face. So a sweep over few edges and few triangles counts the layers of all cells; a
//! mesh without unbalanced edges needs none.
//!
//! Every decision is made in exact integers: which rows an edge passes above or below, and which
//! rows meet a triangle. Ties are broken as if all cells were moved by (ε, ε²) across their rows,
//! so that an edge and the triangles at it never disagree, and a layer that is entered is left.
//! Only the column from which on a layer counts is rounded.
//!
//! # Practice
//!
//! [`SignedLayers::around`] takes a mesh and a grid; bakers, which have a [`PreparedMesh`], call
//! [`PreparedMesh::signed_layers`]. [`SignedLayers::class`] is the rule.

mod class;
mod count;
mod crossings;
mod frame;
mod row_hits;
mod unbalanced;

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_grid_format::GridSpec;
use rayon::prelude::*;

pub use class::CellClass;
use count::{Counter, Delta};
use frame::{Frame, LANES};
use row_hits::RowHits;
use unbalanced::Winding;

use crate::prepared::Limits;
use crate::{PreparedMesh, TriangleMesh, UNOBSERVED};

/// Texels along a face's side. Even, so that no direction lies in a plane of two axes; more would
/// change the class of a few cells in a thousand.
const FACE_SIZE: u32 = 8;

/// Directions of a cell: six faces of 8² texels, of equal weight.
pub const LAYER_DIRECTIONS: u16 = 6 * (FACE_SIZE * FACE_SIZE) as u16;

/// Cells around the mesh's bounding box whose layers are counted, too. Outside the box no cell is
/// inside, as at most half of its directions meet the box; but one beside a sheet is in doubt.
const MARGIN: i32 = 1;

/// A cell's directions in which the signed layers ahead are positive, negative, and odd.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LayerCounts {
    /// Directions with s > 0, of [`LAYER_DIRECTIONS`]. Not counted for contradictory windings.
    pub positive: u16,
    /// Directions with s < 0. Not counted for contradictory windings.
    pub negative: u16,
    /// Directions with an odd s.
    pub odd: u16,
}

impl LayerCounts {
    fn add(&mut self, other: &Self) {
        self.positive += other.positive;
        self.negative += other.negative;
        self.odd += other.odd;
    }
}

/// The signed layers around the cells of a grid that lie in the mesh's bounding box or within one
/// cell of it. See the [module](self).
#[derive(Clone, Debug, PartialEq)]
pub struct SignedLayers {
    region: Region,
    /// The counts of the region's cells, x fastest.
    counts: Vec<LayerCounts>,
    winding: Winding,
}

/// A box of cells.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Region {
    /// Along x, y and z.
    cells: [Range<u32>; 3],
}

impl Region {
    /// The cells of the grid within [`MARGIN`] cells of the vertices.
    fn around(mesh: &PreparedMesh) -> Self {
        let resolution = mesh.spec().resolution();
        let [low, high] = mesh
            .bounds()
            .map(|corner| corner.map(|coordinate| coordinate >> mesh.lattice().bits()));
        Self {
            cells: std::array::from_fn(|axis| {
                let n = resolution[axis] as i32;
                let start = (low[axis] - MARGIN).clamp(0, n);
                // Upper bounds are rounded down, and ranges exclude their ends.
                let end = (high[axis] + 2 + MARGIN).clamp(0, n);
                start as u32..end as u32
            }),
        }
    }

    fn n_cells(&self) -> usize {
        self.cells.iter().map(ExactSizeIterator::len).product()
    }

    /// Between the indices of neighbors along x, y and z.
    fn strides(&self) -> [usize; 3] {
        let [n_x, n_y, _] = self.cells.each_ref().map(ExactSizeIterator::len);
        [1, n_x, n_x * n_y]
    }

    /// The cell's index within the region, if it is there.
    fn idx(&self, cell: [u32; 3]) -> Option<usize> {
        let inside = self.cells.iter().zip(cell).all(|(r, i)| r.contains(&i));
        let [x, y, z]: [usize; 3] =
            std::array::from_fn(|axis| cell[axis].wrapping_sub(self.cells[axis].start) as usize);
        let [_, n_x, layer] = self.strides();
        inside.then(|| x + y * n_x + z * layer)
    }
}

impl SignedLayers {
    /// Counts the layers around `mesh` at the samples of `spec`, `sample_offset` cells from the
    /// cells' centers, on all threads; the result does not depend on their number.
    ///
    /// Returns none where there is nothing to count: a mesh without unbalanced edges, or one that
    /// reaches a million cells from the grid.
    pub fn around(mesh: &TriangleMesh, spec: GridSpec, sample_offset: [f32; 3]) -> Option<Self> {
        let prepared = PreparedMesh::within(Limits::LAYERS, mesh, spec, sample_offset, UNOBSERVED);
        prepared.ok()?.signed_layers()
    }

    /// The layers of a cell; all zero for those far from the mesh.
    pub fn counts(&self, cell: [u32; 3]) -> LayerCounts {
        let idx = self.region.idx(cell);
        idx.map_or_else(LayerCounts::default, |idx| self.counts[idx])
    }

    /// Whether the windings of neighboring triangles agree, but for at most 2 % of all edges.
    pub fn winding_is_consistent(&self) -> bool {
        self.winding == Winding::Consistent
    }
}

impl PreparedMesh {
    /// [`SignedLayers::around`] this mesh; none if all its edges are balanced.
    pub fn signed_layers(&self) -> Option<SignedLayers> {
        let surface = unbalanced::Surface::of(self)?;
        let region = Region::around(self);
        let frames = [0, 1, 2].map(|w| Frame::new(self, &region, w));
        let hits = RowHits::all(self, &frames);
        // A sum in a direction is made of these at the most.
        let longest_row = hits.iter().map(|hits| hits.max_in_row()).max();
        let nets = surface
            .edges
            .iter()
            .map(|edge| edge.net.unsigned_abs() as usize);
        let bound = nets.sum::<usize>() + longest_row.unwrap_or(0);
        let counts = match i16::try_from(bound) {
            Ok(_) => count_all::<i16>(self, &surface, &region, &frames, &hits),
            Err(_) => count_all::<i32>(self, &surface, &region, &frames, &hits),
        };
        Some(SignedLayers {
            region,
            counts,
            winding: surface.winding,
        })
    }
}

/// Deltas of a tile take about this much: they are read and written once for each row of texels.
const TILE_BYTES: usize = 1 << 18;

/// Rows of texels that are counted in one go: half a face, so that a small grid has work for six
/// threads.
const TEXELS_CHUNK: usize = FACE_SIZE as usize / 2;

/// Some layers of an axis, and some rows of texels.
struct Tile<'a> {
    frame: &'a Frame,
    hits: &'a RowHits,
    k: Range<u32>,
    texels: Range<usize>,
}

impl<'a> Tile<'a> {
    /// Divides the work along an axis.
    fn all<D>(frame: &'a Frame, hits: &'a RowHits) -> impl Iterator<Item = Self> {
        let [columns, rows, layers] = &frame.cells;
        let layer = (columns.len() + 1) * rows.len() * LANES * size_of::<D>();
        let depth = (TILE_BYTES / layer.max(1)).max(1);
        let starts = layers.clone().step_by(depth);
        starts.flat_map(move |k| {
            let end = (k + depth as u32).min(frame.cells[2].end);
            let texels = (0..FACE_SIZE as usize).step_by(TEXELS_CHUNK);
            texels.map(move |texel| Self {
                frame,
                hits,
                k: k..end,
                texels: texel..texel + TEXELS_CHUNK,
            })
        })
    }
}

fn count_all<D: Delta>(
    mesh: &PreparedMesh,
    surface: &unbalanced::Surface,
    region: &Region,
    frames: &[Frame; 3],
    hits: &[RowHits; 3],
) -> Vec<LayerCounts> {
    let axes = frames.iter().zip(hits);
    let tiles: Vec<_> = axes
        .flat_map(|(frame, hits)| Tile::all::<D>(frame, hits))
        .collect();
    let next = AtomicUsize::new(0);
    // Sums of integers: it does not matter who counts what.
    let count = |_| {
        let mut counter = Counter::<D>::new(mesh, surface, region);
        while let Some(tile) = tiles.get(next.fetch_add(1, Ordering::Relaxed)) {
            counter.add(tile);
        }
        counter.into_counts()
    };
    let threads = 0..rayon::current_num_threads().min(tiles.len());
    let counted: Vec<_> = threads.into_par_iter().with_max_len(1).map(count).collect();
    let mut counted = counted.into_iter();
    let mut counts = counted.next().unwrap_or_default();
    for of_thread in counted {
        for (counts, of_thread) in counts.iter_mut().zip(&of_thread) {
            counts.add(of_thread);
        }
    }
    counts
}

#[cfg(test)]
mod tests;
