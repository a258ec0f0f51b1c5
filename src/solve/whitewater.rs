//! Whitewater on the GPU: potentials for its emission, and its motion between two frames.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::{air, effects::forces};
use swell_domain::{
    boundary::Boundary,
    budget::Breach,
    forces::Medium,
    parallel,
    particles::Particles,
    solver::PassTime,
    sph::Calibration,
    whitewater::{
        AIR_BELOW, CLOSING, CompleteSettings, FLIGHT_STEPS, HALVINGS, KIND, OUTWARD, Potentials,
        SURFACE, WATER_ABOVE,
    },
};
use swell_gpu::{
    adapter::Context,
    buffer::Buf,
    program::{PassSpec, Program},
    recording::{Command, Recording, Timer},
    sort,
};
use swell_scene::PbfScene;

use super::{
    SolveError,
    boundary::Movers,
    pbf::{buffers::*, params, plan::cell_count, record::sorting, samples},
    plan::{BufferTable, Counts, Plan, in_order},
    state::is_other_count,
};

/// Water fraction around each water particle, in sorted order.
pub const SHARE: Buf<f32> = Buf::new("share");
/// Outward surface normal at each water particle, in sorted order, and in w the confidence that it
/// is at the surface, 0 to 1.
pub const SURFACE_AT: Buf<[f32; 4]> = Buf::new("surface");
/// Closing speed, m/s, wave crest, energy, J/kg, and water fraction, in sorted order.
pub const POTENTIAL: Buf<[f32; 4]> = Buf::new("potential");
/// Position x, y, z of each whitewater particle, and its kind in w.
pub const WHITE_POSITION: Buf<[f32; 4]> = Buf::new("white_position");
/// Velocity of each whitewater particle, and in w its speed of rise as a bubble, m/s, before a
/// frame, and the water fraction around it after one.
pub const WHITE_VELOCITY: Buf<[f32; 4]> = Buf::new("white_velocity");
/// Number of whitewater particles, in the first component.
pub const WHITE_COUNT: Buf<[u32; 4]> = Buf::uniform("white_count");

/// Passes that compute the potentials of water particles.
pub const SURVEY: [&str; 2] = ["whitewater/survey", "whitewater/potentials"];
/// Pass that moves whitewater particles.
pub const ADVANCE: &str = "whitewater/advance";

/// Whitewater's passes for the frames of one bake.
pub struct Whitewater {
    program: Program,
    plan: Plan,
    scene: PbfScene<'static>,
    calibration: Calibration,
    survey: Recording,
    /// Boundary to upload again when the water's particle count changes or solids move. `None` if
    /// neither can happen.
    boundary: Option<Boundary>,
    movers: Option<Movers>,
    settings: Option<CompleteSettings>,
    /// Number of whitewater particles that the buffers can hold.
    capacity: usize,
    timer: Option<Timer>,
}

/// Plans the passes for the water's potentials, and buffers for `white` whitewater particles.
fn plan(scene: &PbfScene, boundary: &Boundary, water: usize, white: usize) -> Plan {
    let pbf = scene.settings();
    let support = Calibration::new(pbf.particle_spacing, pbf.support_ratio).support_radius;
    let counts = Counts {
        particles: water,
        ..Counts::of_solids(boundary)
    };
    let mut plan = Plan::bare(counts, scene.period().cells(scene.domain.size(), support));
    let cells = cell_count(&plan);
    let mut table = BufferTable::default();
    table.add("sort", CELL_START.sized(cells + 1));
    table.extend("sort", sort::scan_buffers(&CELL_START, cells));
    let keys = [CELL_OF, SLOT_IN_CELL, PLACED, ORDER];
    table.extend("sort", keys.map(|buffer| buffer.sized(water)));
    table.add("sort", ELEMENT_COUNT.sized(1));
    table.add("whitewater", PARAMS.sized(1));
    let with_samples = water + counts.boundary_samples;
    table.add("whitewater", PREDICTED.sized(with_samples));
    let vectors = [CORRECTED, VELOCITY, START_POSITION, SORTED_VELOCITY];
    table.extend("whitewater", vectors.map(|buffer| buffer.sized(water)));
    let fours = [SURFACE_AT, POTENTIAL];
    table.extend("whitewater", fours.map(|buffer| buffer.sized(water)));
    table.extend("whitewater", [ID.sized(2 * water), SHARE.sized(water)]);
    table.extend(
        "whitewater",
        [WHITE_POSITION, WHITE_VELOCITY].map(|b| b.sized(white)),
    );
    table.add("whitewater", WHITE_COUNT.sized(1));
    table.extend(forces::OWNER, forces::buffers(scene, Medium::Whitewater));
    if plan.has_solids() {
        table.add("solids", SOLID_DISTANCE.sized(counts.solid_floats()));
        table.add("solids", BOUNDARY_CELL_START.sized(cells + 1));
        match counts.moving_nodes {
            0 => table.add("solids", SOLID_GRID.sized(1)),
            _ => table.add("solids", POSED_SOLIDS.sized(1)),
        }
    }
    plan.declare(table);
    plan
}

