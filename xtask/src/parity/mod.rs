//! The direction sweep against rays at the same snapped mesh: two independent ways to the
//! same images.

mod graze;

use aogrid_bake_core::{FaceBits, FaceSums, PreparedMesh, RawGrid, fixed_texels};
use aogrid_baker_cpu::SnappedRays;

pub use graze::graze;

/// How many texels may differ, in all: those whose ray passes an edge within the distance that
/// single floats resolve, 2⁻²⁴ of 32 cells. The project promises 8 in the 50 million of 32³
/// cells with faces of 16².
pub const PROMISED: f64 = 8.0 / 50e6;

/// A streak is a row of cells that all differ. Two neighbours that graze the same edge are
/// none.
pub const LONGEST_RUN: usize = 3;

/// Differences that are looked at one by one, at most: more are no accident, and each takes a walk
/// over all edges.
const MOST_GRAZES: usize = 1000;

/// What came out of comparing.
pub struct Parity {
    /// Texels in all.
    pub texels: usize,
    /// Cell and texel of each difference.
    pub differences: Vec<(usize, usize)>,
    /// How closely the ray of each difference passes an edge, in cells; of the first thousand.
    pub grazes: Vec<f64>,
    /// How far apart, in cells, single floats let the two ways see an edge.
    pub float_distance: f64,
    /// Texels that are occluded in the rays' images.
    pub occluded: usize,
    /// Cells whose count or moments are not, bit for bit, the sums over the sweep's images.
    pub wrong_sums: usize,
    /// The sweep's moments.
    pub raw: RawGrid,
    /// The sweep's images.
    pub bits: FaceBits,
}

impl Parity {
    /// Compares a sweep's moments and faces of `size`² texels with rays.
    pub fn new(mesh: &PreparedMesh, size: u32, (raw, bits): (RawGrid, FaceBits)) -> Self {
        let rays = SnappedRays::new(mesh).faces(size);
        let all = |cell| (0..bits.texels()).map(move |texel| (cell, texel));
        let cells = 0..bits.cells();
        let occluded = cells.flat_map(all).filter(|&(c, t)| rays.get(c, t)).count();
        let differences = bits.differences(&rays);
        Self {
            texels: bits.cells() * bits.texels(),
            grazes: differences
                .iter()
                .take(MOST_GRAZES)
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

    /// What is wrong beyond how many texels differ; none if nothing is.
    pub fn fault(&self) -> Option<String> {
        let allowed = self.float_distance;
        if self.occluded == 0 {
            return Some("nothing is occluded: nothing was compared".into());
        }
        if self.differences.len() > MOST_GRAZES {
            return Some(format!("{} texels differ", self.differences.len()));
        }
        if let Some(far) = self.grazes.iter().find(|graze| **graze > allowed) {
            return Some(format!(
                "a ray that differs passes no edge within {allowed:.1e} cells, but at {far:.1e}"
            ));
        }
        if self.longest_run() > LONGEST_RUN {
            return Some(format!("a streak of {} cells", self.longest_run()));
        }
        (self.wrong_sums > 0)
            .then(|| format!("{} cells are not the sums of their texels", self.wrong_sums))
    }

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
