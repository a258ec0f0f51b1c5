//! What is wrong with a look file, and where.

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

/// Why a look cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LookError {
    /// The file, or one that it names, cannot be read.
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

/// Turns a TOML or serde error into file, line, key and the nearest allowed key.
pub(super) fn from_toml(file: &Path, text: &str, error: &toml::de::Error) -> LookError {
    let span = error.span().unwrap_or(0..0);
    let line = line_at(text, span.start);
    let raw = error.message().lines().collect::<Vec<_>>().join("; ");
    let words = quoted(&raw);
    let located = key_at(text, &span).unwrap_or_else(|| key_on_line(text, line));
    let is_key = raw.starts_with("unknown field");
    let key = match words.first() {
        Some(&word) if is_key && located.rsplit('.').next() != Some(word) => {
            if located.is_empty() {
                word.to_owned()
            } else {
                format!("{located}.{word}")
            }
        }
        Some(&word) if raw.starts_with("missing field") && !located.is_empty() => {
            format!("{located}.{word}")
        }
        Some(&word) if raw.starts_with("missing field") => word.to_owned(),
        _ => located,
    };
    let mut message = raw.clone();
    if (is_key || raw.starts_with("unknown variant"))
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

/// A value that is well-formed but not allowed; `path` leads to it, with indices as numbers.
pub(super) fn at_path(file: &Path, text: &str, path: &str, message: &str) -> LookError {
    let mut line = 1;
    if let Ok(document) = DeTable::parse(text) {
        let mut parts = path.split('.');
        let mut value: Option<&DeValue<'_>> = None;
        if let Some((key, found)) = parts
            .next()
            .and_then(|part| document.get_ref().get_key_value(part))
        {
            line = line_at(text, key.span().start);
            value = Some(found.get_ref());
        }
        for part in parts {
            let next = match value {
                Some(DeValue::Table(table)) => table
                    .get_key_value(part)
                    .map(|(key, found)| (key.span(), found.get_ref())),
                Some(DeValue::Array(items)) => part
                    .parse::<usize>()
                    .ok()
                    .and_then(|index| items.get(index))
                    .map(|found| (found.span(), found.get_ref())),
                _ => None,
            };
            // What the file leaves out is reported at the table that should hold it.
            let Some((span, found)) = next else { break };
            line = line_at(text, span.start);
            value = Some(found);
        }
    }
    LookError::Fault {
        file: file.to_owned(),
        line,
        key: path.to_owned(),
        message: message.to_owned(),
    }
}
