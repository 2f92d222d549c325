//! GLB files with a baked texture: `occlusionTexture` in their materials.

use std::collections::BTreeSet;
use std::ops::Range;

use super::set_record;
use crate::glb::{Edits, GlbError, Splice, Text};
use crate::mesh::PosedPrimitive;

/// A texture for the materials of a file.
#[derive(Clone, Copy, Debug)]
pub struct GlbTexture<'a> {
    /// The picture, a PNG: red is accessibility, 1 is open.
    pub png: &'a [u8],
    /// The set of texture coordinates, 0 for `TEXCOORD_0`.
    pub set: u32,
}

/// The texture ends at its edge and has mip levels: 9729 is LINEAR, 9987 LINEAR_MIPMAP_LINEAR, 33071
/// CLAMP_TO_EDGE.
const SAMPLER: &str = r#"{"magFilter":9729,"minFilter":9987,"wrapS":33071,"wrapT":33071}"#;

/// Returns a GLB file with a picture in it, as the `occlusionTexture` of the materials of these primitives,
/// and `record`, a JSON value, as `aogrid` in the `extras` of its `asset`. A primitive without a material
/// gets one, and so does one whose material others have, too, that are not baked.
///
/// # Errors
///
/// The file is no GLB with a buffer of its own, or is not the one that the primitives are of.
pub fn add_texture_to_glb(
    bytes: &[u8],
    primitives: &[PosedPrimitive],
    texture: GlbTexture<'_>,
    record: &str,
) -> Result<Vec<u8>, GlbError> {
    let mut splice = Splice::new(bytes)?;
    let view = splice.view(texture.png, 4, "");
    let count = |name: &str| splice.list(name).map_or(0, |list| list.len());
    let [image, sampler, idx] = ["images", "samplers", "textures"].map(count);
    let mut materials = Materials {
        text: &splice.text,
        meshes: splice.list("meshes").ok_or(GlbError::Missing("meshes"))?,
        given: splice.list("materials").unwrap_or_default(),
        texture: format!(r#"{{"index":{idx},"texCoord":{}}}"#, texture.set),
        new: vec![],
        edits: Edits::default(),
    };
    materials.set(primitives)?;
    let Materials { new, edits, .. } = materials;
    splice.edits.extend(edits);
    set_record(&mut splice, record)?;
    splice.finish(&[
        (
            "images",
            &[format!(
                r#"{{"bufferView":{view},"mimeType":"image/png","name":"occlusion"}}"#
            )],
        ),
        ("samplers", &[SAMPLER.to_owned()]),
        (
            "textures",
            &[format!(r#"{{"sampler":{sampler},"source":{image}}}"#)],
        ),
        ("materials", &new),
    ])
}

/// The materials of a file that get the texture.
struct Materials<'a> {
    text: &'a Text<'a>,
    meshes: Vec<Range<usize>>,
    given: Vec<Range<usize>>,
    /// The value of `occlusionTexture`.
    texture: String,
    new: Vec<String>,
    edits: Edits,
}

impl Materials<'_> {
    fn set(&mut self, primitives: &[PosedPrimitive]) -> Result<(), GlbError> {
        let baked: BTreeSet<_> = primitives.iter().map(|p| (p.mesh, p.primitive)).collect();
        let mut others = BTreeSet::new();
        for (mesh, range) in self.meshes.iter().enumerate() {
            for (idx, primitive) in self.primitives(range).iter().enumerate() {
                if !baked.contains(&(mesh, idx)) {
                    others.extend(self.material(primitive));
                }
            }
        }
        let mut done = BTreeSet::new();
        for (mesh, idx) in baked {
            let mesh = self
                .meshes
                .get(mesh)
                .ok_or(GlbError::Missing("such mesh"))?;
            let primitives = self.primitives(mesh);
            let primitive = primitives
                .get(idx)
                .ok_or(GlbError::Missing("such primitive"))?;
            match self.material(primitive) {
                Some(material) if !others.contains(&material) => {
                    if done.insert(material) {
                        let mut edits = Edits::default();
                        self.textured(material, &mut edits)?;
                        self.edits.extend(edits);
                    }
                }
                material => self.own(primitive, material)?,
            }
        }
        Ok(())
    }

    /// Gives a primitive a material of its own: a copy, or an empty one, as glTF takes for granted.
    fn own(&mut self, primitive: &Range<usize>, material: Option<usize>) -> Result<(), GlbError> {
        let copy = match material {
            Some(material) => {
                let mut edits = Edits::default();
                let range = self.textured(material, &mut edits)?;
                String::from_utf8_lossy(&edits.apply(self.text, range)).into_owned()
            }
            None => format!(r#"{{"occlusionTexture":{}}}"#, self.texture),
        };
        let known = self.new.iter().position(|new| *new == copy);
        let idx = known.unwrap_or(self.new.len());
        if known.is_none() {
            self.new.push(copy);
        }
        let member = ("material", (self.given.len() + idx).to_string());
        self.edits.set(self.text, primitive, &[member]);
        Ok(())
    }

    /// Adds the edit that gives a material the texture, and returns the material.
    fn textured(&self, material: usize, edits: &mut Edits) -> Result<Range<usize>, GlbError> {
        let range = self
            .given
            .get(material)
            .ok_or(GlbError::Missing("such material"))?;
        let member = ("occlusionTexture", self.texture.clone());
        edits.set(self.text, range, &[member]);
        Ok(range.clone())
    }

    fn primitives(&self, mesh: &Range<usize>) -> Vec<Range<usize>> {
        let list = self.text.member(mesh, "primitives");
        list.map_or(vec![], |list| self.text.elements(&list))
    }

    fn material(&self, primitive: &Range<usize>) -> Option<usize> {
        let idx = self.text.member(primitive, "material")?;
        serde_json::from_slice(&self.text.0[idx]).ok()
    }
}
