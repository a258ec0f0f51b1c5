//! The whole iteration, from the same start: errors pile up here, and by how much is what the f64 solve itself says.

use glam::DVec3;

use crate::{
    compare::{deviation::Deviation, rounding::U},
    domain::boundary::Boundary,
    reference::{
        Timings,
        neighbors::Neighbors,
        pbf::{Colour, Model, Sorted, iterate_among, passes},
    },
};

use super::{Checker, fields::*, pair_of};

/// Of the RMS answer to a moved start.
const SAFETY: f64 = 4.0;

/// Where the iteration starts, and where the GPU's ends.
#[derive(Default)]
pub(super) struct Whole {
    start: Option<Sorted>,
    end: Vec<DVec3>,
}

impl Whole {
    pub(super) fn has_start(&self) -> bool {
        self.start.is_some()
    }

    /// Particles as the sort left them, then samples.
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

/// What a solve came to: positions, relative densities, λ.
struct Outcome {
    position: Vec<[f64; 3]>,
    density: Vec<f64>,
    lambda: Vec<f64>,
}

impl Checker<'_> {
    pub(super) fn add_whole(&mut self, boundary: &Boundary) {
        let Some(start) = self.whole.start.take() else {
            return;
        };
        let n = self.n();
        let model = Model::new(self.scene, boundary);
        let solved = |shift: f64| {
            let mut moved = start.clone();
            for (k, x) in moved.points[..n].iter_mut().enumerate() {
                *x += shift * signs(k);
            }
            let timings = &mut Timings::default();
            let mut visit = |points: &[DVec3]| self.is_searching().then(|| self.searched(points));
            let iterations = iterate_among(&model, &self.substep, &mut moved, timings, &mut visit);
            (moved.points, iterations)
        };
        let diagonal = self.scene.domain.size().length();
        let (exact, iterations) = solved(0.0);
        let (moved, _) = solved(2.0 * U * diagonal);
        let mut end = std::mem::take(&mut self.whole.end);
        end.extend(&self.model.samples);
        let [found, exact, moved] = [&end, &exact, &moved].map(|points| self.outcome(points));
        let wider = SAFETY * f64::from(iterations.max(1)).sqrt();
        let rows = [
            (
                &WHOLE_DELTA,
                Deviation::between(&found.position, &exact.position),
                Deviation::between(&moved.position, &exact.position),
            ),
            (
                &WHOLE_DENSITY,
                Deviation::between(&found.density, &exact.density),
                Deviation::between(&moved.density, &exact.density),
            ),
            (
                &WHOLE_LAMBDA,
                Deviation::between(&found.lambda, &exact.lambda),
                Deviation::between(&moved.lambda, &exact.lambda),
            ),
        ];
        for (field, error, answer) in rows {
            let index = error.max_at.unwrap_or(0);
            let pair = pair_of(index, error.rms, 0.0, wider * answer.rms);
            self.table.add(field, &[pair], 0);
        }
    }

    fn outcome(&self, points: &[DVec3]) -> Outcome {
        let n = self.n();
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

/// ± 1 along each axis, by a hash of the index.
fn signs(k: usize) -> DVec3 {
    let hash = (k as u32 + 1).wrapping_mul(0x9e37_79b9) >> 16;
    let sign = |bit: u32| if hash >> bit & 1 == 0 { 1.0 } else { -1.0 };
    DVec3::new(sign(0), sign(5), sign(10))
}
