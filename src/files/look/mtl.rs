//! Reader for the parts of material libraries (MTL) that are used: `newmtl`, `Kd` and `map_Kd`.
//!
//! tobj also reads MTL, but reports no line numbers and leaves the options of a
//! picture in its name.

use std::path::PathBuf;

use swell_domain::text;

/// A material of a library.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) name: String,
    /// Reflectance, linear; 1 if the library does not set it.
    pub(super) colour: [f64; 3],
    pub(super) map: Option<Map>,
    /// Line of its `newmtl`.
    pub(super) line: usize,
}

/// A picture that multiplies the colour.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// As named in the library, relative to it.
    pub(super) file: PathBuf,
    /// Line of the statement.
    pub(super) line: usize,
    /// Factor on the texture coordinates.
    pub(super) scale: [f64; 2],
    /// Offset added to the scaled texture coordinates.
    pub(super) offset: [f64; 2],
}

/// A library, and the names of its ignored statements and options, each once.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Library {
    pub(super) entries: Vec<Entry>,
    pub(super) unused: Vec<String>,
}

/// Largest scale or offset of a picture.
const MOST: f64 = 1e6;

pub(super) fn read(bytes: &[u8]) -> Result<Library, String> {
    let bytes = text::without_mark(bytes).map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(bytes);
    let mut library = Library::default();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        library
            .add(number, line)
            .map_err(|problem| format!("line {number}: {problem}"))?;
    }
    if library.entries.is_empty() {
        return Err("it has no material (newmtl)".to_owned());
    }
    Ok(library)
}

impl Library {
    fn add(&mut self, number: usize, line: &str) -> Result<(), String> {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if word == "newmtl" {
            if rest.is_empty() {
                return Err("newmtl without a name".to_owned());
            }
            if self.entries.iter().any(|it| it.name == rest) {
                return Err(format!("material {rest:?} is defined twice"));
            }
            self.entries.push(Entry {
                name: rest.to_owned(),
                colour: [1.0; 3],
                map: None,
                line: number,
            });
            return Ok(());
        }
        let Some(entry) = self.entries.last_mut() else {
            let shown: String = word.chars().take(20).collect();
            return Err(format!("{shown:?} comes before the first newmtl"));
        };
        match word {
            "Kd" => entry.colour = colour(rest)?,
            "map_Kd" => {
                let (map, unused) = map(rest, number)?;
                entry.map = Some(map);
                unused.into_iter().for_each(|option| self.skip(option));
            }
            _ => self.skip(word.chars().take(20).collect()),
        }
        Ok(())
    }

    fn skip(&mut self, word: String) {
        if !self.unused.contains(&word) {
            self.unused.push(word);
        }
    }
}

/// Reads one number for all channels, or three numbers.
fn colour(rest: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = rest.split_whitespace().map(|it| it.parse().ok()).collect();
    let colour = match numbers.as_deref() {
        Some(&[all]) => [all; 3],
        Some(&[r, g, b]) => [r, g, b],
        _ => {
            return Err(format!(
                "Kd {rest:?}; allowed are one number or three from 0 to 1"
            ));
        }
    };
    if !colour.iter().all(|c| (0.0..=1.0).contains(c)) {
        return Err(format!("Kd {rest:?}; allowed are numbers from 0 to 1"));
    }
    Ok(colour)
}

/// Reads options and a file name, which may contain spaces. Also returns the options
/// that are ignored.
fn map(rest: &str, line: usize) -> Result<(Map, Vec<String>), String> {
    let mut map = Map {
        file: PathBuf::new(),
        line,
        scale: [1.0; 2],
        offset: [0.0; 2],
    };
    let mut unused = Vec::new();
    let mut rest = rest.trim_start();
    while rest.starts_with('-') {
        let option = word(&mut rest);
        match option {
            "-s" => map.scale = pair(option, &mut rest, map.scale)?,
            "-o" => map.offset = pair(option, &mut rest, map.offset)?,
            "-t" => {
                pair(option, &mut rest, [0.0; 2])?;
                unused.push(format!("map_Kd {option}"));
            }
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-texres" | "-bm" | "-boost"
            | "-imfchan" | "-type" => {
                word(&mut rest);
                unused.push(format!("map_Kd {option}"));
            }
            "-mm" => {
                word(&mut rest);
                word(&mut rest);
                unused.push(format!("map_Kd {option}"));
            }
            _ => return Err(format!("map_Kd has no option {option:?}")),
        }
    }
    if rest.is_empty() {
        return Err("map_Kd without a file".to_owned());
    }
    map.file = PathBuf::from(rest);
    Ok((map, unused))
}

