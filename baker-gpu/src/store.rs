//! Buffers that are kept from bake to bake.

use std::collections::HashMap;

use wgpu::{Buffer, BufferUsages, Device};

/// Buffers by name. A new one is all zeros.
#[derive(Default)]
pub(crate) struct Store(HashMap<&'static str, Buffer>);

impl Store {
    /// A storage buffer of at least these bytes.
    pub(crate) fn storage(&mut self, device: &Device, name: &'static str, bytes: u64) -> Buffer {
        if let Some(buffer) = self.0.get(name).filter(|buffer| buffer.size() >= bytes) {
            return buffer.clone();
        }
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: bytes.max(16).next_multiple_of(16),
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.0.insert(name, buffer.clone());
        buffer
    }
}
