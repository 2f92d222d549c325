//! Runs the reader of `docs/format.md` with Python, if it and NumPy are there.

use std::fs;
use std::path::Path;
use std::process::Command;

use aogrid_grid_format::Grid;
use aogrid_tests::skip;

/// Prints the channels of each grid file as the reader decodes them, and the largest a of its metadata.
const MAIN: &str = r#"
import sys
for path in sys.argv[1:]:
    metadata, texels = read_grid(path)
    print(json.dumps([metadata["largest"], list(texels.shape), texels.ravel().astype("f8").tolist()]))
"#;

/// The reader divides a byte once, the crate by way of a shader's value: some roundings of single floats
/// near 1.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

#[test]
fn the_documented_reader_reads_the_frozen_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let document = fs::read_to_string(root.join("docs/format.md")).unwrap();
    let (_, code) = document.split_once("```python\n").unwrap();
    let (code, _) = code.split_once("```").unwrap();
    let has_numpy = Command::new("python3")
        .args(["-c", "import numpy"])
        .output();
    if !has_numpy.is_ok_and(|output| output.status.success()) {
        return skip("python3 with NumPy is not there");
    }
    let folder = root.join("grid-format/tests/golden");
    let mut paths: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    let read = Command::new("python3")
        .args(["-c", &(code.to_owned() + MAIN)])
        .args(&paths)
        .output()
        .unwrap();
    assert!(
        read.status.success(),
        "{}",
        String::from_utf8_lossy(&read.stderr)
    );
    let lines = String::from_utf8(read.stdout).unwrap();
    assert_eq!(lines.lines().count(), 9);
    for (path, line) in paths.iter().zip(lines.lines()) {
        let grid = Grid::from_bytes(&fs::read(path).unwrap()).unwrap();
        let (largest, shape, found): (f64, [u32; 4], Vec<f64>) =
            serde_json::from_str(line).unwrap();
        let [nx, ny, nz] = grid.spec().resolution();
        assert_eq!(shape, [nz, ny, nx, grid.encoding().channels() as u32]);
        assert!((largest - f64::from(grid.statistics().largest)).abs() < ROUNDING);
        let expected = grid.decode();
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - f64::from(*expected)).abs() < ROUNDING, "{path:?}");
        }
    }
}