/// Splits off the next word.
fn word<'a>(rest: &mut &'a str) -> &'a str {
    let (first, after) = rest.split_once(char::is_whitespace).unwrap_or((*rest, ""));
    *rest = after.trim_start();
    first
}

/// Reads one to three numbers along u, v and w; pictures do not use the last.
fn pair(option: &str, rest: &mut &str, default: [f64; 2]) -> Result<[f64; 2], String> {
    let mut numbers = Vec::new();
    while numbers.len() < 3 {
        let next = rest.split_whitespace().next().unwrap_or_default();
        let Ok(number) = next.parse::<f64>() else {
            break;
        };
        if number.is_nan() || number.abs() > MOST {
            return Err(format!(
                "map_Kd {option} {next}; allowed are numbers up to {MOST:e}"
            ));
        }
        numbers.push(number);
        word(rest);
    }
    let Some(&u) = numbers.first() else {
        return Err(format!("map_Kd {option} needs numbers"));
    };
    Ok([u, numbers.get(1).copied().unwrap_or(default[1])])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use super::*;

    #[test]
    fn colours_and_pictures_are_read_and_the_rest_is_told() {
        let text = "\u{feff}# by hand\r\nnewmtl wet wall\r\nKd 0.5 0.25 0.125\r\nNs 10\r\n\
            map_Kd -s 2 3 1 -o 0.5 -clamp on a b.png\r\n\
            newmtl plain\nKd 0.5\nNs 3\n";
        let library = read(text.as_bytes()).unwrap();
        let [wall, plain] = &library.entries[..] else {
            panic!("{library:?}");
        };
        assert_eq!(
            (wall.name.as_str(), wall.colour),
            ("wet wall", [0.5, 0.25, 0.125])
        );
        let map = wall.map.as_ref().unwrap();
        assert_eq!(
            (map.file.as_path(), map.line),
            (PathBuf::from("a b.png").as_path(), 5)
        );
        assert_eq!((map.scale, map.offset), ([2.0, 3.0], [0.5, 0.0]));
        assert_eq!((plain.colour, plain.map.as_ref()), ([0.5; 3], None));
        assert_eq!(library.unused, ["Ns", "map_Kd -clamp"]);
    }

    #[test]
    fn what_is_malformed_is_told_with_its_line() {
        for (text, words) in [
            ("", "it has no material"),
            ("# nothing\n", "it has no material"),
            (
                "Kd 1 1 1\nnewmtl a\n",
                "line 1: \"Kd\" comes before the first newmtl",
            ),
            ("newmtl\n", "line 1: newmtl without a name"),
            (
                "newmtl a\n\nnewmtl a\n",
                "line 3: material \"a\" is defined twice",
            ),
            ("newmtl a\nKd 1 2\n", "line 2: Kd \"1 2\"; allowed"),
            ("newmtl a\nKd x 0 0\n", "line 2: Kd \"x 0 0\"; allowed"),
            ("newmtl a\nKd 0 0 1.5\n", "line 2: Kd \"0 0 1.5\"; allowed"),
            ("newmtl a\nKd nan\n", "line 2: Kd \"nan\"; allowed"),
            (
                "newmtl a\nKd spectral a.rfl\n",
                "line 2: Kd \"spectral a.rfl\"; allowed",
            ),
            ("newmtl a\nmap_Kd\n", "line 2: map_Kd without a file"),
            ("newmtl a\nmap_Kd -s 2 2\n", "line 2: map_Kd without a file"),
            (
                "newmtl a\nmap_Kd -s a.png\n",
                "line 2: map_Kd -s needs numbers",
            ),
            (
                "newmtl a\nmap_Kd -s inf a.png\n",
                "line 2: map_Kd -s inf; allowed",
            ),
            (
                "newmtl a\nmap_Kd -q a.png\n",
                "line 2: map_Kd has no option \"-q\"",
            ),
            (
                "\u{89}PNG\r\n\u{1a}\n",
                "line 1: \"\\u{89}PNG\" comes before",
            ),
        ] {
            let problem = read(text.as_bytes()).unwrap_err();
            assert!(problem.contains(words), "{text:?}: {problem}");
        }
    }
}
