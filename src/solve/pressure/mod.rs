//! Pressure projection of face velocities on sparse bricks.
//!
//! The unknown is q = p Δt / (ρ Δx), a velocity, which makes the coefficients dimensionless: for
//! each cell of water, Σ f (q − q') over its six faces = −(Σ ± f u + `solid_flux`), with the open
//! fraction f of the face (Batty et al. 2007). Each open face is then corrected by u −= q − q'. In
//! air q' = 0, at the centre of the air cell or at the crossing of the surface (ghost fluid).
//!
//! # Inputs
//!
//! The caller fills these buffers before [`PressureSolver::project`]. With a capacity of `slots`
//! slots, including slot 0, cell arrays hold `slots * 512` values. Planes are three such arrays in
//! sequence: component c of element e is at `c * 512 * slots + e`.
//!
//! | name | type | contents |
//! | --- | --- | --- |
//! | `bricks` | `Brick` | the records of `domain::bricks` |
//! | `cell_kind` | `u32` cells | [`AIR`], [`FLUID`] or [`SOLID`]; in active slots |
//! | `face_open` | `f32` planes | open fraction of lower faces, 0 to 1; 0 in slot 0: closed box |
//! | `face_velocity` | `f32` planes | m/s; a closed face keeps the velocity of the solid |
//! | `solid_flux` | `f32` cells | Σ ± (1 − f) u_solid over the six faces, outward positive, m/s |
//! | `liquid_distance` | `f32` cells | metres, negative in water; ghost-fluid surface only |
//! | `density_excess` | `f32` cells | ρ/ρ_target − 1 to correct; density correction only |
//!
//! With contraction the flux to let into each cell, m/s, follows in `solid_flux`.
//!
//! With the density correction `face_velocity` holds three planes more, for displacements.
//!
//! # Outputs
//!
//! Of the buffers in [`planned`], the projection fills `pressure` (Pa, natural cell order, 0
//! without water). It updates `face_velocity` in place, and behind that fills the displacements
//! (planes, metres, 0 on faces that are closed or touch no water). Only cells of wet slots are
//! FLUID. Cells of a brick beyond the box are AIR with closed lower faces; one of these faces is
//! the box's own wall. Only faces between two cells of water, or between water and air, change.
//!
//! # Use
//!
//! ```text
//! buffers += pressure::planned(..); passes += pressure::passes(..);  // plan
//! let mut pressure = PressureSolver::new(..);    // once, and again when the slots grow
//! pressure.set_topology(&program, &bricks, cell_size)  // each substep, after uploading `bricks`
//! pressure.project(&program, Scale { .. }, timer)  // builds, solves, subtracts; waits once
//! pressure.correct(&program, timer)  // same system: density_excess -> displacements
//! ```

pub mod bodies;
pub mod buffers;
mod params;
mod plan;
mod pockets;
mod stages;

use std::collections::BTreeMap;

use swell_domain::bricks::{Bricks, CELLS, Level};
use swell_gpu::{
    buffer::Workgroups,
    program::Program,
    recording::{Recording, Timer, spread},
};
use swell_scene::flip::{Precision, Preconditioner, Pressure};

use super::{SolveError, trace::Run};

use buffers::{PHASES, SIZES, read_control, read_reals};
pub use params::{
    PocketPart, PressureBrick, PressureControl, PressureControl64, PressurePhase, PressureStats,
    ReduceStep,
};
pub(crate) use plan::require;
use plan::{Phase, SIZE_COUNT, Size, phase_count};
pub use plan::{STEP_OF_FINEST, passes, planned};
pub use stages::Extent;
pub(super) use stages::all_commands;
use stages::{SINGLE, Shape, Stages};
pub use swell_domain::poisson::{AIR, FLUID, SOLID};

/// Most brick levels that the multigrid uses; pass it to [`Bricks::new`] as depth.
pub const LEVELS: usize = 8;

/// Relative residual that ends the density correction's solve.
pub const CORRECTION_TOLERANCE: f64 = 1e-2;

/// `state` of a solve that iterates, as in shared/pressure_control.wgsl.
pub const ITERATING: u32 = 0;
/// `state` of a solve that recomputes its true residual.
pub const VERIFYING: u32 = 1;
/// `state` of a solve that has ended.
pub const DONE: u32 = 2;
/// `state` of a solve that waits until the host has listed the pockets.
pub const WANTS_POCKETS: u32 = 3;

/// Most iterations per submission. Iterations after convergence are skipped on the device, but
/// still cost time.
const MOST_AT_ONCE: u32 = 64;

