//! Runs a substep dispatch by dispatch, so that each pass can be compared with its f64 reference
//! pass.

use swell_domain::{body::BodyState, solver::Solver, substep::SubstepChoice};
use swell_gpu::{
    buffer::{Buf, Scalar, Windows},
    program::Program,
    recording::{Bind, Recording, TracePoint},
    reflect::{Access, Binding},
};

use super::{SolveError, buffers::COUNTERS, params::Counters};

/// A dispatch of a traced substep, observed just before or just after it runs.
#[derive(Clone, Copy)]
pub struct Traced<'a> {
    /// Whether the dispatch is about to run or has run.
    pub point: TracePoint,
    /// Name of the pass.
    pub pass: &'static str,
    /// Explicit bindings; a variable without one is bound to the buffer of its own name.
    pub binds: &'a [Bind],
    program: &'a Program,
}

impl Traced<'_> {
    /// Reads the first `count` values of a buffer.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn read<T: bytemuck::Pod>(
        &self,
        buffer: Buf<T>,
        count: usize,
    ) -> Result<Vec<T>, SolveError> {
        Ok(self.program.read(buffer, count)?)
    }

    /// Reads the first value of a buffer.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn one<T: bytemuck::Pod>(&self, buffer: Buf<T>) -> Result<T, SolveError> {
        Ok(self.program.read(buffer, 1)?.remove(0))
    }

    /// Reads the first `count` values of the buffer that the shader variable is bound to.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn bound<T: bytemuck::Pod>(
        &self,
        variable: Buf<T>,
        count: usize,
    ) -> Result<Vec<T>, SolveError> {
        let buffer = variable.renamed(self.buffer(variable.name()));
        Ok(self.program.read(buffer, count)?)
    }

    /// Reads the counters of the frame.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn counters(&self) -> Result<Counters, SolveError> {
        self.one(COUNTERS)
    }

    /// Returns the name of the buffer that a shader variable is bound to.
    pub fn buffer<'b>(&'b self, variable: &'b str) -> &'b str {
        let found = self.binds.iter().find(|bind| bind.variable == variable);
        found.map_or(variable, |bind| &bind.buffer)
    }

    /// Reads the window of a uniform that the dispatch is bound to.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn uniform<T: bytemuck::Pod>(&self, variable: &str) -> Result<T, SolveError> {
        let found = self.binds.iter().find(|bind| bind.variable == variable);
        let offset = found
            .and_then(|bind| bind.window)
            .map_or(0, |window| window.0) as usize;
        let buffer: Buf<u8> = Buf::named(self.buffer(variable).to_owned());
        let bytes = self.read(buffer, offset + size_of::<T>())?;
        Ok(bytemuck::pod_read_unaligned(&bytes[offset..]))
    }

    /// Reads the window of `windows` that the dispatch is bound to.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn window<T: bytemuck::Pod>(&self, windows: &Windows<T>) -> Result<T, SolveError> {
        self.uniform(windows.variable())
    }
}

impl Traced<'_> {
    /// Iterates over the read-write bindings of the pass.
    fn written(&self) -> impl Iterator<Item = &Binding> {
        let bindings = self.program.pass(self.pass).bindings.iter();
        bindings.filter(|binding| binding.access == Access::ReadWrite)
    }

    /// Returns whether the dispatch writes a buffer.
    pub fn writes(&self, buffer: &str) -> bool {
        self.written()
            .any(|binding| self.buffer(&binding.name) == buffer)
    }

    /// Returns whether the program has a buffer of this name.
    pub fn has(&self, buffer: &str) -> bool {
        self.program.has(buffer)
    }

    /// Returns how many values of type `T` a buffer holds.
    pub fn length<T>(&self, buffer: &str) -> usize {
        self.program.buffer(buffer).size() as usize / size_of::<T>()
    }

    /// Returns the first float buffer that the dispatch writes and that holds a non-finite value
    /// now.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn first_not_finite(&self) -> Result<Option<String>, SolveError> {
        for binding in self.written() {
            let scalar = binding.element.scalar;
            if !matches!(scalar, Scalar::F32 | Scalar::F64) {
                continue;
            }
            let buffer = self.buffer(&binding.name);
            let words: Buf<u32> = Buf::named(buffer.to_owned());
            let words = self.read(words, self.length::<u32>(buffer))?;
            if !are_finite(&words, scalar) {
                return Ok(Some(buffer.to_owned()));
            }
        }
        Ok(None)
    }
}

