//! A pressure room on a case, as the FLIP solver drives it.
#![allow(
    dead_code,
    missing_docs,
    unreachable_pub,
    reason = "each binary uses its part"
)]

use swell::{
    domain::{
        bricks::CELLS,
        poisson::{
            System,
            cases::{Case, Surface as CaseSurface},
        },
    },
    gpu::{adapter::Context, program::Program, recording::Timer, sort::storage},
    scene::flip::{Preconditioner, Pressure, Surface},
    solve::pressure::{self, PressureSolver, Projected, Solved, Step},
};

pub struct Rig {
    pub program: Program,
    pub solver: PressureSolver,
    pub system: System,
    pub case: Case,
    capacity: usize,
}

pub fn settings(preconditioner: Preconditioner, tolerance: f64) -> Pressure {
    Pressure {
        preconditioner,
        tolerance,
        max_iterations: 3000,
    }
}

/// Where an element stands in the room's own arrays.
pub fn blocked(element: u32) -> usize {
    let (slot, local) = (element / CELLS, element % CELLS);
    let [x, y, z] = [local % 8, local / 8 % 8, local / 64];
    let cell = x % 2 + 2 * (y % 2) + 4 * (z % 2);
    let block = x / 2 + 4 * (y / 2) + 16 * (z / 2);
    (CELLS * slot + 64 * cell + block) as usize
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

    /// An array of the room, by row.
    pub fn by_row(&self, name: &str) -> Vec<f64> {
        let cells = self.capacity * CELLS as usize;
        let values = self.program.download::<f32>(&[(name, cells)]).unwrap();
        self.system
            .cell
            .iter()
            .map(|&element| f64::from(values[0][blocked(element)]))
            .collect()
    }

    /// Both words of the solution, by row.
    pub fn solution(&self) -> Vec<f64> {
        let cells = self.capacity * CELLS as usize;
        let values = self
            .program
            .download::<f32>(&[("pressure_solution", 2 * cells)])
            .unwrap();
        let at = |e: usize| f64::from(values[0][e]) + f64::from(values[0][cells + e]);
        self.system.cell.iter().map(|&e| at(blocked(e))).collect()
    }
}
