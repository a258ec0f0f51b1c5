//! Explains why a path is not a cache.

use std::path::Path;

use swell_domain::output;

/// Describes what `dir` is instead of a cache, as the rest of a sentence that begins with the path.
pub(super) fn why_none(dir: &Path, is_cache: &dyn Fn(&Path) -> bool) -> String {
    if !dir.exists() {
        return "does not exist".to_owned();
    }
    if !dir.is_dir() {
        return "is a file; a cache is a folder".to_owned();
    }
    let within = within(dir, is_cache);
    match &within[..] {
        [] => "is not a cache: it has no manifest.json".to_owned(),
        [one] => format!("is not a cache; did you mean {one}?"),
        several => format!("is not a cache; name one of {}", several.join(", ")),
    }
}

/// Paths of the entries of `dir` for which `is_one` holds, sorted. An unreadable folder counts as
/// empty.
pub fn within(dir: &Path, is_one: &dyn Fn(&Path) -> bool) -> Vec<String> {
    let mut found = output::paths(dir).unwrap_or_default();
    found.retain(|path| is_one(path));
    found
        .iter()
        .map(|path| path.display().to_string())
        .collect()
}
