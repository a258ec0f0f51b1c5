//! Runs a case's trial, with what it is held against beside it.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use crate::{
    scene::study::stability::{Attempt, CaseDevice, Trial},
    stage::Blame,
};

use super::{
    super::{super::device::Opened, StudyError},
    record::{Measured, Run},
    runner::Runner,
    watch::{Beside, Watch},
};

/// What cases run on.
pub struct Devices {
    /// The study's adapter; `None` where nothing runs there.
    pub gpu: Option<Opened>,
    /// The f64 reference.
    pub cpu: Opened,
}

impl Devices {
    /// # Panics
    /// Where a case is on the GPU and none was opened.
    fn of(&self, device: CaseDevice) -> &Opened {
        match device {
            CaseDevice::Cpu => &self.cpu,
            CaseDevice::Gpu => self.gpu.as_ref().expect("a device that was asked for"),
        }
    }
}

/// Runs a trial to its last frame, or to where its numbers fail. `None` where `stop` ended it before.
///
/// # Errors
/// What is no fault of the numbers: the device, a file.
pub fn run_trial(
    devices: &Devices,
    trial: &Trial,
    stop: &AtomicBool,
) -> Result<Option<Run>, StudyError> {
    let mut run = Run::default();
    match go(devices, trial, stop, &mut run) {
        Ok(true) => Ok(Some(run)),
        Ok(false) => Ok(None),
        Err(error) => {
            run.ended = Some(fault_of_numbers(error)?);
            Ok(Some(run))
        }
    }
}

/// The words of an error that a scene is to blame for.
fn fault_of_numbers(error: StudyError) -> Result<String, StudyError> {
    match Blame::from(&error) {
        Blame::Numbers | Blame::Input => Ok(error.to_string()),
        Blame::Device | Blame::Files => Err(error),
    }
}

/// Whether it came to its end.
fn go(
    devices: &Devices,
    trial: &Trial,
    stop: &AtomicBool,
    run: &mut Run,
) -> Result<bool, StudyError> {
    let mut runner = Runner::new(devices.of(trial.device), &trial.scene)?;
    run.particles = runner.state.len();
    let mut beside = Vec::new();
    for other in &trial.others {
        let theirs = Runner::new(devices.of(other.device), &other.scene)?;
        beside.push(Beside::new(theirs, other, &runner));
    }
    let marks = trial.marks.iter();
    let mut watches: Vec<_> = marks.map(|mark| Watch::new(mark, &runner)).collect();
    let mut finished = Ok(true);
    for _ in 0..trial.frames {
        if stop.load(Ordering::Relaxed) {
            return Ok(false);
        }
        let begin = Instant::now();
        let others = beside.iter_mut().map(|other| &mut other.runner);
        let advanced: Result<(), StudyError> = [&mut runner]
            .into_iter()
            .chain(others)
            .try_for_each(Runner::advance);
        run.seconds += begin.elapsed().as_secs_f64();
        if let Err(error) = advanced {
            finished = Err(error);
            break;
        }
        run.frames += 1;
        let report = runner.report.clone();
        for watch in &mut watches {
            if let Some(report) = &report {
                watch.look(&runner, &beside, report);
            }
        }
    }
    let measured = watches.iter();
    run.measured = measured
        .map(|watch| Measured::new(watch.value(), &watch.curve, watch.mark))
        .collect();
    finished
}

/// Frames within which a scene that is to be refused is refused, where it loads.
const FIRST_FRAMES: u32 = 2;

/// In whose words a scene is refused; `None` where it is not.
///
/// # Errors
/// What is no fault of the scene: the device, a file.
pub fn refusal(devices: &Devices, attempt: &Attempt) -> Result<Option<String>, StudyError> {
    let scene = match &attempt.scene {
        Err(message) => return Ok(Some(message.clone())),
        Ok(scene) => scene,
    };
    let begun = || {
        let mut runner = Runner::new(devices.of(attempt.device), scene)?;
        (0..FIRST_FRAMES).try_for_each(|_| runner.advance())
    };
    match begun() {
        Ok(()) => Ok(None),
        Err(error) => fault_of_numbers(error).map(Some),
    }
}
