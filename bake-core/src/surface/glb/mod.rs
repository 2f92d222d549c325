//! GLB files with baked attributes: the file that came in, with what is new [spliced in](crate::glb).

mod read;
#[cfg(test)]
mod tests;
mod texture;

use std::collections::HashMap;
use std::ops::Range;

use crate::glb::{Edits, GlbError, Splice, extras};
use crate::mesh::PosedPrimitive;

pub use read::surface_of_glb;
pub use texture::{GlbTexture, add_texture_to_glb};

/// The attribute of accessibility, a float.
pub const ACCESSIBILITY: &str = "_ACCESSIBILITY";
/// The attribute of bent normals, three floats in the mesh's own frame.
pub const BENT_NORMAL: &str = "_BENT_NORMAL";

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
    let mut editor = Editor::new(bytes)?;
    // The primitives of a node follow each other.
    for of_node in values.chunk_by(|a, b| a.primitive.node == b.primitive.node) {
        editor.node(of_node)?;
    }
    set_record(&mut editor.splice, record)?;
    editor.finish()
}

/// The edits of a file so far.
struct Editor<'a> {
    splice: Splice<'a>,
    meshes: Vec<Range<usize>>,
    nodes: Vec<Range<usize>>,
    n_accessors: usize,
    accessors: Vec<String>,
    copies: Vec<String>,
    /// The first node of each mesh.
    owners: HashMap<usize, usize>,
}

impl<'a> Editor<'a> {
    fn new(bytes: &'a [u8]) -> Result<Self, GlbError> {
        let splice = Splice::new(bytes)?;
        Ok(Self {
            meshes: splice.list("meshes").ok_or(GlbError::Missing("meshes"))?,
            nodes: splice.list("nodes").unwrap_or_default(),
            n_accessors: splice.list("accessors").map_or(0, |list| list.len()),
            splice,
            accessors: vec![],
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
            self.splice.edits.extend(own);
            return Ok(());
        }
        let copy = own.apply(&self.splice.text, range);
        let idx = self.meshes.len() + self.copies.len();
        // The text is valid UTF-8, as JSON must be, and edits cut it at ASCII characters alone.
        self.copies
            .push(String::from_utf8_lossy(&copy).into_owned());
        let range = self.nodes.get(node);
        let reference = range.and_then(|node| self.splice.text.member(node, "mesh"));
        let reference = reference.ok_or(GlbError::Missing("such node"))?;
        self.splice.edits.replace(reference, idx.to_string());
        Ok(())
    }

    fn primitive(
        &mut self,
        mesh: &Range<usize>,
        values: &GlbValues<'_>,
        edits: &mut Edits,
    ) -> Result<(), GlbError> {
        let missing = GlbError::Missing("such primitive");
        let text = &self.splice.text;
        let primitives = text.member(mesh, "primitives").ok_or(missing.clone())?;
        let primitives = text.elements(&primitives);
        let primitive = primitives
            .get(values.primitive.primitive)
            .ok_or(missing.clone())?;
        let attributes = text.member(primitive, "attributes").ok_or(missing)?;
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
        edits.set(&self.splice.text, &attributes, &members);
        Ok(())
    }

    /// Adds floats to the binary chunk; returns the index of their accessor.
    fn accessor(&mut self, kind: &str, count: usize, floats: &[f32]) -> usize {
        let bytes: Vec<u8> = floats.iter().flat_map(|v| v.to_le_bytes()).collect();
        // 34962 is ARRAY_BUFFER, 5126 FLOAT.
        let view = self.splice.view(&bytes, 4, r#","target":34962"#);
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":5126,"count":{count},"type":"{kind}"}}"#
        ));
        self.n_accessors + self.accessors.len() - 1
    }

    fn finish(self) -> Result<Vec<u8>, GlbError> {
        let lists = [
            ("accessors", &self.accessors[..]),
            ("meshes", &self.copies[..]),
        ];
        self.splice.finish(&lists)
    }
}

/// Sets the record in the extras of the asset, unless its extras are no object.
fn set_record(splice: &mut Splice<'_>, record: &str) -> Result<(), GlbError> {
    let Splice {
        text, root, edits, ..
    } = splice;
    let asset = text.member(root, "asset");
    let asset = asset.ok_or(GlbError::Missing("asset"))?;
    let new = extras(text, edits, &asset, record.to_owned());
    edits.set(text, &asset, new.as_slice());
    Ok(())
}
