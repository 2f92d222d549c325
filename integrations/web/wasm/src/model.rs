//! A model: its mesh, and what is made of it on demand.

use std::io;

use aogrid_bake_core::mesh::LoadedMesh;
use aogrid_baker_cpu::RayScene;

use crate::corners::{self, Corner};

/// A loaded model.
pub struct Model {
    /// The mesh with its name and hash.
    pub loaded: LoadedMesh,
    /// Three corners a triangle, with normals that are smooth but for creases.
    pub corners: Vec<Corner>,
    rays: Option<RayScene>,
}

impl Model {
    /// Loads a model from the bytes of a file called `name`.
    ///
    /// # Errors
    ///
    /// A sentence that says what is wrong with the file.
    pub fn load(name: &str, bytes: Vec<u8>) -> Result<Self, String> {
        let missing = |_: &str| {
            let why = "a browser cannot open it; pack everything into one .glb";
            Err(io::Error::new(io::ErrorKind::NotFound, why))
        };
        let loaded = LoadedMesh::from_bytes(name, bytes, &missing)
            .map_err(|error| format!("{name}: {}", with_sources(&error)))?;
        let corners = corners::of(&loaded.mesh);
        Ok(Self {
            loaded,
            corners,
            rays: None,
        })
    }

    /// Builds the tree for rays, if it is not there yet.
    pub fn prepare_rays(&mut self) {
        let mesh = &self.loaded.mesh;
        self.rays.get_or_insert_with(|| RayScene::new(mesh));
    }

    /// Returns the tree for rays, once it is [prepared](Model::prepare_rays).
    pub fn rays(&self) -> Option<&RayScene> {
        self.rays.as_ref()
    }

    /// Returns three positions and three normals a triangle, as single floats: 9 of each.
    pub fn corner_floats(&self) -> Vec<f32> {
        let floats = |corner: &Corner| [corner.position, corner.normal].concat();
        self.corners.iter().flat_map(floats).collect()
    }
}

/// Returns the message of an error and of those behind it.
pub fn with_sources(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(inner) = source {
        text += &format!(": {inner}");
        source = inner.source();
    }
    text
}
