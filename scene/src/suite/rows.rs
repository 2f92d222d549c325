//! The rows of the table: what is judged.

use aogrid_bake_core::{BakeOptions, Extent, Placement};
use aogrid_grid_format::{BoundaryMode, Encoding, GridSpec};

use super::Subject;
use crate::error::{Context, Result};
use crate::grids;
use crate::shade::Mode;
use aogrid_bake_core::Observer;
use aogrid_grid_format::Grid;

/// A way to bake a grid and to shade with it.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The name in tables.
    pub name: &'static str,
    encoding: Encoding,
    boundary: BoundaryMode,
    epsilon: f32,
    /// Cells along each axis.
    resolution: u32,
    mode: &'static str,
    /// Whether the grid is moved by half a cell along each axis, so that its cells lie otherwise
    /// towards the object's faces.
    is_shifted: bool,
}

use BoundaryMode::{Jgt, None as Untreated, Rr};
use Encoding::{Cone, Occlusion};

/// The rows: a new one is a line here.
pub const ROWS: [Row; 14] = [
    row("paper", Cone, Jgt, 0.1, 32, "cone"),
    row("paper rr", Cone, Rr, 0.1, 32, "cone"),
    row("paper none", Cone, Untreated, 0.1, 32, "cone"),
    row("paper shifted", Cone, Jgt, 0.1, 32, "cone").shifted(),
    row("paper none shifted", Cone, Untreated, 0.1, 32, "cone").shifted(),
    row("paper 16³", Cone, Jgt, 0.1, 16, "cone"),
    row("paper none 16³", Cone, Untreated, 0.1, 16, "cone"),
    row("paper none 64³", Cone, Untreated, 0.1, 64, "cone"),
    row("ε 0.8 none", Cone, Untreated, 0.8, 32, "cone"),
    row("ε 0.3 jgt", Cone, Jgt, 0.3, 32, "cone"),
    row("paper merged", Cone, Jgt, 0.1, 32, "merge"),
    row("paper none merged", Cone, Untreated, 0.1, 32, "merge"),
    row("occlusion jgt", Occlusion, Jgt, 0.1, 32, "occlusion"),
    row("occlusion none", Occlusion, Untreated, 0.1, 32, "occlusion"),
];

const fn row(
    name: &'static str,
    encoding: Encoding,
    boundary: BoundaryMode,
    epsilon: f32,
    resolution: u32,
    mode: &'static str,
) -> Row {
    Row {
        name,
        encoding,
        boundary,
        epsilon,
        resolution,
        mode,
        is_shifted: false,
    }
}

impl Row {
    const fn shifted(self) -> Self {
        Self {
            is_shifted: true,
            ..self
        }
    }

    /// Returns the mode that shades.
    pub(super) fn mode(&self) -> &'static Mode {
        Mode::named(self.mode).expect("the table names modes that exist")
    }

    /// Bakes the grid of an occluder.
    pub(super) fn bake(&self, subject: &Subject, observer: Observer<'_>) -> Result<Grid> {
        let placement = Placement {
            resolution: [self.resolution; 3],
            extent: Extent::Epsilon(self.epsilon),
        };
        let options = BakeOptions {
            encoding: self.encoding,
            boundary: self.boundary,
            ..BakeOptions::recommended()
        };
        let centered = placement.place(&subject.mesh.bounds())?;
        let spec = match self.is_shifted {
            true => half_a_cell_away(&centered),
            false => centered,
        };
        let source = &subject.source;
        grids::bake(&subject.mesh, source, spec, &placement, &options, observer)
            .with_context(|| format!("{}: {}", subject.name, self.name))
    }
}

/// Returns the same grid half a cell away along each axis.
fn half_a_cell_away(spec: &GridSpec) -> GridSpec {
    let (n, e) = (spec.resolution(), spec.half_extents());
    let center = spec.center();
    let moved = std::array::from_fn(|x| center[x] + e[x] / n[x] as f32);
    GridSpec::new(n, moved, e).expect("a small move leaves the box valid")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_distinct_names_and_known_modes() {
        for (idx, row) in ROWS.iter().enumerate() {
            assert_eq!(row.mode().name, row.mode);
            assert!(
                ROWS[..idx].iter().all(|r| r.name != row.name),
                "{}",
                row.name
            );
        }
    }
}
