//! Finds the cheapest settings of a shot that keep errors within limits: runs variants of the scene
//! (variants), fits models of error and time, runs what these propose, and writes the cheapest run
//! within the limits as a scene.

mod measured;
mod model;
mod report;
mod words;
mod write;

use std::borrow::Cow;

use swell_files::{
    physics_hash,
    study::{
        RunsOn,
        tune::{Bound, Knob, Limit, Setting, Tune, Variant},
    },
};
use swell_gpu::adapter::Needs;
use swell_stage::{gauge, prepare::Start};
use swell_study::{
    measure::Gauge,
    tune::{Candidate, Choice, Limits, Proposal, choose},
};

use super::{
    PointStatus, StudyError,
    engine::{Bench, StudyKind, WorkUnit, needs_of},
    ledger::Ledger,
    report::Report,
};
use measured::{TuneMeasurements, TuneRun, measure, repeats};
use model::Fitted;

/// Largest number of proposals to run; each one corrects the models by the result of the previous
/// one.
const PROPOSALS: usize = 4;

/// A proposal is run only if its predicted time is below this fraction of the cheapest time so far.
const CHEAPER: f64 = 0.95;

/// Purpose of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// The scene's own settings at another spacing.
    Spacing,
    /// Noise-floor run: the same settings with a millionth more gravity.
    NoiseFloor,
    /// The coarsest spacing with the reference's other settings.
    Fine,
    /// Index of a setting, and index of a value among its alternatives.
    Knob(usize, usize),
    /// The reference with which the others are compared.
    Reference,
    /// Settings that the models proposed.
    Proposal,
}

impl Role {
    /// Whether its settings may be chosen.
    fn is_candidate(self) -> bool {
        !matches!(self, Self::NoiseFloor | Self::Reference)
    }
}

/// A run with its purpose.
struct Trial<'a> {
    role: Role,
    why: &'static str,
    variant: Cow<'a, Variant>,
    run: TuneRun,
    /// Prediction of the models, where it was made before the run.
    predicted: Option<Proposal>,
}

/// Results of all runs.
struct TuneResults<'a> {
    tune: &'a Tune,
    trials: Vec<Trial<'a>>,
    /// Models fitted to the runs; `None` where too few runs reached their end.
    fitted: Option<Fitted<'a>>,
    /// Limits in the quantities' own units.
    limits: Limits,
    /// Edge of the cubes in which crests and fronts are measured, metres.
    resolution: f64,
    /// Index of the chosen trial, and whether it meets the limits.
    choice: Option<(usize, bool)>,
}

impl StudyKind for Tune {
    fn needs(&self) -> Option<Needs> {
        needs_of(
            self.variants()
                .map(|(_, variant)| (&variant.scene, RunsOn::Gpu)),
        )
    }

    fn count(&self) -> usize {
        self.variants().count()
    }

    /// Runs that are known in advance, the coarsest first; proposals are only run by the whole
    /// study.
    fn work_units(&self) -> Option<Vec<WorkUnit>> {
        Some((0..self.variants().count()).map(WorkUnit::of).collect())
    }

    fn run(&self, bench: &mut Bench<'_>) -> Result<Option<Report>, StudyError> {
        write::check_target(self)?;
        let mut lab = Lab {
            tune: self,
            gauge: gauge_of(self)?,
            ledger: bench.ledger()?,
        };
        let trials = lab.known(bench)?;
        if bench.is_part() {
            return Ok(None);
        }
        let limits = limits(self, reference(&trials)?)?;
        let mut results = TuneResults {
            tune: self,
            fitted: Fitted::of(self, &trials),
            trials,
            limits,
            resolution: lab.gauge.resolution(),
            choice: None,
        };
        lab.propose(bench, &mut results)?;
        bench.joined(&lab.ledger);
        results.choose();
        let written = write::write(&results, &bench.request.command)?;
        Ok(Some(report::draw(&results, bench, written)))
    }
}