/// Returns whether all floats are finite, judged by their exponents; for an f64 that is in the high
/// word.
fn are_finite(words: &[u32], float: Scalar) -> bool {
    let (width, exponent) = match float {
        Scalar::F64 => (2, 0x7ff0_0000),
        _ => (1, 0x7f80_0000),
    };
    let mut high = words.iter().skip(width - 1).step_by(width);
    high.all(|word| word & exponent != exponent)
}

/// Substeps of a frame that are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Span {
    /// From this substep, counted from 1, to the end of the frame.
    From(u32),
    /// One substep.
    Only(SubstepChoice),
}

/// A substep that is being traced.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Begun {
    /// Number of the substep, counted from 1.
    pub number: u32,
    /// Time of the frame that had passed when the substep began, seconds.
    pub elapsed: f64,
    /// Length of the previous substep, seconds; 0 if there was none.
    pub before: f64,
    /// Bodies as the substep began; for PBF's own passes, which follow the projection on its grid,
    /// at the substep's end.
    pub bodies: Vec<BodyState>,
    /// Water without particles as the substep began.
    pub deep: DeepBegun,
}

/// What a substep knows of water without particles as it begins; nothing without a band.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeepBegun {
    /// Bricks that had water in the frame so far.
    pub was_wet: Vec<bool>,
    /// Largest speed of that water at the frame's start, m/s.
    pub speed: f64,
}

/// Callback that receives each dispatch of a trace.
pub type Observe<'a> = dyn FnMut(&Begun, Traced<'_>) -> Result<(), SolveError> + 'a;

/// A solver whose frames can be run dispatch by dispatch.
pub trait TraceFrame: Solver {
    /// Runs the frame after the loaded state. Substeps before `span` run normally, those of `span`
    /// one dispatch at a time. PBF also traces the density measurement that ends a frame, after the
    /// last traced substep. Returns the number of that substep. Load a state before using the
    /// solver again.
    ///
    /// # Errors Returns an error if the device fails, a numerical budget is exceeded, the frame has
    /// fewer substeps than requested, or `observe` fails.
    fn trace_frame(&mut self, span: Span, observe: &mut Observe<'_>) -> Result<u32, SolveError>;
}

/// Callback that runs recordings in order: directly, timed, or traced.
pub(super) type Run<'a> = dyn FnMut(&Program, &[&Recording]) -> Result<(), SolveError> + 'a;

pub(super) fn trace(
    recordings: &[&Recording],
    program: &Program,
    observe: &mut dyn FnMut(Traced<'_>) -> Result<(), SolveError>,
) -> Result<(), SolveError> {
    recordings.iter().try_for_each(|recording| {
        recording.trace(program, |point, pass, binds| {
            observe(Traced {
                point,
                pass,
                binds,
                program,
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_are_finite_by_the_word_that_holds_their_exponent() {
        let wide = |value: f64| [value.to_bits() as u32, (value.to_bits() >> 32) as u32];
        // Taken as an f32, the low word of this number is a NaN.
        let odd = f64::from_bits(0x3ff0_0000_7fc0_0000);
        assert!(are_finite(
            &[wide(1.0), wide(odd), wide(-f64::MAX)].concat(),
            Scalar::F64
        ));
        assert!(!are_finite(&wide(odd), Scalar::F32));
        for value in [f64::NAN, f64::NEG_INFINITY] {
            assert!(!are_finite(&[wide(1.0), wide(value)].concat(), Scalar::F64));
            assert!(!are_finite(&[(value as f32).to_bits()], Scalar::F32));
        }
        assert!(are_finite(&[f32::MAX.to_bits(), 0], Scalar::F32));
    }
}
