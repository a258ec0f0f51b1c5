//! Measures how long a scene's frames take, by computing its first ones without keeping them.

use swell_domain::statistics::median;
use swell_gpu::adapter::GpuError;

pub use swell_solve::plan::Share;

use super::{
    Blame,
    bake::BakePlan,
    device::{Gpu, Identity, Opened, SolverError, needs},
    drive::Drive,
};

/// Measured times of frames.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Timed {
    /// Device that they ran on.
    pub device: Identity,
    /// Number of measured frames; one more ran before them as a warm-up.
    pub frames: u32,
    /// Wall-clock seconds of a frame: minimum, median, maximum.
    pub seconds: [f64; 3],
    /// Mean number of substeps per frame.
    pub substeps: f64,
    /// Shares by purpose, from a second run of the same frames with each pass timed, which runs
    /// passes one by one.
    pub shares: Vec<Share>,
}

/// Why frames could not be timed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TimeError {
    /// The adapter cannot be opened or does not suffice.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A frame could not be computed.
    #[error(transparent)]
    Solve(#[from] SolverError),
}

impl From<&TimeError> for Blame {
    fn from(error: &TimeError) -> Self {
        match error {
            TimeError::Gpu(error) => error.into(),
            TimeError::Solve(error) => error.into(),
        }
    }
}

/// Computes `frames` frames of a plan after its first, which warms up the device, and keeps
/// nothing.
///
/// # Errors
/// [`TimeError`], also for frames with invalid numbers.
pub fn time(plan: &BakePlan<'_>, gpu: &Gpu, frames: u32) -> Result<Timed, TimeError> {
    let (scene, start) = (plan.scene, &plan.start);
    let opened = Opened::Gpu(Box::new(gpu.open(needs(scene))?));
    let (mut seconds, mut substeps) = (Vec::new(), 0);
    let mut drive = Drive::new(&opened, scene, start, false)?;
    drive.advance()?;
    for _ in 0..frames {
        let step = drive.advance()?;
        seconds.push(step.seconds);
        substeps += step.report.substeps;
    }
    drop(drive);
    let mut drive = Drive::new(&opened, scene, start, true)?;
    drive.advance()?;
    let before = drive.shares();
    for _ in 0..frames {
        drive.advance()?;
    }
    let mut shares = drive.shares();
    for (share, before) in shares.iter_mut().zip(&before) {
        share.seconds -= before.seconds;
    }
    let least = seconds.iter().copied().fold(f64::INFINITY, f64::min);
    let most = seconds.iter().copied().fold(0.0, f64::max);
    Ok(Timed {
        device: opened.identity(),
        frames,
        seconds: [least, median(seconds).unwrap_or(0.0), most],
        substeps: f64::from(substeps) / f64::from(frames.max(1)),
        shares,
    })
}
