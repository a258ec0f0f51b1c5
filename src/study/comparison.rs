//! Compares two solvers on one scene, frame by frame, and evaluates the claims that the paper draws
//! from its Figures 2 (PBF) and 3 (PIC/FLIP).

use super::{
    chart::{Chart, Mark, Series},
    measure::Measures,
    median,
};

/// Relative difference up to which two values count as alike: twice the few per cent by which a
/// crest or a splash changes when its waterline shifts by half a cube.
const ALIKE: f64 = 0.05;

/// Claims of the paper (§3.2) for the same wave and city on a GTX 1650.
pub const CLAIMS: &str = "The paper sees a better defined crest with PBF (its Figure 2a) than \
    with PIC/FLIP (3a), no well-defined splash with PIC/FLIP, which swallows the buildings \
    (3b), and a wave that spreads more with PBF (2b); a frame took it 24.27 ms with PIC/FLIP \
    and 25.22 ms with PBF.";

/// Measurements of one frame of one solver.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameRow {
    /// Number of the output frame.
    pub frame: u32,
    /// Simulated time, seconds.
    pub time: f64,
    /// Wall-clock seconds of its bake; `None` if the cache has lost them.
    pub seconds: Option<f64>,
    /// Number of substeps.
    pub substeps: u32,
    /// Solver iterations, summed over the substeps.
    pub iterations: u64,
    /// Number of projections that missed their tolerance.
    pub missed: u32,
    /// Measurements of the water.
    pub measures: Measures,
}

/// One solver's frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Name of the solver: `pbf`, `flip`.
    pub solver: String,
    /// Rows in frame order; the same frames for every solver.
    pub rows: Vec<FrameRow>,
}

/// The moment when the water reaches the first obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Impact {
    /// First measured frame in which either solver's front has reached the obstacle; `None` if
    /// neither did.
    pub frame: Option<u32>,
}

/// The finding on one question.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The question.
    pub question: &'static str,
    /// The solver that the paper sees ahead; `None` if it makes no claim.
    pub claimed: Option<&'static str>,
    /// The solver that is ahead here; `None` if the two are alike or one has no value.
    pub ahead: Option<String>,
    /// The finding in words, with its figures.
    pub text: String,
}

impl Impact {
    /// Computed from the fronts of all solvers; `obstacle` is the distance of the first obstacle,
    /// metres.
    pub fn of(courses: &[Course], obstacle: f64) -> Self {
        let first = |course: &Course| {
            let is_there = |row: &&FrameRow| row.measures.front >= Some(obstacle);
            course.rows.iter().find(is_there).map(|row| row.frame)
        };
        Self {
            frame: courses.iter().filter_map(first).min(),
        }
    }

    fn is_before(self, row: &FrameRow) -> bool {
        self.frame.is_none_or(|frame| row.frame < frame)
    }

    fn is_after(self, row: &FrameRow) -> bool {
        self.frame.is_none_or(|frame| row.frame >= frame)
    }
}

/// A question and how it is measured.
struct Question {
    asked: &'static str,
    claimed: Option<&'static str>,
    measured: &'static str,
    unit: &'static str,
    digits: usize,
    value: fn(&Course, Impact) -> Option<f64>,
    /// Whether the smaller value is the better one.
    less_is_ahead: bool,
}

