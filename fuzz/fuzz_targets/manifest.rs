//! Fuzzes a cache's manifest, with a ledger chained to it; see `ledger`.
#![no_main]

mod cache;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    cache::read(bytes, &[cache::first_line(bytes)]);
});
