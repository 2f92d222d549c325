//! Loading of mesh files, with the name and hash that a grid records.

use std::io;
use std::path::Path;

use aogrid_grid_format::Source;

use super::{ObjError, TriangleMesh, read_obj};

/// A mesh with the name and hash of its file.
#[derive(Clone, Debug)]
pub struct LoadedMesh {
    /// The mesh.
    pub mesh: TriangleMesh,
    /// The file's name, without folders.
    pub name: String,
    /// BLAKE3 hash of the file's bytes, in hexadecimal.
    pub blake3: String,
}

/// The reason that a file could not be loaded. The message does not repeat the file's path: the
/// caller has it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file cannot be read.
    #[error("cannot read the file")]
    Read(#[from] io::Error),
    /// The path is that of a device, a pipe or a folder.
    #[error("it is not a regular file")]
    NotAFile,
    /// The file extension is not supported.
    #[error("unsupported file extension; expected .obj")]
    UnknownFormat,
    /// The OBJ file is malformed.
    #[error(transparent)]
    Obj(#[from] ObjError),
}

/// Loads the mesh file at `path`; its extension tells the format.
///
/// # Errors
///
/// The file cannot be read, has an unsupported extension, or is malformed.
pub fn load(path: &Path) -> Result<LoadedMesh, LoadError> {
    let bytes = read_file(path)?;
    Ok(LoadedMesh {
        mesh: read_obj(&bytes)?,
        name: name(path),
        blake3: hash(&bytes),
    })
}

impl LoadedMesh {
    /// Returns the name and the hash that [`load`] would give, without parsing the mesh.
    ///
    /// # Errors
    ///
    /// The file cannot be read or has an unsupported extension.
    pub fn identify(path: &Path) -> Result<(String, String), LoadError> {
        Ok((name(path), hash(&read_file(path)?)))
    }
}

impl From<&LoadedMesh> for Source {
    /// Returns the source that a grid baked from the whole mesh records.
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
    // Reading a device or a pipe might never end.
    if !std::fs::metadata(path)?.is_file() {
        return Err(LoadError::NotAFile);
    }
    let extension = path.extension().unwrap_or_default();
    if !extension.eq_ignore_ascii_case("obj") {
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
