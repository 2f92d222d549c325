//! The buffers of a glTF file: in the file, as data URIs, or in files beside it.

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf_json::Root;

use super::GltfError;
use crate::mesh::Resolver;

#[derive(Clone, Debug)]
pub(super) struct Buffer {
    pub bytes: Vec<u8>,
    /// The path of the other file that the bytes come from, relative to that of the model.
    pub path: Option<String>,
}

/// Reads all buffers of a file; `chunk` is the binary part of a GLB file.
pub(super) fn read(
    root: &Root,
    chunk: Option<&[u8]>,
    resolver: &Resolver<'_>,
) -> Result<Vec<Buffer>, GltfError> {
    let read = |(idx, buffer): (usize, &gltf_json::Buffer)| {
        let fault = |reason: String| GltfError::Buffer {
            buffer: idx,
            reason,
        };
        let (bytes, path) = match &buffer.uri {
            None => match chunk.filter(|_| idx == 0) {
                Some(chunk) => (chunk.to_vec(), None),
                // An extension's data; what uses it reaches beyond it.
                None => {
                    return Ok(Buffer {
                        bytes: vec![],
                        path: None,
                    });
                }
            },
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => (decode_data(data).map_err(fault)?, None),
                None => {
                    let path = relative_path(uri).map_err(fault)?;
                    let bytes = resolver(&path).map_err(|source| GltfError::External {
                        buffer: idx,
                        path: path.clone(),
                        source,
                    })?;
                    (bytes, Some(path))
                }
            },
        };
        let needed = buffer.byte_length.0;
        match bytes.len() as u64 >= needed {
            true => Ok(Buffer { bytes, path }),
            false => Err(fault(format!("it has {} bytes, not {needed}", bytes.len()))),
        }
    };
    root.buffers.iter().enumerate().map(read).collect()
}

/// Decodes a data URI without its scheme.
fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let Some((_, text)) = data.split_once(";base64,") else {
        return Err("its data URI is not in base64".into());
    };
    let padding = DecodePaddingMode::Indifferent;
    let config = GeneralPurposeConfig::new().with_decode_padding_mode(padding);
    GeneralPurpose::new(&STANDARD, config)
        .decode(text)
        .map_err(|error| format!("its data URI is malformed: {error}"))
}

/// Decodes a URI that is a relative path.
fn relative_path(uri: &str) -> Result<String, String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let hex = |digits: &[u8]| {
            let digits = std::str::from_utf8(digits).ok()?;
            u8::from_str_radix(digits, 16).ok()
        };
        let (decoded, remaining) = match after.get(..2).filter(|_| byte == b'%').and_then(hex) {
            Some(decoded) => (decoded, &after[2..]),
            None => (byte, after),
        };
        rest = remaining;
        bytes.push(decoded);
    }
    let path = String::from_utf8(bytes).map_err(|_| "its path is not UTF-8".to_owned())?;
    // Web addresses, absolute paths and drives are of another machine.
    match path.starts_with(['/', '\\']) || path.contains(':') || path.is_empty() {
        true => Err(format!("`{uri}` is not a path relative to the file")),
        false => Ok(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_decoded_and_relative() {
        assert_eq!(relative_path("a%20b/%c3%BC.bin").unwrap(), "a b/ü.bin");
        assert_eq!(relative_path("100%.bin").unwrap(), "100%.bin");
        for wrong in ["/etc/passwd", "http://x/a.bin", "C:/a.bin", "", "%ff"] {
            assert!(relative_path(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn data_is_decoded_with_and_without_padding() {
        for data in ["application/octet-stream;base64,AQI=", ";base64,AQI"] {
            assert_eq!(decode_data(data).unwrap(), [1, 2]);
        }
        assert!(decode_data("text/plain,hello").is_err());
        assert!(decode_data(";base64,?").is_err());
    }
}
