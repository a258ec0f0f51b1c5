//! Text on a chart: labels that avoid points and each other, and wrapped notes.

/// Approximate width and height of a label's letter.
pub(super) const LETTER: [f64; 2] = [5.8, 10.0];
/// Letters per line of a note, and most lines that notes may take.
const NOTE_LETTERS: usize = 105;
const NOTE_LINES: usize = 8;

/// A rectangle on the paper: left, top, right, bottom.
pub(super) type Area = [f64; 4];

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// The part of a chart that labels may still use.
pub(super) struct FreeSpace {
    pub(super) within: Area,
    pub(super) taken: Vec<Area>,
}

impl FreeSpace {
    /// Finds and reserves a position beside a point, at least `least` away, that overlaps neither
    /// points nor earlier labels. Returns the left end and base line of the text.
    pub(super) fn place(&mut self, at: [f64; 2], least: f64, letters: usize) -> Option<[f64; 2]> {
        let (width, height) = (LETTER[0] * letters as f64, LETTER[1]);
        let candidates = [0.0, 8.0, 18.0].into_iter().flat_map(|more| {
            let r = least + more;
            [
                [r, -0.6 * r],
                [-r - width, 0.6 * r + height],
                [r, 0.6 * r + height],
                [-r - width, -0.6 * r],
                [-0.5 * width, -r],
                [-0.5 * width, r + height],
            ]
        });
        for [dx, dy] in candidates {
            let [x, base] = [at[0] + dx, at[1] + dy];
            let area = [x, base - height, x + width, base + 1.0];
            let is_within = area[0] >= self.within[0]
                && area[1] >= self.within[1]
                && area[2] <= self.within[2]
                && area[3] <= self.within[3];
            if is_within && !self.taken.iter().any(|other| overlap(other, &area)) {
                self.taken.push(area);
                return Some([x, base]);
            }
        }
        None
    }
}

/// Breaks text into lines of at most `letters` letters, between words if possible.
fn wrapped(text: &str, letters: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let pieces: Vec<char> = word.chars().collect();
        for piece in pieces.chunks(letters) {
            let last = lines.len() - 1;
            let used = lines[last].chars().count();
            let gap = usize::from(used > 0);
            if used + gap + piece.len() > letters {
                lines.push(piece.iter().collect());
            } else {
                lines[last].push_str(&" "[..gap]);
                lines[last].extend(piece);
            }
        }
    }
    lines
}

/// The wrapped notes; those that do not fit are only counted.
pub(super) fn note_lines(notes: &[String]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for (index, note) in notes.iter().enumerate() {
        let more = wrapped(note, NOTE_LETTERS);
        if lines.len() + more.len() > NOTE_LINES {
            let left = notes.len() - index;
            lines.push(format!("and {left} more, in the table (results.csv)"));
            break;
        }
        lines.extend(more);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_whole_or_counted() {
        assert_eq!(wrapped("ab cd efghijk", 5), ["ab cd", "efghi", "jk"]);
        let long = "failed: ".to_owned() + &"word ".repeat(60);
        let lines = note_lines(&[long.clone(), "short".into()]);
        let is_short = |line: &String| line.chars().count() <= NOTE_LETTERS;
        assert!(lines.iter().all(is_short));
        let words: usize = lines.iter().map(|line| line.matches("word").count()).sum();
        let last = lines.last().map(String::as_str);
        assert_eq!((words, last), (60, Some("short")));
        let lines = note_lines(&vec![long; 4]);
        assert_eq!(lines.len(), 7);
        assert_eq!(lines[6], "and 2 more, in the table (results.csv)");
    }

    #[test]
    fn labels_do_not_overlap() {
        let mut room = FreeSpace {
            within: [0.0, 0.0, 200.0, 200.0],
            taken: vec![[96.0, 96.0, 104.0, 104.0]],
        };
        let placed = (0..40)
            .filter(|_| room.place([100.0, 100.0], 7.0, 3).is_some())
            .count();
        assert!((6..40).contains(&placed), "{placed}");
        for (k, a) in room.taken.iter().enumerate() {
            assert!(!room.taken[..k].iter().any(|b| overlap(a, b)));
        }
    }
}
