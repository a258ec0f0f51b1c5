//! Runs a table of comparisons along a traced substep: reading the device's buffers at the right
//! time is implemented once, here.

use std::collections::BTreeMap;

use swell_gpu::{buffer::Buf, recording::TracePoint};
use swell_solve::{SolveError, trace::Traced};

use super::{
    comparison::{Comparison, Io, State, TracedBuffers},
    sort,
    table::CheckTable,
};

/// Runs the comparisons of a solver.
pub(super) struct Engine<S: State> {
    pub(super) state: S,
    pub(super) table: CheckTable,
    reference_passes: Vec<&'static [Comparison<S>]>,
    sort: sort::Comparisons<S>,
    ran: Vec<&'static str>,
    kept: BTreeMap<String, Vec<u32>>,
    last: &'static str,
    now: &'static str,
}

impl<S: State> Engine<S> {
    pub(super) fn new(state: S, reference_passes: Vec<&'static [Comparison<S>]>) -> Self {
        Self {
            state,
            table: CheckTable::default(),
            reference_passes,
            sort: sort::comparisons(),
            ran: Vec::new(),
            kept: BTreeMap::new(),
            last: "",
            now: "",
        }
    }

    /// Handles a dispatch, before and after it runs.
    pub(super) fn observe(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        if traced.point == TracePoint::Before {
            (self.last, self.now) = (self.now, traced.pass);
            if !self.ran.contains(&traced.pass) {
                self.ran.push(traced.pass);
            }
        }
        let of_solver = self.reference_passes.iter().copied().flatten();
        let reference =
            (self.sort.iter().chain(of_solver)).find(|reference| reference.pass == traced.pass);
        let Some(reference) = reference else {
            return Ok(());
        };
        if traced.point == TracePoint::Before {
            self.kept.clear();
            for variable in (reference.keeps)() {
                let buffer = traced.buffer(&variable).to_owned();
                if traced.writes(&buffer) {
                    let words = traced.length::<u32>(&buffer);
                    let words = traced.read(Buf::<u32>::named(buffer), words)?;
                    self.kept.insert(variable, words);
                }
            }
            return Ok(());
        }
        let io = &mut Io {
            pass: traced.pass,
            last: self.last,
            before: TracedBuffers {
                traced,
                kept: Some(&self.kept),
            },
            after: TracedBuffers { traced, kept: None },
            table: &mut self.table,
        };
        match (reference.is_due)(&mut self.state, io)? {
            true => (reference.compare)(&mut self.state, io),
            false => Ok(()),
        }
    }

    /// Returns the table, with the passes that have no row.
    pub(super) fn finish(mut self) -> CheckTable {
        for pass in self.ran {
            if !self.table.has(pass) {
                let known = S::ELSEWHERE.iter().find(|(name, _)| *name == pass);
                let why = known.map_or("no reference pass", |(_, why)| why);
                self.table.unchecked.push((pass, why));
            }
        }
        self.table
    }
}
