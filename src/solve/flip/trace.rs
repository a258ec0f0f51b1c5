//! Frames of FLIP that run dispatch by dispatch.

use super::{
    super::{
        SolveError,
        params::Counters,
        trace::{Begun, Observe, Run, Span, TraceFrame, trace},
    },
    Flip, FrameTotals,
    buffers::COUNTERS,
};
use swell_domain::substep::SubstepChoice;
use swell_gpu::recording::Recording;

impl TraceFrame for Flip {
    fn trace_frame(&mut self, span: Span, observe: &mut Observe<'_>) -> Result<u32, SolveError> {
        let plain: &mut Run<'_> =
            &mut |program, recordings| Ok(Recording::run_all(recordings, program, None)?);
        self.program.upload(COUNTERS, 0, &[Counters::default()]);
        let mut totals = FrameTotals::default();
        loop {
            let begun = Begun {
                number: totals.substeps + 1,
                elapsed: totals.elapsed,
                before: self.state.substep,
                bodies: self.state.bodies.clone(),
                deep: self.deep_begun(),
            };
            let is_traced = match span {
                Span::From(first) => begun.number >= first,
                Span::Only(SubstepChoice::Number(number)) => begun.number == number,
                // This look ahead does not change anything: the substep's own survey finds the
                // same.
                Span::Only(SubstepChoice::Last) => self.look(&totals, plain)?.2,
            };
            let is_last = if is_traced {
                self.go_on(&mut totals, &mut |program, recordings| {
                    trace(recordings, program, &mut |traced| observe(&begun, traced))
                })?
            } else {
                self.go_on(&mut totals, plain)?
            };
            match span {
                Span::Only(_) if is_traced => return Ok(begun.number),
                Span::Only(SubstepChoice::Number(asked)) if is_last => {
                    return Err(SolveError::NoSubstep {
                        asked,
                        frame: self.frame,
                        count: totals.substeps,
                    });
                }
                _ if is_last => return Ok(totals.substeps),
                _ => {}
            }
        }
    }
}
