//! Data that does not change during a bake, and parameters of a substep.

use std::sync::Arc;

use glam::DVec3;

use crate::neighbors::Cells;
use swell_domain::{
    absorber::AbsorberStates,
    body::BodyState,
    boundary::Boundary,
    bounds::Bounds,
    pbf::{CAP, CONTACT, MAX_CORRECTION, REGULARIZATION},
    period::Period,
    pose::{Passage, Posed},
    shape::ShapeStep,
    signed_distance::SignedDistance,
    sph::{Calibration, half_space_fraction},
};
use swell_scene::{PbfScene, Scene};

/// Particles that a pass handles, by the parity of their sorted index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// Every particle.
    All,
    /// Even indices.
    Red,
    /// Odd indices.
    Black,
}

impl Colour {
    /// Returns whether particle `i` of the sorted order has this colour.
    pub fn holds(self, i: usize) -> bool {
        match self {
            Self::All => true,
            Self::Red => i.is_multiple_of(2),
            Self::Black => !i.is_multiple_of(2),
        }
    }
}

/// Constants of the water, and its solids.
#[derive(Clone, Debug)]
pub struct Model {
    /// Kernel calibration.
    pub calibration: Calibration,
    /// Solver settings.
    pub settings: swell_scene::Pbf,
    /// Gravity that the prediction applies, m/s²; zero if a projection applies it.
    pub gravity: DVec3,
    /// Size of the domain, metres.
    pub size: DVec3,
    /// Cells of edge h over the domain.
    pub cells: Cells,
    /// Positions of boundary samples on solids in their current poses, sorted by cell, metres.
    pub samples: Vec<DVec3>,
    /// Weights of the samples, in units of a particle's mass.
    pub sample_weights: Vec<f64>,
    /// Velocities of the samples, m/s.
    pub sample_velocities: Vec<DVec3>,
    /// Signed distance to the static solids; `None` if there are none.
    pub distance: Option<SignedDistance>,
    /// Moving solids in their current poses.
    pub movers: Vec<Mover>,
    /// Source of the moving solids' samples and grids; `None` if nothing moves.
    boundary: Option<Boundary>,
    /// Gravity of the scene, m/s², whichever part of the solver applies it.
    pub scene_gravity: DVec3,
    /// Velocity of the undisturbed water, m/s.
    pub current: DVec3,
}

/// A moving solid.
#[derive(Clone, Debug)]
pub struct Mover {
    /// Signed distances in the current pose, relative to the domain's minimum corner.
    pub solid: Posed,
    /// Motion that led to this pose.
    pub passage: Passage,
    /// Surface of a solid whose shape changes, over the motion to the current one.
    pub shape: Option<Arc<ShapeStep>>,
}

impl Mover {
    /// Returns the velocity of the solid's material point at `x`, m/s; where the shape changes, of
    /// the point of its surface that is nearest to the nodes around `x`.
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        let rigid = self.passage.velocity_at(x, self.solid.pose.centre);
        match &self.shape {
            Some(shape) => rigid + shape.velocity_at(x),
            None => rigid,
        }
    }
}

/// Displacements that keep a position out of solids and walls.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pushes {
    /// Displacement by solids, metres.
    pub of_solids: DVec3,
    /// Velocity of the last solid that pushed, m/s.
    pub pushing: DVec3,
    /// Displacement by walls after that, metres.
    pub of_walls: DVec3,
    /// Work of moving solids, over m / Δt².
    pub work: f64,
}

/// Length and walls of a substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Substep {
    /// End of the substep, seconds into the shot.
    pub time: f64,
    /// Length Δt, seconds; 0 for a measurement only.
    pub time_step: f64,
    /// Faces of the box at the substep's end, displaced by wave makers.
    pub walls: Bounds,
    /// Velocities of the faces, each along its own axis, m/s.
    pub wall_velocity: Bounds,
}

impl Substep {
    /// Creates a substep that ends at `time` and is `time_step` long, seconds, and in which
    /// absorbing walls have these states.
    pub fn new(scene: &Scene, absorbers: &AbsorberStates, time: f64, time_step: f64) -> Self {
        Self {
            time,
            time_step,
            walls: scene.walls(absorbers, time),
            wall_velocity: scene.wall_velocity(absorbers, time, time_step),
        }
    }

    /// Returns the work of walls on a particle that they displace by `push`, over m / Δt²
    /// (shared/wall_work.wgsl).
    pub fn work_of_push(&self, push: DVec3) -> f64 {
        push.max(DVec3::ZERO).dot(self.wall_velocity.min)
            + push.min(DVec3::ZERO).dot(self.wall_velocity.max)
    }
}

