//! A TOML text with overrides laid over it, and the way back from a span to line and key.

use std::{
    borrow::Cow,
    ops::Range,
    path::{Path, PathBuf},
};

use toml::{
    Spanned,
    de::{DeArray, DeTable, DeValue},
};

use super::{
    error::{Fault, Place, SceneError},
    reach::Reach,
    words::{duplicate, plain_types, shown},
};

/// Bytes set aside for the spans of one override, beyond the end of the text.
const OVERRIDE_SPAN: usize = 1 << 20;

/// Where every key of a scene stands. Overrides have spans beyond the end of the text.
pub(super) struct Document<'a> {
    file: PathBuf,
    text: &'a str,
    overrides: &'a [String],
    entries: Vec<Entry>,
    reach: Reach,
}

struct Entry {
    key: Range<usize>,
    value: Range<usize>,
    path: String,
}

type Value<'a> = Spanned<DeValue<'a>>;

impl<'a> Document<'a> {
    /// Parses `text`, lays `overrides` (`key=value`) over it, and indexes the result.
    ///
    /// # Errors
    /// Broken TOML, or an override that names no place.
    pub(super) fn parse(
        text: &'a str,
        file: &Path,
        overrides: &'a [String],
    ) -> Result<(Self, Spanned<DeTable<'a>>), SceneError> {
        let mut document = Self {
            file: file.to_owned(),
            text,
            overrides,
            entries: Vec::new(),
            reach: Reach::Folder,
        };
        let mut root = DeTable::parse(text).map_err(|error| match duplicate(text, &error) {
            Some(key) => {
                let message = "a second key of this name in its table".to_owned();
                document.fault(error.span(), key.to_owned(), message)
            }
            None => document.fault(error.span(), String::new(), error.message().to_owned()),
        })?;
        for (index, entry) in overrides.iter().enumerate() {
            let mut spans = OverrideSpans {
                start: text.len() + 1 + index * OVERRIDE_SPAN,
                taken: 0,
            };
            lay_over(root.get_mut(), entry, &mut spans).map_err(|reason| SceneError::Override {
                text: entry.clone(),
                reason,
            })?;
        }
        index_table(root.get_ref(), "", &mut document.entries);
        Ok((document, root))
    }

    /// The same with paths that lead so far.
    pub(super) fn within(self, reach: Reach) -> Self {
        Self { reach, ..self }
    }

    /// How far its paths lead.
    pub(super) fn reach(&self) -> Reach {
        self.reach
    }

    /// The file that a value names, from `base_dir`.
    pub(super) fn find(
        &self,
        base_dir: &Path,
        name: &Spanned<String>,
    ) -> Result<PathBuf, SceneError> {
        let found = self.reach.find(base_dir, Path::new(name.get_ref()));
        found.map_err(|problem| self.fault_at(name.span(), problem))
    }

    /// A fault at `span`, of the key that stands there, with what that key allows.
    pub(super) fn fault_at(&self, span: Range<usize>, problem: impl Into<String>) -> SceneError {
        let path = self.path_at(&span).unwrap_or_default();
        let message = with_allowed(problem.into(), &path);
        self.fault(Some(span), path, message)
    }

    /// A fault at `span` that says itself what is allowed.
    pub(super) fn fault_plain(&self, span: Range<usize>, message: String) -> SceneError {
        let path = self.path_at(&span).unwrap_or_default();
        self.fault(Some(span), path, message)
    }

