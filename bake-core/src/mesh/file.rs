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

/// A mesh file in memory: read and hashed once, and not parsed yet.
#[derive(Clone, Debug)]
pub struct MeshFile {
    name: String,
    bytes: Vec<u8>,
    blake3: String,
}

/// Loads the mesh file at `path`; its extension tells the format.
///
/// # Errors
///
/// The file cannot be read, has an unsupported extension, or is malformed.
pub fn load(path: &Path) -> Result<LoadedMesh, LoadError> {
    MeshFile::read(path)?.parse()
}

impl MeshFile {
    /// Reads the file at `path`.
    ///
    /// # Errors
    ///
    /// The file cannot be read or has an unsupported extension.
    pub fn read(path: &Path) -> Result<Self, LoadError> {
        // Reading a device or a pipe might never end.
        if !std::fs::metadata(path)?.is_file() {
            return Err(LoadError::NotAFile);
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        check_extension(&name)?;
        Self::from_bytes(&name, std::fs::read(path)?)
    }

    /// Takes `bytes` as the content of a file called `name`, whose extension tells the format.
    ///
    /// # Errors
    ///
    /// The extension is not supported.
    pub fn from_bytes(name: &str, bytes: Vec<u8>) -> Result<Self, LoadError> {
        check_extension(name)?;
        Ok(Self {
            name: name.to_owned(),
            blake3: blake3::hash(&bytes).to_hex().to_string(),
            bytes,
        })
    }

    /// The file's name, without folders.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The BLAKE3 hash of the bytes, in hexadecimal.
    pub fn blake3(&self) -> &str {
        &self.blake3
    }

    /// Parses the mesh.
    ///
    /// # Errors
    ///
    /// The file is malformed.
    pub fn parse(&self) -> Result<LoadedMesh, LoadError> {
        Ok(LoadedMesh {
            mesh: read_obj(&self.bytes)?,
            name: self.name.clone(),
            blake3: self.blake3.clone(),
        })
    }
}

impl LoadedMesh {
    /// Loads a mesh from the bytes of a file called `name`, in programs without a file system.
    ///
    /// # Errors
    ///
    /// The extension is not supported, or the file is malformed.
    pub fn from_bytes(name: &str, bytes: Vec<u8>) -> Result<Self, LoadError> {
        MeshFile::from_bytes(name, bytes)?.parse()
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

fn check_extension(name: &str) -> Result<(), LoadError> {
    let extension = Path::new(name).extension().unwrap_or_default();
    match extension.eq_ignore_ascii_case("obj") {
        true => Ok(()),
        false => Err(LoadError::UnknownFormat),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    #[test]
    fn bytes_are_loaded_as_a_file_is() {
        let folder = std::env::temp_dir().join(format!("aogrid-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.obj");
        std::fs::write(&path, TRIANGLE).unwrap();
        let of_file = load(&path).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        let of_bytes = LoadedMesh::from_bytes("a.obj", TRIANGLE.to_vec()).unwrap();
        assert_eq!(Source::from(&of_bytes), Source::from(&of_file));
        assert_eq!(of_bytes.mesh.positions(), of_file.mesh.positions());
    }

    #[test]
    fn unknown_extensions_are_refused_before_the_file_is_read() {
        for name in ["a.glb", "obj", "a.obj.gz"] {
            let refused = MeshFile::from_bytes(name, TRIANGLE.to_vec());
            assert!(matches!(refused, Err(LoadError::UnknownFormat)), "{name}");
        }
    }
}
