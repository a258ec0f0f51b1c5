//! Compares the whole iteration from the same start, over which errors accumulate. The tolerance is
//! the response of the f64 solve itself when its particles are moved by a rounding error before
//! each iteration.

use glam::DVec3;

use crate::table::{CheckTable, pair};
use swell_compare::deviation::Deviation;
use swell_domain::boundary::Boundary;
use swell_reference::{
    Timings,
    neighbors::Neighbors,
    pbf::{Colour, Model, Sorted, iterate_among, passes},
};

use super::{
    PbfState, State,
    rows::{SHIFT, WHOLE_DELTA, WHOLE_DENSITY, WHOLE_LAMBDA},
};

/// Start of the iteration, and the positions at the end of the GPU's.
#[derive(Default)]
pub(super) struct Whole {
    start: Option<Sorted>,
    end: Vec<DVec3>,
}

impl Whole {
    pub(super) fn has_start(&self) -> bool {
        self.start.is_some()
    }

    /// Stores particles in sorted order, then samples.
    pub(super) fn start(&mut self, points: &[DVec3], particles: usize, neighbors: Neighbors) {
        self.start = Some(Sorted {
            points: points.to_vec(),
            order: (0..particles).collect(),
            neighbors,
            lambda_sum: vec![0.0; particles],
            wall_work: 0.0,
        });
    }

    pub(super) fn end(&mut self, positions: Vec<DVec3>) {
        self.end = positions;
    }
}

/// Deviation of a solve from the exact one, in one of its fields.
type Measure<'a> = &'a dyn Fn(&Outcome) -> Deviation;

/// Result of a solve: positions, relative densities, λ.
struct Outcome {
    position: Vec<[f64; 3]>,
    density: Vec<f64>,
    lambda: Vec<f64>,
}

impl PbfState {
    pub(crate) fn add_whole(&mut self, boundary: &Boundary, table: &mut CheckTable) {
        let Some(start) = self.whole.start.take() else {
            return;
        };
        let n = self.particles();
        let mut model = Model::new(&self.scene, boundary);
        model.stand(&self.scene, &self.bodies, self.substep.time, 0.0);
        // The GPU rounds in each iteration. Moving only the start would not do: an iteration that
        // converges forgets it, and the remaining error is that of the last iterations.
        let solved = |moves: &dyn Fn(u32, usize) -> DVec3| {
            let mut moved = start.clone();
            let mut disturb = |iteration: u32, points: &mut [DVec3]| {
                for (k, x) in points.iter_mut().enumerate() {
                    *x += moves(iteration, k);
                }
            };
            let timings = &mut Timings::default();
            let mut visit = |points: &[DVec3]| self.is_searching().then(|| self.searched(points));
            let (substep, sorted) = (&self.substep, &mut moved);
            iterate_among(&model, substep, sorted, timings, &mut visit, &mut disturb);
            moved.points
        };
        let shift = SHIFT.of([self.scene.domain.size().length()]);
        let layer = |k: usize| (start.points[k] / self.scene.particle_spacing()).floor();
        let exact = solved(&|_, _| DVec3::ZERO);
        // Moves each particle independently. On a lattice, where all particles of a layer meet the
        // same numbers, also moves whole layers alike, the same in every iteration: what averages
        // out between neighbours in the one case accumulates in the other.
        let alone = solved(&|iteration, k| shift * signs([iteration as usize * n + k; 3]));
        let alike = solved(&|_, k| shift * signs(layer(k).to_array().map(|l| l as usize)));
        let mut end = std::mem::take(&mut self.whole.end);
        end.extend(&self.model.samples);
        let [found, exact, alone, alike] =
            [&end, &exact, &alone, &alike].map(|points| self.outcome(points));
        let position = |of: &Outcome| Deviation::between(&of.position, &exact.position);
        let density = |of: &Outcome| Deviation::between(&of.density, &exact.density);
        let lambda = |of: &Outcome| Deviation::between(&of.lambda, &exact.lambda);
        let rows: [(_, Measure<'_>); 3] = [
            (&WHOLE_DELTA, &position),
            (&WHOLE_DENSITY, &density),
            (&WHOLE_LAMBDA, &lambda),
        ];
        for (entry, off) in rows {
            let error = off(&found);
            let answer = off(&alone).rms.max(off(&alike).rms);
            let index = error.max_at.unwrap_or(0);
            table.add(entry, [pair(index, error.rms, 0.0, [answer])]);
        }
    }

    fn outcome(&self, points: &[DVec3]) -> Outcome {
        let n = self.particles();
        let neighbors = self.search(points);
        let inputs = self.inputs(points, &neighbors);
        let (mut lambda, mut density) = (vec![0.0; n], vec![0.0; n]);
        passes::compute_lambda(inputs, Colour::All, &mut lambda, &mut density);
        Outcome {
            position: points[..n].iter().map(|x| x.to_array()).collect(),
            density,
            lambda,
        }
    }
}

/// Returns ± 1 along each axis, by a hash of one number per axis.
fn signs(of: [usize; 3]) -> DVec3 {
    let sign = |axis: usize| {
        let hash = (of[axis] as u32 + 1).wrapping_mul(0x9e37_79b9) >> 16;
        f64::from(1 - 2 * (hash >> (5 * axis) & 1) as i32)
    };
    DVec3::new(sign(0), sign(1), sign(2))
}
