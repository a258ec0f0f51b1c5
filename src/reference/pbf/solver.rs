//! Whole frames of PBF on the CPU.

use glam::{DVec3, Vec3};

use super::{
    Colour, Model, Substep, effects, forces,
    passes::{self, Inputs, Momentum},
};
use crate::{
    ReferenceError, Timings,
    flip::{Cloud, Flip},
    neighbors::{Neighbors, SortedPoints},
};
use swell_domain::{
    boundary::Boundary,
    budget::Breach,
    parallel,
    particles::Particles,
    pbf::chebyshev_factors,
    probe::fitted,
    solver::{Observed, PassTime, Projection, Solver, Span, StepReport, Unread, Watch},
};
use swell_scene::{Iteration, PbfScene, Scene, Stop, step::projected_substep};

/// PBF in f64. Frames are rounded to f32, as when written, and the next frame starts from the
/// rounded state.
pub struct Pbf {
    scene: PbfScene<'static>,
    model: Model,
    /// FLIP solver that projects velocities, if the scene uses a projection.
    grid: Option<Flip>,
    /// Which particles the projection found to be isolated droplets. Corrections change their
    /// velocity; other particles are only displaced. Empty without a projection.
    is_drop: Vec<bool>,
    state: Particles,
    frame: u32,
    timings: Timings,
    /// Positions after the last substep, metres; its Σ λ, m²; its length, seconds.
    position: Vec<DVec3>,
    pressed: Vec<f64>,
    step: f64,
}

/// Particles in sorted order, with their neighbours; positions relative to the domain's minimum
/// corner.
#[derive(Clone, Debug)]
pub struct Sorted {
    /// Positions, metres: particles, then boundary samples on solids.
    pub points: Vec<DVec3>,
    /// Index of each particle before the sort. Shape (particles).
    pub order: Vec<usize>,
    /// Neighbours at the positions at the time of the sort.
    pub neighbors: Neighbors,
    /// Σ λ of the corrections so far, m², proportional to pressure. Shape (particles).
    pub lambda_sum: Vec<f64>,
    /// Work of moving walls in the corrections so far, over m / Δt².
    pub wall_work: f64,
}

impl Sorted {
    /// Sorts particles by cell and id (pbf/assign_cells to pbf/reorder), and lists neighbours
    /// (pbf/build_neighbors).
    pub fn new(model: &Model, position: &[DVec3], id: &[u32], timings: &mut Timings) -> Self {
        let order = timings.time("pbf/reorder", || model.cells.order(position, id));
        let mut points: Vec<DVec3> = order.iter().map(|&k| position[k]).collect();
        points.extend(&model.samples);
        let neighbors = timings.time("pbf/build_neighbors", || {
            let crowd = SortedPoints {
                cells: model.cells,
                points: &points,
                particles: order.len(),
            };
            Neighbors::listed_within(&crowd, model.calibration.support_radius)
        });
        Self {
            lambda_sum: vec![0.0; order.len()],
            wall_work: 0.0,
            points,
            order,
            neighbors,
        }
    }

    /// Returns the inputs of the passes.
    pub fn inputs<'a>(&'a self, model: &'a Model, substep: &'a Substep) -> Inputs<'a> {
        Inputs {
            model,
            substep,
            points: &self.points,
            neighbors: &self.neighbors,
            is_drop: &[],
        }
    }

    /// Returns the positions of the particles, metres.
    pub fn particles(&self) -> &[DVec3] {
        &self.points[..self.order.len()]
    }

    /// Reorders one value per particle from sorted order to the order before the sort.
    pub fn unsorted<T: Copy + Default>(&self, values: &[T]) -> Vec<T> {
        let mut by_slot = vec![T::default(); values.len()];
        for (&slot, &value) in self.order.iter().zip(values) {
            by_slot[slot] = value;
        }
        by_slot
    }
}

