//! Error against cost, both logarithmic: one line a method, its points labelled with their settings.

use std::fmt::Write as _;

use super::{
    chart::{COLOURS, number},
    page::escaped,
};

/// A method's points, in the order of its settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Line {
    /// Of the method.
    pub name: String,
    /// What was measured.
    pub points: Vec<Point>,
}

/// A setting: what it costs and how far off it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The setting.
    pub label: String,
    /// Least, median and greatest of the repeats, in any one unit.
    pub time: [f64; 3],
    /// The cost that no machine changes, in any one unit.
    pub work: f64,
    /// 0 or more.
    pub error: f64,
}

/// What stands along x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Median times, with a bar from the least to the greatest.
    Time,
    /// The work.
    Work,
}

/// A chart of an error against a cost.
#[derive(Clone, Debug, PartialEq)]
pub struct LogChart {
    /// Above it: what is studied.
    pub title: String,
    /// Below that: on what.
    pub subtitle: String,
    /// Below the x axis, with its unit.
    pub x_label: String,
    /// Beside the y axis, with its unit.
    pub y_label: String,
    /// Which cost.
    pub cost: Cost,
    /// In the order of the colours.
    pub lines: Vec<Line>,
    /// What has no place on logarithmic axes, each in a line below: runs that failed, errors of 0.
    pub notes: Vec<String>,
}

const SIZE: [f64; 2] = [680.0, 440.0];
/// Room for labels: left, top, right, bottom.
const MARGIN: [f64; 4] = [70.0, 70.0, 24.0, 50.0];
/// Height of a further row of the legend.
const ROW: f64 = 16.0;
/// Height of a note's line.
const NOTE: f64 = 14.0;
/// Letters of a note that fit in a line, and lines that notes take at most.
const NOTE_LETTERS: usize = 105;
const NOTE_LINES: usize = 8;
/// Half the height of a bar's ends.
const CAP: f64 = 4.5;
/// Width of a letter of a label, about, and height of one.
const LETTER: [f64; 2] = [5.8, 10.0];

/// A logarithmic axis: two powers of ten's exponents and where they lie on the paper.
struct Axis {
    exponents: [f64; 2],
    paper: [f64; 2],
}

impl Axis {
    /// About all values, with a little room beyond them; at least half a decade.
    fn about(values: impl Iterator<Item = f64>, paper: [f64; 2]) -> Self {
        let (low, high) = values
            .filter(|value| *value > 0.0 && value.is_finite())
            .map(f64::log10)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(v), b.max(v))
            });
        if low > high {
            return Self {
                exponents: [0.0, 1.0],
                paper,
            };
        }
        let room = 0.07 * (high - low) + (0.25 - 0.5 * (high - low)).max(0.0);
        Self {
            exponents: [low - room, high + room],
            paper,
        }
    }

    fn at(&self, value: f64) -> f64 {
        let [low, high] = self.exponents;
        let part = (value.log10() - low) / (high - low);
        self.paper[0] + part * (self.paper[1] - self.paper[0])
    }

    /// Values that get a number, and values that get a line alone.
    fn ticks(&self) -> (Vec<f64>, Vec<f64>) {
        let [low, high] = self.exponents;
        let digits: &[u32] = match high - low {
            span if span < 1.2 => &[1, 2, 3, 5, 7],
            span if span < 2.5 => &[1, 2, 5],
            _ => &[1],
        };
        let stride = (((high - low) / 8.0).ceil() as i32).max(1);
        let (mut numbered, mut plain) = (Vec::new(), Vec::new());
        for decade in low.floor() as i32..=high.ceil() as i32 {
            for digit in 1..10 {
                let value = f64::from(digit) * 10f64.powi(decade);
                if !(low..=high).contains(&value.log10()) {
                    continue;
                }
                if digits.contains(&digit) && decade % stride == 0 {
                    numbered.push(value);
                } else if stride == 1 || digit == 1 {
                    plain.push(value);
                }
            }
        }
        (numbered, plain)
    }
}

/// A rectangle on the paper: left, top, right, bottom.
type Area = [f64; 4];

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Where labels may still go.
struct Room {
    within: Area,
    taken: Vec<Area>,
}

