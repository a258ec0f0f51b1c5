//! Length of a substep, positions of the walls at a time, and the report of a frame.

use glam::DVec3;

use super::{FlipScene, PbfScene, Scene, moving_solid::FreeBody};
use swell_domain::{
    absorber::AbsorberStates,
    body::BodyState,
    bounds::{Bounds, FAR},
    budget::{Breach, Watched},
    particles::Particles,
    probe::energies,
    solver::StepReport,
    statistics::percentile,
};

/// One substep of FLIP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Substep {
    /// Start, seconds from the start of the shot.
    pub start: f64,
    /// Length, seconds.
    pub length: f64,
    /// Time over which forces and drag act, seconds: half of the previous substep plus half of this
    /// one, which centres velocities in the substep whatever the lengths (leapfrog).
    pub kick: f64,
    /// Bound on a particle's displacement, cells: own speed, gravity, forces, effects, walls and
    /// solids.
    pub displacement: f64,
}

/// Displacement, cells, up to which velocities are extrapolated when particles stay within a cell.
const WITHIN_CELLS: f64 = 1.0;

/// Time over which forces act between a substep of `before` seconds (0 if there was none) and one
/// of `length`: half of each. Velocities are then at mid-substep and positions at the ends of
/// substeps (leapfrog; Hairer, Lubich and Wanner 2006, §I.1.4).
///
/// With the substep's own length, waves whose speed determines the substeps would lose ω Δt / 4 of
/// their amplitude in each swing. The start counts as the end of a substep as long as the first.
fn kick(before: f64, length: f64) -> f64 {
    if before > 0.0 {
        0.5 * (before + length)
    } else {
        length
    }
}

impl Substep {
    /// Returns the start and the length of the time over which forces act: from the middle of the
    /// previous substep to that of this one, seconds.
    pub fn kick_span(&self) -> (f64, f64) {
        (self.start + 0.5 * self.length - self.kick, self.kick)
    }
}

/// Returns the substep of a projection of which only the velocities are used, after a substep of
/// `before` seconds; times in seconds.
pub fn projected_substep(start: f64, length: f64, before: f64) -> Substep {
    Substep {
        start,
        length,
        kick: kick(before, length),
        displacement: WITHIN_CELLS,
    }
}

/// Cells that a body may move in a substep, and the surface of a solid whose shape changes. The
/// projection knows where a body stands at the substep's start: one that goes farther, or that a
/// contact stops after the projection, packs the water between it and what is near too densely. Of
/// a surface, distances are linear within a substep: a solid thinner than its path would open.
const BODY_CELLS: f64 = 0.5;

impl Scene {
    /// Returns the faces of the box at `time` including wave makers, relative to the domain's least
    /// corner, metres; ±[`FAR`] along periodic axes.
    pub fn walls(&self, absorbers: &AbsorberStates, time: f64) -> Bounds {
        let (mut min, mut max) = (DVec3::ZERO, self.domain.size());
        for axis in (0..3).filter(|&axis| self.periodic[axis]) {
            (min[axis], max[axis]) = (-FAR, FAR);
        }
        for (maker, absorber) in self.makers(absorbers) {
            let inward = maker.displacement(absorber, time);
            if maker.wall.is_max {
                max[maker.wall.axis] -= inward;
            } else {
                min[maker.wall.axis] += inward;
            }
        }
        Bounds { min, max }
    }

    /// Returns the mean velocity of each face over the `step` seconds before `time`, along its
    /// axis, m/s; 0 if `step` is 0.
    pub fn wall_velocity(&self, absorbers: &AbsorberStates, time: f64, step: f64) -> Bounds {
        let [before, after] = [time - step, time].map(|time| self.walls(absorbers, time));
        let speed = |after: DVec3, before: DVec3| match step {
            0.0 => DVec3::ZERO,
            step => (after - before) / step,
        };
        Bounds {
            min: speed(after.min, before.min),
            max: speed(after.max, before.max),
        }
    }

