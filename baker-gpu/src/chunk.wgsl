// Which part of a kernel's workgroups a dispatch runs: work is cut so that none takes long.

struct Chunk {
    /// The first workgroup.
    first: u32,
}

/// Of this dispatch.
@group(0) @binding(0) var<uniform> chunk: Chunk;
