//! Reading allocates no more than the file is long, whatever the file says. A binary of its
//! own: the allocator that counts is the process's.

use aogrid_grid_format::{
    BakeRecord, Boundary, BoundaryMode, Encoding, Grid, GridSpec, Interior, Method, Source,
    TexelFormat,
};
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Besides the texels: the header's copy, the JSON's strings, an error's text.
const SMALL_THINGS: usize = 16 * 1024;

fn file() -> Vec<u8> {
    let spec = GridSpec::new([32; 3], [0.0; 3], [1.0; 3]).unwrap();
    let record = BakeRecord {
        epsilon: None,
        sample_offset: [0.0; 3],
        method: Method::Faces { size: 16 },
        max_distance: None,
        interior: Interior::Keep,
        interior_cells: 0,
        inside: None,
        boundary: Boundary {
            requested: BoundaryMode::None,
            applied: BoundaryMode::None,
            v_m: 0.0,
        },
        source: Source {
            name: "a.obj".into(),
            part: None,
            blake3: "0".repeat(64),
            triangles: 1,
        },
    };
    let cells = vec![[0.0; 4]; spec.cell_count()];
    let grid = Grid::encode(spec, Encoding::Cone, TexelFormat::F32, &cells, record);
    grid.unwrap().to_bytes()
}

fn peak_of_reading(bytes: &[u8]) -> usize {
    ALLOCATOR.reset_peak_usage();
    let before = ALLOCATOR.current_usage();
    let read = Grid::from_bytes(bytes);
    let peak = ALLOCATOR.peak_usage() - before;
    drop(read);
    peak
}

#[test]
fn reading_allocates_no_more_than_the_file() {
    let good = file();
    let peak = peak_of_reading(&good);
    assert!(
        peak > good.len() / 2,
        "the allocator does not count: {peak}"
    );
    assert!(
        peak <= good.len() + SMALL_THINGS,
        "{peak} of {}",
        good.len()
    );
    // Every number of header and level index, one at a time, as large as can be and nearly so.
    for offset in (12..104).step_by(4) {
        for lie in [u32::MAX, u32::MAX / 2, 1 << 24, 2048, 0] {
            let mut bytes = good.clone();
            bytes[offset..offset + 4].copy_from_slice(&lie.to_le_bytes());
            let peak = peak_of_reading(&bytes);
            assert!(peak <= good.len() + SMALL_THINGS, "{offset} {lie}: {peak}");
        }
    }
}
