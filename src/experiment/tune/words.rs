//! Formats numbers and settings of a tuned shot as text.

use swell_files::study::tune::{Bound, Limit, Quantity};
use swell_study::tune::Law;

use super::{super::sweep::digits::significant, Trial, TuneResults, model::floor};

impl TuneResults<'_> {
    /// Formats an error in the unit of its limit: `1.7 %` or `0.043 m`.
    pub(super) fn describe(&self, limit: &Limit, value: f64) -> String {
        match limit.bound {
            Bound::Part(_) => format!("{} %", significant(self.in_unit(limit, value))),
            Bound::Absolute(_) => {
                let unit = limit.quantity.unit().unwrap_or_default();
                format!("{} {unit}", significant(value))
            }
        }
    }

    /// Converts an error to the unit of its limit: per cent of the reference's greatest value, or
    /// the quantity's own unit.
    pub(super) fn in_unit(&self, limit: &Limit, value: f64) -> f64 {
        match limit.bound {
            Bound::Part(_) => {
                let whole = self.reference().whole(limit.quantity);
                100.0 * value / whole.expect("limits in per cent are refused without it")
            }
            Bound::Absolute(_) => value,
        }
    }

    /// Time per frame and of the shot: `0.31 s a frame, 22 s for the shot's 72`.
    pub(super) fn time(&self, trial: &Trial<'_>) -> String {
        let seconds = trial.run.per_frame()[1];
        let frames = self.tune.scene.shot.frames;
        let shot = seconds * f64::from(frames);
        format!(
            "{} s a frame, {} s for the shot's {frames}",
            significant(seconds),
            significant(shot)
        )
    }

    /// Each error of a trial with its limit and its prediction.
    pub(super) fn off(&self, trial: &Trial<'_>) -> String {
        let predicted = self.predicted(trial);
        let errors = self.errors(&trial.run);
        let limits = self.tune.request.limits.iter().enumerate();
        let of = |(k, limit): (usize, &Limit)| {
            let name = limit.quantity.name();
            let off = match errors[k] {
                Some(off) => format!("{name} {} off", self.describe(limit, off)),
                None => format!("{name} not measured"),
            };
            let laws = match &predicted {
                Some(predicted) => {
                    format!(
                        ", the laws say {}",
                        self.describe(limit, predicted.errors[k])
                    )
                }
                None => String::new(),
            };
            format!("{off} (limit {limit}{laws})")
        };
        limits.map(of).collect::<Vec<_>>().join("; ")
    }

    /// All limits, including those of time.
    pub(super) fn limits_in_words(&self) -> String {
        let request = &self.tune.request;
        let limits = request.limits.iter().map(Limit::to_string);
        let shot = request.seconds.map(|s| format!("{s} s for the shot"));
        let frame = request.per_frame.map(|s| format!("{s} s a frame"));
        limits
            .chain(shot)
            .chain(frame)
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// The page's first sentence.
    pub(super) fn answer(&self) -> String {
        let Some((place, holds)) = self.choice else {
            return "No run finished.".into();
        };
        let trial = &self.trials[place];
        let runs = self.candidates().len();
        let (name, time, off) = (trial.variant.name(), self.time(trial), self.off(trial));
        match holds {
            true => format!("{name}: {time}; {off}: the cheapest of {runs} runs that holds."),
            false => format!(
                "None of {runs} runs holds {}. The nearest is {name}: {time}; {off}.",
                self.limits_in_words()
            ),
        }
    }

    /// Time of the chosen settings relative to the scene's own, where the latter was run.
    pub(super) fn against_own(&self) -> Option<String> {
        let chosen = &self.trials[self.choice?.0];
        let own = self.tune.own_spacing();
        let mut ladder = self
            .trials
            .iter()
            .filter(|t| t.role == super::Role::Spacing);
        let own = ladder.find(|t| t.variant.set[0].value == own && t.run.ended.is_none())?;
        let ratio = chosen.run.per_frame()[1] / own.run.per_frame()[1];
        Some(format!(
            "The scene as it stands: {}; {}. The chosen settings take {} of its time.",
            self.time(own),
            self.off(own),
            significant(ratio)
        ))
    }

    /// Note that a greater reference factor may find more, where the choice is at the coarsest
    /// spacing.
    pub(super) fn at_the_end(&self) -> Option<String> {
        let (place, true) = self.choice? else {
            return None;
        };
        let is_coarsest = self.trials[place].variant.spacing() >= self.tune.ladder[0].spacing();
        is_coarsest.then(|| {
            "It is the coarsest that was run: a greater reference factor looks at coarser ones."
                .to_owned()
        })
    }

    /// Statements that these runs cannot support.
    pub(super) fn not_promised(&self) -> Vec<String> {
        let mut texts: Vec<String> = self.floors();
        let mut limits = self.tune.request.limits.iter();
        if limits.any(|it| matches!(it.quantity, Quantity::Crest | Quantity::Front)) {
            texts.push(format!(
                "Crest and front are measured in cubes of {} m: lower waves \
                 ask for run_up or energy.",
                significant(self.resolution)
            ));
        }
        texts.push(PROMISED.into());
        texts.push(format!(
            "{} No run here knows what all of them share, nor what the model leaves out.",
            self.reference_in_words()
        ));
        let (frames, all) = (self.tune.frames, self.tune.scene.shot.frames);
        if frames < all {
            texts.push(format!(
                "Frames 1 to {frames} of {all} were run: of the others nothing is known, and their \
                 time is taken to be the same."
            ));
        }
        texts
    }

    /// Noise floor of each limited quantity, with a note where it exceeds the limit.
    pub(super) fn floors(&self) -> Vec<String> {
        let run = |role| {
            let mut found = self.trials.iter().filter(move |t| t.role == role);
            found.next().filter(|t| t.run.ended.is_none())
        };
        let (Some(own), Some(noise_floor)) =
            (run(super::Role::Spacing), run(super::Role::NoiseFloor))
        else {
            return Vec::new();
        };
        let limits = self.tune.request.limits.iter().zip(&self.limits.errors);
        let of = |(limit, allowed): (&Limit, &f64)| {
            let floor = floor(limit.quantity, &own.run, &noise_floor.run)?;
            let name = limit.quantity.name();
            let what = format!(
                "{name}: a millionth more gravity changes it by {} at {}",
                self.describe(limit, floor),
                own.variant.name()
            );
            Some(if floor > *allowed {
                format!("{what}, more than {limit}: no settings can promise that.")
            } else {
                format!("{what}.")
            })
        };
        limits.filter_map(of).collect()
    }

    /// Describes the reference and its own estimated errors.
    pub(super) fn reference_in_words(&self) -> String {
        let mut words = format!(
            "Errors are measured against {}.",
            self.tune.reference.name()
        );
        let Some(fitted) = &self.fitted else {
            return words;
        };
        let limits = self.tune.request.limits.iter().zip(&fitted.first.errors);
        let has_reference = |(limit, _): &(&Limit, &Law)| limit.quantity != Quantity::Density;
        let (seen, unseen): (Vec<_>, Vec<_>) = limits
            .filter(has_reference)
            .partition(|(_, law)| law.is_seen());
        let seen: Vec<_> = (seen.iter())
            .map(|(limit, law)| {
                let own = self.describe(limit, law.of_reference());
                format!("{} {own}", limit.quantity.name())
            })
            .collect();
        if !seen.is_empty() {
            words += &format!(" By the laws it is itself off by {}.", seen.join(", "));
        }
        let unseen: Vec<_> = unseen.iter().map(|(l, _)| l.quantity.name()).collect();
        if !unseen.is_empty() {
            words += &format!(
                " How far it is itself off in {} is not known: no order of convergence is seen.",
                unseen.join(" and ")
            );
        }
        words
    }

    /// Table with one row per law.
    pub(super) fn laws(&self) -> Vec<Vec<String>> {
        let titles = [
            "of",
            "goes as spacing to the power",
            "scatter",
            "the reference's own",
        ];
        let mut rows = vec![titles.map(str::to_owned).to_vec()];
        let Some(fitted) = &self.fitted else {
            return rows;
        };
        let row = |name: String, law: &Law, own: String| {
            let scatter = format!("{} %", significant(100.0 * (law.scatter.exp() - 1.0)));
            let order = match law.is_seen() || law.reference == 0.0 {
                true => format!("{:.2}", law.order),
                false => format!("{:.2}, which is none", law.order),
            };
            vec![name, order, scatter, own]
        };
        let limits = self.tune.request.limits.iter().zip(&fitted.first.errors);
        rows.extend(limits.map(|(limit, law)| {
            let own = match law.reference > 0.0 && law.is_seen() {
                true => self.describe(limit, law.of_reference()),
                false => String::new(),
            };
            row(limit.quantity.title().to_owned(), law, own)
        }));
        let time = &fitted.first.time;
        rows.push(row("time of a frame".into(), time, String::new()));
        rows
    }

    /// Reason for the value of a setting in the chosen run.
    pub(super) fn reason(&self, trial: &Trial<'_>, key: &str, value: &str, own: &str) -> String {
        let Some(knob) = self.tune.knobs.iter().position(|knob| knob.key == key) else {
            let law = self.fitted.as_ref().map_or(String::new(), |fitted| {
                let limits = self.tune.request.limits.iter().zip(&fitted.first.errors);
                let seen = limits.filter(|(_, law)| law.is_seen());
                let orders = seen.map(|(limit, law)| {
                    format!(
                        "{} error goes as its power {:.1}",
                        limit.quantity.name(),
                        law.order
                    )
                });
                let time = format!("time as {:.1}", fitted.first.time.order);
                let all: Vec<_> = orders.chain([time]).collect();
                format!("; {}", all.join(", "))
            });
            return format!("tune: was {own}; {}{law}", self.off(trial));
        };
        let tried: Vec<String> = self.effects_in_words(knob, value);
        let was = match value == own {
            true => "as it was".to_owned(),
            false => format!("was {own}"),
        };
        let at = self.tune.ladder[0].spacing();
        match tried.is_empty() {
            true => format!("tune: {was}; nothing else was tried"),
            false => format!("tune: {was}; on variants of {at} m: {}", tried.join("; ")),
        }
    }

    /// Effects of the values of a setting other than the scene's own, the chosen one first.
    fn effects_in_words(&self, knob: usize, chosen: &str) -> Vec<String> {
        let Some(effects) = self.fitted.as_ref().map(|fitted| fitted.effects(knob)) else {
            return Vec::new();
        };
        let limits = &self.tune.request.limits;
        let mut words: Vec<(bool, String)> = effects
            .into_iter()
            .map(|(value, effect)| {
                let errors = limits.iter().zip(&effect.errors).map(|(limit, added)| {
                    let sign = if *added < 0.0 { "-" } else { "+" };
                    format!(
                        "{} {sign}{}",
                        limit.quantity.name(),
                        self.describe(limit, added.abs())
                    )
                });
                let errors = errors.collect::<Vec<_>>().join(", ");
                let time = significant(effect.time);
                (
                    value != chosen,
                    format!("{value} takes {time} of the time ({errors})"),
                )
            })
            .collect();
        words.sort_by_key(|(is_other, _)| *is_other);
        words.into_iter().map(|(_, words)| words).collect()
    }
}

const PROMISED: &str = "After the water has met a wall, a solid or itself particles are chaotic: \
    what is held are such sums and medians, as a mean over the frames that were measured. The \
    shape of a splash, a drop, one frame's crest are not.";
