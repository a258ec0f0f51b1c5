//! Motions through points: tables in a scene, or in files written by spreadsheets
//! and other programs.

use std::{fs::File, io::Read as _, path::Path};

use super::{document::Document, speed::check_speed};
use swell_domain::{motion::Motion, text};
use swell_scene::{
    SceneError,
    words::{chain, shown, shown_all},
};

/// Largest size of a motion table, bytes: ten hours at 60 points per second.
const MAX_TABLE_BYTES: u64 = 64 << 20;

type Result<T> = std::result::Result<T, String>;

/// Constraints on the points of a table.
#[derive(Clone, Copy)]
pub(super) struct Allowed {
    /// Least displacement or angle.
    least: f64,
    /// Checks the speed between two points.
    pub(super) check_speed: fn(f64) -> Result<()>,
}

/// Displacements, metres, that never go behind the start.
pub(super) const WAYS: Allowed = Allowed {
    least: 0.0,
    check_speed,
};

/// Displacements of a domain, metres, which go either way.
pub(super) const BOTH_WAYS: Allowed = Allowed {
    least: -1e9,
    check_speed,
};

/// Angles, degrees; the resulting speed depends on the solid and is checked there.
pub(super) const ANGLES: Allowed = Allowed {
    least: -1e9,
    check_speed: |_| Ok(()),
};

/// Reads the motion table at `path`, in place or from a file.
pub(super) fn table(
    doc: &Document<'_>,
    path: &str,
    base_dir: &Path,
    (file, points): (&Option<String>, &Option<Vec<[f64; 2]>>),
    allowed: Allowed,
) -> std::result::Result<Motion, SceneError> {
    let Some(file) = file else {
        let points = points.clone().unwrap_or_default();
        check_points(&points, &|index| format!("point {index}"), allowed)
            .map_err(|problem| doc.fault_of(&format!("{path}.points"), problem))?;
        return Ok(Motion::Table { points });
    };
    let key = format!("{path}.file");
    let file = doc.find(base_dir, &key, file)?;
    let read = || {
        let rows = rows(&text_of(&file)?)?;
        let (lines, points): (Vec<usize>, Vec<[f64; 2]>) = rows.into_iter().unzip();
        check_points(&points, &|index| format!("line {}", lines[index]), allowed)?;
        Ok(points)
    };
    let points = read()
        .map_err(|problem: String| doc.fault_of(&key, format!("{}: {problem}", file.display())))?;
    Ok(Motion::Table { points })
}

/// Checks that points form a motion; `called` describes the location of a point.
fn check_points(
    points: &[[f64; 2]],
    called: &dyn Fn(usize) -> String,
    allowed: Allowed,
) -> Result<()> {
    if points.len() < 2 {
        return Err(format!("{} points are too few", points.len()));
    }
    let least = points.iter().map(|[_, x]| *x).fold(0.0, f64::min);
    for (i, [t, x]) in points.iter().enumerate() {
        // 1e9 keeps sums and products finite.
        if !((0.0..=1e9).contains(t) && (-1e9..=1e9).contains(x)) {
            return Err(format!(
                "{}, {}, is out of range",
                called(i),
                shown_all(&[*t, *x])
            ));
        }
        if *x < allowed.least {
            return Err(format!(
                "{}, {}, lies outward of the start: displacements run from 0 on, inward (for a \
                 solid: along its direction); a table that moves both ways has to begin at its \
                 outward end: add {} m to each, and lead there from 0",
                called(i),
                shown_all(&[*t, *x]),
                shown(-least)
            ));
        }
    }
    if points[0][1] != 0.0 {
        return Err(format!(
            "the first displacement is {}, and has to be 0",
            shown(points[0][1])
        ));
    }
    for (i, pair) in points.windows(2).enumerate() {
        if pair[1][0] - pair[0][0] < 1e-6 {
            return Err(format!(
                "the time of {}, {} s, is not a microsecond after {} s",
                called(i + 1),
                shown(pair[1][0]),
                shown(pair[0][0])
            ));
        }
        (allowed.check_speed)((pair[1][1] - pair[0][1]).abs() / (pair[1][0] - pair[0][0]))
            .map_err(|problem| format!("up to {}, {problem}", called(i + 1)))?;
    }
    Ok(())
}

