use std::fs;
use std::path::Path;

use aogrid_bake_core::samples::{Sample, to_obj};
use aogrid_tests::files_with_ending;

/// Models that are committed, for the README's first command and for other programs' tests.
const COMMITTED: [Sample; 4] = [Sample::Box, Sample::Table, Sample::Robot, Sample::SpaceShip];

#[test]
fn committed_models_are_what_the_generator_makes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets");
    assert_eq!(files_with_ending(&folder, ".obj").len(), COMMITTED.len());
    for sample in COMMITTED {
        let name = format!("{}.obj", sample.name());
        let committed = fs::read_to_string(folder.join(&name)).unwrap();
        let made = to_obj(&sample.mesh(None).unwrap());
        let remedy = format!("cargo xtask sample {} -o assets/{name}", sample.name());
        assert!(committed == made, "assets/{name} is stale: {remedy}");
    }
}
