//! FLIP as the velocity projection of a solver that moves the particles itself.

use super::{
    super::{SolveError, trace::Run},
    Flip, FrameTotals,
    buffers::*,
};
use crate::params::Counters;
use swell_domain::budget::Breach;
use swell_gpu::{copies::BufferCopy, program::Program};
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
        if n == 0 {
            self.advance_bodies((start, length));
            return Ok(());
        }
        let state = [
            BufferCopy::of(&POSITION, &POSITION, n),
            BufferCopy::of(&VELOCITY, &VELOCITY, n),
            BufferCopy::of(&ID, &ID, n),
        ];
        self.program.copy_from(program, &state);
        let survey = self.survey(run)?;
        totals.substeps += 1;
        if survey.not_finite > 0 {
            let breach = Breach::not_finite(self.frame + 1, survey.not_finite.into(), None);
            return Err(breach.in_substep(totals.substeps).into());
        }
        let substep = projected_substep(start, length, self.state.substep);
        self.run_substep(&survey.is_wet, &substep, totals, run)?;
        let projected = [
            BufferCopy::of(&SORTED_POSITION, &POSITION, n),
            BufferCopy::of(&SORTED_VELOCITY, &VELOCITY, n),
            BufferCopy::of(&sorted_id(n), &ID, n),
            BufferCopy::of(&is_drop(n), &IS_DROP, n),
        ];
        program.copy_from(&self.program, &projected);
        Ok(())
    }
}