/// Factors that turn q into a pressure: p = q ρ Δx / `kick`.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Time for which the pressure acts, seconds; Δt if all substeps have the same length.
    pub kick: f64,
    /// ρ, kg/m³.
    pub rest_density: f64,
}

/// Result of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solved {
    /// Conjugate-gradient iterations.
    pub iterations: u32,
    /// ‖b − Ax‖/‖b‖ from a freshly computed residual; 0 if b = 0.
    pub residual: f64,
    /// Whether the residual exceeds the tolerance.
    pub is_missed: bool,
}

/// Result of a projection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Projected {
    /// Result of the solve.
    pub solved: Solved,
    /// Largest |∇·u| in a cell of water before the projection, 1/s.
    pub divergence_before: f64,
    /// Largest |∇·u| in a cell of water after the projection, 1/s.
    pub divergence_after: f64,
    /// Bodies of water that no air touches.
    pub pockets: u32,
    /// Largest |mean of ∇·u| over a pocket, 1/s. No pressure can remove it; it occurs for example
    /// if a solid squeezes the pocket.
    pub incompatible: f64,
    /// Cells of water without an open face, which are left out of the system.
    pub dropped: u32,
}

/// The projection, for a program that has the [`planned`] buffers and the [`passes`].
pub struct PressureSolver {
    settings: Pressure,
    extent: Extent,
    capacity: usize,
    stages: BTreeMap<Shape, Stages<Recording>>,
    shape: Shape,
    phase: PressurePhase,
    sizes: [Workgroups; SIZE_COUNT],
    pockets: u32,
    /// Bricks with water that bodies may touch, and bodies.
    touched: [u32; 2],
    /// Iterations of the last projection and the last correction: the next solve submits as many at
    /// first. It only affects when the host waits for the device, not the result.
    expected: [u32; 2],
}

/// A projection among those of a substep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Round {
    /// The first one, which adds the weight of the water between cells' centres and bodies.
    First,
    /// One after an effect.
    Again,
    /// One after contacts of bodies, whose changes of velocity the caller has uploaded
    /// (`solve::bodies`).
    AfterContacts,
}

const AFTER_CONTACTS: u32 = Round::AfterContacts as u32;

#[derive(Clone, Copy, PartialEq)]
enum Task {
    Project,
    Correct,
}

impl PressureSolver {
    /// Creates a solver for a program whose buffers hold `capacity` slots. Create a new one when
    /// the buffers are replaced by larger ones.
    pub fn new(settings: &Pressure, extent: Extent, capacity: usize) -> Self {
        let expected = match settings.preconditioner {
            Preconditioner::Multigrid => 10,
            _ => MOST_AT_ONCE,
        };
        Self {
            settings: settings.clone(),
            extent,
            capacity,
            stages: BTreeMap::new(),
            shape: Shape {
                levels: 1,
                dispatched: 0,
                has_pockets: false,
            },
            phase: PressurePhase {
                stride: CELLS * capacity as u32,
                max_iterations: settings.max_iterations,
                ..PressurePhase::default()
            },
            sizes: [Workgroups::default(); SIZE_COUNT],
            pockets: 0,
            touched: [0; 2],
            expected: [expected, expected / 2],
        }
    }

    /// Sets how many bricks with water bodies may touch, and how many bodies there are, before the
    /// topology is set. The caller has uploaded the lists of `solve::bodies`.
    pub(super) fn set_bodies(&mut self, bricks: u32, bodies: u32) {
        self.touched = [bricks, bodies];
    }

    /// Says which of a substep's projections follows.
    pub(super) fn set_round(&mut self, round: Round) {
        self.phase.step = round as u32;
    }

    /// Sets the bricks of a substep, whose records the caller has uploaded to `bricks`.
    ///
    /// # Panics Panics if the bricks exceed the capacity.
    pub fn set_topology(&mut self, program: &Program, bricks: &Bricks, cell_size: f64) {
        assert!(
            bricks.slots() <= self.capacity,
            "{} slots, and the arrays hold {}",
            bricks.slots(),
            self.capacity
        );
        let used = &bricks.levels[..bricks.levels.len().min(LEVELS)];
        self.phase.cell_size = cell_size as f32;
        self.phase.levels = [[0; 4]; LEVELS];
        for (level, Level { start, count }) in used.iter().enumerate() {
            self.phase.levels[level] = [*start, *count, 0, 0];
        }
        self.phase.levels[0][2] = bricks.active;
        self.phase.last_level = used.len() as u32 - 1;
        self.shape = Shape {
            levels: used.len(),
            dispatched: (1..used.len())
                .find(|&level| used[level].count <= SINGLE)
                .unwrap_or(used.len() - 1),
            has_pockets: false,
        };
        self.set_sizes(program, bricks.active, used);
        program.upload(buffers::BRICKS, 0, &brick_records(bricks, used.len()));
    }

