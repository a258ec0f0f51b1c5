//! Points that project a fixed state once, compared with the exact solution of the same system.

use std::{collections::BTreeMap, time::Instant};

use swell_domain::{
    bricks::CELLS,
    budget::Breach,
    particles::Particles,
    poisson::{Cells, System},
    solver::Solver,
};
use swell_files::study::sweep::Point;
use swell_gpu::adapter::Context;
use swell_reference::{
    ReferenceError,
    poisson::{self, gradients::norm},
};
use swell_scene::{FlipScene, flip::Surface};
use swell_solve::{
    SolveError,
    flip::{
        Flip,
        buffers::{CELL_KIND, FACE_OPEN, FACE_VELOCITY, LIQUID_DISTANCE, SOLID_FLUX, contraction},
    },
    plan::device_limits,
};
use swell_stage::{device::Opened, drive::Drive, prepare::Start};

use super::{
    super::{
        StudyError,
        engine::{Bench, until_done},
    },
    frames::products,
    measured::{ProjectionErrors, SweepMeasurements, SweepRun},
};

/// Projections of one state.
pub(super) struct Projections<'a> {
    made_by: &'a Point,
    /// Computed when it is first needed.
    state: Option<Particles>,
    /// Exact solutions by a hash of the system and its right-hand side.
    exact: BTreeMap<[u8; 32], Exact>,
}

#[derive(Clone)]
struct Exact {
    q: Vec<f64>,
    residual: f64,
    /// Whether the solution comes from a factor rather than conjugate gradients.
    has_factor: bool,
}

/// Stands for an axis in keys of values at cell centres.
const CENTER: usize = 3;

/// An exact projection on one grid.
struct Resolved {
    /// Values by cell x, y, z and axis or [`CENTER`]: velocity in m/s at faces that a projection
    /// changes, q Δx at centres.
    values: BTreeMap<[u32; 4], f64>,
    /// Substep Δt, seconds.
    step: f64,
    rows: usize,
    residual: f64,
    has_factor: bool,
}

/// State of the grid before a projection.
struct GridState {
    kind: Vec<u32>,
    open: Vec<f32>,
    distance: Option<Vec<f32>>,
    flux: Vec<f32>,
    contraction: Option<Vec<f32>>,
    velocity: Vec<f32>,
}

impl<'a> Projections<'a> {
    /// Prepares projections of the state at the end of this point's frames.
    pub(super) fn new(made_by: &'a Point) -> Self {
        Self {
            made_by,
            state: None,
            exact: BTreeMap::new(),
        }
    }

    fn state(&mut self, bench: &Bench<'_>) -> Result<&Particles, StudyError> {
        let state = match self.state.take() {
            Some(state) => state,
            None => {
                let Point { scene, frames, .. } = self.made_by;
                let start = Start::of(scene)?;
                let opened = bench.devices.of(self.made_by.device);
                let mut drive = Drive::new(opened, scene, &start, false)?;
                let mut state = start.particles;
                until_done(&mut drive, *frames, bench.stop, |step| {
                    state = step.particles;
                    Ok(())
                })?;
                state
            }
        };
        Ok(self.state.insert(state))
    }

    /// Creates a solver loaded with the state.
    fn loaded(
        &mut self,
        bench: &Bench<'_>,
        point: &Point,
        scene: &FlipScene,
    ) -> Result<Flip, StudyError> {
        let frames = self.made_by.frames;
        let state = self.state(bench)?;
        let context = context(bench, point);
        let start = Start::of(scene)?;
        let plan = start.plan(scene, device_limits(context));
        let mut solver = Flip::new(context, scene, plan, &start.boundary, false)?;
        solver.load(frames, state)?;
        Ok(solver)
    }

    /// Projects `repeats` times after one warm-up. Each time covers a whole projection: system,
    /// solve, gradient, and waiting for the device.
    pub(super) fn measure(
        &mut self,
        bench: &Bench<'_>,
        point: &Point,
        repeats: u32,
    ) -> Result<SweepRun, StudyError> {
        let scene = of_flip(point)?;
        let mut solver = self.loaded(bench, point, &scene)?;
        let substep = solver.carry_to_grid()?;
        let grid = GridState::read(&solver, &scene)?;
        solver.project(&substep)?;
        let mut measured = SweepMeasurements {
            substeps: 1,
            ..SweepMeasurements::default()
        };
        let mut seconds = Vec::new();
        for _ in 0..repeats {
            solver.carry_to_grid()?;
            context(bench, point).wait().map_err(SolveError::from)?;
            let begin = Instant::now();
            let projected = solver.project(&substep)?;
            seconds.push(begin.elapsed().as_secs_f64());
            if !projected.solved.residual.is_finite() {
                let detail = format!("a residual of {}", projected.solved.residual);
                let breach = Breach::not_finite(self.made_by.frames + 1, 1, Some(detail));
                return Err(SolveError::Numbers(breach).into());
            }
            measured.iterations = u64::from(projected.solved.iterations);
            measured.missed = u32::from(projected.solved.is_missed);
            measured.projection = Some(ProjectionErrors {
                divergence: projected.divergence_after * substep.length,
                residual: projected.solved.residual,
                ..self.errors(&solver, &grid)?
            });
        }
        let settings = &scene.settings().pressure;
        measured.work = measured.iterations as f64 * products(settings.preconditioner);
        self.one(bench, seconds, measured)
    }

