//! A pressure room on a case, as the FLIP solver drives it.
use swell::{
    domain::{
        bricks::CELLS,
        poisson::{
            System,
            cases::{Case, Surface as CaseSurface},
        },
    },
    gpu::{adapter::Context, program::Program, recording::Timer, sort::storage},
    scene::flip::{Precision, Preconditioner, Pressure, Surface},
    solve::pressure::{self, PressureSolver, Projected, Solved, Step, blocked},
};

pub struct Rig {
    pub program: Program,
    pub solver: PressureSolver,
    pub system: System,
    pub case: Case,
    capacity: usize,
    precision: Precision,
}

pub fn settings(preconditioner: Preconditioner, tolerance: f64) -> Pressure {
    Pressure {
        preconditioner,
        precision: Precision::F32Refined,
        tolerance,
        max_iterations: 3000,
    }
}

impl Rig {
    pub fn new(context: &Context, case: Case, settings: &Pressure) -> Self {
        let capacity = case.bricks.slots() + 3;
        let cells = 4 * capacity as u64 * u64::from(CELLS);
        let surface = match case.surface {
            CaseSurface::Voxel => Surface::Voxel,
            CaseSurface::GhostFluid => Surface::GhostFluid,
        };
        let mut specs = pressure::buffers(settings, true, capacity);
        specs.extend([
            storage("bricks", 160 * capacity as u64),
            storage("cell_kind", cells),
            storage("face_open", 3 * cells),
            storage("face_velocity", 3 * cells),
            storage("solid_flux", cells),
            storage("liquid_distance", cells),
            storage("density_excess", cells),
        ]);
        let passes = pressure::passes(settings, surface, true);
        let program = Program::new(context, &specs, &passes, &[]).unwrap();
        let mut rig = Self {
            solver: PressureSolver::new(settings, true, capacity),
            system: case.system(),
            program,
            case,
            capacity,
            precision: settings.precision,
        };
        rig.upload_case();
        rig
    }

    pub fn upload_case(&mut self) {
        let case = &self.case;
        self.program.upload("bricks", 0, &case.bricks.records);
        self.program.upload("cell_kind", 0, &case.kind);
        self.program.upload("liquid_distance", 0, &case.distance);
        self.upload_planes("face_open", &case.open);
        self.solver
            .set_topology(&self.program, &case.bricks, case.cell_size);
    }

    /// Solves by other settings of the same preconditioner and precision from now on.
    pub fn set(&mut self, settings: &Pressure) {
        self.solver = PressureSolver::new(settings, true, self.capacity);
        self.upload_case();
    }

    /// Planes of the case's stride into those of the capacity's.
    pub fn upload_planes(&self, name: &str, values: &[f32]) {
        let stride = 4 * self.capacity as u64 * u64::from(CELLS);
        for (axis, plane) in values.chunks_exact(self.case.kind.len()).enumerate() {
            self.program.upload(name, axis as u64 * stride, plane);
        }
    }

    pub fn planes(&self, name: &str) -> Vec<f32> {
        let stride = self.capacity * CELLS as usize;
        let all = self.program.download::<f32>(&[(name, 3 * stride)]).unwrap();
        (0..3)
            .flat_map(|axis| all[0][axis * stride..][..self.case.kind.len()].to_vec())
            .collect()
    }

    /// Gives each row its right-hand side, by way of the solid flux.
    pub fn set_rhs(&self, b: &[f64]) {
        let mut flux = vec![0.0f32; self.case.kind.len()];
        for (&element, &b) in self.system.cell.iter().zip(b) {
            flux[element as usize] = -b as f32;
        }
        self.program.upload("solid_flux", 0, &flux);
        self.upload_planes("face_velocity", &vec![0.0; 3 * self.case.kind.len()]);
    }

    pub fn project(&mut self, timer: Option<&mut Timer>) -> Projected {
        let step = Step {
            time_step: 1.0,
            rest_density: 1.0 / self.case.cell_size,
        };
        self.solver.project(&self.program, step, timer).unwrap()
    }

    pub fn solve(&mut self, b: &[f64]) -> Solved {
        self.set_rhs(b);
        self.project(None).solved
    }

    /// `planes` arrays of the room's own precision, added up, by row.
    fn sum(&self, name: &str, planes: usize) -> Vec<f64> {
        let cells = self.capacity * CELLS as usize;
        let words = planes * cells * self.precision.words();
        let values = self.program.download::<u32>(&[(name, words)]).unwrap();
        let values = pressure::widen(&values[0], self.precision);
        let at = |e: usize| (0..planes).map(|k| values[k * cells + e]).sum();
        self.system.cell.iter().map(|&e| at(blocked(e))).collect()
    }

    /// An array of the room, by row.
    pub fn by_row(&self, name: &str) -> Vec<f64> {
        self.sum(name, 1)
    }

    /// All terms of the solution, by row.
    pub fn solution(&self) -> Vec<f64> {
        self.sum("pressure_solution", self.precision.terms())
    }
}
