//! Position-based fluids (Macklin and Müller 2013) with the red/black iteration.

use glam::DVec3;

use crate::{
    domain::{
        particles::Particles,
        pbf::{CAP, CONTACT, MAX_CORRECTION, REGULARIZATION},
        solver::{Solver, StepReport},
        sph::Calibration,
    },
    gpu::{
        adapter::Context,
        program::Program,
        recording::{Command, Recording, Timer, spread},
        sort,
    },
    scene::{
        Scene, Stop,
        plan::{DeviceLimits, LIST_BUDGET, Plan, SHARED_CONSTANTS},
    },
};

use super::{
    SolveError,
    boundary::Boundary,
    iteration::Builder,
    params::Params,
    state::{check_finite, max_speed, report, slots_by_id, take_over, upload},
};

/// Far from everything, and still finite when squared.
const NOBODY: [f32; 4] = [1e15, 1e15, 1e15, 0.0];

/// PBF on a device.
pub struct Pbf {
    program: Program,
    plan: Plan,
    scene: Scene,
    calibration: Calibration,
    substep: Recording,
    measure: Recording,
    timer: Option<Timer>,
    state: Particles,
    frame: u32,
}

impl Pbf {
    /// Builds what `plan` names, and nothing more. It must have been made for `scene` and `boundary`.
    ///
    /// # Errors
    /// A buffer over the adapter's limits, with the figures; a shader or the device at fault.
    pub fn new(
        context: &Context,
        scene: &Scene,
        plan: Plan,
        boundary: &Boundary,
        is_timed: bool,
    ) -> Result<Self, SolveError> {
        let counts = plan.counts;
        let particles = counts.particles;
        let buffers: Vec<_> = plan
            .buffers
            .iter()
            .map(|buffer| buffer.spec.clone())
            .collect();
        let passes: Vec<_> = plan.passes.iter().map(|pass| pass.spec.clone()).collect();
        let program = Program::new(context, &buffers, &passes, &SHARED_CONSTANTS)?;
        let pbf = scene.solver.pbf();
        let calibration = Calibration::new(pbf.particle_spacing, pbf.support_ratio);
        let mut builder = Builder::new(&plan);
        let substep = Recording::new(&program, &substep_commands(&plan, scene, &mut builder));
        let measure = Recording::new(&program, &measure_commands(&plan, &mut builder));
        program.upload("phases", 0, &builder.phase_slots());
        program.upload(
            "cell_start.lengths",
            0,
            &sort::scan_lengths(cell_count(&plan)),
        );
        program.upload("element_count", 0, &[particles as u32, 0, 0, 0]);
        let last = 2 * particles + counts.boundary_samples;
        program.upload("predicted", 16 * last as u64, &[NOBODY]);
        boundary.upload(&program, scene, &plan, &calibration);
        Ok(Self {
            timer: if is_timed { Timer::new(context) } else { None },
            program,
            plan,
            scene: scene.clone(),
            calibration,
            substep,
            measure,
            state: Particles::default(),
            frame: 0,
        })
    }

