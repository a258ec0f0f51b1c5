//! A manifest of a cache, with a ledger that knows it: see `ledger`.
#![no_main]

mod cache;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    cache::read(bytes, &[cache::first_line(bytes)]);
});