/// State of an iteration that passes share. Shapes (particles).
struct Corrector<'a> {
    model: &'a Model,
    substep: &'a Substep,
    sorted: &'a mut Sorted,
    timings: &'a mut Timings,
    lambda: Vec<f64>,
    density: Vec<f64>,
    /// Positions of one iteration before, for a semi-iteration.
    before: Vec<DVec3>,
    visit: &'a mut Visit<'a>,
}

/// Callback that returns the neighbours that a pass visits at these points; `None` for those of the
/// previous pass.
pub type Visit<'a> = dyn FnMut(&[DVec3]) -> Option<Neighbors> + 'a;

impl Corrector<'_> {
    fn look_about(&mut self) {
        if let Some(neighbors) = (self.visit)(&self.sorted.points) {
            self.sorted.neighbors = neighbors;
        }
    }

    fn lambda(&mut self, colour: Colour) {
        self.look_about();
        let inputs = self.sorted.inputs(self.model, self.substep);
        self.timings.time("pbf/compute_lambda", || {
            passes::compute_lambda(inputs, colour, &mut self.lambda, &mut self.density);
        });
    }

    /// Corrects particles of one colour; `factor` is that of a semi-iteration.
    fn delta(&mut self, colour: Colour, factor: Option<f64>) {
        self.look_about();
        let inputs = self.sorted.inputs(self.model, self.substep);
        let before = &self.before[..];
        let momentum = factor.map(|factor| Momentum { factor, before });
        let moved = self.timings.time("pbf/compute_delta", || {
            passes::compute_delta(inputs, colour, momentum, &self.lambda)
        });
        let sums = self.sorted.lambda_sum.iter_mut().zip(&self.lambda);
        for (_, (sum, lambda)) in sums.enumerate().filter(|(i, _)| colour.holds(*i)) {
            *sum += lambda;
        }
        let now = &mut self.sorted.points[..moved.len()];
        if factor.is_some() {
            self.before.copy_from_slice(now);
        }
        let mut work = 0.0;
        for (now, corrected) in now.iter_mut().zip(moved) {
            *now = corrected.position;
            work += corrected.work;
        }
        self.sorted.wall_work += work;
    }
}

/// Corrects sorted positions until the stop condition of the settings; returns the number of
/// iterations.
pub fn iterate(
    model: &Model,
    substep: &Substep,
    sorted: &mut Sorted,
    timings: &mut Timings,
) -> u32 {
    iterate_among(
        model,
        substep,
        sorted,
        timings,
        &mut |_| None,
        &mut |_, _| {},
    )
}

/// Does the same with neighbours that may change from pass to pass (`visit`), and with a callback
/// `disturb` that may move the particles before each iteration, numbered from 0.
pub fn iterate_among<'a>(
    model: &'a Model,
    substep: &'a Substep,
    sorted: &'a mut Sorted,
    timings: &'a mut Timings,
    visit: &'a mut Visit<'a>,
    disturb: &mut dyn FnMut(u32, &mut [DVec3]),
) -> u32 {
    let n = sorted.order.len();
    let settings = &model.settings;
    let mut factors = chebyshev_factors(settings.spectral_radius);
    let mut corrector = Corrector {
        model,
        substep,
        lambda: vec![0.0; n],
        density: vec![0.0; n],
        before: sorted.particles().to_vec(),
        sorted,
        timings,
        visit,
    };
    let most = settings.stop.most_iterations();
    for k in 0..most {
        disturb(k, &mut corrector.sorted.points[..n]);
        // λ of black particles from the previous iteration is still valid for red's correction:
        // only the first iteration has to compute all.
        corrector.lambda(match settings.iteration {
            Iteration::RedBlack if k > 0 => Colour::Red,
            _ => Colour::All,
        });
        if let Stop::DensityError { density_error, .. } = settings.stop {
            let errors = corrector.density.iter().map(|rho| (rho - 1.0).max(0.0));
            if errors.sum::<f64>() <= density_error * n as f64 {
                return k;
            }
        }
        match settings.iteration {
            Iteration::Jacobi => corrector.delta(Colour::All, None),
            Iteration::Chebyshev => corrector.delta(Colour::All, factors.next()),
            Iteration::RedBlack => {
                corrector.delta(Colour::Red, None);
                corrector.lambda(Colour::Black);
                corrector.delta(Colour::Black, None);
            }
        }
    }
    most
}