    /// Discretisation error: compares the exact projection of the state on `coarse` cells with that
    /// on `fine` cells of half the size, velocities at faces with the mean of the four faces that
    /// make up each, q Δx at centres with the mean of eight.
    pub(super) fn coarser(
        &mut self,
        bench: &Bench<'_>,
        fine: &Point,
        coarse: &Point,
    ) -> Result<SweepRun, StudyError> {
        let begin = Instant::now();
        let [fine, coarse] = [self.resolved(bench, fine)?, self.resolved(bench, coarse)?];
        if (fine.step - coarse.step).abs() > 1e-9 * fine.step {
            let what = format!(
                "the coarser cells take a substep of {} s, the others of {} s",
                coarse.step, fine.step
            );
            return Err(StudyError::Point(what));
        }
        let mean = |of: &BTreeMap<[u32; 4], f64>, place: &[u32; 4]| {
            let axis = place[3] as usize;
            let below = (0..8u32).filter(|k| axis == CENTER || (k >> axis) & 1 == 0);
            let values = below.map(|k| {
                let at = |i: usize| 2 * place[i] + ((k >> i) & 1);
                of.get(&[at(0), at(1), at(2), place[3]]).copied()
            });
            let values: Option<Vec<f64>> = values.collect();
            values.map(|values| values.iter().sum::<f64>() / values.len() as f64)
        };
        let relative = |is_center: bool| {
            let places = coarse.values.iter();
            let places = places.filter(|(place, _)| (place[3] as usize == CENTER) == is_center);
            let pairs =
                places.filter_map(|(place, value)| Some((*value, mean(&fine.values, place)?)));
            let (off, all): (Vec<f64>, Vec<f64>) = pairs.map(|(c, f)| (c - f, f)).unzip();
            norm(&off) / norm(&all)
        };
        let measured = SweepMeasurements {
            substeps: 1,
            projection: Some(ProjectionErrors {
                pressure: relative(true),
                velocity: relative(false),
                rows: fine.rows,
                exact_residual: fine.residual.max(coarse.residual),
                has_factor: fine.has_factor && coarse.has_factor,
                ..ProjectionErrors::default()
            }),
            ..SweepMeasurements::default()
        };
        self.one(bench, vec![begin.elapsed().as_secs_f64()], measured)
    }

    /// Results of a single projection.
    fn one(
        &mut self,
        bench: &Bench<'_>,
        seconds: Vec<f64>,
        measured: SweepMeasurements,
    ) -> Result<SweepRun, StudyError> {
        Ok(SweepRun {
            particles: self.state(bench)?.len(),
            frames: 1,
            seconds,
            ended: None,
            measured,
        })
    }

    /// Exact projection of the state on the grid of a point.
    fn resolved(&mut self, bench: &Bench<'_>, point: &Point) -> Result<Resolved, StudyError> {
        let scene = of_flip(point)?;
        let mut solver = self.loaded(bench, point, &scene)?;
        let substep = solver.carry_to_grid()?;
        let grid = GridState::read(&solver, &scene)?;
        let cells = grid.cells(&solver);
        let system = System::new(cells);
        let exact = self.exact(&system, &grid.right_side(&solver, &system))?;
        let records = &solver.bricks().records;
        let place = |element: usize, axis: usize| {
            let local = (element % CELLS as usize) as u32;
            let corner = records[element / CELLS as usize].coordinate;
            let [x, y, z] = [local % 8, local / 8 % 8, local / 64];
            [
                8 * corner[0] + x,
                8 * corner[1] + y,
                8 * corner[2] + z,
                axis as u32,
            ]
        };
        let stride = grid.kind.len();
        let size = scene.settings().cell_size;
        let faces = system.gradient(cells, &exact.q).into_iter();
        let faces = faces.map(|(face, difference)| {
            let velocity = f64::from(grid.velocity[face]) - difference;
            (place(face % stride, face / stride), velocity)
        });
        let centers = system.cell.iter().zip(&exact.q);
        let centers = centers.map(|(&element, q)| (place(element as usize, CENTER), q * size));
        Ok(Resolved {
            values: faces.chain(centers).collect(),
            step: substep.length,
            rows: system.cell.len(),
            residual: exact.residual,
            has_factor: exact.has_factor,
        })
    }

