//! The reader of glTF 2.0 files: JSON with buffers beside it, or all in one (GLB).
//!
//! The gltf-json crate parses the JSON; what a mesh needs is checked where it is used, so that no
//! other part of a file can make it fail. The gltf crate's own readers panic on quantized positions.

mod accessor;
mod buffers;
mod nodes;
mod shapes;
mod skin;
#[cfg(test)]
mod tests;
mod transforms;

use std::io;

pub(crate) use transforms::local_pose;

use gltf_json::mesh::Semantic;
use gltf_json::validation::{Checked, Validate};
use gltf_json::{Path, Root};

use super::{AnimationTime, Parsed, Resolver};
use crate::mesh::MeshError;

/// The reason that a file is not a glTF mesh that can be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GltfError {
    /// The container of a GLB file is malformed.
    #[error("its GLB container is broken: {0}")]
    Container(&'static str),
    /// The JSON is malformed.
    #[error("its JSON is not that of glTF: {0}")]
    Json(String),
    /// The version is not supported.
    #[error("it is glTF {0}; only 2.0 is supported")]
    Version(String),
    /// The file requires an extension that is not supported.
    #[error(
        "it requires the extension {name}, which is not supported: {}",
        remedy(name)
    )]
    Required {
        /// The extension's name.
        name: String,
    },
    /// A buffer names a file or data that cannot be used.
    #[error("buffer {buffer}: {reason}")]
    Buffer {
        /// The buffer's index.
        buffer: usize,
        /// The reason.
        reason: String,
    },
    /// A file that a buffer names cannot be read.
    #[error("buffer {buffer}: cannot read `{path}`")]
    External {
        /// The buffer's index.
        buffer: usize,
        /// The file's path as written.
        path: String,
        /// The reason.
        source: io::Error,
    },
    /// The file refers to something that it does not have.
    #[error("it refers to {0} {1}, which does not exist")]
    Missing(&'static str, usize),
    /// An accessor cannot be read.
    #[error("accessor {accessor}: {reason}")]
    Accessor {
        /// The accessor's index.
        accessor: usize,
        /// The reason.
        reason: String,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("mesh {mesh} refers to vertex {index}, but there are {count}, from 0")]
    Index {
        /// The mesh's index.
        mesh: usize,
        /// The vertex index.
        index: u32,
        /// The number of vertices of the primitive.
        count: usize,
    },
    /// A mesh has a primitive that is not valid.
    #[error("mesh {mesh}: {reason}")]
    Primitive {
        /// The mesh's index.
        mesh: usize,
        /// The reason.
        reason: &'static str,
    },
    /// A primitive has no texture coordinates.
    #[error(
        "mesh {mesh}, primitive {primitive}: it has no texture coordinates {set}; unwrap it, or bake at \
         vertices"
    )]
    NoCoordinates {
        /// The mesh's index.
        mesh: usize,
        /// The primitive's index.
        primitive: usize,
        /// The set's number.
        set: u32,
    },
    /// The file has no animation of this name.
    #[error("it has no animation `{name}`; {}", listed(known))]
    NoAnimation {
        /// The name.
        name: String,
        /// The names of all animations.
        known: Vec<String>,
    },
    /// A node has a matrix and is animated, which glTF forbids.
    #[error("node {0} is animated and has a matrix: save it with translation, rotation and scale")]
    AnimatedMatrix(usize),
    /// A node is its own ancestor or has two parents.
    #[error("node {0} is its own ancestor or has two parents")]
    NotATree(usize),
    /// Instances of meshes multiply to too many triangles.
    #[error("its nodes have more than {0} triangles in all")]
    TooMany(usize),
    /// The file can be parsed, but its triangles are not a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

fn listed(names: &[String]) -> String {
    match names {
        [] => "there are none".to_owned(),
        names => format!("there are: {}", names.join(", ")),
    }
}

fn remedy(extension: &str) -> &'static str {
    match extension {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "save the model without compression"
        }
        _ => "save the model without it",
    }
}

/// A glTF file with its buffers, not parsed to a mesh yet.
#[derive(Clone, Debug)]
pub(super) struct GltfFile {
    root: Root,
    buffers: Vec<buffers::Buffer>,
    /// Whether the length of each chunk of the container is a multiple of four, as it should be.
    is_aligned: bool,
}

impl GltfFile {
    pub(super) fn new(bytes: &[u8], resolver: &Resolver<'_>) -> Result<Self, GltfError> {
        let (json, chunk) = match bytes.starts_with(b"glTF") {
            true => split_container(bytes)?,
            false => (bytes, None),
        };
        let text = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
        let root: Root = gltf_json::deserialize::from_slice(text)
            .map_err(|error| GltfError::Json(error.to_string()))?;
        check_version(&root)?;
        check_extensions(&root)?;
        let buffers = buffers::read(&root, chunk, resolver)?;
        let is_aligned = json.len() % 4 == 0 && chunk.is_none_or(|chunk| chunk.len() % 4 == 0);
        Ok(Self {
            root,
            buffers,
            is_aligned: is_aligned || !bytes.starts_with(b"glTF"),
        })
    }

