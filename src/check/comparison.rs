//! What a comparison is: a pass, the buffers to read, and the reference pass.

use std::collections::BTreeMap;

use bytemuck::Pod;
use glam::{DVec3, Vec3};

use swell_gpu::buffer::{Buf, Windows};
use swell_scene::flip::Precision;
use swell_solve::{
    SolveError,
    pressure::{
        PressureControl64,
        buffers::{self as pressure, Real},
    },
    trace::Traced,
};

use super::table::CheckTable;

/// Result of a comparison, whose findings are in the table.
pub(super) type PassResult = Result<(), SolveError>;

/// Comparison of a pass with its reference pass. `S` is the state that a solver's comparisons share
/// during the substep.
pub(super) struct Comparison<S> {
    /// Name of the pass.
    pub(super) pass: &'static str,
    /// Names of the pass's variables whose values from before the pass are needed although it
    /// overwrites them: they are saved.
    pub(super) keeps: fn() -> Vec<String>,
    /// Whether to compare this run of the pass.
    pub(super) is_due: fn(&mut S, &Io<'_>) -> Result<bool, SolveError>,
    /// Computes what the pass should have written, and adds that and what it did write to the
    /// table.
    pub(super) compare: fn(&mut S, &mut Io<'_>) -> PassResult,
}

/// Returns a [`Comparison`] that compares every run.
pub(super) const fn comparison<S>(
    pass: &'static str,
    keeps: fn() -> Vec<String>,
    compare: fn(&mut S, &mut Io<'_>) -> PassResult,
) -> Comparison<S> {
    Comparison {
        pass,
        keeps,
        is_due: |_, _| Ok(true),
        compare,
    }
}

/// Saves nothing.
pub(super) const NONE: fn() -> Vec<String> = Vec::new;

/// Lists the names of buffers to save.
macro_rules! names {
    ($($buffer:expr),+ $(,)?) => {
        vec![$($buffer.name().to_owned()),+]
    };
}
pub(super) use names;

/// State that a solver's comparisons share during the substep.
pub(super) trait State: Sized + 'static {
    /// Returns the number of particles.
    fn particles(&self) -> usize;

    /// Passes without a row of their own, and where their results are compared.
    const ELSEWHERE: &'static [(&'static str, &'static str)];
}

/// A dispatch that has run, with the buffers before and after it, and the table.
pub(super) struct Io<'a> {
    /// Name of the pass.
    pub(super) pass: &'static str,
    /// Name of the previous pass.
    pub(super) last: &'static str,
    /// Buffers before the dispatch.
    pub(super) before: TracedBuffers<'a>,
    /// Buffers after the dispatch.
    pub(super) after: TracedBuffers<'a>,
    /// Table that comparisons are added to.
    pub(super) table: &'a mut CheckTable,
}

/// The device's buffers at one time.
pub(super) struct TracedBuffers<'a> {
    pub(super) traced: Traced<'a>,
    /// Saved values of buffers that the pass writes; `None` for the view after it.
    pub(super) kept: Option<&'a BTreeMap<String, Vec<u32>>>,
}

impl TracedBuffers<'_> {
    /// Returns the name of the buffer that a variable is bound to.
    pub(super) fn buffer<'b>(&'b self, variable: &'b str) -> &'b str {
        self.traced.buffer(variable)
    }

    /// Reads the first `count` values of a variable. The view before the pass returns saved values,
    /// and otherwise current ones, which is only valid if the pass does not write the variable.
    pub(super) fn get<T: Pod>(&self, variable: Buf<T>, count: usize) -> Result<Vec<T>, SolveError> {
        let name = variable.name();
        if let Some(kept) = self.kept {
            if let Some(words) = kept.get(name) {
                let bytes: &[u8] = bytemuck::cast_slice(words);
                let first = variable.place(0) as usize;
                let last = first + count * size_of::<T>();
                return Ok(bytemuck::pod_collect_to_vec(&bytes[first..last]));
            }
            let is_written = self.traced.writes(self.buffer(name));
            assert!(
                !is_written,
                "{} writes {name}: its reference has to keep it",
                self.traced.pass
            );
        }
        match self.buffer(name) == name {
            true => self.traced.read(variable, count),
            false => self.traced.bound(variable, count),
        }
    }

    /// Reads vectors.
    pub(super) fn vectors(
        &self,
        variable: Buf<[f32; 3]>,
        count: usize,
    ) -> Result<Vec<DVec3>, SolveError> {
        Ok(wide(&self.get(variable, count)?))
    }

    /// Reads floats, as f64.
    pub(super) fn scalars(&self, variable: Buf<f32>, count: usize) -> Result<Vec<f64>, SolveError> {
        let values = self.get(variable, count)?;
        Ok(values.into_iter().map(f64::from).collect())
    }

    /// Reads values in the projection's precision.
    pub(super) fn reals(
        &self,
        variable: &Buf<Real>,
        precision: Precision,
        count: usize,
    ) -> Result<Vec<f64>, SolveError> {
        match precision {
            Precision::F64 => self.get(variable.retyped::<f64>(), count),
            Precision::F32 | Precision::F32Refined => self.scalars(variable.retyped(), count),
        }
    }

    /// Reads the scalars of a projection.
    pub(super) fn control(&self, precision: Precision) -> Result<PressureControl64, SolveError> {
        match precision {
            Precision::F64 => self.one(pressure::CONTROL_F64),
            Precision::F32 | Precision::F32Refined => Ok(self.one(pressure::CONTROL)?.into()),
        }
    }

    /// Reads the first value of a buffer.
    pub(super) fn one<T: Pod>(&self, variable: Buf<T>) -> Result<T, SolveError> {
        Ok(self.get(variable, 1)?.remove(0))
    }

    /// Reads the window of a uniform that the dispatch is bound to.
    pub(super) fn window<T: Pod>(&self, windows: &Windows<T>) -> Result<T, SolveError> {
        self.traced.window(windows)
    }
}

/// Converts vectors to f64.
pub(super) fn wide(values: &[[f32; 3]]) -> Vec<DVec3> {
    let wide = |value: &[f32; 3]| Vec3::from_array(*value).as_dvec3();
    values.iter().map(wide).collect()
}
