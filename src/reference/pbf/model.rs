//! What stays the same over a bake, and what a substep knows.

use glam::DVec3;

use crate::{
    domain::{
        boundary::Boundary,
        bounds::Bounds,
        pbf::{CAP, CONTACT, MAX_CORRECTION, REGULARIZATION},
        period::Period,
        signed_distance::SignedDistance,
        sph::{Calibration, half_space_fraction},
    },
    reference::neighbors::Cells,
    scene::{self, Scene},
};

/// Which particles a pass handles: the parity of their sorted index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// Every particle.
    All,
    /// Even ones.
    Red,
    /// Odd ones.
    Black,
}

impl Colour {
    /// Whether particle `i` of the sorted order has it.
    pub fn holds(self, i: usize) -> bool {
        match self {
            Self::All => true,
            Self::Red => i.is_multiple_of(2),
            Self::Black => !i.is_multiple_of(2),
        }
    }
}

/// The water's constants and its solids.
#[derive(Clone, Debug)]
pub struct Model {
    /// Kernels.
    pub calibration: Calibration,
    /// Solver settings.
    pub settings: scene::Pbf,
    /// m/s².
    pub gravity: DVec3,
    /// Edges of the domain, metres.
    pub size: DVec3,
    /// Cells of edge h over the domain.
    pub cells: Cells,
    /// Samples on solids, sorted by cell.
    pub samples: Vec<DVec3>,
    /// Their weights in particles' worth of mass.
    pub sample_weights: Vec<f64>,
    /// Distance to the solids; `None` without any.
    pub distance: Option<SignedDistance>,
    /// Of the scene, m/s², whoever adds it.
    pub scene_gravity: DVec3,
}

/// A substep's length and walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Substep {
    /// When it ends, seconds into the shot.
    pub time: f64,
    /// Δt, seconds; 0 measures only.
    pub time_step: f64,
    /// The box now, wave-makers included.
    pub walls: Bounds,
    /// Of its faces, each along its axis, m/s.
    pub wall_velocity: Bounds,
}

impl Substep {
    /// That ends at `time` and is `time_step` long, seconds.
    pub fn new(scene: &Scene, time: f64, time_step: f64) -> Self {
        Self {
            time,
            time_step,
            walls: scene.walls(time),
            wall_velocity: scene.wall_velocity(time, time_step),
        }
    }

    /// What walls do on a particle by adding `push` to its way, over m / Δt² (shared/wall_work.wgsl).
    pub fn work_of_push(&self, push: DVec3) -> f64 {
        push.max(DVec3::ZERO).dot(self.wall_velocity.min)
            + push.min(DVec3::ZERO).dot(self.wall_velocity.max)
    }
}

impl Model {
    /// Of a scene that PBF solves, and its solids in world space.
    pub fn new(scene: &Scene, boundary: &Boundary) -> Self {
        let settings = scene.solver.pbf();
        let samples = &boundary.samples;
        let calibration = Calibration::new(settings.particle_spacing, settings.support_ratio);
        let (size, support) = (scene.domain.size(), calibration.support_radius);
        let cells = Cells::periodic(size, support, scene.period());
        let origin = scene.domain.min;
        let local: Vec<DVec3> = samples.iter().map(|s| s.position - origin).collect();
        let id: Vec<u32> = (0..local.len() as u32).collect();
        let order = cells.order(&local, &id);
        let area = settings.particle_spacing * settings.particle_spacing;
        Self {
            size,
            sample_weights: order
                .iter()
                .map(|&k| calibration.sample_weight * samples[k].area / area)
                .collect(),
            samples: order.into_iter().map(|k| local[k]).collect(),
            distance: boundary.distance.as_ref().map(|distance| SignedDistance {
                origin: distance.origin - origin,
                ..distance.clone()
            }),
            calibration,
            settings: settings.clone(),
            gravity: scene.predicted_gravity(),
            cells,
            scene_gravity: scene.water.gravity,
        }
    }

    /// Lengths along the axes along which the domain joins its own end.
    #[inline]
    pub fn period(&self) -> Period {
        self.cells.period
    }

    /// Largest correction of one iteration, metres.
    pub fn max_correction(&self) -> f64 {
        MAX_CORRECTION * self.settings.particle_spacing
    }

    /// Displacement cap of a substep, metres.
    pub fn max_displacement(&self) -> f64 {
        CAP * self.settings.cfl * self.settings.particle_spacing
    }

    /// ε of λ's denominator, 1/m².
    pub fn regularization(&self) -> f64 {
        REGULARIZATION * self.calibration.bulk_gradient_squares
    }

    /// Keeps a position off the walls and out of the solids (shared/confine.wgsl); what is not a number stays so.
    pub fn confine(&self, x: DVec3, walls: &Bounds) -> DVec3 {
        self.confine_by(x, walls).0
    }

    /// The same, and what the walls added to the position.
    pub fn confine_by(&self, x: DVec3, walls: &Bounds) -> (DVec3, DVec3) {
        let contact = self.contact_distance();
        let x = x + self.solid_push(x);
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
        (kept, kept - x)
    }

    /// Least distance from walls and solids, metres.
    pub(in crate::reference) fn contact_distance(&self) -> f64 {
        CONTACT * self.settings.particle_spacing
    }

    /// What solids add to a position, metres.
    pub(super) fn solid_push(&self, x: DVec3) -> DVec3 {
        let (Some(distance), contact) = (&self.distance, self.contact_distance()) else {
            return DVec3::ZERO;
        };
        match distance.sample(x) {
            d if d < contact => distance.gradient(x).normalize_or_zero() * (contact - d),
            _ => DVec3::ZERO,
        }
    }

    /// The derivative of the relative density that the walls give at `x`, 1/m; the gradient of
    /// [`wall_term`](Self::wall_term) is spiky's in its place.
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

    /// The gradient of what each wall adds to the density times the wall's velocity, 1/s (shared/walls.wgsl).
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

    /// Relative density that the walls give at `x`, and its gradient, 1/m (shared/walls.wgsl).
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
        let scene = Scene::parse(text, Path::new("walls.toml"), Path::new("."), &[]);
        Model::new(&scene.expect("a scene"), &Boundary::default())
    }

    fn walls() -> Bounds {
        Bounds {
            min: DVec3::ZERO,
            max: DVec3::splat(2.0),
        }
    }

    /// The gradient of spiky's integral over the half-space beyond a wall is its integral over the wall's plane: rings by
    /// the midpoint rule, whose error with 2000 steps is below 1e-6 of it.
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
            // The other way from the wall opposite, and what a wall in motion does is that by its speed.
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

    /// Newton's method takes the derivative of what walls give: central differences over 1e-5 m, off by 1e-7 of it.
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