const QUESTIONS: [Question; 6] = [
    Question {
        asked: "Whose crest is better defined?",
        claimed: Some("pbf"),
        measured: "Slope of the crest's front face, median over the frames before the impact",
        unit: "°",
        digits: 1,
        value: |course, impact| {
            let rows = course.rows.iter().filter(|row| impact.is_before(row));
            median(rows.filter_map(|row| row.measures.crest_slope).collect())
        },
        less_is_ahead: false,
    },
    Question {
        asked: "Whose crest is higher?",
        claimed: None,
        measured: "Highest crest above the still level before the impact",
        unit: " m",
        digits: 2,
        value: |course, impact| {
            let rows = course.rows.iter().filter(|row| impact.is_before(row));
            rows.map(|row| row.measures.crest_height).reduce(f64::max)
        },
        less_is_ahead: false,
    },
    Question {
        asked: "Whose splash stands out more?",
        claimed: Some("pbf"),
        measured: "Greatest part of the water in the air from the impact on",
        unit: " %",
        digits: 2,
        value: |course, impact| {
            let rows = course.rows.iter().filter(|row| impact.is_after(row));
            let airborne = rows.map(|row| 100.0 * row.measures.airborne);
            airborne.reduce(f64::max)
        },
        less_is_ahead: false,
    },
    Question {
        asked: "Whose splash goes higher?",
        claimed: Some("pbf"),
        measured: "Greatest height above the still level that 99.9 % of the water keeps \
                   below, from the impact on",
        unit: " m",
        digits: 2,
        value: |course, impact| {
            let rows = course.rows.iter().filter(|row| impact.is_after(row));
            rows.map(|row| row.measures.splash_height).reduce(f64::max)
        },
        less_is_ahead: false,
    },
    Question {
        asked: "Whose wave spreads farther?",
        claimed: Some("pbf"),
        measured: "Ground with water above it, median over the frames from the impact on",
        unit: " m²",
        digits: 1,
        value: |course, impact| {
            let rows = course.rows.iter().filter(|row| impact.is_after(row));
            median(rows.map(|row| row.measures.wet_area).collect())
        },
        less_is_ahead: false,
    },
    Question {
        asked: "Which is faster?",
        claimed: Some("flip"),
        measured: "Time per frame, median",
        unit: " s",
        digits: 3,
        value: |course, _| median(course.rows.iter().filter_map(|row| row.seconds).collect()),
        less_is_ahead: true,
    },
];

/// AbsorberStates every question from the measured frames of two solvers.
pub fn findings(courses: &[Course; 2], impact: Impact) -> Vec<Finding> {
    QUESTIONS
        .iter()
        .map(|question| answer(question, courses, impact))
        .collect()
}

fn answer(question: &Question, courses: &[Course; 2], impact: Impact) -> Finding {
    let values = courses.each_ref().map(|c| (question.value)(c, impact));
    let names = courses.each_ref().map(|c| c.solver.as_str());
    let show = |value: Option<f64>| {
        let digits = question.digits;
        value.map_or("none".to_owned(), |v| {
            format!("{v:.digits$}{}", question.unit)
        })
    };
    let ahead = match values {
        [Some(a), Some(b)] => leader([a, b], question.less_is_ahead),
        _ => None,
    };
    let difference = match (values, ahead) {
        ([Some(_), Some(_)], None) => "alike within 5 %".to_owned(),
        ([Some(a), Some(b)], Some(k)) => {
            let (more, less) = (a.max(b), a.min(b));
            let factor = if less > 0.0 && more / less < 10.0 {
                format!(" by {:.0} %", 100.0 * (more / less - 1.0))
            } else {
                " by far".to_owned()
            };
            format!("{} is ahead{factor}", names[k])
        }
        _ => "no comparison".to_owned(),
    };
    let text = format!(
        "{}: {} with {}, {} with {}: {difference}.",
        question.measured,
        show(values[0]),
        names[0],
        show(values[1]),
        names[1]
    );
    let ahead = ahead.map(|k| names[k].to_owned());
    let verdict = match (question.claimed, &ahead) {
        (None, _) => " The paper makes no claim here.".to_owned(),
        (Some(claimed), Some(ahead)) if claimed == ahead => {
            format!(" The paper says {claimed}: borne out.")
        }
        (Some(claimed), Some(_)) => format!(" The paper says {claimed}: not borne out."),
        (Some(claimed), None) => format!(" The paper says {claimed}: not decided."),
    };
    Finding {
        question: question.asked,
        claimed: question.claimed,
        ahead,
        text: text + &verdict,
    }
}

/// Index of the value that is ahead by more than [`ALIKE`].
fn leader([a, b]: [f64; 2], less_is_ahead: bool) -> Option<usize> {
    if (a - b).abs() <= ALIKE * a.abs().max(b.abs()) {
        return None;
    }
    Some(usize::from((a > b) == less_is_ahead))
}

