//! Absorbing wave makers: their positions including the absorber state.

use glam::DVec3;

use super::{Scene, WaveMaker, words::shown};
use swell_domain::{
    absorber::{AbsorberState, AbsorberStates, MOST},
    absorption::level_along,
    bounds::Bounds,
    particles::Particles,
};

impl WaveMaker {
    /// Returns the inward displacement from the domain's face at time `t`, metres.
    pub fn displacement(&self, absorber: Option<&AbsorberState>, t: f64) -> f64 {
        let off = self.absorbing(absorber).map_or(0.0, |it| it.state(t).0);
        self.room() + self.motion.displacement(t) + off
    }

    /// Returns the state if the wall absorbs; a branch may start from walls that do where its own
    /// do not.
    fn absorbing<'a>(&self, absorber: Option<&'a AbsorberState>) -> Option<&'a AbsorberState> {
        absorber.filter(|_| self.absorption.is_some())
    }

    /// Bounds the speed between two times, m/s, including the absorber's motion.
    pub(super) fn peak_speed(&self, absorber: Option<&AbsorberState>, t0: f64, t1: f64) -> f64 {
        let off = self
            .absorbing(absorber)
            .map_or(0.0, |it| it.peak_speed(t0, t1));
        self.motion.peak_speed(t0, t1) + off
    }

    /// Returns how far inside the domain's face the wall starts, metres: the largest displacement
    /// that absorption may add.
    pub fn room(&self) -> f64 {
        self.absorption.as_ref().map_or(0.0, |it| it.asked().room)
    }

    /// Returns the largest inward displacement until `t`, metres.
    pub fn farthest(&self, t: f64) -> f64 {
        2.0 * self.room() + self.motion.peak_displacement(t)
    }
}

impl Scene {
    /// Returns the wave makers with their states of `absorbers`.
    pub fn makers<'a>(
        &'a self,
        absorbers: &'a AbsorberStates,
    ) -> impl Iterator<Item = (&'a WaveMaker, Option<&'a AbsorberState>)> {
        let absorbers = absorbers.iter().map(Option::as_ref);
        self.wave_makers.iter().zip(absorbers)
    }

    /// Maps the absorber states of another scene, wall by wall, to the absorbing walls of this one.
    /// The strings explain which walls could not take over their state.
    pub fn carried(
        &self,
        other: &Self,
        absorbers: &AbsorberStates,
    ) -> (AbsorberStates, Vec<String>) {
        let (mut carried, mut notes) = (AbsorberStates::default(), Vec::new());
        for ((k, maker), absorber) in self.wave_makers.iter().enumerate().zip(&mut carried) {
            let mut theirs = other.wave_makers.iter().zip(absorbers);
            let theirs = theirs.find(|(their, _)| their.wall == maker.wall);
            let Some(found) = theirs.and_then(|(_, absorber)| *absorber) else {
                continue;
            };
            match &maker.absorption {
                Some(it) if found.displacement.abs() <= it.asked().room => *absorber = Some(found),
                _ => notes.push(format!(
                    "wave_maker[{k}]: the wall {} was {} m away from its own path and begins on it",
                    maker.wall.name(),
                    shown(found.displacement)
                )),
            }
        }
        (carried, notes)
    }

    /// Updates the absorber states in `state` from its water, which is that at the end of `frame`.
    pub fn update_absorbers(&self, state: &mut Particles, frame: u32) {
        state.walls = self.absorbers_after(state, self.shot.time(frame));
    }

    /// Returns whether a wall absorbs: [`Self::update_absorbers`] then needs the water.
    pub fn has_absorbers(&self) -> bool {
        self.wave_makers.iter().any(|it| it.absorption.is_some())
    }

    fn absorbers_after(&self, state: &Particles, time: f64) -> AbsorberStates {
        let mut absorbers = AbsorberStates::default();
        let walls = self.walls(&state.walls, time);
        // Along a periodic axis the water ends at the domain.
        let (min, max) = (self.domain.min, self.domain.max);
        let room = Bounds {
            min: (min + walls.min).max(min),
            max: (min + walls.max).min(max),
        };
        for ((maker, before), absorber) in self.makers(&state.walls).zip(&mut absorbers) {
            let Some(absorption) = &maker.absorption else {
                continue;
            };
            let wall = (maker.wall.axis, maker.wall.is_max);
            let still = min.y + absorption.asked().depth;
            let level = level_along(state, self.particle_spacing(), &room, wall);
            let level = level.map(|level| level - still);
            let span = (time, self.shot.frame_seconds());
            *absorber = Some(absorption.next_state(&maker.motion, before, span, level));
        }
        absorbers
    }

    /// Returns the part of the domain between the walls at the start, metres.
    pub fn start_domain(&self) -> Bounds {
        let mut domain = self.domain;
        for maker in &self.wave_makers {
            let mut inward = DVec3::ZERO;
            inward[maker.wall.axis] = maker.room();
            match maker.wall.is_max {
                true => domain.max -= inward,
                false => domain.min += inward,
            }
        }
        domain
    }
}

/// Counts the frames in which absorbing walls are at the end of their allowed displacement.
#[derive(Default)]
pub struct Held([u32; MOST]);

/// Fraction of the allowed displacement from which a wall counts as at its end.
const AT_THE_END: f64 = 0.99;

impl Held {
    /// Counts a frame, given the state at its end.
    pub fn add(&mut self, scene: &Scene, state: &Particles) {
        for ((maker, absorber), count) in scene.makers(&state.walls).zip(&mut self.0) {
            let off = absorber.map_or(0.0, |absorber| absorber.displacement.abs());
            *count += u32::from(maker.absorption.is_some() && off > AT_THE_END * maker.room());
        }
    }

    /// Returns a warning for each wall that was at its end in any frame.
    pub fn warnings(&self) -> Vec<String> {
        let held = self.0.iter().enumerate().filter(|(_, count)| **count > 0);
        held.map(|(k, count)| {
            format!(
                "wave_maker[{k}].absorption.room: the wall was at the end of its range in {count} \
                 frames and reflected waves; raise it"
            )
        })
        .collect()
    }
}
