//! How long a substep is, where the walls then stand, and what is reported of a frame.

use glam::DVec3;

use super::Scene;
use crate::domain::{
    bounds::Bounds,
    budget::{Breach, Watched},
    particles::Particles,
    probe::energies,
    solver::StepReport,
};

/// A piece of a frame, as FLIP takes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Substep {
    /// Seconds from the shot's start.
    pub start: f64,
    /// Seconds.
    pub length: f64,
    /// Most cells that a particle moves, as its speed, gravity, walls and solids have it.
    pub displacement: f64,
}

impl Scene {
    /// The box's faces at `time`, wave makers included, relative to the domain's least corner, metres.
    pub fn walls(&self, time: f64) -> Bounds {
        let (mut min, mut max) = (DVec3::ZERO, self.domain.size());
        for maker in &self.wave_makers {
            let inward = maker.motion.displacement(time);
            if maker.wall.is_max {
                max[maker.wall.axis] -= inward;
            } else {
                min[maker.wall.axis] += inward;
            }
        }
        Bounds { min, max }
    }

    /// What takes each face of the box in `step` seconds to where it stands at `time`, along its axis, m/s; 0 where `step`
    /// is.
    pub fn wall_velocity(&self, time: f64, step: f64) -> Bounds {
        let (before, after) = (self.walls(time - step), self.walls(time));
        let speed = |after: DVec3, before: DVec3| match step {
            0.0 => DVec3::ZERO,
            step => (after - before) / step,
        };
        Bounds {
            min: speed(after.min, before.min),
            max: speed(after.max, before.max),
        }
    }

    /// Whether a wall or a solid moves, and so does work on the water.
    pub fn has_movers(&self) -> bool {
        !self.wave_makers.is_empty() || !self.moving_solids.is_empty()
    }

    /// Equal substeps that PBF's CFL number asks of the frame after `frame`: from the fastest particle, `speed` in
    /// m/s, what gravity adds within the frame, and the fastest wave maker.
    ///
    /// # Errors
    /// Where they are more than `max_substeps`.
    pub fn pbf_substeps(&self, frame: u32, speed: f64) -> Result<u32, Breach> {
        let pbf = self.solver.pbf();
        let length = self.shot.frame_seconds();
        let start = f64::from(frame) * length;
        let wall = self
            .wave_makers
            .iter()
            .map(|w| w.motion.peak_speed(start, start + length));
        let speed = wall.fold(speed + self.water.gravity.length() * length, f64::max);
        let wanted = (speed * length / (pbf.cfl * pbf.particle_spacing))
            .ceil()
            .max(1.0);
        if wanted > f64::from(pbf.max_substeps) {
            let most = f64::from(pbf.max_substeps);
            let detail = format!("{speed:.3} m/s at solver.pbf.cfl {}", pbf.cfl);
            return Err(Breach {
                detail: Some(detail),
                ..Breach::new(frame + 1, Watched::Substeps, wanted, most)
            });
        }
        Ok(wanted as u32)
    }

    /// How many equal substeps FLIP's CFL number asks of the `remaining` seconds from `start` on, where the fastest
    /// particle has `speed`, m/s, and the first of them; `done` substeps of `frame` are over.
    ///
    /// # Errors
    /// Where the frame's are more than `max_substeps`.
    pub fn flip_substep(
        &self,
        frame: u32,
        start: f64,
        remaining: f64,
        speed: f64,
        done: u32,
    ) -> Result<(f64, Substep), Breach> {
        let flip = self.solver.flip();
        let fastest = speed.max(self.peak_boundary_speed(start, start + remaining));
        let gravity = self.water.gravity.length();
        // v t + g t² = cfl Δx.
        let room = flip.cfl * flip.cell_size;
        let longest = 2.0 * room / (fastest + (fastest * fastest + 4.0 * gravity * room).sqrt());
        let wanted = if longest.is_finite() {
            (remaining / longest).ceil().max(1.0)
        } else {
            1.0
        };
        let length = remaining / wanted;
        let reached = fastest + gravity * length;
        if f64::from(done) + wanted > f64::from(flip.max_substeps) {
            let detail = format!(
                "up to {reached:.3} m/s, particles {speed:.3}, with gravity, wave makers and moving solids, at \
                 solver.flip.cfl {}",
                flip.cfl
            );
            let (asked, most) = (f64::from(done) + wanted, f64::from(flip.max_substeps));
            return Err(Breach {
                detail: Some(detail),
                ..Breach::new(frame, Watched::Substeps, asked, most).in_substep(done + 1)
            });
        }
        let displacement = reached * length / flip.cell_size;
        let substep = Substep {
            start,
            length,
            displacement,
        };
        Ok((wanted, substep))
    }

