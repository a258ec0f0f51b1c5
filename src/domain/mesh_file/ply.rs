//! Reads PLY through ply-rs-bw, element by element. Errors are one line that quotes the file's
//! own line.

use std::{borrow::Cow, collections::HashSet, io::ErrorKind};

use glam::DVec3;
use ply_rs_bw::{
    parser::{ParseError, Parser, Reader},
    ply::{
        ElementDef, Encoding, KeyMap, Property, PropertyAccess, PropertyAccessResult, PropertyType,
        ScalarType,
    },
};

use super::{Digits, Raw, lines_of, quoted, without_mark};

/// A PLY element: the position of a vertex or the corners of a face; other elements are ignored.
#[derive(Default)]
struct PlyElement {
    place: [Option<f64>; 3],
    corners: Option<Vec<u64>>,
}

impl PropertyAccess for PlyElement {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            "x" => self.place[0] = number(&property),
            "y" => self.place[1] = number(&property),
            "z" => self.place[2] = number(&property),
            "vertex_indices" | "vertex_index" => {
                self.corners = property
                    .to_u32_list()
                    .map(|list| list.into_iter().map(u64::from).collect());
            }
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn number(property: &Property) -> Option<f64> {
    match property {
        Property::Double(v) => Some(*v),
        Property::Int(v) => Some(f64::from(*v)),
        Property::UInt(v) => Some(f64::from(*v)),
        // Exact for small integers and floats.
        other => other.to_f32_lossy().map(f64::from),
    }
}

/// Reads vertices and faces.
pub(super) fn read(bytes: &[u8]) -> Result<Raw, String> {
    let (text, body) = split(without_mark(bytes)?)?;
    check_names(&text)?;
    let parser = Parser::<PlyElement>::new();
    let mut header = parser
        .read_header(&mut Reader::new(text.as_bytes()))
        .map_err(|error| header_fault(&error, &text))?;
    let is_text = header.encoding == Encoding::Ascii;
    let lines = if is_text {
        lines_of(body)
    } else {
        Cow::default()
    };
    let numbers = with_digits(&lines);
    let mut reader = Reader::new(if is_text { numbers.as_bytes() } else { body });
    let mut raw = Raw {
        digits: coordinates(&mut header.elements, is_text),
        ..Raw::default()
    };
    for element in header.elements.values() {
        check_promise(element, header.encoding, reader.get_ref().len())?;
        let payload = parser
            .read_payload_for_element(&mut reader, element, &header)
            .map_err(|error| body_fault(&error, element, &lines, text.lines().count()))?;
        take(&mut raw, element, &payload)?;
    }
    if !header.elements.contains_key("face") {
        let names: Vec<_> = header.elements.keys().map(|name| quoted(name)).collect();
        return Err(format!("no element \"face\" among {}", names.join(", ")));
    }
    Ok(raw)
}

/// Precision of the vertices' coordinates. Text is read as 64-bit floats, whatever the
/// header declares.
fn coordinates(elements: &mut KeyMap<ElementDef>, is_text: bool) -> Digits {
    let mut digits = if is_text {
        Digits::Text
    } else {
        Digits::Double
    };
    let Some(vertex) = elements.get_mut("vertex") else {
        return digits;
    };
    for name in ["x", "y", "z"] {
        let Some(property) = vertex.properties.get_mut(name) else {
            continue;
        };
        if let PropertyType::Scalar(kind @ ScalarType::Float) = &mut property.data_type {
            if is_text {
                *kind = ScalarType::Double;
            } else {
                digits = Digits::Single;
            }
        }
    }
    digits
}

fn take(raw: &mut Raw, element: &ElementDef, payload: &[PlyElement]) -> Result<(), String> {
    match element.name.as_str() {
        "vertex" => {
            for (index, vertex) in payload.iter().enumerate() {
                let [Some(x), Some(y), Some(z)] = vertex.place else {
                    return Err(format!("vertex {index} lacks one of x, y, z"));
                };
                raw.vertices.push(DVec3::new(x, y, z));
            }
        }
        "face" => {
            for (index, face) in payload.iter().enumerate() {
                let corners = face.corners.as_deref().unwrap_or_default();
                if corners.is_empty() {
                    return Err(format!("face {index} has no list vertex_indices"));
                }
                if corners.len() < 3 {
                    return Err(format!("face {index} has fewer than three corners"));
                }
                raw.add_face(corners.iter().copied());
            }
        }
        _ => {}
    }
    Ok(())
}

/// Splits into the header's lines, each ended by `\n`, and the rest. The end of the first line
/// decides what ends the others: the body of a binary file may begin with any byte.
fn split(bytes: &[u8]) -> Result<(String, &[u8]), String> {
    let is_end = |b: &u8| matches!(b, b'\n' | b'\r');
    let first = bytes.iter().position(is_end).unwrap_or(bytes.len());
    let end = match bytes[first..] {
        [b'\r', ref rest @ ..] if rest.first() != Some(&b'\n') => b'\r',
        _ => b'\n',
    };
    if bytes[..first].trim_ascii() != b"ply" {
        let line = String::from_utf8_lossy(&bytes[..first.min(256)]);
        return Err(format!(
            "not a PLY: it begins with {}, not with \"ply\"",
            quoted(&line)
        ));
    }
    let mut text = String::new();
    let mut left = bytes;
    while !left.is_empty() {
        let length = left.iter().position(|&b| b == end).unwrap_or(left.len());
        let line = left[..length].trim_ascii();
        left = left.get(length + 1..).unwrap_or_default();
        text += &String::from_utf8_lossy(line);
        text.push('\n');
        if line == b"end_header" {
            return Ok((text, left));
        }
    }
    Err("the header has no line \"end_header\"".into())
}

/// Rejects duplicate names. ply-rs-bw stores elements and properties by name: of two with one name
/// it would drop the first, and continue at the wrong offset.
fn check_names(header: &str) -> Result<(), String> {
    let mut elements = HashSet::new();
    let mut properties = HashSet::new();
    for (index, line) in header.lines().enumerate() {
        let words: Vec<_> = line.split_whitespace().collect();
        let is_new = match words[..] {
            ["element", name, ..] => {
                properties.clear();
                elements.insert(name)
            }
            ["property", .., name] => properties.insert(name),
            _ => true,
        };
        if !is_new {
            return Err(format!(
                "line {}: {} is declared a second time",
                index + 1,
                quoted(line)
            ));
        }
    }
    Ok(())
}

/// ply-rs-bw rejects numbers without digits on both sides of the point, as C writes and reads them:
/// `1.`, `.5`.
fn with_digits(text: &str) -> Cow<'_, str> {
    let bytes = text.as_bytes();
    let is_digit = |at: Option<usize>| {
        at.and_then(|at| bytes.get(at))
            .is_some_and(u8::is_ascii_digit)
    };
    let mut out = String::new();
    let mut copied = 0;
    for (at, _) in text.match_indices('.') {
        let sides = [is_digit(at.checked_sub(1)), is_digit(Some(at + 1))];
        let point = match sides {
            [true, false] => ".0",
            [false, true] => "0.",
            _ => continue,
        };
        out += &text[copied..at];
        out += point;
        copied = at + 1;
    }
    if copied == 0 {
        return text.into();
    }
    out += &text[copied..];
    out.into()
}