    /// Errors of the device's solution.
    fn errors(&mut self, solver: &Flip, grid: &GridState) -> Result<ProjectionErrors, StudyError> {
        let cells = grid.cells(solver);
        let system = System::new(cells);
        let exact = self.exact(&system, &grid.right_side(solver, &system))?;
        let stride = grid.kind.len();
        // p is q times a factor that is the same on both sides.
        let found = solver.solution(&system.cell)?;
        let off: Vec<f64> = found.iter().zip(&exact.q).map(|(q, q64)| q - q64).collect();
        let velocity = solver.field(FACE_VELOCITY, 3 * stride)?;
        let faces = system.gradient(cells, &exact.q);
        let (moved, after): (Vec<f64>, Vec<f64>) = faces
            .into_iter()
            .map(|(face, difference)| {
                let exact = f64::from(grid.velocity[face]) - difference;
                (f64::from(velocity[face]) - exact, exact)
            })
            .unzip();
        Ok(ProjectionErrors {
            pressure: norm(&off) / norm(&exact.q),
            velocity: norm(&moved) / norm(&after),
            divergence: 0.0,
            residual: 0.0,
            rows: system.cell.len(),
            exact_residual: exact.residual,
            has_factor: exact.has_factor,
        })
    }

    /// Exact solution of a system, cached so that methods with the same system share it.
    fn exact(&mut self, system: &System, b: &[f64]) -> Result<Exact, ReferenceError> {
        let mut hasher = blake3::Hasher::new();
        for values in [&system.diagonal, &system.dirichlet, b] {
            hasher.update(bytemuck::cast_slice(values));
        }
        let key = *hasher.finalize().as_bytes();
        if let Some(exact) = self.exact.get(&key) {
            return Ok(exact.clone());
        }
        let solution = poisson::solve(system, b)?;
        let exact = Exact {
            q: solution.x,
            residual: solution.residual,
            has_factor: solution.iterations == 0,
        };
        Ok(self.exact.entry(key).or_insert(exact).clone())
    }
}

/// Returns a point's scene, which FLIP has to solve.
fn of_flip(point: &Point) -> Result<FlipScene<'_>, StudyError> {
    let wrong = || "projections are measured with solver.method flip".to_owned();
    point
        .scene
        .with_flip()
        .ok_or_else(|| StudyError::Point(wrong()))
}

fn context<'a>(bench: &'a Bench<'_>, point: &Point) -> &'a Context {
    match bench.devices.of(point.device) {
        Opened::Gpu(context) => context,
        Opened::Cpu => unreachable!("refused where the study is loaded"),
    }
}

impl GridState {
    fn read(solver: &Flip, scene: &FlipScene) -> Result<Self, SolveError> {
        let stride = solver.plan().counts.bricks.slots * CELLS as usize;
        let has_distance = scene.settings().surface == Surface::GhostFluid;
        let distance = has_distance.then(|| solver.field(LIQUID_DISTANCE, stride));
        Ok(Self {
            kind: solver.field(CELL_KIND, stride)?,
            open: solver.field(FACE_OPEN, 3 * stride)?,
            distance: distance.transpose()?,
            flux: solver.field(SOLID_FLUX, stride)?,
            contraction: (!scene.turns_velocities())
                .then(|| solver.field(contraction(stride), stride))
                .transpose()?,
            velocity: solver.field(FACE_VELOCITY, 3 * stride)?,
        })
    }

    /// Returns the right-hand side of a system of the cells.
    fn right_side(&self, solver: &Flip, system: &System) -> Vec<f64> {
        let mut b = system.rhs(self.cells(solver), &self.velocity, &self.flux);
        if let Some(contraction) = &self.contraction {
            for (b, &element) in b.iter_mut().zip(&system.cell) {
                *b += f64::from(contraction[element as usize]);
            }
        }
        b
    }

    fn cells<'a>(&'a self, solver: &'a Flip) -> Cells<'a> {
        Cells {
            bricks: solver.bricks(),
            kind: &self.kind,
            open: &self.open,
            distance: self.distance.as_deref(),
        }
    }
}