impl Pbf {
    /// Creates the solver for a scene, with its solids.
    pub fn new(scene: &PbfScene, boundary: &Boundary) -> Self {
        Self {
            model: Model::new(scene, boundary),
            is_drop: Vec::new(),
            grid: scene
                .of_projection()
                .map(|grid| Flip::of_velocities(&grid, boundary)),
            scene: scene.to_owned_scene(),
            state: Particles::default(),
            frame: 0,
            timings: Timings::default(),
            position: Vec::new(),
            pressed: Vec::new(),
            step: 0.0,
        }
    }

    /// Projects the velocities for the substep from `start` on, the `number`-th of its frame, and
    /// displaces particles (flip/aim), if there is a projection. Returns the work by moving walls,
    /// joules.
    fn project(
        &mut self,
        (number, start): (u32, f64),
        step: f64,
        position: &mut Vec<DVec3>,
        velocity: &mut Vec<DVec3>,
        all: &mut Projection,
    ) -> Result<f64, ReferenceError> {
        let Some(grid) = &mut self.grid else {
            return Ok(0.0);
        };
        let mut cloud = Cloud {
            position: std::mem::take(position),
            velocity: std::mem::take(velocity),
            affine: Vec::new(),
            id: self.state.id.clone(),
        };
        let numbers = (self.frame + 1, number);
        let substep = projected_substep(start, step, self.state.substep);
        let (is_drop, work) = grid.project_velocities(numbers, &mut cloud, &substep, all)?;
        self.is_drop = is_drop;
        self.state.bodies = grid.bodies().to_vec();
        (*position, *velocity) = (cloud.position, cloud.velocity);
        Ok(work)
    }

    /// Runs one substep of particles in the order of their ids; returns the number of iterations
    /// and of capped particles, and the work by moving walls and forces, joules.
    fn step(
        &mut self,
        substep: &Substep,
        position: &mut Vec<DVec3>,
        velocity: &mut Vec<DVec3>,
    ) -> (u32, u64, f64) {
        self.model.stand(
            &self.scene,
            &self.state.bodies,
            substep.time,
            substep.time_step,
        );
        let (model, timings, is_drop) = (&self.model, &mut self.timings, &self.is_drop);
        forces::turn_particles(&self.scene, substep, velocity, timings);
        let impulses = match forces::act_on_particles(&self.scene) {
            true => timings.time("effects/push_particles", || {
                forces::push_particles(&self.scene, substep, position, velocity)
            }),
            false => Vec::new(),
        };
        for (v, (change, _)) in velocity.iter_mut().zip(&impulses) {
            *v += *change;
        }
        let by_prediction: Vec<_> = timings.time("pbf/predict", || {
            parallel::map(0..position.len(), |slot| {
                let (x, v) = (position[slot], velocity[slot]);
                match is_drop.get(slot) {
                    Some(false) => passes::predict_along(model, substep, x, v),
                    _ => passes::predict_and_work(model, substep, x, v),
                }
            })
        });
        let predicted: Vec<DVec3> = by_prediction.iter().map(|p| p.0).collect();
        let pushed: Vec<DVec3> = by_prediction.iter().map(|p| p.1).collect();
        // A sequential sum does not depend on the number of threads.
        let mut work: f64 = by_prediction.iter().map(|p| p.2).sum();
        let mut sorted = Sorted::new(model, &predicted, &self.state.id, timings);
        let iterations = iterate(model, substep, &mut sorted, timings);
        work += sorted.wall_work;
        let (mut moved, capped): (Vec<DVec3>, u64) = timings.time("pbf/update_velocity", || {
            let updated: Vec<_> = parallel::map(0..sorted.order.len(), |k| {
                let (slot, x) = (sorted.order[k], sorted.particles()[k]);
                let start = match is_drop.get(slot) {
                    Some(false) => x,
                    _ => predicted[slot],
                };
                passes::update_velocity(model, substep, x, start, pushed[slot])
            });
            for (point, &(x, ..)) in sorted.points.iter_mut().zip(&updated) {
                *point = x;
            }
            let capped = updated.iter().filter(|(_, _, is_capped)| *is_capped);
            let capped = capped.count() as u64;
            (updated.into_iter().map(|(_, v, _)| v).collect(), capped)
        });
        let by_forces = sorted.order.iter().zip(&moved);
        let by_forces = by_forces
            .filter_map(|(&slot, &v)| Some(forces::work_on_particle(*impulses.get(slot)?, v)));
        let by_forces: f64 = by_forces.sum();
        forces::turn_particles(&self.scene, substep, &mut moved, timings);
        let drops = sorted.order.iter().filter_map(|&slot| is_drop.get(slot));
        let drops: Vec<bool> = drops.copied().collect();
        let inputs = Inputs {
            is_drop: &drops,
            ..sorted.inputs(model, substep)
        };
        effects::apply(&self.scene.effects, inputs, &mut moved, timings);
        *position = sorted.unsorted(sorted.particles());
        *velocity = sorted.unsorted(&moved);
        self.pressed = sorted.unsorted(&sorted.lambda_sum);
        let work = self.scene.particle_mass() * (work / substep.time_step + by_forces);
        (iterations, capped, work)
    }