/// Measurements of the reference run.
fn reference<'t>(trials: &'t [Trial<'_>]) -> Result<&'t TuneMeasurements, StudyError> {
    let mut found = trials.iter().filter(|t| t.role == Role::Reference);
    match found.next() {
        Some(Trial {
            run:
                TuneRun {
                    ended: None,
                    measured,
                    ..
                },
            ..
        }) => Ok(measured),
        Some(Trial { variant, run, .. }) => Err(StudyError::Point(format!(
            "the run that the others are compared with ({}) fails: {}; a greater reference factor \
             is a coarser one",
            variant.name(),
            run.ended.as_deref().unwrap_or_default()
        ))),
        None => Err(StudyError::Stopped),
    }
}

/// Limits in the quantities' own units.
fn limits(tune: &Tune, reference: &TuneMeasurements) -> Result<Limits, StudyError> {
    let of = |limit: &Limit| match limit.bound {
        Bound::Absolute(value) => Ok(value),
        Bound::Part(part) => reference
            .whole(limit.quantity)
            .filter(|whole| *whole > 0.0)
            .map(|whole| part * whole)
            .ok_or_else(|| untold(limit.quantity.name())),
    };
    Ok(Limits {
        errors: tune
            .request
            .limits
            .iter()
            .map(of)
            .collect::<Result<_, _>>()?,
        seconds: tune.most_seconds(),
    })
}

fn untold(name: &str) -> StudyError {
    StudyError::Point(format!(
        "error {name}: none of the frames that are measured has one"
    ))
}

/// Gauge for all runs; its cubes are those of the coarsest lattice.
fn gauge_of(tune: &Tune) -> Result<Gauge, StudyError> {
    let scene = &tune.reference.scene;
    let spacings = tune
        .variants()
        .map(|(_, variant)| variant.scene.particle_spacing());
    let coarsest = spacings.fold(0.0, f64::max);
    let start = Start::of(scene)?.particles.position;
    let spacing = scene.particle_spacing();
    Ok(gauge::gauge(scene, coarsest, &start, spacing))
}

/// State shared by all runs.
struct Lab<'a> {
    tune: &'a Tune,
    gauge: Gauge,
    ledger: Ledger<TuneMeasurements>,
}

impl<'a> Lab<'a> {
    /// Runs everything that is known in advance. The coarsest run comes first, because a quantity
    /// that it does not have is missing from all runs.
    fn known(&mut self, bench: &mut Bench<'_>) -> Result<Vec<Trial<'a>>, StudyError> {
        let tune = self.tune;
        let mut roles = vec![Role::Spacing; tune.ladder.len()];
        roles.extend([Role::NoiseFloor, Role::Fine]);
        for (k, knob) in tune.knobs.iter().enumerate() {
            roles.extend((0..knob.others.len()).map(|value| Role::Knob(k, value)));
        }
        roles.push(Role::Reference);
        let mut trials = Vec::new();
        for (role, (why, variant)) in roles.into_iter().zip(tune.variants()) {
            if !bench.is_next_ours() {
                continue;
            }
            let Some(run) = self.run(bench, why, variant)? else {
                continue;
            };
            if let (true, None) = (trials.is_empty(), &run.ended) {
                self.check_told(&run.measured)?;
            }
            trials.push(Trial {
                role,
                why,
                variant: Cow::Borrowed(variant),
                run,
                predicted: None,
            });
        }
        Ok(trials)
    }

    fn check_told(&self, coarsest: &TuneMeasurements) -> Result<(), StudyError> {
        for limit in &self.tune.request.limits {
            if coarsest.whole(limit.quantity).is_none() {
                return Err(untold(limit.quantity.name()));
            }
        }
        Ok(())
    }

    /// Returns `None` for a missing run that is only looked up.
    fn run(
        &mut self,
        bench: &mut Bench<'_>,
        why: &str,
        variant: &Variant,
    ) -> Result<Option<TuneRun>, StudyError> {
        let tune = self.tune;
        let measured = format!(
            "tune {} {:?} {:?}",
            repeats(tune, variant),
            self.gauge,
            tune.has_pressure().then(|| variant.scene.pressure_points()),
        );
        let runs = [(&variant.scene, RunsOn::Gpu)];
        let key = bench.devices.key(&runs, tune.frames, &measured);
        let name = format!("{why}: {}", variant.name());
        let gauge = &self.gauge;
        let measure = || measure(bench, tune, variant, gauge);
        let Some((run, stood)) = bench.point(&mut self.ledger, &name, key, measure)? else {
            return Ok(None);
        };
        let status = match &run.ended {
            _ if stood => PointStatus::Stands,
            Some(message) => PointStatus::Failed(message.clone()),
            None => PointStatus::Done(1e3 * run.per_frame()[1], Vec::new()),
        };
        bench.report_point(name, status);
        Ok(Some(run))
    }

    /// Runs the settings with the least predicted time, as long as that is below the time of any
    /// run within the limits.
    fn propose(
        &mut self,
        bench: &mut Bench<'_>,
        results: &mut TuneResults<'a>,
    ) -> Result<(), StudyError> {
        for _ in 0..PROPOSALS {
            let Some(proposal) = results.proposal() else {
                break;
            };
            let Some(fitted) = &results.fitted else {
                break;
            };
            let settings = fitted.settings(&proposal.values);
            let variant = self.tune.variant(proposal.spacing, &settings)?;
            let hash = physics_hash(&variant.scene);
            let mut known = results.trials.iter();
            if known.any(|trial| physics_hash(&trial.variant.scene) == hash) {
                break;
            }
            bench.count += 1;
            if let Some(run) = self.run(bench, "proposal", &variant)? {
                results.take(variant, run, proposal);
            }
        }
        Ok(())
    }
}

impl<'a> TuneResults<'a> {
    /// Measurements of the reference run, which exist for all results.
    fn reference(&self) -> &TuneMeasurements {
        let mut all = self.trials.iter().filter(|t| t.role == Role::Reference);
        let found = all.next().map(|trial| &trial.run.measured);
        found.expect("a run that the others are held against")
    }

