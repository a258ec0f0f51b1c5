//! Scenes that are hard on a solver: each run, measured against its marks, and how far single settings go.
//!
//! Each run is one line of `results.jsonl`, written when it is done; one whose line stands there is not run again.

mod limit;
mod record;
mod report;
mod run;
mod runner;
mod watch;

use std::sync::atomic::AtomicBool;

use crate::{
    gpu::adapter::Context,
    scene::{
        Method, Scene, physics_hash,
        study::stability::{CaseDevice, Held, Stability, Trial},
    },
};

use super::{
    super::device::Opened, Event, Outcome, PointEvent, PointStatus, Request, StudyError,
    ledger::Ledger,
};

pub use record::{Measured, Record, Run, Verdict};
pub use run::{Devices, refusal, run_trial};

/// Changes whenever what a line holds does.
const FORM: &str = "swell stability 2";

/// What a study has come to.
struct Results<'a> {
    stability: &'a Stability,
    devices: &'a Devices,
    /// Of each case, one a trial or attempt.
    cases: Vec<Vec<Record>>,
    /// Of each limit, one a search.
    limits: Vec<Vec<limit::Found>>,
}

/// Runs things and remembers them.
struct Bench<'a> {
    devices: &'a Devices,
    ledger: Ledger<Record>,
    stop: &'a AtomicBool,
    number: usize,
    count: usize,
    tell: &'a mut dyn FnMut(Event),
}

/// Runs it; what stands in the directory is not run again.
pub(super) fn run(
    request: &Request,
    stability: &Stability,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome, StudyError> {
    let devices = Devices {
        gpu: if needs_gpu(stability) {
            let context = Context::open(request.adapter.as_deref())?;
            Some(Opened::Gpu(Box::new(context)))
        } else {
            None
        },
        cpu: Opened::Cpu,
    };
    let of_case = |held: &Held| match held {
        Held::Test(_) => 0,
        Held::Runs(trials) => trials.len(),
        Held::Refusal { attempts, .. } => attempts.len(),
    };
    let cases: usize = stability.cases.iter().map(|case| of_case(&case.held)).sum();
    let limits = stability.limits.iter().map(|limit| limit.searches.len());
    let mut bench = Bench {
        devices: &devices,
        ledger: Ledger::open(&request.directory)?,
        stop,
        number: 0,
        count: cases + limits.sum::<usize>(),
        tell,
    };
    let mut results = Results {
        stability,
        devices: &devices,
        cases: Vec::new(),
        limits: Vec::new(),
    };
    for case in &stability.cases {
        let title = format!("{} {}", case.number, case.name);
        let Some(records) = bench.case(&title, &case.held)? else {
            return Ok(Outcome::default());
        };
        results.cases.push(records);
    }
    for limit in &stability.limits {
        let mut found = Vec::new();
        for search in &limit.searches {
            let Some(one) = bench.search(limit, search)? else {
                return Ok(Outcome::default());
            };
            found.push(one);
        }
        results.limits.push(found);
    }
    report::write_all(request, &results)
}

fn needs_gpu(stability: &Stability) -> bool {
    let is_gpu = |device: CaseDevice| device == CaseDevice::Gpu;
    let on_gpu = |held: &Held| match held {
        Held::Test(_) => false,
        Held::Runs(trials) => trials.iter().any(|trial| {
            is_gpu(trial.device) || trial.others.iter().any(|other| is_gpu(other.device))
        }),
        Held::Refusal { attempts, .. } => attempts.iter().any(|attempt| is_gpu(attempt.device)),
    };
    !stability.limits.is_empty() || stability.cases.iter().any(|case| on_gpu(&case.held))
}

impl Bench<'_> {
    /// A case's lines; `None` where `stop` came before.
    fn case(&mut self, title: &str, held: &Held) -> Result<Option<Vec<Record>>, StudyError> {
        let mut records = Vec::new();
        match held {
            Held::Test(_) => {}
            Held::Runs(trials) => {
                for trial in trials {
                    let method = trial.scene.solver.method;
                    let name = format!("{title}, {}, {}", method.name(), trial.device.name());
                    let Some((record, stood)) = self.trial(&name, trial)? else {
                        return Ok(None);
                    };
                    self.told(name, status(&record, trial, stood));
                    records.push(record);
                }
            }
            Held::Refusal { attempts, .. } => {
                for attempt in attempts {
                    // Quick, and no line: it is tried every time.
                    let ended = refusal(self.devices, attempt)?;
                    let device = attempt.device.name();
                    let name = format!("{title}, {}, {device}", attempt.method.name());
                    self.told(name.clone(), PointStatus::Done(0.0, Vec::new()));
                    let run = Run {
                        ended,
                        ..Run::default()
                    };
                    let hash = String::new();
                    records.push(Record { hash, name, run });
                }
            }
        }
        Ok(Some(records))
    }

    /// A trial's line and whether it stood there; `None` where `stop` came before it was done.
    fn trial(&mut self, name: &str, trial: &Trial) -> Result<Option<(Record, bool)>, StudyError> {
        let hash = hash(self.devices, trial);
        if let Some(record) = self.ledger.find(&hash) {
            return Ok(Some((record.clone(), true)));
        }
        let Some(run) = run_trial(self.devices, trial, self.stop)? else {
            return Ok(None);
        };
        let name = name.to_owned();
        let record = Record { hash, name, run };
        self.ledger.append(&record)?;
        Ok(Some((record, false)))
    }

    fn told(&mut self, name: String, status: PointStatus) {
        self.number += 1;
        (self.tell)(Event::Point(PointEvent {
            number: self.number,
            count: self.count,
            name,
            status,
        }));
    }
}

