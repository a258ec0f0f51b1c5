//! Position-based fluids (Macklin and Müller 2013) with Jacobi, red/black and Chebyshev iterations.

pub mod buffers;
mod iteration;
pub(super) mod plan;
mod projection;
pub(super) mod record;
pub(super) mod samples;

use std::sync::Arc;

use glam::{DVec3, Vec3};

use swell_domain::{
    absorber::AbsorberStates,
    boundary::Boundary,
    budget::Breach,
    particles::{Particles, max_speed},
    pbf::{CAP, CONTACT, MAX_CORRECTION, REGULARIZATION},
    period::Period,
    probe::fitted,
    solver::{Observed, PassTime, Requested, Solver, Span as Substep, StepReport, Unread, Watch},
    sph::Calibration,
    substep::SubstepChoice,
};
use swell_gpu::{
    adapter::Context,
    buffer::Buf,
    program::Program,
    readback::{First, Mapped},
    recording::{Recording, Timer, spread},
    sort,
};
use swell_scene::{PbfScene, Stop};

use super::{
    SolveError,
    boundary::Movers,
    effects::{
        self,
        forces::{self, FORCE_WORK},
    },
    params::{Counters, IterationControl, Params},
    plan::{Counts, Plan, device_limits},
    state::{Carried, check_finite, is_awaited, is_other_count, upload},
    trace::{Begun, DeepBegun, Observe, Run, Span, TraceFrame, Traced, trace},
};
use buffers::*;
use plan::{cell_count, places, shared_constants};
use projection::ProjectionGrid;
use record::Commands;

/// Dummy particle: far from everything, and still finite when squared.
const NOBODY: [f32; 4] = [1e15, 1e15, 1e15, 0.0];

/// The PBF solver on a GPU.
pub struct Pbf {
    program: Program,
    plan: Plan,
    scene: Arc<PbfScene<'static>>,
    calibration: Calibration,
    substep: Recording,
    measure: Recording,
    grid: Option<ProjectionGrid>,
    /// Boundary to upload again when the particle count changes or, with moving solids, in each
    /// substep. `None` if neither can happen.
    boundary: Option<Boundary>,
    movers: Option<Movers>,
    timer: Option<Timer>,
    state: Carried,
    /// Largest speed in the state, m/s.
    speed: f64,
    frame: u32,
    /// Positions relative to the domain's minimum corner, metres, and pressures, Pa, of the
    /// particles in the last substep; empty if the scene does not need them.
    pressed: Vec<(DVec3, f64)>,
}

/// Returns the parameters of a substep that ends at `time` and is `step` seconds long.
pub(super) fn params(
    scene: &PbfScene,
    calibration: &Calibration,
    plan: &Plan,
    absorbers: &AbsorberStates,
    (time, step): (f64, f64),
) -> Params {
    let pbf = scene.settings();
    let walls = scene.walls(absorbers, time);
    let wall_velocity = scene.wall_velocity(absorbers, time, step);
    let Period(period) = scene.period();
    let natural_lambda = 1.0 / calibration.bulk_gradient_squares;
    Params {
        velocity_step: (scene.predicted_gravity() * step).as_vec3().to_array(),
        particle_count: plan.counts.particles as u32,
        grid_dims: plan.grid_dims,
        max_correction: (MAX_CORRECTION * pbf.particle_spacing) as f32,
        wall_min: walls.min.as_vec3().to_array(),
        time_step: step as f32,
        wall_max: walls.max.as_vec3().to_array(),
        inverse_time_step: if step > 0.0 { (1.0 / step) as f32 } else { 0.0 },
        support_radius: calibration.support_radius as f32,
        inverse_support_radius: (1.0 / calibration.support_radius) as f32,
        nobody: (plan.counts.particles + plan.counts.boundary_samples) as u32,
        density_scale: calibration.density_scale as f32,
        gradient_scale: calibration.gradient_scale as f32,
        wall_density_scale: calibration.wall_density_scale as f32,
        regularization: (REGULARIZATION * calibration.bulk_gradient_squares) as f32,
        relaxation: pbf.relaxation as f32,
        contact_distance: (CONTACT * pbf.particle_spacing) as f32,
        max_displacement: (CAP * pbf.cfl * pbf.particle_spacing) as f32,
        artificial_pressure: (pbf.artificial_pressure * natural_lambda) as f32,
        period_x: period.x as f32,
        wall_velocity_min: wall_velocity.min.as_vec3().to_array(),
        period_y: period.y as f32,
        wall_velocity_max: wall_velocity.max.as_vec3().to_array(),
        period_z: period.z as f32,
    }
}

