//! The cheapest settings that keep an error below its limit: power laws fitted to runs of one shot,
//! the proposals that follow from them, and the choice among the runs.
//!
//! A run at spacing d differs from one at spacing r by C (dᵖ − rᵖ), as in Richardson's
//! extrapolation (1911); errors that both share are invisible. Time scales as C dᵖ with p below 0.
//! Every other setting is assumed to add to the error and to multiply the time. Neither assumption
//! is certain, so a proposal is run before it is accepted.

use std::ops::RangeInclusive;

/// Resolution of the fitted orders: hundredths.
const STEPS: f64 = 100.0;

/// Orders tried for an error against a finer run, in hundredths: below a quarter nothing converges,
/// and no scheme here is above fourth order.
const ORDERS: RangeInclusive<i32> = 25..=400;

/// Orders tried for quantities without a reference (times, density errors), in hundredths: they may
/// rise or fall with the spacing.
const ANY_ORDERS: RangeInclusive<i32> = -800..=800;

/// Fraction of a limit that a proposal may use by the laws; the rest covers their inaccuracy.
const MARGIN: f64 = 0.9;

/// A power law of the particle spacing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Order p.
    pub order: f64,
    /// Factor C, in the unit of the fitted quantity, with the spacing in metres.
    pub factor: f64,
    /// Reference spacing r, metres; 0 without a reference.
    pub reference: f64,
    /// RMS of ln(measured / fitted).
    pub scatter: f64,
}

impl Law {
    /// Fits pairs of spacing (metres) and error against the run at spacing `reference` (metres), by
    /// least squares of the logarithms. Pairs without an error, or not coarser than the reference,
    /// are ignored; `None` for fewer than two spacings.
    pub fn against(reference: f64, pairs: &[(f64, f64)]) -> Option<Self> {
        Self::fit(reference, pairs, ORDERS)
    }

    /// Fits a quantity without a reference: a time, a density error.
    pub fn plain(pairs: &[(f64, f64)]) -> Option<Self> {
        Self::fit(0.0, pairs, ANY_ORDERS)
    }

    fn fit(reference: f64, pairs: &[(f64, f64)], orders: RangeInclusive<i32>) -> Option<Self> {
        let is_told = |(d, value): &&(f64, f64)| *d > reference && *value > 0.0;
        let told: Vec<(f64, f64)> = pairs.iter().filter(is_told).copied().collect();
        let first = told.first()?.0;
        if told.iter().all(|(d, _)| *d == first) {
            return None;
        }
        let of_order = |order: i32| {
            let law = Self {
                order: f64::from(order) / STEPS,
                factor: 1.0,
                reference,
                scatter: 0.0,
            };
            let off = told.iter().map(|(d, value)| (value / law.at(*d)).ln());
            let off: Vec<f64> = off.collect();
            let count = off.len() as f64;
            let mean = off.iter().sum::<f64>() / count;
            let square = off.iter().map(|off| (off - mean).powi(2)).sum::<f64>();
            Self {
                factor: mean.exp(),
                scatter: (square / count).sqrt(),
                ..law
            }
        };
        orders
            .map(of_order)
            .min_by(|a, b| a.scatter.total_cmp(&b.scatter))
    }

    /// Predicted difference from the reference at spacing `d`, metres; 0 if `d` is as fine. Without
    /// a reference, the predicted quantity itself.
    pub fn at(&self, d: f64) -> f64 {
        if self.reference == 0.0 {
            return self.factor * d.powf(self.order);
        }
        let part = d.powf(self.order) - self.reference.powf(self.order);
        self.factor * part.max(0.0)
    }

    /// Predicted error of the reference itself; 0 without a reference.
    pub fn of_reference(&self) -> f64 {
        match self.reference {
            0.0 => 0.0,
            reference => self.factor * reference.powf(self.order),
        }
    }

