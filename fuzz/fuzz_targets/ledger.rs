//! Fuzzes a ledger. The input's lines become the contents of ledger lines with a valid chain, so
//! that each line reaches its own checks.
#![no_main]

mod cache;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let lines: Vec<_> = bytes.split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
    let manifest = cache::MANIFEST.as_bytes();
    let first = cache::first_line(manifest);
    cache::read(manifest, &[vec![first], lines.clone()].concat());
    let manifest = cache::manifest_of_format_1();
    let first = cache::first_line_of_format_1(manifest.as_bytes());
    cache::read(manifest.as_bytes(), &[vec![first], lines].concat());
});