    /// What was built.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Names of the passes that a substep and a frame's measurement run, in order.
    pub fn recorded_passes(&self) -> Vec<&'static str> {
        self.substep.passes().chain(self.measure.passes()).collect()
    }

    /// Names of the passes and buffers that exist on the device, sorted.
    pub fn built(&self) -> (Vec<&str>, Vec<&str>) {
        self.program.names()
    }

    /// The named buffer's first `count` values, such as `lambda` or `density`, in sorted order.
    ///
    /// # Errors
    /// The device.
    pub fn field<T: bytemuck::Pod>(&self, name: &str, count: usize) -> Result<Vec<T>, SolveError> {
        Ok(self.program.download(&[(name, count)])?.remove(0))
    }

    /// Substeps that the CFL number asks of the next frame: from the speeds in the state, what gravity adds
    /// within the frame, and the fastest wave-maker.
    fn substeps(&self, start: f64, length: f64) -> Result<u32, SolveError> {
        let pbf = self.scene.solver.pbf();
        let free = max_speed(&self.state) + self.scene.water.gravity.length() * length;
        let wall = self
            .scene
            .wave_makers
            .iter()
            .map(|w| w.motion.peak_speed(start, start + length));
        let speed = wall.fold(free, f64::max);
        let wanted = (speed * length / (pbf.cfl * pbf.particle_spacing))
            .ceil()
            .max(1.0);
        if wanted > f64::from(pbf.max_substeps) {
            return Err(SolveError::Numbers {
                frame: self.frame + 1,
                what: format!(
                    "{speed:.3} m/s asks for {wanted} substeps at cfl {}, and solver.pbf.max_substeps is {}",
                    pbf.cfl, pbf.max_substeps
                ),
            });
        }
        Ok(wanted as u32)
    }

    fn params(&self, time: f64, step: f64) -> Params {
        let pbf = self.scene.solver.pbf();
        let calibration = &self.calibration;
        let size = self.scene.domain.size();
        let (mut low, mut high) = (DVec3::ZERO, size);
        for maker in &self.scene.wave_makers {
            let inward = maker.motion.displacement(time);
            if maker.wall.is_max {
                high[maker.wall.axis] -= inward;
            } else {
                low[maker.wall.axis] += inward;
            }
        }
        let natural_lambda = 1.0 / calibration.bulk_gradient_squares;
        Params {
            velocity_step: (self.scene.water.gravity * step).as_vec3().to_array(),
            particle_count: self.plan.counts.particles as u32,
            grid_dims: self.plan.grid_dims,
            max_correction: (MAX_CORRECTION * pbf.particle_spacing) as f32,
            wall_min: low.as_vec3().to_array(),
            time_step: step as f32,
            wall_max: high.as_vec3().to_array(),
            inverse_time_step: if step > 0.0 { (1.0 / step) as f32 } else { 0.0 },
            support_radius: calibration.support_radius as f32,
            inverse_support_radius: (1.0 / calibration.support_radius) as f32,
            nobody: (self.plan.counts.particles + self.plan.counts.boundary_samples) as u32,
            density_scale: calibration.density_scale as f32,
            gradient_scale: calibration.gradient_scale as f32,
            wall_density_scale: calibration.wall_density_scale as f32,
            regularization: (REGULARIZATION * calibration.bulk_gradient_squares) as f32,
            relaxation: pbf.relaxation as f32,
            contact_distance: (CONTACT * pbf.particle_spacing) as f32,
            max_displacement: (CAP * pbf.cfl * pbf.particle_spacing) as f32,
            artificial_pressure: (pbf.artificial_pressure * natural_lambda) as f32,
            padding: 0.0,
        }
    }

    fn run_substep(&mut self, time: f64, step: f64) -> Result<(), SolveError> {
        self.program.upload("params", 0, &[self.params(time, step)]);
        if let Stop::DensityError { .. } = self.scene.solver.pbf().stop {
            self.program.upload("control", 0, &self.control());
        }
        Ok(self.substep.run(&self.program, self.timer.as_mut())?)
    }

    /// A fresh `control`: not done, no iterations, and the groups of the largest chunk over all and over a colour.
    fn control(&self) -> [u32; 12] {
        let largest = self
            .plan
            .chunks
            .iter()
            .map(|chunk| chunk.count as u64)
            .max()
            .unwrap_or(0);
        let [x, y, z] = spread(&self.program.context, 64, largest);
        let [half_x, half_y, half_z] = spread(&self.program.context, 64, largest.div_ceil(2));
        [0, 0, 0, 0, x, y, z, 0, half_x, half_y, half_z, 0]
    }

    /// Sorts at the frame's last positions, measures density there, and reads everything back.
    fn read_state(&mut self, time: f64) -> Result<(Vec<f32>, [u32; 4]), SolveError> {
        self.program.upload("params", 0, &[self.params(time, 0.0)]);
        self.measure.run(&self.program, self.timer.as_mut())?;
        let n = self.plan.counts.particles;
        let vectors = self
            .program
            .download::<[f32; 4]>(&[("position", n), ("velocity", n)])?;
        let words =
            self.program
                .download::<u32>(&[("id", n), ("sorted_id", n), ("counters", 4)])?;
        let ([position, velocity], [id, sorted_id, counters]) =
            (vectors.as_slice(), words.as_slice())
        else {
            unreachable!("one vector a buffer");
        };
        let counters = [counters[0], counters[1], counters[2], counters[3]];
        let density = self.field::<f32>("density", n)?;

        let slot_of = slots_by_id(&self.state.id);
        take_over(
            &mut self.state,
            &self.scene,
            &slot_of,
            id,
            position,
            velocity,
        );
        let mut by_slot = vec![0.0; n];
        for (&id, &value) in sorted_id.iter().zip(&density) {
            by_slot[slot_of(id)] = value;
        }
        Ok((by_slot, counters))
    }
}

