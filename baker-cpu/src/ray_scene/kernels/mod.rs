//! The tests of eight boxes and of eight triangles, for each SIMD level.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod portable;

use super::packed_ray::PackedRay;
use super::tree::{Lanes, Leaf, Node, Tree};

#[cfg(target_arch = "x86_64")]
use avx2::Avx2;
use portable::Portable;

/// The answers about the triangles of a leaf, a bit each. Triangles in neither set are
/// missed.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafHits {
    /// Triangles that the ray certainly hits.
    pub certain: u32,
    /// Triangles for which single precision cannot tell.
    pub doubt: u32,
}

/// The tests that differ between SIMD levels. A value proves that the machine has the level.
pub(super) trait Kernel: Copy {
    /// Returns the children whose boxes a ray meets, a bit each, and sets the distances at which it
    /// enters them.
    fn boxes(self, node: &Node, ray: &PackedRay, distances: &mut Lanes) -> u32;

    /// Loads a child into the cache ahead of its visit, where that is known to pay.
    #[inline(always)]
    fn prefetch(self, _tree: &Tree, _child: u32) {}

    /// Tests the triangles of a leaf; see [`PackedRay`] for the error bounds.
    fn triangles(self, leaf: &Leaf, ray: &PackedRay) -> LeafHits;
}

/// Code that is compiled for each SIMD level. Implementations and all that they call are marked
/// `inline(always)`: functions that are not inlined are not compiled again.
pub(super) trait Query {
    type Answer;

    fn run<K: Kernel>(self, kernel: K) -> Self::Answer;
}

/// A SIMD level that this machine has.
#[derive(Clone, Copy, Debug)]
pub(super) enum Level {
    Portable(Portable),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

impl Level {
    /// Returns all levels of this machine, the best first and the portable one last.
    pub(super) fn available() -> Vec<Self> {
        let mut levels = Vec::new();
        #[cfg(target_arch = "x86_64")]
        levels.extend(Avx2::new().map(Self::Avx2));
        levels.push(Self::Portable(Portable));
        levels
    }

    /// Returns the name on command lines and in reports.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Portable(_) => "portable",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
        }
    }

    /// Runs a query, compiled for this level.
    #[inline(always)]
    pub(super) fn run<Q: Query>(self, query: Q) -> Q::Answer {
        match self {
            Self::Portable(portable) => query.run(portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.run(query),
        }
    }
}