impl Room {
    /// The place next to a point that no point and no earlier label takes: its left end and base line.
    fn place(&mut self, at: [f64; 2], letters: usize) -> Option<[f64; 2]> {
        let (width, height) = (LETTER[0] * letters as f64, LETTER[1]);
        let candidates = [7.0, 15.0, 25.0].into_iter().flat_map(|r: f64| {
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

/// Lines of at most `letters` letters, broken between words; a word that is longer is broken too.
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

impl LogChart {
    fn x(&self, point: &Point) -> f64 {
        match self.cost {
            Cost::Time => point.time[1],
            Cost::Work => point.work,
        }
    }

    fn drawn<'a>(&self, line: &'a Line) -> impl Iterator<Item = &'a Point> + use<'a> {
        line.points.iter().filter(|point| point.error > 0.0)
    }

    /// Where each line stands in the legend: left end and row.
    fn legend(&self) -> Vec<(f64, usize)> {
        let (mut at, mut row) = (MARGIN[0], 0);
        let place = |line: &Line| {
            let width = 24.0 + LETTER[0] * line.name.chars().count() as f64;
            if at + width > SIZE[0] && at > MARGIN[0] {
                (at, row) = (MARGIN[0], row + 1);
            }
            let place = (at, row);
            at += width;
            place
        };
        self.lines.iter().map(place).collect()
    }

    /// A picture of its own, also within HTML.
    pub fn to_svg(&self) -> String {
        let [left, top, right, bottom] = MARGIN;
        let rows = self.legend().last().map_or(0, |(_, row)| *row);
        let top = top + ROW * rows as f64;
        let points = || self.lines.iter().flat_map(|line| self.drawn(line));
        let costs = points().flat_map(|point| match self.cost {
            Cost::Time => point.time,
            Cost::Work => [point.work; 3],
        });
        let x = Axis::about(costs, [left, SIZE[0] - right]);
        let y = Axis::about(points().map(|p| p.error), [SIZE[1] - bottom, top]);
        let height = SIZE[1] + NOTE * self.note_lines().len() as f64;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {height}\" role=\"img\" \
             font-family=\"sans-serif\" font-size=\"11\">\n<title>{}</title>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            SIZE[0],
            escaped(&self.title)
        );
        // Writing to a String cannot fail.
        let _ = self.write(&mut out, &x, &y);
        out + "</svg>\n"
    }

    fn write(&self, out: &mut String, x: &Axis, y: &Axis) -> std::fmt::Result {
        write_frame(out, self, x, y)?;
        for (index, line) in self.lines.iter().enumerate() {
            self.write_line(out, COLOURS[index % COLOURS.len()], line, x, y)?;
        }
        self.write_labels(out, x, y)?;
        for (index, text) in self.note_lines().iter().enumerate() {
            let base = SIZE[1] + NOTE * index as f64;
            writeln!(
                out,
                "<text x=\"12\" y=\"{base}\" fill=\"#666\">{}</text>",
                escaped(text)
            )?;
        }
        Ok(())
    }

    /// The notes, wrapped; those that do not fit are counted.
    fn note_lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for (index, note) in self.notes.iter().enumerate() {
            let more = wrapped(note, NOTE_LETTERS);
            if lines.len() + more.len() > NOTE_LINES {
                let left = self.notes.len() - index;
                lines.push(format!("and {left} more, in the table (results.csv)"));
                break;
            }
            lines.extend(more);
        }
        lines
    }

    fn write_line(
        &self,
        out: &mut String,
        colour: &str,
        line: &Line,
        x: &Axis,
        y: &Axis,
    ) -> std::fmt::Result {
        let places: Vec<_> = self
            .drawn(line)
            .map(|point| (x.at(self.x(point)), y.at(point.error), point))
            .collect();
        let path: Vec<String> = places
            .iter()
            .map(|(x, y, _)| format!("{x:.1} {y:.1}"))
            .collect();
        if !path.is_empty() {
            writeln!(
                out,
                "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"/>",
                path.join("L")
            )?;
        }
        for (px, py, point) in places {
            if self.cost == Cost::Time {
                let [least, most] = [point.time[0], point.time[2]].map(|t| x.at(t));
                if point.time[0] < point.time[2] {
                    let [low, high] = [py - CAP, py + CAP];
                    writeln!(
                        out,
                        "<path d=\"M{least:.1} {low:.1}V{high:.1}M{least:.1} {py:.1}H{most:.1}M{most:.1} {low:.1}V{high:.1}\" \
                         fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.2\"/>"
                    )?;
                }
            }
            writeln!(
                out,
                "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"3\" fill=\"{colour}\"/>"
            )?;
        }
        Ok(())
    }

    fn write_labels(&self, out: &mut String, x: &Axis, y: &Axis) -> std::fmt::Result {
        let place = |point: &Point| [x.at(self.x(point)), y.at(point.error)];
        let dots = self.lines.iter().flat_map(|line| self.drawn(line));
        let mut room = Room {
            within: [x.paper[0], y.paper[1], x.paper[1], y.paper[0]],
            taken: dots
                .map(|point| {
                    let [px, py] = place(point);
                    [px - 4.0, py - 4.0, px + 4.0, py + 4.0]
                })
                .collect(),
        };
        for (index, line) in self.lines.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            for point in self.drawn(line) {
                let at = place(point);
                // A label without a free place is left to the table.
                let Some([lx, base]) = room.place(at, point.label.chars().count()) else {
                    continue;
                };
                writeln!(
                    out,
                    "<text x=\"{lx:.1}\" y=\"{base:.1}\" font-size=\"10\" fill=\"{colour}\">{}</text>",
                    escaped(&point.label)
                )?;
            }
        }
        Ok(())
    }
}

