//! A small glTF file to change for each test.

use gltf_json::Value;

use crate::mesh::{LoadError, LoadedMesh};

/// A file's JSON and one buffer: a unit right triangle in the xy-plane as floats (36 bytes), and the
/// indices 0, 1, 2, 3 as bytes, with a fourth vertex for strips.
pub(super) struct File {
    pub json: Value,
    pub buffer: Vec<u8>,
}

pub(super) const TRIANGLE: [[f32; 3]; 4] =
    [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.5]];

fn value(text: &str) -> Value {
    gltf_json::deserialize::from_str(text).unwrap()
}

impl File {
    /// Returns a file whose only mesh, `m`, is the first three vertices, posed by these nodes.
    pub(super) fn new(nodes: &str) -> Self {
        let mut buffer: Vec<u8> = TRIANGLE
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        buffer.extend([0, 1, 2, 3]);
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
            "nodes": {nodes},
            "meshes": [{{"name": "m", "primitives": [
                {{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
            "accessors": [
                {{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                  "min": [0, 0, 0], "max": [1, 1, 0.5]}},
                {{"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 48}},
                {{"buffer": 0, "byteOffset": 48, "byteLength": 4}}],
            "buffers": [{{"byteLength": 52}}]}}"#
        );
        Self {
            json: value(&json),
            buffer,
        }
    }

    pub(super) fn set(mut self, pointer: &str, new: &str) -> Self {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = self.json.pointer_mut(parent).expect(pointer);
        parent[key] = value(new);
        self
    }

    pub(super) fn replace(mut self, pointer: &str, new: &str) -> Self {
        *self.json.pointer_mut(pointer).expect(pointer) = value(new);
        self
    }

    pub(super) fn glb(&self) -> Vec<u8> {
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + json.len() + 8 + self.buffer.len();
        let mut file = b"glTF\x02\0\0\0".to_vec();
        file.extend((length as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.buffer)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }

    pub(super) fn load(&self) -> Result<LoadedMesh, LoadError> {
        LoadedMesh::from_bytes("a.glb", self.glb(), &|_| unreachable!("all is in the file"))
    }

    pub(super) fn mesh(&self) -> LoadedMesh {
        self.load().unwrap()
    }

    pub(super) fn error(&self) -> String {
        let error = self.load().unwrap_err();
        assert!(matches!(error, LoadError::Gltf(_)), "{error}");
        error.to_string()
    }
}
