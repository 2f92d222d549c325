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

/// New files differ from the frozen ones in the writer's version and the hash of the texels alone.
#[test]
fn written_files_match_the_frozen_ones() {
    for (encoding, format) in kinds() {
        let frozen = std::fs::read(golden(encoding, format)).unwrap();
        let bytes = grid(encoding, format).to_bytes();
        let hash = blake3::hash(grid(encoding, format).texels()).to_hex();
        let added = format!(",\"texels_blake3\":\"{hash}\"}}");
        let json = |bytes: &[u8]| -> String {
            let start = find(bytes, b"{\"version\"");
            let length = bytes[start..].iter().position(|byte| *byte == 0).unwrap();
            String::from_utf8(bytes[start..start + length].to_vec()).unwrap()
        };
        let expected = json(&frozen).strip_suffix('}').unwrap().to_owned() + &added;
        assert_eq!(json(&bytes), expected, "{encoding:?} {format:?}");
        // Offsets move with the metadata's length; all else is alike.
        assert_eq!(bytes[..at::KVD_LENGTH], frozen[..at::KVD_LENGTH]);
        let texels = grid(encoding, format).texels().len();
        assert_eq!(
            bytes[bytes.len() - texels..],
            frozen[frozen.len() - texels..]
        );
    }
}

/// Mirrored or shuffled texels have the same mean and the same largest value.
#[test]
fn a_hash_tells_changed_texels() {
    let grid = grid(Encoding::Cone, TexelFormat::Unorm8);
    let bytes = grid.to_bytes();
    assert!(Grid::from_bytes(&bytes).unwrap().is_unchanged());
    let mut mirrored = bytes.clone();
    let start = bytes.len() - grid.texels().len();
    for row in mirrored[start..].chunks_exact_mut(9 * 4) {
        for x in 0..4 {
            for channel in 0..4 {
                row.swap(4 * x + channel, 4 * (8 - x) + channel);
            }
        }
    }
    let mirrored = Grid::from_bytes(&mirrored).unwrap();
    assert_eq!(mirrored.statistics(), mirrored.measure());
    assert!(!mirrored.is_unchanged());
    // Files without a hash fall back on the statistics.
    let old = std::fs::read(golden(Encoding::Cone, TexelFormat::Unorm8)).unwrap();
    assert!(Grid::from_bytes(&old).unwrap().is_unchanged());
}

#[test]
fn an_origin_is_kept() {
    let origin = [448_262.37, 5_411_932.545, 312.45];
    let spec = *grid(Encoding::Cone, TexelFormat::Unorm8).spec();
    let far = spec.with_origin(origin).unwrap();
    let format = TexelFormat::Unorm8;
    let grid = Grid::encode(far, Encoding::Cone, format, &cells(&far), record()).unwrap();
    let read = Grid::from_bytes(&grid.to_bytes()).unwrap();
    assert_eq!(read, grid);
    assert_eq!(read.spec().origin(), origin);
    assert!(spec.with_origin([0.0, f64::NAN, 0.0]).is_err());
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