    /// The text at a span, as the file has it.
    pub(super) fn text_at(&self, span: Range<usize>) -> &'a str {
        self.text.get(span).unwrap_or_default()
    }

    /// A fault of the value of the key at `path`, which allows what `allowed` says.
    pub(super) fn fault_of(&self, path: &str, value: f64, allowed: &str) -> SceneError {
        let span = self
            .entries
            .iter()
            .find(|e| e.path == path)
            .map(|e| e.value.clone());
        let message = format!("{} is out of range; allowed: {allowed}", shown(value));
        self.fault(span, path.to_owned(), message)
    }

    /// A fault of the key `name` that is missing in the table at `span`.
    pub(super) fn missing(&self, span: Range<usize>, name: &str) -> SceneError {
        let path = self.path_of_missing(&span, name);
        let message = with_allowed("missing".into(), &path);
        self.fault(Some(span), path, message)
    }

    fn fault(&self, span: Option<Range<usize>>, key: String, message: String) -> SceneError {
        let place = span.map_or(Place::Whole, |span| {
            if let Some(text) = span
                .start
                .checked_sub(self.text.len() + 1)
                .and_then(|beyond| self.overrides.get(beyond / OVERRIDE_SPAN))
            {
                return Place::Override(text.clone());
            }
            let before = self.text.bytes().take(span.start);
            Place::Line(1 + before.filter(|b| *b == b'\n').count())
        });
        SceneError::Fault(Box::new(Fault {
            file: self.file.clone(),
            place,
            key,
            message,
        }))
    }

    /// Turns serde's complaint into one that names the dotted key and what is allowed.
    pub(super) fn translate(&self, error: &toml::de::Error) -> SceneError {
        let message = error.message();
        let span = error.span();
        if let Some(rest) = message.strip_prefix("unknown field ") {
            let mut names = quoted(rest);
            if names.is_empty() {
                return self.fault(span, String::new(), message.to_owned());
            }
            let name = names.remove(0);
            let path = span.as_ref().and_then(|s| self.path_at(s));
            let path = path.unwrap_or_else(|| name.clone());
            return self.fault(span, path, unknown_key(&name, &names));
        }
        if let Some(name) = message
            .strip_prefix("missing field ")
            .and_then(|rest| quoted(rest).pop())
        {
            let path = span
                .as_ref()
                .map_or(name.clone(), |s| self.path_of_missing(s, &name));
            let message = with_allowed("missing".into(), &path);
            return self.fault(span.filter(|s| !s.is_empty()), path, message);
        }
        let path = span.as_ref().and_then(|s| self.path_at(s));
        let path = path.unwrap_or_default();
        let problem = if message.starts_with("data did not match") {
            "wrong type"
        } else {
            message
        };
        let message = with_allowed(plain_types(problem), &path);
        self.fault(span, path, message)
    }

    /// The key at a span: one that stands exactly there, else the innermost around.
    fn path_at(&self, span: &Range<usize>) -> Option<String> {
        let exact = self
            .entries
            .iter()
            .filter(|e| e.value == *span || e.key == *span)
            .max_by_key(|e| e.path.len());
        let around = || {
            self.entries
                .iter()
                .filter(|e| e.value.start <= span.start && span.end <= e.value.end)
                .min_by_key(|e| (e.value.len(), usize::MAX - e.path.len()))
        };
        exact.or_else(around).map(|e| e.path.clone())
    }

    /// The path of a key that the table at a span lacks. `[a.b]` opens both `a` and `a.b` there:
    /// the one that knows the key is meant.
    fn path_of_missing(&self, span: &Range<usize>, name: &str) -> String {
        let tables = || self.entries.iter().filter(|e| e.value == *span);
        tables()
            .map(|e| join(&e.path, name))
            .find(|path| super::allowed::of(path).is_some())
            .or_else(|| tables().next_back().map(|e| join(&e.path, name)))
            .unwrap_or_else(|| name.to_owned())
    }
}

/// "unknown key", the nearest of the allowed ones, and all of them.
pub(super) fn unknown_key(name: &str, allowed: &[String]) -> String {
    let nearest = allowed
        .iter()
        .min_by_key(|candidate| strsim::damerau_levenshtein(name, candidate));
    match nearest {
        Some(nearest) => format!(
            "unknown key; the nearest is \"{nearest}\"; allowed here: {}",
            allowed.join(", ")
        ),
        None => "unknown key; nothing is allowed here".to_owned(),
    }
}

fn with_allowed(problem: String, path: &str) -> String {
    match super::allowed::of(path) {
        Some(allowed) => format!("{problem}; allowed: {allowed}"),
        None => problem,
    }
}

/// Words between backticks.
fn quoted(text: &str) -> Vec<String> {
    text.split('`')
        .skip(1)
        .step_by(2)
        .map(str::to_owned)
        .collect()
}

fn join(table: &str, name: &str) -> String {
    if table.is_empty() {
        name.to_owned()
    } else {
        format!("{table}.{name}")
    }
}

fn index_table(table: &DeTable<'_>, path: &str, entries: &mut Vec<Entry>) {
    for (key, value) in table {
        let path = join(path, key.get_ref());
        index_value(value, key.span(), path, entries);
    }
}

