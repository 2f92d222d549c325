//! Running sums along rows of cells, for the directions of one axis.

use super::crossings::{Edge, crossings};
use super::frame::{LANES, Planes};
use super::row_hits::RowHit;
use super::unbalanced::{Surface, Winding};
use super::{LayerCounts, Region, Tile};
use crate::PreparedMesh;

/// A number that sums of deltas fit. All additions wrap: that none does is known beforehand, and
/// checks would keep loops over lanes from becoming vector instructions.
pub(super) trait Delta: Copy + Default + Send + Sync + From<i8> {
    fn add(self, other: Self) -> Self;
    fn of(net: i32) -> Self;
    /// Whether it is positive, negative and odd: bits 0, 4 and 8.
    fn facts(self) -> Self;
    fn bits(self) -> u16;
}

/// Directions of one lane are as many as a face has rows of texels: each fact takes four bits.
const FACT_BITS: u32 = 4;
const NEGATIVE: i8 = 1 << FACT_BITS;

macro_rules! delta {
    ($t:ty) => {
        impl Delta for $t {
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                self.wrapping_add(other)
            }

            #[inline(always)]
            fn of(net: i32) -> Self {
                net as Self
            }

            #[inline(always)]
            fn facts(self) -> Self {
                // Shifts of the sign, which become vector instructions where comparisons do not.
                let sign = Self::BITS - 1;
                let positive = self.wrapping_neg() >> sign & 1;
                let negative = self >> sign & Self::from(NEGATIVE);
                let odd = (self & 1) << (2 * FACT_BITS);
                positive | negative | odd
            }

            #[inline(always)]
            fn bits(self) -> u16 {
                self as u16
            }
        }
    };
}

delta!(i16);
delta!(i32);

/// The cells' counts so far, and buffers that are used again.
pub(super) struct Counter<'a, D> {
    mesh: &'a PreparedMesh,
    surface: &'a Surface,
    region: &'a Region,
    counts: Vec<LayerCounts>,
    edges: Vec<Edge>,
    rows: Rows<D>,
    /// The facts of the cells of a tile, u fastest.
    facts: Vec<[D; LANES]>,
}

/// The rows of a tile.
#[derive(Default)]
struct Rows<D> {
    /// The first j and k, and how many rows follow each other along v.
    first: [u32; 2],
    n_v: u32,
    /// Cells of a row, and one beyond its end.
    stride: usize,
    /// The deltas of s at each cell, from the cell before. All zero between batches.
    deltas: Vec<[D; LANES]>,
    is_touched: Vec<bool>,
}

impl<D: Delta> Rows<D> {
    fn start(&mut self, tile: &Tile<'_>) {
        let [columns, rows, _] = &tile.frame.cells;
        self.first = [rows.start, tile.k.start];
        self.n_v = rows.end - rows.start;
        self.stride = columns.len() + 1;
        let n_rows = rows.len() * tile.k.len();
        self.deltas.clear();
        self.deltas
            .resize(self.stride * n_rows, [D::default(); LANES]);
        self.is_touched.clear();
        self.is_touched.resize(n_rows, false);
    }

    /// The deltas of a row, from the region's first column on.
    #[inline(always)]
    fn deltas(&mut self, j: u32, k: u32) -> &mut [[D; LANES]] {
        let row = (k - self.first[1]) * self.n_v + (j - self.first[0]);
        self.is_touched[row as usize] = true;
        &mut self.deltas[row as usize * self.stride..][..self.stride]
    }

    fn add_hits(&mut self, hits: &[RowHit]) {
        for hit in hits {
            for delta in &mut self.deltas(hit.j, hit.k)[hit.column as usize] {
                *delta = delta.add(hit.delta.into());
            }
        }
    }

    fn add_crossings(&mut self, tile: &Tile<'_>, edges: &[Edge], planes: Planes) {
        for edge in edges {
            crossings(tile.frame, planes, edge, tile.k.clone(), |crossing| {
                let deltas = self.deltas(crossing.j, crossing.k);
                let delta = D::of(crossing.delta);
                for (lane, column) in (crossing.first_lane..).zip(crossing.columns) {
                    let before = &mut deltas[column as usize][lane & (LANES - 1)];
                    *before = before.add(delta);
                }
            });
        }
    }

