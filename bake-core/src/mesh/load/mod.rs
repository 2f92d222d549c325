//! Loading of mesh files, with the name and hash that a grid records.

mod format;
mod gltf;
mod large_polygon;
mod obj;
mod parts;
mod ply;
mod polygon;
mod pose;
mod stl;
mod strip;
mod vertices;

use std::io;
use std::path::Path;

use aogrid_grid_format::Source;

use super::{MeshError, TriangleMesh};
use format::Format;
pub use gltf::GltfError;
use gltf::GltfFile;
pub(crate) use gltf::local_pose;
pub use obj::{ObjError, read_obj};
pub use ply::PlyError;
pub use pose::{PartMesh, Pose};
pub use stl::StlError;
pub use vertices::{OwnAttributes, PosedPrimitive};

/// The name of a part without a name in the file.
const UNNAMED: &str = "unnamed";

/// A function that returns the content of a file that a glTF file names, from its relative path with
/// `/` between folders.
pub type Resolver<'a> = dyn Fn(&str) -> io::Result<Vec<u8>> + 'a;

/// A time of an animation of a glTF file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimationTime<'a> {
    /// The animation's name, `animation N` for one without; `None` leaves nodes as the file has them,
    /// which is not the bind pose of its skins.
    pub animation: Option<&'a str>,
    /// The time in seconds; before the first and after the last key nothing moves.
    pub time: f64,
}

