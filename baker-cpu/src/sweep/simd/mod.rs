//! SIMD levels: the same code compiled for wider registers.
//!
//! Most of the sweep has one source for all machines: loops over sixteen directions, which a
//! compiler turns into single instructions if it may assume that the machine has them. Such a
//! [`SimdKernel`] is compiled once for each SIMD level, and the best level of the machine is
//! selected at run time. Code that compilers do not vectorize well is in the methods of [`Simd`]: a
//! portable version, which serves as the reference, and hand-written ones where that pays off.
//!
//! Results are bit-identical across SIMD levels: Rust neither fuses nor reorders floating-point
//! operations. Tests compare the levels.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
pub(super) mod portable;

use aogrid_bake_core::PreparedMesh;

use super::data::{
    Batch, BlockTexels, DeltaBuffer, EdgeBuffer, Levels, Mask, RowMoments, SilhouetteChunk,
    SilhouetteSearch,
};
pub(super) use portable::summation::{is_zero, masks};
use portable::{crossings, silhouettes, summation};

#[cfg(target_arch = "x86_64")]
use {super::data::subset_sums, avx2::Avx2, avx512::Avx512};

/// The operations that differ between SIMD levels. A value proves that the machine has the level.
pub(super) trait Simd: Copy {
    /// The table that [`Simd::accumulate`] looks up.
    type Lookup;

    /// Builds the table of one batch and block.
    fn mask_lookup(self, texels: &BlockTexels) -> Self::Lookup;

    /// Adds the moments of masks: see [`summation::MaskLookup::accumulate`]. There is a mask for
    /// each cell of the padded row, a multiple of [`LANES`](aogrid_bake_core::sweep::LANES).
    fn accumulate(self, lookup: &Self::Lookup, masks: &[Mask], moments: RowMoments<'_>);

    /// Finds silhouettes: see [`silhouettes::find`].
    #[inline(always)]
    fn find_silhouettes(self, search: SilhouetteSearch<'_>) {
        silhouettes::find(search);
    }

    /// Computes masks from byte counters: see [`summation::narrow_masks`].
    #[inline(always)]
    fn narrow_masks(self, counters: &[i8], masks: &mut [Mask]) -> bool {
        summation::narrow_masks(counters, masks)
    }

    /// Computes [`Levels::rank`] of many vertices.
    #[inline(always)]
    fn ranks(self, levels: &Levels, v: &[f32], w: &[f32], ranks: &mut [i32]) {
        for (rank, (&v, &w)) in ranks.iter_mut().zip(v.iter().zip(w)) {
            *rank = levels.rank(v, w);
        }
    }

    /// Collects the edges that cross a level: see [`crossings::collect`].
    #[inline(always)]
    fn collect(self, chunk: &SilhouetteChunk<'_>, edges: &mut EdgeBuffer) {
        crossings::collect(chunk, edges);
    }

    /// Counts edges at the rows that they cross: see [`crossings::count`].
    #[inline(always)]
    fn count(self, batch: &Batch<'_>, edges: &EdgeBuffer, unit: i8, deltas: &mut DeltaBuffer) {
        crossings::count(batch, edges, unit, deltas);
    }
}

/// The moments of all masks, as one table for each part of the bits. A table has N entries, the
/// lanes of a register, and is stored quantity by quantity.
#[cfg(target_arch = "x86_64")]
#[repr(align(64))]
pub(super) struct RegisterLookup<const N: usize, const PARTS: usize>([[[i32; N]; 4]; PARTS]);

#[cfg(target_arch = "x86_64")]
impl<const N: usize, const PARTS: usize> RegisterLookup<N, PARTS> {
    fn new(texels: &BlockTexels) -> Self {
        let bits = N.ilog2() as usize;
        Self(std::array::from_fn(|part| {
            let subset_sums = subset_sums::<N>(texels, part * bits);
            std::array::from_fn(|quantity| subset_sums.map(|moment| moment[quantity]))
        }))
    }
}

/// The level that every machine has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Portable;

impl Simd for Portable {
    type Lookup = summation::MaskLookup;

    fn mask_lookup(self, texels: &BlockTexels) -> Self::Lookup {
        summation::MaskLookup::new(texels)
    }

    #[inline(always)]
    fn accumulate(self, lookup: &Self::Lookup, masks: &[Mask], moments: RowMoments<'_>) {
        lookup.accumulate(masks, moments);
    }
}

/// A SIMD level that this machine has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SimdLevel {
    Portable(Portable),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

/// The maximum number of vertices: three times a vertex's index has to fit 31 bits.
const MAX_VERTICES: usize = (1 << 31) / 3;

/// Code that is compiled for each SIMD level. Implementations and all that they call in their inner
/// loops are marked `inline(always)`: functions that are not inlined are not compiled again.
pub(super) trait SimdKernel {
    fn run<S: Simd>(self, simd: S);
}

impl SimdLevel {
    /// Returns all levels of this machine, the best first and the portable one last.
    pub(super) fn available() -> Vec<Self> {
        let mut levels = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(Avx512::new().map(Self::Avx512));
            levels.extend(Avx2::new().map(Self::Avx2));
        }
        levels.push(Self::Portable(Portable));
        levels
    }

    /// Returns the name on command lines and in reports.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Portable(_) => "portable",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "avx512",
        }
    }

    /// Returns this level, or the portable one if the mesh is so large that its indices do not fit
    /// in 32-bit lanes.
    pub(super) fn supported_for(self, mesh: &PreparedMesh) -> Self {
        let fits = mesh.vertices().len() <= MAX_VERTICES;
        if fits { self } else { Self::Portable(Portable) }
    }

    /// Runs `kernel`, compiled for this level.
    pub(super) fn run<K: SimdKernel>(self, kernel: K) {
        match self {
            Self::Portable(portable) => kernel.run(portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(avx512) => avx512.run(kernel),
        }
    }
}
