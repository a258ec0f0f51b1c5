//! Substeps and whole frames of FLIP on the CPU.

use glam::DVec3;

use super::{
    BodyCells, Centers, Cloud, DeepCells, Faces, Model, Motion, Paths, Trace, Unprojected, Waters,
    advect, aim, assign_cells,
    bodies::{Stopped, sped_up},
    carry_bodies, carry_deep, close_gaps,
    contraction::Straight,
    couple_bodies, cut_cells,
    effects::{self, FaceInputs, Flying},
    extrapolate, fill_deep, find_change, find_depth, find_excess, find_water, forces,
    gather_centers, gather_faces, grid_to_particle, let_in, place_deep,
    projection::project as project_faces,
    push_apart, reorder,
    sort::by_id,
    survey,
    trace::PressureField,
    wall_friction,
};
use crate::{ReferenceError, Timings};
use swell_contact::SceneContacts;
use swell_domain::{
    body::{BodyState, Six},
    boundary::Boundary,
    budget::Breach,
    gauge::Gauge,
    particles::{Particles, max_speed},
    poisson::FLUID,
    solver::{PassTime, Projection, Solver, Span, StepReport, Unread, Watch},
};
use swell_scene::{FlipScene, step::Substep};

/// FLIP in f64. Frames are rounded to f32, as when written, and the next starts from that state.
pub struct Flip {
    pub(super) model: Model,
    contacts: Option<SceneContacts>,
    factor_budget: u64,
    /// Whether it moves particles, and not only projects their velocities.
    moves: bool,
    pub(super) state: Particles,
    /// Water without particles; `None` without a band.
    pub(super) deep: Option<DeepCells>,
    frame: u32,
    timings: Timings,
    /// Pressure field of the last substep; `None` before the first.
    field: Option<PressureField>,
}

impl Flip {
    /// Creates the solver for a scene, with its solids. It solves for pressures by
    /// conjugate gradients, which are as accurate as a direct factorisation in a tenth of its time.
    pub fn new(scene: &FlipScene, boundary: &Boundary) -> Self {
        Self {
            model: Model::new(scene, boundary),
            contacts: SceneContacts::of(scene),
            factor_budget: 0,
            moves: true,
            state: Particles::default(),
            deep: None,
            frame: 0,
            timings: Timings::default(),
            field: None,
        }
    }

    /// Creates the solver for [`Self::project_velocities`] alone.
    pub fn of_velocities(scene: &FlipScene, boundary: &Boundary) -> Self {
        Self {
            moves: false,
            ..Self::new(scene, boundary)
        }
    }

    /// Switches to sparse Cholesky factors of up to `bytes` bytes; see [`crate::poisson::BUDGET`].
    pub fn set_factor_budget(&mut self, bytes: u64) {
        self.factor_budget = bytes;
    }

