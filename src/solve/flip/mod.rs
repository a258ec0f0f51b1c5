//! PIC/FLIP (Zhu and Bridson 2005) and APIC (Jiang et al. 2015) on sparse bricks of a MAC grid.
//!
//! A substep measures the particles' largest speed and the bricks that they touch, sorts them by
//! cell, transfers their velocities to the grid, projects, transfers the change back and advects
//! the particles through the projected field. No grid outlives its substep: the state consists of
//! positions, velocities and ids, and for APIC of the affine matrices' rows.

mod bodies;
pub mod buffers;
mod capacity;
mod deep;
mod ended;
pub(super) mod plan;
mod record;
mod step;
mod totals;
mod trace;
mod velocities;
mod watch;

use std::sync::Arc;

use glam::DVec3;

use swell_contact::SceneContacts;
use swell_domain::{
    absorber::AbsorberStates,
    body::Six,
    boundary::Boundary,
    bounds::Bounds,
    bricks::{Bricks, CELLS, table_dims},
    budget::Breach,
    flip::{layers, stored_cells},
    forces::Medium,
    particles::Particles,
    shores::Shores,
    solver::{PassTime, Solver, StepReport, Unread, Watch},
};
use swell_gpu::{
    adapter::Context,
    buffer::Buf,
    program::Program,
    recording::{Recording, Timer},
};
use swell_scene::{FlipScene, moving_solid::MovingSolid, step::Substep};

use super::{
    SolveError,
    boundary::{Movers, upload_distance},
    effects::{
        self,
        forces::{self, FORCE_WORK},
    },
    params::Counters,
    plan::{Counts, Plan},
    pressure::{self, PressureSolver, Round, bodies::Lists},
    state::{Carried, is_awaited, is_other_count, upload},
    trace::Run,
};
use buffers::*;
pub use capacity::capacity;
use capacity::{
    bricks, capacity_of, laden_bricks, no_water, pressure_solver, recordings, upload_constants,
    whole_frame,
};
use deep::DeepState;
use ended::{Ended, ReadFrame};
use record::{Recordings, groups};
pub(super) use totals::FrameTotals;

/// The FLIP solver on a GPU.
pub struct Flip {
    program: Program,
    plan: Plan,
    scene: Arc<FlipScene<'static>>,
    movers: Option<Movers>,
    shores: Shores,
    recordings: Recordings,
    pressure: PressureSolver,
    timer: Option<Timer>,
    state: Carried,
    frame: u32,
    /// Bricks of the last substep.
    bricks: Bricks,
    /// Walls that cut the cells of the last substep, in cells.
    cut: Bounds,
    /// See [`Substep::kick`], seconds.
    kick: f64,
    contacts: Option<SceneContacts>,
    /// Responses of the bodies to impulses in the substep.
    responses: Vec<[Six; 6]>,
    /// Where the bodies may touch the water in the substep.
    touched: Lists,
    /// Water without particles; `None` without a band, and before a state is loaded.
    deep: Option<DeepState>,
}

/// Result of `flip/survey`.
struct Survey {
    /// Largest particle speed, m/s.
    speed: f64,
    not_finite: u32,
    is_wet: Vec<bool>,
}

impl Flip {
    /// Builds the passes and buffers of `plan`, which must have been made for `scene` and
    /// `boundary`.
    ///
    /// # Errors Returns an error if a buffer exceeds the adapter's limits, a shader does not
    /// compile, or the device fails.
    pub fn new(
        context: &Context,
        scene: &FlipScene,
        plan: Plan,
        boundary: &Boundary,
        is_timed: bool,
    ) -> Result<Self, SolveError> {
        pressure::require(context, &scene.settings().pressure)?;
        let (buffers, passes) = (plan.buffer_specs(), plan.pass_specs());
        let program = Program::new(context, &buffers, &passes, &[])?;
        upload_distance(boundary, &program, scene);
        forces::upload_meshes(&program, scene, Medium::Water);
        upload_constants(&program, &plan, scene);
        let bricks = bricks(scene, plan.grid_dims, &no_water(scene, plan.grid_dims), 0);
        let frame = whole_frame(scene);
        let mut state = Carried::new(&Particles::default());
        state.bodies = scene.bodies_at_start();
        let params = step::params(scene, &plan, &state.walls, &bricks, &frame);
        program.upload(PARAMS, 0, &[params]);
        Ok(Self {
            recordings: recordings(&program, &plan, scene),
            pressure: pressure_solver(scene, &plan),
            timer: is_timed.then(|| Timer::new(context)),
            bricks,
            cut: step::cut(scene, &state.walls, &frame),
            kick: frame.kick,
            program,
            plan,
            scene: Arc::new(scene.to_owned_scene()),
            movers: Movers::of(boundary, scene),
            contacts: SceneContacts::of(scene),
            responses: Vec::new(),
            touched: Lists::default(),
            deep: None,
            shores: Shores::new(boundary, scene.domain.min, scene.settings().cell_size)
                .joined(scene.periodic),
            state,
            frame: 0,
        })
    }