/// Uploads data that does not change between substeps; returns the recordings of a substep and of a
/// frame's final measurement.
fn set_up(
    program: &Program,
    plan: &Plan,
    scene: &PbfScene,
    boundary: &Boundary,
    calibration: &Calibration,
) -> [Recording; 2] {
    let particles = plan.counts.particles;
    let effects = effects::of_pbf(scene, particles);
    let commands = Commands::new(plan, scene, &effects);
    program.upload_windows(&PHASES, &commands.phases);
    sort::upload_lengths(program, &CELL_START, cell_count(plan));
    program.upload(ELEMENT_COUNT, 0, &[[particles as u32, 0, 0, 0]]);
    samples::upload_places(program, plan.page, places(plan) - 1, &[NOBODY]);
    samples::upload(boundary, program, scene, plan, calibration);
    forces::upload_meshes_for_pbf(program, scene);
    [&commands.substep, &commands.measure].map(|commands| Recording::new(program, commands))
}

impl Pbf {
    /// Builds the passes and buffers of `plan`, which must have been made for `scene` and
    /// `boundary`.
    ///
    /// # Errors Returns an error if a buffer exceeds the adapter's limits, a shader does not
    /// compile, or the device fails.
    pub fn new(
        context: &Context,
        scene: &PbfScene,
        plan: Plan,
        boundary: &Boundary,
        is_timed: bool,
    ) -> Result<Self, SolveError> {
        let (buffers, passes) = (plan.buffer_specs(), plan.pass_specs());
        let program = Program::new(context, &buffers, &passes, &shared_constants(&plan))?;
        let pbf = scene.settings();
        let calibration = Calibration::new(pbf.particle_spacing, pbf.support_ratio);
        let [substep, measure] = set_up(&program, &plan, scene, boundary, &calibration);
        Ok(Self {
            boundary: (scene.has_sources() || !boundary.moving.is_empty())
                .then(|| boundary.clone()),
            movers: Movers::of(boundary, scene),
            grid: ProjectionGrid::of(context, scene, &plan, boundary)?,
            timer: is_timed.then(|| Timer::new(context)),
            program,
            plan,
            scene: Arc::new(scene.to_owned_scene()),
            calibration,
            substep,
            measure,
            state: Carried::new(&Particles::default()),
            speed: 0.0,
            frame: 0,
            pressed: Vec::new(),
        })
    }