impl Model {
    /// Creates the model of a scene, with its solids in world space.
    pub fn new(scene: &PbfScene, boundary: &Boundary) -> Self {
        let settings = scene.settings();
        let calibration = Calibration::new(settings.particle_spacing, settings.support_ratio);
        let (size, support) = (scene.domain.size(), calibration.support_radius);
        let origin = scene.domain.min;
        let mut model = Self {
            size,
            samples: Vec::new(),
            sample_weights: Vec::new(),
            sample_velocities: Vec::new(),
            distance: boundary.distance.as_ref().map(|distance| SignedDistance {
                origin: distance.origin - origin,
                ..distance.clone()
            }),
            movers: Vec::new(),
            boundary: (!boundary.moving.is_empty()).then(|| boundary.clone()),
            calibration,
            settings: settings.clone(),
            gravity: scene.predicted_gravity(),
            cells: Cells::periodic(size, support, scene.period()),
            scene_gravity: scene.water.gravity,
            current: scene.water.current,
        };
        model.take_samples(scene, boundary, &[], (0.0, 0.0));
        model.stand(scene, &[], 0.0, 0.0);
        model
    }

    fn take_samples(
        &mut self,
        scene: &Scene,
        boundary: &Boundary,
        bodies: &[BodyState],
        (time, step): (f64, f64),
    ) {
        let samples = scene.solid_samples(boundary, bodies, time, step);
        let local: Vec<DVec3> = samples.iter().map(|s| s.position).collect();
        let id: Vec<u32> = (0..local.len() as u32).collect();
        let order = self.cells.order(&local, &id);
        let area = self.settings.particle_spacing * self.settings.particle_spacing;
        let weight = |k: &usize| self.calibration.sample_weight * samples[*k].area / area;
        self.sample_weights = order.iter().map(weight).collect();
        self.sample_velocities = order.iter().map(|&k| samples[k].velocity).collect();
        self.samples = order.into_iter().map(|k| local[k]).collect();
    }

    /// Moves solids to their poses at `time`, bodies from these states, with the velocities of
    /// their motion over the preceding `step` seconds.
    pub fn stand(&mut self, scene: &Scene, bodies: &[BodyState], time: f64, step: f64) {
        let Some(boundary) = self.boundary.take() else {
            return;
        };
        self.take_samples(scene, &boundary, bodies, (time, step));
        let origin = scene.domain.min;
        let solids = scene.moving_solids.iter().zip(&boundary.moving);
        let movers = solids.enumerate().map(|(index, (solid, grid))| {
            let passage = solid.passage_to(bodies, time, step);
            let shape = boundary.shape(index);
            let shape = shape.map(|it| it.field.moved(-origin).step(time - step, step));
            let grid = match &shape {
                Some(shape) => shape.after.clone(),
                None => SignedDistance {
                    origin: grid.origin - origin,
                    ..grid.clone()
                },
            };
            let pose = passage.at(1.0).moved(-origin);
            Mover {
                solid: Posed { grid, pose },
                passage,
                shape,
            }
        });
        self.movers = movers.collect();
        self.boundary = Some(boundary);
    }

    /// Returns the lengths of the domain along its periodic axes.
    #[inline]
    pub fn period(&self) -> Period {
        self.cells.period
    }

    /// Returns the largest displacement by one iteration, metres.
    pub fn max_correction(&self) -> f64 {
        MAX_CORRECTION * self.settings.particle_spacing
    }

    /// Returns the cap on a particle's displacement in a substep, metres.
    pub fn max_displacement(&self) -> f64 {
        CAP * self.settings.cfl * self.settings.particle_spacing
    }

    /// Returns ε in the denominator of λ, 1/m².
    pub fn regularization(&self) -> f64 {
        REGULARIZATION * self.calibration.bulk_gradient_squares
    }

    /// Keeps a position out of walls and solids (shared/confine.wgsl); a NaN stays a NaN.
    pub fn confine(&self, x: DVec3, walls: &Bounds) -> DVec3 {
        self.confine_by(x, walls).0
    }

    /// Does the same and also returns the displacements.
    pub fn confine_by(&self, x: DVec3, walls: &Bounds) -> (DVec3, Pushes) {
        let contact = self.contact_distance();
        let mut pushes = self.solid_pushes(x);
        let x = x + pushes.of_solids;
        let kept = DVec3::from_array(std::array::from_fn(|axis| {
            let (low, high) = (walls.min[axis] + contact, walls.max[axis] - contact);
            if x[axis] < low {
                low
            } else if x[axis] > high {
                high
            } else {
                x[axis]
            }
        }));
        pushes.of_walls = kept - x;
        (kept, pushes)
    }

