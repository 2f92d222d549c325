//! The vertices of a mesh in the file that it comes from, and their other attributes.

use std::ops::Range;

use super::gltf::GltfError;
use super::{Content, LoadError, LoadedMesh, MeshFile, Pose, obj};

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

/// The number and the direction that a vertex has in attributes of one's own.
pub type OwnAttributes = (f32, [f32; 3]);

impl MeshFile {
    /// Parses the mesh so that each vertex has one position and one pair of texture coordinates: an OBJ
    /// file has them apart.
    ///
    /// # Errors
    ///
    /// The file is malformed, needs what is not supported, or is an OBJ file without texture coordinates.
    pub fn parse_textured(&self) -> Result<LoadedMesh, LoadError> {
        match &self.content {
            Content::Obj(bytes) => Ok(self.loaded(obj::parse_textured(bytes)?.parsed)),
            _ => self.parse(),
        }
    }

    /// Returns the texture coordinates and the normals of an OBJ file's vertices, as
    /// [`MeshFile::parse_textured`] has them: v downward, and zero for vertices without a normal. `None` for
    /// other formats.
    ///
    /// # Errors
    ///
    /// The file is malformed, or has no texture coordinates.
    #[expect(
        clippy::type_complexity,
        reason = "two lists, one of which may be missing"
    )]
    pub fn obj_attributes(
        &self,
    ) -> Result<Option<(Vec<[f32; 2]>, Option<Vec<[f32; 3]>>)>, LoadError> {
        match &self.content {
            Content::Obj(bytes) => {
                let textured = obj::parse_textured(bytes)?;
                Ok(Some((textured.coordinates, textured.normals)))
            }
            _ => Ok(None),
        }
    }

    /// Returns the normals of all vertices of `loaded`, which was parsed from this file, in the frame of
    /// the whole; zero for vertices without one. `None` if there are none at all, or the file is no glTF.
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
    /// set `set`, the attribute `TEXCOORD_0` for 0. `None` if the file is no glTF.
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

    /// Returns the numbers of the attribute `scalars` and the directions of the attribute `normals`, in the
    /// frame of the whole, of all vertices of `loaded`, which was parsed from this file. `None` unless all
    /// primitives have both. The names begin with an underscore.
    ///
    /// # Errors
    ///
    /// An accessor is malformed.
    pub fn own_attributes(
        &self,
        loaded: &LoadedMesh,
        [scalars, normals]: [&str; 2],
    ) -> Result<Option<Vec<OwnAttributes>>, GltfError> {
        let Content::Gltf(file) = &self.content else {
            return Ok(None);
        };
        let mut all = vec![(0.0, [0.0; 3]); loaded.mesh.positions().len()];
        for posed in &loaded.primitives {
            let numbers = file.own::<1>(posed.mesh, posed.primitive, scalars)?;
            let directions = file.own::<3>(posed.mesh, posed.primitive, normals)?;
            let (Some(numbers), Some(directions)) = (numbers, directions) else {
                return Ok(None);
            };
            let to = all[posed.vertices.clone()].iter_mut();
            for (to, ([number], direction)) in to.zip(numbers.into_iter().zip(directions)) {
                let direction = posed.pose.normal(direction);
                *to = (number as f32, direction.map(|v| v as f32));
            }
        }
        Ok((!loaded.primitives.is_empty()).then_some(all))
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
