//! What the substeps of a frame add up to.

use crate::pressure;
use swell_domain::solver::Projection;

/// What a frame's substeps did, added up.
#[derive(Default)]
pub(crate) struct FrameTotals {
    pub(super) substeps: u32,
    pub(super) iterations: u64,
    pub(crate) projection: Projection,
    /// Joule.
    pub(crate) work: f64,
    /// Of the frame, seconds.
    pub(super) elapsed: f64,
}

impl FrameTotals {
    pub(super) fn add(&mut self, projected: &pressure::Projected) {
        let solved = &projected.solved;
        self.iterations += u64::from(solved.iterations);
        let all = &mut self.projection;
        all.residual = all.residual.max(solved.residual);
        all.divergence_before = all.divergence_before.max(projected.divergence_before);
        all.divergence_after = all.divergence_after.max(projected.divergence_after);
        all.missed += u32::from(solved.is_missed);
        all.pockets = all.pockets.max(projected.pockets);
        all.incompatible = all.incompatible.max(projected.incompatible);
        all.dropped += u64::from(projected.dropped);
    }
}
