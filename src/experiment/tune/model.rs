//! Models of error and time fitted to the variants of a shot.

use swell_files::study::tune::{Knob, Quantity, Setting, Tune};
use swell_study::tune::{Effect, Law, Model, Proposal};

use super::{Role, Trial, measured::TuneRun};

/// Fitted models, and the settings to which their values refer.
pub(super) struct Fitted<'a> {
    /// Models as fitted to the variants.
    pub(super) first: Model,
    /// Models corrected by the proposals that were run.
    pub(super) model: Model,
    /// Values of each setting in the model: the scene's own, which changes nothing, then those
    /// whose runs reached their end, with their indices among the setting's alternatives.
    choices: Choices<'a>,
}

impl<'a> Fitted<'a> {
    /// Returns `None` where the reference or all but one spacing failed.
    pub(super) fn of(tune: &'a Tune, trials: &[Trial<'_>]) -> Option<Self> {
        let run = |role: Role| {
            let mut found = trials.iter().filter(|t| t.role == role);
            found.next().map(|t| &t.run).filter(|r| r.ended.is_none())
        };
        let reference = run(Role::Reference)?;
        let ladder: Vec<(f64, &TuneRun)> = trials
            .iter()
            .filter(|t| t.role == Role::Spacing && t.run.ended.is_none())
            .map(|t| (t.variant.spacing(), &t.run))
            .collect();
        let [(coarsest, _), .., (finest, _)] = ladder[..] else {
            return None;
        };
        let law = |of: Quantity| {
            let pairs = ladder.iter();
            let pairs =
                pairs.map(|(d, run)| Some((*d, run.measured.off(of, &reference.measured)?)));
            law(
                of,
                tune.reference.spacing(),
                &pairs.flatten().collect::<Vec<_>>(),
            )
        };
        let limits = tune.request.limits.iter();
        let times: Vec<_> = ladder
            .iter()
            .map(|(d, run)| (*d, run.per_frame()[1]))
            .collect();
        let own = run(Role::Spacing).filter(|_| coarsest == tune.ladder[0].spacing());
        let noise_floor = run(Role::NoiseFloor);
        let (settings, choices) = match (own, run(Role::Fine), noise_floor) {
            (Some(own), Some(fine), Some(noise_floor)) => {
                effects(tune, [own, fine, noise_floor], run)
            }
            _ => (Vec::new(), Vec::new()),
        };
        let model = Model {
            errors: limits.map(|limit| law(limit.quantity)).collect(),
            time: Law::plain(&times)?,
            settings,
            spacings: tune.spacings([finest, coarsest]),
        };
        Some(Self {
            first: model.clone(),
            model,
            choices,
        })
    }

    /// Settings that the values of a proposal change in the scene.
    pub(super) fn settings(&self, values: &[usize]) -> Vec<Setting> {
        let chosen = self.choices.iter().zip(values).map(|(of, &k)| of[k]);
        let set = chosen.flatten().flat_map(|(_, set)| set);
        set.cloned().collect()
    }

    /// Values of a trial; `None` where the models do not cover it.
    pub(super) fn values(&self, role: Role) -> Option<Vec<usize>> {
        let mut values = vec![0; self.choices.len()];
        match role {
            Role::Spacing => {}
            Role::Knob(k, value) => {
                let is_it = |of: &Option<Chosen<'_>>| of.is_some_and(|it| it.0 == value);
                values[k] = self.choices.get(k)?.iter().position(is_it)?;
            }
            _ => return None,
        }
        Some(values)
    }

    /// Corrects the models by the result of a proposal.
    pub(super) fn correct(&mut self, errors: &[Option<f64>], seconds: f64, before: &Proposal) {
        let pairs = errors.iter().zip(&before.errors);
        for (law, (measured, predicted)) in self.model.errors.iter_mut().zip(pairs) {
            // A failed run counts as infinitely wrong.
            let ratio = measured.map_or(f64::INFINITY, |measured| measured / predicted);
            if ratio.is_finite() || measured.is_none() {
                *law = law.corrected(ratio);
            }
        }
        if seconds > 0.0 {
            self.model.time = self.model.time.corrected(seconds / before.seconds);
        }
    }
}

