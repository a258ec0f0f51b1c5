//! A TOML text with overrides, and the mapping from spans back to lines and keys.

use std::{
    ops::Range,
    path::{Path, PathBuf},
};

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    key::{self, Key, Kind},
    overrides,
    reach::Reach,
};
use swell_scene::{Fault, Place, SceneError, words::plain_types};

/// Index of the keys of a file. Overrides have spans beyond the end of the text.
pub(super) struct Document<'a> {
    file: PathBuf,
    text: &'a str,
    overrides: &'a [String],
    keys: &'static [Key],
    entries: Vec<Entry>,
    reach: Reach,
}

struct Entry {
    key: Range<usize>,
    value: Range<usize>,
    path: String,
}

impl<'a> Document<'a> {
    /// Parses `text`, a file with these `keys`, applies `overrides` (`key=value`), and
    /// indexes the result.
    ///
    /// # Errors
    /// If the TOML is malformed or an override cannot be applied.
    pub(super) fn parse(
        text: &'a str,
        file: &Path,
        overrides: &'a [String],
        keys: &'static [Key],
    ) -> Result<(Self, Spanned<DeTable<'a>>), SceneError> {
        let mut document = Self {
            file: file.to_owned(),
            text,
            overrides,
            keys,
            entries: Vec::new(),
            reach: Reach::Folder,
        };
        let mut root = DeTable::parse(text).map_err(|error| document.broken(&error))?;
        overrides::lay_all(root.get_mut(), overrides, text.len()).map_err(|(entry, reason)| {
            SceneError::Override {
                text: entry.clone(),
                reason,
            }
        })?;
        index_table(root.get_ref(), "", &mut document.entries);
        Ok((document, root))
    }

    /// Describes a syntax error.
    fn broken(&self, error: &toml::de::Error) -> SceneError {
        let span = error.span().unwrap_or_default();
        let name = self.text.get(span.clone()).unwrap_or_default().trim();
        if !error.message().starts_with("duplicate key") || name.is_empty() {
            let message = error.message();
            let hint = match self.is_of_backslash(message, &span) {
                true => "; \\ begins an escape in double quotes: in paths use / between folders",
                false => "",
            };
            return self.fault(error.span(), String::new(), format!("{message}{hint}"));
        }
        let (path, message) = match self.header_at(span.start) {
            Some(header) => (header, "this table is defined twice".to_owned()),
            None => {
                let table = self.table_around(&span);
                let place = table_name(&table).unwrap_or_else(|| "the file".to_owned());
                let message = format!("this key is defined twice in {place}");
                (join(&table, name), message)
            }
        };
        self.fault(Some(span), path, message)
    }

    /// Whether the error at a span is an invalid escape sequence.
    fn is_of_backslash(&self, message: &str, span: &Range<usize>) -> bool {
        let before = self.text.get(..span.end).unwrap_or_default();
        let line = before.rsplit('\n').next().unwrap_or_default();
        let of_escapes = [
            "missing escaped value",
            "too few unicode value digits",
            "invalid value",
        ];
        line.contains('\\') && of_escapes.iter().any(|of| message.starts_with(of))
    }

    /// Returns the dotted name in the table header on the line of `place`.
    fn header_at(&self, place: usize) -> Option<String> {
        let start = self.text.get(..place)?.rfind('\n').map_or(0, |at| at + 1);
        let line = self.text.get(start..)?.lines().next()?.trim();
        let (name, _) = line.strip_prefix('[')?.split_once(']')?;
        let is_name = !name.contains(['=', '{', ',']);
        is_name.then(|| name.trim_start_matches('[').trim().to_owned())
    }

    /// Returns the table of a duplicate key at a span: the innermost inline table around it, or
    /// that of the last header before it, as far as the text can be parsed.
    fn table_around(&self, span: &Range<usize>) -> String {
        let mut entries = Vec::new();
        let (partial, _) = DeTable::parse_recoverable(self.text);
        index_table(partial.get_ref(), "", &mut entries);
        let begins = |entry: &Entry, with: &str| {
            let rest = self.text.get(entry.value.start..);
            rest.is_some_and(|rest| rest.starts_with(with))
        };
        let is_around =
            |entry: &Entry| entry.value.start < span.start && span.end <= entry.value.end;
        let is_before = |entry: &Entry| entry.value.start < span.start;
        let inline = (entries.iter())
            .filter(|entry| begins(entry, "{") && is_around(entry))
            .min_by_key(|entry| entry.value.len());
        let headed = (entries.iter())
            .filter(|entry| begins(entry, "[") && is_before(entry))
            .filter(|entry| self.header_at(entry.value.start).is_some())
            .max_by_key(|entry| (entry.value.start, entry.path.len()));
        let table = inline.or(headed);
        table.map_or_else(String::new, |entry| entry.path.clone())
    }