    /// Adds what holds in the batch's directions to the cells' facts, and leaves no deltas.
    fn sum(&mut self, facts: &mut [[D; LANES]]) {
        let rows = self.deltas.chunks_exact_mut(self.stride);
        let cells = facts.chunks_exact_mut(self.stride - 1);
        let is_touched = self.is_touched.iter_mut().map(std::mem::take);
        for ((deltas, cells), is_touched) in rows.zip(cells).zip(is_touched) {
            if is_touched {
                add_facts(deltas, cells);
                deltas.fill([D::default(); LANES]);
            }
        }
    }
}

impl<'a, D: Delta> Counter<'a, D> {
    pub(super) fn new(mesh: &'a PreparedMesh, surface: &'a Surface, region: &'a Region) -> Self {
        Self {
            mesh,
            surface,
            region,
            counts: vec![LayerCounts::default(); region.n_cells()],
            edges: Vec::new(),
            rows: Rows::default(),
            facts: Vec::new(),
        }
    }

    /// Those of the region's cells, x fastest.
    pub(super) fn into_counts(self) -> Vec<LayerCounts> {
        self.counts
    }

    /// Counts the directions of a tile.
    pub(super) fn add(&mut self, tile: &Tile<'_>) {
        let Self { mesh, surface, .. } = *self;
        let edges = surface.edges.iter();
        self.edges.clear();
        self.edges
            .extend(edges.map(|edge| Edge::new(mesh, tile.frame, edge)));
        self.rows.start(tile);
        let n_cells = self.rows.is_touched.len() * (self.rows.stride - 1);
        self.facts.clear();
        self.facts.resize(n_cells, [D::default(); LANES]);
        for texel in tile.texels.clone() {
            self.rows.add_hits(tile.hits.in_layers(&tile.k));
            self.rows
                .add_crossings(tile, &self.edges, Planes::new(tile.frame, texel));
            self.rows.sum(&mut self.facts);
        }
        self.reduce(tile);
    }

    /// Adds the facts of the tile's cells to the counts.
    fn reduce(&mut self, tile: &Tile<'_>) {
        let signs = self.surface.winding == Winding::Consistent;
        let [along_u, along_v, along_w] = tile.frame.axes.map(|axis| self.region.strides()[axis]);
        let n_v = self.rows.n_v as usize;
        let first_layer = (tile.k.start - tile.frame.cells[2].start) as usize;
        let rows = self.facts.chunks_exact((self.rows.stride - 1).max(1));
        for (row, facts) in rows.enumerate() {
            let first = row % n_v * along_v + (first_layer + row / n_v) * along_w;
            let counts = self.counts[first..].iter_mut().step_by(along_u);
            for (counts, facts) in counts.zip(facts) {
                counts.add(&total(facts, signs));
            }
        }
    }
}

/// Adds the running sums' facts to the cells of a row.
#[inline]
fn add_facts<D: Delta>(deltas: &[[D; LANES]], cells: &mut [[D; LANES]]) {
    let mut layers = [D::default(); LANES];
    for (cell, delta) in cells.iter_mut().zip(deltas) {
        // Loops of one operation each: compilers make vector instructions of them.
        layers = lanes(|lane| layers[lane].add(delta[lane]));
        let facts: [D; LANES] = lanes(|lane| layers[lane].facts());
        *cell = lanes(|lane| cell[lane].add(facts[lane]));
    }
}

#[inline(always)]
fn lanes<D: Delta>(of: impl Fn(usize) -> D) -> [D; LANES] {
    let mut lanes = [D::default(); LANES];
    for (lane, value) in lanes.iter_mut().enumerate() {
        *value = of(lane);
    }
    lanes
}

/// The facts of all lanes; only whether layers are odd without `signs`.
#[inline]
fn total<D: Delta>(facts: &[D; LANES], signs: bool) -> LayerCounts {
    // Two facts at once: no sum exceeds a byte, as there are at most 8 in each of 16 lanes.
    let mut both = 0_u16;
    let mut negative = 0_u16;
    for fact in facts {
        both = both.wrapping_add(fact.bits() & 0x0f0f);
        negative = negative.wrapping_add(fact.bits() >> FACT_BITS & 0x0f);
    }
    let [positive, odd] = both.to_le_bytes().map(u16::from);
    LayerCounts {
        positive: if signs { positive } else { 0 },
        negative: if signs { negative } else { 0 },
        odd,
    }
}
