//! Work of moving walls on the particles, over m / Δt².

use crate::{
    comparison::{Io, PassResult},
    table::pair,
};
use swell_solve::pbf::buffers;

use super::{PbfState, State, rows::WORK};

impl PbfState {
    /// Returns the largest speed of a wall, m/s.
    pub(super) fn wall_speed(&self) -> f64 {
        let velocity = &self.substep.wall_velocity;
        velocity.min.abs().max(velocity.max.abs()).max_element()
    }

    /// Returns the largest speed of a wall or solid, m/s.
    pub(super) fn boundary_speed(&self) -> f64 {
        self.wall_speed().max(self.model.fastest_solid())
    }
}

pub(super) fn boundary_work(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let groups = n.div_ceil(64);
    let work = io.before.get(buffers::WALL_WORK, 2 * n)?;
    let before = io.before.get(buffers::BOUNDARY_WORK, groups)?;
    let after = io.after.get(buffers::BOUNDARY_WORK, groups)?;
    io.table.each(&WORK, 0..groups, |group| {
        let terms = 64 * group..(64 * group + 64).min(n);
        let term = |i: usize| f64::from(work[i]) + f64::from(work[n + i]);
        let sum: f64 = terms.clone().map(term).sum();
        let size = |i: usize| f64::from(work[i].abs() + work[n + i].abs());
        let sizes: f64 = terms.map(size).sum();
        let [before, after] = [before[group], after[group]].map(f64::from);
        let magnitudes = [sizes, before.abs(), after.abs()];
        pair(group, after, before + sum, magnitudes)
    });
    Ok(())
}
