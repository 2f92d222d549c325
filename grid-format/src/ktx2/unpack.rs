//! Unpacking of supercompressed levels. aogrid writes none; other KTX2 tools pack grids on request.

use std::io::Read;

use ::ktx2::SupercompressionScheme;

use crate::ReadError;

/// Whether [`unpack`] can unpack the scheme.
pub(super) fn is_known(scheme: SupercompressionScheme) -> bool {
    [
        SupercompressionScheme::Zstandard,
        SupercompressionScheme::ZLIB,
    ]
    .contains(&scheme)
}

/// Unpacks `data`, which must give `length` bytes. The scheme must be known.
pub(super) fn unpack(
    scheme: SupercompressionScheme,
    data: &[u8],
    length: usize,
) -> Result<Vec<u8>, ReadError> {
    let fault = |reason: String| ReadError::Packed(reason);
    let mut texels = Vec::new();
    // One byte more shows that the data are too long.
    let limit = length as u64 + 1;
    let read = match scheme {
        SupercompressionScheme::ZLIB => flate2::read::ZlibDecoder::new(data)
            .take(limit)
            .read_to_end(&mut texels),
        _ => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(data);
            let decoder = decoder.map_err(|error| fault(error.to_string()))?;
            decoder.take(limit).read_to_end(&mut texels)
        }
    };
    read.map_err(|error| fault(error.to_string()))?;
    match texels.len() == length {
        true => Ok(texels),
        false => Err(ReadError::LevelLength {
            expected: length as u64,
            found: texels.len() as u64,
        }),
    }
}
