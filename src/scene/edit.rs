//! Settings written into the text of a scene, which keeps its comments and its order.

use std::ops::Range;

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

/// A key and what it is set to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Dotted, as in `solver.pbf.iterations`; none of its parts is an index.
    pub key: String,
    /// As TOML has it.
    pub value: String,
    /// Stands above it, as a comment; one line.
    pub reason: String,
}

/// A change of the text: what stands in a range becomes another text.
struct Edit {
    at: Range<usize>,
    text: String,
    /// Whether it is a comment above a key that was there.
    is_above: bool,
}

/// The text of a scene with settings. A key that stands there keeps its place, and the comment behind it; one that does not
/// comes first in its table, which is made at the end of the text where there is none.
///
/// # Errors
/// In words: a text that is no TOML, or a key that leads through what is no table.
pub fn with_settings(text: &str, settings: &[Setting]) -> Result<String, String> {
    let root = DeTable::parse(text).map_err(|error| error.message().to_owned())?;
    let mut edits = Vec::new();
    for setting in settings {
        edits.extend(edits_for(text, root.get_ref(), setting)?);
    }
    // From the end on, so that places before it stay; of two at one place the first comes first, and new keys before what stands
    // above a key that was there.
    edits.reverse();
    edits.sort_by_key(|edit| std::cmp::Reverse((edit.at.start, edit.is_above)));
    let mut out = text.to_owned();
    for edit in edits {
        out.replace_range(edit.at, &edit.text);
    }
    Ok(out)
}

fn edits_for(text: &str, root: &DeTable<'_>, setting: &Setting) -> Result<Vec<Edit>, String> {
    let Setting { key, value, reason } = setting;
    let parts: Vec<&str> = key.split('.').collect();
    let mut table = root;
    // The innermost table that is open to another key, and what the key is called in it.
    let mut place = None;
    for (depth, part) in parts.iter().enumerate() {
        let Some(found) = table.get(*part) else {
            break;
        };
        let rest = parts[depth + 1..].join(".");
        if rest.is_empty() {
            let line = line_start(text, found.span().start);
            let indent: String = text[line..].chars().take_while(|c| *c == ' ').collect();
            return Ok(vec![
                above(line, format!("{indent}# {reason}\n")),
                Edit {
                    at: found.span(),
                    text: value.clone(),
                    is_above: false,
                },
            ]);
        }
        let DeValue::Table(inner) = found.get_ref() else {
            return Err(format!("{} is no table", parts[..=depth].join(".")));
        };
        if let Some(at) = opening(text, found, &parts[..=depth]) {
            place = Some((at, rest));
        }
        table = inner;
    }
    Ok(match place {
        Some((Opening::Header(at), rest)) => {
            vec![insertion(at, format!("# {reason}\n{rest} = {value}\n"))]
        }
        Some((Opening::Brace { at, is_empty }, rest)) => {
            let line = line_start(text, at);
            let comma = if is_empty { " " } else { "," };
            vec![
                above(line, format!("# {reason}\n")),
                insertion(at, format!(" {rest} = {value}{comma}")),
            ]
        }
        None => {
            let (name, last) = parts.split_at(parts.len() - 1);
            let break_ = if text.ends_with('\n') { "" } else { "\n" };
            let table = format!("{break_}\n[{}]\n# {reason}\n", name.join("."));
            vec![insertion(
                text.len(),
                format!("{table}{} = {value}\n", last.concat()),
            )]
        }
    })
}

/// Where another key may stand in a table.
enum Opening {
    /// On the line after its header.
    Header(usize),
    /// Behind its brace.
    Brace { at: usize, is_empty: bool },
}

/// `None` of a table that only the names of other tables or of keys speak of.
fn opening(text: &str, table: &Spanned<DeValue<'_>>, path: &[&str]) -> Option<Opening> {
    let (start, rest) = (table.span().start, text.get(table.span().start..)?);
    if let Some(inside) = rest.strip_prefix('{') {
        return Some(Opening::Brace {
            at: start + 1,
            is_empty: inside.trim_start().starts_with('}'),
        });
    }
    let line = rest.lines().next()?;
    let name = line.strip_prefix('[')?.split(']').next()?;
    let is_own = name.split('.').map(str::trim).eq(path.iter().copied());
    is_own.then_some(Opening::Header(start + line.len() + 1))
}

fn insertion(at: usize, text: String) -> Edit {
    Edit {
        at: at..at,
        text,
        is_above: false,
    }
}

fn above(at: usize, text: String) -> Edit {
    Edit {
        is_above: true,
        ..insertion(at, text)
    }
}

fn line_start(text: &str, at: usize) -> usize {
    text[..at].rfind('\n').map_or(0, |end| end + 1)
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
            "[solver.pbf]      # of PBF\n# why 8\niterations = 8\n# why 0.5\ncfl = 0.5\n  # why 0.25\n  particle_spacing = 0.25",
            "# why \"ipp\"\npressure = { preconditioner = \"ipp\", tolerance = 1e-5 }\n",
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
        // The names of other tables speak of [solver], and of [solver.flip] nothing does.
        let text = "[solver.pbf]\nparticle_spacing = 0.1\n[effects]\nviscosity = {}";
        let settings = [
            set("solver.flip.cell_size", "0.2"),
            set("effects.viscosity.xsph", "0.1"),
        ];
        let written = with_settings(text, &settings).expect("written");
        let read: toml::Table = toml::from_str(&written).expect("TOML");
        assert_eq!(read["solver"]["flip"]["cell_size"].as_float(), Some(0.2));
        assert_eq!(read["effects"]["viscosity"]["xsph"].as_float(), Some(0.1));
        // Controls: what is no TOML, and a way through a number.
        assert!(with_settings("[", &settings).is_err());
        let through = [set("solver.pbf.particle_spacing.deep", "1")];
        let said = with_settings(text, &through).expect_err("no table");
        assert_eq!(said, "solver.pbf.particle_spacing is no table");
    }
}
