//! A mesh from a file, with what a grid remembers of it.

use std::io;
use std::path::Path;

use aogrid_grid_format::Source;

use super::{ObjError, TriangleMesh, read_obj};

/// A mesh and where it came from.
#[derive(Clone, Debug)]
pub struct LoadedMesh {
    /// The mesh.
    pub mesh: TriangleMesh,
    /// The file's name, without folders.
    pub name: String,
    /// BLAKE3 of the file's bytes, in hexadecimal.
    pub blake3: String,
}

/// Why a file gave no mesh. The message does not repeat the file's path: the caller has it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// It cannot be read.
    #[error("cannot read it")]
    Read(#[from] io::Error),
    /// A device, a pipe, a folder.
    #[error("it is not a regular file")]
    NotAFile,
    /// An ending that no reader knows.
    #[error("its ending is not that of a mesh this program reads (.obj)")]
    UnknownFormat,
    /// A broken OBJ file.
    #[error(transparent)]
    Obj(#[from] ObjError),
}

/// Reads the mesh in the file at `path`, by its ending.
///
/// # Errors
///
/// The file cannot be read, is of an unknown kind, or is broken.
pub fn load(path: &Path) -> Result<LoadedMesh, LoadError> {
    let bytes = read_file(path)?;
    Ok(LoadedMesh {
        mesh: read_obj(&bytes)?,
        name: name(path),
        blake3: hash(&bytes),
    })
}

impl LoadedMesh {
    /// The name and hash that [`load`] would give, without parsing the mesh.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is of an unknown kind.
    pub fn identify(path: &Path) -> Result<(String, String), LoadError> {
        Ok((name(path), hash(&read_file(path)?)))
    }
}

impl From<&LoadedMesh> for Source {
    /// What a grid baked from the whole mesh remembers of it.
    fn from(loaded: &LoadedMesh) -> Self {
        Self {
            name: loaded.name.clone(),
            part: None,
            blake3: loaded.blake3.clone(),
            triangles: loaded.mesh.triangles().len() as u64,
        }
    }
}

fn read_file(path: &Path) -> Result<Vec<u8>, LoadError> {
    // A device or pipe could be endless.
    if !std::fs::metadata(path)?.is_file() {
        return Err(LoadError::NotAFile);
    }
    let ending = path.extension().unwrap_or_default();
    if !ending.eq_ignore_ascii_case("obj") {
        return Err(LoadError::UnknownFormat);
    }
    Ok(std::fs::read(path)?)
}

fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}