    /// Returns the scene, its grid and its solids.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Runs one substep of `cloud` on bricks around `is_wet`.
    ///
    /// # Errors Returns an error if the factorisation of a pressure system fails.
    pub fn substep(
        &mut self,
        cloud: &Cloud,
        is_wet: &[bool],
        substep: &Substep,
    ) -> Result<Trace, ReferenceError> {
        let Self {
            model,
            timings,
            factor_budget,
            moves,
            state,
            contacts,
            deep,
            ..
        } = self;
        let responses = model.responses(&state.bodies, substep.kick);
        let before = model.predicted(&state.bodies, substep);
        let mut step = model.step(substep, &state.walls, &before);
        let (bricks, mut sorted) = timings.time("flip/reorder", || {
            let bricks = model.bricks(is_wet, &step);
            let cell = assign_cells(model, &bricks, &cloud.position);
            let sorted = reorder(&bricks, cloud, &cell);
            (bricks, sorted)
        });
        let mut space = timings.time("flip/cut_cells", || cut_cells(model, &step, &bricks));
        let flying = Flying {
            model,
            step: &step,
            bricks: &bricks,
            kind: &space.kind,
        };
        forces::turn_sorted(model, &step, &mut sorted.cloud.velocity, timings);
        effects::on_particles(&model.scene.effects, flying, &mut sorted, timings);
        let mut faces = timings.time("flip/gather_faces", || {
            gather_faces(model, &step, &bricks, &sorted, &space)
        });
        let depth = deep.as_ref().map(|deep| {
            timings.time("flip/place_deep", || {
                place_deep(model, &step, &bricks, deep, &space, &mut faces)
            })
        });
        let mut density = timings.time("flip/gather_centers", || {
            gather_centers(model, &step, &bricks, &sorted, &space)
        });
        if let Some(depth) = &depth {
            fill_deep(model, depth, &mut density);
        }
        let (kind, mut distance) = timings.time("flip/find_water", || {
            let depth = find_depth(model, &step, &bricks, &space, &density);
            find_water(model, &bricks, &space, &depth)
        });
        space.kind = kind;
        let forced = Unprojected {
            model,
            step: &step,
            bricks: &bricks,
            space: &space,
            density: &density,
            faces: &faces,
        };
        let closed = timings.time("flip/close_gaps", || close_gaps(&forced, &mut distance));
        let mut straight = Straight::default();
        if *moves && !model.scene.turns_velocities() {
            let water = Unprojected {
                space: &closed,
                ..forced
            };
            straight = Straight::before_projection(&water, timings);
        }
        space = closed;
        let mut excess = match model.settings().density_correction {
            true => timings.time("flip/find_excess", || {
                find_excess(&step, &bricks, &space, &density)
            }),
            false => Vec::new(),
        };
        if model.scene.has_inlets() {
            timings.time("flip/let_in", || {
                let inlets = model.scene.inlets(step.start, step.length);
                let size = model.cell_size();
                let_in(&inlets, size, &bricks, &mut space, &density, &mut excess);
            });
        }
        let centers = Centers {
            density,
            excess,
            distance,
        };
        let acts_between = model.scene.effects.act_between_projections();
        if !model.scene.no_slip.is_empty() && !acts_between {
            timings.time("flip/wall_friction", || {
                wall_friction(model, &step, &bricks, &space, &mut faces);
            });
        }
        forces::on_faces(model, &step, &bricks, &space, &mut faces, timings);
        let water = FaceInputs {
            model,
            step: &step,
            bricks: &bricks,
            space: &space,
            centers: &centers,
            old: &faces.change,
        };
        effects::on_faces(&model.scene.effects, water, &mut faces.velocity, timings);
        let coupled = match before.is_empty() {
            true => Vec::new(),
            false => timings.time("flip/couple_bodies", || {
                couple_bodies(model, &step, &bricks, &space, (&before, &responses))
            }),
        };
        let touched: Vec<BodyCells>;
        let waters = Waters::new(model, &bricks, &space, &centers);
        let mut waters = waters
            .with_bodies(&coupled)
            .with_contraction(&straight.contraction);
        let by_weight: Vec<Six> = coupled.iter().map(BodyCells::before).collect();
        waters.carry_flux(&by_weight);
        let mut carried = by_weight.clone();
        let mut project = |centers, faces: &mut Faces, timings: &mut Timings| {
            let found = project_faces(model, timings, *factor_budget, &mut waters, centers, faces)?;
            if !before.is_empty() {
                for (sum, change) in carried.iter_mut().zip(&found.0.changes) {
                    *sum = std::array::from_fn(|k| sum[k] + change[k]);
                }
                let bodies = (&before[..], &carried[..]);
                carry_bodies(model, &step, &bricks, &space, bodies, &mut faces.velocity);
                carried.fill([0.0; 6]);
            }
            Ok::<_, ReferenceError>(found)
        };
        let (mut earlier, mut is_short) = (None, false);
        if acts_between {
            earlier = Some(project(None, &mut faces, timings)?.0);
            let water = FaceInputs {
                model,
                step: &step,
                bricks: &bricks,
                space: &space,
                centers: &centers,
                old: &faces.change,
            };
            let named = &model.scene.effects;
            is_short = effects::between_projections(named, water, &mut faces.velocity, timings);
        }
        let (projected, displacement) = project(Some(&centers), &mut faces, timings)?;
        let changes = [earlier.as_ref(), Some(&projected)].into_iter().flatten();
        let changes = changes.map(|projected| &projected.changes);
        let mut bodies = sped_up(&before, [&by_weight].into_iter().chain(changes));
        let mut after_contacts = None;
        if let Some(contacts) = contacts {
            let free = bodies.clone();
            timings.time("contacts", || {
                contacts.resolve(&model.scene, &state.walls, substep, &mut bodies);
            });
            if let Some(stopped) = Stopped::new(model, &free, &bodies, substep.length) {
                waters.carry_changes(&projected.system, &stopped.changes);
                touched = stopped.held(&coupled);
                waters = waters.with_bodies(&touched);
                let budget = *factor_budget;
                let (found, _) =
                    project_faces(model, timings, budget, &mut waters, None, &mut faces)?;
                let changes = stopped.pushed(&found.changes, &mut bodies);
                let moved = (&before[..], &changes[..]);
                carry_bodies(model, &step, &bricks, &space, moved, &mut faces.velocity);
                after_contacts = Some(found);
            }
        }
        let water = Unprojected {
            model,
            step: &step,
            bricks: &bricks,
            space: &space,
            density: &centers.density,
            faces: &faces,
        };
        let bend = timings.time("flip/bend_paths", || straight.bend(&water));
        step.solids = model.solids_at(&bodies, step.start, step.length);
        timings.time("flip/extrapolate", || {
            find_change(model, &bricks, &space, &mut faces);
            for layer in 2..=step.layers as u32 {
                extrapolate(&step, &bricks, layer, &mut faces);
            }
        });
        if let Some(depth) = &depth {
            let moved = timings.time("flip/carry_deep", || {
                let motion = Motion {
                    model,
                    step: &step,
                    bricks: &bricks,
                    velocity: &faces.velocity,
                    displacement: displacement.as_deref(),
                };
                carry_deep(&motion, depth)
            });
            *deep = Some(moved);
        }
        let mut given = timings.time("flip/grid_to_particle", || {
            let displacement = displacement.as_deref();
            grid_to_particle(model, &step, &bricks, &sorted, &faces, &space, displacement)
        });
        let seen = (&faces, &space);
        let force_work =
            forces::after_transfer(model, &step, &bricks, &sorted, seen, &mut given, timings);
        if displacement.is_some() {
            let pushed = timings.time("flip/push_apart", || {
                push_apart(model, &step, &bricks, &sorted, &given.is_drop)
            });
            for (displacement, push) in given.displacement.iter_mut().zip(pushed) {
                *displacement += push;
            }
        }
        let moved = timings.time("flip/advect", || {
            let position = &sorted.cloud.position;
            let paths = Paths {
                bricks: &bricks,
                velocity: &faces.velocity,
                cell: &sorted.cell,
                bend: &bend,
            };
            advect(model, &step, &paths, position, &given)
        });
        let scale = model.scene.water.rest_density * model.cell_size() / step.kick;
        let mut pressure = waters.by_element(&projected.system, &projected.solution.x);
        for other in earlier.iter().chain(&after_contacts) {
            let before = waters.by_element(&other.system, &other.solution.x);
            (pressure.iter_mut().zip(before)).for_each(|(now, before)| *now += before);
        }
        Ok(Trace {
            solid_flux: waters.flux().to_vec(),
            bodies,
            coupled: coupled.clone(),
            force_work,
            pressure: pressure.into_iter().map(|q| scale * q).collect(),
            earlier,
            after_contacts,
            is_short,
            after: Cloud {
                position: moved.position,
                velocity: moved.velocity,
                affine: given.affine.clone(),
                id: sorted.cloud.id.clone(),
            },
            capped: moved.capped,
            given,
            bricks,
            sorted,
            space,
            centers,
            faces,
            projected,
            displacement,
        })
    }