    fn set_sizes(&mut self, program: &Program, active: u32, levels: &[Level]) {
        let groups = |threads: u32| {
            if threads == 0 {
                return Workgroups::default();
            }
            spread(&program.context, 64, u64::from(threads)).into()
        };
        self.sizes = [Workgroups::default(); SIZE_COUNT];
        for (level, &Level { count, .. }) in levels.iter().enumerate() {
            self.sizes[Size::Full(level).index()] = groups(64 * count);
        }
        self.sizes[Size::Single.index()] = [1, 1, 1].into();
        self.sizes[Size::Active.index()] = groups(64 * active);
        self.sizes[Size::BodyBricks.index()] = groups(64 * self.touched[0]);
        self.sizes[Size::Bodies.index()] = groups(64 * self.touched[1]);
        program.upload(SIZES, 0, &self.sizes);
    }

    /// Builds the system, solves it and makes `face_velocity` divergence-free; waits for the
    /// device.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn project(
        &mut self,
        program: &Program,
        scale: Scale,
        mut timer: Option<&mut Timer>,
    ) -> Result<Projected, SolveError> {
        self.project_by(program, scale, &mut |program, recordings| {
            Ok(Recording::run_all(
                recordings,
                program,
                timer.as_deref_mut(),
            )?)
        })
    }

    /// Does the same with a callback that runs recordings.
    pub(super) fn project_by(
        &mut self,
        program: &Program,
        scale: Scale,
        run: &mut Run<'_>,
    ) -> Result<Projected, SolveError> {
        let pressure = scale.rest_density * f64::from(self.phase.cell_size) / scale.kick;
        self.phase.pressure_scale = pressure as f32;
        // Each substep searches for pockets again.
        self.phase.pocket_parts = 0;
        self.shape.has_pockets = false;
        self.pockets = 0;
        let tolerance = self.settings.tolerance;
        let (solved, stats) = self.solve(program, Task::Project, tolerance, run)?;
        Ok(Projected {
            solved,
            divergence_before: stats.divergence_before.into(),
            divergence_after: stats.divergence_after.into(),
            incompatible: stats.incompatible.into(),
            dropped: stats.dropped,
            pockets: self.pockets,
        })
    }

    /// Solves the last projection's system for displacements whose divergence is `density_excess`
    /// (Kugelstadt et al. 2019), to [`CORRECTION_TOLERANCE`]; waits for the device.
    ///
    /// # Errors Returns an error if the device fails.
    ///
    /// # Panics Panics if the solver was created without the density correction.
    pub fn correct(
        &mut self,
        program: &Program,
        mut timer: Option<&mut Timer>,
    ) -> Result<Solved, SolveError> {
        self.correct_by(program, &mut |program, recordings| {
            Ok(Recording::run_all(
                recordings,
                program,
                timer.as_deref_mut(),
            )?)
        })
    }

    /// Does the same with a callback that runs recordings.
    pub(super) fn correct_by(
        &mut self,
        program: &Program,
        run: &mut Run<'_>,
    ) -> Result<Solved, SolveError> {
        assert!(self.extent.has_correction, "built without the correction");
        let (solved, _) = self.solve(program, Task::Correct, CORRECTION_TOLERANCE, run)?;
        Ok(solved)
    }

    /// Returns q of the last solve in the solve's precision, m/s, at `elements` of the caller's
    /// cell arrays.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn solution(&self, program: &Program, elements: &[u32]) -> Result<Vec<f64>, SolveError> {
        let precision = self.settings.precision;
        let stride = CELLS as usize * self.capacity;
        let count = precision.terms() * stride;
        let values = read_reals(program, &buffers::SOLUTION, precision, count)?;
        let at = |place: usize| {
            (0..precision.terms())
                .map(|k| values[k * stride + place])
                .sum()
        };
        Ok(elements.iter().map(|&e| at(blocked(e))).collect())
    }

    /// Runs a task to its end, in batches of iterations. Each batch is followed by a verification
    /// and by the steps that use the solution; their dispatches stay empty until the state calls
    /// for them.
    fn solve(
        &mut self,
        program: &Program,
        task: Task,
        tolerance: f64,
        run: &mut Run<'_>,
    ) -> Result<(Solved, PressureStats), SolveError> {
        if self.phase.levels[0][1] == 0 {
            return Ok(Default::default());
        }
        self.phase.tolerance_square = (tolerance * tolerance) as f32;
        self.phase.body_bricks = match task {
            Task::Project => self.touched[0],
            Task::Correct => 0,
        };
        self.upload_phases(program);
        let mut batch = self.expected[task as usize] + 1;
        // Where pockets have to be listed first, the start runs twice.
        let (mut is_first, mut is_begun) = (true, false);
        loop {
            let round = self.phase.step;
            let stages = self.stages(program);
            let (start, finish) = match task {
                Task::Project => (Some(&stages.project), Some(&stages.finish_project)),
                Task::Correct => (stages.correct.as_ref(), stages.finish_correct.as_ref()),
            };
            let mut recordings = Vec::new();
            if task == Task::Project && !is_begun {
                recordings.extend(match round {
                    AFTER_CONTACTS => &stages.touch,
                    _ => &stages.weigh,
                });
            }
            is_begun = true;
            if is_first {
                recordings.extend(start);
                recordings.push(&stages.begin);
            }
            recordings.extend((0..batch.min(MOST_AT_ONCE)).map(|_| &stages.iterate));
            recordings.push(&stages.verify);
            recordings.extend(finish);
            run(program, &recordings)?;
            let (control, stats) = read_control(program, self.settings.precision)?;
            is_first = control.state == WANTS_POCKETS;
            if is_first {
                self.find_pockets(program)?;
            } else if control.state == DONE {
                self.expected[task as usize] = control.iterations;
                return Ok((solved(&control, tolerance), stats));
            } else {
                batch = (control.iterations / 2).max(4);
            }
        }
    }

    fn stages(&mut self, program: &Program) -> &Stages<Recording> {
        let (preconditioner, extent) = (self.settings.preconditioner, self.extent);
        (self.stages.entry(self.shape))
            .or_insert_with_key(|&shape| Stages::new(preconditioner, extent, shape).bind(program))
    }

    fn upload_phases(&self, program: &Program) {
        let phases: Vec<_> = (0..phase_count(self.extent))
            .map(|index| Phase::fill(index, self.phase))
            .collect();
        program.upload_windows(&PHASES, &phases);
    }

    /// Lists the cells of each pocket, after the device has counted pockets.
    fn find_pockets(&mut self, program: &Program) -> Result<(), SolveError> {
        let cells = (CELLS * (self.phase.levels[0][1] + 1)) as usize;
        let labels = program.read(buffers::LABEL, cells)?;
        if self.extent.has_bodies {
            bodies::remove_means(program, &labels, self.touched[1] as usize)?;
        }
        let (cells, parts) = pockets::list(&labels);
        program.upload(buffers::POCKET_CELLS, 0, &cells);
        program.upload(buffers::POCKET_PARTS, 0, &parts);
        self.pockets = pockets::count(&parts);
        self.sizes[Size::Pockets.index()] = spread(&program.context, 1, parts.len() as u64).into();
        program.upload(SIZES, 0, &self.sizes);
        self.shape.has_pockets = true;
        self.phase.pocket_parts = parts.len() as u32;
        self.upload_phases(program);
        Ok(())
    }
}

