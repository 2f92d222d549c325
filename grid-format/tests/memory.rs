//! Reading allocates no more than the file's length, whatever the file declares. This is a test
//! binary of its own, because the counting allocator belongs to the whole process.

use aogrid_grid_format::{
    BakeRecord, Boundary, BoundaryMode, Encoding, Grid, GridSpec, Interior, Sampling, Source,
    TexelFormat,
};
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Allowance for allocations besides the texels: header, JSON strings, error texts.
const OVERHEAD: usize = 16 * 1024;

fn file() -> Vec<u8> {
    let spec = GridSpec::new([32; 3], [0.0; 3], [1.0; 3]).unwrap();
    let record = BakeRecord {
        epsilon: None,
        sample_offset: [0.0; 3],
        sampling: Sampling::CubeFaces { size: 16 },
        max_distance: None,
        interior: Interior::Keep,
        interior_cells: 0,
        inside: None,
        snap: false,
        fit: false,
        without: vec![],
        self_offset: 0.0,
        flatness: [0.0; 4],
        check: None,
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
    assert!(peak <= good.len() + OVERHEAD, "{peak} of {}", good.len());
    // Every 32-bit field of the header and the level index, one at a time, with extreme values.
    for offset in (12..104).step_by(4) {
        for value in [u32::MAX, u32::MAX / 2, 1 << 24, 2048, 0] {
            let mut bytes = good.clone();
            bytes[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
            let peak = peak_of_reading(&bytes);
            assert!(peak <= good.len() + OVERHEAD, "{offset} {value}: {peak}");
        }
    }
}
