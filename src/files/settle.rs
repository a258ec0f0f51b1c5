//! Checks a document against its table of keys and fills in defaults.

use std::ops::Range;

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    document::{Document, join, nearest, unknown_key},
    key::{ANY, Key, Kind, LeftOut},
};
use swell_scene::{
    SceneError,
    words::{is_file_stem, shown, shown_all},
};

type Result<T> = std::result::Result<T, SceneError>;

/// A table of a document and the keys that it may have.
struct Table<'d, 'a> {
    doc: &'d Document<'a>,
    keys: &'static [Key],
    path: &'d str,
    /// Span of the table; `None` for the file itself.
    span: Option<Range<usize>>,
}

impl<'a> Document<'a> {
    /// Rejects keys and values that the table of keys does not allow, and fills in the defaults
    /// of missing keys.
    ///
    /// # Errors
    /// The first fault, with line, key and allowed values.
    pub(super) fn settle(&self, root: &mut Spanned<DeTable<'a>>) -> Result<()> {
        let table = Table {
            doc: self,
            keys: self.keys(),
            path: "",
            span: None,
        };
        table.settle(root.get_mut())
    }
}

impl Table<'_, '_> {
    fn settle<'v>(&self, values: &mut DeTable<'v>) -> Result<()> {
        self.check_deciders(values)?;
        self.check_names(values)?;
        // Checked first, so that a key is not reported as missing while it is present but
        // not allowed here.
        for key in self.keys.iter().filter(|key| key.name != ANY) {
            self.has_place(values, key)?;
        }
        for key in self.keys {
            if key.name == ANY {
                for (name, value) in values.iter_mut() {
                    self.settle_value(name.get_ref(), key, value)?;
                }
                continue;
            }
            if !self.has_place(values, key)? {
                continue;
            }
            self.fill(values, key)?;
            if let Some(value) = values.get_mut(key.name) {
                self.settle_value(key.name, key, value)?;
            }
        }
        Ok(())
    }

    /// Checks the values that decide which keys are allowed, before those keys are
    /// reported as unknown.
    fn check_deciders(&self, values: &mut DeTable<'_>) -> Result<()> {
        let decides = |name: &str| {
            self.keys
                .iter()
                .any(|key| key.only.is_some_and(|(by, _)| by == name))
        };
        for key in self.keys.iter().filter(|key| decides(key.name)) {
            if let Some(value) = values.get_mut(key.name) {
                self.settle_value(key.name, key, value)?;
            }
        }
        Ok(())
    }

    fn check_names(&self, values: &DeTable<'_>) -> Result<()> {
        let is_known = |name: &str| {
            self.keys
                .iter()
                .any(|key| key.name == name || key.name == ANY)
        };
        let mut names = values.keys();
        let Some(name) = names.find(|name| !is_known(name.get_ref())) else {
            return Ok(());
        };
        let path = join(self.path, name.get_ref());
        let allowed = self.names_beside(values);
        let message = unknown_key(&path, &allowed);
        Err(self.doc.fault(Some(name.span()), path, message))
    }

    /// Returns the keys allowed with the present values.
    fn names_beside(&self, values: &DeTable<'_>) -> Vec<&'static str> {
        let goes = |key: &&Key| key.clash(values).is_none();
        self.keys.iter().filter(goes).map(|key| key.name).collect()
    }

    /// Returns whether a key is allowed with the keys beside it.
    ///
    /// # Errors
    /// If it is present but not allowed.
    fn has_place(&self, values: &DeTable<'_>, key: &Key) -> Result<bool> {
        let together = key
            .without
            .iter()
            .find(|other| values.contains_key(**other));
        let other = key.clash(values);
        let Some(value) = values.get(key.name) else {
            return Ok(together.is_none() && other.is_none());
        };
        let refuse = |problem: String| Err(self.fault(key.name, value.span(), problem));
        if let Some((by, word)) = other {
            let goes = self.names_beside(values);
            let path = join(self.path, key.name);
            let message = format!(
                "does not go with {by} = {word:?}; allowed with it: {}",
                goes.join(", ")
            );
            return Err(self.doc.fault(Some(value.span()), path, message));
        }
        match (together, key.with) {
            (Some(other), _) => refuse(format!("given together with {other}")),
            (None, Some(other)) if !values.contains_key(other) => {
                refuse(format!("given without {other}"))
            }
            _ => Ok(true),
        }
    }

    /// Inserts the default of a missing key.
    ///
    /// # Errors
    /// If the key is required.
    ///
    /// # Panics
    /// If a default is not valid TOML; a test inserts all of them.
    fn fill(&self, values: &mut DeTable<'_>, key: &Key) -> Result<()> {
        if values.contains_key(key.name) {
            return Ok(());
        }
        match key.default {
            LeftOut::Needed => {
                let path = join(self.path, key.name);
                let message = format!("missing; allowed: {}", key.allowed());
                Err(self.doc.fault(self.span.clone(), path, message))
            }
            LeftOut::Value(toml) => {
                let span = self.span.clone().unwrap_or_default();
                let value = DeValue::parse(toml).expect("every default is TOML");
                let name = Spanned::new(span.clone(), key.name.into());
                values.insert(name, Spanned::new(span, value.into_inner()));
                Ok(())
            }
            LeftOut::Computed(_) | LeftOut::Absent => Ok(()),
        }
    }

    fn settle_value(&self, name: &str, key: &Key, value: &mut Spanned<DeValue<'_>>) -> Result<()> {
        let span = value.span();
        let below =
            |path: &str, span: Range<usize>, keys: &'static [Key], values: &mut DeTable<'_>| {
                let table = Table {
                    doc: self.doc,
                    keys,
                    path,
                    span: Some(span),
                };
                table.settle(values)
            };
        match (&key.kind, value.get_mut()) {
            (Kind::Table(keys) | Kind::Inline(keys), DeValue::Table(values)) => {
                below(&join(self.path, name), span, keys, values)
            }
            (Kind::Tables(keys), DeValue::Array(items))
                if items.iter().all(|i| i.get_ref().is_table()) =>
            {
                for (index, item) in items.iter_mut().enumerate() {
                    let path = format!("{}[{index}]", join(self.path, name));
                    let span = item.span();
                    if let DeValue::Table(values) = item.get_mut() {
                        below(&path, span, keys, values)?;
                    }
                }
                Ok(())
            }
            (kind, value) => match (kind.wrong_element(value), kind.problem(key.name, value)) {
                (Some(wrong), _) => {
                    let name = format!("{name}{}", wrong.index);
                    Err(self.fault(&name, wrong.span, wrong.problem))
                }
                (None, Some(problem)) => Err(self.fault(name, span, problem)),
                (None, None) => Ok(()),
            },
        }
    }

    fn fault(&self, name: &str, span: Range<usize>, problem: String) -> SceneError {
        let path = join(self.path, name);
        let message = self.doc.with_allowed(problem, &path);
        self.doc.fault(Some(span), path, message)
    }
}