    /// Shows a substep of `step` seconds that has just run to `watch`.
    fn show(
        &mut self,
        span: Span,
        step: f64,
        position: &[DVec3],
        velocity: &[DVec3],
        watch: &mut dyn Watch,
    ) -> Result<(), ReferenceError> {
        let wanted = watch.wants(span);
        if !wanted.is_any() {
            return Ok(());
        }
        let mut seen = Observed::default();
        if wanted.particles {
            seen.particles.id.clone_from(&self.state.id);
            let [positions, velocities] = self.rounded(position, velocity);
            (seen.particles.position, seen.particles.velocity) = (positions, velocities);
            seen.particles.substep = step;
        }
        if wanted.pressures {
            (self.position, self.step) = (position.to_vec(), step);
            seen.pressures = self.pressures(&self.scene.pressure_points())?;
        }
        watch.look(span, seen);
        Ok(())
    }

    /// Returns world positions and velocities rounded as in a frame.
    fn rounded(&self, position: &[DVec3], velocity: &[DVec3]) -> [Vec<[f32; 3]>; 2] {
        let origin = self.scene.domain.min;
        let place = |x: &DVec3| (origin + *x).as_vec3().to_array();
        let speed = |v: &DVec3| v.as_vec3().to_array();
        [
            position.iter().map(place).collect(),
            velocity.iter().map(speed).collect(),
        ]
    }

    /// Returns the relative densities of the state, in its order.
    fn density(&mut self, time: f64) -> Vec<f64> {
        let substep = Substep::new(&self.scene, &self.state.walls, time, 0.0);
        self.model.stand(&self.scene, &self.state.bodies, time, 0.0);
        let (model, timings) = (&self.model, &mut self.timings);
        let position = local(&self.scene, &self.state);
        let sorted = Sorted::new(model, &position, &self.state.id, timings);
        let density = timings.time("pbf/measure_density", || {
            passes::measure_density(sorted.inputs(model, &substep))
        });
        sorted.unsorted(&density)
    }

    /// Passes the states of absorbing walls and bodies to the projection.
    fn tell_grid(&mut self) {
        if let Some(grid) = &mut self.grid {
            grid.take_boundaries(&self.state);
        }
    }
}

