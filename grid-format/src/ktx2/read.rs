//! Reading: bytes to grid. Everything is validated here, once, so that every [`Grid`] is valid.
//!
//! For one level the KTX2 layout is fixed, so each offset has exactly one valid value. That rules out
//! overlapping and hidden sections. No allocation exceeds the file's own length by more than a
//! constant, but for the texels of a supercompressed file, which are allocated as they are unpacked.

use ::ktx2::{Header, LevelIndex};
use serde::Deserialize;

use super::layout::{self, FileMetadata, METADATA_KEY, PROFILE_MAJOR, WRITER_KEY};
use super::unpack;
use crate::{Encoding, Grid, GridSpec, ReadError, Statistics, TexelFormat};

impl Grid {
    /// Reads a grid from the bytes of its file.
    ///
    /// # Errors
    ///
    /// The bytes are not exactly what [`Grid::to_bytes`] writes. Unknown JSON keys, unknown
    /// key/value pairs and a newer minor version are accepted. Never panics.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReadError> {
        // The sections are checked in file order, each at the offset where the one before it ends.
        let header = read_header(bytes)?;
        let (channels, format) = check_kind(&header)?;
        let kvd_start = check_descriptor(bytes, &header)?;
        let (kvd, kvd_end) = key_value_section(bytes, &header, kvd_start)?;
        let pairs = parse_key_values(kvd)?;
        let metadata = parse_metadata(&pairs)?;
        let encoding = Encoding::from_name(&metadata.encoding)
            .ok_or_else(|| ReadError::UnknownEncoding(metadata.encoding.clone()))?;
        if encoding.channels() != channels {
            return Err(ReadError::Channels {
                encoding: encoding.name(),
                expected: encoding.channels(),
                found: channels,
            });
        }
        // The resolution is bounded before anything is sized by it.
        let resolution = [header.pixel_width, header.pixel_height, header.pixel_depth];
        let spec = GridSpec::new(resolution, metadata.center, metadata.half_extents)?
            .with_origin(metadata.origin)?;
        let texel_bytes = encoding.channels() * format.channel_bytes();
        let texels = level(bytes, kvd_end, texel_bytes, &spec, &header)?;
        let grid = Self {
            spec,
            encoding,
            format,
            statistics: read_statistics(&metadata)?,
            record: metadata.bake,
            writer: find(&pairs, WRITER_KEY).unwrap_or_default().to_owned(),
            checksum: metadata.texels_blake3,
            texels,
        };
        grid.check_texels()?;
        Ok(grid)
    }

    fn check_texels(&self) -> Result<(), ReadError> {
        let mut texels = self.texels.chunks_exact(self.texel_bytes());
        match texels.position(|texel| !self.encoding.is_in_range(self.format, texel)) {
            Some(idx) => Err(ReadError::Texel(self.spec.cell_at(idx))),
            None => Ok(()),
        }
    }
}

fn read_header(bytes: &[u8]) -> Result<Header, ReadError> {
    if bytes.len() >= ::ktx2::MAGIC.len() && !bytes.starts_with(&::ktx2::MAGIC) {
        return Err(ReadError::NotKtx2);
    }
    let head = slice(bytes, 0, Header::LENGTH, "the header")?;
    let head = head.try_into().expect("the slice has the header's length");
    Header::from_bytes(head).map_err(|error| ReadError::NotAGrid(error.to_string()))
}

/// Returns the number of channels and the texel format of the texture's Vulkan format.
fn check_kind(header: &Header) -> Result<(usize, TexelFormat), ReadError> {
    let refuse = |reason: String| Err(ReadError::NotAGrid(reason));
    if let Some(scheme) = header.supercompression_scheme
        && !unpack::is_known(scheme)
    {
        return refuse(format!(
            "its supercompression {scheme:?} is not supported; zstd and zlib are"
        ));
    }
    let Some((channels, format)) = layout::texel_kind(header.format) else {
        return refuse(match header.format {
            Some(format) => format!("its format {format:?} is not supported by the profile"),
            None => "its format is undefined".into(),
        });
    };
    if header.pixel_height == 0 || header.pixel_depth == 0 {
        return refuse("it is not a 3D texture".into());
    }
    if (header.layer_count, header.face_count, header.level_count) != (0, 1, 1) {
        return refuse(format!(
            "layerCount, faceCount and levelCount are {}, {} and {}, not 0, 1 and 1",
            header.layer_count, header.face_count, header.level_count
        ));
    }
    Ok((channels, format))
}

/// Compares the data format descriptor with the one that the format requires, and returns its end.
fn check_descriptor(bytes: &[u8], header: &Header) -> Result<usize, ReadError> {
    let format = header.format.expect("`check_kind` has found a format");
    let (expected, type_size) = layout::descriptor(format);
    let what = "the data format descriptor";
    check_offset(what, layout::DFD_START, header.index.dfd_byte_offset.into())?;
    let found = slice(bytes, layout::DFD_START, expected.len(), what)?;
    let mut found = found.to_vec();
    if header.supercompression_scheme.is_some() {
        // Some tools keep the texel's size, others set it to zero, as KTX2 had it before.
        found[layout::BYTES_PLANES].copy_from_slice(&expected[layout::BYTES_PLANES]);
    }
    if header.index.dfd_byte_length as usize != expected.len()
        || found != expected
        || header.type_size != type_size
    {
        return Err(ReadError::NotAGrid(format!(
            "its data format descriptor does not describe {format:?}"
        )));
    }
    Ok(layout::DFD_START + expected.len())
}