/// Law of an error by spacing. Where none can be fitted, for example because the error is 0
/// throughout, a constant at the largest measured value.
fn law(of: Quantity, reference: f64, pairs: &[(f64, f64)]) -> Law {
    let law = match of {
        Quantity::Density => Law::plain(pairs),
        _ => Law::against(reference, pairs),
    };
    law.unwrap_or(Law {
        order: 0.0,
        factor: pairs.iter().map(|pair| pair.1).fold(0.0, f64::max),
        reference: 0.0,
        scatter: 0.0,
    })
}

/// A value other than the scene's own: its index among the alternatives, and the settings it
/// changes.
type Chosen<'a> = (usize, &'a [Setting]);

/// Values of each setting; `None` is the scene's own.
type Choices<'a> = Vec<Vec<Option<Chosen<'a>>>>;

/// Noise floor: difference of a run from one with a millionth more gravity, which no two bakes fall
/// below.
pub(super) fn floor(of: Quantity, own: &TuneRun, noise_floor: &TuneRun) -> Option<f64> {
    match of {
        Quantity::Density => Some((own.measured.density - noise_floor.measured.density).abs()),
        _ => own.measured.off(of, &noise_floor.measured),
    }
}

/// Effects of each value of each setting at the coarsest spacing: the time relative to the scene's
/// own value, and the increase of the distance to the run with finer settings at the same spacing.
/// Differences within the noise floor count as none.
fn effects<'a, 't>(
    tune: &'a Tune,
    [own, fine, noise_floor]: [&TuneRun; 3],
    run: impl Fn(Role) -> Option<&'t TuneRun>,
) -> (Vec<Vec<Effect>>, Choices<'a>) {
    let limits = &tune.request.limits;
    let off = |run: &TuneRun, of: Quantity| run.measured.off(of, &fine.measured);
    let effect = |other: &TuneRun| {
        let errors = limits.iter().map(|limit| {
            let of = limit.quantity;
            // Quantities without a value at this spacing count as unchanged.
            let added = off(other, of)? - off(own, of)?;
            Some(added).filter(|added| added.abs() > floor(of, own, noise_floor).unwrap_or(0.0))
        });
        Effect {
            time: other.per_frame()[1] / own.per_frame()[1],
            errors: errors.map(Option::unwrap_or_default).collect(),
        }
    };
    let of = |(k, knob): (usize, &'a Knob)| {
        let mut effects = vec![Effect::none(limits.len())];
        let mut choices = vec![None];
        for (value, (set, _)) in knob.others.iter().enumerate() {
            if let Some(other) = run(Role::Knob(k, value)) {
                effects.push(effect(other));
                choices.push(Some((value, &set[..])));
            }
        }
        (effects, choices)
    };
    tune.knobs.iter().enumerate().map(of).unzip()
}

