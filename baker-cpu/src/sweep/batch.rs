//! A batch: all directions of one slope, in one tile of the grid.

use super::counters::{Layout, MOST_PLACES, Tile};
use super::crossings::{AT_ONCE, Batch, Edges, Row};
use super::frame::{Frame, LANES};
use super::instructions::{Vectors, Work};
use super::levels::Levels;
use super::pass::Pass;
use super::silhouettes::{Facing, Sides};
use super::steps::{Bytes, Steps, Taken};
use super::summation::{self, Mask};
use super::sums::Sums;

/// A batch, in one tile.
pub(super) struct BatchWork<'a> {
    pub pass: &'a Pass<'a>,
    pub tile: &'a Tile,
    /// From the pass's first.
    pub row: usize,
    pub workspace: &'a mut Workspace,
}

impl Work for BatchWork<'_> {
    #[inline(always)]
    fn run<V: Vectors>(mut self, vectors: V) {
        let pass = self.pass;
        let b = pass.first_row + self.row as u32;
        let levels = Levels::new(pass.frame, self.tile, b);
        let slopes: Vec<_> = (0..pass.frame.blocks())
            .map(|block| pass.frame.slopes(block))
            .collect();
        let batch = Batch {
            mesh: pass.job.mesh,
            frame: pass.frame,
            tile: self.tile,
            b,
            positions: &pass.job.vertices.positions,
            levels: &levels,
            slopes: &slopes,
        };
        let layout = Layout::new(pass.frame);
        self.workspace.steps.start(layout, self.tile);
        self.rank(vectors, &levels);
        self.count_pairs(vectors, &batch);
        self.count_lone(vectors, &batch);
        self.count_piercings(&batch);
        self.sum(vectors, layout);
    }
}