/// Summarises all findings in one sentence.
pub fn summary(findings: &[Finding]) -> String {
    let claims = || findings.iter().filter(|f| f.claimed.is_some());
    let borne_out = claims().filter(|f| f.ahead.as_deref() == f.claimed).count();
    let undecided = claims().filter(|f| f.ahead.is_none()).count();
    let all = claims().count();
    format!(
        "{all} claims follow from the paper's Figures 2 and 3 and its times. Borne out here: \
         {borne_out}; not borne out: {}; not decided: {undecided}.",
        all - borne_out - undecided
    )
}

/// Column name and value; `None` is an empty cell.
type Column = (&'static str, fn(&FrameRow) -> Option<f64>);

const COLUMNS: [Column; 13] = [
    ("frame", |row| Some(row.frame.into())),
    ("time_s", |row| Some(row.time)),
    ("bake_s", |row| row.seconds),
    ("substeps", |row| Some(row.substeps.into())),
    ("iterations", |row| Some(row.iterations as f64)),
    ("missed", |row| Some(row.missed.into())),
    ("crest_height_m", |row| Some(row.measures.crest_height)),
    ("crest_slope_degrees", |row| row.measures.crest_slope),
    ("front_m", |row| row.measures.front),
    ("splash_height_m", |row| Some(row.measures.splash_height)),
    ("splash_reach_m", |row| Some(row.measures.splash_reach)),
    ("airborne", |row| Some(row.measures.airborne)),
    ("wet_area_m2", |row| Some(row.measures.wet_area)),
];

/// Every measured frame as a table in SI units. The first row has the titles.
pub fn table(courses: &[Course]) -> Vec<Vec<String>> {
    let titles = COLUMNS.iter().map(|(name, _)| *name);
    let titles = ["solver"].into_iter().chain(titles);
    let mut table = vec![titles.map(str::to_owned).collect()];
    for course in courses {
        table.extend(course.rows.iter().map(|row| {
            let cell = |(_, value): &Column| value(row).map_or(String::new(), |v| v.to_string());
            let cells = COLUMNS.iter().map(cell);
            [course.solver.clone()].into_iter().chain(cells).collect()
        }));
    }
    table
}

/// The curves of the page: each measure against simulated time.
pub fn charts(courses: &[Course], impact: Impact) -> Vec<Chart> {
    type Value = fn(&FrameRow) -> Option<f64>;
    let measured: [(&str, &str, Value); 7] = [
        ("Crest above the still level", "m", |row| {
            Some(row.measures.crest_height)
        }),
        ("Slope of the crest's front face", "degrees", |row| {
            row.measures.crest_slope
        }),
        ("Front of the wave", "m", |row| row.measures.front),
        (
            "Height below which 99.9 % of the water is",
            "m above the still level",
            |row| Some(row.measures.splash_height),
        ),
        ("Water in the air", "% of the particles", |row| {
            Some(100.0 * row.measures.airborne)
        }),
        ("Ground with water above it", "m²", |row| {
            Some(row.measures.wet_area)
        }),
        ("Time per frame", "s", |row| row.seconds),
    ];
    let mut rows = courses.iter().flat_map(|course| &course.rows);
    let at_impact = rows.find(|row| Some(row.frame) == impact.frame);
    let mark = at_impact.map(|row| Mark::At(row.time, "impact".to_owned()));
    let series = |course: &Course, value: Value| {
        let points = course.rows.iter().map(|row| (row.time, value(row)));
        Series::curve(&course.solver, points)
    };
    let chart = |(title, unit, value): (&str, &str, Value)| Chart {
        title: title.into(),
        x_label: "simulated time, s".into(),
        y_label: unit.into(),
        series: courses.iter().map(|course| series(course, value)).collect(),
        marks: mark.iter().cloned().collect(),
        ..Chart::default()
    };
    measured.into_iter().map(chart).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten frames with the front advancing a metre per frame; `measures` is the same in each.
    fn course(solver: &str, measures: Measures, seconds: f64) -> Course {
        let row = |frame: u32| FrameRow {
            frame,
            time: 0.1 * f64::from(frame),
            seconds: Some(seconds),
            substeps: 2,
            iterations: 8,
            missed: 0,
            measures: Measures {
                front: Some(f64::from(frame)),
                ..measures
            },
        };
        Course {
            solver: solver.into(),
            rows: (1..=10).map(row).collect(),
        }
    }

    fn pair(pbf: f64, flip: f64) -> [Course; 2] {
        let measures = |k: f64| Measures {
            crest_height: k,
            crest_slope: Some(10.0 * k),
            splash_height: k,
            airborne: 0.1 * k,
            wet_area: k,
            ..Measures::default()
        };
        [
            course("pbf", measures(pbf), 1.0),
            course("flip", measures(flip), 0.5),
        ]
    }

    fn verdicts(courses: &[Course; 2]) -> Vec<Option<String>> {
        let impact = Impact::of(courses, 5.0);
        findings(courses, impact)
            .into_iter()
            .map(|f| f.ahead)
            .collect()
    }

    #[test]
    fn the_words_follow_the_numbers_both_ways() {
        let pbf = Some("pbf".to_owned());
        let flip = Some("flip".to_owned());
        let mut expected = vec![pbf; 5];
        expected.push(flip.clone());
        assert_eq!(verdicts(&pair(2.0, 1.0)), expected);
        assert_eq!(verdicts(&pair(1.0, 2.0)), vec![flip.clone(); 6]);
        let mut alike = vec![None; 5];
        alike.push(flip);
        assert_eq!(verdicts(&pair(1.0, 1.04)), alike);
        // 5 % of the greater: 1 against 1 / 0.95 = 1.052632.
        assert_eq!(verdicts(&pair(1.0, 1.0526)), alike);
        assert!(
            verdicts(&pair(1.0, 1.0527))[..5]
                .iter()
                .all(Option::is_some)
        );

        let courses = pair(1.0, 1.5);
        let found = findings(&courses, Impact::of(&courses, 11.0));
        assert_eq!(
            found[0].text,
            "Slope of the crest's front face, median over the frames before the impact: 10.0° with \
             pbf, 15.0° with flip: flip is ahead by 50 %. The paper says pbf: not borne out."
        );
        assert!(found[1].text.ends_with("The paper makes no claim here."));
        assert!(summary(&found).starts_with("5 claims"));
        assert!(summary(&found).ends_with("Borne out here: 1; not borne out: 4; not decided: 0."));
    }

    #[test]
    fn before_and_after_the_impact_are_kept_apart() {
        let mut courses = pair(1.0, 1.0);
        // A height after the impact is no crest, and spray before it is no splash.
        for row in &mut courses[1].rows {
            let is_before = row.frame < 5;
            row.measures.crest_height = if is_before { 1.0 } else { 9.0 };
            row.measures.airborne = if is_before { 9.0 } else { 0.1 };
        }
        let impact = Impact::of(&courses, 5.0);
        assert_eq!(impact.frame, Some(5));
        assert_eq!(verdicts(&courses)[1..3], [None, None]);
        assert_eq!(Impact::of(&courses, 11.0).frame, None);
    }

    #[test]
    fn no_wave_and_no_frames_are_no_comparison() {
        let mut courses = pair(1.0, 2.0);
        for row in &mut courses[0].rows {
            row.measures.crest_slope = None;
        }
        let found = findings(&courses, Impact { frame: None });
        assert_eq!(found[0].ahead, None);
        assert!(found[0].text.contains("none with pbf") && found[0].text.contains("not decided"));
        for course in &mut courses {
            course.rows.clear();
        }
        let found = findings(&courses, Impact { frame: None });
        assert!(found.iter().all(|f| f.ahead.is_none()));
    }

    #[test]
    fn the_table_has_a_line_a_frame_and_as_many_columns_as_titles() {
        let table = table(&pair(1.0, 2.0));
        assert_eq!(table.len(), 21);
        assert!(table.iter().all(|row| row.len() == table[0].len()));
        assert_eq!(table[11].join(","), "flip,1,0.1,0.5,2,8,0,2,20,1,2,0,0.2,2");
    }

    #[test]
    fn every_measure_has_a_curve_for_each_solver() {
        let courses = pair(1.0, 2.0);
        let charts = charts(&courses, Impact { frame: Some(3) });
        assert_eq!(charts.len(), 7);
        for chart in &charts {
            let [Mark::At(time, _)] = &chart.marks[..] else {
                panic!("{:?}", chart.marks)
            };
            assert!(chart.series.len() == 2 && (time - 0.3).abs() < 1e-12);
        }
    }
}