    /// Returns the least distance of a particle from walls and solids, metres.
    pub(crate) fn contact_distance(&self) -> f64 {
        CONTACT * self.settings.particle_spacing
    }

    /// Returns the displacements of a position by solids, one solid after another.
    pub(super) fn solid_pushes(&self, x: DVec3) -> Pushes {
        let contact = self.contact_distance();
        let mut pushes = Pushes::default();
        if let Some(distance) = &self.distance {
            let d = distance.sample(x);
            if d < contact {
                pushes.of_solids = distance.gradient(x).normalize_or_zero() * (contact - d);
            }
        }
        for mover in &self.movers {
            let solid = &mover.solid;
            let before = x + pushes.of_solids;
            let d = solid.sample(before);
            if d < contact {
                let push = solid.gradient(before).normalize_or_zero() * (contact - d);
                let velocity = mover.velocity_at(before + push);
                pushes.of_solids += push;
                pushes.work += push.dot(velocity);
                if push != DVec3::ZERO {
                    pushes.pushing = velocity;
                }
            }
        }
        pushes
    }

    /// Returns the largest speed of any point of a solid, m/s.
    pub fn fastest_solid(&self) -> f64 {
        let speed = |mover: &Mover| {
            let spin = mover.passage.spin.length();
            let reach = mover.solid.grid.reach(mover.solid.pose.rest);
            let shape = mover.shape.as_ref().map_or(0.0, |shape| shape.fastest);
            mover.passage.velocity.length() + spin * reach + shape
        };
        self.movers.iter().map(speed).fold(0.0, f64::max)
    }

    /// Returns the derivative of the walls' contribution to the relative density at `x`, 1/m;
    /// [`wall_term`](Self::wall_term) returns the spiky gradient instead.
    pub(super) fn wall_derivative(&self, x: DVec3, walls: &Bounds) -> DVec3 {
        let h = self.calibration.support_radius;
        let scale = self.calibration.wall_density_scale;
        let low = ((x - walls.min) / h).clamp(DVec3::ZERO, DVec3::ONE);
        let high = ((walls.max - x) / h).clamp(DVec3::ZERO, DVec3::ONE);
        let free = |q: f64| 1.0 - scale * half_space_fraction(q);
        let slope = |q: f64| scale * 315.0 / 256.0 * (1.0 - q * q).powi(4) / h;
        let along = |axis: usize| {
            let (low, high) = (low[axis], high[axis]);
            let derivative = slope(high) * free(low) - slope(low) * free(high);
            (free(low) * free(high), derivative)
        };
        let [(fx, dx), (fy, dy), (fz, dz)] = [along(0), along(1), along(2)];
        DVec3::new(dx * fy * fz, dy * fx * fz, dz * fx * fy)
    }

    /// Returns the sum over the walls of each wall's density gradient times its velocity, 1/s
    /// (shared/walls.wgsl).
    pub(super) fn wall_rate(&self, x: DVec3, substep: &Substep) -> f64 {
        let velocity = &substep.wall_velocity;
        if *velocity == Bounds::default() {
            return 0.0;
        }
        let (h, walls) = (self.calibration.support_radius, &substep.walls);
        let low = ((x - walls.min) / h).clamp(DVec3::ZERO, DVec3::ONE);
        let high = ((walls.max - x) / h).clamp(DVec3::ZERO, DVec3::ONE);
        let scale = self.calibration.wall_density_scale;
        let slope = |q: f64| scale * 1.5 * (1.0 - q).powi(4) * (1.0 + 4.0 * q) / h;
        let free = |axis: usize| {
            (1.0 - scale * half_space_fraction(low[axis]))
                * (1.0 - scale * half_space_fraction(high[axis]))
        };
        let others = DVec3::new(free(1) * free(2), free(0) * free(2), free(0) * free(1));
        let along = (0..3).map(|axis| {
            let pushed = slope(high[axis]) * velocity.max[axis];
            others[axis] * (pushed - slope(low[axis]) * velocity.min[axis])
        });
        along.sum()
    }