fn index_value(value: &Value<'_>, key: Range<usize>, path: String, entries: &mut Vec<Entry>) {
    match value.get_ref() {
        DeValue::Table(table) => index_table(table, &path, entries),
        DeValue::Array(array) => {
            for (i, item) in array.iter().enumerate() {
                index_value(item, item.span(), format!("{path}[{i}]"), entries);
            }
        }
        _ => {}
    }
    entries.push(Entry {
        key,
        value: value.span(),
        path,
    });
}

/// Spans of one override, a new one for each key and value that it lays down.
struct OverrideSpans {
    start: usize,
    taken: usize,
}

impl OverrideSpans {
    fn next(&mut self) -> Range<usize> {
        let at = self.start + self.taken.min(OVERRIDE_SPAN - 1);
        self.taken += 1;
        at..at + 1
    }
}

/// Lays `key=value` over the table. `a.b[2].c` and `a.b.2.c` both reach into arrays.
fn lay_over<'a>(
    root: &mut DeTable<'a>,
    entry: &'a str,
    spans: &mut OverrideSpans,
) -> Result<(), String> {
    const ALLOWED: &str = "allowed is key=value, as in solver.pbf.iterations=8";
    let (key, value) = entry
        .split_once('=')
        .ok_or_else(|| format!("no \"=\"; {ALLOWED}"))?;
    let segments: Vec<&str> = key
        .split(['.', '['])
        .map(|s| s.trim().trim_end_matches(']'))
        .collect();
    if segments.iter().any(|s| s.is_empty()) {
        return Err(format!("\"{key}\" is no dotted key; {ALLOWED}"));
    }
    let value = respan(parse_value(value.trim())?, spans);
    let (first, rest) = segments.split_first().ok_or(ALLOWED)?;
    let mut slot = enter_table(root, first, spans);
    for segment in rest {
        slot = enter(slot, segment, spans)?;
    }
    *slot = value;
    Ok(())
}

fn parse_value(text: &str) -> Result<Value<'_>, String> {
    match DeValue::parse(text) {
        Ok(value) => Ok(value),
        Err(error) => {
            let is_bare =
                |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '/' | '+' | ':');
            if !text.is_empty() && text.chars().all(is_bare) {
                Ok(Spanned::new(0..0, DeValue::String(Cow::Borrowed(text))))
            } else {
                Err(format!(
                    "\"{text}\" is neither a TOML value ({}) nor a bare word",
                    error.message()
                ))
            }
        }
    }
}

/// The same value with the override's spans throughout.
fn respan<'a>(value: Value<'a>, spans: &mut OverrideSpans) -> Value<'a> {
    let at = spans.next();
    let inner = match value.into_inner() {
        DeValue::Array(array) => {
            let mut moved = DeArray::new();
            for item in array.iter() {
                moved.push(respan(item.clone(), spans));
            }
            DeValue::Array(moved)
        }
        DeValue::Table(table) => DeValue::Table(
            table
                .into_iter()
                .map(|(key, item)| {
                    let key = Spanned::new(spans.next(), key.into_inner());
                    (key, respan(item, spans))
                })
                .collect(),
        ),
        other => other,
    };
    Spanned::new(at, inner)
}

/// The value that `segment` names; a table is made where there is none.
fn enter<'t, 'a>(
    slot: &'t mut Value<'a>,
    segment: &'a str,
    spans: &mut OverrideSpans,
) -> Result<&'t mut Value<'a>, String> {
    match slot.get_mut() {
        DeValue::Table(table) => Ok(enter_table(table, segment, spans)),
        DeValue::Array(array) => {
            let len = array.len();
            segment
                .parse()
                .ok()
                .and_then(|index: usize| array.get_mut(index))
                .ok_or_else(|| format!("\"{segment}\" is no index into an array of {len}"))
        }
        other => Err(format!(
            "\"{segment}\" cannot be set within a value of type {}",
            other.type_str()
        )),
    }
}

fn enter_table<'t, 'a>(
    table: &'t mut DeTable<'a>,
    segment: &'a str,
    spans: &mut OverrideSpans,
) -> &'t mut Value<'a> {
    let key = Spanned::new(spans.next(), Cow::Borrowed(segment));
    let at = spans.next();
    table
        .entry(key)
        .or_insert_with(|| Spanned::new(at, DeValue::Table(DeTable::new())))
}
