//! Where more time stops paying, and who is better for the same time.

/// Part of the discretisation error below which a solver's error is of no account.
const OF_NO_ACCOUNT: f64 = 0.1;

use super::work_precision::{Line, Point};

/// The points of a line that no other beats in both time and error, from the cheapest on.
fn best(line: &Line) -> Vec<&Point> {
    let mut points: Vec<&Point> = line.points.iter().filter(|p| p.error > 0.0).collect();
    points.sort_by(|a, b| {
        a.time[1]
            .total_cmp(&b.time[1])
            .then(a.error.total_cmp(&b.error))
    });
    let mut least = f64::INFINITY;
    points.retain(|point| {
        let is_better = point.error < least;
        least = least.min(point.error);
        is_better
    });
    points
}

/// The cheapest setting whose error is below a tenth of the discretisation error; `None` where none is.
pub fn first_of_no_account(line: &Line, discretisation: f64) -> Option<&Point> {
    let mut points = best(line).into_iter();
    points.find(|point| point.error <= OF_NO_ACCOUNT * discretisation)
}

/// The setting with the least error × time, which stands in for the knee where the discretisation error is not known. Up to
/// it x times the time buys more than x times the accuracy, beyond it less. `None` for a line without points.
pub fn knee(line: &Line) -> Option<&Point> {
    best(line)
        .into_iter()
        .min_by(|a, b| (a.time[1] * a.error).total_cmp(&(b.time[1] * b.error)))
}

/// "x times the time buys y times the accuracy".
fn bargain(from: &Point, to: &Point) -> String {
    format!(
        "from {} to {} {:.2} times the time buys {:.2} times the accuracy",
        from.label,
        to.label,
        to.time[1] / from.time[1],
        from.error / to.error
    )
}

/// What the knee of a line is, in words, beside the discretisation error where that is known.
pub fn words(line: &Line, discretisation: Option<f64>) -> String {
    let best = best(line);
    let (Some(least), Some(first), Some(last)) = (knee(line), best.first(), best.last()) else {
        return "nothing was measured".into();
    };
    if best.len() < 2 {
        return "one setting alone has no knee".into();
    }
    let (knee, told) = match discretisation {
        None => (
            least,
            format!(
                "the discretisation error is not known here; by error × time the knee is {}",
                least.label
            ),
        ),
        Some(error) => match first_of_no_account(line, error) {
            Some(knee) => (
                knee,
                format!(
                    "the knee is {}, the cheapest whose error ({:.2e}) is below a tenth of the discretisation error ({error:.2e})",
                    knee.label, knee.error
                ),
            ),
            None => (
                least,
                format!(
                    "no setting comes below a tenth of the discretisation error ({error:.2e}); by error × time the knee is {}",
                    least.label
                ),
            ),
        },
    };
    let mut said = vec![told];
    if knee.label != first.label {
        said.push(bargain(first, knee));
    }
    if knee.label != last.label {
        said.push(bargain(knee, last));
    } else if discretisation.is_none_or(|error| knee.error > OF_NO_ACCOUNT * error) {
        said.push("it is the best that was run, so that more may still pay".into());
    }
    said.join("; ")
}

/// What a line leaves at a time between its points' times: its best points joined by straight lines in the chart.
fn at_time(line: &Line, time: f64) -> Option<f64> {
    let best = best(line);
    let pair = best
        .windows(2)
        .find(|pair| (pair[0].time[1]..=pair[1].time[1]).contains(&time))?;
    let [a, b] = [pair[0], pair[1]];
    let part = (time / a.time[1]).ln() / (b.time[1] / a.time[1]).ln();
    Some(a.error * (b.error / a.error).powf(part))
}

/// Another line's error over this point's, at this point's time.
#[derive(Clone, Debug, PartialEq)]
pub struct Rivalry {
    /// The setting of the line that is asked about.
    pub label: String,
    /// Of each other line: its error over the point's; above 1 the point is better. `None` where that line has no point on
    /// both sides of the time.
    pub ratios: Vec<Option<f64>>,
}

/// Compares each point of line `index` with every other line at the same time.
pub fn rivalry(lines: &[Line], index: usize) -> Vec<Rivalry> {
    let compare = |point: &Point| Rivalry {
        label: point.label.clone(),
        ratios: (0..lines.len())
            .filter(|&other| other != index)
            .map(|other| Some(at_time(&lines[other], point.time[1])? / point.error))
            .collect(),
    };
    let points = lines[index].points.iter().filter(|p| p.error > 0.0);
    points.map(compare).collect()
}

