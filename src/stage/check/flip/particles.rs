//! The grid back to the particles.

use glam::DVec3;
use rayon::prelude::*;

use super::{Checker, Layout, fields::*, pair, pair_of};
use crate::{
    compare::rounding::U,
    domain::bricks::{Bricks, CELLS},
    reference::flip::{Given, Moved, advect, grid_to_particle},
    solve::{SolveError, trace::Traced},
};

/// By component, how far the values of the faces about a cell are apart, and their largest magnitude.
fn spread(bricks: &Bricks, values: &[DVec3], element: u32) -> (DVec3, DVec3) {
    let (mut low, mut high) = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
    for k in 0..27 {
        let offset = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
        let value = values[bricks.near(element, offset) as usize];
        (low, high) = (low.min(value), high.max(value));
    }
    (high - low, low.abs().max(high.abs()))
}

impl Checker<'_> {
    pub(super) fn grid_to_particle(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let faces = self.read_faces(traced)?;
        let has_shift = self.model.settings().density_correction;
        let shift = match has_shift {
            true => Some(self.planes(traced, "face_displacement")?),
            false => None,
        };
        let Layout { bricks, .. } = self.layout();
        let (step, sorted) = (self.step(), self.sorted());
        let twin = grid_to_particle(&self.model, &step, bricks, sorted, &faces, shift.as_deref());
        let given = self.read_given(traced)?;
        let place = 9.0 * self.place();
        let wet = CELLS..CELLS * (bricks.wet + 1);
        let bound = |(range, most): (DVec3, DVec3)| (place * range + 32.0 * U * most).length();
        let of_cell = |element: u32| {
            let own = sorted.of(element);
            let (mut velocity, mut change, mut moved) = (0.0, 0.0, 0.0);
            if !own.is_empty() {
                velocity = bound(spread(bricks, &faces.velocity, element));
                change = bound(spread(bricks, &faces.change, element));
                moved = (shift.as_ref()).map_or(0.0, |of| bound(spread(bricks, of, element)));
            }
            own.map(move |i| (i, velocity, change, moved))
        };
        let tolerances: Vec<_> = wet.into_par_iter().flat_map_iter(of_cell).collect();
        let (mut velocities, mut carried) = (Vec::new(), Vec::new());
        let (mut shifts, mut affine) = (Vec::new(), Vec::new());
        for (i, velocity, change, moved) in tolerances {
            let tolerance = velocity + change + 4.0 * U * sorted.cloud.velocity[i].length();
            velocities.push(pair(i, given.velocity[i], twin.velocity[i], tolerance));
            carried.push(pair(i, given.carried[i], twin.carried[i], velocity));
            if has_shift {
                shifts.push(pair(i, given.displacement[i], twin.displacement[i], moved));
            }
            if let (Some(found), Some(exact)) = (given.affine.get(i), twin.affine.get(i)) {
                let tolerance = 2.0 * velocity / self.model.cell_size();
                for row in 0..3 {
                    let pair = pair(i, found.row(row), exact.row(row), tolerance);
                    affine.push(pair);
                }
            }
        }
        self.table.add(&GIVEN, &velocities, 0);
        self.table.add(&CARRIED, &carried, 0);
        if !affine.is_empty() {
            self.table.add(&GIVEN_AFFINE, &affine, 0);
        }
        if has_shift {
            self.table.add(&SHIFT, &shifts, 0);
        }
        self.given = Some(given);
        Ok(())
    }

    /// What the device gave each particle.
    fn read_given(&self, traced: Traced<'_>) -> Result<Given, SolveError> {
        let width = if self.model.settings().density_correction {
            6
        } else {
            3
        };
        let words = traced.read::<f32>("carried", width * self.n)?;
        let at = |row: &[f32], first: usize| {
            DVec3::from_array(std::array::from_fn(|k| f64::from(row[first + k])))
        };
        let rows = || words.chunks_exact(width);
        let names = ["position", "velocity", "id", "affine"];
        let cloud = self.read_cloud(traced, names)?;
        Ok(Given {
            velocity: cloud.velocity,
            affine: cloud.affine,
            carried: rows().map(|row| at(row, 0)).collect(),
            displacement: rows()
                .map(|row| if width == 6 { at(row, 3) } else { DVec3::ZERO })
                .collect(),
        })
    }

    pub(super) fn advect(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let Some(given) = self.given.take() else {
            return Ok(());
        };
        let faces = self.planes(traced, "face_velocity")?;
        let Layout { bricks, .. } = self.layout();
        let step = self.step();
        let start = &self.sorted().cloud.position;
        let go = |start: &[DVec3]| advect(&self.model, &step, bricks, start, &faces, &given);
        let twin = go(start);
        let fastest = faces.iter().map(|v| v.length()).fold(0.0, f64::max);
        let among_solids = self.distance_error();
        // What is left of a velocity that a solid stops has the rounding of the two that were subtracted.
        let among = f64::from(u8::from(!step.solids.is_empty()));
        let solids = step.solids.iter().map(|s| s.velocity.length());
        let solids = solids.fold(0.0, f64::max);
        let reach =
            |x: &DVec3| U * (8.0 * x.length() + 30.0 * step.length * fastest) + among_solids;
        let mut answers: Vec<Moved> = Vec::new();
        for axis in DVec3::AXES {
            for side in [axis, -axis] {
                let moved: Vec<_> = start.iter().map(|x| *x + side * reach(x)).collect();
                answers.push(go(&moved));
            }
        }
        let position = self.vectors(traced, "position")?;
        let velocity = self.vectors(traced, "velocity")?;
        let answer = |of: &dyn Fn(&Moved) -> f64| -> f64 {
            answers
                .chunks(2)
                .map(|pair| of(&pair[0]).max(of(&pair[1])))
                .sum()
        };
        let (mut places, mut speeds) = (Vec::new(), Vec::new());
        for i in 0..self.n {
            let (x, v) = (twin.position[i], twin.velocity[i]);
            let of_x = answer(&|moved| moved.position[i].distance(x)) + U * x.length();
            let speeds_in = given.velocity[i].length() + solids;
            let of_v = answer(&|moved| moved.velocity[i].distance(v))
                + 8.0 * U * (v.length() + among * speeds_in);
            places.push(pair(i, position[i], x, of_x));
            speeds.push(pair(i, velocity[i], v, of_v));
        }
        let capped = f64::from(traced.counters()?.capped) - f64::from(self.capped);
        let exact = twin.capped as f64;
        let slack = answer(&|moved| (moved.capped as f64 - exact).abs());
        let ids = traced.read::<u32>("id", self.n)?;
        let sorted_ids = self.sorted().cloud.id.clone();
        self.table.add(&MOVED, &places, 0);
        self.table.add(&ADVECTED, &speeds, 0);
        self.table
            .add(&CAPPED, &[pair_of(0, capped, exact, slack)], 0);
        self.table.add_exact(&MOVED_ID, &ids, &sorted_ids);
        Ok(())
    }
}