    /// Whether the runs show an order of convergence: it is above the least that is tried, and the
    /// runs scatter by less than a factor of 1.5.
    pub fn is_seen(&self) -> bool {
        self.order > f64::from(*ORDERS.start()) / STEPS && self.scatter.exp() < 1.5
    }

    /// Corrects the law after a run at its proposal was `ratio` times as far off as predicted. A
    /// single run is trusted up to a factor of two.
    pub fn corrected(self, ratio: f64) -> Self {
        Self {
            factor: self.factor * ratio.clamp(0.5, 2.0),
            ..self
        }
    }
}

/// Effect of another value of a setting, from a run that changes only this value.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// Time relative to that with the scene's own value.
    pub time: f64,
    /// What it adds to each error, in the order of the limits; negative if it is better.
    pub errors: Vec<f64>,
}

impl Effect {
    /// The effect of the scene's own value: none.
    pub fn none(errors: usize) -> Self {
        Self {
            time: 1.0,
            errors: vec![0.0; errors],
        }
    }
}

/// Everything known about a shot.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Law of each error, in the order of the limits.
    pub errors: Vec<Law>,
    /// Law of the seconds per frame.
    pub time: Law,
    /// Effects of the values of each further setting; the scene's own value is the first.
    pub settings: Vec<Vec<Effect>>,
    /// Candidate spacings, metres: within the spacings that were run, because the laws are untested
    /// beyond.
    pub spacings: Vec<f64>,
}

/// Limits that must not be exceeded.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Limit of each error, in its own unit.
    pub errors: Vec<f64>,
    /// Limit of the seconds per frame.
    pub seconds: Option<f64>,
}

/// The settings that are cheapest by the laws.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// Particle spacing, metres.
    pub spacing: f64,
    /// Index of the value of each further setting.
    pub values: Vec<usize>,
    /// Predicted errors, in the order of the limits.
    pub errors: Vec<f64>,
    /// Predicted seconds per frame.
    pub seconds: f64,
}

impl Model {
    /// Predicts errors and time for a spacing (metres) and these values of the further settings.
    pub fn predict(&self, spacing: f64, values: &[usize]) -> Proposal {
        let chosen = || self.settings.iter().zip(values).map(|(of, &k)| &of[k]);
        let added = |k: usize| chosen().map(|effect| effect.errors[k]).sum::<f64>();
        let laws = self.errors.iter().enumerate();
        Proposal {
            spacing,
            values: values.to_vec(),
            errors: laws
                .map(|(k, law)| (law.at(spacing) + added(k)).max(0.0))
                .collect(),
            seconds: self.time.at(spacing) * chosen().map(|effect| effect.time).product::<f64>(),
        }
    }

    /// The cheapest settings that keep the limits by the laws with a tenth to spare; `None` if
    /// there are none.
    pub fn propose(&self, limits: &Limits) -> Option<Proposal> {
        let holds = |proposal: &Proposal| {
            let mut pairs = proposal.errors.iter().zip(&limits.errors);
            pairs.all(|(error, limit)| *error <= MARGIN * limit)
                && limits.seconds.is_none_or(|most| proposal.seconds <= most)
        };
        let of_values = |values: Vec<usize>| {
            let spacings = self.spacings.iter();
            let proposals = spacings.map(move |d| self.predict(*d, &values));
            proposals.filter(holds).collect::<Vec<_>>()
        };
        combinations(&self.settings)
            .into_iter()
            .flat_map(of_values)
            .min_by(|a, b| a.seconds.total_cmp(&b.seconds))
    }
}

/// Every choice of one value of each setting.
fn combinations(settings: &[Vec<Effect>]) -> Vec<Vec<usize>> {
    settings.iter().fold(vec![Vec::new()], |all, values| {
        let longer = |chosen: &Vec<usize>| {
            let of = |k: usize| [&chosen[..], &[k]].concat();
            (0..values.len()).map(of).collect::<Vec<_>>()
        };
        all.iter().flat_map(longer).collect()
    })
}

/// A completed run.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Seconds per frame.
    pub seconds: f64,
    /// Measured errors, in the order of the limits; `None` if one could not be determined.
    pub errors: Vec<Option<f64>>,
}