    /// Returns the current plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Returns the names of the passes of a substep and of a frame's final measurement, in order.
    pub fn recorded_passes(&self) -> Vec<&'static str> {
        let of_grid = self
            .grid
            .iter()
            .flat_map(|grid| grid.flip().recorded_passes());
        let own = self.substep.passes().chain(self.measure.passes());
        of_grid.chain(own).collect()
    }

    /// Returns the names of the passes and of the buffers that exist on the device, sorted.
    pub fn built(&self) -> (Vec<&str>, Vec<&str>) {
        self.program.names()
    }

    /// Reads the first `count` values of a buffer.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn field<T: bytemuck::Pod>(
        &self,
        buffer: Buf<T>,
        count: usize,
    ) -> Result<Vec<T>, SolveError> {
        Ok(self.program.read(buffer, count)?)
    }

    /// Resizes buffers to another number of particles.
    fn resize(&mut self, particles: usize) -> Result<(), SolveError> {
        let counts = Counts {
            particles,
            ..self.plan.counts
        };
        let limits = device_limits(&self.program.context);
        let plan = plan::plan(&self.scene, counts, limits);
        let (buffers, passes) = (plan.buffer_specs(), plan.pass_specs());
        if (plan.has_lists, plan.page) == (self.plan.has_lists, self.plan.page) {
            self.program.refit(&buffers, &passes)?;
        } else {
            // The passes have different defines: build the program again.
            let context = self.program.context.clone();
            self.program = Program::new(&context, &buffers, &passes, &shared_constants(&plan))?;
        }
        self.plan = plan;
        let boundary = self.boundary.as_ref();
        let boundary = boundary.expect("a scene in which water enters or leaves");
        let (program, plan, scene) = (&self.program, &self.plan, &self.scene);
        [self.substep, self.measure] = set_up(program, plan, scene, boundary, &self.calibration);
        Ok(())
    }

    fn params(&self, time: f64, step: f64) -> Params {
        let (scene, absorbers) = (&self.scene, &self.state.walls);
        params(
            scene,
            &self.calibration,
            &self.plan,
            absorbers,
            (time, step),
        )
    }

    /// Resets the counters and sums of a frame.
    fn begin_frame(&mut self) {
        if let Some(grid) = &mut self.grid {
            grid.begin_frame(self.frame);
        }
        self.program.upload(COUNTERS, 0, &[Counters::default()]);
        if self.scene.has_movers() {
            let groups = self.plan.counts.particles.div_ceil(64);
            self.program.upload(BOUNDARY_WORK, 0, &vec![0.0; groups]);
        }
        let of_forces = forces::pbf_sums(&self.scene, self.plan.counts.particles);
        self.program.upload(FORCE_WORK, 0, &vec![0.0; of_forces]);
    }

    /// Projects velocities and uploads the uniforms for the substep that ends at `time`.
    fn prepare_substep(
        &mut self,
        time: f64,
        step: f64,
        run: &mut Run<'_>,
    ) -> Result<(), SolveError> {
        if let Some(grid) = &mut self.grid {
            grid.project(&self.program, (time - step, step), run)?;
            self.state.bodies = grid.flip().bodies().to_vec();
        }
        self.program.upload(PARAMS, 0, &[self.params(time, step)]);
        if let (Some(movers), Some(boundary)) = (&self.movers, &self.boundary) {
            let (program, scene) = (&self.program, &self.scene);
            let bodies = &self.state.bodies;
            movers.upload(program, scene, bodies, (time - step, step));
            let samples = scene.solid_samples(boundary, bodies, time, step);
            samples::upload_samples(&samples, program, scene, &self.plan, &self.calibration);
        }
        effects::upload(&self.program, &self.scene, (time, step));
        forces::upload_for_pbf(&self.program, &self.scene, (time - step, step));
        if let Stop::DensityError { .. } = self.scene.settings().stop {
            self.program.upload(CONTROL, 0, &[self.control()]);
        }
        Ok(())
    }

    fn run_substep(&mut self, time: f64, step: f64) -> Result<(), SolveError> {
        let mut timer = self.timer.take();
        let run: &mut Run<'_> =
            &mut |program, recordings| Ok(Recording::run_all(recordings, program, timer.as_mut())?);
        let prepared = self.prepare_substep(time, step, run);
        self.timer = timer;
        prepared?;
        Ok(self.substep.run(&self.program, self.timer.as_mut())?)
    }

    /// Returns the number of substeps in the next frame.
    fn substeps(&self) -> Result<u32, SolveError> {
        let boundaries = (&self.state.walls, &self.state.bodies[..]);
        Ok(self
            .scene
            .pbf_substeps(boundaries, self.frame, self.speed)?)
    }

    /// Returns the end time and the length of the k-th substep, seconds.
    fn substep_of(&self, substeps: u32, k: u32) -> (f64, f64) {
        let length = self.scene.shot.frame_seconds();
        let step = length / f64::from(substeps);
        (f64::from(self.frame) * length + f64::from(k) * step, step)
    }

    /// Returns the initial `control`: not done, no iterations, and the workgroups of the largest
    /// chunk for all particles and for one colour.
    fn control(&self) -> IterationControl {
        let largest = self
            .plan
            .chunks
            .iter()
            .map(|chunk| chunk.count as u64)
            .max()
            .unwrap_or(0);
        let groups = |threads| spread(&self.program.context, 64, threads).into();
        IterationControl {
            all: groups(largest),
            colour: groups(largest.div_ceil(2)),
            ..IterationControl::default()
        }
    }

    /// Computes the particles' pressures from Σ λ by [`Calibration::pressure_scale`], in sorted
    /// order. Call it before the state is uploaded again.
    fn particle_pressures(&self, step: f64) -> Result<Vec<(DVec3, f64)>, SolveError> {
        let n = self.plan.counts.particles;
        let wanted = (
            POSITION.first(n),
            lambda_sum(self.scene.has_movers(), n).first(n),
        );
        let (position, lambda) = self.program.download(wanted)?;
        let relaxation = self.scene.settings().relaxation;
        let density = self.scene.water.rest_density;
        let scale = self.calibration.pressure_scale(density, relaxation, step);
        let particles = position.iter().zip(&lambda);
        Ok(particles
            .map(|(x, lambda)| {
                let x = Vec3::from_array(*x).as_dvec3();
                (x, scale * f64::from(*lambda))
            })
            .collect())
    }

    /// Reads the requested data of the last substep, which was `step` seconds long.
    fn seen(&mut self, wanted: &Requested, step: f64) -> Result<Observed, SolveError> {
        let mut seen = Observed::default();
        if wanted.particles {
            let frame = self.frame + 1;
            seen.particles = self.state.look(&self.program, &self.scene, frame)?;
            seen.particles.substep = step;
        }
        if wanted.pressures {
            if self.grid.is_none() {
                self.pressed = self.particle_pressures(step)?;
            }
            seen.pressures = self.pressures(&self.scene.pressure_points())?;
        }
        Ok(seen)
    }

    /// Sorts particles at the frame's final positions, measures the density there, and maps the
    /// frame.
    fn measured(&mut self, time: f64) -> Result<MappedFrame, SolveError> {
        self.program.upload(PARAMS, 0, &[self.params(time, 0.0)]);
        self.measure.run(&self.program, self.timer.as_mut())?;
        let n = self.plan.counts.particles;
        let state = (POSITION.first(n), VELOCITY.first(n), ID.first(n));
        // Without moving walls the buffer does not exist.
        let groups = match self.scene.has_movers() {
            true => n.div_ceil(64),
            false => 0,
        };
        let measured = (
            sorted_id(n).first(n),
            DENSITY.first(n),
            COUNTERS.first(1),
            BOUNDARY_WORK.first(groups),
        );
        let of_forces = FORCE_WORK.first(forces::pbf_sums(&self.scene, n));
        Ok(MappedFrame {
            scene: self.scene.clone(),
            frame: self.frame + 1,
            state: self.state.clone(),
            found: self.program.map((state, measured, of_forces))?,
        })
    }
}

