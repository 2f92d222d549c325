//! `detach`: the grids of a GLB as files.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, bail};
use aogrid_bake_core::glb::{self, AttachedGrid};
use aogrid_grid_format::Grid;

use crate::console::Console;
use crate::output;

/// Write the grids in a GLB file as files of their own
///
/// They are the files that `attach` has put there, byte for byte. A line for each node tells its grid's
/// file.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The GLB with grids
    #[arg(value_name = "GLB")]
    file: PathBuf,
    /// The folder to write the grids into
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// The examples at the end of `detach --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid detach robot-ao.glb -o grids
  aogrid detach robot-ao.glb -o grids --force";

/// The ending of grid files.
const ENDING: &str = ".ao.ktx2";

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let shown = || args.file.display().to_string();
    let bytes = fs::read(&args.file).with_context(shown)?;
    let nodes = glb::attached(&bytes).with_context(shown)?;
    let files = files(&nodes).with_context(shown)?;
    for file in &files {
        let grid = Grid::from_bytes(file.bytes);
        grid.with_context(|| format!("{}: the grid of node {}", shown(), file.node.node))?;
        if file
            .node
            .blake3
            .as_deref()
            .is_some_and(|hash| *hash != *blake3::hash(file.bytes).to_hex())
        {
            console.warning(&format!(
                "{}: the grid of node {} is another than its extras name",
                shown(),
                file.node.node
            ));
        }
    }
    fs::create_dir_all(&args.out)
        .with_context(|| format!("{}: cannot create it", args.out.display()))?;
    for file in &files {
        output::check_new(&args.out.join(&file.name), args.force)?;
    }
    for file in &files {
        output::write(&args.out.join(&file.name), file.bytes)?;
    }
    for (node, file) in of_nodes(&nodes, &files) {
        let name = node.name.clone();
        let name = name.unwrap_or_else(|| format!("node {}", node.node));
        console.result(&format!("{name}: {}", args.out.join(&file.name).display()));
    }
    Ok(())
}

/// A grid file to write.
struct File<'a> {
    name: String,
    view: usize,
    bytes: &'a [u8],
    /// The first node that has it.
    node: &'a AttachedGrid,
}

/// Returns the files in a GLB, each once.
fn files(nodes: &[AttachedGrid]) -> anyhow::Result<Vec<File<'_>>> {
    let mut seen = HashSet::new();
    let mut names = HashSet::new();
    let mut files = Vec::new();
    for node in nodes {
        let Some((view, bytes)) = &node.file else {
            continue;
        };
        if !seen.insert(*view) {
            continue;
        }
        let wanted = file_name(node);
        let mut name = wanted.clone();
        let mut number = 1;
        while !names.insert(name.clone()) {
            number += 1;
            name = format!("{number}-{wanted}");
        }
        files.push(File {
            name,
            view: *view,
            bytes,
            node,
        });
    }
    if files.is_empty() {
        let mut lost: Vec<_> = nodes.iter().filter_map(|node| node.uri.clone()).collect();
        lost.dedup();
        match lost.is_empty() {
            true => bail!("it has no grids: `attach` puts them there"),
            false => bail!(
                "a program has dropped its grids, {}: attach these files again",
                lost.join(", ")
            ),
        }
    }
    Ok(files)
}

/// Returns each node that has a grid, with its file.
fn of_nodes<'a>(
    nodes: &'a [AttachedGrid],
    files: &'a [File<'_>],
) -> impl Iterator<Item = (&'a AttachedGrid, &'a File<'a>)> {
    let by_view: HashMap<usize, &File<'_>> = files.iter().map(|file| (file.view, file)).collect();
    nodes.iter().filter_map(move |node| {
        let (view, _) = node.file.as_ref()?;
        Some((node, by_view[view]))
    })
}

/// Returns the name of a grid's file: that in the node's extras, if it is a plain name.
fn file_name(node: &AttachedGrid) -> String {
    let uri = node.uri.as_deref().unwrap_or_default();
    let mut components = Path::new(uri).components();
    let is_plain = matches!(components.next(), Some(Component::Normal(_)))
        && components.next().is_none()
        && uri.ends_with(ENDING)
        && !uri.contains(['/', '\\', ':'])
        && !uri.contains(char::is_control);
    match is_plain {
        true => uri.to_owned(),
        false => format!("node-{}{ENDING}", node.node),
    }
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::mesh::Pose;

    use super::*;

    fn node(node: usize, uri: &str, view: Option<usize>) -> AttachedGrid {
        AttachedGrid {
            node,
            name: None,
            uri: Some(uri.into()),
            blake3: None,
            file: view.map(|view| (view, vec![])),
            pose: Pose::IDENTITY,
        }
    }

    #[test]
    fn names_lead_out_of_no_folder() {
        let name = |uri: &str| file_name(&node(3, uri, Some(0)));
        assert_eq!(name("arm.ao.ktx2"), "arm.ao.ktx2");
        for uri in [
            "../arm.ao.ktx2",
            "/arm.ao.ktx2",
            "a\\b.ao.ktx2",
            "c:x.ao.ktx2",
            "",
            "..",
            "x",
        ] {
            assert_eq!(name(uri), "node-3.ao.ktx2");
        }
    }

    #[test]
    fn each_file_is_written_once() {
        let uri = "a.ao.ktx2";
        let nodes = [
            node(0, uri, Some(5)),
            node(1, uri, Some(5)),
            node(2, uri, Some(6)),
        ];
        let files = files(&nodes).unwrap();
        let names: Vec<_> = files.iter().map(|file| file.name.as_str()).collect();
        assert_eq!(names, ["a.ao.ktx2", "2-a.ao.ktx2"]);
        let of_nodes: Vec<_> = of_nodes(&nodes, &files)
            .map(|(_, file)| file.view)
            .collect();
        assert_eq!(of_nodes, [5, 5, 6]);
    }

    #[test]
    fn grids_that_were_dropped_are_named() {
        let error = files(&[node(0, "a.ao.ktx2", None)])
            .err()
            .unwrap()
            .to_string();
        assert!(
            error.contains("a.ao.ktx2") && error.contains("attach"),
            "{error}"
        );
        let error = files(&[]).err().unwrap().to_string();
        assert!(error.contains("no grids"), "{error}");
    }
}
