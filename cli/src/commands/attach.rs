//! `attach`: a model and its grids as one GLB.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use aogrid_bake_core::glb::{self, Nodes, Occluder};
use aogrid_bake_core::mesh::{LoadedMesh, MeshFile, Pose};
use aogrid_grid_format::Grid;

use crate::console::Console;
use crate::output;

/// Put a model's grids into its GLB file
///
/// A grid goes to the node of the part that it was baked from, and to all nodes with the same mesh; a grid
/// of the whole model goes to the root. The GLB is written as it was, with whole grid files behind its
/// other data and the extension AOGRID_occluder on the nodes; other programs ignore both.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The model, a GLB
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// The grids (*.ao.ktx2); NODE=GRID attaches one in the frame of the node with that name
    #[arg(value_name = "GRID", required = true)]
    grids: Vec<PathBuf>,
    /// The GLB to write
    #[arg(short, long, value_name = "OUT")]
    out: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// The examples at the end of `attach --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid attach robot.glb robot.ao.ktx2 -o robot-ao.glb
  aogrid attach robot.glb parts/robot.arm.ao.ktx2 parts/robot.base.ao.ktx2 -o robot-ao.glb
  aogrid attach robot.glb Hand=hand.ao.ktx2 -o robot-ao.glb";

/// The maximum number of parts that an error names.
const MAX_NAMED: usize = 8;

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let model = Model::read(&args.model)?;
    let is_glb = args
        .out
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    ensure!(is_glb, "{}: its name must end in .glb", args.out.display());
    output::check_not_input(&args.out, &args.model)?;
    output::check_new(&args.out, args.force)?;
    let mut occluders = Vec::new();
    for grid in &args.grids {
        occluders.push(model.occluder(grid, console)?);
    }
    make_unique(&mut occluders);
    let shown = || args.model.display().to_string();
    let bytes = glb::attach(&model.bytes, &model.nodes, &occluders).with_context(shown)?;
    output::write(&args.out, &bytes)?;
    let nodes: usize = occluders.iter().map(|grid| grid.nodes.len().max(1)).sum();
    console.note(&format!(
        "wrote {}: {} on {}",
        args.out.display(),
        counted(occluders.len(), "grid"),
        counted(nodes, "node")
    ));
    Ok(())
}

/// Returns a number of things in words.
fn counted(count: usize, thing: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {thing}{plural}")
}

/// Gives grids whose files have the same name in different folders different names.
fn make_unique(occluders: &mut [Occluder]) {
    let mut taken = HashSet::new();
    for occluder in occluders {
        let name = occluder.uri.clone();
        let mut number = 1;
        while !taken.insert(occluder.uri.clone()) {
            number += 1;
            occluder.uri = format!("{number}-{name}");
        }
    }
}

/// A model with its nodes.
struct Model {
    bytes: Vec<u8>,
    loaded: LoadedMesh,
    nodes: Nodes,
}

impl Model {
    fn read(path: &Path) -> anyhow::Result<Self> {
        let shown = || path.display().to_string();
        let file = MeshFile::read(path).with_context(shown)?;
        let loaded = file.parse().with_context(shown)?;
        let bytes = fs::read(path).with_context(shown)?;
        let nodes = Nodes::new(&bytes, &loaded).with_context(shown)?;
        Ok(Self {
            bytes,
            loaded,
            nodes,
        })
    }

    /// Reads a grid and finds its nodes.
    fn occluder(&self, argument: &Path, console: &Console) -> anyhow::Result<Occluder> {
        let (node, path) = split(argument);
        let shown = || path.display().to_string();
        let bytes = fs::read(path).with_context(shown)?;
        let grid = Grid::from_bytes(&bytes).with_context(shown)?;
        let nodes = match node {
            Some(name) => self.named(name).with_context(shown)?,
            None => {
                let hash = blake3::hash(&bytes).to_hex();
                let nodes = self.recorded(&grid, &hash).with_context(shown)?;
                self.warn_of_other_model(&grid, path, console);
                nodes
            }
        };
        let name = path.file_name().unwrap_or_default();
        Ok(Occluder {
            uri: name.to_string_lossy().into_owned(),
            bytes,
            nodes,
        })
    }

    /// Returns the node with a name that the user gives.
    fn named(&self, name: &str) -> anyhow::Result<Vec<(usize, Pose)>> {
        match self.nodes.named(name)[..] {
            [node] => Ok(vec![(node, Pose::IDENTITY)]),
            [] => bail!("the model has no node `{name}`: {}", self.names()),
            [..] => bail!("the model has several nodes `{name}`: rename them"),
        }
    }

    /// Returns the nodes that a grid belongs to by what it, or the model, records.
    fn recorded(&self, grid: &Grid, hash: &str) -> anyhow::Result<Vec<(usize, Pose)>> {
        let marked = self.nodes.with_hash(hash);
        if !marked.is_empty() {
            return Ok(marked);
        }
        let Some(part) = &grid.record().source.part else {
            return Ok(self.nodes.only_root()?.into_iter().collect());
        };
        let nodes = self.nodes.of_part(part)?;
        ensure!(
            !nodes.is_empty(),
            "the model has no part `{part}`, which the grid was baked from; name its node, \
             NODE=GRID: {}",
            self.names()
        );
        Ok(nodes)
    }

    /// Returns the model's parts for an error.
    fn names(&self) -> String {
        let names: Vec<_> = self.nodes.parts().map(|name| format!("`{name}`")).collect();
        let shown = names[..names.len().min(MAX_NAMED)].join(", ");
        match names.len().saturating_sub(MAX_NAMED) {
            0 => format!("its parts are {shown}"),
            more => format!("its parts are {shown} and {more} more"),
        }
    }

    fn warn_of_other_model(&self, grid: &Grid, path: &Path, console: &Console) {
        let source = &grid.record().source;
        let has_mark = glb::attached(&self.bytes).is_ok_and(|grids| !grids.is_empty());
        if source.blake3 != self.loaded.blake3 && !has_mark {
            console.warning(&format!(
                "{}: it was baked from {}, which is another file than {} or has changed since: bake \
                 it again if its shape has changed",
                path.display(),
                source.name,
                self.loaded.name
            ));
        }
    }
}

/// Splits NODE=GRID, unless it is the name of a file.
fn split(argument: &Path) -> (Option<&str>, &Path) {
    let text = argument.to_str().filter(|_| !argument.exists());
    match text.and_then(|text| text.split_once('=')) {
        Some((node, path)) => (Some(node), Path::new(OsStr::new(path))),
        None => (None, argument),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_told_from_files() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a=b");
        assert_eq!(
            split(&file).0,
            Some(&*folder.path().join("a").to_string_lossy())
        );
        fs::write(&file, "").unwrap();
        assert_eq!(split(&file), (None, &*file));
        assert_eq!(
            split(Path::new("Arm=x/a.ktx2")),
            (Some("Arm"), Path::new("x/a.ktx2"))
        );
        assert_eq!(split(Path::new("a.ktx2")), (None, Path::new("a.ktx2")));
    }

    #[test]
    fn files_of_one_name_get_different_ones() {
        let occluder = |uri: &str| Occluder {
            uri: uri.into(),
            bytes: vec![],
            nodes: vec![],
        };
        let mut all = ["a", "b", "a", "2-a", "a"].map(occluder);
        make_unique(&mut all);
        let names = all.map(|occluder| occluder.uri);
        assert_eq!(names, ["a", "b", "2-a", "2-2-a", "3-a"]);
    }
}
