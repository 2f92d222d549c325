use super::*;

fn golden(encoding: Encoding, format: TexelFormat) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    folder.join(format!("v1-{}-{}.ao.ktx2", encoding.name(), format.name()))
}

/// Files of profile version 1.0 as aogrid 0.1.0 wrote them. They must never be regenerated: a
/// failure means that old files are no longer read as before.
#[test]
fn frozen_files_are_still_read_alike() {
    for (encoding, format) in kinds() {
        let bytes = std::fs::read(golden(encoding, format)).unwrap();
        let read = Grid::from_bytes(&bytes).unwrap();
        assert_eq!(read.to_bytes(), bytes, "{encoding:?} {format:?}");
        let now = grid(encoding, format);
        assert_eq!(read.record(), now.record());
        assert_eq!(read.spec(), now.spec());
        assert_eq!(read.statistics(), now.statistics());
        assert_eq!(read.texels(), now.texels());
        assert_eq!(read.writer(), "aogrid 0.1.0");
    }
}

/// New files differ from the frozen ones in the writer's version alone.
#[test]
fn written_files_match_the_frozen_ones() {
    for (encoding, format) in kinds() {
        let frozen = std::fs::read(golden(encoding, format)).unwrap();
        let old = "aogrid 0.1.0";
        let new = Grid::current_writer();
        if new.len() == old.len() {
            let at = find(&frozen, old.as_bytes());
            let mut expected = frozen;
            expected[at..at + old.len()].copy_from_slice(new.as_bytes());
            assert_eq!(grid(encoding, format).to_bytes(), expected);
        } else {
            // Offsets move with the name's length. The test above compares what is read.
            assert_ne!(grid(encoding, format).to_bytes(), frozen);
        }
    }
}

#[test]
fn written_grids_are_read_back_within_the_error_bounds() {
    for (encoding, format) in kinds() {
        let grid = grid(encoding, format);
        let read = Grid::from_bytes(&grid.to_bytes()).unwrap();
        assert_eq!(read, grid);
        let [max_a, max_d] = encoding.max_error(format);
        for (idx, cell) in cells(grid.spec()).into_iter().enumerate() {
            let found = read.cell(idx);
            let rounding = 2.0 * f32::EPSILON;
            assert!((found[3] - cell[3]).abs() <= max_a + rounding);
            for x in 0..3 {
                let expected = if encoding.has_direction() {
                    cell[x]
                } else {
                    0.0
                };
                assert!((found[x] - expected).abs() <= max_d + rounding);
            }
        }
    }
}
