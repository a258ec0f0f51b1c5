//! Numbers, types and boxes in messages, in the user's notation.

use swell_domain::bounds::Bounds;

/// Formats a number briefly: `1e308` instead of its 309 digits.
pub fn shown(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if (1e-4..1e7).contains(&size) || !size.is_finite() => format!("{value}"),
        _ => format!("{value:e}"),
    }
}

/// Formats numbers as a TOML array.
pub fn shown_all(values: &[f64]) -> String {
    let words: Vec<_> = values.iter().map(|&value| shown(value)).collect();
    format!("[{}]", words.join(", "))
}

/// Type names of serde with those for users; longer names come before their prefixes.
const TYPES: [(&str, &str); 11] = [
    ("a boolean", "true or false"),
    ("a sequence", "an array"),
    ("a map", "a table"),
    ("f64", "a number"),
    ("f32", "a number"),
    ("i64", "a whole number"),
    ("u64", "a whole number from 0"),
    ("u32", "a whole number from 0"),
    ("usize", "a whole number from 0"),
    ("internally tagged enum ", "a table"),
    ("struct ", "a table"),
];

/// Replaces Rust's type names in serde's message: "invalid type: string \"fine\",
/// expected a number".
pub fn plain_types(message: &str) -> String {
    let lines = message.lines().collect::<Vec<_>>().join("; ");
    let Some((before, expected)) = lines.rsplit_once("expected ") else {
        return lines;
    };
    let found = TYPES.iter().find(|(name, _)| expected.starts_with(name));
    let Some((name, word)) = found else {
        return lines;
    };
    // The name of a table's type is dropped as well.
    let rest = match name.ends_with(' ') {
        true => "",
        false => &expected[name.len()..],
    };
    let before = before.replace("floating point", "number");
    format!("{before}expected {word}{rest}")
}

/// Whether a name can be part of a file name.
pub fn is_file_stem(name: &str) -> bool {
    (1..=100).contains(&name.len())
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.'))
}

/// Formats a box by its corners.
pub fn extent(bounds: Option<Bounds>) -> String {
    bounds.map_or_else(
        || "nothing".to_owned(),
        |b| {
            let [min, max] = [b.min, b.max].map(|corner| shown_all(&corner.to_array()));
            format!("{min} to {max}")
        },
    )
}

/// Formats an error and its sources in one line.
pub fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}

/// Formats a non-negative number with four significant digits.
pub fn four_digits(of: f64) -> String {
    if of == 0.0 {
        return "0".to_owned();
    }
    let digits = (3.0 - of.log10().floor()).clamp(0.0, 30.0) as usize;
    format!("{of:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (-3.0, "-3"),
            (0.25, "0.25"),
            (1e5, "100000"),
            (1e308, "1e308"),
            (-1.5e300, "-1.5e300"),
            (1e-5, "1e-5"),
            (5e-324, "5e-324"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(shown(value), text);
        }
        assert_eq!(shown_all(&[0.0, 1e308]), "[0, 1e308]");
    }

    #[test]
    fn types_are_called_what_a_user_calls_them() {
        for (raw, plain) in [
            (
                "invalid type: string \"fine\", expected f64",
                "invalid type: string \"fine\", expected a number",
            ),
            (
                "invalid type: floating point `1.5`, expected i64",
                "invalid type: number `1.5`, expected a whole number",
            ),
            (
                "invalid type: integer `1`, expected a boolean",
                "invalid type: integer `1`, expected true or false",
            ),
            (
                "invalid type: string \"x\", expected struct ShotSpec",
                "invalid type: string \"x\", expected a table",
            ),
            (
                "invalid length 2, expected an array of length 3",
                "invalid length 2, expected an array of length 3",
            ),
            ("something else", "something else"),
        ] {
            assert_eq!(plain_types(raw), plain);
        }
    }
}
