use std::fs;
use std::path::Path;

use aogrid_bake_core::models::{Model, to_obj};
use aogrid_tests::files_with_ending;

/// The committed models, for the README's first command and for other programs' tests.
const COMMITTED: [Model; 4] = [Model::Box, Model::Table, Model::Robot, Model::SpaceShip];

#[test]
fn committed_models_match_the_generator() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets");
    assert_eq!(files_with_ending(&folder, ".obj").len(), COMMITTED.len());
    for sample in COMMITTED {
        let name = format!("{}.obj", sample.name());
        let committed = fs::read_to_string(folder.join(&name)).unwrap();
        let generated = to_obj(&sample.mesh(None).unwrap());
        let remedy = format!("cargo xtask model {} -o assets/{name}", sample.name());
        assert!(committed == generated, "assets/{name} is stale: {remedy}");
    }
}
