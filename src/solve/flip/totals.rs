//! Sums over the substeps of a frame.

use crate::pressure;
use swell_domain::solver::Projection;

/// Sums and maxima over the substeps of a frame.
#[derive(Default)]
pub(crate) struct FrameTotals {
    pub(super) substeps: u32,
    pub(super) iterations: u64,
    pub(crate) projection: Projection,
    /// Work by moving walls and solids on the water, joules.
    pub(crate) work: f64,
    /// Time of the frame that has passed, seconds.
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
