//! `info`: a description of a grid or a model.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use aogrid_bake_core::mesh::{self, MeshReport};
use aogrid_grid_format::{BakeRecord, Check, Grid, GridSpec, Interior};
use serde::Serialize;

use crate::console::Console;

/// Describe a grid file and how it was baked, or a model
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// A grid (*.ao.ktx2) or a model (*.obj, *.glb, *.gltf, *.stl, *.ply)
    file: PathBuf,
    /// Report as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// The examples at the end of `info --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid info table.ao.ktx2
  aogrid info assets/table.obj
  aogrid info table.ao.ktx2 --json";

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let path = &args.file;
    let is_grid = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("ktx2"));
    if !is_grid {
        let loaded = mesh::load(path).with_context(|| path.display().to_string())?;
        for warning in &loaded.warnings {
            console.warning(&format!("{}: {warning}", path.display()));
        }
        let report = MeshReport::new(&loaded.mesh);
        if args.json {
            return console.json(&MeshJson::new(&report));
        }
        mesh_lines(&report)
            .iter()
            .for_each(|line| console.result(line));
        return Ok(());
    }
    let grid = read_grid(path)?;
    if args.json {
        return console.json(&GridJson::new(&grid));
    }
    grid_lines(&grid)
        .iter()
        .for_each(|line| console.result(line));
    Ok(())
}

/// Reads a grid file; errors name the file.
pub(crate) fn read_grid(path: &Path) -> anyhow::Result<Grid> {
    let shown = || path.display().to_string();
    // Reading from a device or pipe might never end.
    let metadata = fs::metadata(path).with_context(shown)?;
    anyhow::ensure!(metadata.is_file(), "{}: it is not a regular file", shown());
    let bytes = fs::read(path).with_context(shown)?;
    Grid::from_bytes(&bytes).with_context(shown)
}

/// A mesh report as JSON.
#[derive(Serialize)]
pub(crate) struct MeshJson {
    triangles: usize,
    parts: usize,
    min: [f32; 3],
    max: [f32; 3],
    degenerate: usize,
    duplicate: usize,
    boundary_edges: usize,
    non_manifold_edges: usize,
    closed: bool,
}

impl MeshJson {
    pub(crate) fn new(report: &MeshReport) -> Self {
        Self {
            triangles: report.triangles,
            parts: report.parts,
            min: report.bounds.min,
            max: report.bounds.max,
            degenerate: report.degenerate,
            duplicate: report.duplicate,
            boundary_edges: report.boundary_edges,
            non_manifold_edges: report.non_manifold_edges,
            closed: report.is_closed(),
        }
    }
}

/// A grid's resolution and box as JSON.
#[derive(Serialize)]
pub(crate) struct BoxJson {
    resolution: [u32; 3],
    center: [f32; 3],
    half_extents: [f32; 3],
    /// The point that the center is relative to; left out if it is zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<[f64; 3]>,
}

impl BoxJson {
    pub(crate) fn new(spec: &GridSpec) -> Self {
        Self {
            resolution: spec.resolution(),
            center: spec.center(),
            half_extents: spec.half_extents(),
            origin: origin(spec),
        }
    }
}

/// Returns the origin of a grid that is not at zero.
fn origin(spec: &GridSpec) -> Option<[f64; 3]> {
    Some(spec.origin()).filter(|origin| *origin != [0.0; 3])
}

/// A grid file's metadata as JSON.
#[derive(Serialize)]
pub(crate) struct GridJson {
    #[serde(flatten)]
    spec: BoxJson,
    encoding: &'static str,
    format: &'static str,
    writer: String,
    texel_bytes: usize,
    mean: f64,
    largest: f32,
    bake: BakeRecord,
}

impl GridJson {
    pub(crate) fn new(grid: &Grid) -> Self {
        Self {
            spec: BoxJson::new(grid.spec()),
            encoding: grid.encoding().name(),
            format: grid.format().name(),
            writer: grid.writer().to_owned(),
            texel_bytes: grid.texel_bytes(),
            mean: grid.statistics().mean,
            largest: grid.statistics().largest,
            bake: grid.record().clone(),
        }
    }
}

fn grid_lines(grid: &Grid) -> Vec<String> {
    let record = grid.record();
    let [ox, oy, oz] = record.sample_offset;
    let [fx, fy, fz, f] = record.flatness;
    let max_distance = record
        .max_distance
        .map_or("unlimited".into(), |distance| distance.to_string());
    let epsilon = match record.epsilon {
        Some(epsilon) if record.snap => format!("epsilon {epsilon}, snapped to the bounding box"),
        Some(epsilon) => format!("epsilon {epsilon}"),
        None => "given half-extents".into(),
    };
    let boundary = record.boundary;
    let statistics = grid.statistics();
    vec![
        format!("grid       {}", box_line(grid.spec())),
        format!("placed by  {epsilon}"),
        format!(
            "encoding   {}, {}",
            grid.encoding().name(),
            grid.format().name()
        ),
        format!(
            "occlusion  mean {:.5}, largest {:.5}",
            statistics.mean, statistics.largest
        ),
        format!(
            "sampled    {:?}, offset {ox},{oy},{oz} cells",
            record.sampling
        ),
        format!("distance   {max_distance}"),
        format!("interior   {}", interior_line(record)),
        format!(
            "boundary   {:?} (asked for: {:?}), V_M {:.5}",
            boundary.applied, boundary.requested, boundary.v_m
        ),
        format!(
            "surface    {}, looked up {} cells along normals by the object itself",
            if record.fit {
                "cells fitted"
            } else {
                "cells as baked"
            },
            record.self_offset
        ),
        format!("far field  flatness {f} + {fx} x² + {fy} y² + {fz} z² (0 a sphere, 1 a disc)"),
        format!("source     {}", source_line(record)),
        match &record.check {
            Some(check) => format!("checked    {}", check_line(check)),
            None => "checked    no: bake it with --check".into(),
        },
        format!("hash       {}", record.source.blake3),
        format!("writer     {}", grid.writer()),
    ]
}