    /// Returns the current plan, whose brick capacity grows with the water.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Returns the bricks of the last substep.
    pub fn bricks(&self) -> &Bricks {
        &self.bricks
    }

    /// Returns the names of the passes of a substep in order, without those of the projection.
    pub fn recorded_passes(&self) -> Vec<&'static str> {
        let recordings = &self.recordings;
        let before = recordings
            .survey
            .passes()
            .chain(recordings.to_grid.passes())
            .chain(recordings.between());
        let after = recordings
            .to_particles
            .passes()
            .chain(recordings.watch.passes());
        before.chain(after).collect()
    }

    /// Returns the names of the passes and of the buffers that exist on the device, sorted.
    pub fn built(&self) -> (Vec<&str>, Vec<&str>) {
        self.program.names()
    }

    /// Reads the first `count` values of a buffer, as the last substep left them.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn field<T: bytemuck::Pod>(
        &self,
        buffer: Buf<T>,
        count: usize,
    ) -> Result<Vec<T>, SolveError> {
        Ok(self.program.read(buffer, count)?)
    }

    fn survey(&mut self, run: &mut Run<'_>) -> Result<Survey, SolveError> {
        run(&self.program, &[&self.recordings.survey])?;
        let flags = SURVEY_IS_WET.first(no_water(&self.scene, self.plan.grid_dims).len());
        let (head, is_wet) = self.program.download((SURVEY.first(1), flags))?;
        let of_deep = self.deep.as_ref().map_or(0.0, |deep| deep.speed);
        Ok(Survey {
            speed: f64::from(head[0].speed_square).sqrt().max(of_deep),
            not_finite: head[0].not_finite,
            is_wet: is_wet.into_iter().map(|flag| flag != 0).collect(),
        })
    }

    /// Chooses the next substep of the `remaining` seconds, and estimates how many substeps these
    /// take.
    fn choose(
        &self,
        survey: &Survey,
        start: f64,
        remaining: f64,
        done: u32,
    ) -> Result<(f64, Substep), SolveError> {
        if survey.not_finite > 0 {
            let breach = Breach::not_finite(self.frame + 1, survey.not_finite.into(), None);
            // The values come from the previous substep, or from the loaded state.
            return Err(breach.in_substep(done.max(1)).into());
        }
        let frame = self.frame + 1;
        let chosen = (self.scene).flip_substep(
            (&self.state.walls, &self.state.bodies),
            frame,
            start,
            remaining,
            survey.speed,
            (done, self.state.substep),
        )?;
        Ok(chosen)
    }

    /// Extends `is_wet`, the bricks that hold particles, by bricks near solids that belong to the
    /// water.
    fn with_shores(&self, is_wet: &[bool], substep: &Substep) -> Vec<bool> {
        let size = self.scene.settings().cell_size;
        let cut = step::cut(&self.scene, &self.state.walls, substep);
        let moving = self.scene.moving_solids.iter();
        let least = self.scene.domain.min;
        let bodies = &self.state.bodies;
        let pose = |solid: &MovingSolid| {
            let pose = solid.pose(bodies, substep.start);
            pose.moved(-least).scaled(1.0 / size)
        };
        let movers = self.movers.as_ref();
        let poses = moving.enumerate().map(|(index, solid)| {
            let surface = movers.and_then(|it| it.surface(index, substep, (least, size)));
            (pose(solid), surface)
        });
        let dims = table_dims(stored_cells(self.plan.grid_dims, self.scene.periodic));
        let mut is_wet = is_wet.to_vec();
        self.shores.mark(&mut is_wet, dims, &cut, poses);
        is_wet
    }

    /// Lays out bricks around the water and grows the buffers if they do not fit.
    fn lay_out(&mut self, is_wet: &[bool], substep: &Substep) -> Result<(), SolveError> {
        let layers = layers(substep.displacement);
        let with_deep = self.with_deep(is_wet);
        let all_wet = self.with_shores(&with_deep, substep);
        let is_laden = match self.deep {
            Some(_) => is_wet,
            None => &all_wet[..],
        };
        let flags = (&all_wet[..], is_laden);
        self.bricks = laden_bricks(&self.scene, self.plan.grid_dims, flags, layers);
        let needed = capacity_of(&self.bricks);
        let grown = self.plan.counts.bricks.grown(needed);
        if grown != self.plan.counts.bricks {
            self.refit_around_deep(Counts {
                bricks: grown,
                ..self.plan.counts
            })?;
        }
        self.relate_deep();
        let bricks = &self.bricks;
        let params = step::params(&self.scene, &self.plan, &self.state.walls, bricks, substep);
        let groups = groups(&self.program, &self.scene, &params, layers);
        self.cut = step::cut(&self.scene, &self.state.walls, substep);
        self.kick = substep.kick;
        self.program.upload(PARAMS, 0, &[params]);
        (self.program).upload(BRICKS, 0, bytemuck::cast_slice(&bricks.records));
        self.program.upload(BRICK_SLOT, 0, &bricks.table);
        self.program.upload(GROUPS, 0, &groups);
        self.upload_movers(substep);
        if self.scene.has_inlets() {
            let inlets = step::inlets(&self.scene, substep);
            self.program.upload(INLETS, 0, &[inlets]);
        }
        let span = (substep.start, substep.length);
        effects::upload(&self.program, &self.scene, span);
        forces::upload(
            &self.program,
            &self.scene,
            Medium::Water,
            substep.kick_span(),
        );
        Ok(())
    }

    /// Transfers the loaded state to the grid, as the first substep of the next frame does;
    /// [`Self::project`] continues from there.
    ///
    /// # Errors Returns an error if the device fails or the state is not finite or too fast.
    pub fn carry_to_grid(&mut self) -> Result<Substep, SolveError> {
        self.timed(|flip, run| {
            let (survey, substep) = flip.first_substep(run)?;
            flip.carry(&survey.is_wet, &substep, run)?;
            Ok(substep)
        })
    }

    /// Projects the face velocities on the grid and waits for the device.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn project(&mut self, substep: &Substep) -> Result<pressure::Projected, SolveError> {
        self.timed(|flip, run| flip.project_by(Round::First, substep, run))
    }

    /// Returns the last projection's q = p Δt / (ρ Δx) at elements of cell arrays, in the solve's
    /// precision, m/s.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn solution(&self, elements: &[u32]) -> Result<Vec<f64>, SolveError> {
        self.pressure.solution(&self.program, elements)
    }

    /// Calls `work` with a callback that runs recordings, timed if the solver times passes.
    fn timed<T>(
        &mut self,
        work: impl FnOnce(&mut Self, &mut Run<'_>) -> Result<T, SolveError>,
    ) -> Result<T, SolveError> {
        let mut timer = self.timer.take();
        let result = work(self, &mut |program, recordings| {
            Ok(Recording::run_all(recordings, program, timer.as_mut())?)
        });
        self.timer = timer;
        result
    }

    /// Chooses the first substep of the frame after the loaded state.
    fn first_substep(&mut self, run: &mut Run<'_>) -> Result<(Survey, Substep), SolveError> {
        let length = self.scene.shot.frame_seconds();
        let survey = self.survey(run)?;
        let (_, substep) = self.choose(&survey, f64::from(self.frame) * length, length, 0)?;
        Ok((survey, substep))
    }

    fn carry(
        &mut self,
        is_wet: &[bool],
        substep: &Substep,
        run: &mut Run<'_>,
    ) -> Result<(), SolveError> {
        self.predict_bodies(substep);
        self.lay_out(is_wet, substep)?;
        self.list_bodies();
        run(&self.program, &[&self.recordings.to_grid])
    }

    fn project_by(
        &mut self,
        round: Round,
        substep: &Substep,
        run: &mut Run<'_>,
    ) -> Result<pressure::Projected, SolveError> {
        let scale = pressure::Scale {
            kick: substep.kick,
            rest_density: self.scene.water.rest_density,
        };
        let cell_size = self.scene.settings().cell_size;
        self.pressure
            .set_topology(&self.program, &self.bricks, cell_size);
        self.pressure.set_round(round);
        let projected = self.pressure.project_by(&self.program, scale, run)?;
        self.push_bodies(round, run)?;
        Ok(projected)
    }

    fn project_within_budget(
        &mut self,
        round: Round,
        substep: &Substep,
        totals: &mut FrameTotals,
        run: &mut Run<'_>,
    ) -> Result<(), SolveError> {
        let projected = self.project_by(round, substep, run)?;
        totals.add(&projected);
        Ok(self.scene.budget.check_projection(
            self.frame + 1,
            totals.substeps,
            projected.solved.residual,
            projected.divergence_after,
            substep.length,
        )?)
    }

    fn run_substep(
        &mut self,
        is_wet: &[bool],
        substep: &Substep,
        totals: &mut FrameTotals,
        run: &mut Run<'_>,
    ) -> Result<(), SolveError> {
        self.carry(is_wet, substep, run)?;
        self.project_within_budget(Round::First, substep, totals, run)?;
        if let Some(turns) = effects::turns(&self.scene, substep.length) {
            totals.projection.missed += u32::from(turns.is_short);
            self.recordings
                .run_between(&self.program, turns.again, run)?;
            self.project_within_budget(Round::Again, substep, totals, run)?;
        }
        if self.collide_bodies(substep) {
            self.project_within_budget(Round::AfterContacts, substep, totals, run)?;
        }
        if self.scene.settings().density_correction {
            let corrected = self.pressure.correct_by(&self.program, run)?;
            totals.projection.correction_iterations += u64::from(corrected.iterations);
            totals.projection.missed += u32::from(corrected.is_missed);
        }
        if self.contacts.is_some() {
            self.upload_movers(substep);
        }
        run(
            &self.program,
            &[&self.recordings.to_particles, &self.recordings.watch],
        )?;
        totals.work += self.watched(totals.substeps, substep.kick)?;
        self.move_bodies(substep);
        self.state.substep = substep.length;
        Ok(())
    }

    /// Checks that the substep left only finite values; returns the work by boundaries and forces
    /// in it, in `kick` seconds, joules.
    fn watched(&self, substep: u32, kick: f64) -> Result<f64, SolveError> {
        let groups = match self.scene.is_worked_on() {
            true => self.bricks.wet as usize * (CELLS / 64) as usize,
            false => 0,
        };
        let of_forces = forces::flip_sums(&self.scene, self.bricks.wet);
        // Without moving walls or forces the buffers do not exist, and none of them is read.
        let wanted = (
            COUNTERS.first(1),
            BOUNDARY_WORK.first(groups),
            FORCE_WORK.first(of_forces),
        );
        let (counters, sums, of_forces) = self.program.download(wanted)?;
        if counters[0].not_finite > 0 {
            let breach = Breach::not_finite(self.frame + 1, counters[0].not_finite.into(), None);
            return Err(breach.in_substep(substep).into());
        }
        let sum = |sums: Vec<f32>| sums.into_iter().map(f64::from).sum::<f64>();
        let face = self.scene.settings().cell_size.powi(2);
        let by_forces = self.scene.particle_mass() * sum(of_forces);
        Ok(face * kick * sum(sums) + by_forces)
    }

    /// Sets the state of absorbing walls.
    pub(crate) fn take_absorbers(&mut self, walls: AbsorberStates) {
        self.state.walls = walls;
    }

    /// Surveys the particles and chooses the next substep; also returns whether it is the frame's
    /// last.
    fn look(
        &mut self,
        totals: &FrameTotals,
        run: &mut Run<'_>,
    ) -> Result<(Survey, Substep, bool), SolveError> {
        let length = self.scene.shot.frame_seconds();
        let start = f64::from(self.frame) * length + totals.elapsed;
        let survey = self.survey(run)?;
        let (wanted, substep) =
            self.choose(&survey, start, length - totals.elapsed, totals.substeps)?;
        Ok((survey, substep, wanted <= 1.0))
    }

    /// Runs the next substep; returns whether it was the frame's last.
    fn go_on(&mut self, totals: &mut FrameTotals, run: &mut Run<'_>) -> Result<bool, SolveError> {
        let (survey, substep, is_last) = self.look(totals, run)?;
        totals.substeps += 1;
        self.run_substep(&survey.is_wet, &substep, totals, run)?;
        totals.elapsed += substep.length;
        Ok(is_last)
    }

    fn upload_state(&self, state: &Particles) {
        upload(&self.program, &self.scene, state);
        let names = self.scene.settings().attributes();
        if !names.is_empty() {
            let mut rows = vec![0.0f32; names.len() * state.len()];
            for (k, name) in names.iter().enumerate() {
                let values = state.attributes.get(*name).into_iter().flatten();
                for (row, value) in rows.chunks_exact_mut(names.len()).zip(values) {
                    row[k] = *value;
                }
            }
            self.program.upload(AFFINE, 0, &rows);
        }
    }

    /// Maps the frame that the substeps in `totals` have computed.
    fn ended(&self, totals: &FrameTotals) -> Result<Ended, SolveError> {
        let (n, names) = (self.state.len(), self.scene.settings().attributes());
        let cells = match self.state.is_empty() {
            true => 0,
            false => (self.bricks.wet as usize + 1) * CELLS as usize,
        };
        let state = (POSITION.first(n), VELOCITY.first(n), ID.first(n));
        let of_cells = (DENSITY.first(cells), CELL_KIND.first(cells));
        // Without attributes the buffer does not exist, and none of it is read; nor without a band.
        let rows = AFFINE.first(names.len() * n);
        let deep = DEEP.first(match self.deep {
            Some(_) => DEEP_VALUES * cells,
            None => 0,
        });
        Ok(Ended {
            scene: self.scene.clone(),
            frame: self.frame + 1,
            substeps: totals.substeps,
            state: self.state.clone(),
            bricks: self.bricks.clone(),
            found: (self.program).map((state, of_cells, COUNTERS.first(1), rows, deep))?,
        })
    }

    /// Length of a cell array up to the last slot of the finest level in the last substep.
    fn elements(&self) -> usize {
        (self.bricks.active as usize + 1) * CELLS as usize
    }
}

