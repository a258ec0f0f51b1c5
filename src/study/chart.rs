//! Curves as SVG.

use std::fmt::Write as _;

use super::page::escaped;

/// A line of a chart; a gap stands where y is `None`.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// What the legend says.
    pub name: String,
    /// x and y.
    pub points: Vec<(f64, Option<f64>)>,
}

/// Curves over one pair of axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Above it.
    pub title: String,
    /// Below the x axis, with its unit.
    pub x_label: String,
    /// Beside the y axis, with its unit.
    pub y_label: String,
    /// In the order of the colours.
    pub series: Vec<Series>,
    /// Upright dashed lines: where, and what they say.
    pub marks: Vec<(f64, String)>,
}

/// Okabe and Ito (2008): told apart by everyone.
pub(super) const COLOURS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000",
];

const SIZE: [f64; 2] = [560.0, 280.0];
/// Room for labels: left, top, right, bottom.
const MARGIN: [f64; 4] = [64.0, 30.0, 14.0, 44.0];
/// Intervals that an axis is cut into, about.
const INTERVALS: f64 = 5.0;

/// Numbers between two ends and where they lie on the paper.
struct Axis {
    values: [f64; 2],
    paper: [f64; 2],
}

impl Axis {
    fn at(&self, value: f64) -> f64 {
        let part = (value - self.values[0]) / (self.values[1] - self.values[0]);
        self.paper[0] + part * (self.paper[1] - self.paper[0])
    }
}

impl Chart {
    /// A picture of its own, also within HTML.
    pub fn to_svg(&self) -> String {
        let xs = || {
            self.series
                .iter()
                .flat_map(|s| s.points.iter().map(|p| p.0))
        };
        let ys = || {
            let points = self.series.iter().flat_map(|s| &s.points);
            points.filter_map(|p| p.1)
        };
        let x = Axis {
            values: ends(xs(), false),
            paper: [MARGIN[0], SIZE[0] - MARGIN[2]],
        };
        let y = Axis {
            values: ends(ys(), true),
            paper: [SIZE[1] - MARGIN[3], MARGIN[1]],
        };
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" \
             font-family=\"sans-serif\" font-size=\"11\">\n<title>{}</title>\n",
            SIZE[0],
            SIZE[1],
            escaped(&self.title)
        );
        // Writing to a String cannot fail.
        let _ = self.write(&mut out, &x, &y);
        out + "</svg>\n"
    }

    fn write(&self, out: &mut String, x: &Axis, y: &Axis) -> std::fmt::Result {
        let [left, right] = x.paper;
        let [bottom, top] = y.paper;
        let middle = (left + right) / 2.0;
        writeln!(
            out,
            "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<text x=\"{left}\" y=\"16\" font-size=\"13\">{}</text>",
            escaped(&self.title)
        )?;
        // Right to left; letters of this size are about seven units wide.
        let mut end = right;
        for (index, series) in self.series.iter().enumerate().rev() {
            let (colour, name) = (COLOURS[index % COLOURS.len()], escaped(&series.name));
            writeln!(
                out,
                "<text x=\"{end}\" y=\"16\" text-anchor=\"end\" fill=\"{colour}\">{name}</text>"
            )?;
            end -= 7.0 * series.name.chars().count() as f64 + 10.0;
        }
        for value in ticks(x.values) {
            let at = x.at(value);
            writeln!(out, "<path d=\"M{at:.1} {bottom}V{top}\" stroke=\"#ddd\"/>")?;
            let below = bottom + 14.0;
            let text = number(value);
            writeln!(
                out,
                "<text x=\"{at:.1}\" y=\"{below}\" text-anchor=\"middle\">{text}</text>"
            )?;
        }
        for value in ticks(y.values) {
            let at = y.at(value);
            writeln!(out, "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#ddd\"/>")?;
            let (beside, base, text) = (left - 6.0, at + 4.0, number(value));
            writeln!(
                out,
                "<text x=\"{beside}\" y=\"{base:.1}\" text-anchor=\"end\">{text}</text>"
            )?;
        }
        writeln!(
            out,
            "<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"#333\"/>"
        )?;
        let (foot, half) = (SIZE[1] - 10.0, (top + bottom) / 2.0);
        writeln!(
            out,
            "<text x=\"{middle}\" y=\"{foot}\" text-anchor=\"middle\">{}</text>",
            escaped(&self.x_label)
        )?;
        writeln!(
            out,
            "<text transform=\"translate(14 {half}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            escaped(&self.y_label)
        )?;
        for (value, text) in &self.marks {
            let (at, base, text) = (x.at(*value), top + 12.0, escaped(text));
            // On the side that has more room.
            let (beside, anchor) = if at < middle {
                (at + 4.0, "start")
            } else {
                (at - 4.0, "end")
            };
            writeln!(
                out,
                "<path d=\"M{at:.1} {top}V{bottom}\" stroke=\"#666\" stroke-dasharray=\"4 3\"/>\
                 <text x=\"{beside:.1}\" y=\"{base}\" fill=\"#666\" text-anchor=\"{anchor}\">{text}</text>"
            )?;
        }
        for (index, series) in self.series.iter().enumerate() {
            self.write_series(out, index, series, x, y)?;
        }
        Ok(())
    }

    fn write_series(
        &self,
        out: &mut String,
        index: usize,
        series: &Series,
        x: &Axis,
        y: &Axis,
    ) -> std::fmt::Result {
        let colour = COLOURS[index % COLOURS.len()];
        let mut path = String::new();
        let mut pen = 'M';
        for (at, value) in &series.points {
            match value {
                Some(value) => {
                    write!(path, "{pen}{:.1} {:.1}", x.at(*at), y.at(*value))?;
                    // A point of its own shows as a dot.
                    path.push_str(if pen == 'M' { "h0" } else { "" });
                    pen = 'L';
                }
                None => pen = 'M',
            }
        }
        writeln!(
            out,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\" \
             stroke-linecap=\"round\"/>"
        )
    }
}