    /// α of a FLIP substep of `length` seconds, so that a frame takes the same part of the grid's velocity in however
    /// many substeps: 1 − (1 − α)^(Δt / frame). At a fixed α halving Δt would double the dissipation. Effects take
    /// their part beside it.
    pub fn substep_pic_blend(&self, length: f64) -> f64 {
        let effects = self.effects.flip_plans(0);
        let kept: f64 = effects.iter().map(|effect| 1.0 - effect.blend).product();
        let kept = (1.0 - self.solver.flip().pic_blend) * kept;
        1.0 - kept.powf(length / self.shot.frame_seconds())
    }

    /// Energies of a state, and the errors of relative densities; sums run in order. What the steps did is left at 0.
    pub fn report(&self, state: &Particles, density: impl Iterator<Item = f64>) -> StepReport {
        let mass = self.particle_mass();
        let (kinetic, potential) = energies(state, mass, self.water.gravity, self.domain.min);
        let mut errors: Vec<f64> = density.map(|rho| (rho - 1.0).max(0.0)).collect();
        // From 0: an empty sum is -0.
        let mean = errors.iter().fold(0.0, |sum, error| sum + error) / errors.len().max(1) as f64;
        errors.sort_unstable_by(f64::total_cmp);
        let percentile = |p: f64| {
            errors
                .get(((errors.len() as f64 * p).ceil() as usize).saturating_sub(1))
                .copied()
        };
        StepReport {
            substeps: 0,
            iterations: 0,
            density_error_mean: mean,
            density_error_p99: percentile(0.99).unwrap_or(0.0),
            density_error_max: percentile(1.0).unwrap_or(0.0),
            kinetic_energy: kinetic,
            potential_energy: potential,
            max_speed: state.max_speed(),
            capped: 0,
            searched: 0,
            boundary_work: 0.0,
            volume: None,
            projection: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_report_has_the_tails_of_the_density_and_the_energies() {
        let text = r#"
            shot = { name = "tank", frames = 4, frames_per_second = 60 }
            domain = { min = [0, -1, 0], max = [1, 1, 1] }
            solver = { method = "pbf", pbf = { particle_spacing = 0.1 } }
            [[water.block]]
            min = [0, -1, 0]
            max = [1, 0, 1]
        "#;
        let scene = Scene::parse(text, Path::new("s.toml"), Path::new(""), &[]).expect("valid");
        let state = Particles {
            position: vec![[0.5, -0.5, 0.5], [0.5, 0.25, 0.5]],
            velocity: vec![[3.0, 0.0, -4.0], [0.0, 2.0, 0.0]],
            id: vec![0, 1],
            ..Particles::default()
        };
        // 0.900 to 1.099 in no order: what is below 1 is no error.
        let density = |k: u32| 0.9 + 0.001 * f64::from(k);
        let shuffled = (0..200).map(|k| density(37 * k % 200));
        let report = scene.report(&state, shuffled);
        assert_eq!(report.density_error_p99, density(197) - 1.0);
        assert_eq!(report.density_error_max, density(199) - 1.0);
        // A sum of 200 values up to 0.1 in another order.
        let mean = 0.001 * f64::from((0..100).sum::<u32>()) / 200.0;
        assert!((report.density_error_mean - mean).abs() < 200.0 * f64::EPSILON);
        assert_eq!(report.max_speed, 5.0);
        // 1 kg each, but for the roundings of 1000 · 0.1³; heights are above the floor.
        let near = |value: f64, expected: f64| (value / expected - 1.0).abs() < 8.0 * f64::EPSILON;
        assert!(near(report.kinetic_energy, 0.5 * (25.0 + 4.0)));
        assert!(near(report.potential_energy, 9.81 * (0.5 + 1.25)));
    }
}
