//! The direction sweep against rays at the same snapped mesh: two independent ways to the
//! same images.

use aogrid_bake_core::{
    BakeOptions, FaceBits, Placement, PreparedMesh, RawGrid, TriangleMesh, UNOBSERVED,
};
use aogrid_baker_cpu::{SnappedRays, Sweeper};
use aogrid_baker_gpu as gpu;

use crate::graze;

/// What came out of comparing.
pub struct Parity {
    /// Texels in all.
    pub texels: usize,
    /// Cell and texel of each difference.
    pub differences: Vec<(usize, usize)>,
    /// How closely the ray of each difference passes an edge, in cells.
    pub grazes: Vec<f64>,
    /// How far apart, in cells, single floats let the two ways see an edge.
    pub float_distance: f64,
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
    against_rays(mesh, size, bake.expect("it can be baked"))
}

/// As [`compare`], with the GPU's sweep.
///
/// # Panics
///
/// As [`compare`].
pub fn compare_gpu(sweeper: &mut gpu::Sweeper, mesh: PreparedMesh, size: u32) -> Parity {
    let uploaded = sweeper.upload(mesh).expect("it fits the GPU");
    let bake = sweeper.bake_with_bits(&uploaded, size, UNOBSERVED);
    against_rays(uploaded.mesh(), size, bake.expect("it can be baked"))
}

fn against_rays(mesh: &PreparedMesh, size: u32, (raw, bits): (RawGrid, FaceBits)) -> Parity {
    let rays = SnappedRays::new(mesh).faces(size);
    let texels = bits.cells() * bits.texels();
    let occluded = (0..bits.cells())
        .flat_map(|cell| (0..bits.texels()).map(move |texel| (cell, texel)))
        .filter(|&(cell, texel)| rays.get(cell, texel))
        .count();
    let differences = bits.differences(&rays);
    assert!(occluded > 0 || mesh.triangles().is_empty());
    Parity {
        texels,
        grazes: differences
            .iter()
            .map(|&difference| graze(mesh, size, difference))
            .collect(),
        differences,
        float_distance: float_distance(mesh),
        occluded,
        raw,
        bits,
    }
}

/// Coordinates in single floats are off by 2⁻²⁴ of the largest, and so is every sum and product
/// on the way from a vertex to a column: V − b·W twice, the crossing along the edge, its height,
/// and the height times a slope; each as long as the mesh reaches, and steeper by as much as a
/// cell is longer than wide.
fn float_distance(mesh: &PreparedMesh) -> f64 {
    let size = mesh.spec().cell_size();
    let [smallest, largest] = [f64::min, f64::max].map(|f| f(f(size[0], size[1]), size[2]));
    let roundings = 8.0;
    roundings * mesh.lattice().reach() * (1.0 + largest / smallest) / f64::from(1 << 24)
}
