//! Verifies every checksum of a cache.

use std::path::Path;

pub use swell_cache::{CacheError, Problem, VerifyReport};

/// Checks every checksum of the cache in `dir`. Damage is listed in the report; `into_result` turns
/// it into an error.
///
/// # Errors
/// [`CacheError`] if `dir` holds no cache that this program reads, or cannot be read at all.
pub fn verify(dir: &Path) -> Result<VerifyReport, CacheError> {
    swell_cache::survey(dir)
}
