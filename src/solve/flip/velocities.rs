//! FLIP as the velocity projection of a solver that moves the particles itself.

use super::{
    super::{SolveError, trace::Run},
    Flip, FrameTotals,
    buffers::*,
};
use crate::params::Counters;
use swell_domain::budget::Breach;
use swell_gpu::program::Program;
use swell_scene::step::projected_substep;

impl Flip {
    /// Resets the counters for the frame after `frame`.
    pub(crate) fn begin_frame(&mut self, frame: u32) {
        self.frame = frame;
        self.program.upload(COUNTERS, 0, &[Counters::default()]);
    }

    /// Copies positions, velocities and ids, in storage order, from `program`; projects the
    /// velocities over the `length` seconds from `start` on; and copies particles back in sorted
    /// order, with the flags of droplets.
    ///
    /// # Errors Returns an error if the device fails, a value is not finite, or a projection
    /// exceeds its budget.
    pub(crate) fn project_velocities(
        &mut self,
        program: &Program,
        (start, length): (f64, f64),
        totals: &mut FrameTotals,
        run: &mut Run<'_>,
    ) -> Result<(), SolveError> {
        let n = self.state.len();
        let own = &self.program;
        own.copy(&POSITION, program, &POSITION, n);
        own.copy(&VELOCITY, program, &VELOCITY, n);
        own.copy(&ID, program, &ID, n);
        let survey = self.survey(run)?;
        totals.substeps += 1;
        if survey.not_finite > 0 {
            let breach = Breach::not_finite(self.frame + 1, survey.not_finite.into(), None);
            return Err(breach.in_substep(totals.substeps).into());
        }
        let substep = projected_substep(start, length, self.state.substep);
        self.run_substep(&survey.is_wet, &substep, totals, run)?;
        let own = &self.program;
        program.copy(&POSITION, own, &SORTED_POSITION, n);
        program.copy(&VELOCITY, own, &SORTED_VELOCITY, n);
        program.copy(&ID, own, &sorted_id(n), n);
        program.copy(&IS_DROP, own, &is_drop(n), n);
        Ok(())
    }
}