impl Key {
    /// Returns the key whose value excludes this key, and that value.
    fn clash(&self, values: &DeTable<'_>) -> Option<(&'static str, String)> {
        let (by, among) = self.only?;
        let word = values.get(by)?.get_ref().as_str()?;
        (!among.contains(&word)).then(|| (by, word.to_owned()))
    }
}

/// An array element of the wrong type.
struct WrongElement {
    /// Index such as `[1]` or `[1][2]`.
    index: String,
    span: Range<usize>,
    problem: String,
}

/// Returns the first item that is not a number.
fn no_number(items: &[Spanned<DeValue<'_>>]) -> Option<WrongElement> {
    let (index, item) = (items.iter().enumerate()).find(|(_, i)| number(i.get_ref()).is_none())?;
    Some(WrongElement::of(index, item, "a number"))
}

impl WrongElement {
    fn of(index: usize, item: &Spanned<DeValue<'_>>, expected: &str) -> Self {
        Self {
            index: format!("[{index}]"),
            span: item.span(),
            problem: wrong_type(item.get_ref(), expected),
        }
    }
}

fn wrong_type(value: &DeValue<'_>, expected: &str) -> String {
    let found = match value {
        DeValue::String(text) => format!("string {text:?}"),
        DeValue::Integer(whole) => format!("integer `{whole}`"),
        DeValue::Float(number) => format!("number `{number}`"),
        DeValue::Boolean(flag) => format!("boolean `{flag}`"),
        DeValue::Array(items) => format!("an array of {}", items.len()),
        DeValue::Datetime(date) => format!("date `{date}`"),
        DeValue::Table(_) => "a table".to_owned(),
    };
    format!("invalid type: {found}, expected {expected}")
}

impl Kind {
    /// Returns the first element of the wrong type in an array of the right length.
    fn wrong_element(&self, value: &DeValue<'_>) -> Option<WrongElement> {
        let items = value.as_array()?;
        let first = |is_right: fn(&DeValue<'_>) -> bool, expected: &str| {
            let mut items = items.iter().enumerate();
            let (index, item) = items.find(|(_, item)| !is_right(item.get_ref()))?;
            Some(WrongElement::of(index, item, expected))
        };
        match self {
            Self::Vector(len, _) if items.len() == *len => no_number(items),
            Self::Scale(_) if items.len() == 3 => no_number(items),
            Self::Choices(_) => first(|item| item.is_str(), "a string"),
            Self::Tables(_) => first(|item| item.is_table(), "a table"),
            Self::Points(len, _) => wrong_point(items, *len),
            Self::Corners(_) if items.len() == 2 => wrong_point(items, 3),
            _ => None,
        }
    }

    /// Describes the fault of a value.
    fn problem(&self, name: &str, value: &DeValue<'_>) -> Option<String> {
        let Some(expected) = self.expected(value) else {
            return self.misfit(name, value);
        };
        Some(wrong_type(value, &expected))
    }

    /// Returns the expected type if the value has another one.
    fn expected(&self, value: &DeValue<'_>) -> Option<String> {
        let is_number = number(value).is_some();
        let (is_right, expected) = match self {
            Self::Number(_) | Self::NumberOrZero(_) => (is_number, "a number"),
            Self::NumberOrFalse(_) => (is_number || value.is_bool(), "a number or false"),
            Self::Whole(_) => (value.is_integer(), "a whole number"),
            Self::Vector(len, _) => {
                let is_right = numbers(value).is_some_and(|given| given.len() == *len);
                return (!is_right).then(|| format!("an array of {len} numbers"));
            }
            Self::Scale(_) => {
                let is_three = numbers(value).is_some_and(|given| given.len() == 3);
                (is_number || is_three, "a number or an array of 3")
            }
            Self::Corners(_) => {
                let given = corners(value);
                let is_right = given
                    .is_some_and(|given| given.iter().all(|c| c.len() == 3) && given.len() == 2);
                (is_right, "two arrays of 3 numbers")
            }
            Self::Points(len, _) => {
                let is_point = |item: &Spanned<DeValue<'_>>| {
                    numbers(item.get_ref()).is_some_and(|given| given.len() == *len)
                };
                let is_right = value
                    .as_array()
                    .is_some_and(|items| items.iter().all(is_point));
                return (!is_right).then(|| format!("an array of arrays of {len} numbers"));
            }
            Self::Flag => (value.is_bool(), "true or false"),
            Self::Choice(_) | Self::FileStem | Self::Text(_) => (value.is_str(), "a string"),
            Self::Choices(_) => {
                let is_word = |item: &Spanned<DeValue<'_>>| item.get_ref().is_str();
                let is_right = value
                    .as_array()
                    .is_some_and(|items| items.iter().all(is_word));
                (is_right, "an array of strings")
            }
            Self::Table(_) | Self::Inline(_) => (value.is_table(), "a table"),
            Self::Tables(_) => {
                let is_table = |item: &Spanned<DeValue<'_>>| item.get_ref().is_table();
                let is_right = value
                    .as_array()
                    .is_some_and(|items| items.iter().all(is_table));
                (is_right, "an array of tables")
            }
            Self::Other(_) => (true, ""),
        };
        (!is_right).then(|| expected.to_owned())
    }

    /// Describes the fault of a value of the right type.
    fn misfit(&self, name: &str, value: &DeValue<'_>) -> Option<String> {
        match self {
            Self::NumberOrFalse(_) if value.is_bool() => {
                (value.as_bool() == Some(true)).then(|| "true is not a limit".to_owned())
            }
            Self::Number(range) | Self::NumberOrFalse(range) => {
                let given = number(value)?;
                out_of_range(range.contains(&given), shown(given))
            }
            Self::NumberOrZero(range) => {
                let given = number(value)?;
                out_of_range(given == 0.0 || range.contains(&given), shown(given))
            }
            Self::Whole(range) => {
                let given = value.as_integer()?;
                let whole = i64::from_str_radix(given.as_str(), given.radix()).ok();
                let is_within = whole
                    .and_then(|whole| u32::try_from(whole).ok())
                    .is_some_and(|whole| range.contains(&whole));
                let text = whole.map_or_else(|| given.to_string(), |whole| whole.to_string());
                out_of_range(is_within, text)
            }
            Self::Vector(_, range) => {
                let given = numbers(value)?;
                let is_within = given.iter().all(|v| range.contains(v));
                out_of_range(is_within, shown_all(&given))
            }
            Self::Corners(range) => {
                let given = corners(value)?.concat();
                let far = given.iter().find(|v| !range.contains(v))?;
                Some(format!("{} is out of range", shown(*far)))
            }
            Self::Scale(range) => {
                let given = number(value)
                    .map(|scale| vec![scale])
                    .or_else(|| numbers(value))?;
                let is_within = given.iter().all(|v| range.contains(&v.abs()));
                out_of_range(is_within, shown_all(&given))
            }
            Self::Choice(words) => no_choice(name, words, value.as_str()?),
            Self::Choices(words) => {
                let mut given = value.as_array()?.iter();
                let one = name.strip_suffix('s').unwrap_or(name);
                given.find_map(|word| no_choice(one, words, word.get_ref().as_str()?))
            }
            Self::FileStem => {
                let given = value.as_str()?;
                (!is_file_stem(given)).then(|| format!("{given:?} is not a safe file name"))
            }
            Self::Text(_) | Self::Points(..) | Self::Other(_) => None,
            Self::Flag | Self::Table(_) | Self::Inline(_) | Self::Tables(_) => None,
        }
    }
}

