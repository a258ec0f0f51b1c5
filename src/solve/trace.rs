//! A substep run dispatch by dispatch, for whoever holds each pass against its f64 twin.

use crate::{
    domain::solver::Solver,
    gpu::{
        program::Program,
        recording::{Bind, Moment, Recording},
        reflect::Access,
    },
};

use super::SolveError;

/// A dispatch of a traced substep, just before or after it runs.
#[derive(Clone, Copy)]
pub struct Traced<'a> {
    /// Which of the two.
    pub moment: Moment,
    /// Pass name.
    pub pass: &'static str,
    /// Where its variables are bound, when not in the buffer of their own name.
    pub binds: &'a [Bind],
    program: &'a Program,
}

impl Traced<'_> {
    /// A buffer's first `count` values as they stand now.
    ///
    /// # Errors
    /// The device.
    pub fn read<T: bytemuck::Pod>(&self, buffer: &str, count: usize) -> Result<Vec<T>, SolveError> {
        Ok(self.program.download(&[(buffer, count)])?.remove(0))
    }

    /// Name of the buffer that a variable is bound to.
    pub fn buffer<'b>(&'b self, variable: &'b str) -> &'b str {
        let found = self.binds.iter().find(|bind| bind.variable == variable);
        found.map_or(variable, |bind| &bind.buffer)
    }

    /// The window of a uniform that the dispatch is bound to.
    ///
    /// # Errors
    /// The device.
    pub fn uniform<T: bytemuck::Pod>(&self, variable: &str) -> Result<T, SolveError> {
        let found = self.binds.iter().find(|bind| bind.variable == variable);
        let offset = found
            .and_then(|bind| bind.window)
            .map_or(0, |window| window.0) as usize;
        let bytes: Vec<u8> = self.read(self.buffer(variable), offset + size_of::<T>())?;
        Ok(bytemuck::pod_read_unaligned(&bytes[offset..]))
    }
}

impl Traced<'_> {
    /// Names of the buffers that the dispatch writes, of floats or of all.
    fn written(&self, floats_only: bool) -> impl Iterator<Item = &str> {
        let bindings = self.program.pass(self.pass).bindings.iter();
        bindings
            .filter(move |binding| {
                binding.access == Access::ReadWrite && (binding.is_float || !floats_only)
            })
            .map(|binding| self.buffer(&binding.name))
    }

    /// Whether the dispatch writes a buffer.
    pub fn writes(&self, buffer: &str) -> bool {
        self.written(false).any(|written| written == buffer)
    }

    /// How many values of `T` a buffer holds.
    pub fn length<T>(&self, buffer: &str) -> usize {
        self.program.buffer(buffer).size() as usize / size_of::<T>()
    }

    /// The first buffer of floats that the dispatch writes and in which something is not finite as it stands now.
    ///
    /// # Errors
    /// The device.
    pub fn first_not_finite(&self) -> Result<Option<String>, SolveError> {
        for buffer in self.written(true) {
            let values: Vec<f32> = self.read(buffer, self.length::<f32>(buffer))?;
            if !values.iter().all(|value| value.is_finite()) {
                return Ok(Some(buffer.to_owned()));
            }
        }
        Ok(None)
    }
}

/// A solver whose frames can be run dispatch by dispatch.
pub trait TraceFrame: Solver {
    /// Runs the frame after the loaded state, from substep `from` on, counted from 1, one dispatch at a time; `observe`
    /// is told the substep. The solver then has to be loaded anew.
    ///
    /// # Errors
    /// The device, the numbers, and what `observe` returns.
    fn trace_frame(
        &mut self,
        from: u32,
        observe: &mut dyn FnMut(u32, Traced<'_>) -> Result<(), SolveError>,
    ) -> Result<(), SolveError>;
}

/// What runs recordings one after the other: at once, timed, or traced.
pub(super) type Run<'a> = dyn FnMut(&Program, &[&Recording]) -> Result<(), SolveError> + 'a;

/// Runs `recordings` one dispatch at a time.
pub(super) fn trace(
    recordings: &[&Recording],
    program: &Program,
    observe: &mut dyn FnMut(Traced<'_>) -> Result<(), SolveError>,
) -> Result<(), SolveError> {
    recordings.iter().try_for_each(|recording| {
        recording.trace(program, |moment, pass, binds| {
            observe(Traced {
                moment,
                pass,
                binds,
                program,
            })
        })
    })
}
