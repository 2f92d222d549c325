// The part of a kernel's workgroups that a dispatch runs. Work is split so that no dispatch takes
// long.

struct Chunk {
    /// The first workgroup.
    first: u32,
}

/// The chunk of this dispatch.
@group(0) @binding(0) var<uniform> chunk: Chunk;