fn key_value_section<'a>(
    bytes: &'a [u8],
    header: &Header,
    start: usize,
) -> Result<(&'a [u8], usize), ReadError> {
    let index = &header.index;
    if index.kvd_byte_length == 0 {
        return Err(ReadError::NoMetadata);
    }
    let what = "the key/value data";
    check_offset(what, start, index.kvd_byte_offset.into())?;
    let length = index.kvd_byte_length as usize;
    let kvd = slice(bytes, start, length, what)?;
    check_offset("supercompression global data", 0, index.sgd_byte_offset)?;
    if index.sgd_byte_length != 0 {
        return Err(ReadError::NotAGrid(
            "it has supercompression global data".into(),
        ));
    }
    Ok((kvd, start + length))
}

/// Returns the pairs of the key/value section, values without their terminating NUL. Pairs whose
/// value is not text are left out.
fn parse_key_values(mut kvd: &[u8]) -> Result<Vec<(&str, &str)>, ReadError> {
    let mut pairs = Vec::new();
    while !kvd.is_empty() {
        let Some((length, rest)) = kvd.split_first_chunk::<4>() else {
            return Err(ReadError::KeyValue("the length of a pair is truncated"));
        };
        let length = u32::from_le_bytes(*length) as usize;
        let Some(pair) = rest.get(..length) else {
            return Err(ReadError::KeyValue("a pair is longer than the section"));
        };
        let Some(nul) = pair.iter().position(|&byte| byte == 0) else {
            return Err(ReadError::KeyValue("a key is not NUL-terminated"));
        };
        let key = std::str::from_utf8(&pair[..nul])
            .map_err(|_| ReadError::KeyValue("a key is not UTF-8"))?;
        let value = pair[nul + 1..].strip_suffix(&[0]);
        if let Some(Ok(value)) = value.map(std::str::from_utf8) {
            pairs.push((key, value));
        }
        // KTX2 requires the padding of the last pair, too.
        kvd = rest
            .get(length.next_multiple_of(4)..)
            .ok_or(ReadError::KeyValue("the padding of a pair is truncated"))?;
    }
    Ok(pairs)
}

fn find<'a>(pairs: &[(&str, &'a str)], key: &str) -> Option<&'a str> {
    pairs
        .iter()
        .find(|(name, _)| *name == key)
        .map(|(_, value)| *value)
}

fn parse_metadata(pairs: &[(&str, &str)]) -> Result<FileMetadata, ReadError> {
    /// The field that every version of the profile has.
    #[derive(Deserialize)]
    struct Version {
        version: String,
    }
    // The version alone is parsed first: a newer major version may have other fields.
    let json = find(pairs, METADATA_KEY).ok_or(ReadError::NoMetadata)?;
    let Version { version } = serde_json::from_str(json).map_err(ReadError::Metadata)?;
    let major = version
        .split_once('.')
        .and_then(|(major, _)| major.parse().ok());
    match major {
        Some(PROFILE_MAJOR) => serde_json::from_str(json).map_err(ReadError::Metadata),
        Some(newer) if newer > PROFILE_MAJOR => Err(ReadError::NewerVersion(newer)),
        _ => Err(ReadError::MetadataRange("version")),
    }
}

fn read_statistics(metadata: &FileMetadata) -> Result<Statistics, ReadError> {
    let fractions = [
        ("mean", metadata.mean),
        ("largest", metadata.largest.into()),
    ];
    let invalid = fractions.iter().find(|(_, v)| !(0.0..=1.0).contains(v));
    let name = invalid
        .map(|(name, _)| *name)
        .or(metadata.bake.out_of_range());
    match name {
        Some(name) => Err(ReadError::MetadataRange(name)),
        None => Ok(Statistics {
            mean: metadata.mean,
            largest: metadata.largest,
        }),
    }
}

/// Returns the texels of the only level, which ends the file.
fn level(
    bytes: &[u8],
    kvd_end: usize,
    texel_bytes: usize,
    spec: &GridSpec,
    header: &Header,
) -> Result<Vec<u8>, ReadError> {
    let entry = slice(bytes, Header::LENGTH, LevelIndex::LENGTH, "the level index")?;
    let entry = LevelIndex::from_bytes(entry.try_into().expect("the slice has an entry's length"));
    // Supercompressed levels are not aligned.
    let start = match header.supercompression_scheme {
        None => layout::level_start(kvd_end, texel_bytes),
        Some(_) => kvd_end,
    };
    check_offset("the level", start, entry.byte_offset)?;
    let length = spec.cell_count() * texel_bytes;
    check_length(length, entry.uncompressed_byte_length)?;
    if header.supercompression_scheme.is_none() {
        check_length(length, entry.byte_length)?;
    }
    let stored = usize::try_from(entry.byte_length).unwrap_or(usize::MAX);
    let data = slice(bytes, start, stored, "the level")?;
    match bytes.len() - (start + stored) {
        0 => {}
        extra => return Err(ReadError::TrailingBytes(extra as u64)),
    }
    match header.supercompression_scheme {
        None => Ok(data.to_vec()),
        Some(scheme) => unpack::unpack(scheme, data, length),
    }
}

fn check_length(expected: usize, found: u64) -> Result<(), ReadError> {
    let expected = expected as u64;
    match found == expected {
        true => Ok(()),
        false => Err(ReadError::LevelLength { expected, found }),
    }
}

fn check_offset(what: &'static str, expected: usize, found: u64) -> Result<(), ReadError> {
    if found == expected as u64 {
        return Ok(());
    }
    Err(ReadError::Misplaced {
        what,
        expected: expected as u64,
        found,
    })
}

fn slice<'a>(
    bytes: &'a [u8],
    start: usize,
    length: usize,
    what: &'static str,
) -> Result<&'a [u8], ReadError> {
    let end = start.saturating_add(length);
    bytes.get(start..end).ok_or(ReadError::Truncated {
        what,
        end: end as u64,
        len: bytes.len() as u64,
    })
}