/// Converts a header error to one line: the parser's first line names the fault, and the rest dumps
/// its state.
fn header_fault(error: &ParseError, header: &str) -> String {
    let told = error.to_string();
    let Some(number) = error.line() else {
        return told.lines().next().unwrap_or_default().to_owned();
    };
    let what = told.strip_prefix(&format!("Line {number}: "));
    let what = what.unwrap_or(&told).lines().next().unwrap_or_default();
    let line = header.lines().nth(number - 1).unwrap_or_default();
    let what = what.trim_end_matches(['.', ':']);
    format!("line {number}: {}: {what}", quoted(line))
}

/// Converts a body error to one line. `lines` are those of a text body, which follow
/// `header` lines.
fn body_fault(error: &ParseError, element: &ElementDef, lines: &str, header: usize) -> String {
    let ElementDef { name, count, .. } = element;
    if error.kind() == ErrorKind::UnexpectedEof {
        return format!(
            "the file ends within element {name:?}, of which the header declares {count}"
        );
    }
    let told = error.to_string();
    let Some(number) = error.line() else {
        let what = told.lines().next().unwrap_or_default();
        return format!("element {name:?}: {what}");
    };
    let line = lines.lines().nth(number - 1).unwrap_or_default();
    let is_number = |word: &&str| word.parse::<f64>().is_ok_and(f64::is_finite);
    let odd = line.split_whitespace().find(|word| !is_number(word));
    let value = told
        .split_once("Value: '")
        .and_then(|(_, rest)| rest.split_once('\''));
    let what = match (odd, value) {
        (Some(word), _) => format!("{} is not a number", quoted(word)),
        (None, Some((value, _))) => format!("{value} does not fit into its property's type"),
        (None, None) => "it has fewer values than the header declares".to_owned(),
    };
    format!(
        "line {}, element {name:?}: {}: {what}",
        header + number,
        quoted(line)
    )
}

/// Checks an element's declared count against the bytes that are left. Otherwise a header that
/// declares 2⁶⁰ elements without properties would keep the reader busy for years.
fn check_promise(
    element: &ElementDef,
    encoding: Encoding,
    bytes_left: usize,
) -> Result<(), String> {
    use ScalarType as S;
    let size = |scalar: &S| match scalar {
        S::Char | S::UChar => 1,
        S::Short | S::UShort => 2,
        S::Int | S::UInt | S::Float => 4,
        S::Double => 8,
    };
    // A line has at least two characters per property: a digit and a separator.
    let least: u128 = match encoding {
        Encoding::Ascii => element.properties.len() as u128 * 2,
        _ => element
            .properties
            .values()
            .map(|p| match &p.data_type {
                PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => size(scalar),
            })
            .sum(),
    };
    let needed = element.count as u128 * least.max(1);
    // The last line may lack its line end.
    if needed > bytes_left as u128 + 1 {
        return Err(format!(
            "the header declares {} of element \"{}\", which need {needed} bytes, but {bytes_left} \
             are left",
            element.count, element.name
        ));
    }
    Ok(())
}
