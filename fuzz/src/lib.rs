//! What the fuzz targets share. A reader must return a valid value or an error, whatever the bytes:
//! no panic, no endless loop, no memory beyond what the bytes can ask for.
//!
//! `cargo run --manifest-path fuzz/Cargo.toml --example seeds` writes seeds of every format into
//! `fuzz/corpus`, and `cargo +nightly fuzz run --sanitizer none obj` takes them from there.

use std::io;

use aogrid_bake_core::mesh::LoadedMesh;
use aogrid_scene::EnvironmentSource;

/// Loads bytes as the mesh file `name`, with zeros in every file that it names, and checks the mesh.
pub fn load_mesh(name: &str, bytes: &[u8]) {
    let resolver = |path: &str| match path.starts_with("missing") {
        true => Err(io::Error::from(io::ErrorKind::NotFound)),
        false => Ok(vec![0; 64]),
    };
    let Ok(loaded) = LoadedMesh::from_bytes(name, bytes.to_vec(), &resolver) else {
        return;
    };
    let mesh = &loaded.mesh;
    assert!(mesh.positions().iter().flatten().all(|v| v.is_finite()));
    let count = mesh.positions().len() as u32;
    assert!(mesh.triangles().iter().flatten().all(|idx| *idx < count));
    for idx in 0..mesh.parts().len().min(8) {
        // Parts without an area are errors.
        let _ = loaded.part(idx);
    }
}

/// Reads bytes as an environment map, and checks its radiance.
pub fn load_environment(name: &str, bytes: &[u8]) {
    let Ok((environment, _)) = EnvironmentSource::load_bytes(name, bytes) else {
        return;
    };
    for direction in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, -0.8]] {
        let radiance = environment.radiance(direction);
        assert!(radiance.iter().all(|v| v.is_finite() && *v >= 0.0));
    }
}