/// Returns the index of an element in blocked arrays, which are ordered by block of 2³ cells.
pub fn blocked(element: u32) -> usize {
    let (slot, local) = (element / CELLS, element % CELLS);
    let [x, y, z] = [local % 8, local / 8 % 8, local / 64];
    let cell = x % 2 + 2 * (y % 2) + 4 * (z % 2);
    let block = x / 2 + 4 * (y / 2) + 16 * (z / 2);
    (CELLS * slot + 64 * cell + block) as usize
}

fn solved(control: &PressureControl64, tolerance: f64) -> Solved {
    let residual = control.residual();
    Solved {
        iterations: control.iterations,
        residual,
        // The device compares squares, with the squared tolerance rounded to f32.
        is_missed: residual.is_nan() || residual > tolerance * (1.0 + 1e-6),
    }
}

/// Returns the projection's brick records for the first `levels` levels: face neighbours, and the
/// cell on the next coarser level.
fn brick_records(bricks: &Bricks, levels: usize) -> Vec<PressureBrick> {
    let record = |brick: &swell_domain::bricks::Brick| {
        let octant = brick.coordinate.map(|c| c & 1);
        let has_parent = brick.parent != 0 && (brick.level as usize) + 1 < levels;
        PressureBrick {
            faces: [12, 10, 4, 14, 16, 22].map(|k| brick.neighbors[k]),
            above: if has_parent {
                CELLS * brick.parent + 2 * octant[0] + 8 * octant[1] + 32 * octant[2]
            } else {
                0
            },
            padding: 0,
        }
    };
    bricks.records.iter().map(record).collect()
}