fn text_of(file: &Path) -> Result<String> {
    let mut bytes = Vec::new();
    File::open(file)
        .and_then(|file| file.take(MAX_TABLE_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|e| chain(&e))?;
    if bytes.len() as u64 > MAX_TABLE_BYTES {
        return Err(format!("larger than {} MiB", MAX_TABLE_BYTES >> 20));
    }
    let text = text::of(&bytes).map_err(|e| e.to_string())?;
    Ok(text.to_owned())
}

/// Reads two numbers per line, with the line number counted from 1. They are separated by a
/// comma, a semicolon, a tab or spaces. Text after `#`, empty lines, and titles on the first
/// other line are skipped.
fn rows(text: &str) -> Result<Vec<(usize, [f64; 2])>> {
    let mut found = Vec::new();
    let mut may_be_titles = true;
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let fields: Vec<&str> = fields(line);
        let numbers: Vec<Option<f64>> = fields.iter().map(|field| field.parse().ok()).collect();
        match numbers[..] {
            [Some(t), Some(x)] => found.push((index + 1, [t, x])),
            _ if may_be_titles && are_titles(&fields) => {}
            _ => {
                return Err(format!(
                    "line {}: {line:?} is not time and displacement, two numbers with decimal \
                     points and a comma, a semicolon, a tab or spaces between them",
                    index + 1
                ));
            }
        }
        may_be_titles = false;
    }
    Ok(found)
}

/// Splits a line at commas, semicolons and whitespace; nothing between two commas
/// is an empty field.
fn fields(line: &str) -> Vec<&str> {
    let mut fields = Vec::new();
    for part in line.split([',', ';']) {
        match part.trim() {
            "" => fields.push(""),
            part => fields.extend(part.split_whitespace()),
        }
    }
    fields
}

/// Whether neither the first nor the last field begins like a number.
fn are_titles(fields: &[&str]) -> bool {
    let is_number = |field: &&str| {
        field.parse::<f64>().is_ok()
            || field.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
    };
    let ends = [fields.first(), fields.last()];
    !ends.into_iter().flatten().any(is_number)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;

    #[test]
    fn rows_are_read_whatever_stands_between_their_numbers() {
        let wanted = [(1, [0.0, 0.0]), (2, [0.5, 0.25]), (3, [1.0, -1e-3])];
        for text in [
            "0,0\n0.5,0.25\n1,-1e-3\n",
            "0;0\r\n0.5;0.25\r\n1;-1e-3\r\n",
            "0\t0\n0.5\t0.25\n1\t-1e-3",
            "0 0\n  0.5   0.25\n1 -1e-3\n",
            "0, 0\n0.5 ;\t0.25\n+1.0 , -.001\n",
        ] {
            assert_eq!(rows(text).unwrap(), wanted, "{text:?}");
        }
        // Titles, comments and empty lines; line numbers are those of the file.
        for titles in [
            "time,displacement",
            "time [s]; way of 1 [m]",
            "t\tx",
            "\"s\" \"m\"",
            "t",
        ] {
            let text = format!("# a paddle\n\n{titles}\n0;0\n\n# half\n1;0.5 # there\n");
            assert_eq!(
                rows(&text).unwrap(),
                [(4, [0.0, 0.0]), (7, [1.0, 0.5])],
                "{titles}"
            );
        }
        // Controls: decimal commas, too many or too few columns, titles further down.
        for (text, line) in [
            ("0,0;0,0\n0,5;0,25\n", 1),
            ("t;x\n0;0\n0,5;0,25\n", 3),
            ("t;x\n0 0,25\n", 2),
            ("0,0\n0.5,,0.25\n", 2),
            ("0,0\n0.5,0.25,\n", 2),
            ("0,0\n0.5\n", 2),
            ("0,0\nt,x\n1,1\n", 2),
            ("1s,2m\n1,1\n", 1),
            ("t,x\nt,x\n", 2),
        ] {
            let error = rows(text).unwrap_err();
            let words = format!("line {line}: ");
            assert!(
                error.starts_with(&words) && error.contains("decimal points"),
                "{text:?}: {error}"
            );
        }
    }

    /// Displacements of a wall must not go both ways, and the message says how to change the
    /// table; angles may.
    #[test]
    fn a_table_that_goes_both_ways_is_told_from_one_out_of_range() {
        let called = |index: usize| format!("line {}", index + 2);
        let both = [[0.0, 0.0], [1.0, 0.5], [2.0, -0.5], [3.0, 0.0]];
        let error = check_points(&both, &called, WAYS).unwrap_err();
        for words in [
            "line 4, [2, -0.5], lies outward",
            "from 0 on, inward",
            "add 0.5 m to each",
        ] {
            assert!(error.contains(words), "{words}: {error}");
        }
        assert_eq!(check_points(&both, &called, ANGLES), Ok(()));
        let far = check_points(&[[0.0, 0.0], [1.0, 2e9]], &called, WAYS).unwrap_err();
        assert!(far.contains("line 3, [1, 2e9], is out of range"), "{far}");
        let twice = check_points(&[[0.0, 0.0], [0.0, 0.1]], &called, WAYS).unwrap_err();
        assert!(twice.contains("the time of line 3, 0 s"), "{twice}");
    }
}
