//! The chunks of a GLB file.

use super::GlbError;

/// The magic numbers of the container and its chunks.
const GLTF: &[u8; 4] = b"glTF";
const JSON: [u8; 4] = *b"JSON";
const BIN: [u8; 4] = *b"BIN\0";

/// The length of the container's header, and of a chunk's.
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// A GLB file taken apart.
pub(crate) struct Container<'a> {
    pub json: &'a [u8],
    pub bin: Option<&'a [u8]>,
    /// The chunks behind them, as they are.
    pub rest: &'a [u8],
}

fn word(bytes: &[u8], at: usize) -> Option<usize> {
    let word = bytes.get(at..at + 4)?.try_into().ok()?;
    Some(u32::from_le_bytes(word) as usize)
}

impl<'a> Container<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Result<Self, GlbError> {
        if !bytes.starts_with(GLTF) || word(bytes, 4) != Some(2) {
            return Err(GlbError::NotGlb);
        }
        let length = word(bytes, 8).ok_or(GlbError::Broken)?;
        let bytes = bytes.get(..length).ok_or(GlbError::Broken)?;
        let chunk = |at: usize, kind: [u8; 4]| {
            let length = word(bytes, at)?;
            let found = bytes.get(at + 4..at + CHUNK_HEADER)?;
            let data = bytes.get(at + CHUNK_HEADER..)?.get(..length)?;
            (found == kind).then_some(data)
        };
        let json = chunk(HEADER, JSON).ok_or(GlbError::Broken)?;
        let next = HEADER + CHUNK_HEADER + json.len();
        let bin = chunk(next, BIN);
        let end = next + bin.map_or(0, |bin| CHUNK_HEADER + bin.len());
        Ok(Self {
            json,
            bin,
            rest: bytes.get(end..).unwrap_or_default(),
        })
    }

    /// Returns the file with other JSON and another binary chunk, both padded as they must be.
    pub(crate) fn with(&self, mut json: Vec<u8>, mut bin: Vec<u8>) -> Result<Vec<u8>, GlbError> {
        json.resize(json.len().next_multiple_of(4), b' ');
        bin.resize(bin.len().next_multiple_of(4), 0);
        let length = HEADER + 2 * CHUNK_HEADER + json.len() + bin.len() + self.rest.len();
        let size = |n: usize| u32::try_from(n).map_err(|_| GlbError::TooLarge);
        let mut out = Vec::with_capacity(length);
        out.extend(GLTF);
        out.extend(2_u32.to_le_bytes());
        out.extend(size(length)?.to_le_bytes());
        for (kind, data) in [(JSON, &json), (BIN, &bin)] {
            out.extend(size(data.len())?.to_le_bytes());
            out.extend(kind);
            out.extend(data);
        }
        out.extend(self.rest);
        Ok(out)
    }
}
