//! A substep run dispatch by dispatch, for whoever holds each pass against its f64 twin.

use swell_domain::{solver::Solver, substep::Which};
use swell_gpu::{
    buffer::{Buf, Scalar, Windows},
    program::Program,
    recording::{Bind, Moment, Recording},
    reflect::{Access, Binding},
};
use swell_scene::flip::Precision;

use super::{
    SolveError,
    buffers::COUNTERS,
    params::{Counters, IterationControl},
    pbf,
    pressure::{
        PressureControl64, PressureStats,
        buffers::{Real, STATS, read_control, read_reals},
    },
};

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
    pub fn read<T: bytemuck::Pod>(
        &self,
        buffer: Buf<T>,
        count: usize,
    ) -> Result<Vec<T>, SolveError> {
        Ok(self.program.read(buffer, count)?)
    }

    /// What stands in a buffer of one struct, or in front of others.
    ///
    /// # Errors
    /// The device.
    pub fn one<T: bytemuck::Pod>(&self, buffer: Buf<T>) -> Result<T, SolveError> {
        Ok(self.program.read(buffer, 1)?.remove(0))
    }

    /// The first `count` values of the buffer that the variable of `variable`'s name is bound to.
    ///
    /// # Errors
    /// The device.
    pub fn bound<T: bytemuck::Pod>(
        &self,
        variable: Buf<T>,
        count: usize,
    ) -> Result<Vec<T>, SolveError> {
        let buffer = variable.renamed(self.buffer(variable.name()));
        Ok(self.program.read(buffer, count)?)
    }

    /// The first `count` values of an array of a projection's own precision.
    ///
    /// # Errors
    /// The device.
    pub fn reals(
        &self,
        buffer: &Buf<Real>,
        precision: Precision,
        count: usize,
    ) -> Result<Vec<f64>, SolveError> {
        read_reals(self.program, buffer, precision, count)
    }

    /// What passes have counted.
    ///
    /// # Errors
    /// The device.
    pub fn counters(&self) -> Result<Counters, SolveError> {
        self.one(COUNTERS)
    }

    /// PBF's iteration until a density error.
    ///
    /// # Errors
    /// The device.
    pub fn iteration_control(&self) -> Result<IterationControl, SolveError> {
        self.one(pbf::buffers::CONTROL)
    }

    /// The scalars of a projection in `precision`, on which their layout depends.
    ///
    /// # Errors
    /// The device.
    pub fn pressure_control(&self, precision: Precision) -> Result<PressureControl64, SolveError> {
        Ok(read_control(self.program, precision)?.0)
    }

    /// What a projection has noted.
    ///
    /// # Errors
    /// The device.
    pub fn pressure_stats(&self) -> Result<PressureStats, SolveError> {
        self.one(STATS)
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
        let buffer: Buf<u8> = Buf::named(self.buffer(variable).to_owned());
        let bytes = self.read(buffer, offset + size_of::<T>())?;
        Ok(bytemuck::pod_read_unaligned(&bytes[offset..]))
    }

    /// The window of `windows` that the dispatch is bound to.
    ///
    /// # Errors
    /// The device.
    pub fn window<T: bytemuck::Pod>(&self, windows: &Windows<T>) -> Result<T, SolveError> {
        self.uniform(windows.variable())
    }
}

impl Traced<'_> {
    /// What the dispatch writes.
    fn written(&self) -> impl Iterator<Item = &Binding> {
        let bindings = self.program.pass(self.pass).bindings.iter();
        bindings.filter(|binding| binding.access == Access::ReadWrite)
    }

    /// Whether the dispatch writes a buffer.
    pub fn writes(&self, buffer: &str) -> bool {
        self.written()
            .any(|binding| self.buffer(&binding.name) == buffer)
    }

    /// Whether the program that runs it has a buffer of that name.
    pub fn has(&self, buffer: &str) -> bool {
        self.program.has(buffer)
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

/// Whether floats are finite, by their exponents: the higher word of an f64 holds it.
fn are_finite(words: &[u32], float: Scalar) -> bool {
    let (width, exponent) = match float {
        Scalar::F64 => (2, 0x7ff0_0000),
        _ => (1, 0x7f80_0000),
    };
    let mut high = words.iter().skip(width - 1).step_by(width);
    high.all(|word| word & exponent != exponent)
}

/// Which substeps of a frame are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Span {
    /// From one on, counted from 1, to the frame's end.
    From(u32),
    /// One.
    Only(Which),
}

/// A substep that is traced.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Begun {
    /// From 1.
    pub number: u32,
    /// Seconds of the frame that were over when it began.
    pub elapsed: f64,
    /// Length of the substep before, seconds; 0 where there was none.
    pub before: f64,
}

/// What a trace tells.
pub type Observe<'a> = dyn FnMut(Begun, Traced<'_>) -> Result<(), SolveError> + 'a;

/// A solver whose frames can be run dispatch by dispatch.
pub trait TraceFrame: Solver {
    /// Runs the frame after the loaded state: what comes before `span` at once, and its substeps one dispatch at a time, with
    /// PBF the measurement of a frame's end after the last of them too. Returns that one's number. The solver then has to
    /// be loaded anew.
    ///
    /// # Errors
    /// The device, the numbers, fewer substeps than were asked for, and what `observe` returns.
    fn trace_frame(&mut self, span: Span, observe: &mut Observe<'_>) -> Result<u32, SolveError>;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_are_finite_by_the_word_that_holds_their_exponent() {
        let wide = |value: f64| [value.to_bits() as u32, (value.to_bits() >> 32) as u32];
        // The lower word of this number is an f32 that is none.
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
