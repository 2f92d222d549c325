//! The buffers of one thread.

use super::data::{ByteCounters, DeltaBuffer, EdgeBuffer, MAX_GROUP_COUNTERS, Mask};
use super::moments::TileMoments;

/// The buffers of one thread.
pub(super) struct Workspace {
    pub ranks: Vec<i32>,
    pub edges: EdgeBuffer,
    pub deltas: DeltaBuffer,
    /// All zero between groups.
    pub counters: Box<ByteCounters>,
    pub masks: Vec<Mask>,
    /// The moments of a tile's cells: all zero between tiles.
    pub moments: TileMoments,
}

impl Default for Workspace {
    fn default() -> Self {
        let counters = vec![0; MAX_GROUP_COUNTERS].into_boxed_slice();
        Self {
            ranks: Vec::new(),
            edges: EdgeBuffer::default(),
            deltas: DeltaBuffer::default(),
            counters: counters
                .try_into()
                .expect("the length is MAX_GROUP_COUNTERS"),
            masks: Vec::new(),
            moments: TileMoments::default(),
        }
    }
}