impl Solver for Flip {
    type Error = SolveError;

    fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), SolveError> {
        self.scene.check_bodies(&particles.bodies)?;
        if is_other_count(&self.scene, self.plan.counts.particles, particles)? {
            self.resize(particles.len())?;
        }
        self.state = Carried::new(particles);
        self.frame = frame;
        self.upload_state(particles);
        self.load_deep(particles)
    }

    fn compute(&mut self, watch: &mut dyn Watch) -> Result<Unread<SolveError>, SolveError> {
        self.program.upload(COUNTERS, 0, &[Counters::default()]);
        let totals = match self.state.is_empty() {
            true => self.run_without_water()?,
            false => self.timed(|flip, run| flip.run_substeps(watch, run))?,
        };
        let ended = self.ended(&totals)?;
        self.frame += 1;
        let capped = ended.found.views()?.2[0].capped;
        self.state.walls = AbsorberStates::default();
        let mut read: Box<ReadFrame> = Box::new(move || ended.read());
        if is_awaited(&self.scene) {
            let (mut state, densities) = read()?;
            self.scene.update_absorbers(&mut state, self.frame);
            self.state.walls = state.walls;
            if self.scene.domain.min != DVec3::ZERO {
                // World positions in the frame are rounded: continue from the written values, as
                // a resumed bake does.
                self.upload_state(&state);
            }
            read = Box::new(move || Ok((state, densities)));
        }
        let (scene, walls) = (self.scene.clone(), self.state.walls);
        Ok(Unread::new(walls, move || {
            let (mut state, (density, densest_at)) = read()?;
            state.walls = walls;
            let report = StepReport {
                substeps: totals.substeps,
                iterations: totals.iterations,
                capped: u64::from(capped),
                boundary_work: totals.work,
                projection: Some(totals.projection),
                densest_at,
                ..scene.report(&state, density.into_iter())
            };
            Ok((state, report))
        }))
    }

    fn pressures(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, SolveError> {
        self.pressures_at(points)
    }

    fn timings(&self) -> Vec<PassTime> {
        let timer = self.timer.as_ref();
        timer.map_or_else(Vec::new, |timer| timer.times(PassTime::new))
    }
}
