//! Absorbing wave makers: reading their settings, and their positions including the absorber state.

use glam::DVec3;

use super::{
    Scene, WaveMaker, document::Document, error::SceneError, spec::AbsorptionSpec, words::shown,
};
use swell_domain::{
    absorber::{AbsorberState, AbsorberStates, MOST},
    absorption::{AbsorberParameters as Asked, Absorption, MOST_GAIN, level_along},
    bounds::Bounds,
    motion::Motion,
    particles::Particles,
};

/// Reads and checks the table at `path` for a wall normal to `axis`, with frames of `seconds`.
pub(super) fn build(
    doc: &Document<'_>,
    path: &str,
    (spec, axis): (&AbsorptionSpec, usize),
    (gravity, seconds): (DVec3, f64),
) -> Result<Absorption, SceneError> {
    if axis == 1 || gravity.x != 0.0 || gravity.z != 0.0 || gravity.y >= 0.0 {
        let problem = "a wall absorbs by the water's level, so it has to face x or z, and gravity \
            has to point straight down";
        return Err(doc.fault_of_plain(path, problem));
    }
    let absorption = Absorption::new(Asked {
        room: spec.room,
        depth: spec.depth,
        period: spec.period,
        gravity: gravity.length(),
    });
    let gain = absorption.gain();
    if gain * seconds > MOST_GAIN {
        let problem = format!(
            "the wall reacts once a frame, and on {} m of water that has to be at least {:.1} \
             times a second; raise shot.frames_per_second",
            shown(spec.depth),
            gain / MOST_GAIN
        );
        return Err(doc.fault_of_plain(path, problem));
    }
    Ok(absorption)
}

impl WaveMaker {
    /// Returns the inward displacement from the domain's face at time `t`, metres.
    pub(super) fn displacement(&self, absorber: Option<&AbsorberState>, t: f64) -> f64 {
        let off = absorber.map_or(0.0, |absorber| absorber.state(t).0);
        self.room() + self.motion.displacement(t) + off
    }

    /// Bounds the speed between two times, m/s, including the absorber's motion.
    pub(super) fn peak_speed(&self, absorber: Option<&AbsorberState>, t0: f64, t1: f64) -> f64 {
        let off = absorber.map_or(0.0, |absorber| absorber.peak_speed(t0, t1));
        self.motion.peak_speed(t0, t1) + off
    }

    /// Returns how far inside the domain's face the wall starts, metres: the largest displacement
    /// that absorption may add.
    pub fn room(&self) -> f64 {
        self.absorption.as_ref().map_or(0.0, |it| it.asked().room)
    }

    /// Returns the largest inward displacement until `t`, metres.
    pub(super) fn farthest(&self, t: f64) -> f64 {
        2.0 * self.room() + self.motion.peak_displacement(t)
    }
}

impl Scene {
    /// Returns the wave makers with their absorber states.
    pub(super) fn makers(&self) -> impl Iterator<Item = (&WaveMaker, Option<&AbsorberState>)> {
        let absorbers = self.absorbers.iter().map(Option::as_ref);
        self.wave_makers.iter().zip(absorbers)
    }

    /// Returns the scene with the absorber states of `state`.
    #[must_use]
    pub fn after(&self, state: &Particles) -> Self {
        let mut scene = self.clone();
        scene.take_absorbers(state);
        scene
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

    /// Takes over the absorber states of `state`.
    pub fn take_absorbers(&mut self, state: &Particles) {
        self.absorbers = self.absorbers_in(state);
    }

    /// Returns the absorber states in `state` for the walls that absorb in this scene.
    pub(super) fn absorbers_in(&self, state: &Particles) -> AbsorberStates {
        let mut absorbers = state.walls;
        for (k, absorber) in absorbers.iter_mut().enumerate() {
            let maker = self.wave_makers.get(k);
            *absorber = absorber.filter(|_| maker.is_some_and(|maker| maker.absorption.is_some()));
        }
        absorbers
    }

    /// Updates the absorber states from the water at the end of `frame`, and stores
    /// them in `state`.
    pub fn update_absorbers(&mut self, state: &mut Particles, frame: u32) {
        self.absorbers = self.absorbers_after(state, self.shot.time(frame));
        state.walls = self.absorbers;
    }

    fn absorbers_after(&self, state: &Particles, time: f64) -> AbsorberStates {
        let mut absorbers = AbsorberStates::default();
        let walls = self.walls(time);
        // Along a periodic axis the water ends at the domain.
        let (min, max) = (self.domain.min, self.domain.max);
        let room = Bounds {
            min: (min + walls.min).max(min),
            max: (min + walls.max).min(max),
        };
        for ((maker, before), absorber) in self.makers().zip(&mut absorbers) {
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

/// Rejects a wall that neither moves nor absorbs.
pub(super) fn check_still(
    doc: &Document<'_>,
    path: &str,
    motion: &Motion,
    absorption: Option<&Absorption>,
) -> Result<(), SceneError> {
    match (motion, absorption) {
        (Motion::Still, None) => {
            let problem =
                "a wall that neither makes nor absorbs waves; give it wave_maker.absorption";
            Err(doc.fault_of(&format!("{path}.kind"), problem))
        }
        _ => Ok(()),
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
        let absorbers = scene.absorbers_in(state);
        let makers = scene.wave_makers.iter().zip(&absorbers);
        for ((maker, absorber), count) in makers.zip(&mut self.0) {
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const SCENE: &str = r#"
[shot]
name = "a"
frames = 10
frames_per_second = 20
[domain]
min = [0, 0, 0]
max = [4, 1, 0.5]
[[water.block]]
min = [0, 0, 0]
max = [4, 0.4, 0.5]
[[wave_maker]]
wall = "+x"
motion = { kind = "still" }
absorption = { depth = 0.4, period = 1.14, room = 0.3 }
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
cfl = 1.0
"#;

    /// A wall that makes no waves and moves only as it absorbs: 1.2 m/s, and 2.2 m/s at the end
    /// of a tenth of a second at 10 m/s². Without its state it is at rest.
    #[test]
    fn the_speed_of_an_absorbing_wall_counts() {
        let mut scene =
            Scene::parse(SCENE, Path::new("s.toml"), Path::new(""), &[]).expect("valid");
        let substeps = |scene: &Scene| {
            let first = scene.flip_substep(1, 0.0, 0.05, 0.0, (0, 0.0));
            first.expect("few").0
        };
        assert_eq!(scene.peak_boundary_speed(0.0, 0.1), 0.0);
        let at_rest = substeps(&scene);
        scene.absorbers[0] = Some(AbsorberState {
            start: 0.0,
            displacement: 0.0,
            velocity: 1.2,
            acceleration: 10.0,
            level: None,
            mean: 0.0,
        });
        assert!((scene.peak_boundary_speed(0.0, 0.1) - 2.2).abs() < 1e-12);
        // 1.7 m/s for 0.05 s are 0.085 m and gravity adds 0.025 m: more than a cell.
        assert_eq!((at_rest, substeps(&scene)), (1.0, 2.0));
    }
}
