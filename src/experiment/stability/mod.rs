//! Stability studies: runs demanding scenes and checks them against marks (acceptance bounds), and
//! finds how far single settings can go.

mod limit;
mod report;
mod trial;
mod verdict;
mod view;
mod watch;

use swell_files::study::{
    RunsOn,
    stability::{Bound, Held, Stability, Trial},
};
use swell_gpu::adapter::Needs;
use swell_scene::Scene;

use super::{
    PointStatus, StudyError,
    engine::{Bench, StudyKind, WorkUnit, needs_of},
    ledger::Ledger,
    report::Report,
};
use report::StabilityResults;

pub(super) use report::number;

pub use trial::{refusal, run_trial};
pub use verdict::{MarkMeasurement, StabilityRun, Verdict};

impl StudyKind for Stability {
    fn needs(&self) -> Option<Needs> {
        let mut runs = Vec::new();
        for case in &self.cases {
            match &case.held {
                Held::Test(_) => {}
                Held::Runs(trials) => runs.extend(trials.iter().flat_map(scenes)),
                Held::Refusal { attempts, .. } => runs.extend(
                    (attempts.iter()).filter_map(|a| Some((&**a.scene.as_ref().ok()?, a.device))),
                ),
            }
        }
        let of_limits = (!self.limits.is_empty()).then(Needs::default);
        needs_of(runs.into_iter()).or(of_limits)
    }

    fn count(&self) -> usize {
        let of_case = |held: &Held| match held {
            Held::Test(_) => 0,
            Held::Runs(trials) => trials.len(),
            Held::Refusal { attempts, .. } => attempts.len(),
        };
        let cases = self.cases.iter().map(|case| of_case(&case.held));
        let limits = self.limits.iter();
        let limits = limits.map(|limit| limit.searches.len() * limit::most_tries(limit));
        cases.chain(limits).sum()
    }

    /// Trials, then searches for limits, which take many runs each. Expected refusals are only
    /// tried by the whole study.
    fn work_units(&self) -> Option<Vec<WorkUnit>> {
        let trials = |held: &Held| match held {
            Held::Runs(trials) => trials.len(),
            Held::Test(_) | Held::Refusal { .. } => 0,
        };
        let trials: usize = self.cases.iter().map(|case| trials(&case.held)).sum();
        let mut places = vec![WorkUnit::of(0); trials];
        for limit in &self.limits {
            let search = WorkUnit {
                rank: 1,
                points: limit::most_tries(limit),
            };
            places.extend(vec![search; limit.searches.len()]);
        }
        Some(places)
    }

    fn run(&self, bench: &mut Bench<'_>) -> Result<Option<Report>, StudyError> {
        let mut ledger = bench.ledger()?;
        let mut runs = Vec::new();
        for case in &self.cases {
            let title = format!("{} {}", case.number, case.name);
            let mut of_case = Vec::new();
            match &case.held {
                Held::Test(_) => {}
                Held::Runs(trials) => {
                    for trial in trials {
                        if !bench.is_next_ours() {
                            continue;
                        }
                        let method = trial.scene.solver.method().name();
                        let name = format!("{title}, {method}, {}", trial.device.name());
                        if let Some((run, stood)) = point(bench, &mut ledger, &name, trial)? {
                            bench.report_point(name, run.status(trial, stood));
                            of_case.push(run);
                        }
                    }
                }
                Held::Refusal { .. } if bench.is_part() => {}
                Held::Refusal { attempts, .. } => {
                    for attempt in attempts {
                        let (method, device) = (attempt.method.name(), attempt.device.name());
                        // Refusals are quick and not stored: they are tried every time.
                        of_case.push(StabilityRun {
                            ended: refusal(bench.devices, attempt)?,
                            ..StabilityRun::default()
                        });
                        let name = format!("{title}, {method}, {device}");
                        bench.report_point(name, PointStatus::Done(0.0, Vec::new()));
                    }
                }
            }
            runs.push(of_case);
        }
        let mut limits = Vec::new();
        for limit in &self.limits {
            for search in &limit.searches {
                if !bench.is_next_ours() {
                    continue;
                }
                let found = limit::find(bench, &mut ledger, limit, search)?;
                limits.extend(found.map(|found| (limit, search, found)));
            }
        }
        if bench.is_part() {
            return Ok(None);
        }
        bench.joined(&ledger);
        let results = StabilityResults {
            stability: self,
            devices: bench.devices,
            runs,
            limits,
        };
        Ok(Some(results.draw(bench.request)))
    }
}

/// Scenes of a trial with their devices, its own scene first.
fn scenes(trial: &Trial) -> impl Iterator<Item = (&Scene, RunsOn)> {
    let others = trial
        .others
        .iter()
        .map(|other| (&other.scene, other.device));
    [(&trial.scene, trial.device)].into_iter().chain(others)
}

/// Results of a trial and whether they come from a ledger; `None` where a missing one is only
/// looked up.
fn point(
    bench: &Bench<'_>,
    ledger: &mut Ledger<Vec<MarkMeasurement>>,
    name: &str,
    trial: &Trial,
) -> Result<Option<(StabilityRun, bool)>, StudyError> {
    let mut measured = String::new();
    for other in &trial.others {
        measured += &format!("{} {} ", other.scale, other.shift);
    }
    for mark in &trial.marks {
        // The worst of the frames depends on the direction of the bound, not on its value.
        let side = matches!(mark.bound, Bound::AtMost(_));
        let (of, after, since, region) = (mark.of, mark.after, mark.since, &mark.region);
        measured += &format!("{of:?} {side} {after} {since:?} {region:?} ");
    }
    let runs: Vec<_> = scenes(trial).collect();
    let key = bench.devices.key(&runs, trial.frames, &measured);
    let measure = || run_trial(bench.devices, trial, bench.stop);
    bench.point(ledger, name, key, measure)
}
