//! The reference page: for every key the allowed values, unit, default and purpose.

use super::{
    super::key::{Key, Kind, LeftOut, Physics},
    File,
};

/// Returns the keys of these files as Markdown, one section per table.
pub fn page(files: &[File]) -> String {
    let mut out = "# Keys\n\nEvery key of every file that swell reads. This page is written by \
                   `swell keys`.\n"
        .to_owned();
    files.iter().for_each(|file| chapter(&mut out, *file));
    out
}

fn chapter(out: &mut String, file: File) {
    let (title, intro) = match file {
        File::Scene => (
            "Scene keys",
            "A bake continues (`--resume`) only with the values that it began with, except of keys \
             with a star: those are no physics.",
        ),
        File::Look => (
            "Look keys",
            "None of them is physics: a look never needs a new bake.",
        ),
        File::Study => (
            "Study keys",
            "Which of them a study takes depends on its `kind`.",
        ),
        File::Tolerance => (
            "Tolerance keys",
            "What a file does not name is shown and not judged. `NAME` is a name of an \
             attribute or an aggregate.",
        ),
        File::Whitewater => (
            "Whitewater keys",
            "Of the file that `swell whitewater CACHE --settings FILE` takes. None of them \
             is physics of the bake.",
        ),
    };
    *out += &format!("\n## {title}\n\n{intro}\n");
    section(out, file, "", "", file.keys());
}

/// Writes the keys of one table, then the sections of its tables.
fn section(out: &mut String, file: File, head: &str, about: &str, keys: &'static [Key]) {
    if !head.is_empty() {
        *out += &format!("\n### `{head}`\n");
        if !about.is_empty() {
            *out += &format!("\n{about}\n");
        }
    }
    let path = head.trim_matches(['[', ']']);
    let (tables, plain): (Vec<_>, Vec<_>) = keys.iter().partition(|key| !key.below().is_empty());
    if !plain.is_empty() {
        *out += "\n| key | allowed | left out | for |\n| --- | --- | --- | --- |\n";
    }
    for key in plain {
        let star = match (file, key.physics) {
            (File::Scene, Physics::No) => " \\*",
            _ => "",
        };
        let cells = [
            format!("`{}`{star}", key.name),
            cell(&key.values()),
            cell(&left_out(key)),
            cell(key.about),
        ];
        *out += &format!("| {} |\n", cells.join(" | "));
    }
    for table in tables {
        let dotted = match path {
            "" => table.name.to_owned(),
            path => format!("{path}.{}", table.name),
        };
        let head = match table.kind {
            Kind::Tables(_) => format!("[[{dotted}]]"),
            _ => format!("[{dotted}]"),
        };
        let star = match (file, table.physics) {
            (File::Scene, Physics::No) => " No key of it is physics.",
            _ => "",
        };
        let about = format!("{}.{}{star}", table.about, optional(table));
        section(out, file, &head, &about, table.below());
    }
}

/// Note on a table that may be left out.
fn optional(table: &Key) -> &'static str {
    match (&table.kind, &table.default) {
        (Kind::Tables(_), _) => " Any number.",
        (_, LeftOut::Absent) => " None if left out.",
        (_, LeftOut::Needed) => " Needed.",
        _ => "",
    }
}

fn left_out(key: &Key) -> String {
    match key.default {
        LeftOut::Needed if key.only.is_some() => "needed there".to_owned(),
        LeftOut::Needed => "needed".to_owned(),
        LeftOut::Value(toml) => format!("`{toml}`"),
        LeftOut::Computed(words) => words(),
        LeftOut::Absent => "none".to_owned(),
    }
}

/// An unescaped bar would end the cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
