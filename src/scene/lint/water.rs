//! Warnings for the initial water and for emitters and drains.

use crate::{
    Scene,
    words::{four_digits, shown},
};
use swell_domain::{bounds::Bounds, sampling::block_dims, sources::Window};

/// Relative difference of a block's volume from that of its whole layers of particles
/// that is tolerated.
const ROUNDED: f64 = 0.02;

impl Scene {
    pub(super) fn lint_water(&self, lints: &mut Vec<String>) {
        self.lint_dry(lints);
        self.lint_blocks(lints);
        self.lint_sources(lints);
    }

    /// Returns the initial water blocks, clipped to the rest positions of absorbing walls
    /// inside the domain.
    pub fn start_blocks(&self) -> Vec<Bounds> {
        let room = self.start_domain();
        let blocks = self.water.blocks.iter();
        blocks.map(|block| block.intersection(&room)).collect()
    }

    /// Returns the volume of water requested at the start, m³: the sum over blocks, meshes and
    /// individual particles, including overlaps and what is inside solids.
    pub fn asked_volume(&self) -> f64 {
        let blocks = self.start_blocks();
        let blocks = blocks
            .iter()
            .map(|block| block.size().max(glam::DVec3::ZERO));
        let blocks: f64 = blocks.map(|size| size.x * size.y * size.z).sum();
        let meshes = self
            .water
            .meshes
            .iter()
            .map(|placed| placed.mesh.capped_volume());
        let particles = self.water.particles.iter().map(|swarm| swarm.at.len());
        let particles = particles.sum::<usize>() as f64 * self.particle_volume();
        blocks + meshes.sum::<f64>() + self.wave_volume() + particles
    }

    /// Returns the volume that a particle represents, m³.
    pub fn particle_volume(&self) -> f64 {
        self.particle_spacing().powi(3)
    }

    /// Warns about a scene without water and emitters.
    fn lint_dry(&self, lints: &mut Vec<String>) {
        let water = &self.water;
        let is_dry = water.blocks.is_empty() && water.meshes.is_empty() && water.waves.is_empty();
        if is_dry && water.particles.iter().all(|it| it.at.is_empty()) && self.emitters.is_empty() {
            lints.push("water: the scene holds no water, and no [[emitter]] brings any".to_owned());
        }
    }

    /// Warns about blocks whose volume differs from that of their particles.
    fn lint_blocks(&self, lints: &mut Vec<String>) {
        let (room, spacing) = (self.start_domain(), self.particle_spacing());
        for (index, block) in self.start_blocks().iter().enumerate() {
            let dims = block_dims(block, &room, spacing);
            let [x, y, z] = dims;
            let (asked, made) = (block.volume(), (x * y * z) as f64 * self.particle_volume());
            let part = made / asked - 1.0;
            if block.size().min_element() > 0.0 && part.abs() > ROUNDED {
                lints.push(format!(
                    "water.block[{index}]: {} m³ are requested and {} m³ are made, {:.1} % {}: it \
                     is filled with whole layers, {x} × {y} × {z} particles",
                    four_digits(asked),
                    four_digits(made),
                    100.0 * part.abs(),
                    if part < 0.0 { "less" } else { "more" }
                ));
            }
        }
    }

    /// Warns about emitters, drains and forces that only act after the shot.
    fn lint_sources(&self, lints: &mut Vec<String>) {
        let mut emitters = self.emitters.iter().map(|it| ("emitter", it.window));
        let mut drains = self.drains.iter().map(|it| ("drain", it.window));
        let duration = self.shot.duration();
        let late = |list: &mut dyn Iterator<Item = (&str, Window)>, lints: &mut Vec<String>| {
            for (index, (name, window)) in list.enumerate() {
                if window.from >= duration {
                    lints.push(format!(
                        "{name}[{index}].from: it begins after {} s, and the shot ends after {} s",
                        shown(window.from),
                        shown(duration)
                    ));
                }
            }
        };
        late(&mut emitters, lints);
        late(&mut drains, lints);
        let forces = self.forces.iter();
        let mut forces = forces.map(|it| ("force", it.force.window));
        late(&mut forces, lints);
        self.lint_rooms(lints);
        self.lint_forces(lints);
    }

    /// Warns about forces without strength.
    fn lint_forces(&self, lints: &mut Vec<String>) {
        for (index, placed) in self.forces.iter().enumerate() {
            if placed.force.kind.most() == 0.0 {
                lints.push(format!("force[{index}]: it is 0 m/s², which moves nothing"));
            }
        }
    }

    /// Warns about emitters that extend behind a wave maker.
    fn lint_rooms(&self, lints: &mut Vec<String>) {
        for (index, emitter) in self.emitters.iter().enumerate() {
            let Bounds { min, max } = emitter.shape.bounds();
            for (k, maker) in self.wave_makers.iter().enumerate() {
                let axis = maker.wall.axis;
                let behind = match maker.wall.is_max {
                    true => max[axis] - (self.domain.max[axis] - maker.room()),
                    false => self.domain.min[axis] + maker.room() - min[axis],
                };
                if behind > 1e-6 {
                    lints.push(format!(
                        "emitter[{index}]: {behind:.3} m of its volume are behind wave_maker[{k}] \
                         at rest, where nothing enters"
                    ));
                }
            }
        }
    }
}
