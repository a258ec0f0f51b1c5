//! `swell inspect STUDY`

use std::{
    fmt::{self, Write},
    path::Path,
};

use serde_json::{Value, json};

use super::{InspectArgs, refuse_options};
use crate::{Failure, bake, count};
use swell_files::study::Study;
use swell_stage::inspect::study::Outline;

/// Whether a file is a study: it sets `kind` before its first table. False for an unreadable file.
pub(super) fn is_study(file: &Path) -> bool {
    let text = swell_domain::text::read(file).unwrap_or_default();
    let lines = text.lines().map(str::trim_start);
    lines
        .take_while(|line| !line.starts_with('['))
        .any(|line| match line.strip_prefix("kind") {
            Some(rest) => rest.trim_start().starts_with('='),
            None => false,
        })
}

fn outline(args: &InspectArgs, file: &Path) -> Result<Outline, Failure> {
    refuse_options(args, "a study: its scenes are named in it", file)?;
    let study = Study::load_within(file, bake::reach(args.allow_outside))?;
    Ok(Outline::of(&study))
}

/// Prints the runs of the study in `file`.
pub(super) fn show(out: &mut String, args: &InspectArgs, file: &Path) -> Result<(), Failure> {
    *out += &told(&outline(args, file)?, file);
    Ok(())
}

/// Describes the runs in words; `file` is the study, or the scene to be tuned.
pub(crate) fn told(outline: &Outline, file: &Path) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = show_outline(&mut out, outline, file);
    out
}

fn show_outline(out: &mut String, outline: &Outline, file: &Path) -> fmt::Result {
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    writeln!(
        out,
        "{name}: study of kind {}, {}, {}",
        outline.kind,
        count(outline.parts.len() as u64, "part"),
        count(outline.points() as u64, "point")
    )?;
    for warning in &outline.warnings {
        writeln!(out, "warning: {warning}")?;
    }
    for part in &outline.parts {
        writeln!(out, "\n{} ({})", part.name, part.key)?;
        for point in &part.points {
            writeln!(out, "   {point}")?;
        }
    }
    Ok(())
}

/// The description for programs.
pub(super) fn object(args: &InspectArgs, file: &Path) -> Result<Value, Failure> {
    Ok(outline_object(&outline(args, file)?))
}

pub(crate) fn outline_object(outline: &Outline) -> Value {
    let parts = outline.parts.iter();
    let parts =
        parts.map(|part| json!({ "name": part.name, "key": part.key, "points": part.points }));
    json!({
        "kind": "study",
        "study": outline.kind,
        "points": outline.points(),
        "parts": parts.collect::<Vec<_>>(),
        "warnings": outline.warnings,
    })
}
