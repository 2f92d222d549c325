//! Crossings: the rows that edges cross, and the first cells that they affect.

use aogrid_bake_core::sweep::LANES;

use crate::sweep::data::{
    Batch, DeltaBuffer, EdgeBuffer, LaneDeltas, Line, SilhouetteChunk, first_columns, row_side,
};

/// Appends the silhouettes of a chunk that cross a level. The caller has reserved space.
#[inline(always)]
pub(in crate::sweep) fn collect(chunk: &SilhouetteChunk<'_>, edges: &mut EdgeBuffer) {
    for (&vertices, &facing) in chunk.vertices.iter().zip(chunk.facings) {
        edges.push(vertices, chunk.ranks, facing);
    }
}

/// Counts each edge at every row that it crosses, `unit` for each layer. The SIMD versions are
/// tested against this one.
#[inline(always)]
pub(in crate::sweep) fn count(
    batch: &Batch<'_>,
    edges: &EdgeBuffer,
    unit: i8,
    deltas: &mut DeltaBuffer,
) {
    let n_u = deltas.layout.n_u as f32;
    let rounding = batch.rounding();
    for n in 0..edges.n {
        let [from, to] = [edges.ranks[0][n], edges.ranks[1][n]];
        let ends = [
            batch.end(edges.vertices[0][n], from),
            batch.end(edges.vertices[1][n], to),
        ];
        let facings = edges.facings[n].intervals();
        let line = Line::new(ends[0], ends[1], batch.levels);
        let column_error = line.column_error(rounding);
        for (block, slopes) in batch.slopes.iter().enumerate() {
            let lanes = LaneDeltas::new(facings, from < to, batch.frame, block);
            if lanes.active == 0 {
                continue;
            }
            for level in batch.levels.between(from.min(to), from.max(to)) {
                let [u, height] = line.at(&level);
                let mut columns = first_columns(u - column_error, height, slopes, n_u);
                // Double precision decides if rounding could move the column.
                let last = first_columns(u + column_error, height, slopes, n_u);
                if columns != last {
                    let vertices = [edges.vertices[0][n], edges.vertices[1][n]];
                    for (lane, column) in columns.iter_mut().enumerate() {
                        if *column != last[lane] {
                            let z = (block * LANES + lane) as u32;
                            *column = batch.exact_column(vertices, level.row, z);
                        }
                    }
                }
                let at = (level.row, block as u32);
                deltas.push(at, row_side(height), &columns, lanes, unit);
            }
        }
    }
}