    /// Sets how far the paths of the file may lead.
    pub(super) fn within(self, reach: Reach) -> Self {
        Self { reach, ..self }
    }

    /// Returns how far the paths of the file may lead.
    pub(super) fn reach(&self) -> Reach {
        self.reach
    }

    /// Resolves the file named by the key at `path`, relative to `base_dir`.
    pub(super) fn find(
        &self,
        base_dir: &Path,
        path: &str,
        name: &str,
    ) -> Result<PathBuf, SceneError> {
        let found = self.reach.find(base_dir, Path::new(name));
        found.map_err(|problem| self.fault_of(path, problem))
    }

    /// Creates a fault at `span`, for the key there, and appends what the key allows.
    pub(super) fn fault_at(&self, span: Range<usize>, problem: impl Into<String>) -> SceneError {
        let path = self.path_at(&span).unwrap_or_default();
        let message = self.with_allowed(problem.into(), &path);
        self.fault(Some(span), path, message)
    }

    /// Creates a fault at `span` whose message already says what is allowed.
    pub(super) fn fault_plain(&self, span: Range<usize>, message: String) -> SceneError {
        let path = self.path_at(&span).unwrap_or_default();
        self.fault(Some(span), path, message)
    }

    /// Returns the text at a span.
    pub(super) fn text_at(&self, span: Range<usize>) -> &'a str {
        self.text.get(span).unwrap_or_default()
    }

    /// Creates a fault of the key at `path` and appends what it allows. It is located at the key,
    /// or else at the innermost table that exists.
    pub(super) fn fault_of(&self, path: &str, problem: impl Into<String>) -> SceneError {
        let message = self.with_allowed(problem.into(), path);
        self.fault(self.span_of(path), path.to_owned(), message)
    }

    /// Creates a fault of the key at `path` whose message already says what is allowed.
    pub(super) fn fault_of_plain(&self, path: &str, message: impl Into<String>) -> SceneError {
        self.fault(self.span_of(path), path.to_owned(), message.into())
    }

    /// Returns the location of the key at `path` for a fault found later.
    pub(super) fn place_of(&self, path: &str) -> Fault {
        self.fault_at_place(self.span_of(path), path.to_owned(), String::new())
    }

    fn span_of(&self, path: &str) -> Option<Range<usize>> {
        let mut path = path;
        loop {
            if let Some(entry) = self.entries.iter().find(|entry| entry.path == path) {
                return Some(entry.value.clone());
            }
            path = &path[..path.rfind(['.', '['])?];
        }
    }

    /// Creates a fault for the missing key `name` of the table at `span`.
    pub(super) fn missing(&self, span: Range<usize>, name: &str) -> SceneError {
        let path = self.path_of_missing(&span, name);
        let message = self.with_allowed("missing".into(), &path);
        self.fault(Some(span), path, message)
    }

    /// Creates a fault of a dotted key, at a span or for the whole file.
    pub(super) fn fault(
        &self,
        span: Option<Range<usize>>,
        key: String,
        message: String,
    ) -> SceneError {
        SceneError::Fault(Box::new(self.fault_at_place(span, key, message)))
    }

    fn fault_at_place(&self, span: Option<Range<usize>>, key: String, message: String) -> Fault {
        let place = span.map_or(Place::Whole, |span| {
            if let Some(text) = overrides::at(self.overrides, span.start, self.text.len()) {
                return Place::Override(text.clone());
            }
            let before = self.text.bytes().take(span.start);
            Place::Line(1 + before.filter(|b| *b == b'\n').count())
        });
        Fault {
            file: self.file.clone(),
            place,
            key,
            message,
        }
    }

    /// Translates an error of serde into one that names the dotted key and what is allowed.
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
            let message = unknown_key(&path, &names);
            return self.fault(span, path, message);
        }
        if let Some(name) = message
            .strip_prefix("missing field ")
            .and_then(|rest| quoted(rest).pop())
        {
            let path = span
                .as_ref()
                .map_or(name.clone(), |s| self.path_of_missing(s, &name));
            let message = self.with_allowed("missing".into(), &path);
            return self.fault(span.filter(|s| !s.is_empty()), path, message);
        }
        let path = span.as_ref().and_then(|s| self.path_at(s));
        let path = path.unwrap_or_default();
        let problem = if message.starts_with("data did not match") {
            "wrong type"
        } else {
            message
        };
        let message = self.with_allowed(plain_types(problem), &path);
        self.fault(span, path, message)
    }

    /// Returns the key at exactly this span, or else the innermost around it.
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

    /// Returns the path of a key that is missing in the table at a span. `[a.b]` opens both `a` and
    /// `a.b` there; the one that has this key is meant.
    fn path_of_missing(&self, span: &Range<usize>, name: &str) -> String {
        let tables = || self.entries.iter().filter(|e| e.value == *span);
        tables()
            .map(|e| join(&e.path, name))
            .find(|path| key::find(self.keys, path).is_some())
            .or_else(|| tables().next_back().map(|e| join(&e.path, name)))
            .unwrap_or_else(|| name.to_owned())
    }

    /// Returns the keys that the file may have.
    pub(super) fn keys(&self) -> &'static [Key] {
        self.keys
    }

    /// Appends what the key at a path allows.
    pub(super) fn with_allowed(&self, problem: String, path: &str) -> String {
        match key::find(self.keys, path) {
            Some(Key {
                kind: Kind::Tables(_),
                ..
            }) => {
                let name = without_indices(path);
                format!("{problem}; allowed: an array of tables [[{name}]]")
            }
            Some(key) => format!("{problem}; allowed: {}", key.allowed()),
            None => problem,
        }
    }
}

