//! What is wrong with a look file, and where.

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use super::super::words::{duplicate, plain_types};

/// Why a look cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LookError {
    /// The file cannot be read.
    #[error("{}: {source}", file.display())]
    Read {
        /// Which file.
        file: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
    /// The file says something that it must not.
    #[error("{}:{line}: `{key}`: {message}", file.display())]
    Fault {
        /// The look file.
        file: PathBuf,
        /// Counted from 1.
        line: usize,
        /// Dotted key, as far as it is known.
        key: String,
        /// What is wrong and what is allowed.
        message: String,
    },
}

fn line_at(text: &str, offset: usize) -> usize {
    let end = offset.min(text.len());
    text.as_bytes()[..end]
        .iter()
        .filter(|&&byte| byte == b'\n')
        .count()
        + 1
}

/// The words between backticks in a serde message.
fn quoted(message: &str) -> Vec<&str> {
    message.split('`').skip(1).step_by(2).collect()
}

fn nearest<'a>(word: &str, among: &[&'a str]) -> Option<&'a str> {
    among
        .iter()
        .map(|&candidate| (strsim::damerau_levenshtein(word, candidate), candidate))
        .filter(|&(distance, candidate)| distance <= 2 + candidate.len() / 4)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

fn key_on_line(text: &str, line: usize) -> String {
    let content = text.lines().nth(line - 1).unwrap_or("");
    let key = content.split(['=', '#']).next().unwrap_or("").trim();
    key.trim_matches(['[', ']', ' ']).to_owned()
}

/// The key whose value holds `span`, by walking the document: dotted, with array indices left out.
fn key_at(text: &str, span: &Range<usize>) -> Option<String> {
    fn walk(table: &DeTable<'_>, span: &Range<usize>, path: &mut Vec<String>) -> bool {
        for (key, value) in table {
            let on_key = key.span().start <= span.start && span.start < key.span().end;
            let inside = value.span().start <= span.start && span.start < value.span().end;
            path.push(key.get_ref().to_string());
            let deeper = descend(value.get_ref(), span, path);
            if deeper || on_key || inside {
                return true;
            }
            path.pop();
        }
        false
    }
    fn descend(value: &DeValue<'_>, span: &Range<usize>, path: &mut Vec<String>) -> bool {
        match value {
            DeValue::Table(inner) => walk(inner, span, path),
            DeValue::Array(items) => items.iter().any(|item| descend(item.get_ref(), span, path)),
            _ => false,
        }
    }
    let document = DeTable::parse(text).ok()?;
    let mut path = Vec::new();
    walk(document.get_ref(), span, &mut path).then(|| path.join("."))
}

/// The keys that a look cannot do without, or that a table of it cannot. No two have the same last name.
const NEEDED: [(&str, &str); 15] = [
    (
        "camera",
        "a table [camera] with focal_length_mm, position and target, or [[camera.keyframe]]",
    ),
    ("camera.focal_length_mm", "a number from 1 to 5000 mm"),
    ("camera.keyframe.frame", "a number, the frame of the pose"),
    ("camera.keyframe.position", "three numbers, metres"),
    ("camera.keyframe.target", "three numbers, metres"),
    (
        "sky",
        "a table [sky] with model = \"hosek_wilkie\", or model = \"panorama\" and file",
    ),
    ("sky.model", "\"hosek_wilkie\" or \"panorama\""),
    ("sky.file", "an EXR file, relative to the look file"),
    (
        "surface.ripple.wavelength_m",
        "a number from 0.001 to 1000 m",
    ),
    ("surface.ripple.slope", "a number from 0 to 1"),
    (
        "water.spray.density_per_metre",
        "a number from 0 to 10000 1/m",
    ),
    (
        "water.spray.speed_m_per_s",
        "a number from 0.001 to 10000 m/s",
    ),
    ("basin.height_m", "a number from 0.001 to 1000 m"),
    ("solids.windows.storey_m", "a number from 0.001 to 1000 m"),
    ("solids.windows.bay_m", "a number from 0.001 to 1000 m"),
];

/// Key and message where `name` is missing. Its table is known by its name: the span that serde gives is that of a table
/// only where the table has one.
fn missing(name: &str) -> Option<(String, String)> {
    let mut needed = NEEDED.iter();
    let (key, words) = needed.find(|(key, _)| key.rsplit('.').next() == Some(name))?;
    Some(((*key).to_owned(), format!("missing; allowed is {words}")))
}

fn join(table: &str, name: &str) -> String {
    match table {
        "" => name.to_owned(),
        table => format!("{table}.{name}"),
    }
}

/// Turns a TOML or serde error into file, line, key and the nearest allowed key.
pub(super) fn from_toml(file: &Path, text: &str, error: &toml::de::Error) -> LookError {
    let span = error.span().unwrap_or(0..0);
    let line = line_at(text, span.start);
    let mut message = plain_types(error.message());
    let words = quoted(error.message());
    let located = key_at(text, &span).unwrap_or_else(|| key_on_line(text, line));
    let is_key = message.starts_with("unknown field");
    let mut key = located;
    if let Some(name) = duplicate(text, error) {
        key = name.to_owned();
        message = "a second key of this name in its table".to_owned();
    } else if let Some(&word) = words.first() {
        if is_key && key.rsplit('.').next() != Some(word) {
            key = join(&key, word);
        } else if message.starts_with("missing field") {
            (key, message) = missing(word).unwrap_or_else(|| (join(&key, word), message));
        }
    }
    if (is_key || message.starts_with("unknown variant"))
        && let Some(found) = words
            .split_first()
            .and_then(|(word, allowed)| nearest(word, allowed))
    {
        message.push_str(&format!("; did you mean `{found}`?"));
    }
    LookError::Fault {
        file: file.to_owned(),
        line,
        key,
        message,
    }
}

/// The line of the value that `path` leads to, with indices as numbers; of what the file leaves out, that of the table
/// that should hold it.
pub(super) fn line_of(text: &str, path: &str) -> usize {
    let Ok(document) = DeTable::parse(text) else {
        return 1;
    };
    let mut parts = path.split('.');
    let Some((key, found)) = parts
        .next()
        .and_then(|part| document.get_ref().get_key_value(part))
    else {
        return 1;
    };
    let (mut line, mut value) = (line_at(text, key.span().start), found.get_ref());
    for part in parts {
        let next = match value {
            DeValue::Table(table) => table
                .get_key_value(part)
                .map(|(key, found)| (key.span(), found.get_ref())),
            DeValue::Array(items) => part
                .parse::<usize>()
                .ok()
                .and_then(|index| items.get(index))
                .map(|found| (found.span(), found.get_ref())),
            _ => None,
        };
        let Some((span, found)) = next else { break };
        line = line_at(text, span.start);
        value = found;
    }
    line
}

/// A value that is well-formed but not allowed; `path` leads to it, with indices as numbers.
pub(super) fn at_path(file: &Path, text: &str, path: &str, message: &str) -> LookError {
    LookError::Fault {
        file: file.to_owned(),
        line: line_of(text, path),
        key: path.to_owned(),
        message: message.to_owned(),
    }
}
