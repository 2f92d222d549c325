//! The vertices of a mesh in the file that it comes from, and their other attributes.

use std::ops::Range;

use super::gltf::GltfError;
use super::{Content, LoadedMesh, MeshFile, Pose};

/// A primitive of a glTF file where a node poses it.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedPrimitive {
    /// The index of the node.
    pub node: usize,
    /// The index of the mesh.
    pub mesh: usize,
    /// The index of the primitive within the mesh.
    pub primitive: usize,
    /// The vertices of the primitive, in its accessors' order, among those of the loaded mesh.
    pub vertices: Range<usize>,
    /// The pose of the node; that of a skinned mesh is the identity.
    pub pose: Pose,
}

impl MeshFile {
    /// Returns the normals of all vertices of `loaded`, which was parsed from this file, in the frame of
    /// the whole; zero for vertices without one. `None` if there are none at all, or the format's are not
    /// read: only those of glTF are.
    ///
    /// # Errors
    ///
    /// An accessor of normals is malformed.
    pub fn normals(&self, loaded: &LoadedMesh) -> Result<Option<Vec<[f32; 3]>>, GltfError> {
        let Content::Gltf(file) = &self.content else {
            return Ok(None);
        };
        let mut normals = vec![[0.0; 3]; loaded.mesh.positions().len()];
        let mut any = false;
        for posed in &loaded.primitives {
            let Some(own) = file.normals(posed.mesh, posed.primitive)? else {
                continue;
            };
            any = true;
            for (to, normal) in normals[posed.vertices.clone()].iter_mut().zip(own) {
                *to = posed.pose.normal(normal).map(|v| v as f32);
            }
        }
        Ok(any.then_some(normals))
    }

    /// Returns the texture coordinates of all vertices of `loaded`, which was parsed from this file: its
    /// set `set`, the attribute `TEXCOORD_0` for 0. `None` if the format's are not read: only those of
    /// glTF are.
    ///
    /// # Errors
    ///
    /// A primitive has no such set, or its accessor is malformed.
    pub fn texture_coordinates(
        &self,
        loaded: &LoadedMesh,
        set: u32,
    ) -> Result<Option<Vec<[f32; 2]>>, GltfError> {
        let Content::Gltf(file) = &self.content else {
            return Ok(None);
        };
        let mut all = vec![[0.0; 2]; loaded.mesh.positions().len()];
        for posed in &loaded.primitives {
            let own = file.texture_coordinates(posed.mesh, posed.primitive, set)?;
            all[posed.vertices.clone()].copy_from_slice(&own);
        }
        Ok(Some(all))
    }

    /// Returns the tangents of all vertices of `loaded`, which was parsed from this file, in the frame of
    /// the whole, with the sign of the bitangent in the fourth number. `None` unless all primitives have
    /// them.
    ///
    /// # Errors
    ///
    /// An accessor of tangents is malformed.
    pub fn tangents(&self, loaded: &LoadedMesh) -> Result<Option<Vec<[f32; 4]>>, GltfError> {
        let Content::Gltf(file) = &self.content else {
            return Ok(None);
        };
        let mut all = vec![[0.0; 4]; loaded.mesh.positions().len()];
        for posed in &loaded.primitives {
            let Some(own) = file.tangents(posed.mesh, posed.primitive)? else {
                return Ok(None);
            };
            let flip = posed.pose.determinant().signum();
            for (to, [x, y, z, sign]) in all[posed.vertices.clone()].iter_mut().zip(own) {
                let [x, y, z] = posed.pose.vector([x, y, z]);
                let length = (x * x + y * y + z * z).sqrt();
                let length = if length > 0.0 { length } else { 1.0 };
                *to = [x / length, y / length, z / length, sign * flip].map(|v| v as f32);
            }
        }
        Ok(Some(all))
    }

    /// Returns the colors of the vertices of a glTF primitive, the attribute `COLOR_0` with an alpha of 1
    /// where it has none; `None` if it has no colors.
    ///
    /// # Errors
    ///
    /// The accessor is malformed.
    pub fn colors(&self, posed: &PosedPrimitive) -> Result<Option<Vec<[f32; 4]>>, GltfError> {
        match &self.content {
            Content::Gltf(file) => file.colors(posed.mesh, posed.primitive),
            _ => Ok(None),
        }
    }
}