/// Title, legend, grid, numbers and axes' names.
fn write_frame(out: &mut String, chart: &LogChart, x: &Axis, y: &Axis) -> std::fmt::Result {
    let ([left, right], [bottom, top]) = (x.paper, y.paper);
    writeln!(
        out,
        "<text x=\"12\" y=\"18\" font-size=\"13\">{}</text>\n<text x=\"12\" y=\"34\" fill=\"#666\">{}</text>",
        escaped(&chart.title),
        escaped(&chart.subtitle)
    )?;
    for (index, (line, (at, row))) in chart.lines.iter().zip(chart.legend()).enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        let base = 54.0 + ROW * row as f64;
        writeln!(
            out,
            "<circle cx=\"{at:.1}\" cy=\"{}\" r=\"4\" fill=\"{colour}\"/>\
             <text x=\"{:.1}\" y=\"{base}\" fill=\"{colour}\">{}</text>",
            base - 4.0,
            at + 8.0,
            escaped(&line.name)
        )?;
    }
    let (numbered, plain) = x.ticks();
    for value in &plain {
        let at = x.at(*value);
        writeln!(
            out,
            "<path d=\"M{at:.1} {bottom}V{top}\" stroke=\"#f0f0f0\"/>"
        )?;
    }
    for value in &numbered {
        let at = x.at(*value);
        writeln!(
            out,
            "<path d=\"M{at:.1} {bottom}V{top}\" stroke=\"#ccc\"/>\
             <text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            bottom + 14.0,
            number(*value)
        )?;
    }
    let (numbered, plain) = y.ticks();
    for value in &plain {
        let at = y.at(*value);
        writeln!(
            out,
            "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#f0f0f0\"/>"
        )?;
    }
    for value in &numbered {
        let at = y.at(*value);
        writeln!(
            out,
            "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#ccc\"/>\
             <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            left - 6.0,
            at + 4.0,
            number(*value)
        )?;
    }
    writeln!(
        out,
        "<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"#333\"/>\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
         <text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        (left + right) / 2.0,
        bottom + 32.0,
        escaped(&chart.x_label),
        (top + bottom) / 2.0,
        escaped(&chart.y_label)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(errors: [f64; 3]) -> LogChart {
        let point = |k: usize| Point {
            label: format!("n={k}"),
            time: [0.9, 1.0, 1.2].map(|t| t * 10f64.powi(k as i32)),
            work: 2.0 * 10f64.powi(k as i32),
            error: errors[k],
        };
        LogChart {
            title: "a <b>".into(),
            subtitle: "on c".into(),
            x_label: "ms".into(),
            y_label: "error".into(),
            cost: Cost::Time,
            lines: vec![Line {
                name: "jacobi".into(),
                points: (0..3).map(point).collect(),
            }],
            notes: vec!["failed: 32".into()],
        }
    }

    #[test]
    fn equal_ratios_are_equal_distances() {
        let svg = chart([1e-1, 1e-2, 1e-3]).to_svg();
        let line = svg
            .lines()
            .find(|line| line.contains("d=\"M") && line.contains('L'));
        let path = line
            .and_then(|line| line.split('"').nth(1))
            .expect("a line");
        let places: Vec<Vec<f64>> = path
            .trim_start_matches('M')
            .split('L')
            .map(|p| p.split(' ').map(|v| v.parse().expect("a number")).collect())
            .collect();
        let step = |k: usize, axis: usize| places[k + 1][axis] - places[k][axis];
        let [x, y] = [0, 1].map(|axis| step(1, axis) - step(0, axis));
        // Written to a tenth.
        assert!(x.abs() <= 0.21 && y.abs() <= 0.21, "{path}");
        assert!(svg.contains("n=1") && svg.contains("failed: 32") && svg.contains("a &lt;b&gt;"));
        assert!(svg.contains(">0.01<") && !svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn an_error_of_nothing_and_no_points_break_nothing() {
        let svg = chart([1e-1, 0.0, 1e-3]).to_svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf") && !svg.contains("n=1"));
        let empty = LogChart {
            lines: Vec::new(),
            ..chart([1.0; 3])
        };
        assert!(!empty.to_svg().contains("NaN"));
    }

    #[test]
    fn a_long_legend_takes_more_rows() {
        let one = chart([1.0; 3]).lines.remove(0);
        let name = |k: usize| Line {
            name: format!("a method of many letters, no. {k}"),
            ..one.clone()
        };
        let long = LogChart {
            lines: (0..6).map(name).collect(),
            ..chart([1.0; 3])
        };
        let rows: Vec<usize> = long.legend().iter().map(|(_, row)| *row).collect();
        // 24 + 31 letters of 5.8: two of 204 beside each other in 610.
        assert_eq!(rows, [0, 0, 1, 1, 2, 2]);
        assert!(
            long.legend()
                .iter()
                .all(|(at, _)| at + 24.0 + LETTER[0] * 31.0 <= SIZE[0])
        );
    }

    #[test]
    fn notes_are_whole_or_counted() {
        assert_eq!(wrapped("ab cd efghijk", 5), ["ab cd", "efghi", "jk"]);
        let long = "failed: ".to_owned() + &"word ".repeat(60);
        let mut noted = chart([1.0; 3]);
        noted.notes = vec![long.clone(), "short".into()];
        let lines = noted.note_lines();
        assert!(
            lines
                .iter()
                .all(|line| line.chars().count() <= NOTE_LETTERS)
        );
        let words: usize = lines.iter().map(|line| line.matches("word").count()).sum();
        assert_eq!(
            (words, lines.last().map(String::as_str)),
            (60, Some("short"))
        );
        noted.notes = vec![long; 4];
        let lines = noted.note_lines();
        assert_eq!(lines.len(), 7);
        assert_eq!(lines[6], "and 2 more, in the table (results.csv)");
    }

    /// A bar of a point's own times, and none where they are one time.
    #[test]
    fn repeats_have_bars() {
        let bars = |chart: &LogChart| chart.to_svg().matches("stroke-width=\"1.2\"").count();
        let mut chart = chart([1e-1, 1e-2, 1e-3]);
        assert_eq!(bars(&chart), 3);
        for point in &mut chart.lines[0].points {
            point.time = [point.time[1]; 3];
        }
        assert_eq!(bars(&chart), 0);
        assert!(chart.to_svg().contains(">on c<"));
    }

    #[test]
    fn labels_do_not_overlap() {
        let mut room = Room {
            within: [0.0, 0.0, 200.0, 200.0],
            taken: vec![[96.0, 96.0, 104.0, 104.0]],
        };
        let placed = (0..40)
            .filter(|_| room.place([100.0, 100.0], 3).is_some())
            .count();
        assert!((6..40).contains(&placed), "{placed}");
        for (k, a) in room.taken.iter().enumerate() {
            assert!(!room.taken[..k].iter().any(|b| overlap(a, b)));
        }
    }
}
