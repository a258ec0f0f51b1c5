//! What probes see of a substep.

use glam::DVec3;

use super::{
    super::{SolveError, pressure, state::look, trace::Run},
    CELL_KIND, Flip, FrameTotals,
};
use crate::domain::{
    gauge::Gauge,
    solver::{Seen, Span, Wanted, Watch},
};

impl Flip {
    /// Substeps through one frame.
    pub(super) fn run_substeps(
        &mut self,
        watch: &mut dyn Watch,
        run: &mut Run<'_>,
    ) -> Result<FrameTotals, SolveError> {
        let begin = f64::from(self.frame) * self.scene.shot.frame_seconds();
        let mut totals = FrameTotals::default();
        loop {
            let start = begin + totals.elapsed;
            let is_last = self.go_on(&mut totals, run)?;
            let substep = Span {
                start,
                end: begin + totals.elapsed,
                is_last,
            };
            let wanted = watch.wants(substep);
            if wanted.is_any() {
                watch.look(substep, self.seen(wanted)?);
            }
            if is_last {
                return Ok(totals);
            }
        }
    }

    fn seen(&self, wanted: Wanted) -> Result<Seen, SolveError> {
        let mut seen = Seen::default();
        if wanted.particles {
            seen.particles = look(&self.program, &self.scene, &self.state, self.frame + 1)?;
        }
        if wanted.pressures {
            seen.pressures = self.pressures_at(&self.scene.pressure_points())?;
        }
        Ok(seen)
    }

    /// The projection's, between cell centres.
    pub(super) fn pressures_at(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, SolveError> {
        let kind: Vec<u32> = self.field(CELL_KIND, self.elements())?;
        let pressure: Vec<f32> = self.field(pressure::buffers::PRESSURE, self.elements())?;
        let pressure: Vec<f64> = pressure.into_iter().map(f64::from).collect();
        let gauge = Gauge {
            bricks: &self.bricks,
            cells: self.plan.grid_dims,
            cell_size: self.scene.solver.flip().cell_size,
            kind: &kind,
            pressure: &pressure,
        };
        let local = |at: &DVec3| *at - self.scene.domain.min;
        Ok(points.iter().map(|at| gauge.at(local(at))).collect())
    }
}