    /// Runs a substep, checks it against the budget, and keeps its pressure field. The first
    /// argument is the frame and the number of the substep in it, from 1.
    fn judged_substep(
        &mut self,
        (frame, number): (u32, u32),
        cloud: &Cloud,
        is_wet: &[bool],
        substep: &Substep,
    ) -> Result<Trace, ReferenceError> {
        let trace = self.substep(cloud, is_wet, substep)?;
        for projected in trace.projections() {
            let [_, divergence] = projected.divergence;
            self.model.scene.budget.check_projection(
                frame,
                number,
                projected.solution.residual,
                divergence,
                substep.length,
            )?;
        }
        let step = self.model.step(substep, &self.state.walls, &trace.bodies);
        self.field = Some(PressureField::of(&step, &trace));
        Ok(trace)
    }

    /// Returns the states of the bodies.
    pub fn bodies(&self) -> &[BodyState] {
        &self.state.bodies
    }

    /// Copies absorbing walls and bodies from `state`.
    pub fn take_boundaries(&mut self, state: &Particles) {
        self.state.walls = state.walls;
        self.state.bodies.clone_from(&state.bodies);
    }

    /// Projects the velocities of particles, given in the order of their ids, over a substep, and
    /// displaces the particles (flip/aim). Returns which of them are isolated droplets, and the
    /// work by moving walls and forces, joules. The first argument is the frame and the number of
    /// the substep in it, from 1.
    ///
    /// # Errors Returns an error if a value is not finite, a projection exceeds its budget, or the
    /// factorisation of a pressure system fails.
    pub fn project_velocities(
        &mut self,
        (frame, number): (u32, u32),
        cloud: &mut Cloud,
        substep: &Substep,
        all: &mut Projection,
    ) -> Result<(Vec<bool>, f64), ReferenceError> {
        if cloud.position.is_empty() {
            if let Some(contacts) = &self.contacts {
                let (scene, bodies) = (&self.model.scene, &mut self.state.bodies);
                contacts.advance(scene, &self.state.walls, substep, bodies);
            }
            return Ok((Vec::new(), 0.0));
        }
        let surveyed = survey(&self.model, cloud);
        if surveyed.not_finite > 0 {
            let breach = Breach::not_finite(frame, surveyed.not_finite as u64, None);
            return Err(breach.in_substep(number).into());
        }
        let mut trace = self.judged_substep((frame, number), cloud, &surveyed.is_wet, substep)?;
        trace.add_to(all);
        let step = self.model.step(substep, &self.state.walls, &trace.bodies);
        let work = self.model.boundary_work(&step, &trace);
        let order = by_id(&trace.sorted.cloud);
        let is_drop = &trace.given.is_drop;
        let pushed = push_apart(&self.model, &step, &trace.bricks, &trace.sorted, is_drop);
        trace.given.displacement = pushed;
        let aimed = aim(&step, &trace.sorted.cloud.position, &trace.given);
        for (slot, &k) in order.iter().enumerate() {
            (cloud.position[slot], cloud.velocity[slot]) = (aimed[k], trace.given.velocity[k]);
        }
        let is_drop = order.iter().map(|&k| trace.given.is_drop[k]);
        self.state.bodies = self.model.moved(&trace.bodies, substep.length);
        Ok((is_drop.collect(), work))
    }

