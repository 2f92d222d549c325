//! A pool of buffers that are kept between bakes.

use std::collections::HashMap;

use wgpu::{Buffer, BufferUsages, Device};

/// Storage buffers by name. A new buffer is zero-initialized.
#[derive(Default)]
pub(crate) struct BufferPool(HashMap<&'static str, Buffer>);

impl BufferPool {
    /// Returns the storage buffer of this name with at least this many bytes.
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
