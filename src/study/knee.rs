//! Where more time stops paying off, and which method is more accurate at equal time.

/// Fraction of the discretisation error below which a solver's error is negligible.
pub const OF_NO_ACCOUNT: f64 = 0.1;

/// A method's points, in the order of its settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MethodCurve {
    /// Name of the method.
    pub name: String,
    /// The measured points.
    pub points: Vec<CostPoint>,
}

/// Cost and error of one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct CostPoint {
    /// Name of the setting.
    pub label: String,
    /// Minimum, median and maximum time of the repeats, in any consistent unit.
    pub time: [f64; 3],
    /// Machine-independent cost, in any consistent unit.
    pub work: f64,
    /// Error, 0 or more.
    pub error: f64,
}

/// The Pareto front of a line in time and error, from the cheapest point on.
fn best(line: &MethodCurve) -> Vec<&CostPoint> {
    let mut points: Vec<&CostPoint> = line.points.iter().filter(|p| p.error > 0.0).collect();
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

/// The cheapest setting whose error is at most a tenth of the discretisation error; `None` if there
/// is none.
fn first_of_no_account(line: &MethodCurve, discretisation: f64) -> Option<&CostPoint> {
    let mut points = best(line).into_iter();
    points.find(|point| point.error <= OF_NO_ACCOUNT * discretisation)
}

/// Where more time stops paying off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knee<'a> {
    /// The setting at the knee.
    pub point: &'a CostPoint,
    /// Whether its error is at most a tenth of the discretisation error. Otherwise the setting has
    /// the least error × time: up to it x times the time buys more than x times the accuracy,
    /// beyond it less.
    pub is_enough: bool,
    /// Whether no setting that was run is better, so that more time may still pay off.
    pub is_last: bool,
}

/// The knee of a line, given the discretisation error if it is known; `None` for a line without
/// points.
pub fn knee(line: &MethodCurve, discretisation: Option<f64>) -> Option<Knee<'_>> {
    let enough = discretisation.and_then(|error| first_of_no_account(line, error));
    let product = |point: &&CostPoint| point.time[1] * point.error;
    let least = || {
        best(line)
            .into_iter()
            .min_by(|a, b| product(a).total_cmp(&product(b)))
    };
    let point = enough.or_else(least)?;
    Some(Knee {
        point,
        is_enough: enough.is_some(),
        is_last: best(line)
            .last()
            .is_some_and(|last| std::ptr::eq(*last, point)),
    })
}

/// "x times the time buys y times the accuracy".
fn bargain(from: &CostPoint, to: &CostPoint) -> String {
    format!(
        "from {} to {} {:.2} times the time buys {:.2} times the accuracy",
        from.label,
        to.label,
        to.time[1] / from.time[1],
        from.error / to.error
    )
}

/// Text for a knee at the last setting that was run.
pub const BEST_THAT_WAS_RUN: &str = "the best that was run, so that more may still pay";

/// Number of settings that two lines must have in common before either is called better.
const LEAST_IN_COMMON: usize = 2;

/// Describes the knee of a line in words, given the discretisation error if it is known.
pub fn words(line: &MethodCurve, discretisation: Option<f64>) -> String {
    let best = best(line);
    let (Some(knee), Some(first), Some(last)) =
        (knee(line, discretisation), best.first(), best.last())
    else {
        return "nothing was measured".into();
    };
    if best.len() < 2 {
        return "a single setting has no knee".into();
    }
    let Knee {
        point,
        is_enough,
        is_last,
    } = knee;
    let label = &point.label;
    let mut said = vec![match discretisation {
        None => format!(
            "the discretisation error is not known here; by error × time the knee is {label}"
        ),
        Some(error) if is_enough => format!(
            "the knee is {label}, the cheapest whose error ({:.2e}) is below a tenth of the \
             discretisation error ({error:.2e})",
            point.error
        ),
        Some(error) => format!(
            "no setting comes below a tenth of the discretisation error ({error:.2e}); by error × \
             time the knee is {label}"
        ),
    }];
    if *label != first.label {
        said.push(bargain(first, point));
    }
    if !is_last {
        said.push(bargain(point, last));
    } else if !is_enough {
        said.push(format!("it is {BEST_THAT_WAS_RUN}"));
    }
    said.join("; ")
}

/// Error of a line at a time between those of its points: its best points joined by straight lines
/// in the logarithmic chart.
fn at_time(line: &MethodCurve, time: f64) -> Option<f64> {
    let best = best(line);
    let pair = best
        .windows(2)
        .find(|pair| (pair[0].time[1]..=pair[1].time[1]).contains(&time))?;
    let [a, b] = [pair[0], pair[1]];
    let part = (time / a.time[1]).ln() / (b.time[1] / a.time[1]).ln();
    Some(a.error * (b.error / a.error).powf(part))
}