    /// Runs the substeps of one frame; returns their report and the densities in cells of water in
    /// the last one.
    fn run_frame(
        &mut self,
        cloud: &mut Cloud,
        watch: &mut dyn Watch,
    ) -> Result<(StepReport, Vec<f64>), ReferenceError> {
        let frame = self.frame + 1;
        let length = self.model.scene.shot.frame_seconds();
        let start = f64::from(self.frame) * length;
        let mut report = self
            .model
            .scene
            .report(&Particles::default(), [].into_iter());
        let mut all = Projection::default();
        let mut elapsed = 0.0;
        let (deep, mut was_wet) = self.deep_cells().unzip();
        let of_deep = max_speed(&self.state.deep.velocity);
        self.deep = deep;
        loop {
            let mut surveyed = survey(&self.model, cloud);
            if surveyed.not_finite > 0 {
                let breach = Breach::not_finite(frame, surveyed.not_finite as u64, None);
                return Err(breach.in_substep(report.substeps.max(1)).into());
            }
            let (wanted, substep) = (self.model.scene).flip_substep(
                (&self.state.walls, &self.state.bodies),
                frame,
                start + elapsed,
                length - elapsed,
                surveyed.speed.max(of_deep),
                (report.substeps, self.state.substep),
            )?;
            report.substeps += 1;
            if let Some(was) = &mut was_wet {
                add_flags(was, &mut surveyed.is_wet);
            }
            let number = (frame, report.substeps);
            let trace = self.judged_substep(number, cloud, &surveyed.is_wet, &substep)?;
            let step = self.model.step(&substep, &self.state.walls, &trace.bodies);
            report.boundary_work += self.model.boundary_work(&step, &trace);
            for projected in trace.projections() {
                report.iterations += u64::from(projected.solution.iterations);
            }
            trace.add_to(&mut all);
            report.capped += trace.capped;
            let span = Span {
                start: start + elapsed,
                end: start + (elapsed + substep.length),
                is_last: wanted <= 1.0,
            };
            elapsed += substep.length;
            self.state.substep = substep.length;
            self.state.bodies = self.model.moved(&trace.bodies, substep.length);
            let density = trace.centers.density;
            *cloud = trace.after;
            self.show(span, cloud, watch)?;
            if span.is_last {
                report.projection = Some(all);
                let Some(field) = &self.field else {
                    return Ok((report, Vec::new()));
                };
                let of_cells = (0u32..).zip(density).zip(&field.kind);
                let in_water = of_cells.filter(|(_, kind)| **kind == FLUID);
                let water: Vec<(u32, f64)> = in_water.map(|(cell, _)| cell).collect();
                let cells = water.iter();
                let cells = cells.map(|&(element, density)| (field.bricks.cell(element), density));
                report.densest_at = self.model.scene.densest_cell(cells);
                return Ok((
                    report,
                    water.into_iter().map(|(_, density)| density).collect(),
                ));
            }
        }
    }

