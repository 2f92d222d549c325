#![no_main]

use std::path::Path;

use aogrid_scene::LoadOptions;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    // Files of this machine are not read: they would make runs differ.
    if text.contains("file") {
        return;
    }
    let path = Path::new("missing/scene.toml");
    if let Ok(scene) = aogrid_scene::parse(path, text, LoadOptions::default()) {
        assert!(
            scene
                .instances
                .iter()
                .all(|instance| instance.mesh < scene.meshes.len())
        );
    }
});