impl Fitted<'_> {
    /// Values of a setting other than the scene's own, in TOML notation, with their effects.
    pub(super) fn effects(&self, knob: usize) -> Vec<(&str, &Effect)> {
        let Some((choices, effects)) = self.choices.get(knob).zip(self.first.settings.get(knob))
        else {
            return Vec::new();
        };
        let pairs = choices.iter().zip(effects);
        pairs
            .filter_map(|(choice, effect)| Some((choice.as_ref()?.1[0].value.as_str(), effect)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::{borrow::Cow, path::Path};

    use swell_files::{
        Reach,
        study::tune::{TuneRequest, Variant},
    };

    use super::{super::measured::TuneMeasurements, *};

    fn tune() -> Tune {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let request = TuneRequest {
            scene: folder.join("dam-break.toml"),
            solver: None,
            limits: vec!["density=1%".parse().expect("a limit")],
            per_frame: None,
            seconds: None,
            frames: None,
            reference: 0.8,
            repeats: 1,
            target: folder.join("tuned.toml"),
            reach: Reach::Folder,
        };
        Tune::load(request).expect("a shot")
    }

    fn trial(role: Role, variant: &Variant, density: f64, seconds: f64) -> Trial<'_> {
        let measured = TuneMeasurements {
            density,
            ..TuneMeasurements::default()
        };
        Trial {
            role,
            why: "",
            variant: Cow::Borrowed(variant),
            run: TuneRun {
                frames: 1,
                seconds: vec![seconds],
                measured,
                ..TuneRun::default()
            },
            predicted: None,
        }
    }

    /// Density errors of d / 10, times of 1e-5 d⁻⁴, and a noise floor of 1e-4. CFL 2 adds twice
    /// that; CFL ½ subtracts half of it, which is within the noise.
    fn trials(tune: &Tune) -> Vec<Trial<'_>> {
        let of = |variant: &Variant| (0.1 * variant.spacing(), 1e-5 * variant.spacing().powi(-4));
        let mut trials: Vec<_> = tune
            .ladder
            .iter()
            .map(|variant| trial(Role::Spacing, variant, of(variant).0, of(variant).1))
            .collect();
        let (density, seconds) = of(&tune.ladder[0]);
        let at =
            |role, variant, added, times| trial(role, variant, density + added, times * seconds);
        trials.push(at(Role::NoiseFloor, &tune.noise_floor, 1e-4, 1.0));
        trials.push(at(Role::Fine, &tune.fine, -1e-3, 4.0));
        let cfl = &tune.knobs[0].others;
        trials.push(at(Role::Knob(0, 0), &cfl[0].1, 2e-4, 0.5));
        trials.push(at(Role::Knob(0, 1), &cfl[1].1, -5e-5, 2.0));
        trials.push(trial(Role::Reference, &tune.reference, 0.0, 9.0));
        trials
    }

    #[test]
    fn laws_and_effects_are_those_that_were_put_in() {
        let tune = tune();
        let mut trials = trials(&tune);
        let fitted = Fitted::of(&tune, &trials).expect("four spacings");
        let [law] = fitted.model.errors[..] else {
            panic!("one limit")
        };
        assert!((law.order - 1.0).abs() < 1e-9 && (law.factor - 0.1).abs() < 1e-9);
        assert!((fitted.model.time.order + 4.0).abs() < 1e-9);
        let effects = fitted.effects(0);
        let [(double, fast), (half, slow)] = effects[..] else {
            panic!("{effects:?}")
        };
        assert_eq!((double, half), ("2", "0.5"));
        assert!((fast.errors[0] - 2e-4).abs() < 1e-12 && (fast.time - 0.5).abs() < 1e-12);
        assert_eq!(slow.errors[0], 0.0, "no more than what gravity does");
        // No run of the other settings reached its end, so they keep the scene's own values.
        assert_eq!(fitted.settings(&[1, 0, 0]), tune.knobs[0].others[0].0);
        assert!(fitted.effects(1).is_empty() && fitted.settings(&[0, 0, 0]).is_empty());
        assert_eq!(fitted.values(Role::Knob(0, 1)), Some(vec![2, 0, 0]));
        assert_eq!(fitted.values(Role::Knob(1, 0)), None);
        // Controls: a lower noise floor reveals the effect, and without a reference nothing is
        // fitted.
        trials[4].run.measured.density -= 9e-5;
        let fitted = Fitted::of(&tune, &trials).expect("four spacings");
        assert!((fitted.effects(0)[1].1.errors[0] + 5e-5).abs() < 1e-12);
        trials.pop();
        assert!(Fitted::of(&tune, &trials).is_none());
    }
}
