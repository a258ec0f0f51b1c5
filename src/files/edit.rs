//! Edits settings in the text of a scene while keeping its comments and order.

use toml_edit::{DocumentMut, InlineTable, Item, RawString, Table, TableLike, TomlError, Value};

/// A key and its new value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Dotted key such as `solver.pbf.iterations`, without indices.
    pub key: String,
    /// The value as TOML.
    pub value: String,
    /// Reason for the value, written as a comment above the key; a single line.
    pub reason: String,
}

/// Returns the text of a scene with `settings` applied. An existing key keeps its position
/// and trailing comment; a new key is appended to its table, and missing tables are
/// appended to the text.
///
/// # Errors
/// A description if the text or a value is not valid TOML, or if a key leads through a value
/// that is not a table.
pub fn with_settings(text: &str, settings: &[Setting]) -> Result<String, String> {
    let unread = |error: TomlError| error.message().to_owned();
    let mut document: DocumentMut = text.parse().map_err(unread)?;
    for setting in settings {
        let value = setting.value.parse().map_err(unread)?;
        set(document.as_table_mut(), &setting.key, value)?;
        explain(document.as_table_mut(), setting);
    }
    Ok(document.to_string())
}

/// Sets a key and creates missing tables.
fn set(root: &mut Table, key: &str, mut value: Value) -> Result<(), String> {
    let mut parts: Vec<&str> = key.split('.').collect();
    let last = parts.pop().expect("a key has a part");
    let mut table: &mut dyn TableLike = root;
    let mut is_inline = false;
    for (depth, part) in parts.iter().enumerate() {
        let item = table.entry(part).or_insert_with(|| made(is_inline));
        is_inline = item.is_inline_table();
        let inner = item.as_table_like_mut();
        table = inner.ok_or_else(|| format!("{} is not a table", parts[..=depth].join(".")))?;
    }
    if let Some(old) = table.get_mut(last).and_then(Item::as_value_mut) {
        *value.decor_mut() = old.decor().clone();
        *old = value;
    } else {
        table.insert(last, Item::Value(value));
        if is_inline {
            table.fmt();
        }
    }
    Ok(())
}

/// Creates an empty table. It is implicit: it has no header while it holds only tables.
fn made(is_inline: bool) -> Item {
    if is_inline {
        return Item::Value(InlineTable::new().into());
    }
    let mut table = Table::new();
    table.set_implicit(true);
    Item::Table(table)
}

/// Writes the reason on a line above the key, or above the key of the inline table that holds it.
fn explain(root: &mut Table, setting: &Setting) {
    let mut table = root;
    for part in setting.key.split('.') {
        if table.get(part).is_some_and(Item::is_table) {
            let inner = table.get_mut(part).and_then(Item::as_table_mut);
            table = inner.expect("a table");
            continue;
        }
        let mut key = table.key_mut(part).expect("a key that was set");
        let decor = key.leaf_decor_mut();
        let before = decor.prefix().and_then(RawString::as_str);
        let before = before.unwrap_or_default();
        // The prefix of a key ends with its indentation.
        let indent = before.rfind('\n').map_or(before, |end| &before[end + 1..]);
        decor.set_prefix(format!("{before}# {}\n{indent}", setting.reason));
        break;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(key: &str, value: &str) -> Setting {
        Setting {
            key: key.into(),
            value: value.into(),
            reason: format!("why {value}"),
        }
    }

    const SCENE: &str = "\
# A scene.
[shot]
name = \"a\"

[solver]
method = \"pbf\"   # short
[solver.pbf]      # of PBF
  particle_spacing = 0.1            # d
[solver.flip]
cell_size = 0.2
pressure = { tolerance = 1e-5 }
";

    #[test]
    fn keys_keep_their_place_and_comments_theirs() {
        let settings = [
            set("solver.method", "\"flip\""),
            set("solver.pbf.particle_spacing", "0.25"),
            set("solver.flip.pressure.tolerance", "1e-3"),
        ];
        let written = with_settings(SCENE, &settings).expect("written");
        assert_eq!(
            written,
            "\
# A scene.
[shot]
name = \"a\"

[solver]
# why \"flip\"
method = \"flip\"   # short
[solver.pbf]      # of PBF
  # why 0.25
  particle_spacing = 0.25            # d
[solver.flip]
cell_size = 0.2
# why 1e-3
pressure = { tolerance = 1e-3 }
"
        );
        assert_eq!(with_settings(SCENE, &[]).expect("nothing"), SCENE);
    }

    #[test]
    fn keys_that_are_not_there_come_into_their_table() {
        let settings = [
            set("solver.pbf.particle_spacing", "0.25"),
            set("solver.pbf.iterations", "8"),
            set("solver.pbf.cfl", "0.5"),
            set("solver.flip.pressure.preconditioner", "\"ipp\""),
            set("effects.viscosity.xsph", "0.1"),
        ];
        let written = with_settings(SCENE, &settings).expect("written");
        for piece in [
            "[solver.pbf]      # of PBF\n  # why 0.25\n  particle_spacing = 0.25            # d\n\
             # why 8\niterations = 8\n# why 0.5\ncfl = 0.5\n",
            "# why \"ipp\"\npressure = { tolerance = 1e-5, preconditioner = \"ipp\" }\n",
            "\n[effects.viscosity]\n# why 0.1\nxsph = 0.1\n",
        ] {
            assert!(written.contains(piece), "{written}");
        }
        let read: toml::Table = toml::from_str(&written).expect("TOML");
        assert_eq!(
            read["solver"]["flip"]["pressure"]["preconditioner"].as_str(),
            Some("ipp")
        );
        assert_eq!(read["effects"]["viscosity"]["xsph"].as_float(), Some(0.1));
    }

    #[test]
    fn tables_without_a_header_of_their_own_are_found() {
        // Other headers imply `[solver]`; nothing implies `[solver.flip]`.
        let text = "[solver.pbf]\nparticle_spacing = 0.1\n[effects]\nviscosity = {}";
        let settings = [
            set("solver.flip.cell_size", "0.2"),
            set("effects.viscosity.xsph", "0.1"),
        ];
        let written = with_settings(text, &settings).expect("written");
        let read: toml::Table = toml::from_str(&written).expect("TOML");
        assert_eq!(read["solver"]["flip"]["cell_size"].as_float(), Some(0.2));
        assert_eq!(read["effects"]["viscosity"]["xsph"].as_float(), Some(0.1));
        // Controls: invalid TOML, and a key that leads through a number.
        assert!(with_settings("[", &settings).is_err());
        let through = [set("solver.pbf.particle_spacing.deep", "1")];
        let said = with_settings(text, &through).expect_err("not a table");
        assert_eq!(said, "solver.pbf.particle_spacing is not a table");
    }
}
