//! The classes of a grid's cells: inside the object or outside.

use aogrid_grid_format::Inside;
use rayon::prelude::*;

use crate::RawGrid;
use crate::layers::CellClass;

/// The classes of a grid's cells: interior or exterior, and in doubt or not.
#[derive(Clone, Debug, PartialEq)]
pub struct Classification {
    classes: Vec<CellClass>,
    /// Whether the mesh is open, so that its layers were counted.
    is_open: bool,
}

impl Classification {
    /// Classifies every cell. Cells whose every direction is occluded are interior, and so are
    /// those that the grid's signed layers, if it has them, show to be inside.
    pub fn of(raw: &RawGrid) -> Self {
        Self {
            classes: (0..raw.counts.len())
                .into_par_iter()
                .map(|idx| class_of(raw, idx))
                .collect(),
            is_open: raw.layers.is_some(),
        }
    }

    /// Returns the class of each cell, x fastest.
    pub fn classes(&self) -> &[CellClass] {
        &self.classes
    }

    /// Returns the number of interior cells.
    pub fn interior_cells(&self) -> usize {
        self.count(|class| class.is_interior)
    }

    /// Returns the certainty of the classification; `None` for a mesh whose layers were not
    /// counted.
    pub fn inside(&self) -> Option<Inside> {
        let doubtful = self.count(|class| class.is_doubtful);
        let either = self.count(|class| class.is_doubtful || class.is_interior);
        self.is_open.then(|| Inside {
            doubtful_cells: doubtful as u64,
            doubt: doubtful as f32 / either.max(1) as f32,
            inward_cells: self.count(|class| class.is_inward) as u64,
        })
    }

    fn count(&self, predicate: impl Fn(&CellClass) -> bool) -> usize {
        self.classes.iter().filter(|class| predicate(class)).count()
    }
}

/// Returns the class of the cell at `idx`, see [`Classification::of`].
pub(crate) fn class_of(raw: &RawGrid, idx: usize) -> CellClass {
    let is_enclosed = raw.is_enclosed(idx);
    match &raw.layers {
        Some(layers) => layers.class(raw.spec.cell_at(idx), is_enclosed),
        None => CellClass {
            is_interior: is_enclosed,
            ..CellClass::default()
        },
    }
}