impl Solver for Pbf {
    type Error = SolveError;

    fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), SolveError> {
        let planned = self.plan.counts.particles;
        if particles.len() != planned {
            return Err(SolveError::Count {
                planned,
                given: particles.len(),
            });
        }
        self.state = particles.clone();
        self.frame = frame;
        upload(&self.program, &self.scene, &self.state);
        Ok(())
    }

    fn advance(&mut self) -> Result<(Particles, StepReport), SolveError> {
        let length = 1.0 / self.scene.shot.frames_per_second;
        let start = f64::from(self.frame) * length;
        let substeps = self.substeps(start, length)?;
        let step = length / f64::from(substeps);
        self.program.upload("counters", 0, &[0u32; 4]);
        for k in 1..=substeps {
            self.run_substep(start + f64::from(k) * step, step)?;
        }
        let (density, [capped, searched, adaptive_iterations, not_finite]) =
            self.read_state(start + length)?;
        self.frame += 1;
        if not_finite > 0 {
            let what = format!("{not_finite} values that are not finite in {substeps} substeps");
            return Err(SolveError::Numbers {
                frame: self.frame,
                what,
            });
        }
        check_finite(self.frame, &self.state, Some(&density))?;
        if self.scene.domain.min != DVec3::ZERO {
            // The frame's world positions are rounded: go on from what was written, as a resumed bake would.
            upload(&self.program, &self.scene, &self.state);
        }
        let iterations = match self.scene.solver.pbf().stop {
            Stop::Iterations(count) => u64::from(count) * u64::from(substeps),
            Stop::DensityError { .. } => u64::from(adaptive_iterations),
        };
        let report = report(&self.scene, &self.state, &density);
        let report = StepReport {
            substeps,
            iterations,
            capped: u64::from(capped),
            searched: u64::from(searched),
            ..report
        };
        Ok((self.state.clone(), report))
    }

    fn timings(&self) -> Vec<(&'static str, f64, u64)> {
        let total = self.timer.as_ref().map(|timer| &timer.total);
        total
            .into_iter()
            .flatten()
            .map(|(&name, &(seconds, runs))| (name, seconds, runs))
            .collect()
    }
}

/// The limits of an open device that a plan depends on.
pub fn device_limits(context: &Context) -> DeviceLimits {
    DeviceLimits {
        binding: context.limits.max_storage_buffer_binding_size,
        buffer: context.limits.max_buffer_size,
        list_budget: LIST_BUDGET,
    }
}

fn cell_count(plan: &Plan) -> usize {
    plan.grid_dims.iter().map(|&n| n as usize).product()
}

fn sort_commands(plan: &Plan) -> Vec<Command> {
    let n = plan.counts.particles;
    let mut commands = vec![
        Command::Clear("cell_start"),
        Command::over("pbf/assign_cells", n),
    ];
    commands.extend(sort::scan("cell_start", cell_count(plan)));
    commands.extend(sort::SORT_PASSES.map(|pass| Command::over(pass, n)));
    commands.push(Command::over("pbf/reorder", n));
    commands
}

fn substep_commands(plan: &Plan, scene: &Scene, builder: &mut Builder<'_>) -> Vec<Command> {
    let pbf = scene.solver.pbf();
    let mut commands = vec![Command::over("pbf/predict", plan.counts.particles)];
    commands.extend(sort_commands(plan));
    if plan.has_lists {
        builder.over_all("pbf/build_neighbors", &mut commands);
    }
    builder.iterations(pbf, &mut commands);
    builder.finish(pbf, &mut commands);
    for effect in plan.effect_passes() {
        builder.over_all(effect, &mut commands);
    }
    commands
}

fn measure_commands(plan: &Plan, builder: &mut Builder<'_>) -> Vec<Command> {
    let mut commands = vec![Command::over("pbf/predict", plan.counts.particles)];
    commands.extend(sort_commands(plan));
    builder.measure(&mut commands);
    commands
}