fn status(record: &Record, trial: &Trial, stood: bool) -> PointStatus {
    let run = &record.run;
    let missed: Vec<_> = (trial
        .marks
        .iter()
        .zip(run.verdicts(trial))
        .zip(&run.measured))
    .filter(|((_, verdict), _)| *verdict == Verdict::Misses)
    .map(|((mark, _), measured)| {
        let value = measured.value.map_or("none".into(), report::number);
        format!("{} is {value}", mark.of.name())
    })
    .collect();
    match &run.ended {
        Some(message) => PointStatus::Failed(message.clone()),
        None if !missed.is_empty() => PointStatus::Failed(missed.join(", ")),
        None if stood => PointStatus::Stands,
        None => PointStatus::Done(1e3 * run.seconds / f64::from(run.frames.max(1)), Vec::new()),
    }
}

/// Of all that a line depends on: physics and when to give up of each run, frames, what is measured, devices, program.
fn hash(devices: &Devices, trial: &Trial) -> String {
    let of_scene = |scene: &Scene, device: CaseDevice| {
        let limits = match scene.solver.method {
            Method::Pbf => scene.solver.pbf().max_substeps.to_string(),
            Method::Flip => scene.solver.flip().max_substeps.to_string(),
        };
        let identity = match device {
            CaseDevice::Cpu => devices.cpu.identity().to_string(),
            CaseDevice::Gpu => devices
                .gpu
                .as_ref()
                .map_or(String::new(), |gpu| gpu.identity().to_string()),
        };
        let probes = format!("{:?}", scene.probes);
        [physics_hash(scene), limits, probes, identity].join(" ")
    };
    let mut text = vec![
        FORM.to_owned(),
        env!("CARGO_PKG_VERSION").to_owned(),
        trial.frames.to_string(),
        of_scene(&trial.scene, trial.device),
    ];
    for other in &trial.others {
        text.push(of_scene(&other.scene, other.device));
        text.push(format!("{} {}", other.scale, other.shift));
    }
    for mark in &trial.marks {
        // The worst of the frames depends on the side that the mark is on, not on where it is.
        let side = matches!(mark.bound, crate::scene::study::stability::Bound::AtMost(_));
        text.push(format!(
            "{:?} {side} {} {:?} {:?}",
            mark.of, mark.after, mark.since, mark.region
        ));
    }
    blake3::hash(text.join("\n").as_bytes())
        .to_hex()
        .to_string()
}