    /// Errors of a run in the order of the limits; `None` where it did not reach its end.
    fn errors(&self, run: &TuneRun) -> Vec<Option<f64>> {
        let reference = self.reference();
        let limits = self.tune.request.limits.iter();
        let off = limits.map(|limit| run.measured.off(limit.quantity, reference));
        off.map(|off| off.filter(|_| run.ended.is_none())).collect()
    }

    fn candidate(&self, trial: &Trial<'_>) -> Candidate {
        Candidate {
            seconds: trial.run.per_frame()[1],
            errors: self.errors(&trial.run),
        }
    }

    /// Trials that may be chosen, with their indices.
    fn candidates(&self) -> Vec<(usize, Candidate)> {
        let trials = self.trials.iter().enumerate();
        let may = trials.filter(|(_, t)| t.role.is_candidate() && t.run.ended.is_none());
        may.map(|(k, trial)| (k, self.candidate(trial))).collect()
    }

    fn choose(&mut self) {
        let (places, runs): (Vec<_>, Vec<_>) = self.candidates().into_iter().unzip();
        self.choice = choose(&runs, &self.limits).map(|choice| match choice {
            Choice::Holds(k) => (places[k], true),
            Choice::Nearest(k) => (places[k], false),
        });
    }

    /// Settings with the least predicted time, where these are worth a run.
    fn proposal(&self) -> Option<Proposal> {
        let proposal = self.fitted.as_ref()?.model.propose(&self.limits)?;
        let runs = self.candidates().into_iter().map(|(_, run)| run);
        let holding = runs.filter(|run| run.excess(&self.limits) <= 1.0);
        let cheapest = holding.map(|run| run.seconds).reduce(f64::min);
        let is_worth = cheapest.is_none_or(|least| proposal.seconds < CHEAPER * least);
        is_worth.then_some(proposal)
    }

    /// Adds the run of a proposal and corrects the models by it.
    fn take(&mut self, variant: Variant, run: TuneRun, predicted: Proposal) {
        let errors = self.errors(&run);
        if let Some(fitted) = &mut self.fitted {
            fitted.correct(&errors, run.per_frame()[1], &predicted);
        }
        self.trials.push(Trial {
            role: Role::Proposal,
            why: "proposal",
            variant: Cow::Owned(variant),
            run,
            predicted: Some(predicted),
        });
    }

    /// Prediction of the models for a trial: as made before the run, or from the initial fit.
    fn predicted(&self, trial: &Trial<'_>) -> Option<Proposal> {
        if let Some(predicted) = &trial.predicted {
            return Some(predicted.clone());
        }
        let fitted = self.fitted.as_ref()?;
        let values = fitted.values(trial.role)?;
        Some(fitted.first.predict(trial.variant.spacing(), &values))
    }

    /// Settings of a trial, each with the scene's own value, in the order of the page.
    fn settings(&self, trial: &Trial<'_>) -> Vec<(Setting, String)> {
        let tune = self.tune;
        let own_spacing = tune.own_spacing();
        let first = trial.variant.set[0].clone();
        let of = |knob: &Knob| {
            let mut set = trial.variant.set.iter();
            let found = set.find(|setting| setting.key == knob.key).cloned();
            let own = Setting {
                key: knob.key,
                value: knob.own.clone(),
            };
            (found.unwrap_or(own), knob.own.clone())
        };
        let knobs = tune.knobs.iter().map(of);
        [(first, own_spacing)].into_iter().chain(knobs).collect()
    }
}
