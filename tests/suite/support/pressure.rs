//! The pressure solver on a prepared case, driven as FLIP drives it.
use swell::{
    domain::{
        bricks::CELLS,
        poisson::{
            System,
            cases::{Case, Surface as CaseSurface},
        },
    },
    gpu::{adapter::Context, buffer::Buf, program::Program, recording::Timer},
    scene::flip::{Precision, Preconditioner, Pressure, Surface},
    solve::{
        flip::buffers::*,
        pressure::{
            self, Extent, PressureSolver, Projected, Scale, Solved, blocked,
            buffers::{COEFFICIENT, DIRICHLET, Real, SOLUTION, read_reals},
        },
    },
};

/// The projection of a scene without bodies.
pub const WITH_CORRECTION: Extent = Extent {
    has_correction: true,
    has_bodies: false,
    has_contraction: false,
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
        let cells = capacity * CELLS as usize;
        let surface = match case.surface {
            CaseSurface::Voxel => Surface::Voxel,
            CaseSurface::GhostFluid => Surface::GhostFluid,
        };
        let mut specs = pressure::planned(settings, WITH_CORRECTION, capacity).specs();
        specs.extend([
            BRICKS.sized(capacity),
            CELL_KIND.sized(cells),
            FACE_OPEN.sized(3 * cells),
            FACE_VELOCITY.sized(6 * cells),
            SOLID_FLUX.sized(cells),
            LIQUID_DISTANCE.sized(cells),
            DENSITY_EXCESS.sized(cells),
        ]);
        let passes = pressure::passes(settings, surface, WITH_CORRECTION, false);
        let program = Program::new(context, &specs, &passes, &[]).unwrap();
        let mut rig = Self {
            solver: PressureSolver::new(settings, WITH_CORRECTION, capacity),
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
        let records = bytemuck::cast_slice(&case.bricks.records);
        self.program.upload(BRICKS, 0, records);
        self.program.upload(CELL_KIND, 0, &case.kind);
        self.program.upload(LIQUID_DISTANCE, 0, &case.distance);
        self.upload_planes(FACE_OPEN, &case.open);
        self.solver
            .set_topology(&self.program, &case.bricks, case.cell_size);
    }

    /// From now on solves with other settings of the same preconditioner and precision.
    pub fn set(&mut self, settings: &Pressure) {
        self.solver = PressureSolver::new(settings, WITH_CORRECTION, self.capacity);
        self.upload_case();
    }

    /// Uploads three planes with the case's stride into a buffer with the capacity's stride.
    pub fn upload_planes(&self, buffer: Buf<f32>, values: &[f32]) {
        let stride = self.capacity * CELLS as usize;
        for (axis, plane) in values.chunks_exact(self.case.kind.len()).enumerate() {
            self.program.upload(buffer.clone(), axis * stride, plane);
        }
    }

    pub fn planes(&self, buffer: Buf<f32>) -> Vec<f32> {
        let stride = self.capacity * CELLS as usize;
        let all = self.program.read(buffer, 3 * stride).unwrap();
        (0..3)
            .flat_map(|axis| all[axis * stride..][..self.case.kind.len()].to_vec())
            .collect()
    }

    /// The displacements of the density correction.
    pub fn displacements(&self) -> Vec<f32> {
        self.planes(face_displacement(self.capacity * CELLS as usize))
    }

    /// Sets the right-hand side of each row, by means of the solid flux.
    pub fn set_rhs(&self, b: &[f64]) {
        let mut flux = vec![0.0f32; self.case.kind.len()];
        for (&element, &b) in self.system.cell.iter().zip(b) {
            flux[element as usize] = -b as f32;
        }
        self.program.upload(SOLID_FLUX, 0, &flux);
        self.upload_planes(FACE_VELOCITY, &vec![0.0; 3 * self.case.kind.len()]);
    }

    pub fn project(&mut self, timer: Option<&mut Timer>) -> Projected {
        let scale = Scale {
            kick: 1.0,
            rest_density: 1.0 / self.case.cell_size,
        };
        self.solver.project(&self.program, scale, timer).unwrap()
    }

    pub fn solve(&mut self, b: &[f64]) -> Solved {
        self.set_rhs(b);
        self.project(None).solved
    }

    /// Sums `planes` arrays in the solver's own precision; one value per row.
    fn sum(&self, buffer: Buf<Real>, planes: usize) -> Vec<f64> {
        let cells = self.capacity * CELLS as usize;
        let read = read_reals(&self.program, &buffer, self.precision, planes * cells);
        let values = read.unwrap();
        let at = |e: usize| (0..planes).map(|k| values[k * cells + e]).sum();
        self.system.cell.iter().map(|&e| at(blocked(e))).collect()
    }

    /// An array of the solver, one value per row.
    pub fn by_row(&self, buffer: Buf<Real>) -> Vec<f64> {
        self.sum(buffer, 1)
    }

    /// The solution, one value per row, with all terms of its extended precision summed.
    pub fn solution(&self) -> Vec<f64> {
        self.sum(SOLUTION, self.precision.terms())
    }
}

impl Rig {
    /// Number of rows on the device that differ from those of the f64 system by more than rounding: θ
    /// and its inverse are rounded a few times at ε = 6e-8, and so is their sum.
    pub fn wrong_rows(&self, system: &System) -> usize {
        let cells = 512 * (self.case.bricks.slots() + 3);
        let wanted = COEFFICIENT.first(3 * cells);
        let coefficient = self.program.download(wanted).unwrap();
        // The rig's precision is one of the f32 ones.
        let wanted = DIRICHLET.retyped::<f32>().first(cells);
        let dirichlet = self.program.download(wanted).unwrap();
        let is_off =
            |found: f32, expected: f64| (f64::from(found) - expected).abs() > 1e-6 * expected;
        let mut is_row = vec![false; cells];
        let mut wrong = 0;
        for (row, &element) in system.cell.iter().enumerate() {
            let place = blocked(element);
            is_row[place] = true;
            let is_wrong = is_off(dirichlet[place], system.dirichlet[row])
                || (0..3).any(|axis| {
                    is_off(
                        coefficient[axis * cells + place],
                        system.coefficient[row][2 * axis],
                    )
                });
            wrong += usize::from(is_wrong);
        }
        let wet = 512..512 * (self.case.bricks.wet as usize + 1);
        let beyond = wet.filter(|&e| {
            !is_row[e]
                && (dirichlet[e] != 0.0 || (0..3).any(|axis| coefficient[axis * cells + e] != 0.0))
        });
        wrong + beyond.count()
    }
}