    /// Returns the walls' contribution to the relative density at `x`, and its spiky gradient, 1/m
    /// (shared/walls.wgsl).
    pub fn wall_term(&self, x: DVec3, walls: &Bounds) -> (f64, DVec3) {
        let h = self.calibration.support_radius;
        let low = ((x - walls.min) / h).clamp(DVec3::ZERO, DVec3::ONE);
        let high = ((walls.max - x) / h).clamp(DVec3::ZERO, DVec3::ONE);
        if low.min(high).min_element() >= 1.0 {
            return (0.0, DVec3::ZERO);
        }
        let scale = self.calibration.wall_density_scale;
        let slope = |q: f64| scale * 1.5 * (1.0 - q).powi(4) * (1.0 + 4.0 * q) / h;
        let along = |axis: usize| {
            let free = (1.0 - scale * half_space_fraction(low[axis]))
                * (1.0 - scale * half_space_fraction(high[axis]));
            (free, slope(high[axis]) - slope(low[axis]))
        };
        let [(fx, sx), (fy, sy), (fz, sz)] = [along(0), along(1), along(2)];
        let gradient = DVec3::new(sx * fy * fz, sy * fx * fz, sz * fx * fy);
        (1.0 - fx * fy * fz, gradient)
    }
}

#[cfg(test)]
mod tests {
    use std::{f64::consts::PI, path::Path};

    use super::*;
    use swell_files::parse_scene;

    fn model() -> Model {
        let text = r#"
            [shot]
            name = "walls"
            frames = 1
            frames_per_second = 50
            [domain]
            min = [0.0, 0.0, 0.0]
            max = [2.0, 2.0, 2.0]
            [[water.block]]
            min = [0.0, 0.0, 0.0]
            max = [0.5, 0.5, 0.5]
            [solver]
            method = "pbf"
            [solver.pbf]
            particle_spacing = 0.1
        "#;
        let scene = parse_scene(text, Path::new("walls.toml"), Path::new("."), &[]);
        let scene = scene.expect("a scene");
        let scene = scene.with_pbf().expect("of PBF");
        Model::new(&scene, &Boundary::default())
    }

    fn walls() -> Bounds {
        Bounds {
            min: DVec3::ZERO,
            max: DVec3::splat(2.0),
        }
    }

    /// The gradient of spiky's integral over the half-space beyond a wall is its integral over the
    /// wall's plane. The test integrates over rings by the midpoint rule, whose relative error with
    /// 2000 steps is below 1e-6.
    #[test]
    fn walls_push_by_the_kernel_s_integral_over_their_plane() {
        let model = model();
        let h = model.calibration.support_radius;
        for z in [0.02, 0.06, 0.1, 0.17] {
            let n = 2000;
            let step = (h * h - z * z).sqrt() / f64::from(n);
            let ring = |k: u32| {
                let r = (f64::from(k) + 0.5) * step;
                let kernel = 15.0 / (PI * h.powi(6)) * (h - r.hypot(z)).powi(3);
                2.0 * PI * r * step * kernel
            };
            let plane: f64 = (0..n).map(ring).sum();
            let expected = -model.calibration.wall_density_scale * plane;
            let (_, gradient) = model.wall_term(DVec3::new(z, 1.0, 1.0), &walls());
            assert!(
                (gradient.x / expected - 1.0).abs() < 1e-6,
                "{z}: {gradient} {expected}"
            );
            // The opposite wall pushes in the opposite direction, and the rate of a moving wall is
            // the gradient times its velocity.
            let beyond = DVec3::new(1.0, 2.0 - z, 1.0);
            let (_, gradient) = model.wall_term(beyond, &walls());
            assert!(
                (gradient.y / expected + 1.0).abs() < 1e-6,
                "{z}: {gradient}"
            );
            let substep = Substep {
                time: 0.0,
                time_step: 0.01,
                walls: walls(),
                wall_velocity: Bounds {
                    min: DVec3::new(3.0, 0.0, 0.0),
                    max: DVec3::new(0.0, -2.0, 0.0),
                },
            };
            let rate = model.wall_rate(DVec3::new(z, 1.0, 1.0), &substep);
            assert!((rate / (3.0 * expected) - 1.0).abs() < 1e-6, "{z}: {rate}");
            let rate = model.wall_rate(beyond, &substep);
            assert!((rate / (2.0 * expected) - 1.0).abs() < 1e-6, "{z}: {rate}");
        }
    }

    /// Newton's method uses the derivative of the walls' density: compared with central differences
    /// over 1e-5 m, whose relative error is 1e-7.
    #[test]
    fn the_derivative_of_walls_is_that_of_their_density() {
        let model = model();
        for x in [DVec3::new(0.06, 0.07, 1.0), DVec3::new(1.95, 1.0, 0.12)] {
            let derivative = model.wall_derivative(x, &walls());
            for axis in 0..3 {
                let e = 1e-5 * DVec3::AXES[axis];
                let [after, before] = [x + e, x - e].map(|x| model.wall_term(x, &walls()).0);
                let off = derivative[axis] - (after - before) / 2e-5;
                assert!(
                    off.abs() < 1e-6 * derivative.length(),
                    "{x}: {derivative} {off}"
                );
            }
        }
    }
}
