#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| aogrid_fuzz::load_mesh("fuzz.ply", bytes));
