//! Shader composition: `#import "path"`, `#ifdef NAME`, `#else`, `#endif`, embedded in the binary.

use std::{borrow::Cow, collections::BTreeSet};

use include_dir::{Dir, include_dir};

use super::adapter::GpuError;

static SHADERS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/shaders");

/// Every WGSL file that is a pass, as `room/name`, sorted; `shared/` holds imports only.
pub fn pass_files() -> Vec<String> {
    let mut names: Vec<String> = SHADERS
        .dirs()
        .filter(|dir| dir.path() != std::path::Path::new("shared"))
        .flat_map(|dir| dir.files())
        .filter(|file| {
            file.path()
                .extension()
                .is_some_and(|extension| extension == "wgsl")
        })
        .map(|file| {
            file.path()
                .with_extension("")
                .to_string_lossy()
                .replace('\\', "/")
        })
        .collect();
    names.sort();
    names
}

/// WGSL text of `name` (such as `pbf/predict`) with imports pasted once and conditions resolved.
///
/// # Errors
/// A file that does not exist, or a condition that does not close.
pub fn compose(name: &str, defines: &[&str]) -> Result<String, GpuError> {
    let mut out = String::new();
    let mut seen = BTreeSet::new();
    append(&format!("{name}.wgsl"), defines, &mut seen, &mut out)?;
    Ok(out)
}

fn source(path: &str) -> Option<Cow<'static, str>> {
    #[cfg(feature = "mutants")]
    if let Some(text) = crate::mutants::shader(path) {
        return Some(Cow::Owned(text));
    }
    Some(Cow::Borrowed(SHADERS.get_file(path)?.contents_utf8()?))
}

fn append(
    path: &str,
    defines: &[&str],
    seen: &mut BTreeSet<String>,
    out: &mut String,
) -> Result<(), GpuError> {
    if !seen.insert(path.to_owned()) {
        return Ok(());
    }
    let fault = |line: usize, what: &str| GpuError::Shader {
        name: path.to_owned(),
        message: format!("line {line}: {what}"),
    };
    let text = source(path).ok_or_else(|| fault(0, "no such file"))?;
    let mut open: Vec<(usize, bool)> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let directive = words.next().unwrap_or("");
        let argument = words.next().unwrap_or("").trim_matches('"');
        let live = open.iter().all(|&(_, on)| on);
        match directive {
            "#import" if live => append(argument, defines, seen, out)?,
            "#import" => {}
            "#ifdef" => open.push((index + 1, defines.contains(&argument))),
            "#ifndef" => open.push((index + 1, !defines.contains(&argument))),
            "#else" => match open.last_mut() {
                Some((_, on)) => *on = !*on,
                None => return Err(fault(index + 1, "#else without #ifdef")),
            },
            "#endif" => {
                open.pop()
                    .ok_or_else(|| fault(index + 1, "#endif without #ifdef"))?;
            }
            _ if live => {
                out.push_str(line);
                out.push('\n');
            }
            _ => {}
        }
    }
    match open.pop() {
        Some((line, _)) => Err(fault(line, "#ifdef without #endif")),
        None => Ok(()),
    }
}