fn survey_commands(plan: &Plan) -> Vec<Command> {
    let n = plan.counts.particles;
    let mut commands = sorting(plan);
    commands.extend(SURVEY.map(|pass| Command::over(pass, n)));
    commands
}

fn pass(
    name: &'static str,
    plan: &Plan,
    scene: &PbfScene,
    settings: Option<&CompleteSettings>,
) -> PassSpec {
    let has_forces = scene.has_forces_on(Medium::Whitewater);
    let conditions = [
        ("SOLIDS", plan.has_solids()),
        ("MOVING_SOLIDS", plan.counts.moving_nodes > 0),
        ("SHAPES", plan.counts.shape_nodes > 0),
        ("PERIODIC", scene.is_periodic()),
        ("FORCES", has_forces),
        (
            forces::MESHES,
            forces::has_meshes(scene, Medium::Whitewater),
        ),
    ];
    let constants = match (name, settings) {
        ("whitewater/survey", _) => {
            vec![("SURFACE_LEAST", SURFACE[0]), ("SURFACE_FULL", SURFACE[1])]
        }
        ("whitewater/potentials", _) => {
            vec![
                ("OUTWARD_LEAST", OUTWARD[0]),
                ("OUTWARD_FULL", OUTWARD[1]),
                ("CLOSING", CLOSING),
            ]
        }
        (ADVANCE, Some(settings)) => {
            let own = vec![
                ("AIR_BELOW", AIR_BELOW),
                ("WATER_ABOVE", WATER_ABOVE),
                ("FLIGHT_STEPS", f64::from(FLIGHT_STEPS)),
                ("HALVINGS", f64::from(HALVINGS)),
                ("RESPONSE", settings.response),
            ];
            let of_forces = match has_forces {
                true => forces::constants(scene, Medium::Whitewater),
                false => Vec::new(),
            };
            let of_air = air::constants(settings.drop_radius, settings.wind);
            [own, of_air, of_forces].concat()
        }
        _ => Vec::new(),
    };
    let holding = conditions.into_iter().filter(|(_, holds)| *holds);
    PassSpec {
        name,
        defines: holding.map(|(define, _)| define).collect(),
        constants,
    }
}

/// Uploads data that does not change between frames; returns the recording of a survey.
fn set_up(
    program: &Program,
    plan: &Plan,
    scene: &PbfScene,
    boundary: &Boundary,
    calibration: &Calibration,
) -> Recording {
    sort::upload_lengths(program, &CELL_START, cell_count(plan));
    let water = plan.counts.particles as u32;
    program.upload(ELEMENT_COUNT, 0, &[[water, 0, 0, 0]]);
    samples::upload(boundary, program, scene, plan, calibration);
    forces::upload_meshes(program, scene, Medium::Whitewater);
    Recording::new(program, &survey_commands(plan))
}

