//! The direction sweep against rays at the same snapped mesh: two independent ways to the
//! same images.

use aogrid_bake_core::{
    BakeOptions, FaceBits, Placement, PreparedMesh, RawGrid, TriangleMesh, UNOBSERVED,
};
use aogrid_baker_cpu::{SnappedRays, Sweeper};

/// What came out of comparing.
pub struct Parity {
    /// Texels in all.
    pub texels: usize,
    /// Cell and texel of each difference.
    pub differences: Vec<(usize, usize)>,
    /// Texels that are occluded in the rays' images.
    pub occluded: usize,
    /// The sweep's moments.
    pub raw: RawGrid,
    /// The sweep's images.
    pub bits: FaceBits,
}

impl Parity {
    /// The longest run of cells with differing texels along any axis: a *streak*, if long.
    pub fn longest_run(&self) -> usize {
        let mut odd = vec![false; self.raw.counts.len()];
        for (cell, _) in &self.differences {
            odd[*cell] = true;
        }
        let spec = &self.raw.spec;
        let mut longest = 0;
        for idx in (0..odd.len()).filter(|&idx| odd[idx]) {
            for axis in 0..3 {
                let mut cell = spec.cell_at(idx);
                let mut length = 0;
                while cell[axis] < spec.resolution()[axis] && odd[spec.cell_idx(cell)] {
                    length += 1;
                    cell[axis] += 1;
                }
                longest = longest.max(length);
            }
        }
        longest
    }
}

/// The grid of a default bake at `resolution`, with the mesh on its lattice.
///
/// # Panics
///
/// If there is none.
pub fn prepared(mesh: &TriangleMesh, resolution: [u32; 3]) -> PreparedMesh {
    let placement = Placement {
        resolution,
        ..Placement::default()
    };
    let spec = placement.place(&mesh.bounds()).expect("it can be placed");
    PreparedMesh::new(mesh, spec, BakeOptions::SAMPLE_OFFSET).expect("it fits the sweep")
}

/// Bakes both ways.
///
/// # Panics
///
/// If nothing is occluded at all: then nothing was compared.
pub fn compare(mesh: &PreparedMesh, size: u32) -> Parity {
    let bake = Sweeper::new().bake_with_bits(mesh, size, UNOBSERVED);
    let (raw, bits) = bake.expect("it can be baked");
    let rays = SnappedRays::new(mesh).faces(size);
    let texels = bits.cells() * bits.texels();
    let occluded = (0..bits.cells())
        .flat_map(|cell| (0..bits.texels()).map(move |texel| (cell, texel)))
        .filter(|&(cell, texel)| rays.get(cell, texel))
        .count();
    assert!(occluded > 0 || mesh.triangles().is_empty());
    Parity {
        texels,
        differences: bits.differences(&rays),
        occluded,
        raw,
        bits,
    }
}
