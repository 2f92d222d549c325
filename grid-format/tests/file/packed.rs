use std::io::Write;

use super::*;

/// Returns the file with its level replaced by `data`, supercompressed by a scheme.
fn repacked(plain: &[u8], texels: usize, scheme: u32, data: &[u8]) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(plain[at..at + 4].try_into().unwrap());
    let end = (word(at::KVD_OFFSET) + word(at::KVD_LENGTH)) as usize;
    let mut bytes = plain[..end].to_vec();
    bytes[at::SCHEME..at::SCHEME + 4].copy_from_slice(&scheme.to_le_bytes());
    for (at, value) in [
        (at::LEVEL_OFFSET, end),
        (at::LEVEL_LENGTH, data.len()),
        (at::LEVEL_UNCOMPRESSED, texels),
    ] {
        bytes[at..at + 8].copy_from_slice(&(value as u64).to_le_bytes());
    }
    bytes.extend(data);
    bytes
}

fn zlib(data: &[u8]) -> Vec<u8> {
    let level = flate2::Compression::default();
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), level);
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

fn zstd(data: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(data, ruzstd::encoding::CompressionLevel::Fastest)
}

/// Report 22: grids recompressed by other tools.
#[test]
fn grids_packed_by_other_tools_are_read() {
    for (encoding, format) in kinds() {
        let grid = grid(encoding, format);
        let (plain, texels) = (grid.to_bytes(), grid.texels());
        for (scheme, data) in [(2, zstd(texels)), (3, zlib(texels))] {
            let packed = repacked(&plain, texels.len(), scheme, &data);
            let read = Grid::from_bytes(&packed).unwrap();
            assert_eq!(read, grid);
            assert!(read.is_unchanged());
            // KTX2 once had the size of a texel's plane at zero there.
            let mut zero = packed.clone();
            zero[at::DFD + 20..at::DFD + 28].fill(0);
            assert_eq!(Grid::from_bytes(&zero).unwrap(), grid);
            let mut wrong = packed.clone();
            wrong[at::DFD + 12] ^= 1;
            assert!(Grid::from_bytes(&wrong).is_err());
        }
    }
}

#[test]
fn broken_data_and_wrong_lengths_are_refused() {
    let grid = grid(Encoding::Cone, TexelFormat::Unorm8);
    let (plain, texels) = (grid.to_bytes(), grid.texels());
    for (scheme, pack) in [(2, zstd as fn(&[u8]) -> Vec<u8>), (3, zlib)] {
        let read = |data: &[u8]| {
            let packed = repacked(&plain, texels.len(), scheme, data);
            Grid::from_bytes(&packed).unwrap_err()
        };
        let data = pack(texels);
        assert!(matches!(read(b"nonsense"), ReadError::Packed(_)));
        assert!(matches!(
            read(&data[..data.len() / 2]),
            ReadError::Packed(_)
        ));
        let expected = texels.len() as u64;
        for (other, length) in [(&texels[..8], 8), (&[texels; 3].concat(), expected + 1)] {
            let error = read(&pack(other));
            let is_length = matches!(
                error,
                ReadError::LevelLength { expected: e, found } if e == expected && found == length
            );
            assert!(is_length, "{error}");
        }
    }
}
