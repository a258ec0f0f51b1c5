//! A key of a file that a user writes: what it is declared with, and what follows in words.

use std::ops::RangeInclusive;

use super::words::shown;

/// From the least number to the largest.
pub(super) type Interval = RangeInclusive<f64>;

/// Stands in a table for any name that the user chooses.
pub(super) const ANY: &str = "NAME";

/// What a value is.
pub(super) enum Kind {
    /// A number, whole or not.
    Number(Interval),
    /// 0, or a number.
    NumberOrZero(Interval),
    /// A number, or `false`.
    NumberOrFalse(Interval),
    /// A whole number.
    Whole(RangeInclusive<u32>),
    /// So many numbers in brackets.
    Vector(usize, Interval),
    /// Two corners of a box, of three numbers each.
    Corners(Interval),
    /// A number of this size, or three of them, of either sign.
    Scale(Interval),
    /// `true` or `false`.
    Flag,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// Some of these words, in brackets.
    Choices(&'static [&'static str]),
    /// A name that can be a part of a file's.
    FileStem,
    /// A string, of which these words say more.
    Text(&'static str),
    /// An array of so many numbers each, of which these words say more.
    Points(usize, &'static str),
    /// What these words say; looked at where it is used.
    Other(&'static str),
    /// `[table]`, which the written-out scene has in lines of its own.
    Table(&'static [Key]),
    /// `{ table }`, which it has in one line.
    Inline(&'static [Key]),
    /// `[[table]]`, any number.
    Tables(&'static [Key]),
}

/// What holds where a key is left out.
pub(super) enum LeftOut {
    /// It may not be.
    Needed,
    /// The same as if this had been written, in TOML.
    Value(&'static str),
    /// What these words say, from constants of the code that computes it.
    Computed(fn() -> String),
    /// There is none of it.
    Absent,
}

/// Whether a key decides what happens in the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Physics {
    /// It does: a bake continues only with the same value.
    Yes,
    /// A file, of which the content does: `blake3` stands beside it.
    ByHash,
    /// It does not: a budget, what is written beside the frames, how many frames there are.
    No,
}

/// A key, or a table of them.
pub(super) struct Key {
    /// The last part of its dotted name.
    pub(super) name: &'static str,
    pub(super) kind: Kind,
    /// In words; empty where there is none.
    pub(super) unit: &'static str,
    pub(super) default: LeftOut,
    pub(super) physics: Physics,
    /// What it is for, on the page.
    pub(super) about: &'static str,
    /// More on what is allowed, with the punctuation before it.
    pub(super) also: &'static str,
    /// It goes only where a key beside it, earlier in the table, has one of these values.
    pub(super) only: Option<(&'static str, &'static [&'static str])>,
    /// It goes only together with this key.
    pub(super) with: Option<&'static str>,
    /// It goes with none of these keys.
    pub(super) without: &'static [&'static str],
}

/// What a table is written with.
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

/// The words of an enum's table of names.
pub(super) const fn words<T, const N: usize>(named: &[(&'static str, T); N]) -> [&'static str; N] {
    let mut words = [""; N];
    let mut at = 0;
    while at < N {
        words[at] = named[at].0;
        at += 1;
    }
    words
}

/// The key at a dotted path, whose indices do not matter, and the tables that lead there, from the outermost on; fewer
/// than the path has parts where there is no such key.
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

/// The key at a dotted path.
pub(super) fn find(keys: &'static [Key], path: &str) -> Option<&'static Key> {
    let found = along(keys, path);
    (found.len() == path.split('.').count()).then(|| found.last().copied())?
}

impl Key {
    /// The keys of a table; none of anything else.
    pub(super) fn below(&self) -> &'static [Self] {
        match self.kind {
            Kind::Table(keys) | Kind::Inline(keys) | Kind::Tables(keys) => keys,
            _ => &[],
        }
    }

    /// What its value may be, in words, and what holds where it is left out and no other key says it.
    pub(super) fn allowed(&self) -> String {
        match self.default {
            LeftOut::Computed(default) => {
                format!("{}; {} if left out", self.values_here(), default())
            }
            _ => self.values_here(),
        }
    }

    /// What its value may be, in words, and with which values of another key it goes.
    pub(super) fn values(&self) -> String {
        self.words(self.only)
    }

    /// What its value may be, where the keys that it goes with stand.
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

/// A table by what it cannot do without, else by all that it has.
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

/// A bound in few digits.
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

/// "a, b and c".
pub(super) fn list<S: AsRef<str>>(words: &[S], last: &str) -> String {
    let words: Vec<_> = words.iter().map(AsRef::as_ref).collect();
    match words.split_last() {
        Some((end, [])) => (*end).to_owned(),
        Some((end, before)) => format!("{} {last} {end}", before.join(", ")),
        None => "nothing".to_owned(),
    }
}
