//! The rows of the table: what is judged.

use aogrid_bake_core::{BakeOptions, Extent, Placement, Preset};
use aogrid_grid_format::{BoundaryMode, Encoding, GridSpec, Interior, TexelFormat};

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
    preset: Preset,
    /// Changes the preset's placement and options.
    change: fn(&mut Placement, &mut BakeOptions),
    mode: &'static str,
    /// Whether the grid is moved by half a cell along each axis, so that its cells lie otherwise
    /// towards the object's faces.
    is_shifted: bool,
}

/// The rows: a new one is a line here. The steps from the papers to the default come first.
pub const ROWS: [Row; 24] = [
    row(Preset::Paper, "paper", "cone", |_, _| {}),
    row(Preset::Paper, "paper none", "cone", |_, o| {
        o.boundary = BoundaryMode::None;
    }),
    row(Preset::Paper, "+ signed interior", "cone", |_, o| {
        o.boundary = BoundaryMode::None;
        o.interior = Interior::Signed;
    }),
    row(Preset::Default, "+ ε 0.8", "cone", |p, o| {
        p.snap = false;
        o.fit = false;
        o.encoding = Encoding::Cone;
    }),
    row(Preset::Default, "+ moments", "cone", |p, o| {
        p.snap = false;
        o.fit = false;
    }),
    row(Preset::Default, "+ snap", "cone", |_, o| o.fit = false),
    row(Preset::Default, "default", "cone", |_, _| {}),
    row(Preset::Default, "default merged", "merge", |_, _| {}),
    row(Preset::Default, "default mean", "mean", |_, _| {}),
    row(Preset::Default, "default shifted", "cone", |p, _| {
        p.snap = false;
    })
    .shifted(),
    row(Preset::Default, "default f16", "cone", |_, o| {
        o.format = TexelFormat::F16;
    }),
    row(Preset::Economy, "economy", "cone", |_, _| {}),
    row(Preset::Fine, "fine", "cone", |_, _| {}),
    row(Preset::Paper, "paper rr", "cone", |_, o| {
        o.boundary = BoundaryMode::Rr;
    }),
    row(Preset::Paper, "paper merged", "merge", |_, _| {}),
    row(Preset::Paper, "paper shifted", "cone", |_, _| {}).shifted(),
    row(Preset::Paper, "paper 16³", "cone", |p, _| {
        p.resolution = [16; 3];
    }),
    row(Preset::Paper, "ε 0.3 jgt", "cone", |p, _| {
        p.extent = Extent::Epsilon(0.3);
    }),
    row(Preset::Paper, "paper none 64³", "cone", |p, o| {
        p.resolution = [64; 3];
        o.boundary = BoundaryMode::None;
    }),
    row(Preset::Paper, "paper none shifted", "cone", |_, o| {
        o.boundary = BoundaryMode::None;
    })
    .shifted(),
    row(Preset::Paper, "paper none 16³", "cone", |p, o| {
        p.resolution = [16; 3];
        o.boundary = BoundaryMode::None;
    }),
    row(Preset::Paper, "paper none merged", "merge", |_, o| {
        o.boundary = BoundaryMode::None;
    }),
    row(Preset::Paper, "occlusion jgt", "occlusion", |_, o| {
        o.encoding = Encoding::Occlusion;
    }),
    row(Preset::Paper, "occlusion none", "occlusion", |_, o| {
        o.encoding = Encoding::Occlusion;
        o.boundary = BoundaryMode::None;
    }),
];

const fn row(
    preset: Preset,
    name: &'static str,
    mode: &'static str,
    change: fn(&mut Placement, &mut BakeOptions),
) -> Row {
    Row {
        name,
        preset,
        change,
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
        let (mut placement, mut options) = (self.preset.placement(), self.preset.options());
        (self.change)(&mut placement, &mut options);
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
    GridSpec::new(n, moved, e)
        .and_then(|moved| moved.with_origin(spec.origin()))
        .expect("a small move leaves the box valid")
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
