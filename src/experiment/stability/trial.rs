//! Runs a trial of a case, together with the runs it is compared with.

use std::{sync::atomic::AtomicBool, time::Instant};

use swell_files::study::{
    RunsOn,
    stability::{Attempt, Trial},
};
use swell_stage::{device::SolverError, drive::Drive};

use super::{
    super::{Devices, StudyError, engine::until_done},
    verdict::{MarkMeasurement, StabilityRun},
    view::RunView,
    watch::{Beside, Watch},
};

/// Runs a trial to its last frame, or until its numbers fail.
///
/// # Errors
/// Failures that the numbers did not cause: of the device or a file, or [`StudyError::Stopped`] if
/// `stop` was set before the end.
pub fn run_trial(
    devices: &Devices,
    trial: &Trial,
    stop: &AtomicBool,
) -> Result<StabilityRun, StudyError> {
    let mut run = StabilityRun::default();
    if let Err(error) = go(devices, trial, stop, &mut run) {
        run.ended = Some(error.of_the_point()?);
    }
    Ok(run)
}

fn go(
    devices: &Devices,
    trial: &Trial,
    stop: &AtomicBool,
    run: &mut StabilityRun,
) -> Result<(), StudyError> {
    let mut view = RunView::new(&trial.scene)?;
    let mut own = drive(devices, trial.device, &view)?;
    run.particles = view.state.len();
    let mut drives = Vec::new();
    let mut beside = Vec::new();
    for other in &trial.others {
        let theirs = RunView::new(&other.scene)?;
        drives.push(drive(devices, other.device, &theirs)?);
        beside.push(Beside::new(theirs, other, &view));
    }
    let marks = trial.marks.iter();
    let mut watches: Vec<_> = marks.map(|mark| Watch::new(mark, &view)).collect();
    let mut seconds = 0.0;
    let ended = until_done(&mut own, trial.frames, stop, |step| {
        seconds += step.seconds;
        let report = step.report.clone();
        view.take(step);
        let begin = Instant::now();
        for (drive, other) in drives.iter_mut().zip(&mut beside) {
            other.view.take(drive.advance()?);
        }
        seconds += begin.elapsed().as_secs_f64();
        run.frames += 1;
        for watch in &mut watches {
            watch.look(&view, &beside, &report);
        }
        Ok(())
    });
    run.seconds.push(seconds);
    let measured = watches.iter();
    run.measured = measured
        .map(|watch| MarkMeasurement::new(watch.value(), &watch.curve, watch.mark))
        .collect();
    ended
}

/// Creates a run at its start.
fn drive<'a>(
    devices: &Devices,
    device: RunsOn,
    view: &RunView<'a>,
) -> Result<Drive<'a>, SolverError> {
    let drive = Drive::new(devices.of(device), view.scene, &view.start, false)?;
    Ok(drive.with_pressures())
}

/// Number of frames within which a scene that loads must be refused.
const FIRST_FRAMES: u32 = 2;

/// Returns the message with which a scene is refused; `None` where it is accepted.
///
/// # Errors
/// Failures that the scene did not cause: of the device or a file.
pub fn refusal(devices: &Devices, attempt: &Attempt) -> Result<Option<String>, StudyError> {
    let scene = match &attempt.scene {
        Err(message) => return Ok(Some(message.clone())),
        Ok(scene) => scene,
    };
    let begun = || {
        let view = RunView::new(scene)?;
        let mut drive = drive(devices, attempt.device, &view)?;
        let mut frames = (0..FIRST_FRAMES).map(|_| drive.advance());
        Ok::<_, StudyError>(frames.try_for_each(|step| step.map(|_| ()))?)
    };
    match begun() {
        Ok(()) => Ok(None),
        Err(error) => error.of_the_point().map(Some),
    }
}
