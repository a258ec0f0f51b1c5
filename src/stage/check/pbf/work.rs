//! What moving walls do on the particles, over m / Δt².

use crate::{
    compare::{check::Pair, rounding::U},
    reference::pbf::passes,
    solve::{SolveError, trace::Traced},
};

use super::{Checker, fields::*, pair_of, wide};

impl Checker<'_> {
    /// Largest speed of a wall, m/s.
    fn wall_speed(&self) -> f64 {
        let velocity = &self.substep.wall_velocity;
        velocity.min.abs().max(velocity.max.abs()).max_element()
    }

    /// What a pass adds to; kept until it has run.
    pub(super) fn read_work(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        self.work = match traced.pass {
            "pbf/compute_delta" => traced.read("wall_work", self.n())?,
            "pbf/boundary_work" => traced.read("boundary_work", self.n().div_ceil(64))?,
            _ => Vec::new(),
        };
        Ok(())
    }

    /// By the prediction: `push_error` of what the walls add to each particle's position, metres.
    pub(super) fn predict_work(
        &mut self,
        traced: Traced<'_>,
        push_error: &[f64],
    ) -> Result<(), SolveError> {
        let n = self.n();
        let work = traced.read::<f32>("wall_work", 2 * n)?;
        let (position, velocity) = (&self.vectors["position"], &self.vectors["velocity"]);
        let speed = self.wall_speed();
        let pairs: Vec<Pair<f64>> = (0..n)
            .map(|i| {
                let (x, v) = (wide(&position[i]), wide(&velocity[i]));
                let (_, _, twin) = passes::predict_and_work(&self.model, &self.substep, x, v);
                let error = 3.0 * speed * (push_error[i] + U * x.length()) + 4.0 * U * twin.abs();
                pair_of(i, f64::from(work[n + i]), twin, error)
            })
            .collect();
        self.table.add(&PREDICT_WORK, &pairs, 0);
        Ok(())
    }

    /// By a correction of particle `i`, after which `wall_work` is `after`: the twin added `added`. `error` is that of the
    /// correction and of what the walls push, metres.
    pub(super) fn delta_work(&self, i: usize, after: f32, added: f64, error: f64) -> Pair<f64> {
        let (before, after) = (f64::from(self.work[i]), f64::from(after));
        let tolerance = 3.0 * self.wall_speed() * error
            + 2.0 * U * (before.abs() + after.abs())
            + 16.0 * U * added.abs();
        pair_of(i, after, before + added, tolerance)
    }

    pub(super) fn boundary_work(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        let work = traced.read::<f32>("wall_work", 2 * n)?;
        let sums = traced.read::<f32>("boundary_work", n.div_ceil(64))?;
        let pairs: Vec<_> = (sums.iter().zip(&self.work).enumerate())
            .map(|(group, (&after, &before))| {
                let terms = 64 * group..(64 * group + 64).min(n);
                let term = |i: usize| f64::from(work[i]) + f64::from(work[n + i]);
                let sum: f64 = terms.clone().map(term).sum();
                let sizes: f64 = terms
                    .map(|i| f64::from(work[i].abs() + work[n + i].abs()))
                    .sum();
                let before = f64::from(before);
                let tolerance = U * (66.0 * sizes + before.abs() + f64::from(after).abs());
                pair_of(group, f64::from(after), before + sum, tolerance)
            })
            .collect();
        self.table.add(&WORK, &pairs, 0);
        Ok(())
    }
}
