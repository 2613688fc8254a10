#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| dymlm_fuzz_bodies::read_map_file(bytes));