/// Text for lines that have too few times in common.
pub const TOO_FEW: &str = "too few for a verdict";

/// Comparison of a line with another at equal times.
#[derive(Clone, Debug, PartialEq)]
pub struct Rivalry {
    /// Name of the other line.
    pub other: String,
    /// For each setting whose time lies within the other line's range: the other's error over the
    /// setting's. Above 1 the setting is better.
    pub ratios: Vec<(String, f64)>,
}

/// Compares the points of line `index` with every other line at the same time.
pub fn rivalry(lines: &[MethodCurve], index: usize) -> Vec<Rivalry> {
    let others = lines.iter().enumerate().filter(|(k, _)| *k != index);
    let points = || lines[index].points.iter().filter(|p| p.error > 0.0);
    let ratio = |other: &MethodCurve, point: &CostPoint| {
        let theirs = at_time(other, point.time[1])?;
        Some((point.label.clone(), theirs / point.error))
    };
    others
        .map(|(_, other)| Rivalry {
            other: other.name.clone(),
            ratios: points().filter_map(|point| ratio(other, point)).collect(),
        })
        .collect()
}

impl Rivalry {
    /// Whether the lines have enough times in common for a verdict.
    pub fn has_verdict(&self) -> bool {
        self.ratios.len() >= LEAST_IN_COMMON
    }

    /// Settings at which the line is not better, with the ratios.
    pub fn lost(&self) -> Vec<String> {
        let lost = self.ratios.iter().filter(|(_, ratio)| *ratio <= 1.0);
        lost.map(|(label, ratio)| format!("{label} ({ratio:.2})"))
            .collect()
    }

    /// Describes whether the line beats the other; if not at all settings, names the exceptions.
    pub fn words(&self) -> String {
        let (name, lost) = (&self.other, self.lost());
        if !self.has_verdict() {
            let all = self.ratios.len();
            let settings = if all == 1 { "setting" } else { "settings" };
            return format!("{name}: {all} {settings} with times in common, {TOO_FEW}");
        }
        match (self.ratios.len(), lost.len()) {
            (all, 0) => {
                format!("less error than {name} at all {all} settings that can be compared")
            }
            (all, _) => format!(
                "less error than {name} at {} of {all} settings, not at {} (its \
                 error over this line's)",
                all - lost.len(),
                lost.join(", ")
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(name: &str, points: &[(f64, f64)]) -> MethodCurve {
        MethodCurve {
            name: name.into(),
            points: points
                .iter()
                .enumerate()
                .map(|(k, &(time, error))| CostPoint {
                    label: format!("s{k}"),
                    time: [time; 3],
                    work: time,
                    error,
                })
                .collect(),
        }
    }

    /// Twice four times the accuracy for twice the time; then twice a tenth more for twice the
    /// time.
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
        let label = |line| knee(line, None).map(|knee| knee.point.label.clone());
        assert_eq!(label(&bent).as_deref(), Some("s2"));
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
        // A setting that is slower and worse does not belong to the front; a line without points
        // has no knee.
        let worse = line("a", &[(1.0, 1.6), (2.0, 0.4), (3.0, 0.5), (4.0, 0.1)]);
        assert_eq!(best(&worse).len(), 3);
        assert!(words(&worse, None).contains("more may still pay"));
        let is_last = |line| knee(line, None).is_some_and(|knee| knee.is_last);
        assert!(is_last(&worse) && !is_last(&bent));
        assert_eq!(label(&line("a", &[(1.0, 0.0)])), None);
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
        // Error 1/t: 0.4 at 2.5, 0.125 at 8.
        let lines = [slow, fast];
        let [found] = &rivalry(&lines, 1)[..] else {
            panic!("one other line")
        };
        let labels: Vec<&str> = found.ratios.iter().map(|r| r.0.as_str()).collect();
        assert_eq!(labels, ["s1", "s2"]);
        assert!(found.ratios.iter().all(|(_, r)| (r - 2.0).abs() < 1e-12));
        assert!(found.words().contains("less error than slow at all 2"));
        // The other way round it loses at every time.
        let loser = &rivalry(&lines, 0)[0];
        let said = loser.words();
        assert!(said.contains("at 0 of 3 settings, not at s0"), "{said}");
        assert!(loser.has_verdict() && found.has_verdict());
        let one = Rivalry {
            ratios: vec![("s1".into(), 2.0)],
            ..loser.clone()
        };
        assert!(!one.has_verdict());
        let said = one.words();
        assert_eq!(
            said,
            "fast: 1 setting with times in common, too few for a verdict"
        );
    }
}
