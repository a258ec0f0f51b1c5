//! Declaration of a key in a user's file, and the texts derived from it.

use std::ops::RangeInclusive;

use swell_scene::words::shown;

/// Closed range of a number.
pub(super) type Interval = RangeInclusive<f64>;

/// Name of a key that stands for any name chosen by the user.
pub(super) const ANY: &str = "NAME";

/// Type and range of a value.
pub(super) enum Kind {
    /// A number, integer or not.
    Number(Interval),
    /// 0 or a number in the range.
    NumberOrZero(Interval),
    /// A number, or `false`.
    NumberOrFalse(Interval),
    /// An integer.
    Whole(RangeInclusive<u32>),
    /// An array of this many numbers.
    Vector(usize, Interval),
    /// Two corners of a box, of three numbers each.
    Corners(Interval),
    /// A number whose magnitude is in the range, or three of them; the sign is free.
    Scale(Interval),
    /// `true` or `false`.
    Flag,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// An array of these words.
    Choices(&'static [&'static str]),
    /// A name that is safe as part of a file name.
    FileStem,
    /// A string, described by these words.
    Text(&'static str),
    /// An array of points with this many numbers each, described by these words.
    Points(usize, &'static str),
    /// A value described by these words and checked where it is used.
    Other(&'static str),
    /// `[table]`, which is written out in lines of its own.
    Table(&'static [Key]),
    /// `{ table }`, which is written out in one line.
    Inline(&'static [Key]),
    /// `[[table]]`, any number of times.
    Tables(&'static [Key]),
}

/// What a missing key means.
pub(super) enum LeftOut {
    /// The key is required.
    Needed,
    /// This default, in TOML.
    Value(&'static str),
    /// A default computed by code; the function describes it.
    Computed(fn() -> String),
    /// The thing that the key describes does not exist.
    Absent,
}

/// Whether a key affects the simulated frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Physics {
    /// It does; a bake continues only with the same value.
    Yes,
    /// It names a file whose content does; the key `blake3` in the same table has its hash.
    ByHash,
    /// It does not: for example a budget, outputs beside the frames, or the number of frames.
    No,
}

/// A key or a table of keys.
pub(super) struct Key {
    /// Last part of the dotted name.
    pub(super) name: &'static str,
    pub(super) kind: Kind,
    /// Unit in words; empty for none.
    pub(super) unit: &'static str,
    pub(super) default: LeftOut,
    pub(super) physics: Physics,
    /// Purpose, for the page of keys.
    pub(super) about: &'static str,
    /// Further constraints, beginning with their punctuation.
    pub(super) also: &'static str,
    /// The key is allowed only if an earlier key of the table has one of these values.
    pub(super) only: Option<(&'static str, &'static [&'static str])>,
    /// The key is allowed only together with this key.
    pub(super) with: Option<&'static str>,
    /// The key is not allowed together with any of these keys.
    pub(super) without: &'static [&'static str],
}

/// Constructors and builder methods for the tables of keys.
impl Key {
    const fn new(name: &'static str, kind: Kind) -> Self {
        Self {
            name,
            kind,
            unit: "",
            default: LeftOut::Needed,
            physics: Physics::Yes,
            about: "",
            also: "",
            only: None,
            with: None,
            without: &[],
        }
    }

    pub(super) const fn number(name: &'static str, range: Interval) -> Self {
        Self::new(name, Kind::Number(range))
    }

    pub(super) const fn number_or_zero(name: &'static str, range: Interval) -> Self {
        Self::new(name, Kind::NumberOrZero(range))
    }

    pub(super) const fn number_or_false(name: &'static str, range: Interval) -> Self {
        Self::new(name, Kind::NumberOrFalse(range))
    }

    pub(super) const fn whole(name: &'static str, range: RangeInclusive<u32>) -> Self {
        Self::new(name, Kind::Whole(range))
    }

    pub(super) const fn vector(name: &'static str, len: usize, range: Interval) -> Self {
        Self::new(name, Kind::Vector(len, range))
    }

    pub(super) const fn corners(name: &'static str, range: Interval) -> Self {
        Self::new(name, Kind::Corners(range))
    }

    pub(super) const fn scale(name: &'static str, range: Interval) -> Self {
        Self::new(name, Kind::Scale(range))
    }

    pub(super) const fn flag(name: &'static str) -> Self {
        Self::new(name, Kind::Flag)
    }

    pub(super) const fn choice(name: &'static str, words: &'static [&'static str]) -> Self {
        Self::new(name, Kind::Choice(words))
    }

    pub(super) const fn choices(name: &'static str, words: &'static [&'static str]) -> Self {
        Self::new(name, Kind::Choices(words))
    }

    pub(super) const fn file_stem(name: &'static str) -> Self {
        Self::new(name, Kind::FileStem)
    }

    pub(super) const fn text(name: &'static str, allowed: &'static str) -> Self {
        Self::new(name, Kind::Text(allowed))
    }

    pub(super) const fn points(name: &'static str, len: usize, allowed: &'static str) -> Self {
        Self::new(name, Kind::Points(len, allowed))
    }

    pub(super) const fn other(name: &'static str, allowed: &'static str) -> Self {
        Self::new(name, Kind::Other(allowed))
    }

    pub(super) const fn table(name: &'static str, keys: &'static [Self]) -> Self {
        Self::new(name, Kind::Table(keys))
    }

    pub(super) const fn inline(name: &'static str, keys: &'static [Self]) -> Self {
        Self::new(name, Kind::Inline(keys))
    }

    pub(super) const fn tables(name: &'static str, keys: &'static [Self]) -> Self {
        Self::new(name, Kind::Tables(keys)).absent()
    }

    pub(super) const fn about(mut self, about: &'static str) -> Self {
        self.about = about;
        self
    }

    pub(super) const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    pub(super) const fn also(mut self, also: &'static str) -> Self {
        self.also = also;
        self
    }

    pub(super) const fn default(mut self, toml: &'static str) -> Self {
        self.default = LeftOut::Value(toml);
        self
    }

    pub(super) const fn computed(mut self, words: fn() -> String) -> Self {
        self.default = LeftOut::Computed(words);
        self
    }

    pub(super) const fn absent(mut self) -> Self {
        self.default = LeftOut::Absent;
        self
    }

    pub(super) const fn not_physics(mut self) -> Self {
        self.physics = Physics::No;
        self
    }

    pub(super) const fn by_hash(mut self) -> Self {
        self.physics = Physics::ByHash;
        self
    }

    pub(super) const fn only(mut self, key: &'static str, among: &'static [&'static str]) -> Self {
        self.only = Some((key, among));
        self
    }

    pub(super) const fn with(mut self, key: &'static str) -> Self {
        self.with = Some(key);
        self
    }

    pub(super) const fn without(mut self, keys: &'static [&'static str]) -> Self {
        self.without = keys;
        self
    }
}

/// Returns the names in an enum's `NAMED` table.
pub(super) const fn words<T, const N: usize>(named: &[(&'static str, T); N]) -> [&'static str; N] {
    let mut words = [""; N];
    let mut at = 0;
    while at < N {
        words[at] = named[at].0;
        at += 1;
    }
    words
}

/// Returns the tables along a dotted path and its key, from the outermost. Indices are ignored. The
/// result is shorter than the path if there is no such key.
pub(super) fn along(keys: &'static [Key], path: &str) -> Vec<&'static Key> {
    let mut found = Vec::new();
    let mut keys = keys;
    for part in path.split('.') {
        let name = part.split('[').next().unwrap_or(part);
        let Some(key) = keys.iter().find(|key| key.name == name || key.name == ANY) else {
            break;
        };
        found.push(key);
        keys = key.below();
    }
    found
}

/// Returns the key at a dotted path.
pub(super) fn find(keys: &'static [Key], path: &str) -> Option<&'static Key> {
    let found = along(keys, path);
    (found.len() == path.split('.').count()).then(|| found.last().copied())?
}

impl Key {
    /// Returns the keys of a table; empty for other kinds.
    pub(super) fn below(&self) -> &'static [Self] {
        match self.kind {
            Kind::Table(keys) | Kind::Inline(keys) | Kind::Tables(keys) => keys,
            _ => &[],
        }
    }

    /// Describes the allowed values and a computed default.
    pub(super) fn allowed(&self) -> String {
        match self.default {
            LeftOut::Computed(default) => {
                format!("{}; {} if left out", self.values_here(), default())
            }
            _ => self.values_here(),
        }
    }

    /// Describes the allowed values, including the values of another key that it requires.
    pub(super) fn values(&self) -> String {
        self.words(self.only)
    }

    /// Describes the allowed values where the required keys are present.
    fn values_here(&self) -> String {
        self.words(None)
    }

    fn words(&self, only: Option<(&str, &[&str])>) -> String {
        let mut words = self.kind.words(self.name);
        if !self.unit.is_empty() {
            words += &format!(", {}", self.unit);
        }
        if let Some(key) = self.with {
            words += &format!(", with {key}");
        }
        if !self.without.is_empty() {
            words += &format!(", not together with {}", list(self.without, "or"));
        }
        if let Some((key, among)) = only {
            words += &format!(", with {key} = {}", list(&quoted(among), "or"));
        }
        words += self.also;
        if let Kind::NumberOrFalse(_) = self.kind {
            words += ", or false";
        }
        words
    }
}

impl Kind {
    fn words(&self, name: &str) -> String {
        match self {
            Self::Number(range) | Self::NumberOrFalse(range) => {
                format!("a number {}", from_to(range))
            }
            Self::NumberOrZero(range) => format!("0 or a number {}", from_to(range)),
            Self::Whole(range) => {
                format!("a whole number from {} to {}", range.start(), range.end())
            }
            Self::Vector(len, range) => format!("{} numbers {}", count(*len), from_to(range)),
            Self::Corners(range) => {
                format!("two corners, each three numbers {}", from_to(range))
            }
            Self::Scale(range) => {
                format!(
                    "a number {}, or three of them; negative ones mirror",
                    from_to(range)
                )
            }
            Self::Flag => "true or false".to_owned(),
            Self::Choice(words) => list(&quoted(words), "or"),
            Self::Choices(words) => format!("an array of {}", list(&quoted(words), "and")),
            Self::FileStem => {
                "1 to 100 letters, digits, \"_\", \"-\" and \".\", the first a letter or digit"
                    .to_owned()
            }
            Self::Text(words) | Self::Points(_, words) | Self::Other(words) => (*words).to_owned(),
            Self::Table(keys) | Self::Inline(keys) => table_words(keys),
            Self::Tables(_) => format!("an array of tables [[{name}]]"),
        }
    }
}

/// Describes a table by its required keys, or by all keys if none is required.
fn table_words(keys: &[Key]) -> String {
    let needed = |key: &&Key| matches!(key.default, LeftOut::Needed) && key.only.is_none();
    let names =
        |keys: &mut dyn Iterator<Item = &Key>| -> Vec<_> { keys.map(|key| key.name).collect() };
    let (all, needed) = (
        names(&mut keys.iter()),
        names(&mut keys.iter().filter(needed)),
    );
    match (needed.len(), all.len()) {
        (0, _) => format!("a table of {}", list(&all, "and")),
        (some, all) if some == all => format!("a table with {}", list(&needed, "and")),
        _ => format!("a table with at least {}", list(&needed, "and")),
    }
}

fn from_to(range: &Interval) -> String {
    format!("from {} to {}", brief(*range.start()), brief(*range.end()))
}

/// Formats a bound briefly.
fn brief(value: f64) -> String {
    match value.abs() {
        size if size >= 1e6 || (size > 0.0 && size < 1e-3) => format!("{value:e}"),
        _ => shown(value),
    }
}

fn count(len: usize) -> String {
    match len {
        2 => "two".to_owned(),
        3 => "three".to_owned(),
        other => other.to_string(),
    }
}

fn quoted(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| format!("{word:?}")).collect()
}

/// Formats a list such as "a, b and c".
pub(super) fn list<S: AsRef<str>>(words: &[S], last: &str) -> String {
    let words: Vec<_> = words.iter().map(AsRef::as_ref).collect();
    match words.split_last() {
        Some((end, [])) => (*end).to_owned(),
        Some((end, before)) => format!("{} {last} {end}", before.join(", ")),
        None => "nothing".to_owned(),
    }
}