/// Describes what was baked in one line.
fn source_line(record: &BakeRecord) -> String {
    let source = &record.source;
    let mut line = source.name.clone();
    if let Some(part) = &source.part {
        line += &format!(", part `{part}`");
    }
    if !record.without.is_empty() {
        line += &format!(", without `{}`", record.without.join("`, `"));
    }
    format!("{line}, {} triangles", source.triangles)
}

/// Describes the measured error in one line.
pub(crate) fn check_line(check: &Check) -> String {
    let areas = [
        ("near contact", check.near),
        ("tilted", check.tilted),
        ("any way", check.any_way),
        ("rest", check.rest),
        ("beyond", check.beyond),
        ("itself", check.itself),
    ];
    let described = areas.into_iter().filter_map(|(name, error)| {
        error.map(|error| format!("{name} {:.3} ({:.3})", error.rmse, error.p95))
    });
    let described: Vec<String> = described.collect();
    format!("RMSE (p95) of AO: {}", described.join(", "))
}

/// Describes the cells inside a model in one line.
pub(crate) fn interior_line(record: &BakeRecord) -> String {
    let cells = record.interior_cells;
    let mut line = match record.interior {
        Interior::Signed => format!("{cells} interior cells filled"),
        Interior::Enclosed => format!("{cells} enclosed cells filled"),
        Interior::Keep => format!("{cells} enclosed cells kept"),
    };
    if let Some(inside) = &record.inside {
        if inside.doubtful_cells > 0 {
            let (cells, doubt) = (inside.doubtful_cells, inside.doubt);
            line += &format!(", {cells} in doubt (doubt {doubt:.2})");
        }
        if inside.inward_cells > 0 {
            line += &format!(", {} see faces that point inward", inside.inward_cells);
        }
    }
    line
}

/// Describes a grid's resolution and box in one line.
pub(crate) fn box_line(spec: &GridSpec) -> String {
    let [nx, ny, nz] = spec.resolution();
    let (center, half_extents) = (triple(spec.center()), triple(spec.half_extents()));
    let relative = origin(spec).map_or(String::new(), |[x, y, z]| {
        format!(" relative to ({x}, {y}, {z})")
    });
    format!("{nx}×{ny}×{nz} cells, center ({center}){relative}, half-extents ({half_extents})")
}

/// Formats three coordinates with about five significant digits whatever the model's unit.
pub(crate) fn triple(v: [f32; 3]) -> String {
    let size = v.into_iter().fold(0.0, |size: f32, v| size.max(v.abs()));
    let number = |v: f32| match size == 0.0 || (1e-2..1e6).contains(&size) {
        true => format!("{v:.4}"),
        false => format!("{v:.4e}"),
    };
    v.map(number).join(", ")
}

/// Describes a mesh in one line.
pub(crate) fn mesh_line(report: &MeshReport) -> String {
    let mut facts = vec![
        counted(report.triangles, "triangle"),
        counted(report.parts, "part"),
    ];
    facts.push(
        if report.is_closed() {
            "closed"
        } else {
            "not closed"
        }
        .into(),
    );
    let flaws = [
        (report.boundary_edges, "boundary edge"),
        (report.non_manifold_edges, "non-manifold edge"),
        (report.degenerate, "degenerate triangle"),
        (report.duplicate, "duplicate triangle"),
    ];
    facts.extend(
        flaws
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|&(n, what)| counted(n, what)),
    );
    facts.join(", ")
}

/// Formats a count with its noun.
fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

fn mesh_lines(report: &MeshReport) -> Vec<String> {
    let ([ax, ay, az], [bx, by, bz]) = (report.bounds.min, report.bounds.max);
    vec![
        format!("triangles   {}", report.triangles),
        format!("parts       {}", report.parts),
        format!("box         ({ax}, {ay}, {az}) to ({bx}, {by}, {bz})"),
        format!("degenerate  {} triangles without area", report.degenerate),
        format!("duplicate   {} triangles", report.duplicate),
        format!(
            "edges       {} boundary, {} non-manifold: {}",
            report.boundary_edges,
            report.non_manifold_edges,
            if report.is_closed() {
                "closed"
            } else {
                "not closed"
            }
        ),
    ]
}
