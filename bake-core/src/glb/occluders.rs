//! Grids as parts of a GLB file: whole grid files in its binary chunk, by an extension of its nodes.

use std::collections::HashMap;

use gltf_json::{Node, Root};
use serde_json::Value;

use super::{Container, GlbError, Nodes, Splice, extras};
use crate::mesh::Pose;

/// The extension of a node that has a grid.
pub const EXTENSION: &str = "AOGRID_occluder";

/// The alignment of a grid file, so that its texels can be read in place: the largest texel's bytes.
const ALIGN: usize = 16;

/// A grid file to attach.
#[derive(Clone, Debug)]
pub struct Occluder {
    /// The name of the grid's file, without folders, that the nodes' extras record.
    pub uri: String,
    /// The grid file.
    pub bytes: Vec<u8>,
    /// The nodes that it serves, each with the pose in it of the grid's frame; none for a grid of a whole
    /// scene that has several roots, which gets a node of its own.
    pub nodes: Vec<(usize, Pose)>,
}

/// A node of a GLB file that has a grid, or had one before a program dropped it.
#[derive(Clone, Debug, PartialEq)]
pub struct AttachedGrid {
    /// The node's index.
    pub node: usize,
    /// The node's name, if it has one.
    pub name: Option<String>,
    /// The name of the grid's file, from the node's extras.
    pub uri: Option<String>,
    /// The BLAKE3 hash of the grid's file, from the node's extras.
    pub blake3: Option<String>,
    /// The index of the buffer view that holds the file and its bytes; `None` if the extension is gone.
    pub file: Option<(usize, Vec<u8>)>,
    /// The pose in the node of the grid's frame.
    pub pose: Pose,
}

/// Returns a GLB file with grids attached to its nodes.
///
/// # Errors
///
/// The file is no GLB with a buffer of its own, a node has a grid already, or two grids are for one
/// node.
pub fn attach(bytes: &[u8], nodes: &Nodes, occluders: &[Occluder]) -> Result<Vec<u8>, GlbError> {
    let mut splice = Splice::new(bytes)?;
    let places = splice.list("nodes").unwrap_or_default();
    let mut taken = HashMap::new();
    let mut own_nodes = Vec::new();
    for occluder in occluders {
        let view = splice.view(&occluder.bytes, ALIGN, "");
        for &(node, pose) in &occluder.nodes {
            if taken.insert(node, ()).is_some() {
                return Err(GlbError::TwoGrids(node));
            }
            let place = places.get(node).ok_or(GlbError::Missing("such node"))?;
            let members = Members::new(occluder, view, &pose);
            let Splice { text, edits, .. } = &mut splice;
            let mut new = Vec::new();
            match text.member(place, "extensions") {
                Some(old) if text.member(&old, EXTENSION).is_some() => {
                    return Err(GlbError::Attached(node));
                }
                Some(old) => edits.set(text, &old, &[(EXTENSION, members.extension)]),
                None => new.push(("extensions", members.extensions())),
            }
            new.extend(extras(text, edits, place, members.record));
            edits.set(text, place, &new);
        }
        if occluder.nodes.is_empty() {
            let members = Members::new(occluder, view, &Pose::IDENTITY);
            own_nodes.push(format!(
                r#"{{"name":"aogrid","extensions":{},"extras":{{"aogrid":{}}}}}"#,
                members.extensions(),
                members.record
            ));
        }
    }
    add_roots(&mut splice, nodes.scene(), places.len(), own_nodes.len())?;
    let used = splice.list("extensionsUsed").unwrap_or_default();
    let extension = format!("\"{EXTENSION}\"");
    let is_used =
        |name: &std::ops::Range<usize>| &splice.text.0[name.clone()] == extension.as_bytes();
    let used = match used.iter().any(is_used) || occluders.is_empty() {
        true => vec![],
        false => vec![extension],
    };
    splice.finish(&[("nodes", &own_nodes), ("extensionsUsed", &used)])
}

/// Adds nodes from `first` on to the roots of a scene, if there are scenes.
fn add_roots(
    splice: &mut Splice<'_>,
    scene: usize,
    first: usize,
    count: usize,
) -> Result<(), GlbError> {
    let Some(scenes) = splice.list("scenes").filter(|_| count > 0) else {
        return Ok(());
    };
    let scene = scenes.get(scene).ok_or(GlbError::Missing("such scene"))?;
    let Splice { text, edits, .. } = splice;
    let new: Vec<String> = (first..first + count).map(|idx| idx.to_string()).collect();
    match text.member(scene, "nodes") {
        Some(roots) => edits.append(text, &roots, &new.join(",")),
        None => edits.set(text, scene, &[("nodes", format!("[{}]", new.join(",")))]),
    }
    Ok(())
}

