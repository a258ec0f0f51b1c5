//! How long frames of a scene take: its first ones, computed and not kept.

use swell_domain::{signed_distance::SignedDistanceError, statistics::median};
use swell_gpu::adapter::GpuError;
use swell_scene::Scene;

pub use swell_solve::plan::Share;

use super::{
    Blame,
    device::{Gpu, Identity, Opened, SolverError, needs},
    drive::Drive,
    prepare::Start,
};

/// What frames took.
#[derive(Clone, Debug)]
pub struct Timed {
    /// What they ran on.
    pub device: Identity,
    /// How many; one more ran before them.
    pub frames: u32,
    /// Wall clock of one, seconds: the least, the median, the greatest.
    pub seconds: [f64; 3],
    /// Of each, on the mean.
    pub substeps: f64,
    /// By what passes are there for, of the same frames computed once more with each pass timed: passes then run one by one.
    pub shares: Vec<Share>,
}

/// Why frames could not be timed.
#[derive(Debug, thiserror::Error)]
pub enum TimeError {
    /// The scene's solids.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// The adapter.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The frames.
    #[error(transparent)]
    Solve(#[from] SolverError),
}

impl From<&TimeError> for Blame {
    fn from(error: &TimeError) -> Self {
        match error {
            TimeError::Solid(error) => error.into(),
            TimeError::Gpu(error) => error.into(),
            TimeError::Solve(error) => error.into(),
        }
    }
}

/// Computes so many frames of a scene after its first, which warms the device up, and keeps nothing.
///
/// # Errors
/// [`TimeError`]; of frames that break a budget that as well.
pub fn time(scene: &Scene, adapter: Option<&str>, frames: u32) -> Result<Timed, TimeError> {
    let start = Start::of(scene)?;
    let gpu = Gpu::from(adapter.map(str::to_owned));
    let opened = Opened::Gpu(Box::new(gpu.open(needs(scene))?));
    let (mut seconds, mut substeps) = (Vec::new(), 0);
    let mut drive = Drive::new(&opened, scene, &start, false)?;
    drive.advance()?;
    for _ in 0..frames {
        let step = drive.advance()?;
        seconds.push(step.seconds);
        substeps += step.report.substeps;
    }
    drop(drive);
    let mut drive = Drive::new(&opened, scene, &start, true)?;
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