/// Message for an unknown key: its table, the nearest allowed key, and all allowed keys.
pub(super) fn unknown_key<S: AsRef<str>>(path: &str, allowed: &[S]) -> String {
    let (table, name) = path.rsplit_once('.').unwrap_or(("", path));
    let place = table_name(table).map_or_else(String::new, |table| format!(" in {table}"));
    match nearest(name, allowed) {
        Some(nearest) => {
            let all: Vec<_> = allowed.iter().map(AsRef::as_ref).collect();
            format!(
                "unknown key{place}; the nearest is \"{nearest}\"; allowed here: {}",
                all.join(", ")
            )
        }
        None => format!("unknown key{place}; nothing is allowed here"),
    }
}

/// Words from other programs, and the keys with the same or the nearest meaning.
const OTHER_WORDS: [(&str, &str); 3] = [
    ("amplitude", "stroke"),
    ("frequency", "period"),
    ("fps", "frames_per_second"),
];

/// Returns the synonym of a word, or else the candidate with the least edit distance.
pub(super) fn nearest<'w, S: AsRef<str>>(word: &str, among: &'w [S]) -> Option<&'w str> {
    let mut among = among.iter().map(AsRef::as_ref);
    let meant = OTHER_WORDS.iter().find(|(other, _)| *other == word);
    if let Some((_, ours)) = meant
        && let Some(found) = among.clone().find(|candidate| candidate == ours)
    {
        return Some(found);
    }
    among
        .by_ref()
        .min_by_key(|candidate| strsim::damerau_levenshtein(word, candidate))
}

/// Returns a table's name for messages; `None` for the file itself.
fn table_name(table: &str) -> Option<String> {
    match table {
        "" => None,
        table if table.contains('[') => Some(table.to_owned()),
        table => Some(format!("[{table}]")),
    }
}

/// Returns `water.block` for `water.block[3]`.
fn without_indices(path: &str) -> String {
    let parts = path
        .split('.')
        .map(|part| part.split('[').next().unwrap_or(part));
    parts.collect::<Vec<_>>().join(".")
}

/// Returns the words between backticks.
fn quoted(text: &str) -> Vec<String> {
    text.split('`')
        .skip(1)
        .step_by(2)
        .map(str::to_owned)
        .collect()
}

pub(super) fn join(table: &str, name: &str) -> String {
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

fn index_value(
    value: &Spanned<DeValue<'_>>,
    key: Range<usize>,
    path: String,
    entries: &mut Vec<Entry>,
) {
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
