//! Runs a table of twins along a traced substep: a twin says which pass it is of, what it reads, and what it makes of that;
//! when and where the device's values are read is written here once.

use std::collections::BTreeMap;

use glam::{DVec3, Vec4};

use crate::{
    gpu::recording::Moment,
    solve::{SolveError, trace::Traced},
};

use super::{sort, table::Table};

/// What holds a pass against its twin; `S` is what a solver's twins know of the substep.
pub(super) struct Twin<S> {
    /// Name of the pass.
    pub(super) pass: &'static str,
    /// Variables of the pass that are wanted as they stood before it ran although it writes them: they are kept.
    pub(super) keeps: &'static [&'static str],
    /// Computes what the pass should have written, and adds that to the table beside what it did.
    pub(super) compare: Compare<S>,
}

/// Compares a pass.
type Compare<S> = fn(&mut S, &Io<'_>, &mut Table) -> Result<(), SolveError>;

/// A [`Twin`].
pub(super) const fn twin<S>(
    pass: &'static str,
    keeps: &'static [&'static str],
    compare: Compare<S>,
) -> Twin<S> {
    Twin {
        pass,
        keeps,
        compare,
    }
}

/// What a solver's twins know of the substep from pass to pass.
pub(super) trait State: Sized + 'static {
    /// Twins of its passes.
    fn twins() -> Vec<&'static [Twin<Self>]>;

    /// Particles.
    fn particles(&self) -> usize;

    /// Passes without a row of their own, and where what they make is compared.
    const ELSEWHERE: &'static [(&'static str, &'static str)];
}

/// A dispatch that has run: what it read and what it left.
pub(super) struct Io<'a> {
    traced: Traced<'a>,
    kept: &'a BTreeMap<&'static str, Vec<u32>>,
    /// The pass before.
    pub(super) last: &'static str,
}

impl Io<'_> {
    /// Name of the pass.
    pub(super) fn pass(&self) -> &'static str {
        self.traced.pass
    }

    /// Name of the buffer that a variable is bound to.
    pub(super) fn buffer<'b>(&'b self, variable: &'b str) -> &'b str {
        self.traced.buffer(variable)
    }

    /// The first `count` values of a variable as the pass left them.
    pub(super) fn after<T: bytemuck::Pod>(
        &self,
        variable: &str,
        count: usize,
    ) -> Result<Vec<T>, SolveError> {
        self.traced.read(self.buffer(variable), count)
    }

    /// The same as they stood before it ran: kept, where the twin says so, and else as they stand, which must be
    /// of what the pass does not write.
    pub(super) fn before<T: bytemuck::Pod>(
        &self,
        variable: &str,
        count: usize,
    ) -> Result<Vec<T>, SolveError> {
        let buffer = self.buffer(variable);
        let Some(words) = self.kept.get(variable) else {
            assert!(
                !self.traced.writes(buffer),
                "{} writes {variable}: its twin has to keep it",
                self.pass()
            );
            return self.after(variable, count);
        };
        let bytes: &[u8] = bytemuck::cast_slice(words);
        Ok(bytemuck::pod_collect_to_vec(
            &bytes[..count * size_of::<T>()],
        ))
    }

    /// Vectors, of which the fourth component is left out.
    pub(super) fn vectors(&self, variable: &str, count: usize) -> Result<Vec<DVec3>, SolveError> {
        Ok(wide(&self.after(variable, count)?))
    }

    /// The same from before.
    pub(super) fn vectors_before(
        &self,
        variable: &str,
        count: usize,
    ) -> Result<Vec<DVec3>, SolveError> {
        Ok(wide(&self.before(variable, count)?))
    }

    /// Numbers in f64.
    pub(super) fn scalars(&self, variable: &str, count: usize) -> Result<Vec<f64>, SolveError> {
        let values = self.after::<f32>(variable, count)?;
        Ok(values.into_iter().map(f64::from).collect())
    }

    /// A struct that stands in front of a buffer.
    pub(super) fn one<T: bytemuck::Pod>(&self, variable: &str) -> Result<T, SolveError> {
        Ok(self.after(variable, 1)?.remove(0))
    }

    /// The same from before.
    pub(super) fn one_before<T: bytemuck::Pod>(&self, variable: &str) -> Result<T, SolveError> {
        Ok(self.before(variable, 1)?.remove(0))
    }

    /// The window of a uniform that the dispatch is bound to.
    pub(super) fn uniform<T: bytemuck::Pod>(&self, variable: &str) -> Result<T, SolveError> {
        self.traced.uniform(variable)
    }
}

/// First three components, in f64.
pub(super) fn wide(values: &[[f32; 4]]) -> Vec<DVec3> {
    let wide = |value: &[f32; 4]| Vec4::from_array(*value).as_dvec4().truncate();
    values.iter().map(wide).collect()
}

/// A table of twins at work.
pub(super) struct Engine<S: State> {
    pub(super) state: S,
    pub(super) table: Table,
    twins: Vec<&'static [Twin<S>]>,
    sort: sort::Twins<S>,
    ran: Vec<&'static str>,
    kept: BTreeMap<&'static str, Vec<u32>>,
    last: &'static str,
    now: &'static str,
}

impl<S: State> Engine<S> {
    pub(super) fn new(state: S) -> Self {
        Self {
            state,
            table: Table::default(),
            twins: S::twins(),
            sort: sort::twins(),
            ran: Vec::new(),
            kept: BTreeMap::new(),
            last: "",
            now: "",
        }
    }

    /// Takes in a dispatch, before and after it runs.
    pub(super) fn observe(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        if traced.moment == Moment::Before {
            (self.last, self.now) = (self.now, traced.pass);
            if !self.ran.contains(&traced.pass) {
                self.ran.push(traced.pass);
            }
        }
        let of_solver = self.twins.iter().copied().flatten();
        let twin = (self.sort.iter().chain(of_solver)).find(|twin| twin.pass == traced.pass);
        let Some(twin) = twin else {
            return Ok(());
        };
        if traced.moment == Moment::Before {
            self.kept.clear();
            for &variable in twin.keeps {
                let buffer = traced.buffer(variable);
                if traced.writes(buffer) {
                    let words = traced.length::<u32>(buffer);
                    self.kept.insert(variable, traced.read(buffer, words)?);
                }
            }
            return Ok(());
        }
        let io = Io {
            traced,
            kept: &self.kept,
            last: self.last,
        };
        (twin.compare)(&mut self.state, &io, &mut self.table)
    }

    /// The table, with the passes that have no row.
    pub(super) fn finish(mut self) -> Table {
        for pass in self.ran {
            if !self.table.has(pass) {
                let known = S::ELSEWHERE.iter().find(|(name, _)| *name == pass);
                let why = known.map_or("no f64 twin", |(_, why)| why);
                self.table.unchecked.push((pass, why));
            }
        }
        self.table
    }
}
