//! Neighbour lists: reads back those of the GPU, and derives the neighbours that a pass visits.

use std::sync::Arc;

use glam::DVec3;

use crate::{
    comparison::{Io, PassResult},
    table::pair,
};
use swell_domain::parallel;
use swell_domain::places::{SKIN, are_near};
use swell_reference::neighbors::{Neighbors, SortedPoints};
use swell_solve::{
    SolveError,
    pbf::buffers,
    plan::{LIST_CAPACITY, Plan},
};

use super::{
    PbfState, State,
    rows::{NEAR_H, NEIGHBORS},
};

/// Particles per block of lists, as in shared/neighbor_list.wgsl.
const STRIDE: usize = 512;

/// The lists of a substep, chunk by chunk.
pub(super) struct Lists {
    members: Vec<Vec<u32>>,
    /// Particles with more neighbours than a list holds, which each pass searches for.
    is_searched: Vec<bool>,
    all: Option<Arc<Neighbors>>,
    /// First particle of each cell, as on the device.
    start: Vec<u32>,
    /// Expected position words; empty if lists are built without them.
    pub(super) words: Vec<u32>,
}

impl Lists {
    pub(super) fn new(plan: &Plan) -> Self {
        let n = plan.counts.particles;
        Self {
            members: vec![Vec::new(); n],
            is_searched: vec![!plan.has_lists; n],
            all: None,
            start: Vec::new(),
            words: Vec::new(),
        }
    }
}

/// Appends sorted neighbours; returns the lengths after the particles and after the samples.
fn split(near: &[u32], particles: usize, members: &mut Vec<u32>) -> [u32; 2] {
    let first = members.len();
    members.extend(near);
    let fluid = near.partition_point(|&j| (j as usize) < particles);
    [(first + fluid) as u32, members.len() as u32]
}

impl PbfState {
    /// Finds the points closer than h, in f64; `points` may be in any order.
    pub(super) fn search(&self, points: &[DVec3]) -> Neighbors {
        self.search_within(points, self.model.calibration.support_radius)
    }

    /// Finds the points closer than `radius`. Sorts again, because the cell in f64 of a point on a
    /// face may differ from that by which the device has sorted it.
    fn search_within(&self, points: &[DVec3], radius: f64) -> Neighbors {
        let n = self.particles();
        let ids: Vec<u32> = (0..points.len() as u32).collect();
        let (particles, samples) = points.split_at(n);
        let mut order = self.model.cells.order(particles, &ids);
        let samples = self.model.cells.order(samples, &ids);
        order.extend(samples.into_iter().map(|k| n + k));
        let sorted: Vec<DVec3> = order.iter().map(|&k| points[k]).collect();
        let crowd = SortedPoints {
            cells: self.model.cells,
            points: &sorted,
            particles: n,
        };
        let found = Neighbors::search(&crowd, radius);
        let mut place = vec![0; n];
        for (k, &slot) in order[..n].iter().enumerate() {
            place[slot] = k;
        }
        Neighbors::listed(n, |i, members| {
            let (fluid, solid) = found.of(place[i]);
            [fluid, solid].map(|group| {
                members.extend(group.iter().map(|&j| order[j as usize] as u32));
                members.len() as u32
            })
        })
    }

    /// Returns whether lists are built from position words.
    pub(super) fn has_words(&self) -> bool {
        self.plan.has_lists && self.plan.has_places(&self.scene)
    }

    /// Returns the expected members of the lists, in f64, or by position words if lists are built
    /// from these.
    pub(super) fn listed(&self, points: &[DVec3]) -> Neighbors {
        if self.lists.words.is_empty() {
            return self.search(points);
        }
        let (n, words) = (self.particles(), &self.lists.words);
        let h = self.model.calibration.support_radius;
        let near = self.search_within(points, h * (1.0 + SKIN));
        Neighbors::listed(n, |i, members| {
            let is_listed = |&j: &u32| match words.get(j as usize) {
                Some(&word) => are_near(words[i], word),
                None => points[i].distance_squared(points[j as usize]) < h * h,
            };
            let mut all: Vec<u32> = near.all(i).filter(is_listed).collect();
            all.sort_unstable();
            split(&all, n, members)
        })
    }

    /// Returns the neighbours that a pass visits from `points`: those of the list, or of a search
    /// of the cells around if there is no list.
    pub(crate) fn visited(
        &mut self,
        io: &Io<'_>,
        points: &[DVec3],
    ) -> Result<Arc<Neighbors>, SolveError> {
        if let Some(all) = &self.lists.all {
            return Ok(Arc::clone(all));
        }
        if !self.is_searching() {
            let (n, lists) = (self.particles(), &self.lists.members);
            let all = Neighbors::listed(n, |i, members| split(&lists[i], n, members));
            let all = Arc::new(all);
            self.lists.all = Some(Arc::clone(&all));
            return Ok(all);
        }
        if self.lists.start.is_empty() {
            let count: usize = self.model.cells.dims.iter().product();
            self.lists.start = io.before.get(buffers::CELL_START, count + 1)?;
        }
        Ok(Arc::new(self.searched(points)))
    }