    /// Whether any wall or solid moves and so does work on the water.
    pub fn has_movers(&self) -> bool {
        !self.wave_makers.is_empty() || !self.moving_solids.is_empty()
    }

    /// Whether moving boundaries or emitters without a level do work on FLIP's water.
    pub fn is_worked_on(&self) -> bool {
        self.has_movers() || self.has_inlets()
    }

    /// Returns the time from `start`, where a substep of `length` begins, to the end of its frame,
    /// seconds; never less than `length`.
    pub fn seconds_left(&self, start: f64, length: f64) -> f64 {
        let frame = self.shot.frame_seconds();
        // Starts accumulate rounding errors.
        let before = (start / frame + 1e-6).floor();
        ((before + 1.0) * frame - start).max(length)
    }

    /// Returns the longest substep of a grid projection for surface waves under an acceleration g,
    /// m/s²: √(Δx / g) seconds; infinite without one. Waves of two cells have ω² of about
    /// 1.4 g / Δx on the grid (up to 4.8 g / Δx where the surface is near cells' centres) and are
    /// stable for ω Δt < 2. In longer substeps they make noise in slow water.
    fn longest_wave_step(&self, acceleration: f64) -> f64 {
        (self.solver.cell_size() / acceleration).sqrt()
    }

    /// Describes the step limits of surface waves, if they are the narrowest, and of effects, as
    /// the end of a message.
    fn stable_step(&self, of_waves: Option<f64>) -> String {
        let of_waves = of_waves.map_or_else(String::new, |longest| {
            format!(", for surface waves of two cells no longer than {longest:.3e} s")
        });
        match self.effects.longest_step(self.grain()) {
            (longest, name) if longest.is_finite() => {
                format!("{of_waves}, and at effects.{name} no longer than {longest:.3e} s")
            }
            _ => of_waves,
        }
    }

    /// Returns the position of the densest particle, given all relative densities; world
    /// coordinates, metres.
    pub fn densest_particle(&self, state: &Particles, density: &[f64]) -> Option<[f64; 3]> {
        let both = state.position.iter().zip(density);
        let densest = both.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let place = DVec3::from(densest.0.map(f64::from));
        Some((self.origin + place).to_array())
    }

    /// Returns the centre of the densest cell of FLIP's grid, given all relative densities; world
    /// coordinates, metres.
    pub fn densest_cell(&self, cells: impl Iterator<Item = ([u32; 3], f64)>) -> Option<[f64; 3]> {
        let (cell, _) = cells.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let middle = DVec3::from(cell.map(|k| f64::from(k) + 0.5));
        let place = self.domain.min + middle * self.solver.cell_size();
        Some((self.origin + place).to_array())
    }

    /// Returns the energies and density errors of a state, summed in order; counts of steps are 0.
    pub fn report(
        &self,
        state: &Particles,
        density: impl Iterator<Item = f64> + Send,
    ) -> StepReport {
        let (mass, gravity) = (self.particle_mass(), self.water.gravity);
        let motion = || {
            let (kinetic, potential) = energies(state, mass, gravity, self.domain.min);
            (kinetic, potential, state.max_speed())
        };
        let ((kinetic, potential, max_speed), errors) =
            rayon::join(motion, || density_errors(density));
        let [mean, p99, max] = errors;
        StepReport {
            substeps: 0,
            iterations: 0,
            density_error_mean: mean,
            density_error_p99: p99,
            density_error_max: max,
            kinetic_energy: kinetic,
            potential_energy: potential,
            max_speed,
            capped: 0,
            searched: 0,
            boundary_work: 0.0,
            volume: None,
            projection: None,
            exchange: None,
            densest_at: None,
        }
    }
}

/// Mean, 99th percentile and maximum of max(0, ρ/ρ0 − 1).
fn density_errors(density: impl Iterator<Item = f64>) -> [f64; 3] {
    let errors: Vec<f64> = density.map(|rho| (rho - 1.0).max(0.0)).collect();
    // The folds start at 0 because an empty `sum` is −0.
    let (sum, max) = (errors.iter()).fold((0.0, 0.0), |(sum, most), &error| {
        (sum + error, f64::max(most, error))
    });
    let mean = sum / errors.len().max(1) as f64;
    [mean, percentile(errors, 0.99).unwrap_or(0.0), max]
}

