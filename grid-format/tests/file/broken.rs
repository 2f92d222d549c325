use proptest::prelude::*;

use super::*;

#[test]
fn encoding_refuses_values_out_of_range() {
    let spec = GridSpec::new([8; 3], [0.0; 3], [1.0; 3]).unwrap();
    let encode = |change: &dyn Fn(&mut Vec<[f32; 4]>)| {
        let mut cells = vec![[0.0; 4]; 512];
        change(&mut cells);
        let format = TexelFormat::F32;
        Grid::encode(spec, Encoding::Cone, format, &cells, record())
    };
    assert!(encode(&|_| ()).is_ok());
    assert!(encode(&|cells| cells.truncate(511)).is_err());
    for (channel, value) in [
        (3, 1.01),
        (3, -0.01),
        (3, f32::NAN),
        (0, 1.01),
        (2, f32::NAN),
    ] {
        let error = encode(&|cells| cells[77][channel] = value).unwrap_err();
        assert!(error.to_string().contains("[5, 1, 1]"), "{error}");
    }
}

#[test]
fn every_truncated_length_is_an_error() {
    let bytes = small();
    for length in 0..bytes.len() {
        let error = Grid::from_bytes(&bytes[..length]).unwrap_err();
        let truncated = matches!(error, ReadError::Truncated { len, .. } if len == length as u64);
        assert!(truncated, "{length}: {error}");
    }
}

#[test]
fn extra_bytes_are_an_error() {
    let mut bytes = small();
    for extra in 1..=9 {
        bytes.push(0);
        let error = Grid::from_bytes(&bytes).unwrap_err();
        assert!(matches!(error, ReadError::TrailingBytes(n) if n == extra));
    }
}

#[test]
fn texels_out_of_range_are_errors() {
    let good = grid(Encoding::Cone, TexelFormat::F32).to_bytes();
    let last = good.len() - 4;
    for value in [f32::NAN, f32::INFINITY, -0.5, 1.5] {
        let mut bytes = good.clone();
        bytes[last..].copy_from_slice(&value.to_le_bytes());
        let error = Grid::from_bytes(&bytes).unwrap_err();
        assert!(matches!(error, ReadError::Texel([8, 7, 10])), "{error}");
    }
    // Byte 0 of a direction decodes to −128/127.
    let mut bytes = grid(Encoding::Cone, TexelFormat::Unorm8).to_bytes();
    let last = bytes.len() - 4;
    bytes[last] = 0;
    assert!(matches!(Grid::from_bytes(&bytes), Err(ReadError::Texel(_))));
}

proptest! {
    /// Reading returns a grid or an error for any changed bytes, and a grid can be written again.
    #[test]
    fn flipped_bytes_never_panic(
        flips in prop::collection::vec((0_usize..2000, any::<u8>()), 1..6),
        kind in 0_usize..6,
    ) {
        let (encoding, format) = kinds().nth(kind).unwrap();
        let mut bytes = grid(encoding, format).to_bytes();
        let length = bytes.len();
        for (at, mask) in flips {
            bytes[at % length] ^= mask;
        }
        let _ = Grid::from_bytes(&bytes).map(|grid| grid.to_bytes());
    }

    #[test]
    fn random_bytes_behind_the_identifier_never_panic(
        tail in prop::collection::vec(any::<u8>(), 0..400),
    ) {
        let bytes = [&small()[..12], &tail].concat();
        prop_assert!(Grid::from_bytes(&bytes).is_err());
    }
}