/// Least and greatest, never equal; with `room` beyond them for lines not to touch the frame, and 0
/// among them where that takes little.
fn ends(values: impl Iterator<Item = f64>, room: bool) -> [f64; 2] {
    let (mut low, mut high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
            (a.min(v), b.max(v))
        });
    if low > high {
        return [0.0, 1.0];
    }
    if room {
        if low > 0.0 && low < 0.5 * high {
            low = 0.0;
        }
        let span = high - low;
        high += 0.06 * span;
        low -= if low == 0.0 { 0.0 } else { 0.06 * span };
    }
    if high - low <= 1e-12 * high.abs().max(1e-6) {
        let half = 0.5 * high.abs().max(1.0);
        return [low - half, high + half];
    }
    [low, high]
}

/// Round numbers (1, 2 or 5 times a power of ten) within the ends.
fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let rough = (high - low) / INTERVALS;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|step| *step >= rough * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// As few digits as tell it.
pub(super) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if (1e-3..1e5).contains(&value.abs()) {
        let text = format!("{value:.4}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{value:.0e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<(f64, Option<f64>)>) -> Chart {
        Chart {
            title: "height & <more>".into(),
            x_label: "time, s".into(),
            y_label: "m".into(),
            series: vec![Series {
                name: "pbf".into(),
                points,
            }],
            marks: vec![(1.0, "impact".into())],
        }
    }

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(ticks([0.0, 10.0]), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(ticks([-1.0, 1.3]), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        let fine: Vec<String> = ticks([0.0, 0.004]).into_iter().map(number).collect();
        assert_eq!(fine, ["0", "0.001", "0.002", "0.003", "0.004"]);
        assert_eq!(number(1234567.0), "1e6");
    }

    #[test]
    fn a_line_runs_through_its_points_and_breaks_at_gaps() {
        let svg = chart(vec![
            (0.0, Some(0.0)),
            (1.0, Some(1.0)),
            (2.0, None),
            (3.0, Some(0.5)),
        ])
        .to_svg();
        // x from 64 to 546; y from 236 (0) up to 30 (1.06).
        assert!(
            svg.contains("d=\"M64.0 236.0h0L224.7 41.7M546.0 138.8h0\""),
            "{svg}"
        );
        assert!(svg.contains("height &amp; &lt;more&gt;") && svg.contains("impact"));
        let text: String = svg
            .split('<')
            .map(|t| t.split('>').next().unwrap_or(""))
            .collect();
        assert!(!text.contains("NaN"));
    }

    #[test]
    fn no_points_and_equal_points_still_make_a_chart() {
        for points in [vec![], vec![(1.0, None)], vec![(1.0, Some(2.0)); 3]] {
            let svg = chart(points).to_svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
