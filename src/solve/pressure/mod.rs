//! Pressure projection of face velocities on sparse bricks.
//!
//! The unknown is q = p Δt / (ρ Δx), a velocity, so that nothing is scaled: for each cell of water
//! Σ f (q − q') over its six faces = −(Σ ± f u + `solid_flux`), with f the face's open fraction (Batty et
//! al. 2007), and each open face is then corrected by u −= q − q'. Air is q' = 0, at its cell's centre or
//! where the surface crosses (ghost fluid).
//!
//! # What the caller's program holds
//! Buffers that the caller fills before [`PressureSolver::project`], `slots` = capacity in slots, slot 0
//! included; cell arrays are `slots * 512` values, planes three such arrays one after the other, so that
//! component c of element e is at `c * 512 * slots + e`:
//!
//! | name | type | holds |
//! | --- | --- | --- |
//! | `bricks` | `Brick` | the records of `domain::bricks` |
//! | `cell_kind` | `u32` cells | [`AIR`], [`FLUID`] or [`SOLID`] (no open volume); of active slots |
//! | `face_open` | `f32` planes | open fraction of the lower faces, 0..1; slot 0 stays 0, so the box is closed |
//! | `face_velocity` | `f32` planes | m/s; a face with fraction 0 holds the solid's velocity and keeps it |
//! | `solid_flux` | `f32` cells | Σ ± (1 − f) u_solid over the six faces, outward positive, m/s |
//! | `liquid_distance` | `f32` cells | metres, negative inside; with the ghost-fluid surface alone |
//! | `density_excess` | `f32` cells | ρ/ρ_target − 1 as it is to be corrected; with the correction alone |
//!
//! What the room fills, of [`planned`]: `face_velocity` in place; `pressure`, Pa, natural cell order, 0 where
//! there is no water; `face_displacement`, planes in metres, 0 on faces that touch no water or are closed.
//! Only cells of wet slots are FLUID. Cells of a brick that lie past the box are AIR, and their lower faces closed:
//! one of those is the box's own wall. Only faces between water and water or water and air change.
//!
//! # Use
//! ```text
//! buffers += pressure::planned(..); passes += pressure::passes(..);    plan
//! let mut pressure = PressureSolver::new(..);                          once, and again when slots grow
//! pressure.set_topology(&program, &bricks, cell_size)                  each substep, after `bricks` is uploaded
//! pressure.project(&program, Scale { .. }, timer)                      builds, solves, subtracts; waits once
//! pressure.correct(&program, timer)                                    same system, density_excess -> face_displacement
//! ```

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
    PressureBrick, PressureControl, PressureControl64, PressurePhase, PressureStats, ReduceStep,
};
use plan::{PHASE_COUNT, Phase, SIZE_COUNT, Size};
pub use plan::{passes, planned};
pub(super) use stages::all_commands;
use stages::{SINGLE, Shape, Stages};
pub use swell_domain::poisson::{AIR, FLUID, SOLID};

/// Levels of bricks that the multigrid uses at most: pass it to [`Bricks::new`] as depth.
pub const LEVELS: usize = 8;

/// Relative residual of the density correction.
pub const CORRECTION_TOLERANCE: f64 = 1e-2;

/// `state` of a solve that iterates, as in shared/pressure_control.wgsl.
pub const ITERATING: u32 = 0;
/// Of one whose residual is computed afresh.
pub const VERIFYING: u32 = 1;
/// Of one that has ended.
pub const DONE: u32 = 2;
/// Of one that waits for the host to list the pockets.
pub const WANTS_POCKETS: u32 = 3;

/// Iterations submitted at once at most: a device that is done skips the rest, but not for nothing.
const MOST_AT_ONCE: u32 = 64;

/// What q of a substep stands for: pressure is q ρ Δx over the time for which it acts.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// For how long it acts, seconds: Δt where substeps are equal.
    pub kick: f64,
    /// ρ, kg/m³.
    pub rest_density: f64,
}

/// What a solve did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solved {
    /// Conjugate-gradient iterations.
    pub iterations: u32,
    /// ‖b − Ax‖/‖b‖ from a freshly computed residual; 0 where b = 0.
    pub residual: f64,
    /// Whether that is above the tolerance.
    pub is_missed: bool,
}

/// What a projection did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Projected {
    /// The solve.
    pub solved: Solved,
    /// Largest |∇·u| in a cell of water before, 1/s.
    pub divergence_before: f64,
    /// The same after.
    pub divergence_after: f64,
    /// Bodies of water that no air touches.
    pub pockets: u32,
    /// Largest |mean of ∇·u| over a pocket, 1/s: what no pressure can undo, as when a solid crushes it.
    pub incompatible: f64,
    /// Cells of water without an open face.
    pub dropped: u32,
}

/// The projection, bound to a program that holds [`planned`] buffers and [`passes`].
pub struct PressureSolver {
    settings: Pressure,
    has_correction: bool,
    capacity: usize,
    stages: BTreeMap<Shape, Stages<Recording>>,
    shape: Shape,
    phase: PressurePhase,
    sizes: [Workgroups; SIZE_COUNT],
    pockets: u32,
    /// Iterations that the last projection and the last correction took: how many the next is submitted with.
    /// It changes when the device is waited for, and nothing else.
    expected: [u32; 2],
}