type OfState = (First<[f32; 3]>, First<[f32; 3]>, First<u32>);
type OfMeasure = (First<u32>, First<f32>, First<Counters>, First<f32>);

/// Reads a state and the relative density of each particle.
type ReadState = dyn FnOnce() -> Result<(Particles, Vec<f64>), SolveError> + Send;

/// A frame in mapped memory.
struct MappedFrame {
    scene: Arc<PbfScene<'static>>,
    frame: u32,
    /// With the walls before the frame.
    state: Carried,
    found: Mapped<(OfState, OfMeasure, First<f32>)>,
}

impl MappedFrame {
    fn counters(&self) -> Result<Counters, SolveError> {
        Ok(self.found.views()?.1.2[0])
    }

    /// Returns the work by moving walls and by forces on the water in the frame, joules; its
    /// substeps were `step` seconds long.
    fn boundary_work(&self, step: f64) -> Result<f64, SolveError> {
        let (_, measured, of_forces) = self.found.views()?;
        let sum = |sums: &[f32]| sums.iter().copied().map(f64::from).sum::<f64>();
        Ok(self.scene.particle_mass() * (sum(measured.3) / step + sum(of_forces)))
    }

    /// Returns the state, and the relative density of each particle.
    fn read(self) -> Result<(Particles, Vec<f64>), SolveError> {
        let (state, (sorted_id, density, counters, _), _) = self.found.views()?;
        let (position, velocity, id) = state;
        let ids = &self.state.ids;
        let places = ids.places(self.frame, id)?;
        let sorted_places = ids.places(self.frame, sorted_id)?;
        if counters[0].not_finite > 0 {
            let count = counters[0].not_finite.into();
            return Err(Breach::not_finite(self.frame, count, None).into());
        }
        let state = (self.state).state(&self.scene, &places, position, velocity);
        let density = sorted_places.collect(|k| f64::from(density[k]));
        check_finite(self.frame, &state, Some(&density))?;
        Ok((state, density))
    }
}

impl Solver for Pbf {
    type Error = SolveError;

    fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), SolveError> {
        self.scene.check_bodies(&particles.bodies)?;
        if is_other_count(&self.scene, self.plan.counts.particles, particles)? {
            self.resize(particles.len())?;
        }
        self.state = Carried::new(particles);
        self.speed = particles.max_speed();
        self.frame = frame;
        upload(&self.program, &self.scene, particles);
        match &mut self.grid {
            Some(grid) => grid.load(frame, particles),
            None => Ok(()),
        }
    }

    fn compute(&mut self, watch: &mut dyn Watch) -> Result<Unread<SolveError>, SolveError> {
        let length = self.scene.shot.frame_seconds();
        let start = f64::from(self.frame) * length;
        let substeps = self.substeps()?;
        self.begin_frame();
        for k in 1..=substeps {
            let (time, step) = self.substep_of(substeps, k);
            self.run_substep(time, step)?;
            let substep = Substep {
                start: self.substep_of(substeps, k - 1).0,
                end: time,
                is_last: k == substeps,
            };
            let wanted = watch.wants(substep);
            if wanted.is_any() {
                watch.look(substep, self.seen(&wanted, step)?);
            }
        }
        self.state.substep = length / f64::from(substeps);
        let measured = self.measured(start + length)?;
        self.speed = max_speed(measured.found.views()?.0.1);
        if self.scene.reads_multipliers() {
            self.pressed = self.particle_pressures(length / f64::from(substeps))?;
        }
        self.frame += 1;
        let counters = measured.counters()?;
        let work = measured.boundary_work(length / f64::from(substeps))?;
        let mut read: Box<ReadState> = Box::new(move || measured.read());
        self.state.walls = AbsorberStates::default();
        if is_awaited(&self.scene) {
            let (mut state, density) = read()?;
            self.scene.update_absorbers(&mut state, self.frame);
            self.state.walls = state.walls;
            if self.scene.domain.min != DVec3::ZERO {
                // World positions in the frame are rounded: continue from the written values, as
                // a resumed bake does.
                upload(&self.program, &self.scene, &state);
            }
            read = Box::new(move || Ok((state, density)));
        }
        if let Some(grid) = &mut self.grid {
            grid.take_absorbers(self.state.walls);
        }
        let iterations = match self.scene.settings().stop {
            Stop::Iterations(count) => u64::from(count) * u64::from(substeps),
            Stop::DensityError { .. } => u64::from(counters.iterations),
        };
        let grid = self.grid.as_ref().map(ProjectionGrid::done);
        let (scene, walls) = (self.scene.clone(), self.state.walls);
        Ok(Unread::new(walls, move || {
            let (mut state, density) = read()?;
            state.walls = walls;
            let report = StepReport {
                substeps,
                iterations,
                capped: u64::from(counters.capped),
                searched: u64::from(counters.searched),
                boundary_work: work + grid.as_ref().map_or(0.0, |grid| grid.1),
                projection: grid.map(|grid| grid.0),
                densest_at: scene.densest_particle(&state, &density),
                ..scene.report(&state, density.into_iter())
            };
            Ok((state, report))
        }))
    }

    /// Fits a plane to the pressures of particles around each point; with a projection, returns the
    /// projection's pressure.
    fn pressures(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, SolveError> {
        if let Some(grid) = &self.grid {
            return grid.pressures(points);
        }
        let local = |at: &DVec3| *at - self.scene.domain.min;
        let support = self.calibration.support_radius;
        let points = points.iter().map(local);
        Ok(points
            .map(|at| {
                let near = |x: DVec3| at + self.scene.period().shortest(x - at);
                let pressed = self.pressed.iter().map(|&(x, p)| (near(x), p));
                fitted(pressed, at, support)
            })
            .collect())
    }

    fn timings(&self) -> Vec<PassTime> {
        let timer = self.timer.as_ref();
        timer.map_or_else(Vec::new, |timer| timer.times(PassTime::new))
    }
}

impl TraceFrame for Pbf {
    fn trace_frame(&mut self, span: Span, observe: &mut Observe<'_>) -> Result<u32, SolveError> {
        let count = self.substeps()?;
        let (first, last) = match span {
            Span::From(first) => (first, count),
            Span::Only(SubstepChoice::Last) => (count, count),
            Span::Only(SubstepChoice::Number(number)) => (number, number),
        };
        if last > count {
            return Err(SolveError::NoSubstep {
                asked: last,
                frame: self.frame,
                count,
            });
        }
        self.begin_frame();
        for number in 1..first {
            let (time, step) = self.substep_of(count, number);
            self.run_substep(time, step)?;
        }
        for number in first..=last {
            let (time, step) = self.substep_of(count, number);
            let elapsed = f64::from(number - 1) * step;
            let begun = Begun {
                number,
                elapsed,
                before: if number > 1 { step } else { self.state.substep },
                bodies: self.state.bodies.clone(),
                deep: DeepBegun::default(),
            };
            let mut tell = |traced: Traced<'_>| observe(&begun, traced);
            self.prepare_substep(time, step, &mut |program, recordings| {
                trace(recordings, program, &mut tell)
            })?;
            let begun = Begun {
                bodies: self.state.bodies.clone(),
                ..begun.clone()
            };
            let mut tell = |traced: Traced<'_>| observe(&begun, traced);
            trace(&[&self.substep], &self.program, &mut tell)?;
            if number == last {
                self.program.upload(PARAMS, 0, &[self.params(time, 0.0)]);
                trace(&[&self.measure], &self.program, &mut tell)?;
            }
        }
        Ok(last)
    }
}