impl Candidate {
    /// The largest ratio of a measured value to its limit: up to 1 all limits hold. Infinite if an
    /// error could not be determined.
    pub fn excess(&self, limits: &Limits) -> f64 {
        let pairs = self.errors.iter().zip(&limits.errors);
        let errors = pairs.map(|(error, limit)| error.map_or(f64::INFINITY, |e| e / limit));
        let seconds = limits.seconds.iter().map(|most| self.seconds / most);
        errors.chain(seconds).fold(0.0, f64::max)
    }
}

/// The chosen run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// The cheapest that keeps all limits.
    Holds(usize),
    /// No run keeps all limits; this one comes nearest.
    Nearest(usize),
}

/// Chooses the cheapest run that keeps all limits, else the one nearest to that; `None` without
/// runs.
pub fn choose(runs: &[Candidate], limits: &Limits) -> Option<Choice> {
    let each = || runs.iter().enumerate();
    let holding = each().filter(|(_, run)| run.excess(limits) <= 1.0);
    let cheapest = holding.min_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds));
    let excess = |run: &Candidate| run.excess(limits);
    let nearest = || each().min_by(|a, b| excess(a.1).total_cmp(&excess(b.1)));
    cheapest
        .map(|(k, _)| Choice::Holds(k))
        .or_else(|| nearest().map(|(k, _)| Choice::Nearest(k)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3 d^1.5 against a run at 0.08: the fit returns what was put in, the reference's own error
    /// included.
    fn measured(order: f64) -> Vec<(f64, f64)> {
        let of = |d: f64| (d, 3.0 * (d.powf(order) - 0.08f64.powf(order)));
        [0.2, 0.16, 0.128, 0.1].map(of).to_vec()
    }

    fn close(a: f64, b: f64) -> bool {
        (a / b - 1.0).abs() < 1e-9
    }

    #[test]
    fn a_law_is_found_beside_a_reference_that_has_an_error_too() {
        for order in [0.5, 1.0, 1.5, 2.0] {
            let law = Law::against(0.08, &measured(order)).expect("four spacings");
            assert!(close(law.order, order) && close(law.factor, 3.0), "{law:?}");
            assert!(law.scatter < 1e-12 && law.at(0.08) == 0.0);
            assert!(close(law.of_reference(), 3.0 * 0.08f64.powf(order)));
        }
        // Negative controls: taking the reference for the truth gives too high an order, and a
        // spoiled run shows.
        let blind = Law::plain(&measured(1.0)).expect("four spacings");
        assert!(blind.order > 1.5 && blind.scatter > 0.05, "{blind:?}");
        let mut spoiled = measured(1.0);
        spoiled[1].1 *= 3.0;
        let law = Law::against(0.08, &spoiled).expect("four spacings");
        assert!(law.scatter > 0.3, "{law:?}");
        let flat = [0.2, 0.16, 0.128, 0.1].map(|d| (d, 0.1));
        let flat = Law::against(0.08, &flat).expect("four spacings");
        assert!(!flat.is_seen() && Law::against(0.08, &measured(1.0)).is_some_and(|l| l.is_seen()));
    }

    #[test]
    fn a_time_falls_with_the_spacing_and_one_spacing_has_no_law() {
        let law = Law::plain(&[0.2f64, 0.1, 0.05].map(|d| (d, 2e-4 * d.powf(-4.0))));
        let law = law.expect("three spacings");
        assert!(close(law.order, -4.0) && close(law.factor, 2e-4), "{law:?}");
        assert_eq!(Law::plain(&[(0.1, 1.0), (0.1, 2.0)]), None);
        assert_eq!(Law::plain(&[]), None);
        // An error of 0 and a run as fine as the reference carry no information.
        let pairs = [(0.08, 1.0), (0.1, 0.0), (0.2, 1.0)];
        assert_eq!(Law::against(0.08, &pairs), None);
    }

    /// Error d − 0.05, time 1e-4 d⁻⁴; one setting halves the time for 0.02 more error, or doubles
    /// it for 0.03 less.
    fn model() -> Model {
        Model {
            errors: vec![Law {
                order: 1.0,
                factor: 1.0,
                reference: 0.05,
                scatter: 0.0,
            }],
            time: Law {
                order: -4.0,
                factor: 1e-4,
                reference: 0.0,
                scatter: 0.0,
            },
            settings: vec![vec![
                Effect::none(1),
                Effect {
                    time: 0.5,
                    errors: vec![0.02],
                },
                Effect {
                    time: 2.0,
                    errors: vec![-0.03],
                },
            ]],
            spacings: (60..=200).map(|mm| f64::from(mm) / 1000.0).collect(),
        }
    }

    fn limits(error: f64) -> Limits {
        Limits {
            errors: vec![error],
            seconds: None,
        }
    }

    /// By hand, with 0.9 of the limit to use: 0.1 leaves d = 0.14 with the own value (0.260), 0.12
    /// with the fast one (0.241), 0.17 with the slow one (0.239).
    #[test]
    fn the_cheapest_of_the_product_is_proposed() {
        let of = |error: f64| model().propose(&limits(error));
        let proposal = of(0.1).expect("one");
        assert_eq!(proposal.values, [2]);
        assert_eq!(proposal.spacing, 0.17);
        assert!(proposal.errors[0] <= 0.09 + 1e-12);
        // Without the slow value the fast one wins; where its error is too large, the own value.
        let mut two = model();
        two.settings[0].truncate(2);
        let values = |error: f64| two.propose(&limits(error)).expect("one").values;
        assert_eq!((values(0.1), values(0.02)), (vec![1], vec![0]));
        // Nothing meets a limit that the finest spacing misses, or a time limit that is too short.
        assert_eq!(two.propose(&limits(0.01)), None);
        let hurried = |seconds| {
            let limits = Limits {
                seconds: Some(seconds),
                ..limits(0.1)
            };
            model().propose(&limits)
        };
        assert!(hurried(0.25).is_some() && hurried(0.2).is_none());
    }

    #[test]
    fn a_law_that_promised_too_much_is_corrected() {
        let mut model = model();
        model.settings.clear();
        let before = model.propose(&limits(0.1)).expect("one");
        model.errors[0] = model.errors[0].corrected(1.5);
        let after = model.propose(&limits(0.1)).expect("one");
        // 0.05 + 0.09 / 1.5.
        assert!((after.spacing - 0.109).abs() < 0.002 && after.seconds > before.seconds);
        assert!(close(model.errors[0].corrected(9.0).factor, 3.0));
    }

    #[test]
    fn the_cheapest_run_that_holds_is_chosen_and_a_miss_is_said() {
        let run = |seconds, first, second| Candidate {
            seconds,
            errors: vec![Some(first), second],
        };
        let runs = [
            run(1.0, 0.05, Some(0.001)),
            run(2.0, 0.02, Some(0.002)),
            run(3.0, 0.01, Some(0.001)),
            run(0.1, 0.0, None),
        ];
        let limits = |first, second, seconds| Limits {
            errors: vec![first, second],
            seconds,
        };
        let of = |limits: Limits| choose(&runs, &limits);
        assert_eq!(of(limits(0.02, 0.01, None)), Some(Choice::Holds(1)));
        assert_eq!(of(limits(0.06, 0.01, None)), Some(Choice::Holds(0)));
        assert_eq!(of(limits(0.02, 0.0015, None)), Some(Choice::Holds(2)));
        // A run whose error could not be determined keeps no limit, however cheap it is.
        assert_eq!(of(limits(0.005, 0.01, None)), Some(Choice::Nearest(2)));
        assert_eq!(of(limits(0.015, 0.01, Some(2.9))), Some(Choice::Nearest(2)));
        assert_eq!(choose(&[], &limits(1.0, 1.0, None)), None);
    }
}
