//! Writing: grid to bytes.

use ::ktx2::{Header, Index, LevelIndex};

use super::layout::{
    self, FileMetadata, METADATA_KEY, ORIENTATION, ORIENTATION_KEY, PROFILE_MAJOR, PROFILE_MINOR,
    WRITER_KEY,
};
use crate::Grid;

impl Grid {
    /// Returns the bytes of the grid's file. Equal grids give equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        // All offsets are known beforehand, so that the bytes are written in one go.
        let format = layout::vk_format(self.encoding.channels(), self.format);
        let (descriptor, type_size) = layout::descriptor(format);
        let key_values = self.key_values();
        let kvd_start = layout::DFD_START + descriptor.len();
        let kvd_end = kvd_start + key_values.len();
        let level_start = layout::level_start(kvd_end, self.texel_bytes());

        let [nx, ny, nz] = self.spec.resolution();
        let header = Header {
            format: Some(format),
            type_size,
            pixel_width: nx,
            pixel_height: ny,
            pixel_depth: nz,
            layer_count: 0,
            face_count: 1,
            level_count: 1,
            supercompression_scheme: None,
            index: Index {
                dfd_byte_offset: layout::DFD_START as u32,
                dfd_byte_length: descriptor.len() as u32,
                kvd_byte_offset: kvd_start as u32,
                kvd_byte_length: key_values.len() as u32,
                sgd_byte_offset: 0,
                sgd_byte_length: 0,
            },
        };
        let level = LevelIndex {
            byte_offset: level_start as u64,
            byte_length: self.texels.len() as u64,
            uncompressed_byte_length: self.texels.len() as u64,
        };

        let mut bytes = Vec::with_capacity(level_start + self.texels.len());
        bytes.extend(header.as_bytes());
        bytes.extend(level.as_bytes());
        bytes.extend(descriptor);
        bytes.extend(key_values);
        bytes.resize(level_start, 0);
        bytes.extend(&self.texels);
        bytes
    }

    fn key_values(&self) -> Vec<u8> {
        let metadata = FileMetadata {
            version: format!("{PROFILE_MAJOR}.{PROFILE_MINOR}"),
            encoding: self.encoding.name().to_owned(),
            center: self.spec.center(),
            half_extents: self.spec.half_extents(),
            origin: self.spec.origin(),
            bake: self.record.clone(),
            mean: self.statistics.mean,
            largest: self.statistics.largest,
            texels_blake3: self.checksum.clone(),
        };
        let json =
            serde_json::to_string(&metadata).expect("strings and finite numbers have a JSON form");
        let mut bytes = Vec::new();
        // KTX2 requires the keys sorted by code point: capitals come first.
        push_key_value(&mut bytes, ORIENTATION_KEY, ORIENTATION);
        push_key_value(&mut bytes, WRITER_KEY, &self.writer);
        push_key_value(&mut bytes, METADATA_KEY, &json);
        bytes
    }
}

fn push_key_value(bytes: &mut Vec<u8>, key: &str, value: &str) {
    let length = key.len() + value.len() + 2;
    bytes.extend((length as u32).to_le_bytes());
    for text in [key, value] {
        bytes.extend(text.as_bytes());
        bytes.push(0);
    }
    bytes.resize(bytes.len().next_multiple_of(4), 0);
}
