#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| seixo_fuzz::curve(data));