impl PbfScene<'_> {
    /// Returns the number of equal substeps that PBF's CFL number, and short surface waves with its
    /// projection (Δt ≤ √(Δx / g)), require in the frame after `frame`, for a fastest particle of
    /// `speed`, m/s, gravity, forces, effects, wave makers and solids.
    ///
    /// # Errors
    /// If there are more than `max_substeps`.
    pub fn pbf_substeps(
        &self,
        (absorbers, bodies): (&AbsorberStates, &[BodyState]),
        frame: u32,
        speed: f64,
    ) -> Result<u32, Breach> {
        let pbf = self.settings();
        let length = self.shot.frame_seconds();
        let start = f64::from(frame) * length;
        let pull = self.most_acceleration(start, start + length);
        let jump = self.jump_of_domain(start, start + length);
        let gained = pull * length + jump + self.effects.push().gained(length);
        let solids = self.peak_boundary_speed(absorbers, bodies, start, start + length);
        let speed = solids.max(speed + gained);
        let wanted = (speed * length / (pbf.cfl * pbf.particle_spacing))
            .max(length / self.effects.longest_step(self.grain()).0);
        let longest_wave = self.longest_wave_step(pull);
        let of_waves = match pbf.grid_projection {
            true => length / longest_wave,
            false => 0.0,
        };
        let narrowest = (of_waves > wanted).then_some(longest_wave);
        let wanted = wanted.max(of_waves).ceil().max(1.0);
        if wanted > f64::from(pbf.max_substeps) {
            let most = f64::from(pbf.max_substeps);
            let stable = self.stable_step(narrowest);
            let detail = format!("{speed:.3} m/s at solver.pbf.cfl {}{stable}", pbf.cfl);
            return Err(Breach {
                detail: Some(detail),
                ..Breach::new(frame + 1, Watched::Substeps, wanted, most)
            });
        }
        Ok(wanted as u32)
    }
}

/// Cells in a substep by which contacts may change a body's motion before the water is projected
/// again. A body at rest on the floor would else drive the water around it by the weight that the
/// floor bears.
const CONTACT_CELLS: f64 = 1e-3;

