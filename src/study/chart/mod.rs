//! Curves as SVG: series over one pair of axes, both linear or both logarithmic.

mod axis;
mod labels;

use axis::{Axis, number};
use labels::{FreeSpace, LETTER, note_lines};

use super::page::escaped;

/// A point of a series.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dot {
    /// x.
    pub at: f64,
    /// y. `None` leaves a gap; logarithmic axes also skip values that are not positive.
    pub value: Option<f64>,
    /// Text beside the point, if there is space.
    pub label: String,
    /// Least and greatest x, drawn as a bar if they differ.
    pub bar: Option<[f64; 2]>,
    /// Whether the point gets a ring and its label is placed before all others.
    pub is_knee: bool,
}

/// A line of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points in the order in which they are joined.
    pub points: Vec<Dot>,
}

/// A dashed line across a chart, with its text.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// Vertical, at this x.
    At(f64, String),
    /// Horizontal, at this y; omitted if the curves are far from it. The text may be empty.
    Level(f64, String),
}

/// Curves over one pair of axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// Title above the chart.
    pub title: String,
    /// Line below the title; may be empty.
    pub subtitle: String,
    /// Label of the x axis, with its unit.
    pub x_label: String,
    /// Label of the y axis, with its unit.
    pub y_label: String,
    /// Whether both axes are logarithmic. Points are then drawn as labelled dots.
    pub is_log: bool,
    /// Curves, in the order of the colours.
    pub series: Vec<Series>,
    /// Reference data drawn as rings, in the colours after those of the series; only on linear
    /// axes.
    pub dots: Vec<Series>,
    /// Dashed lines across the chart.
    pub marks: Vec<Mark>,
    /// What cannot be drawn on the axes, one line each below the chart.
    pub notes: Vec<String>,
    /// Name of a point with a ring; "knee" if empty.
    pub ring: &'static str,
}

/// Colour-blind safe palette of Okabe and Ito (2008).
const COLOURS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000",
];
const GREY: &str = "#666";

/// Margins for numbers and axis labels: left, right, bottom.
const MARGIN: [f64; 3] = [70.0, 24.0, 50.0];
/// Height of a row of the title, the legend or the notes.
const ROW: f64 = 16.0;
/// Half the height of the end caps of a bar.
const CAP: f64 = 4.5;
/// Radius of the ring around a knee.
const RING: f64 = 7.5;
/// Radius of the ring that marks a data point.
const DATA: f64 = 4.5;

impl Series {
    /// A plain curve through (x, y) points.
    pub fn curve(name: &str, points: impl IntoIterator<Item = (f64, Option<f64>)>) -> Self {
        let dot = |(at, value)| Dot {
            at,
            value,
            ..Dot::default()
        };
        Self {
            name: name.to_owned(),
            points: points.into_iter().map(dot).collect(),
        }
    }
}

/// A drawing under construction.
struct Svg(String);

impl Svg {
    fn path(&mut self, d: &str, stroke: &str, more: &str) {
        self.0 += &format!("<path d=\"{d}\" fill=\"none\" stroke=\"{stroke}\"{more}/>\n");
    }

    fn circle(&mut self, [x, y]: [f64; 2], radius: f64, more: &str) {
        self.0 += &format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" {more}/>\n");
    }

    fn text(&mut self, [x, y]: [f64; 2], more: &str, text: &str) {
        let text = escaped(text);
        self.0 += &format!("<text x=\"{x:.1}\" y=\"{y:.1}\" {more}>{text}</text>\n");
    }
}