/// The JSON values of a node that has a grid.
struct Members {
    extension: String,
    record: String,
}

impl Members {
    fn new(occluder: &Occluder, view: usize, pose: &Pose) -> Self {
        let mut extension = serde_json::json!({ "bufferView": view, "mimeType": "image/ktx2" });
        let hash = blake3::hash(&occluder.bytes).to_hex();
        let mut record = serde_json::json!({ "uri": occluder.uri, "blake3": hash.as_str() });
        if *pose != Pose::IDENTITY {
            let matrix = matrix_of(pose);
            extension["matrix"] = matrix.clone();
            record["matrix"] = matrix;
        }
        Self {
            extension: extension.to_string(),
            record: record.to_string(),
        }
    }

    fn extensions(&self) -> String {
        format!(r#"{{"{EXTENSION}":{}}}"#, self.extension)
    }
}

/// Returns a pose as the 16 numbers of a matrix, columns first.
fn matrix_of(pose: &Pose) -> Value {
    let [x, y, z] = pose.linear;
    let columns = [(x, 0.0), (y, 0.0), (z, 0.0), (pose.translation, 1.0)];
    let numbers = columns.iter().flat_map(|(v, w)| [v[0], v[1], v[2], *w]);
    // Adding zero turns −0 into +0.
    numbers.map(|v| v + 0.0).collect()
}

/// Returns the pose of a matrix; the identity for what is none.
pub(super) fn pose_of(matrix: &Value) -> Pose {
    let numbers: Vec<f64> = matrix
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect();
    if numbers.len() != 16 {
        return Pose::IDENTITY;
    }
    let column = |at: usize| [numbers[at], numbers[at + 1], numbers[at + 2]];
    Pose {
        linear: [column(0), column(4), column(8)],
        translation: column(12),
    }
}

/// Returns the record of a grid in a node's extras.
pub(super) fn record(node: &Node) -> Option<Value> {
    let extras: Value = serde_json::from_str(node.extras.as_ref()?.get()).ok()?;
    extras.get("aogrid").cloned()
}

/// Returns the nodes of a GLB file that have grids, or had them.
///
/// # Errors
///
/// The file is no GLB, or an extension does not name a part of its binary chunk.
pub fn attached(bytes: &[u8]) -> Result<Vec<AttachedGrid>, GlbError> {
    let container = Container::new(bytes)?;
    let root: Root = gltf_json::deserialize::from_slice(container.json)
        .map_err(|error| GlbError::Json(error.to_string()))?;
    let bin = container.bin.unwrap_or_default();
    let nodes = root.nodes.iter().enumerate();
    let found = nodes.filter_map(|(idx, node)| of_node(&root, bin, idx, node).transpose());
    found.collect()
}

/// Returns the grid of a node, if it has or had one.
fn of_node(
    root: &Root,
    bin: &[u8],
    idx: usize,
    node: &Node,
) -> Result<Option<AttachedGrid>, GlbError> {
    let record = record(node).unwrap_or_default();
    let text = |name: &str| record[name].as_str().map(str::to_owned);
    let extension = node
        .extensions
        .as_ref()
        .and_then(|all| all.others.get(EXTENSION));
    if extension.is_none() && text("blake3").is_none() {
        return Ok(None);
    }
    let file = extension.map(|extension| {
        let view = extension["bufferView"].as_u64().map(|view| view as usize);
        let bytes = view.and_then(|view| Some((view, view_bytes(root, bin, view)?.to_vec())));
        bytes.ok_or(GlbError::NoGrid(idx))
    });
    let matrix = extension.map_or(&record["matrix"], |extension| &extension["matrix"]);
    Ok(Some(AttachedGrid {
        node: idx,
        name: node.name.clone(),
        uri: text("uri"),
        blake3: text("blake3"),
        file: file.transpose()?,
        pose: pose_of(matrix),
    }))
}

/// Returns the bytes of a buffer view of the binary chunk.
fn view_bytes<'a>(root: &Root, bin: &'a [u8], view: usize) -> Option<&'a [u8]> {
    let view = root.buffer_views.get(view)?;
    if view.buffer.value() != 0 {
        return None;
    }
    let start = usize::try_from(view.byte_offset.map_or(0, |offset| offset.0)).ok()?;
    bin.get(start..)?
        .get(..usize::try_from(view.byte_length.0).ok()?)
}
