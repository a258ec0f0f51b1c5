//! Reads STL through stl_io, which reads a single solid in lower-case text; texts are converted to
//! that first.

use std::io::Cursor;

use glam::DVec3;

use super::{Digits, Raw, lines_of, quoted, without_mark};

/// Bytes before the triangles of a binary file: 80 bytes of free text and the number of triangles.
const HEADER: usize = 84;

/// Reads the vertices and triangles of all solids.
pub(super) fn read(bytes: &[u8]) -> Result<Raw, String> {
    let promised = bytes
        .get(80..HEADER)
        .and_then(|b| b.try_into().ok())
        .map(|b| u64::from(u32::from_le_bytes(b)));
    if promised.is_some_and(|n| bytes.len() as u64 == HEADER as u64 + 50 * n) {
        return read_binary(bytes);
    }
    // Some exporters end a text with a control character, as old systems did.
    let text = without_mark(bytes)?;
    let end = text
        .iter()
        .rposition(|b| !matches!(b, 0 | 0x1a | b' ' | b'\t'..=b'\r'));
    let text = &text[..end.map_or(0, |end| end + 1)];
    let is_named = |name: &[u8]| name.eq_ignore_ascii_case(b"solid");
    let is_solid = text.trim_ascii_start().get(..5).is_some_and(is_named);
    if is_solid && !text.contains(&0) {
        return read_text(&lines_of(text));
    }
    let why = if is_solid {
        "begins with \"solid\", but is not text"
    } else {
        "not an STL: no \"solid\" line"
    };
    Err(match promised {
        Some(n) => format!(
            "{why}, and {n} triangles need {} bytes of {}",
            HEADER as u64 + 50 * n,
            bytes.len()
        ),
        None if is_solid => why.into(),
        None => "not an STL: too short".into(),
    })
}

fn read_binary(bytes: &[u8]) -> Result<Raw, String> {
    let mut bytes = bytes.to_vec();
    // stl_io takes every file that starts with "solid " for text, but some binary files do too.
    bytes[..80].fill(0);
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| e.to_string())?;
    let vertices = mesh.vertices.iter();
    let vertices = vertices.map(|v| DVec3::from_array(v.0.map(f64::from)));
    let triangles = mesh.faces.iter().map(|f| f.vertices.map(|i| i as u64));
    Ok(Raw::of_triangles(
        Digits::Single,
        vertices.collect(),
        triangles,
    ))
}

fn read_text(text: &str) -> Result<Raw, String> {
    let Joined {
        solid,
        begins,
        places,
    } = join(text)?;
    let mut solid = Cursor::new(solid);
    let facets = stl_io::create_stl_reader(&mut solid).map_err(|e| e.to_string())?;
    let mut count = 0;
    for (index, facet) in facets.enumerate() {
        // Parsed only to check the syntax: stl_io reads coordinates as 32-bit floats.
        facet.map_err(|error| {
            let line = begins.get(index).copied().unwrap_or_default();
            format!("the facet that begins in line {line}: {error}")
        })?;
        count += 1;
    }
    if places.len() != 3 * count {
        return Err(format!(
            "{} lines \"vertex\" with three numbers in {count} facets",
            places.len()
        ));
    }
    let triangles = (0..count as u64).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    Ok(Raw::of_triangles(Digits::Text, places, triangles))
}

/// All solids of a text, joined into one.
struct Joined {
    solid: String,
    /// Line in which each facet begins.
    begins: Vec<usize>,
    /// Corners of all facets.
    places: Vec<DVec3>,
}

fn join(text: &str) -> Result<Joined, String> {
    let mut solid = String::from("solid all\n");
    let (mut begins, mut places) = (Vec::new(), Vec::new());
    let (mut is_within, mut is_between) = (false, true);
    for (index, line) in text.lines().enumerate() {
        let line = line.trim().to_ascii_lowercase();
        let fault = |what: &str| format!("line {}: {what}", index + 1);
        if line.is_empty() {
            continue;
        }
        if line.starts_with("solid") {
            if is_within {
                return Err(fault("a solid begins within another: no line \"endsolid\""));
            }
            is_within = true;
            continue;
        }
        if !is_within {
            return Err(fault(&format!("{} outside a solid", quoted(&line))));
        }
        if line.starts_with("endsolid") {
            is_within = false;
            continue;
        }
        if is_between {
            begins.push(index + 1);
        }
        is_between = line == "endfacet";
        // Normals are not used, and may be NaN for a triangle without area.
        let words: Vec<_> = line.split_whitespace().collect();
        if let ["vertex", x, y, z] = words[..]
            && let [Ok(x), Ok(y), Ok(z)] = [x, y, z].map(str::parse)
        {
            places.push(DVec3::new(x, y, z));
        }
        match words[..] {
            ["facet", "normal", _, _, _] => solid += "facet normal 0 0 0",
            _ => solid += &line,
        }
        solid.push('\n');
    }
    if is_within {
        return Err("the last solid has no line \"endsolid\"".into());
    }
    solid += "endsolid all\n";
    Ok(Joined {
        solid,
        begins,
        places,
    })
}