impl BatchWork<'_> {
    #[inline(always)]
    fn rank<V: Vectors>(&mut self, vectors: V, levels: &Levels) {
        let Frame { v, w, .. } = *self.pass.frame;
        let by_axis = &self.pass.job.vertices.by_axis;
        let ranks = &mut self.workspace.ranks;
        ranks.resize(by_axis[v].len(), 0);
        vectors.ranks(levels, &by_axis[v], &by_axis[w], ranks);
    }

    /// Silhouettes of two triangles that cross a level: two layers more or fewer.
    #[inline(always)]
    fn count_pairs<V: Vectors>(&mut self, vectors: V, batch: &Batch<'_>) {
        for lists in &self.pass.silhouettes.lists {
            let list = &lists[self.row];
            let mut first = 0;
            while first < list.sides.len() {
                self.make_room(vectors, batch, 2);
                let Workspace { edges, ranks, .. } = &mut *self.workspace;
                let (row, next) = Row::new(list, first, ranks);
                vectors.collect(&row, edges);
                first = next;
            }
        }
        self.count_collected(vectors, batch, 2);
    }

    /// Edges of one triangle that cross a level: always a layer more or fewer.
    #[inline(always)]
    fn count_lone<V: Vectors>(&mut self, vectors: V, batch: &Batch<'_>) {
        let (facings, row) = (&self.pass.silhouettes.facings, self.row);
        for some in self.pass.job.mesh.lone_edges().chunks(AT_ONCE) {
            self.make_room(vectors, batch, 1);
            let Workspace { edges, ranks, .. } = &mut *self.workspace;
            for edge in some {
                let side = facings[edge.side.triangle()][row].along(edge.side);
                edges.push(edge.vertices, ranks, Sides::new(side, side));
            }
        }
        self.count_collected(vectors, batch, 1);
    }

    #[inline(always)]
    fn make_room<V: Vectors>(&mut self, vectors: V, batch: &Batch<'_>, unit: i8) {
        if !self.workspace.edges.has_room(AT_ONCE) {
            self.count_collected(vectors, batch, unit);
        }
    }

    #[inline(always)]
    fn count_collected<V: Vectors>(&mut self, vectors: V, batch: &Batch<'_>, unit: i8) {
        let Workspace { edges, steps, .. } = &mut *self.workspace;
        vectors.count(batch, edges, unit, steps);
        edges.n = 0;
    }

    #[inline(always)]
    fn count_piercings(&mut self, batch: &Batch<'_>) {
        let pass = self.pass;
        let Workspace { ranks, steps, .. } = &mut *self.workspace;
        let facing =
            |triangle: u32| -> Facing { pass.silhouettes.facings[triangle as usize][self.row] };
        let corners = |triangle: u32| {
            let vertices = pass.job.mesh.triangles()[triangle as usize];
            vertices.map(|vertex| (vertex, batch.end(vertex, ranks[vertex as usize])))
        };
        pass.piercings
            .count(batch, self.tile, facing, corners, steps);
    }

    /// Adds the batch's texels to the sums of the tile.
    #[inline(always)]
    fn sum<V: Vectors>(&mut self, vectors: V, layout: Layout) {
        let pass = self.pass;
        let b = pass.first_row + self.row as u32;
        let shares: Vec<_> = (0..pass.frame.blocks())
            .map(|block| summation::texels(pass.job.texels, pass.frame, b, block))
            .map(|texels| vectors.shares(&texels))
            .collect();
        self.workspace.sums.of_tile(pass.frame, self.tile);
        // Nobody writes those beyond the row's end.
        let n_masks = (layout.n_u as usize).next_multiple_of(LANES);
        self.workspace.masks.clear();
        self.workspace.masks.resize(n_masks, 0);
        for group in 0..layout.groups(self.tile) {
            let Workspace {
                steps, counters, ..
            } = &mut *self.workspace;
            let first = group << layout.shift;
            let strips = first..(first + (1 << layout.shift)).min(layout.strips(self.tile));
            match steps.take(group, counters) {
                Taken::Nothing => {}
                Taken::Narrow => {
                    for (idx, strip) in strips.enumerate() {
                        let Workspace {
                            counters, masks, ..
                        } = &mut *self.workspace;
                        let counters = &mut counters[idx * layout.strip()..][..layout.strip()];
                        if !summation::is_zero(counters) {
                            if vectors.narrow_masks(counters, masks) {
                                summation::masks(counters, masks);
                            }
                            counters.fill(0);
                            self.add(vectors, strip, &shares);
                        }
                    }
                }
                Taken::Wide(counters) => {
                    for (strip, counters) in strips.zip(counters.chunks_exact(layout.strip())) {
                        summation::masks(counters, &mut self.workspace.masks);
                        self.add(vectors, strip, &shares);
                    }
                }
            }
        }
    }

    /// Adds to the cells of a strip what their masks say.
    #[inline(always)]
    fn add<V: Vectors>(&mut self, vectors: V, strip: usize, shares: &[V::Shares]) {
        let (row, block) = (strip / shares.len(), strip % shares.len());
        let Workspace { masks, sums, .. } = &mut *self.workspace;
        vectors.add(&shares[block], masks, sums.row(row));
        let b = self.pass.first_row + self.row as u32;
        self.pass.keep_bits(self.tile, (row, b, block), masks);
    }
}

/// What a thread needs for itself.
pub(super) struct Workspace {
    ranks: Vec<i32>,
    edges: Edges,
    steps: Steps,
    /// All zero between groups.
    counters: Box<Bytes>,
    masks: Vec<Mask>,
    /// Of the cells of a tile: all zero between tiles.
    pub sums: Sums,
}

impl Default for Workspace {
    fn default() -> Self {
        let counters = vec![0; MOST_PLACES].into_boxed_slice();
        Self {
            ranks: Vec::new(),
            edges: Edges::default(),
            steps: Steps::default(),
            counters: counters.try_into().expect("it has this length"),
            masks: Vec::new(),
            sums: Sums::default(),
        }
    }
}