    /// Returns the paths, relative to this file's folder, and the contents of the files that were read
    /// beside it.
    pub(super) fn external(&self) -> impl Iterator<Item = (&str, &[u8])> {
        let external = self.buffers.iter().filter(|buffer| buffer.path.is_some());
        external.map(|buffer| {
            (
                buffer.path.as_deref().unwrap_or_default(),
                &buffer.bytes[..],
            )
        })
    }

    /// Parses the mesh: in bind pose, or in the pose of an animation.
    pub(super) fn parse(&self, pose: Option<&AnimationTime<'_>>) -> Result<Parsed, GltfError> {
        let invalid = self.validation_warning()?;
        let mut parsed = nodes::parse(self, pose)?;
        parsed.warnings.extend(invalid);
        if !self.is_aligned {
            let warning = "a chunk of its container is not a multiple of four bytes long";
            parsed.warnings.push(warning.into());
        }
        Ok(parsed)
    }

    /// Returns a warning if the file is not valid, whether the mesh can be read or not.
    fn validation_warning(&self) -> Result<Option<String>, GltfError> {
        // The validator takes for granted that these exist.
        for primitive in self.root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            let positions = primitive
                .attributes
                .get(&Checked::Valid(Semantic::Positions));
            if let Some(idx) = positions.map(|idx| idx.value())
                && idx >= self.root.accessors.len()
            {
                return Err(GltfError::Missing("accessor", idx));
            }
        }
        let mut errors = Vec::new();
        self.root
            .validate(&self.root, Path::new, &mut |path, error| {
                let path = path();
                // Those that are not supported are refused already.
                if !path.as_str().starts_with("extensionsRequired") {
                    errors.push(format!("{path}: {}", error.to_string().to_lowercase()));
                }
            });
        let more = match errors.len() {
            0 | 1 => String::new(),
            n => format!(", and {} more", n - 1),
        };
        Ok(errors
            .first()
            .map(|first| format!("it is not valid glTF ({first}{more})")))
    }
}

/// Returns the JSON and the binary chunk of a GLB file.
fn split_container(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), GltfError> {
    let broken = GltfError::Container;
    let word = |at: usize| {
        let bytes = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(bytes))
    };
    let version = word(4).ok_or(broken("the header is cut off"))?;
    if version != 2 {
        return Err(GltfError::Version(version.to_string()));
    }
    let length = word(8).ok_or(broken("the header is cut off"))? as usize;
    if length > bytes.len() {
        return Err(broken("the file is shorter than its header says"));
    }
    let chunk = |at: usize| -> Result<_, GltfError> {
        let length = word(at).ok_or(broken("a chunk is cut off"))? as usize;
        let kind = word(at + 4).ok_or(broken("a chunk is cut off"))?;
        let data = bytes.get(at + 8..).and_then(|rest| rest.get(..length));
        Ok((kind, data.ok_or(broken("a chunk is longer than the file"))?))
    };
    let (kind, json) = chunk(12)?;
    if kind != u32::from_le_bytes(*b"JSON") {
        return Err(broken("its first chunk is not JSON"));
    }
    let next = 20 + json.len();
    if next + 8 > length {
        return Ok((json, None));
    }
    // Chunks of kinds that are not known are to be skipped; only the second one may be the buffer.
    let (kind, data) = chunk(next)?;
    let is_buffer = kind == u32::from_le_bytes(*b"BIN\0");
    Ok((json, is_buffer.then_some(data)))
}

fn check_version(root: &Root) -> Result<(), GltfError> {
    let needed = root
        .asset
        .min_version
        .as_ref()
        .unwrap_or(&root.asset.version);
    let is_known = match root.asset.min_version {
        Some(_) => needed == "2.0",
        // Later minor versions must be readable by what knows 2.0.
        None => needed.split('.').next() == Some("2"),
    };
    match is_known {
        true => Ok(()),
        false => Err(GltfError::Version(needed.clone())),
    }
}

/// Extensions that a mesh can be read with: known here, or of no consequence for geometry.
const KNOWN: &[&str] = &[
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_xmp_json_ld",
];

/// Beginnings of the names of extensions that have no consequence for geometry.
const HARMLESS: &[&str] = &[
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_animation_",
];

fn check_extensions(root: &Root) -> Result<(), GltfError> {
    let is_known = |name: &&String| {
        KNOWN.contains(&name.as_str()) || HARMLESS.iter().any(|start| name.starts_with(start))
    };
    match root.extensions_required.iter().find(|name| !is_known(name)) {
        Some(name) => Err(GltfError::Required { name: name.clone() }),
        None => Ok(()),
    }
}
