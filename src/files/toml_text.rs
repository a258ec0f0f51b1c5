//! Writes tables of keys as TOML, in the order of their keys.

use serde::Serialize;
use toml::{Table, Value};

use super::{
    declare::Keyed,
    key::{Key, Kind},
};

/// Returns what a file of these keys with these values says.
pub(super) fn to_toml<T: Keyed + Serialize>(spec: &T) -> String {
    let mut out = String::new();
    write_tables(&mut out, T::KEYS, "", &table(spec));
    out
}

/// Returns a table of keys with its values.
pub(super) fn table(spec: &impl Serialize) -> Table {
    Table::try_from(spec).expect("numbers, names and tables of them are TOML")
}

/// Writes the tables below `path` in the order of their keys, plain keys before tables.
fn write_tables(out: &mut String, keys: &[Key], path: &str, values: &Table) {
    let is_table = |key: &&Key| matches!(key.kind, Kind::Table(_) | Kind::Tables(_));
    for key in keys.iter().filter(|key| !is_table(key)) {
        if let Some(value) = values.get(key.name) {
            *out += &format!("{} = {}\n", key.name, inline(key, value));
        }
    }
    for key in keys.iter().filter(is_table) {
        let path = match path {
            "" => key.name.to_owned(),
            path => format!("{path}.{}", key.name),
        };
        let (items, head) = match values.get(key.name) {
            None => continue,
            Some(Value::Array(items)) => (items.as_slice(), format!("[[{path}]]")),
            Some(item) => (std::slice::from_ref(item), format!("[{path}]")),
        };
        for table in items.iter().filter_map(Value::as_table) {
            if !out.is_empty() {
                out.push('\n');
            }
            *out += &format!("{head}\n");
            write_tables(out, key.below(), &path, table);
        }
    }
}

/// Formats a value in one line. `{:?}` of a float is the shortest decimal that reads back as the
/// same number, and valid TOML.
fn inline(key: &Key, value: &Value) -> String {
    match value {
        Value::Float(number) => format!("{number:?}"),
        Value::Array(items) => {
            let items: Vec<_> = items.iter().map(|item| inline(key, item)).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Table(table) => {
            let rows = key.below().iter().filter_map(|below| {
                let value = table.get(below.name)?;
                Some(format!("{} = {}", below.name, inline(below, value)))
            });
            format!("{{ {} }}", rows.collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}
