//! Every checksum of a cache.

use std::path::Path;

pub use crate::cache::{CacheError, Problem, VerifyReport};

/// Looks at every checksum of the cache in `dir`. Damage stands in the report; `into_result` makes an
/// error of it.
///
/// # Errors
/// [`CacheError`] where `dir` holds no cache that this program reads, or cannot be read at all.
pub fn verify(dir: &Path) -> Result<VerifyReport, CacheError> {
    crate::cache::survey(dir)
}
