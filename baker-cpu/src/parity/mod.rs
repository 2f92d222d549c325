//! Comparison of the direction sweep with rays cast at the same quantized mesh: two independent
//! algorithms for the same images.

mod graze;

use aogrid_bake_core::{FaceBits, FaceSums, PreparedMesh, RawGrid, fixed_texels};

use crate::QuantizedMeshRays;

pub use graze::graze;

/// The share of texels that may differ: those whose ray passes an edge within the resolution of
/// single floats, 2⁻²⁴ of 32 cells. The project promises 8 in the 50 million texels of 32³ cells
/// with faces of 16².
pub const MAX_MISMATCH_RATE: f64 = 8.0 / 50e6;

/// The longest allowed run of differing cells along an axis. A longer one is a streak, the mark of
/// a fault in the sweep; two or three neighbors may graze the same edge by chance.
pub const MAX_RUN_LENGTH: usize = 3;

/// The maximum number of differences that are inspected one by one. More cannot be chance, and
/// each inspection visits every edge.
const MAX_INSPECTED: usize = 1000;

/// The result of a comparison.
pub struct Parity {
    /// Number of texels compared.
    pub texels: usize,
    /// Cell and texel of each difference.
    pub differences: Vec<(usize, usize)>,
    /// Distance in cells between the ray of each difference and the nearest edge; the first
    /// thousand.
    pub grazes: Vec<f64>,
    /// Upper bound in cells of the distance by which rounding to single floats displaces an edge.
    pub float_distance: f64,
    /// Number of texels that are occluded in the rays' images.
    pub occluded: usize,
    /// Number of cells whose count or moments are not bit for bit the sums over the sweep's images.
    pub wrong_sums: usize,
    /// The sweep's moments.
    pub raw: RawGrid,
    /// The sweep's images.
    pub bits: FaceBits,
}

impl Parity {
    /// Compares a sweep's moments and faces of `size`² texels with rays.
    pub fn new(mesh: &PreparedMesh, size: u32, (raw, bits): (RawGrid, FaceBits)) -> Self {
        let rays = QuantizedMeshRays::new(mesh).faces(size);
        let texels_of = |cell| (0..bits.texels()).map(move |texel| (cell, texel));
        let cells = 0..bits.cells();
        let occluded = cells
            .flat_map(texels_of)
            .filter(|&(c, t)| rays.get(c, t))
            .count();
        let differences = bits.differences(&rays);
        Self {
            texels: bits.cells() * bits.texels(),
            grazes: differences
                .iter()
                .take(MAX_INSPECTED)
                .map(|&difference| graze(mesh, size, difference))
                .collect(),
            differences,
            float_distance: float_distance(mesh),
            occluded,
            wrong_sums: wrong_sums(size, &raw, &bits),
            raw,
            bits,
        }
    }

    /// Returns the first violated condition other than the number of differing texels, if any.
    pub fn fault(&self) -> Option<String> {
        let allowed = self.float_distance;
        if self.occluded == 0 {
            return Some("nothing is occluded: nothing was compared".into());
        }
        if self.differences.len() > MAX_INSPECTED {
            return Some(format!("{} texels differ", self.differences.len()));
        }
        if let Some(far) = self.grazes.iter().find(|graze| **graze > allowed) {
            return Some(format!(
                "the ray of a differing texel is {far:.1e} cells from the nearest edge; \
                 {allowed:.1e} are allowed"
            ));
        }
        if self.longest_run() > MAX_RUN_LENGTH {
            return Some(format!(
                "a streak: {} cells in a row have differing texels",
                self.longest_run()
            ));
        }
        (self.wrong_sums > 0).then(|| {
            format!(
                "the moments of {} cells are not the sums over their texels",
                self.wrong_sums
            )
        })
    }

    /// Returns the length of the longest run of cells with differing texels along any axis.
    pub fn longest_run(&self) -> usize {
        let mut differs = vec![false; self.raw.counts.len()];
        for (cell, _) in &self.differences {
            differs[*cell] = true;
        }
        let spec = &self.raw.spec;
        let mut longest = 0;
        // Start a run at each differing cell and follow it along the three axes.
        for idx in (0..differs.len()).filter(|&idx| differs[idx]) {
            for axis in 0..3 {
                let mut cell = spec.cell_at(idx);
                let mut length = 0;
                while cell[axis] < spec.resolution()[axis] && differs[spec.cell_idx(cell)] {
                    length += 1;
                    cell[axis] += 1;
                }
                longest = longest.max(length);
            }
        }
        longest
    }
}

/// Counts the cells whose count or moments are not the sums over their texels in `bits`.
fn wrong_sums(size: u32, raw: &RawGrid, bits: &FaceBits) -> usize {
    let texels = fixed_texels(size);
    let is_wrong = |cell: &usize| {
        let mut sums = FaceSums::default();
        for (idx, texel) in texels.iter().enumerate() {
            if bits.get(*cell, idx) {
                sums.add(texel);
            }
        }
        raw.counts[*cell] != sums.count || raw.moments[*cell] != sums.moments(raw.directions)
    };
    (0..bits.cells()).filter(is_wrong).count()
}

/// Returns the error bound of an edge's position in single floats, in cells.
///
/// Each coordinate is rounded by up to 2⁻²⁴ of the largest, and so is every sum and product between
/// a vertex and a column: V − b·W twice, the crossing along the edge, its height, and the height
/// times a slope; 8 roundings. Each is proportional to the mesh's reach, and slopes grow with the
/// ratio of the longest to the shortest side of a cell.
fn float_distance(mesh: &PreparedMesh) -> f64 {
    let size = mesh.spec().cell_size();
    let [smallest, largest] = [f64::min, f64::max].map(|f| f(f(size[0], size[1]), size[2]));
    let roundings = 8.0;
    roundings * mesh.lattice().reach() * (1.0 + largest / smallest) / f64::from(1 << 24)
}
