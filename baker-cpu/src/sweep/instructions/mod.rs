//! The same code for wider registers.
//!
//! Most of the sweep has one source for all machines: loops over sixteen directions, which a
//! compiler turns into one instruction each if it may assume that the machine has it. Such a
//! piece of [`Work`] is compiled once for each set of instructions, and the best that the
//! machine has is chosen at run time. What a compiler does not find by itself are the methods of
//! [`Vectors`]: written once for all machines, as the truth, and again where that is worth it.
//!
//! No operation is left to a compiler's taste (Rust neither fuses nor reorders floats), so that
//! all sets give the same bits; tests compare them.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;

use aogrid_bake_core::PreparedMesh;

use super::crossings::{self, Batch, Edges, Row};
use super::levels::Levels;
use super::silhouettes::Find;
use super::steps::Steps;
use super::summation::{self, Mask, Texels};
use super::sums::RowSums;
#[cfg(target_arch = "x86_64")]
use {avx2::Avx2, avx512::Avx512};

/// What differs between sets of instructions. A value is the proof that the machine has them.
pub(super) trait Vectors: Copy {
    /// What [`Vectors::add`] looks up.
    type Shares;

    /// For one batch and block.
    fn shares(self, texels: &Texels) -> Self::Shares;

    /// See [`summation::Shares::add`]. Masks are as many as there are sums, a multiple of
    /// [`LANES`](super::frame::LANES).
    fn add(self, shares: &Self::Shares, masks: &[Mask], sums: RowSums<'_>);

    /// See [`Find::run_portable`].
    #[inline(always)]
    fn find(self, find: Find<'_>) {
        find.run_portable();
    }

    /// See [`summation::narrow_masks`].
    #[inline(always)]
    fn narrow_masks(self, counters: &[i8], masks: &mut [Mask]) -> bool {
        summation::narrow_masks(counters, masks)
    }

    /// [`Levels::rank`] of many vertices.
    #[inline(always)]
    fn ranks(self, levels: &Levels, v: &[f32], w: &[f32], ranks: &mut [i32]) {
        for (rank, (&v, &w)) in ranks.iter_mut().zip(v.iter().zip(w)) {
            *rank = levels.rank(v, w);
        }
    }

    /// See [`crossings::collect`].
    #[inline(always)]
    fn collect(self, row: &Row<'_>, edges: &mut Edges) {
        crossings::collect(row, edges);
    }

    /// See [`crossings::count`].
    #[inline(always)]
    fn count(self, batch: &Batch<'_>, edges: &Edges, unit: i8, steps: &mut Steps) {
        crossings::count(batch, edges, unit, steps);
    }
}

/// The shares of all masks, in parts of so many bits as choose one of the N numbers of a register:
/// quantity by quantity.
#[cfg(target_arch = "x86_64")]
#[repr(align(64))]
pub(super) struct Tables<const N: usize, const PARTS: usize>([[[i32; N]; 4]; PARTS]);

#[cfg(target_arch = "x86_64")]
impl<const N: usize, const PARTS: usize> Tables<N, PARTS> {
    fn new(texels: &Texels) -> Self {
        let bits = N.ilog2() as usize;
        Self(std::array::from_fn(|part| {
            let subsets = summation::subsets::<N>(texels, part * bits);
            std::array::from_fn(|quantity| subsets.map(|share| share[quantity]))
        }))
    }
}

/// What every machine has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Portable;

impl Vectors for Portable {
    type Shares = summation::Shares;

    fn shares(self, texels: &Texels) -> Self::Shares {
        summation::Shares::new(texels)
    }

    #[inline(always)]
    fn add(self, shares: &Self::Shares, masks: &[Mask], sums: RowSums<'_>) {
        shares.add(masks, sums);
    }
}

/// A set of instructions that this machine has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Instructions {
    Portable(Portable),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

/// Three times a vertex's number has to fit 31 bits.
const MOST_VERTICES: usize = (1 << 31) / 3;

/// What is compiled for each set. Implementations and all that they call in their inner loops
/// are marked `inline(always)`: what is not inlined is not compiled again.
pub(super) trait Work {
    fn run<V: Vectors>(self, vectors: V);
}

impl Instructions {
    /// All that this machine has, the best first; the portable ones are always there.
    pub(super) fn available() -> Vec<Self> {
        let mut sets = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            sets.extend(Avx512::new().map(Self::Avx512));
            sets.extend(Avx2::new().map(Self::Avx2));
        }
        sets.push(Self::Portable(Portable));
        sets
    }

    /// The name on command lines and in reports.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Portable(_) => "portable",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "avx512",
        }
    }

    /// These, unless the mesh is so large that its indices do not fit their registers.
    pub(super) fn fitting(self, mesh: &PreparedMesh) -> Self {
        let fits = mesh.vertices().len() <= MOST_VERTICES;
        if fits { self } else { Self::Portable(Portable) }
    }

    /// Runs `work`, compiled for this set.
    pub(super) fn run<W: Work>(self, work: W) {
        match self {
            Self::Portable(portable) => work.run(portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.run(work),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(avx512) => avx512.run(work),
        }
    }
}
