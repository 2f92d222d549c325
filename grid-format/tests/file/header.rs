use super::*;

#[test]
fn other_kinds_of_files_are_identified_in_the_error() {
    assert!(matches!(with_u32(0, 0), ReadError::NotKtx2));
    // "«KTX 11»", KTX version 1.
    assert!(matches!(
        with_u32(4, u32::from_le_bytes(*b" 11\xBB")),
        ReadError::NotKtx2
    ));
    assert!(matches!(
        Grid::from_bytes(b"# Wavefront OBJ"),
        Err(ReadError::NotKtx2)
    ));
    let not_a_grid = |offset, value| match with_u32(offset, value) {
        ReadError::NotAGrid(reason) => reason,
        other => panic!("{offset} {value}: {other}"),
    };
    // VK_FORMAT_R8_SRGB, undefined, unknown.
    assert!(not_a_grid(at::FORMAT, 15).contains("R8_SRGB"));
    assert!(not_a_grid(at::FORMAT, 0).contains("undefined"));
    not_a_grid(at::FORMAT, u32::MAX);
    assert!(not_a_grid(at::DEPTH, 0).contains("3D"));
    for (offset, value) in [
        (at::TYPE_SIZE, 2),
        (at::WIDTH, 0),
        (at::LAYERS, 1),
        (at::FACES, 0),
        (at::FACES, 6),
        (at::LEVELS, 0),
        (at::LEVELS, 2),
        (at::LEVELS, u32::MAX),
        (at::SCHEME, 1),
        (at::SCHEME, 77),
        (at::DFD, 0),
        // Texel block dimensions of 256: adding 1 in a byte would overflow to 0.
        (at::DFD + 16, u32::MAX),
    ] {
        not_a_grid(offset, value);
    }
}

#[test]
fn wrong_lengths_and_offsets_are_errors() {
    let offsets = [
        at::DFD_OFFSET,
        at::DFD_LENGTH,
        at::KVD_OFFSET,
        at::KVD_LENGTH,
        at::SGD_OFFSET,
        at::SGD_OFFSET + 4,
        at::SGD_LENGTH,
        at::SGD_LENGTH + 4,
        at::LEVEL_OFFSET,
        at::LEVEL_OFFSET + 4,
        at::LEVEL_LENGTH,
        at::LEVEL_LENGTH + 4,
        at::LEVEL_UNCOMPRESSED,
        at::LEVEL_UNCOMPRESSED + 4,
        at::WIDTH,
        at::DEPTH,
    ];
    let good = small();
    for offset in offsets {
        let bytes = good[offset..offset + 4].try_into().unwrap();
        let correct = u32::from_le_bytes(bytes);
        let wrong = [
            0,
            1,
            8,
            correct.wrapping_add(1),
            correct.wrapping_sub(1),
            correct ^ 4,
        ];
        let wrong = wrong.into_iter().chain([1 << 31, u32::MAX, u32::MAX - 3]);
        for value in wrong.filter(|value| *value != correct) {
            with_u32(offset, value);
        }
    }
}

#[test]
fn oversized_dimensions_are_errors_before_anything_is_allocated() {
    for offset in [at::WIDTH, at::DEPTH] {
        for size in [2049, 1 << 20, u32::MAX] {
            let error = with_u32(offset, size);
            assert!(matches!(error, ReadError::Spec(_)), "{error}");
        }
    }
    // Each axis is valid by itself, but there are too many cells in all.
    let mut bytes = small();
    for axis in 0..3 {
        bytes[at::WIDTH + 4 * axis..][..4].copy_from_slice(&2048_u32.to_le_bytes());
    }
    assert!(matches!(Grid::from_bytes(&bytes), Err(ReadError::Spec(_))));
}
