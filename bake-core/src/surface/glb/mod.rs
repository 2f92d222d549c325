//! GLB files with baked attributes: the file that came in, with what is new spliced in.
//!
//! Nothing is parsed and written anew: what is not edited keeps its bytes, unknown extensions, order of
//! keys and digits included. New values follow the old ones in the binary chunk.

mod container;
mod json;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::ops::Range;

use container::Container;
use json::{Edits, Text};

use crate::mesh::PosedPrimitive;

/// The attribute of accessibility, a float.
pub const ACCESSIBILITY: &str = "_ACCESSIBILITY";
/// The attribute of bent normals, three floats in the mesh's own frame.
pub const BENT_NORMAL: &str = "_BENT_NORMAL";

/// The reason that values cannot be added to a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GlbError {
    /// The file is no GLB.
    #[error("it is not a GLB: save the model as one GLB, or name a PLY to write")]
    NotGlb,
    /// The container is malformed.
    #[error("its GLB container is broken")]
    Broken,
    /// The JSON is malformed.
    #[error("its JSON is malformed: {0}")]
    Json(String),
    /// The first buffer is another file or is written in the JSON.
    #[error("its first buffer is not in the GLB itself: save the model as one GLB")]
    NoBinary,
    /// The JSON lacks what the values are for.
    #[error("its JSON has no {0}: was the file changed meanwhile?")]
    Missing(&'static str),
    /// The file would be larger than a GLB can be.
    #[error("with the values it would be larger than 4 GiB")]
    TooLarge,
}

/// The values of a primitive's vertices.
#[derive(Clone, Debug)]
pub struct GlbValues<'a> {
    /// The primitive, as a node poses it.
    pub primitive: &'a PosedPrimitive,
    /// The accessibility of each vertex.
    pub accessibility: Vec<f32>,
    /// The bent normal of each vertex, in the mesh's own frame.
    pub bent_normals: Vec<[f32; 3]>,
    /// The colors that replace or become `COLOR_0`, if it is to change.
    pub colors: Option<Vec<[f32; 4]>>,
}

/// Returns a GLB file with the values as attributes of its primitives, and `record`, a JSON value, as
/// `aogrid` in the `extras` of its `asset`. A mesh that several nodes pose is copied for each but the
/// first, because each is occluded differently.
///
/// # Errors
///
/// The file is no GLB with a buffer of its own, or is not the one that the primitives are of.
pub fn add_to_glb(
    bytes: &[u8],
    values: &[GlbValues<'_>],
    record: &str,
) -> Result<Vec<u8>, GlbError> {
    let container = Container::new(bytes)?;
    // Edits take for granted that the text is valid.
    serde_json::from_slice::<serde_json::Value>(container.json)
        .map_err(|error| GlbError::Json(error.to_string()))?;
    let text = Text(container.json);
    let mut editor = Editor::new(&text, container.bin)?;
    // The primitives of a node follow each other.
    for of_node in values.chunk_by(|a, b| a.primitive.node == b.primitive.node) {
        editor.node(of_node)?;
    }
    editor.record(record)?;
    let (json, bin) = editor.finish()?;
    container.with(json, bin)
}

/// The edits of a file so far.
struct Editor<'a> {
    text: &'a Text<'a>,
    root: Range<usize>,
    meshes: Vec<Range<usize>>,
    nodes: Vec<Range<usize>>,
    edits: Edits,
    bin: Vec<u8>,
    n_accessors: usize,
    n_views: usize,
    accessors: Vec<String>,
    views: Vec<String>,
    copies: Vec<String>,
    /// The first node of each mesh.
    owners: HashMap<usize, usize>,
}

impl<'a> Editor<'a> {
    fn new(text: &'a Text<'a>, bin: Option<&[u8]>) -> Result<Self, GlbError> {
        let root = text.root();
        let list = |name: &str| text.member(&root, name).map(|list| text.elements(&list));
        let buffers = list("buffers").unwrap_or_default();
        let is_own = |buffer: &Range<usize>| text.member(buffer, "uri").is_none();
        if buffers.first().is_some_and(|first| !is_own(first))
            || (buffers.is_empty() != bin.is_none())
        {
            return Err(GlbError::NoBinary);
        }
        Ok(Self {
            meshes: list("meshes").ok_or(GlbError::Missing("meshes"))?,
            nodes: list("nodes").unwrap_or_default(),
            n_accessors: list("accessors").map_or(0, |list| list.len()),
            n_views: list("bufferViews").map_or(0, |list| list.len()),
            text,
            root,
            edits: Edits::default(),
            bin: bin.unwrap_or_default().to_vec(),
            accessors: vec![],
            views: vec![],
            copies: vec![],
            owners: HashMap::new(),
        })
    }