/// A mesh with the name and hash of its file.
#[derive(Clone, Debug)]
pub struct LoadedMesh {
    /// The whole mesh, all parts where the file poses them.
    pub mesh: TriangleMesh,
    /// The file's name, without folders.
    pub name: String,
    /// BLAKE3 hash of the bytes of all files that were read, in hexadecimal.
    pub blake3: String,
    /// Notes about what was left out or guessed, a sentence each without a full stop.
    pub warnings: Vec<String>,
    /// The rounding of the coordinates in the file, in object units: half the step of single floats
    /// at the largest of them, or zero for numbers of double precision.
    pub rounding: f64,
    /// The primitives of a glTF file, in the order of the mesh's vertices; empty for other files.
    pub primitives: Vec<PosedPrimitive>,
    /// The shape and pose of each part of a file that has them.
    posed: Vec<Result<PartMesh, MeshError>>,
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
    /// Neither the content nor the name tells a format that can be read.
    #[error("its format is not known; .obj, .glb, .gltf, .stl and .ply are, and .gz of them")]
    UnknownFormat,
    /// The content is of a format that cannot be read.
    #[error("it is {0}")]
    Foreign(&'static str),
    /// The file is compressed and cannot be unpacked.
    #[error("it cannot be unpacked: {0}")]
    Gzip(String),
    /// Only glTF files have animations.
    #[error("only glTF files have skins and animations to pose a model by")]
    NoPoses,
    /// The OBJ file is malformed.
    #[error(transparent)]
    Obj(#[from] ObjError),
    /// The glTF file is malformed or needs what is not supported.
    #[error(transparent)]
    Gltf(#[from] GltfError),
    /// The STL file is malformed.
    #[error(transparent)]
    Stl(#[from] StlError),
    /// The PLY file is malformed.
    #[error(transparent)]
    Ply(#[from] PlyError),
}

/// A mesh file in memory, with all files that it names: read and hashed once, and not parsed yet.
#[derive(Clone, Debug)]
pub struct MeshFile {
    name: String,
    content: Content,
    blake3: String,
}

#[derive(Clone, Debug)]
enum Content {
    Obj(Vec<u8>),
    Stl(Vec<u8>),
    Ply(Vec<u8>),
    Gltf(Box<GltfFile>),
}

/// The result of a format's reader.
struct Parsed {
    mesh: TriangleMesh,
    posed: Vec<Result<PartMesh, MeshError>>,
    primitives: Vec<PosedPrimitive>,
    warnings: Vec<String>,
    rounding: f64,
}

impl Parsed {
    fn new(mesh: TriangleMesh, warnings: Vec<String>) -> Self {
        Self {
            mesh,
            posed: vec![],
            primitives: vec![],
            warnings,
            rounding: 0.0,
        }
    }

    /// Returns the same with the rounding of a file that holds `positions` as single floats.
    fn with_rounding_of(self, positions: &[[f64; 3]]) -> Self {
        Self {
            rounding: single_rounding(positions),
            ..self
        }
    }
}

/// Returns half the step of single floats at the largest coordinate.
fn single_rounding(positions: &[[f64; 3]]) -> f64 {
    let largest = positions
        .iter()
        .flatten()
        .fold(0.0, |max: f64, v| max.max(v.abs()));
    largest * f64::from(f32::EPSILON) / 2.0
}

/// Loads the mesh file at `path`. Its content tells the format, or else its extension.
///
/// # Errors
///
/// The file or one that it names cannot be read, its format is not known, or it is malformed.
pub fn load(path: &Path) -> Result<LoadedMesh, LoadError> {
    MeshFile::read(path)?.parse()
}

impl MeshFile {
    /// Reads the file at `path`, and those beside it that it names.
    ///
    /// # Errors
    ///
    /// A file cannot be read, or its format is not known.
    pub fn read(path: &Path) -> Result<Self, LoadError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let folder = path.parent().unwrap_or(Path::new(""));
        let bytes = format::read_file(path, &name)?;
        Self::from_bytes(&name, bytes, &|relative| {
            let path = folder.join(relative);
            match std::fs::metadata(&path)?.is_file() {
                true => std::fs::read(path),
                false => Err(io::Error::other("it is not a regular file")),
            }
        })
    }

    /// Takes `bytes` as the content of a file called `name`. `resolver` returns the files that it
    /// names.
    ///
    /// # Errors
    ///
    /// The format is not known, or a file that it names is missing.
    pub fn from_bytes(
        name: &str,
        bytes: Vec<u8>,
        resolver: &Resolver<'_>,
    ) -> Result<Self, LoadError> {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&bytes);
        let (bytes, inner_name) = format::unpacked(bytes, name)?;
        let content = match Format::detect(&bytes, bytes.len() as u64, inner_name)? {
            Format::Obj => Content::Obj(bytes),
            Format::Stl => Content::Stl(bytes),
            Format::Ply => Content::Ply(bytes),
            Format::Gltf => Content::Gltf(Box::new(GltfFile::new(&bytes, resolver)?)),
        };
        if let Content::Gltf(file) = &content {
            for (_, external) in file.external() {
                // The length keeps the files apart.
                hasher.update(&(external.len() as u64).to_le_bytes());
                hasher.update(external);
            }
        }
        Ok(Self {
            name: name.to_owned(),
            content,
            blake3: hasher.finalize().to_hex().to_string(),
        })
    }

    /// The file's name, without folders.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The BLAKE3 hash of the bytes of all files that were read, in hexadecimal.
    pub fn blake3(&self) -> &str {
        &self.blake3
    }

    /// Returns the paths of the other files that were read, relative to this file's folder.
    pub fn companions(&self) -> impl Iterator<Item = &str> {
        let gltf = match &self.content {
            Content::Gltf(file) => Some(file),
            _ => None,
        };
        let external = gltf.into_iter().flat_map(|file| file.external());
        external.map(|(path, _)| path)
    }

    /// Parses the mesh.
    ///
    /// # Errors
    ///
    /// The file is malformed, or needs what is not supported.
    pub fn parse(&self) -> Result<LoadedMesh, LoadError> {
        let parsed = match &self.content {
            Content::Obj(bytes) => obj::parse(bytes)?,
            Content::Stl(bytes) => stl::parse(bytes)?,
            Content::Ply(bytes) => ply::parse(bytes)?,
            Content::Gltf(file) => file.parse(None)?,
        };
        Ok(self.loaded(parsed))
    }

    /// Parses the mesh of a glTF file as the nodes and skins of an animation pose it. Vertices,
    /// triangles and parts have the order of [`MeshFile::parse`], and primitives are not listed.
    ///
    /// # Errors
    ///
    /// The file is not glTF, has no such animation, is malformed, or needs what is not supported.
    pub fn parse_posed(&self, pose: &AnimationTime<'_>) -> Result<LoadedMesh, LoadError> {
        match &self.content {
            Content::Gltf(file) => Ok(self.loaded(file.parse(Some(pose))?)),
            _ => Err(LoadError::NoPoses),
        }
    }

    fn loaded(&self, parsed: Parsed) -> LoadedMesh {
        LoadedMesh {
            mesh: parsed.mesh,
            name: self.name.clone(),
            blake3: self.blake3.clone(),
            warnings: parsed.warnings,
            rounding: parsed.rounding,
            primitives: parsed.primitives,
            posed: parsed.posed,
        }
    }
}

impl LoadedMesh {
    /// Loads a mesh from the bytes of a file called `name`, in programs without a file system.
    /// `resolver` returns the files that a glTF file names.
    ///
    /// # Errors
    ///
    /// The format is not known, a file that it names is missing, or it is malformed.
    pub fn from_bytes(
        name: &str,
        bytes: Vec<u8>,
        resolver: &Resolver<'_>,
    ) -> Result<Self, LoadError> {
        MeshFile::from_bytes(name, bytes, resolver)?.parse()
    }

    /// Takes a mesh that was made in memory as one from a file called `name` with this hash.
    pub fn from_mesh(mesh: TriangleMesh, name: String, blake3: String) -> Self {
        Self {
            mesh,
            name,
            blake3,
            warnings: vec![],
            rounding: 0.0,
            primitives: vec![],
            posed: vec![],
        }
    }

    /// Returns a part in its own frame, with its pose in the whole. The nodes of a glTF file have
    /// frames; parts of other files are in the frame of the whole.
    ///
    /// # Errors
    ///
    /// No triangle of the part has an area.
    ///
    /// # Panics
    ///
    /// If there is no part `idx`.
    pub fn part(&self, idx: usize) -> Result<PartMesh, MeshError> {
        match self.posed.get(idx) {
            Some(part) => part.clone(),
            None => Ok(PartMesh {
                same_as: idx,
                ..PartMesh::whole(self.mesh.part(idx)?)
            }),
        }
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

/// Loads every file that differs from `bytes` in one byte or is cut off, which must give a mesh or an
/// error.
#[cfg(test)]
fn load_all_broken(name: &str, bytes: &[u8]) {
    assert!(LoadedMesh::from_bytes(name, bytes.to_vec(), &|_| unreachable!()).is_ok());
    let load = |bytes: &[u8]| {
        let missing = |_: &str| Err(io::Error::from(io::ErrorKind::NotFound));
        // Most are errors; those that are not are meshes, which are valid.
        let _ = LoadedMesh::from_bytes(name, bytes.to_vec(), &missing);
    };
    for at in 0..bytes.len() {
        load(&bytes[..at]);
        for byte in [
            0, 1, 0x7F, 0x80, 0xFF, b'-', b'9', b'e', b' ', b'\n', b'"', b']',
        ] {
            let mut broken = bytes.to_vec();
            broken[at] = byte;
            load(&broken);
        }
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
        let nothing = &|_: &str| unreachable!("an OBJ file names no others");
        let of_bytes = LoadedMesh::from_bytes("a.obj", TRIANGLE.to_vec(), nothing).unwrap();
        assert_eq!(Source::from(&of_bytes), Source::from(&of_file));
        assert_eq!(of_bytes.mesh.positions(), of_file.mesh.positions());
        assert_eq!(of_bytes.blake3, blake3::hash(TRIANGLE).to_hex().as_str());
    }
}