#[derive(Clone, Copy, PartialEq)]
enum Task {
    Project,
    Correct,
}

impl PressureSolver {
    /// For a program with buffers of `capacity` slots; to be built anew when those were replaced by larger ones.
    pub fn new(settings: &Pressure, has_correction: bool, capacity: usize) -> Self {
        let expected = match settings.preconditioner {
            Preconditioner::Multigrid => 10,
            _ => MOST_AT_ONCE,
        };
        Self {
            settings: settings.clone(),
            has_correction,
            capacity,
            stages: BTreeMap::new(),
            shape: Shape {
                levels: 1,
                dispatched: 1,
                has_pockets: false,
            },
            phase: PressurePhase {
                stride: CELLS * capacity as u32,
                max_iterations: settings.max_iterations,
                ..PressurePhase::default()
            },
            sizes: [Workgroups::default(); SIZE_COUNT],
            pockets: 0,
            expected: [expected, expected / 2],
        }
    }

    /// Takes over the bricks of a substep, whose records the caller has uploaded to `bricks`.
    ///
    /// # Panics
    /// Where they are more than the capacity.
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
                .unwrap_or(used.len() - 1)
                .max(1),
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
            self.sizes[Size::Half(level).index()] = groups(32 * count);
        }
        self.sizes[Size::Single.index()] = [1, 1, 1].into();
        self.sizes[Size::Active.index()] = groups(64 * active);
        program.upload(SIZES, 0, &self.sizes);
    }

    /// Builds the system, solves it and makes `face_velocity` free of divergence; waits for the device.
    ///
    /// # Errors
    /// The device.
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

    /// The same, by whatever runs recordings.
    pub(super) fn project_by(
        &mut self,
        program: &Program,
        scale: Scale,
        run: &mut Run<'_>,
    ) -> Result<Projected, SolveError> {
        let pressure = scale.rest_density * f64::from(self.phase.cell_size) / scale.kick;
        self.phase.pressure_scale = pressure as f32;
        // Each substep looks for pockets anew.
        self.phase.has_pockets = 0;
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
    /// # Errors
    /// The device.
    ///
    /// # Panics
    /// Where the room was built without the correction.
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

    /// The same, by whatever runs recordings.
    pub(super) fn correct_by(
        &mut self,
        program: &Program,
        run: &mut Run<'_>,
    ) -> Result<Solved, SolveError> {
        assert!(self.has_correction, "built without the correction");
        let (solved, _) = self.solve(program, Task::Correct, CORRECTION_TOLERANCE, run)?;
        Ok(solved)
    }

    /// q of the last solve in the precision that it was solved in, m/s, of `elements` of the caller's cell arrays.
    ///
    /// # Errors
    /// The device.
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

    /// Runs a task to its end: batches of iterations, each followed by a verification and by what is to be done
    /// with the solution, which stay empty until it is their turn.
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
        self.upload_phases(program);
        let mut batch = self.expected[task as usize] + 1;
        let mut is_first = true;
        loop {
            let stages = self.stages(program);
            let (start, finish) = match task {
                Task::Project => (Some(&stages.project), Some(&stages.finish_project)),
                Task::Correct => (stages.correct.as_ref(), stages.finish_correct.as_ref()),
            };
            let mut recordings = Vec::new();
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
        let (preconditioner, has_correction) = (self.settings.preconditioner, self.has_correction);
        self.stages.entry(self.shape).or_insert_with_key(|&shape| {
            Stages::new(preconditioner, has_correction, shape).bind(program)
        })
    }

    fn upload_phases(&self, program: &Program) {
        let has_halves = self.settings.preconditioner == Preconditioner::Multigrid;
        let phases: Vec<_> = (0..PHASE_COUNT)
            .map(|index| Phase::fill(index, self.phase, has_halves))
            .collect();
        program.upload_windows(&PHASES, &phases);
    }

    /// Lists the cells of each pocket, which the device has counted and found to be there.
    fn find_pockets(&mut self, program: &Program) -> Result<(), SolveError> {
        let cells = (CELLS * (self.phase.levels[0][1] + 1)) as usize;
        let labels = program.read(buffers::LABEL, cells)?;
        let (cells, ranges) = pockets::list(&labels);
        program.upload(buffers::POCKET_CELLS, 0, &cells);
        program.upload(buffers::POCKET_RANGES, 0, &ranges);
        self.pockets = ranges.len() as u32;
        self.sizes[Size::Pockets.index()] =
            spread(&program.context, 1, u64::from(self.pockets)).into();
        program.upload(SIZES, 0, &self.sizes);
        self.shape.has_pockets = true;
        self.phase.has_pockets = 1;
        self.upload_phases(program);
        Ok(())
    }
}

/// Where an element stands in the room's own arrays: by block of 2³ cells.
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
        // The device compares squares, with the tolerance's in f32.
        is_missed: residual.is_nan() || residual > tolerance * (1.0 + 1e-6),
    }
}

/// The room's own records: face neighbours, and the way up to the next level, of the first `levels` levels.
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