    /// Adds the values of a node's mesh, in place or in a copy of the mesh.
    fn node(&mut self, values: &[GlbValues<'_>]) -> Result<(), GlbError> {
        let PosedPrimitive { node, mesh, .. } = *values[0].primitive;
        let range = self
            .meshes
            .get(mesh)
            .ok_or(GlbError::Missing("such mesh"))?;
        let range = range.clone();
        let mut own = Edits::default();
        for values in values {
            self.primitive(&range, values, &mut own)?;
        }
        if *self.owners.entry(mesh).or_insert(node) == node {
            self.edits.extend(own);
            return Ok(());
        }
        let copy = own.apply(self.text, range);
        let idx = self.meshes.len() + self.copies.len();
        // The text is valid UTF-8, as JSON must be, and edits cut it at ASCII characters alone.
        self.copies
            .push(String::from_utf8_lossy(&copy).into_owned());
        let range = self.nodes.get(node);
        let reference = range.and_then(|node| self.text.member(node, "mesh"));
        let reference = reference.ok_or(GlbError::Missing("such node"))?;
        self.edits.replace(reference, idx.to_string());
        Ok(())
    }

    fn primitive(
        &mut self,
        mesh: &Range<usize>,
        values: &GlbValues<'_>,
        edits: &mut Edits,
    ) -> Result<(), GlbError> {
        let missing = GlbError::Missing("such primitive");
        let primitives = self
            .text
            .member(mesh, "primitives")
            .ok_or(missing.clone())?;
        let primitives = self.text.elements(&primitives);
        let primitive = primitives
            .get(values.primitive.primitive)
            .ok_or(missing.clone())?;
        let attributes = self.text.member(primitive, "attributes").ok_or(missing)?;
        let n = values.accessibility.len();
        let accessibility = self.accessor("SCALAR", n, &values.accessibility);
        let bent_normals = self.accessor("VEC3", n, values.bent_normals.as_flattened());
        let mut members = vec![
            (ACCESSIBILITY, accessibility.to_string()),
            (BENT_NORMAL, bent_normals.to_string()),
        ];
        if let Some(colors) = &values.colors {
            let colors = self.accessor("VEC4", n, colors.as_flattened());
            members.push(("COLOR_0", colors.to_string()));
        }
        edits.set(self.text, &attributes, &members);
        Ok(())
    }

    /// Adds floats to the binary chunk; returns the index of their accessor.
    fn accessor(&mut self, kind: &str, count: usize, floats: &[f32]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let (offset, length) = (self.bin.len(), 4 * floats.len());
        self.bin.extend(floats.iter().flat_map(|v| v.to_le_bytes()));
        let view = self.n_views + self.views.len();
        // 34962 is ARRAY_BUFFER, 5126 FLOAT.
        self.views.push(format!(
            r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length},"target":34962}}"#
        ));
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":5126,"count":{count},"type":"{kind}"}}"#
        ));
        self.n_accessors + self.accessors.len() - 1
    }

    /// Sets the record in the extras of the asset, unless its extras are no object.
    fn record(&mut self, record: &str) -> Result<(), GlbError> {
        let asset = self.text.member(&self.root, "asset");
        let asset = asset.ok_or(GlbError::Missing("asset"))?;
        let members = [("aogrid", record.to_owned())];
        match self.text.member(&asset, "extras") {
            Some(extras) if self.text.0[extras.start] == b'{' => {
                self.edits.set(self.text, &extras, &members);
            }
            Some(_) => {}
            None => {
                let extras = format!(r#"{{"aogrid":{record}}}"#);
                self.edits.set(self.text, &asset, &[("extras", extras)]);
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<(Vec<u8>, Vec<u8>), GlbError> {
        let length = self.bin.len();
        let lists = [
            ("accessors", self.accessors.join(",")),
            ("bufferViews", self.views.join(",")),
            ("meshes", self.copies.join(",")),
        ];
        let mut new = Vec::new();
        for (name, items) in &lists {
            match self.text.member(&self.root, name) {
                Some(list) => self.edits.append(self.text, &list, items),
                None => new.push((*name, format!("[{items}]"))),
            }
        }
        let buffers = self.text.member(&self.root, "buffers");
        match buffers.map(|list| self.text.elements(&list)) {
            Some(buffers) if !buffers.is_empty() => {
                let length = [("byteLength", length.to_string())];
                self.edits.set(self.text, &buffers[0], &length);
            }
            Some(_) => return Err(GlbError::NoBinary),
            None => new.push(("buffers", format!(r#"[{{"byteLength":{length}}}]"#))),
        }
        self.edits.set(self.text, &self.root, &new);
        let json = self.edits.apply(self.text, 0..self.text.0.len());
        Ok((json, self.bin))
    }
}
