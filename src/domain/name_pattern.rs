//! File names that contain a frame's number.

use std::{
    path::{Path, PathBuf, is_separator},
    str::FromStr,
};

/// A file name with a placeholder for the frame number: `out/m.%04d.ply`, or `out/m.####.ply`.
/// Folder names are taken literally.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

/// Why a text is not such a file name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PatternError {
    /// It has no placeholder, or more than one.
    #[error(
        "the file's name in `{0}` has to hold one place for the frame's number: write %04d or ####"
    )]
    Place(String),
}

impl Pattern {
    /// Path of a frame's file.
    pub fn file(&self, frame: u32) -> PathBuf {
        let Self {
            before,
            digits,
            after,
        } = self;
        PathBuf::from(format!("{before}{frame:0digits$}{after}"))
    }

    /// Folder of the files, as written; empty for none.
    pub fn folder(&self) -> &Path {
        let end = self.before.rfind(is_separator).map_or(0, |at| at + 1);
        Path::new(&self.before[..end])
    }

    /// Number in a file name without its folder, if it is one of these.
    pub fn number_in(&self, name: &str) -> Option<u32> {
        let end = self.before.rfind(is_separator).map_or(0, |at| at + 1);
        let digits = name.strip_prefix(&self.before[end..])?;
        let digits = digits.strip_suffix(&self.after[..])?;
        let number =
            (digits.bytes().all(|it| it.is_ascii_digit())).then(|| digits.parse().ok())??;
        // Not `m.7.ply` or `m.00007.ply` where the number has four digits.
        let as_written = format!("{number:0width$}", width = self.digits);
        (as_written == digits).then_some(number)
    }

    /// Extension of the names, lower case.
    pub fn ending(&self) -> String {
        let end = Path::new(&self.after)
            .extension()
            .or_else(|| Path::new(&self.after).file_name());
        end.map(|end| end.to_string_lossy().trim_start_matches('.').to_lowercase())
            .unwrap_or_default()
    }
}

impl FromStr for Pattern {
    type Err = PatternError;

    fn from_str(text: &str) -> Result<Self, PatternError> {
        let fault = || PatternError::Place(text.to_owned());
        let (folder, text) = text.split_at(text.rfind(is_separator).map_or(0, |at| at + 1));
        // The placeholder's position, its length, and its number of digits.
        let percent = text.find('%').map(|at| {
            let inner = text[at + 1..]
                .find('d')
                .map(|end| &text[at + 1..at + 1 + end]);
            let digits = inner.and_then(|digits| match digits {
                "" => Some(1),
                // A sign would parse too.
                digits => (digits.starts_with(|c: char| c.is_ascii_digit()))
                    .then(|| digits.parse().ok().filter(|n| (1..=9).contains(n)))
                    .flatten(),
            });
            (at, inner.map_or(0, |inner| inner.len() + 2), digits)
        });
        let hashes = text.find('#').map(|at| {
            let many = text[at..].chars().take_while(|&c| c == '#').count();
            (at, many, Some(many))
        });
        let (at, length, digits) = match (percent, hashes) {
            (Some(place), None) | (None, Some(place)) => place,
            _ => return Err(fault()),
        };
        let after = &text[at + length..];
        if after.contains(['%', '#']) {
            return Err(fault());
        }
        Ok(Self {
            before: format!("{folder}{}", &text[..at]),
            digits: digits.ok_or_else(fault)?,
            after: after.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_one_place_for_a_number() {
        let file = |text: &str, frame| {
            let pattern: Pattern = text.parse().expect("a pattern");
            (pattern.file(frame).display().to_string(), pattern.ending())
        };
        let named = |name: &str, end: &str| (name.to_owned(), end.to_owned());
        assert_eq!(file("a/m.%04d.ply", 7), named("a/m.0007.ply", "ply"));
        assert_eq!(file("m.###.OBJ", 12345), named("m.12345.OBJ", "obj"));
        assert_eq!(file("m%d.npy", 7), named("m7.npy", "npy"));
        assert_eq!(file("m%d.tar.npy", 7).1, "npy");
        let number = |text: &str, name: &str| {
            let pattern: Pattern = text.parse().expect("a pattern");
            pattern.number_in(name)
        };
        for (name, found) in [
            ("m.0007.ply", Some(7)),
            ("m.12345.ply", Some(12345)),
            ("m.7.ply", None),
            ("m.00007.ply", None),
            ("m.0007.obj", None),
            ("m.+007.ply", None),
            ("m..ply", None),
            ("m.99999999999.ply", None),
        ] {
            assert_eq!(number("a/m.%04d.ply", name), found, "{name}");
        }
        // Folder names are taken literally.
        for folder in ["100%", "take #2", "%04d", "####"] {
            let found = file(&format!("{folder}/m.%04d.ply"), 7);
            assert_eq!(found, named(&format!("{folder}/m.0007.ply"), "ply"));
            assert!(format!("{folder}/m.ply").parse::<Pattern>().is_err());
        }
        for text in [
            "m.ply",
            "m.%04d.%d.ply",
            "m.%04x.ply",
            "m.%+4d.ply",
            "%04d/m.ply",
            "m#.#.ply",
            "m%99d.ply",
        ] {
            assert!(text.parse::<Pattern>().is_err(), "{text}");
        }
    }
}