    /// Returns whether there are particles without a list.
    pub(super) fn is_searching(&self) -> bool {
        self.lists.is_searched.contains(&true)
    }

    /// Returns the neighbours that a pass visits from `points` if some particles have no list:
    /// particles that were sorted into the cells around a particle's current position. Two
    /// particles that approach each other from cells farther apart are missed.
    pub(super) fn searched(&self, points: &[DVec3]) -> Neighbors {
        let n = self.particles();
        let (cells, lists) = (&self.model.cells, &self.lists);
        let start = &lists.start;
        let solid_start = cells.starts(&self.model.samples);
        let h2 = self.model.calibration.support_radius.powi(2);
        Neighbors::listed(n, |i, members| {
            if !lists.is_searched[i] {
                return split(&lists.members[i], n, members);
            }
            let mut near = Vec::new();
            for run in cells.runs(points[i]).iter() {
                let fluid = start[run.start] as usize..start[run.end] as usize;
                let solid = n + solid_start[run.start]..n + solid_start[run.end];
                let r2 = |j: usize| {
                    cells
                        .period
                        .shortest(points[i] - points[j])
                        .length_squared()
                };
                let found = fluid.chain(solid).filter(|&j| j != i && r2(j) < h2);
                near.extend(found.map(|j| j as u32));
            }
            near.sort_unstable();
            split(&near, n, members)
        })
    }
}

pub(super) fn build_neighbors(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let phase = io.before.window(&buffers::PHASES)?;
    let (points, _) = state.stored(io)?;
    let (first, count) = (phase.first as usize, phase.count as usize);
    let capacity = LIST_CAPACITY as usize;
    let words = count.next_multiple_of(STRIDE) * capacity;
    let list = io
        .after
        .get(buffers::NEIGHBOR_LIST.retyped::<u32>(), words)?;
    let counts = io.after.get(buffers::NEIGHBOR_COUNT, n)?;
    let member = |local: usize, k: usize| {
        let lane = local % STRIDE;
        let base =
            local / STRIDE * STRIDE * (capacity / 4) + (lane >> 1) + (lane & 1) * (STRIDE / 2);
        list[4 * (base + k / 4 * STRIDE) + k % 4]
    };
    // Words of four entries; the last word holds its entries first.
    let members = |local: usize| {
        let held = counts[first + local] as usize;
        let mut all: Vec<u32> = (0..held.next_multiple_of(4))
            .map(|k| member(local, k))
            .filter(|&j| (j as usize) < points.len())
            .collect();
        all.sort_unstable();
        all
    };
    let h = state.model.calibration.support_radius;
    let shell = NEAR_H.of([]);
    let (inner, outer) = (h * h * (1.0 - shell), h * h * (1.0 + shell));
    // Words determine the neighbours among particles exactly; boundary samples have none.
    let words = match state.has_words() {
        true => io.before.get(buffers::PLACE, n)?,
        false => Vec::new(),
    };
    let skin = if words.is_empty() { shell } else { SKIN };
    let near = state.search_within(&points, h * (1.0 + skin));
    let period = state.model.period();
    let one = |local: usize| {
        let i = first + local;
        let r2 = |j: u32| {
            let way = period.shortest(points[i] - points[j as usize]);
            way.length_squared()
        };
        let near: Vec<u32> = near.all(i).collect();
        let by_words = |j: u32| Some(are_near(*words.get(i)?, *words.get(j as usize)?));
        let is_sure = |&&j: &&u32| r2(j) < inner || by_words(j) == Some(true);
        let is_possible = |&&j: &&u32| by_words(j).unwrap_or(r2(j) < outer);
        let sure = near.iter().filter(is_sure).count();
        let possible = near.iter().filter(is_possible).count();
        let held = counts[i] as usize;
        let all = if held <= capacity {
            members(local)
        } else {
            Vec::new()
        };
        let wrong = if held > capacity {
            sure.saturating_sub(held) + held.saturating_sub(possible)
        } else {
            let within = |j: &&u32| near.contains(j) && is_possible(j);
            let twice = all.windows(2).filter(|pair| pair[0] == pair[1]).count();
            let right = all.iter().filter(within).count() - twice;
            let missed = (near.iter())
                .filter(|j| is_sure(j) && all.binary_search(j).is_err())
                .count();
            missed + all.len() - right + held.abs_diff(all.len())
        };
        (wrong, possible.saturating_sub(sure), all)
    };
    let found: Vec<_> = parallel::map(0..count, one);
    let wrong =
        |(local, one): (usize, &(usize, usize, _))| pair(first + local, one.0 as f64, 0.0, []);
    io.table
        .add(&NEIGHBORS, found.iter().enumerate().map(wrong));
    io.table
        .add_ties(&NEIGHBORS, found.iter().map(|one| one.1).sum());
    for (local, (_, _, all)) in found.into_iter().enumerate() {
        state.lists.is_searched[first + local] = counts[first + local] > LIST_CAPACITY;
        state.lists.members[first + local] = all;
    }
    Ok(())
}
