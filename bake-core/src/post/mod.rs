//! Post-processing of moments to a grid: interior fill, then the near-surface fit or the boundary
//! treatment, then encoding. All bakers share it; it runs once, on the CPU.

mod boundary;
mod interior;

use aogrid_grid_format::{BakeRecord, EncodeError, Encoding, Grid, Interior, Source};

use crate::fit::{self, NearSurface};
use crate::{BakeOptions, Classification, Extent, Moments, Placement, RawGrid};

/// The reason that moments cannot become a grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PostError {
    /// Every cell is interior, so that there is none to fill the others from.
    #[error(
        "every cell is inside the object: the grid's box with half-extents {0:?} is too small, \
         enlarge it"
    )]
    AllInterior([f32; 3]),
    /// A boundary cell is fully occluded, so that rescaling would divide by zero.
    #[error(
        "a cell at the grid's boundary is fully occluded (V_M = 1), so no boundary treatment can \
         fade it out: enlarge the box, fill the interior, or bake with boundary `none`"
    )]
    BoundaryOccluded,
    /// A value of the result is out of range.
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

/// The results of further bakes, which refine a grid.
#[derive(Clone, Debug, Default)]
pub struct Refinements<'a> {
    /// The points that cells near the surface are fitted to; `None` leaves the cells as baked.
    pub near: Option<NearSurface<'a>>,
    /// The object's flatness (see [`BakeRecord::flatness`]); zero for the far field of a sphere.
    pub flatness: [f32; 4],
}

/// Post-processes and encodes the grid that a baker made with `options` at `placement` from
/// `source`.
///
/// # Errors
///
/// Every cell is inside the object, or a fully occluded cell at the boundary cannot be faded out.
pub fn finish(
    mut raw: RawGrid,
    refinements: &Refinements<'_>,
    placement: &Placement,
    options: &BakeOptions,
    source: Source,
) -> Result<Grid, PostError> {
    let classification = Classification::of(&raw);
    if options.interior != Interior::Keep {
        interior::fill(&mut raw, &classification)?;
    }
    let boundary = boundary::treat(&mut raw, options.boundary)?;
    let cells: Vec<[f32; 4]> = match &refinements.near {
        Some(near) => fit::fit(&raw, &classification, near),
        None => raw
            .moments
            .iter()
            .map(|cell| values(cell, options.encoding))
            .collect(),
    };
    let record = BakeRecord {
        epsilon: match placement.extent {
            Extent::Epsilon(epsilon) => Some(epsilon),
            Extent::HalfExtents(_) => None,
        },
        sample_offset: options.sample_offset,
        sampling: options.sampling,
        max_distance: options.max_distance,
        interior: options.interior,
        interior_cells: classification.interior_cells() as u64,
        inside: classification.inside(),
        boundary,
        snap: placement.snap && matches!(placement.extent, Extent::Epsilon(_)),
        fit: refinements.near.is_some(),
        self_offset: options.self_offset_for(classification.inside().as_ref()),
        flatness: refinements.flatness,
        check: None,
        without: vec![],
        source,
    };
    Ok(Grid::encode(
        raw.spec,
        options.encoding,
        options.format,
        &cells,
        record,
    )?)
}

/// Returns the values of a cell that an encoding takes.
fn values(cell: &Moments, encoding: Encoding) -> [f32; 4] {
    let [x, y, z] = match encoding {
        Encoding::Moment => cell.normalized_moment(),
        Encoding::Cone | Encoding::Occlusion => cell.axis(),
    };
    [x, y, z, cell.a]
}
