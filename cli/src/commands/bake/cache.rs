//! Grids that were baked before, by what they were baked from: a folder that runs and machines share.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use aogrid_bake_core::mesh::MeshFile;
use aogrid_bake_core::{ALGORITHM_VERSION, BakeOptions, Placement};
use aogrid_grid_format::Grid;

use super::Args;
use super::jobs::Job;
use crate::output;

/// The first line of an entry. Then come the hash of the rest, the warnings as JSON, each in a line,
/// and the grid's file.
const HEADING: &[u8] = b"aogrid cache 1\n";

/// A folder of baked grids.
pub(super) struct Cache {
    folder: PathBuf,
    /// The hash of all that the grids of one command have in common.
    recipe: blake3::Hasher,
    /// Whether entries are used, and not only written.
    is_read: bool,
}

/// A grid from the cache.
pub(super) struct Entry {
    pub grid: Grid,
    /// The file of the grid, byte for byte.
    pub bytes: Vec<u8>,
    /// The warnings of its bake.
    pub warnings: Vec<String>,
}

impl Cache {
    /// Opens the folder, and makes it if there is none.
    pub(super) fn open(
        folder: &Path,
        args: &Args,
        placement: &Placement,
        options: &BakeOptions,
    ) -> anyhow::Result<Self> {
        fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot create the cache", folder.display()))?;
        let shared = &args.shared;
        let mut recipe = blake3::Hasher::new();
        // Sweep and rays, CPU and GPU differ in ties, so that a request for one is not served by
        // the other.
        let of_options = format!(
            "{ALGORITHM_VERSION} {} {placement:?} {options:?} {:?} {:?} {} {:?} {:?} {:?}",
            Grid::current_writer(),
            shared.algorithm(),
            shared.backend,
            args.check,
            args.max_error,
            args.max_bytes,
            args.without,
        );
        recipe.update(of_options.as_bytes());
        Ok(Self {
            folder: folder.to_owned(),
            recipe,
            is_read: !args.force,
        })
    }

    /// Returns the path of a job's entry, which depends on all that the grid does.
    pub(super) fn path(&self, job: &Job, file: &MeshFile) -> PathBuf {
        let mut hasher = self.recipe.clone();
        let of_job = (file.name(), file.blake3(), job.part, &job.part_name);
        hasher.update(format!("{of_job:?}").as_bytes());
        let name = hasher.finalize().to_hex();
        // Folders of ten thousands of files are slow on network drives.
        self.folder.join(&name[..2]).join(&name[2..])
    }

    /// Returns an entry, if there is one and it is whole.
    pub(super) fn get(&self, path: &Path) -> Option<Entry> {
        let bytes = self.is_read.then(|| fs::read(path).ok())??;
        unpacked(&bytes)
    }

    /// Writes an entry.
    pub(super) fn put(&self, path: &Path, grid: &[u8], warnings: &[String]) -> anyhow::Result<()> {
        let folder = path.parent().unwrap_or(&self.folder);
        fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot create it", folder.display()))?;
        output::write(path, &packed(grid, warnings)?)
    }
}

fn packed(grid: &[u8], warnings: &[String]) -> anyhow::Result<Vec<u8>> {
    let mut rest = serde_json::to_vec(warnings)?;
    rest.push(b'\n');
    rest.extend(grid);
    let hash = blake3::hash(&rest).to_hex();
    Ok([HEADING, hash.as_bytes(), b"\n", &rest].concat())
}

fn unpacked(bytes: &[u8]) -> Option<Entry> {
    let (hash, rest) = line(bytes.strip_prefix(HEADING)?)?;
    if blake3::hash(rest).to_hex().as_bytes() != hash {
        return None;
    }
    let (warnings, bytes) = line(rest)?;
    Some(Entry {
        grid: Grid::from_bytes(bytes).ok()?,
        bytes: bytes.to_vec(),
        warnings: serde_json::from_slice(warnings).ok()?,
    })
}

/// Returns the first line, and what follows.
fn line(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    Some((&bytes[..end], &bytes[end + 1..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use aogrid_bake_core::models::Model;
    use aogrid_bake_core::{Preset, UNOBSERVED};
    use aogrid_grid_format::Source;

    /// Every entry that is cut off or differs in a byte is none.
    #[test]
    fn broken_entries_are_none() {
        let mesh = Model::Box.mesh(None).unwrap();
        let placement = Placement {
            resolution: [8; 3],
            ..Placement::paper()
        };
        let source = Source {
            name: "box.obj".into(),
            part: None,
            blake3: "0".repeat(64),
            triangles: mesh.triangles().len() as u64,
        };
        let options = Preset::Paper.options();
        let grid = aogrid_baker_cpu::bake_grid(&mesh, &placement, &options, source, UNOBSERVED);
        let grid = grid.unwrap().to_bytes();
        let entry = packed(&grid, &["it is hollow".into()]).unwrap();
        let whole = unpacked(&entry).unwrap();
        assert!(whole.bytes == grid && whole.warnings == ["it is hollow"]);
        for at in (0..entry.len()).step_by(7) {
            assert!(unpacked(&entry[..at]).is_none(), "{at}");
            let mut broken = entry.clone();
            broken[at] ^= 1;
            assert!(unpacked(&broken).is_none(), "{at}");
        }
    }
}