impl Whitewater {
    /// Creates the passes for `water` particles of `scene`, which is
    /// [`of_whitewater`](swell_scene::Scene::of_whitewater) of
    /// the baked scene. Call [`Self::set`] before [`Self::advance`].
    ///
    /// # Errors Returns an error if a buffer exceeds the adapter's limits, a shader does not
    /// compile, or the device fails.
    pub fn new(
        context: &Context,
        scene: &PbfScene,
        boundary: &Boundary,
        water: usize,
        is_timed: bool,
    ) -> Result<Self, SolveError> {
        let plan = plan(scene, boundary, water, 0);
        let commands = survey_commands(&plan);
        let passes: Vec<PassSpec> = in_order(&commands)
            .map(|name| pass(name, &plan, scene, None))
            .collect();
        let program = Program::new(context, &plan.buffer_specs(), &passes, &[])?;
        let pbf = scene.settings();
        let calibration = Calibration::new(pbf.particle_spacing, pbf.support_ratio);
        Ok(Self {
            survey: set_up(&program, &plan, scene, boundary, &calibration),
            boundary: (scene.has_sources() || !boundary.moving.is_empty())
                .then(|| boundary.clone()),
            movers: Movers::of(boundary, scene),
            timer: is_timed.then(|| Timer::new(context)),
            scene: scene.to_owned_scene(),
            settings: None,
            capacity: 0,
            calibration,
            program,
            plan,
        })
    }

    /// Prepares the motion of whitewater with these settings.
    ///
    /// # Errors Returns an error if a shader does not compile or the device fails.
    pub fn set(&mut self, settings: &CompleteSettings) -> Result<(), SolveError> {
        let pass = pass(ADVANCE, &self.plan, &self.scene, Some(settings));
        self.program.refit(&[], &[pass])?;
        self.settings = Some(settings.clone());
        Ok(())
    }

    /// Resizes buffers to another number of water particles.
    fn resize(&mut self, water: usize) -> Result<(), SolveError> {
        let boundary = self.boundary.as_ref();
        let boundary = boundary.expect("a scene in which water enters or leaves");
        self.plan = plan(&self.scene, boundary, water, self.capacity);
        self.program.refit(&self.plan.buffer_specs(), &[])?;
        let (program, scene) = (&self.program, &self.scene);
        self.survey = set_up(program, &self.plan, scene, boundary, &self.calibration);
        Ok(())
    }

    /// Returns the names of the passes and of the buffers that exist on the device, sorted.
    pub fn built(&self) -> (Vec<&str>, Vec<&str>) {
        self.program.names()
    }