/// Returns the first item that is not an array of `len` numbers.
fn wrong_point(items: &[Spanned<DeValue<'_>>], len: usize) -> Option<WrongElement> {
    let is_point = |item: &Spanned<DeValue<'_>>| {
        numbers(item.get_ref()).is_some_and(|given| given.len() == len)
    };
    let (index, item) = (items.iter().enumerate()).find(|(_, item)| !is_point(item))?;
    let below = item.get_ref().as_array().filter(|below| below.len() == len);
    match below.and_then(|below| no_number(below)) {
        Some(wrong) => Some(WrongElement {
            index: format!("[{index}]{}", wrong.index),
            ..wrong
        }),
        None => Some(WrongElement::of(
            index,
            item,
            &format!("an array of {len} numbers"),
        )),
    }
}

fn out_of_range(is_within: bool, given: String) -> Option<String> {
    (!is_within).then(|| format!("{given} is out of range"))
}

fn no_choice(name: &str, words: &[&str], given: &str) -> Option<String> {
    if words.contains(&given) {
        return None;
    }
    let nearest = nearest(given, words).unwrap_or_default();
    Some(format!(
        "{given:?} is not a value of {name}; the nearest is {nearest:?}"
    ))
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(number) => number.as_str().parse().ok(),
        DeValue::Integer(whole) => i128::from_str_radix(whole.as_str(), whole.radix())
            .ok()
            .map(|whole| whole as f64),
        _ => None,
    }
}

fn numbers(value: &DeValue<'_>) -> Option<Vec<f64>> {
    let items = value.as_array()?.iter();
    items.map(|item| number(item.get_ref())).collect()
}

fn corners(value: &DeValue<'_>) -> Option<Vec<Vec<f64>>> {
    let items = value.as_array()?.iter();
    items.map(|item| numbers(item.get_ref())).collect()
}