impl Solver for Pbf {
    type Error = ReferenceError;

    fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), ReferenceError> {
        self.scene.check_bodies(&particles.bodies)?;
        self.state = particles.clone();
        self.frame = frame;
        self.tell_grid();
        Ok(())
    }

    fn compute(&mut self, watch: &mut dyn Watch) -> Result<Unread<ReferenceError>, ReferenceError> {
        let frame = self.frame + 1;
        let length = self.scene.shot.frame_seconds();
        let start = f64::from(self.frame) * length;
        let boundaries = (&self.state.walls, &self.state.bodies[..]);
        let substeps = self
            .scene
            .pbf_substeps(boundaries, self.frame, self.state.max_speed())?;
        let step = length / f64::from(substeps);
        let mut position = local(&self.scene, &self.state);
        let mut velocity: Vec<DVec3> = self.state.velocity.iter().map(widen).collect();
        let (mut iterations, mut capped, mut boundary_work) = (0, 0, 0.0);
        let mut all = Projection::default();
        for k in 1..=substeps {
            let begin = start + f64::from(k - 1) * step;
            boundary_work +=
                self.project((k, begin), step, &mut position, &mut velocity, &mut all)?;
            self.state.substep = step;
            let substep = Substep::new(
                &self.scene,
                &self.state.walls,
                start + f64::from(k) * step,
                step,
            );
            let (some, slowed, work) = self.step(&substep, &mut position, &mut velocity);
            iterations += u64::from(some);
            capped += slowed;
            boundary_work += work;
            let span = Span {
                start: begin,
                end: start + f64::from(k) * step,
                is_last: k == substeps,
            };
            self.show(span, step, &position, &velocity, watch)?;
        }
        [self.state.position, self.state.velocity] = self.rounded(&position, &velocity);
        let density = self.density(start + length);
        if let Some((count, first)) = self.state.first_not_finite(Some(&density)) {
            return Err(Breach::not_finite(frame, count, Some(first)).into());
        }
        self.frame = frame;
        self.scene.update_absorbers(&mut self.state, frame);
        self.tell_grid();
        (self.position, self.step) = (position, step);
        let report = StepReport {
            substeps,
            iterations,
            capped,
            boundary_work,
            projection: self.grid.as_ref().map(|_| all),
            densest_at: self.scene.densest_particle(&self.state, &density),
            ..self.scene.report(&self.state, density.into_iter())
        };
        let state = self.state.clone();
        Ok(Unread::new(state.walls, move || Ok((state, report))))
    }

    /// Computes pressures from Σ λ by
    /// [`pressure_scale`](swell_domain::sph::Calibration::pressure_scale).
    fn pressures(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, ReferenceError> {
        if let Some(grid) = &self.grid {
            return grid.pressures(points);
        }
        let calibration = &self.model.calibration;
        let scale = calibration.pressure_scale(
            self.scene.water.rest_density,
            self.model.settings.relaxation,
            self.step,
        );
        let pressure = |at: &DVec3| {
            let pressed = self.pressed.iter().map(|sum| scale * sum);
            let at = *at - self.scene.domain.min;
            let period = self.model.period();
            let nearest = self.position.iter().map(|x| at + period.shortest(*x - at));
            let particles = nearest.zip(pressed);
            fitted(particles, at, calibration.support_radius)
        };
        Ok(points.iter().map(pressure).collect())
    }

    fn timings(&self) -> Vec<PassTime> {
        self.timings.rows()
    }
}

/// Returns the positions of a state relative to the domain's minimum corner, metres.
pub fn local(scene: &Scene, state: &Particles) -> Vec<DVec3> {
    let position = state.position.iter();
    position.map(|x| widen(x) - scene.domain.min).collect()
}

fn widen(v: &[f32; 3]) -> DVec3 {
    Vec3::from_array(*v).as_dvec3()
}