impl FlipScene<'_> {
    /// Returns which bodies contacts stopped or turned aside, with their states before and after
    /// that, in a substep of `length` seconds.
    pub fn stopped(&self, before: &[BodyState], after: &[BodyState], length: f64) -> Vec<bool> {
        let room = CONTACT_CELLS * self.settings().cell_size;
        let states = before.iter().zip(after);
        let of_body = |(it, (before, after)): (&FreeBody, (&BodyState, &BodyState))| {
            let slower = (after.velocity - before.velocity).length();
            let turned = (after.spin - before.spin).length();
            (slower + it.reach * turned) * length > room
        };
        self.bodies().zip(states).map(of_body).collect()
    }

    /// Returns the longest substep in which no point of a body moves farther than [`BODY_CELLS`],
    /// seconds.
    fn longest_body_step(&self, bodies: &[BodyState]) -> f64 {
        if !self.has_bodies() {
            return f64::INFINITY;
        }
        let room = BODY_CELLS * self.settings().cell_size;
        let (v, g) = (self.fastest_body(bodies), self.water.gravity.length());
        2.0 * room / (v + (v * v + 4.0 * g * room).sqrt())
    }

    /// Returns how many equal substeps FLIP's CFL number and short surface waves (Δt ≤ √(Δx / g))
    /// require in the `remaining` seconds from `start`, and the first of them. The fastest particle
    /// has `speed`, m/s; `done` substeps of `frame` are complete, and the last substep (of any
    /// frame) took `before` seconds.
    ///
    /// # Errors
    /// If the frame has more than `max_substeps`.
    pub fn flip_substep(
        &self,
        (absorbers, bodies): (&AbsorberStates, &[BodyState]),
        frame: u32,
        start: f64,
        remaining: f64,
        speed: f64,
        (done, before): (u32, f64),
    ) -> Result<(f64, Substep), Breach> {
        let flip = self.settings();
        let push = self.peak_boundary_speed(absorbers, bodies, start, start + remaining);
        // Forces act from the middle of the last substep on.
        let pull = self.most_acceleration(start - 0.5 * before, start + remaining);
        let jump = self.jump_of_domain(start - 0.5 * before, start + remaining);
        let fastest = speed.max(push) + jump;
        let push = self.effects.push();
        // Solves v t + g t² = cfl Δx.
        let room = flip.cfl * flip.cell_size;
        let longest = |v: f64, g: f64| 2.0 * room / (v + (v * v + 4.0 * g * room).sqrt());
        // An effect is limited both in acceleration and in speed; the weaker bound
        // on the step holds.
        let by_acceleration = longest(fastest, pull + push.acceleration);
        let longest = by_acceleration.max(longest(fastest + push.speed, pull));
        let longest = longest.min(self.effects.longest_step(self.grain()).0);
        let longest = longest.min(self.longest_body_step(bodies));
        let shapes = self.fastest_shape(start, start + remaining);
        let longest = longest.min(BODY_CELLS * flip.cell_size / shapes);
        let of_waves = self.longest_wave_step(pull);
        let narrowest = (of_waves < longest).then_some(of_waves);
        let longest = longest.min(of_waves);
        let wanted = if longest.is_finite() {
            (remaining / longest).ceil().max(1.0)
        } else {
            1.0
        };
        let length = remaining / wanted;
        let kick = kick(before, length);
        let reached = fastest + (pull * kick + push.gained(kick));
        if f64::from(done) + wanted > f64::from(flip.max_substeps) {
            let detail = format!(
                "up to {reached:.3} m/s, particles {speed:.3}, with gravity, effects, wave makers \
                 and moving solids, at solver.flip.cfl {}{}",
                flip.cfl,
                self.stable_step(narrowest)
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
            kick,
            displacement,
        };
        Ok((wanted, substep))
    }

    /// Returns the PIC blend α of a FLIP substep of `length` seconds, 1 − (1 − α)^(Δt / frame),
    /// where effects add to the frame's α. A fixed α would double the dissipation when Δt halves.
    pub fn substep_pic_blend(&self, length: f64) -> f64 {
        let blends = self.effects.blends().into_iter();
        let kept: f64 = blends.map(|blend| 1.0 - blend).product();
        let kept = (1.0 - self.settings().pic_blend) * kept;
        1.0 - kept.powf(length / self.shot.frame_seconds())
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::kick;

    /// An oscillator with ω Δt = 0.2 (half while it is fast) keeps its amplitude for 100 swings.
    #[test]
    fn a_swing_that_decides_on_its_steps_keeps_its_height() {
        let left = |kick: &dyn Fn(f64, f64) -> f64| {
            let (mut x, mut v, mut before, mut elapsed) = (1.0f64, 0.0f64, 0.0, 0.0);
            let mut highest = 0.0f64;
            while elapsed < 100.0 * PI {
                let length = if v.abs() > 0.7 { 0.1 } else { 0.2 };
                v -= kick(before, length) * x;
                x += length * v;
                (before, elapsed) = (length, elapsed + length);
                if elapsed > 98.0 * PI {
                    highest = highest.max(x.abs());
                }
            }
            highest
        };
        // A step is chosen at its start, which is off the middle in third order: (ω
        // Δt)³ / 8 per swing.
        assert!((left(&kick) - 1.0).abs() < 0.1, "{}", left(&kick));
        // Control: forces over the substep's own length take ω Δt / 4 of each swing until none
        // is fast any more.
        let found = left(&|_, length| length);
        assert!(found < 0.75, "{found}");
    }
}
