#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = resample_tests::fuzzed::Reader::Gaussians.read(bytes);
});
