#![no_main]

use aogrid_grid_format::Grid;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(grid) = Grid::from_bytes(bytes) else {
        return;
    };
    // Writing and reading it again changes nothing.
    let written = grid.to_bytes();
    let again = Grid::from_bytes(&written).expect("it was written by us");
    assert!(again.to_bytes() == written);
    let _ = (grid.is_unchanged(), grid.measure(), grid.decode());
});
