//! Applies `key=value` overrides to a TOML text.

use std::{borrow::Cow, ops::Range};

use toml::{
    Spanned,
    de::{DeArray, DeTable, DeValue},
};

/// Number of spans reserved for one override, beyond the end of the text.
const OVERRIDE_SPAN: usize = 1 << 20;

type Value<'a> = Spanned<DeValue<'a>>;

/// Applies all overrides to the table, with spans beyond the `end` of the text.
///
/// # Errors
/// The first override that cannot be applied, and the reason.
pub(super) fn lay_all<'a>(
    root: &mut DeTable<'a>,
    overrides: &'a [String],
    end: usize,
) -> Result<(), (&'a String, String)> {
    for (index, entry) in overrides.iter().enumerate() {
        let mut spans = OverrideSpans {
            start: end + 1 + index * OVERRIDE_SPAN,
            taken: 0,
        };
        lay_over(root, entry, &mut spans).map_err(|reason| (entry, reason))?;
    }
    Ok(())
}

/// Returns the override with a span at `place`, beyond the `end` of the text.
pub(super) fn at(overrides: &[String], place: usize, end: usize) -> Option<&String> {
    let beyond = place.checked_sub(end + 1)?;
    overrides.get(beyond / OVERRIDE_SPAN)
}

/// Allocates a new span for each key and value of one override.
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

/// Applies `key=value` to the table. Both `a.b[2].c` and `a.b.2.c` index arrays.
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
        return Err(format!("\"{key}\" is not a dotted key; {ALLOWED}"));
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

/// Replaces all spans of a value by those of the override.
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

/// Returns the value named by `segment`, creating a table if there is none.
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
                .ok_or_else(|| format!("\"{segment}\" is not an index into an array of {len}"))
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
