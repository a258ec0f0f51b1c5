//! Every checksum of a cache.

use std::path::Path;

pub use swell_cache::{CacheError, Problem, VerifyReport};

/// Looks at every checksum of the cache in `dir`. Damage stands in the report; `into_result` makes an
/// error of it.
///
/// # Errors
/// [`CacheError`] where `dir` holds no cache that this program reads, or cannot be read at all.
pub fn verify(dir: &Path) -> Result<VerifyReport, CacheError> {
    swell_cache::survey(dir)
}