impl Chart {
    fn ring_name(&self) -> &'static str {
        match self.ring {
            "" => "knee",
            name => name,
        }
    }

    fn size(&self) -> [f64; 2] {
        match self.is_log {
            true => [680.0, 440.0],
            false => [560.0, 300.0],
        }
    }

    /// A point's y if the axes can show it.
    fn value(&self, dot: &Dot) -> Option<f64> {
        let has_place = |value: &f64| !self.is_log || (*value > 0.0 && dot.at > 0.0);
        dot.value.filter(has_place)
    }

    /// Everything that has a name and a colour.
    fn named(&self) -> impl Iterator<Item = &Series> {
        self.series.iter().chain(&self.dots)
    }

    /// The points that the axes can show, with the index of their series and their y.
    fn dots(&self) -> impl Iterator<Item = (usize, &Dot, f64)> {
        let series = self.named().enumerate();
        let all = series.flat_map(|(k, series)| series.points.iter().map(move |dot| (k, dot)));
        all.filter_map(|(k, dot)| Some((k, dot, self.value(dot)?)))
    }

    /// Position of each series in the legend: left end and base line.
    fn legend(&self) -> Vec<[f64; 2]> {
        let rows = 1.0 + f64::from(u8::from(!self.subtitle.is_empty()));
        let mut at = [MARGIN[0], 4.0 + ROW * (rows + 1.0)];
        let place = |series: &Series| {
            let width = 24.0 + LETTER[0] * series.name.chars().count() as f64;
            if at[0] + width > self.size()[0] && at[0] > MARGIN[0] {
                at = [MARGIN[0], at[1] + ROW];
            }
            let place = at;
            at[0] += width;
            place
        };
        self.named().map(place).collect()
    }

    fn x_axis(&self) -> Axis {
        let ([width, _], [left, right, _]) = (self.size(), MARGIN);
        let bars = |dot: &Dot| dot.bar.unwrap_or([dot.at; 2]);
        // A linear axis spans the whole series including its gaps.
        let gaps = self.named().flat_map(|series| &series.points);
        let gaps = gaps.filter(|_| !self.is_log).map(|dot| dot.at);
        let costs = self.dots().flat_map(|(_, dot, _)| bars(dot));
        let costs = costs.chain(self.dots().map(|(_, dot, _)| dot.at));
        Axis::new(self.is_log, false, costs.chain(gaps), [left, width - right])
    }

    /// First and last value of the linear x axis, and their positions as fractions of the drawing's
    /// width.
    pub fn across(&self) -> [[f64; 2]; 2] {
        let axis = self.x_axis();
        [axis.ends(), axis.paper.map(|at| at / self.size()[0])]
    }

    /// Renders the chart as a complete SVG document, which can also be embedded in HTML.
    pub fn to_svg(&self) -> String {
        let ([width, height], bottom) = (self.size(), MARGIN[2]);
        let legend = self.legend();
        let top = ROW + legend.last().map_or(2.0 * ROW, |place| place[1]);
        let x = self.x_axis();
        let values: Vec<f64> = self.dots().map(|(_, _, value)| value).collect();
        let most = values.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        // A level far beyond the curves would flatten them.
        let is_near = |level: &f64| !self.is_log && level.abs() <= 4.0 * most;
        let levels = self.marks.iter().filter_map(|mark| match mark {
            Mark::Level(level, _) => Some(*level).filter(is_near),
            Mark::At(..) => None,
        });
        let values = values.iter().copied().chain(levels);
        let y = Axis::new(self.is_log, true, values, [height - bottom, top]);
        let notes = note_lines(&self.notes);
        let tall = height + ROW * notes.len() as f64;
        let mut svg = Svg(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {tall}\" role=\"img\" \
             font-family=\"sans-serif\" font-size=\"11\">\n<title>{}</title>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            escaped(&self.title)
        ));
        self.write_frame(&mut svg, &legend, &x, &y);
        self.write_marks(&mut svg, &x, &y);
        for (index, series) in self.series.iter().enumerate() {
            self.write_series(&mut svg, COLOURS[index % COLOURS.len()], series, &x, &y);
        }
        for (index, series) in self.dots.iter().enumerate() {
            let colour = COLOURS[(self.series.len() + index) % COLOURS.len()];
            for dot in &series.points {
                if let Some(value) = self.value(dot) {
                    let ring = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.7\"");
                    svg.circle([x.at(dot.at), y.at(value)], DATA, &ring);
                }
            }
        }
        self.write_labels(&mut svg, &x, &y);
        for (index, text) in notes.iter().enumerate() {
            let base = height + ROW * index as f64;
            svg.text([12.0, base], "fill=\"#666\"", text);
        }
        svg.0 + "</svg>\n"
    }

    /// Draws title, legend, grid, tick labels and axis labels.
    fn write_frame(&self, svg: &mut Svg, legend: &[[f64; 2]], x: &Axis, y: &Axis) {
        let ([left, right], [bottom, top]) = (x.paper, y.paper);
        svg.text([12.0, 18.0], "font-size=\"13\"", &self.title);
        if !self.subtitle.is_empty() {
            svg.text([12.0, 18.0 + ROW], "fill=\"#666\"", &self.subtitle);
        }
        for (index, (series, [at, base])) in self.named().zip(legend).enumerate() {
            let fill = format!("fill=\"{}\"", COLOURS[index % COLOURS.len()]);
            svg.circle([*at, base - 4.0], 4.0, &fill);
            svg.text([at + 8.0, *base], &fill, &series.name);
        }
        let upright = |at: f64| format!("M{at:.1} {bottom}V{top}");
        let level = |at: f64| format!("M{left} {at:.1}H{right}");
        for (numbers, stroke) in [(false, "#f0f0f0"), (true, "#ccc")] {
            let of = |axis: &Axis| match numbers {
                true => axis.ticks().0,
                false => axis.ticks().1,
            };
            for at in of(x).iter().map(|value| x.at(*value)) {
                svg.path(&upright(at), stroke, "");
            }
            for at in of(y).iter().map(|value| y.at(*value)) {
                svg.path(&level(at), stroke, "");
            }
        }
        for value in x.ticks().0 {
            let place = [x.at(value), bottom + 14.0];
            svg.text(place, "text-anchor=\"middle\"", &number(value));
        }
        for value in y.ticks().0 {
            let place = [left - 6.0, y.at(value) + 4.0];
            svg.text(place, "text-anchor=\"end\"", &number(value));
        }
        svg.path(&format!("M{left} {top}V{bottom}H{right}"), "#333", "");
        let (middle, half) = ((left + right) / 2.0, (top + bottom) / 2.0);
        let centred = "text-anchor=\"middle\"";
        svg.text([middle, bottom + 32.0], centred, &self.x_label);
        let turned = format!("transform=\"translate(16 {half}) rotate(-90)\" {centred}");
        svg.text([0.0, 0.0], &turned, &self.y_label);
    }

    fn write_marks(&self, svg: &mut Svg, x: &Axis, y: &Axis) {
        let ([left, right], [bottom, top]) = (x.paper, y.paper);
        for mark in &self.marks {
            let (d, place, is_end, text) = match mark {
                Mark::At(value, text) => {
                    let (at, is_end) = (x.at(*value), x.part(*value) > 0.5);
                    // On the side with more space.
                    let beside = if is_end { at - 4.0 } else { at + 4.0 };
                    let d = format!("M{at:.1} {top}V{bottom}");
                    (d, [beside, top + 12.0], is_end, text)
                }
                Mark::Level(value, _) if !(0.0..=1.0).contains(&y.part(*value)) => continue,
                Mark::Level(value, text) => {
                    let at = y.at(*value);
                    let d = format!("M{left} {at:.1}H{right}");
                    (d, [right - 4.0, at - 4.0], true, text)
                }
            };
            svg.path(&d, GREY, " stroke-dasharray=\"4 3\"");
            let anchor = if is_end { "end" } else { "start" };
            let more = format!("fill=\"{GREY}\" text-anchor=\"{anchor}\"");
            svg.text(place, &more, text);
        }
    }

    fn write_series(&self, svg: &mut Svg, colour: &str, series: &Series, x: &Axis, y: &Axis) {
        let (mut path, mut pen) = (String::new(), 'M');
        for dot in &series.points {
            match self.value(dot) {
                Some(value) => {
                    path += &format!("{pen}{:.1} {:.1}", x.at(dot.at), y.at(value));
                    // A zero-length segment shows an isolated point as a dot.
                    path += if pen == 'M' { "h0" } else { "" };
                    pen = 'L';
                }
                None if self.is_log => {}
                None => pen = 'M',
            }
        }
        svg.path(
            &path,
            colour,
            " stroke-width=\"1.7\" stroke-linecap=\"round\"",
        );
        for dot in series.points.iter().filter(|_| self.is_log) {
            let Some(value) = self.value(dot) else {
                continue;
            };
            let at = [x.at(dot.at), y.at(value)];
            if let Some([least, most]) = dot.bar.filter(|[least, most]| least < most) {
                let ([least, most], [low, high]) =
                    ([x.at(least), x.at(most)], [at[1] - CAP, at[1] + CAP]);
                let d = format!(
                    "M{least:.1} {low:.1}V{high:.1}M{least:.1} \
                     {:.1}H{most:.1}M{most:.1} {low:.1}V{high:.1}",
                    at[1]
                );
                svg.path(&d, colour, " stroke-width=\"1.2\"");
            }
            svg.circle(at, 3.0, &format!("fill=\"{colour}\""));
            if dot.is_knee {
                let ring = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"");
                svg.circle(at, RING, &ring);
            }
        }
    }

    fn write_labels(&self, svg: &mut Svg, x: &Axis, y: &Axis) {
        let area = |(_, dot, value): (usize, &Dot, f64)| {
            let ([px, py], r) = ([x.at(dot.at), y.at(value)], 4.0);
            [px - r, py - r, px + r, py + r]
        };
        let mut room = FreeSpace {
            within: [x.paper[0], y.paper[1], x.paper[1], y.paper[0]],
            taken: self.dots().map(area).collect(),
        };
        let mut labelled: Vec<_> = self.dots().filter(|d| !d.1.label.is_empty()).collect();
        labelled.sort_by_key(|(_, dot, _)| !dot.is_knee);
        for (index, dot, value) in labelled {
            let at = [x.at(dot.at), y.at(value)];
            let (text, least) = match dot.is_knee {
                true => (format!("{}: {}", self.ring_name(), dot.label), RING + 5.0),
                false => (dot.label.clone(), 7.0),
            };
            // A label that does not fit is left to the table.
            if let Some(place) = room.place(at, least, text.chars().count()) {
                let fill = COLOURS[index % COLOURS.len()];
                let more = format!("font-size=\"10\" fill=\"{fill}\"");
                svg.text(place, &more, &text);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<(f64, Option<f64>)>) -> Chart {
        Chart {
            title: "height & <more>".into(),
            x_label: "time, s".into(),
            y_label: "m".into(),
            series: vec![Series::curve("pbf", points)],
            marks: vec![
                Mark::At(1.0, "impact".into()),
                Mark::Level(0.9, "mark".into()),
                Mark::Level(1e3, "far".into()),
            ],
            ..Chart::default()
        }
    }

    /// One setting per decade of time, each with a bar.
    fn log_chart(errors: [f64; 3]) -> Chart {
        let dot = |k: usize| {
            let decade = 10f64.powi(k as i32);
            Dot {
                at: decade,
                value: Some(errors[k]),
                label: format!("n={k}"),
                bar: Some([0.9 * decade, 1.2 * decade]),
                is_knee: k == 2,
            }
        };
        Chart {
            title: "a <b>".into(),
            subtitle: "on c".into(),
            is_log: true,
            series: vec![Series {
                name: "jacobi".into(),
                points: (0..3).map(dot).collect(),
            }],
            notes: vec!["failed: 32".into()],
            ..Chart::default()
        }
    }

    #[test]
    fn a_line_runs_through_its_points_and_breaks_at_gaps() {
        let points = [
            (0.0, Some(0.0)),
            (1.0, Some(1.0)),
            (2.0, None),
            (3.0, Some(0.5)),
        ];
        let svg = chart(points.to_vec()).to_svg();
        // x runs from 70 to 536; y from 250 (0) up to 52 (1.06).
        assert!(
            svg.contains("d=\"M70.0 250.0h0L225.3 63.2M536.0 156.6h0\""),
            "{svg}"
        );
        assert!(svg.contains("height &amp; &lt;more&gt;") && svg.contains("impact"));
        assert!(svg.contains(">mark<") && !svg.contains(">far<"), "{svg}");
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn a_cursor_finds_the_axis() {
        let [values, places] =
            chart(vec![(2.0, Some(1.0)), (3.0, None), (6.0, Some(4.0))]).across();
        assert_eq!(values, [2.0, 6.0]);
        assert_eq!(places, [70.0 / 560.0, 536.0 / 560.0]);
    }

    #[test]
    fn no_points_and_equal_points_still_make_a_chart() {
        for points in [vec![], vec![(1.0, None)], vec![(1.0, Some(2.0)); 3]] {
            for is_log in [false, true] {
                let svg = Chart {
                    is_log,
                    ..chart(points.clone())
                };
                let svg = svg.to_svg();
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            }
        }
    }

    #[test]
    fn equal_ratios_are_equal_distances() {
        let svg = log_chart([1e-1, 1e-2, 1e-3]).to_svg();
        let line = svg.lines().find(|line| line.contains("h0L"));
        let path = line
            .and_then(|line| line.split('"').nth(1))
            .expect("a line");
        let places: Vec<Vec<f64>> = path
            .replace("h0", "")
            .trim_start_matches('M')
            .split('L')
            .map(|p| p.split(' ').map(|v| v.parse().expect("a number")).collect())
            .collect();
        let step = |k: usize, axis: usize| places[k + 1][axis] - places[k][axis];
        let [x, y] = [0, 1].map(|axis| step(1, axis) - step(0, axis));
        // The SVG rounds to tenths.
        assert!(x.abs() <= 0.21 && y.abs() <= 0.21, "{path}");
        assert!(svg.contains(">n=1<") && svg.contains("failed: 32") && svg.contains("a &lt;b&gt;"));
        assert!(svg.contains(">0.01<") && svg.contains(">on c<"), "{svg}");
    }

    #[test]
    fn an_error_or_a_cost_of_nothing_has_no_place_on_a_logarithmic_axis() {
        let mut free = log_chart([1e-1, 1e-2, 1e-3]);
        free.series[0].points[1].at = 0.0;
        for chart in [log_chart([1e-1, 0.0, 1e-3]), free] {
            let svg = chart.to_svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf") && !svg.contains("n=1"));
        }
    }

    /// One ring, around the dot that is the knee, with a label that says so.
    #[test]
    fn the_knee_is_marked() {
        let mut chart = log_chart([1e-1, 1e-2, 1e-3]);
        let rings = |chart: &Chart| chart.to_svg().matches("r=\"7.5\"").count();
        assert_eq!(rings(&chart), 1);
        assert!(chart.to_svg().contains(">knee: n=2<"));
        chart.ring = "chosen";
        assert!(chart.to_svg().contains(">chosen: n=2<") && !chart.to_svg().contains("knee"));
        chart.series[0].points[2].is_knee = false;
        assert_eq!(rings(&chart), 0);
        assert!(!chart.to_svg().contains("knee"));
    }

    #[test]
    fn a_long_legend_takes_more_rows() {
        let name = |k: usize| Series::curve(&format!("a method of many letters, no. {k}"), []);
        let long = Chart {
            series: (0..6).map(name).collect(),
            ..log_chart([1.0; 3])
        };
        let rows: Vec<f64> = long.legend().iter().map(|place| place[1]).collect();
        // 24 + 31 letters of 5.8: two entries of 204 fit side by side into 610.
        assert_eq!(rows, [52.0, 52.0, 68.0, 68.0, 84.0, 84.0]);
        let ends = long
            .legend()
            .into_iter()
            .map(|[at, _]| at + 24.0 + LETTER[0] * 31.0);
        assert!(ends.into_iter().all(|end| end <= 680.0));
    }

    /// Each point's range of times is a bar; equal times draw none.
    #[test]
    fn repeats_have_bars() {
        let bars = |chart: &Chart| chart.to_svg().matches("stroke-width=\"1.2\"").count();
        let mut chart = log_chart([1e-1, 1e-2, 1e-3]);
        assert_eq!(bars(&chart), 3);
        for dot in &mut chart.series[0].points {
            dot.bar = Some([dot.at; 2]);
        }
        assert_eq!(bars(&chart), 0);
    }
}
