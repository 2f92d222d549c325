//! The file: bytes of a KTX2 texture with metadata, written and read.

mod layout;
mod read;
mod unpack;
mod write;

pub(crate) use layout::PROFILE_MAJOR;