    /// Returns the time of each pass; empty unless timed.
    pub fn times(&self) -> Vec<PassTime> {
        let timer = self.timer.as_ref();
        timer.map_or_else(Vec::new, |timer| timer.times(PassTime::new))
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

    /// Uploads the water of the frame at `time`, `seconds` after the previous one, and returns the
    /// potentials of its particles, in the water's order.
    ///
    /// # Errors Returns an error if the device fails, or if the particle count changed although no
    /// water enters or leaves the scene.
    pub fn survey(
        &mut self,
        water: &Particles,
        time: f64,
        seconds: f64,
    ) -> Result<Vec<Potentials>, SolveError> {
        let n = water.len();
        if is_other_count(&self.scene, self.plan.counts.particles, water)? {
            self.resize(n)?;
        }
        let local = local(&self.scene, &water.position);
        self.program.upload(CORRECTED, 0, &local);
        self.program.upload(VELOCITY, 0, &water.velocity);
        self.program.upload(ID, 0, &water.id);
        let mut params = params(
            &self.scene,
            &self.calibration,
            &self.plan,
            &water.walls,
            (time, seconds),
        );
        // Whitewater falls under gravity, however the water's own solver applies it.
        params.velocity_step = (self.scene.water.gravity * seconds).as_vec3().to_array();
        self.program.upload(PARAMS, 0, &[params]);
        let span = (time - seconds, seconds);
        forces::upload(&self.program, &self.scene, Medium::Whitewater, span);
        if let (Some(movers), Some(boundary)) = (&self.movers, &self.boundary) {
            let (program, scene) = (&self.program, &self.scene);
            movers.upload(program, scene, &water.bodies, (time - seconds, seconds));
            let samples = scene.solid_samples(boundary, &water.bodies, time, seconds);
            samples::upload_samples(&samples, program, scene, &self.plan, &self.calibration);
        }
        self.survey.run(&self.program, self.timer.as_mut())?;
        let (potential, order) = (self.program).download((POTENTIAL.first(n), ORDER.first(n)))?;
        let mut found = vec![Potentials::default(); n];
        for (&place, values) in order.iter().zip(&potential) {
            let [trapped_air, wave_crest, energy, share] = values.map(f64::from);
            found[place as usize] = Potentials {
                trapped_air,
                wave_crest,
                energy,
                share,
            };
        }
        Ok(found)
    }

    /// Moves whitewater from the previous frame to that of the last [`Self::survey`]: positions,
    /// velocities, kinds.
    ///
    /// # Errors Returns an error if the device fails or a value is not finite.
    ///
    /// # Panics Panics if [`Self::set`] was not called.
    pub fn advance(&mut self, white: &mut Particles, frame: u32) -> Result<(), SolveError> {
        let settings = self.settings.as_ref();
        let settings = settings.expect("settings come before moves");
        let n = white.len();
        if n == 0 {
            return Ok(());
        }
        if n > self.capacity {
            // 25 % headroom, so that a growing stream does not reallocate in every frame.
            self.capacity = n + n / 4;
            let specs = [WHITE_POSITION, WHITE_VELOCITY].map(|b| b.sized(self.capacity));
            self.program.refit(&specs, &[])?;
        }
        let kinds = &white.attributes[KIND];
        let local = local(&self.scene, &white.position);
        let order = self.by_cell(&local);
        let at = |&k: &u32| k as usize;
        let position = parallel::map_slice(&order, |k| {
            let [x, y, z] = local[at(k)];
            [x, y, z, kinds[at(k)]]
        });
        let velocity = parallel::map_slice(&order, |k| {
            let [x, y, z] = white.velocity[at(k)];
            [x, y, z, settings.rise_of(white.id[at(k)]) as f32]
        });
        self.program.upload(WHITE_POSITION, 0, &position);
        self.program.upload(WHITE_VELOCITY, 0, &velocity);
        self.program.upload(WHITE_COUNT, 0, &[[n as u32, 0, 0, 0]]);
        let recording = Recording::new(&self.program, &[Command::over(ADVANCE, n)]);
        recording.run(&self.program, self.timer.as_mut())?;
        let (position, velocity) =
            (self.program).download((WHITE_POSITION.first(n), WHITE_VELOCITY.first(n)))?;
        let origin = self.scene.domain.min;
        let moved = position.iter().zip(&velocity);
        for (k, ([x, y, z, kind], [u, v, w, _])) in order.iter().map(at).zip(moved) {
            let world = Vec3::new(*x, *y, *z).as_dvec3() + origin;
            white.position[k] = world.as_vec3().to_array();
            white.velocity[k] = [*u, *v, *w];
            if let Some(own) = white.attributes.get_mut(KIND) {
                own[k] = *kind;
            }
        }
        match white.first_not_finite(None) {
            None => Ok(()),
            Some((count, first)) => Err(Breach::not_finite(frame, count, Some(first)).into()),
        }
    }
}

impl Whitewater {
    /// Returns the order of positions by their cells: neighbouring threads then read the same water
    /// particles.
    fn by_cell(&self, places: &[[f32; 3]]) -> Vec<u32> {
        let h = self.calibration.support_radius as f32;
        let [nx, ny, _] = self.plan.grid_dims.map(u64::from);
        let key = |[x, y, z]: &[f32; 3]| {
            // A float-to-integer cast saturates: negative values become 0.
            let [x, y, z] = [x, y, z].map(|x| (x / h) as u64);
            (z * ny + y) * nx + x
        };
        let mut order: Vec<(u64, u32)> =
            parallel::map(0..places.len(), |k| (key(&places[k]), k as u32));
        order.par_sort_unstable();
        order.into_iter().map(|(_, k)| k).collect()
    }
}

/// Returns positions relative to the domain's minimum corner.
fn local(scene: &PbfScene, positions: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let origin = scene.domain.min;
    let one = |p: &[f32; 3]| {
        let x: DVec3 = Vec3::from_array(*p).as_dvec3() - origin;
        x.as_vec3().to_array()
    };
    positions.iter().map(one).collect()
}