    /// Returns the last substep's pressure field; `None` before the first.
    pub(super) fn gauge(&self) -> Option<Gauge<'_>> {
        let field = self.field.as_ref()?;
        Some(Gauge {
            bricks: &field.bricks,
            cells: self.model.cells,
            cell_size: self.model.cell_size(),
            kind: &field.kind,
            is_buried: &field.is_buried,
            pressure: &field.pressure,
            taken: &field.taken,
            density: self.model.scene.water.rest_density,
            rise: self.model.scene.water.rise(),
        })
    }
}

impl Solver for Flip {
    type Error = ReferenceError;

    fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), ReferenceError> {
        self.model.scene.check_bodies(&particles.bodies)?;
        self.state = particles.clone();
        self.frame = frame;
        Ok(())
    }

    fn compute(&mut self, watch: &mut dyn Watch) -> Result<Unread<ReferenceError>, ReferenceError> {
        let mut cloud = self.cloud();
        let (done, density) = if self.state.is_empty() {
            let (scene, state) = (&self.model.scene, &mut self.state);
            let substeps = match &self.contacts {
                Some(contacts) => {
                    let (walls, before) = (&state.walls, &mut state.substep);
                    contacts.advance_frame(scene, walls, self.frame, &mut state.bodies, before)?
                }
                None => 0,
            };
            let report = StepReport {
                substeps,
                projection: Some(Projection::default()),
                ..scene.report(state, [].into_iter())
            };
            (report, Vec::new())
        } else {
            self.run_frame(&mut cloud, watch)?
        };
        self.write(&cloud);
        self.state.deep = self.rounded_deep();
        let frame = self.frame + 1;
        if let Some((count, first)) = self.state.first_not_finite(None) {
            return Err(Breach::not_finite(frame, count, Some(first)).into());
        }
        self.frame = frame;
        self.model.scene.update_absorbers(&mut self.state, frame);
        let report = StepReport {
            substeps: done.substeps,
            iterations: done.iterations,
            capped: done.capped,
            boundary_work: done.boundary_work,
            projection: done.projection,
            densest_at: done.densest_at,
            ..self.model.scene.report(&self.state, density.into_iter())
        };
        let state = self.state.clone();
        Ok(Unread::new(state.walls, move || Ok((state, report))))
    }

    /// Returns the projection's pressures, interpolated between cell centres, Pa; `None` outside
    /// water.
    fn pressures(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, ReferenceError> {
        // Without particles there is no pressure field.
        let Some(gauge) = self.gauge() else {
            return Ok(vec![None; points.len()]);
        };
        let local = |at: &DVec3| *at - self.model.scene.domain.min;
        Ok(points.iter().map(|at| gauge.at(local(at))).collect())
    }

    fn timings(&self) -> Vec<PassTime> {
        self.timings.rows()
    }
}

/// Sets the flags of either side in both: what is deep may be in any brick that had water before in
/// the frame.
fn add_flags(was: &mut [bool], is: &mut [bool]) {
    for (was, is) in was.iter_mut().zip(is) {
        *was |= *is;
        *is = *was;
    }
}