/// Whether a line beats each other at equal time, in words: where it does not, the settings are named.
pub fn rivalry_words(lines: &[Line], index: usize) -> String {
    let table = rivalry(lines, index);
    let others = (0..lines.len()).filter(|&other| other != index);
    let said = others.enumerate().map(|(column, other)| {
        let ratios: Vec<(&str, f64)> = table
            .iter()
            .filter_map(|row| Some((row.label.as_str(), row.ratios[column]?)))
            .collect();
        let lost: Vec<String> = ratios
            .iter()
            .filter(|(_, ratio)| *ratio <= 1.0)
            .map(|(label, ratio)| format!("{label} ({ratio:.2})"))
            .collect();
        let name = &lines[other].name;
        match (ratios.len(), lost.len()) {
            (all @ 0..2, _) => {
                format!("{name}: {all} settings with times in common, too few for a verdict")
            }
            (all, 0) => {
                format!("less error than {name} at all {all} settings that can be compared")
            }
            (all, _) => format!(
                "less error than {name} at {} of {all} settings, not at {} (its error over this line's)",
                all - lost.len(),
                lost.join(", ")
            ),
        }
    });
    said.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(name: &str, points: &[(f64, f64)]) -> Line {
        Line {
            name: name.into(),
            points: points
                .iter()
                .enumerate()
                .map(|(k, &(time, error))| Point {
                    label: format!("s{k}"),
                    time: [time; 3],
                    work: time,
                    error,
                })
                .collect(),
        }
    }

    /// Twice the time for four times the accuracy, twice; then twice the time for a tenth more.
    #[test]
    fn a_bend_is_found() {
        let bent = line(
            "a",
            &[
                (1.0, 1.6),
                (2.0, 0.4),
                (4.0, 0.1),
                (8.0, 0.09),
                (16.0, 0.081),
            ],
        );
        assert_eq!(knee(&bent).map(|p| p.label.as_str()), Some("s2"));
        let said = words(&bent, None);
        assert!(
            said.contains("is not known here; by error × time the knee is s2"),
            "{said}"
        );
        assert!(
            said.contains("from s0 to s2 4.00 times the time buys 16.00 times the accuracy"),
            "{said}"
        );
        assert!(
            said.contains("from s2 to s4 4.00 times the time buys 1.23 times"),
            "{said}"
        );
        // A setting that is slower and worse is no part of it; no points have no knee.
        let worse = line("a", &[(1.0, 1.6), (2.0, 0.4), (3.0, 0.5), (4.0, 0.1)]);
        assert_eq!(best(&worse).len(), 3);
        assert!(words(&worse, None).contains("more may still pay"));
        assert_eq!(knee(&line("a", &[(1.0, 0.0)])), None);
    }

    #[test]
    fn a_tenth_of_the_discretisation_error_is_enough() {
        let steady = line(
            "a",
            &[
                (1.0, 1.6),
                (2.0, 0.4),
                (4.0, 0.1),
                (8.0, 0.02),
                (16.0, 0.002),
            ],
        );
        let label = |error| first_of_no_account(&steady, error).map(|p| p.label.as_str());
        assert_eq!(
            (label(4.0), label(3.97), label(1.0)),
            (Some("s1"), Some("s2"), Some("s2"))
        );
        assert_eq!((label(0.02), label(0.019)), (Some("s4"), None));
        let said = words(&steady, Some(3.9));
        assert!(
            said.starts_with("the knee is s2, the cheapest whose error (1.00e-1)"),
            "{said}"
        );
        assert!(said.contains("from s2 to s4 4.00 times the time"), "{said}");
        assert!(words(&steady, Some(0.02)).starts_with("the knee is s4"));
        assert!(!words(&steady, Some(0.02)).contains("more may still pay"));
        let said = words(&steady, Some(0.01));
        assert!(said.starts_with("no setting comes below a tenth"), "{said}");
    }

    #[test]
    fn equal_times_are_compared_and_losses_named() {
        let slow = line("slow", &[(1.0, 1.0), (4.0, 0.25), (16.0, 0.0625)]);
        let fast = line(
            "fast",
            &[(0.5, 3.0), (2.5, 0.2), (8.0, 0.0625), (32.0, 0.01)],
        );
        // Error 1/t: at 2.5 it is 0.4, at 8 0.125.
        let lines = [slow, fast];
        let found = rivalry(&lines, 1);
        let ratio = |k: usize| found[k].ratios[0];
        assert_eq!((ratio(0), ratio(3)), (None, None));
        assert!(ratio(1).is_some_and(|r| (r - 2.0).abs() < 1e-12));
        assert!(ratio(2).is_some_and(|r| (r - 2.0).abs() < 1e-12));
        assert!(rivalry_words(&lines, 1).contains("less error than slow at all 2"));
        // The other way round it loses at every time.
        let said = rivalry_words(&lines, 0);
        assert!(said.contains("at 0 of 3 settings, not at s0"), "{said}");
    }
}
