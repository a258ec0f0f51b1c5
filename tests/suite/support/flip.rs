//! Helpers shared by the tests of FLIP.
use glam::{DVec3, Vec3};
use swell::{
    domain::{
        boundary::Boundary,
        bricks::{Bricks, CELLS},
        particles::Particles,
        signed_distance::SignedDistance,
        solver::{Solver, StepReport},
    },
    gpu::{adapter::Context, buffer::Buf},
    scene::{
        Scene,
        flip::{Flip as Settings, Precision, Preconditioner, Pressure, Surface, Transfer},
    },
    solve::{
        flip::{Flip, capacity},
        plan::{Capacity, Counts, Plan, device_limits},
    },
};

pub use crate::support::flip_of as flip;
use crate::support::{lattice, scene as box_scene};

/// Cell size, metres.
pub const DX: f64 = 0.1;

pub fn settings() -> Settings {
    Settings {
        cell_size: DX,
        particles_per_cell: 8,
        transfer: Transfer::Flip,
        pic_blend: 0.05,
        cfl: 2.0,
        max_substeps: 32,
        surface: Surface::GhostFluid,
        density_correction: true,
        band: None,
        pressure: Pressure {
            preconditioner: Preconditioner::Multigrid,
            precision: Precision::F32Refined,
            tolerance: 1e-5,
            max_iterations: 400,
        },
    }
}

/// A box of `cells` cells.
pub fn scene(cells: [f64; 3]) -> Scene {
    let mut scene = box_scene(cells.map(|n| n * DX));
    scene.unchosen = Some(scene.solver);
    scene.solver = settings().into();
    scene
}

pub fn solver_with(
    context: &Context,
    scene: &Scene,
    particles: &Particles,
    boundary: &Boundary,
    bricks: Capacity,
) -> Flip {
    let counts = Counts {
        particles: particles.len(),
        bricks,
        ..Counts::of_solids(boundary)
    };
    let plan = Plan::new(scene, counts, device_limits(context));
    let mut solver =
        Flip::new(context, &scene.with_flip().unwrap(), plan, boundary, false).unwrap();
    solver.load(0, particles).unwrap();
    solver
}

pub fn solver(context: &Context, scene: &Scene, particles: &Particles) -> Flip {
    solver_with(
        context,
        scene,
        particles,
        &Boundary::default(),
        capacity(&scene.with_flip().unwrap(), particles),
    )
}

pub fn run(
    context: &Context,
    scene: &Scene,
    particles: &Particles,
    frames: u32,
) -> (Particles, StepReport) {
    let mut solver = solver(context, scene, particles);
    let mut last = None;
    for _ in 0..frames {
        last = Some(solver.advance().unwrap());
    }
    last.unwrap()
}

/// A block of whole cells of water, eight particles each.
pub fn block(corner: [usize; 3], cells: [usize; 3]) -> Particles {
    lattice(
        corner.map(|c| c as f64 * DX),
        cells.map(|n| 2 * n),
        [DX / 2.0; 3],
    )
}

pub fn position(particles: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(particles.position[k]).as_dvec3()
}

pub fn velocity(particles: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(particles.velocity[k]).as_dvec3()
}

/// A field of the grid, read back from the GPU and indexed by cell.
pub struct Field {
    pub bricks: Bricks,
    pub values: Vec<f32>,
    pub stride: usize,
}

impl Field {
    pub fn new(solver: &Flip, buffer: Buf<f32>, planes: usize) -> Self {
        let stride = solver.plan().counts.bricks.slots * CELLS as usize;
        Self {
            bricks: solver.bricks().clone(),
            values: solver.field(buffer, planes * stride).unwrap(),
            stride,
        }
    }

    /// Bits of a value, for a field of `u32` read as `f32`.
    pub fn at_bits(&self, cell: [usize; 3]) -> u32 {
        (self.at(0, cell) as f32).to_bits()
    }

    pub fn at(&self, plane: usize, cell: [usize; 3]) -> f64 {
        let dims = self.bricks.table_dims.map(|n| n as usize);
        let [x, y, z] = cell.map(|c| c / 8);
        let slot = self.bricks.table[(z * dims[1] + y) * dims[0] + x] as usize;
        let local = cell[0] % 8 + 8 * (cell[1] % 8) + 64 * (cell[2] % 8);
        f64::from(self.values[plane * self.stride + 512 * slot + local])
    }
}

/// The half-space n·x < d as a solid, sampled every 5 cm.
pub fn half_space(n: DVec3, d: f64) -> Boundary {
    let (spacing, dims) = (0.05, [50, 50, 50]);
    let origin = DVec3::splat(-0.3);
    let value = |k: usize| {
        let node = DVec3::new((k % 50) as f64, (k / 50 % 50) as f64, (k / 2500) as f64);
        (n.dot(origin + spacing * node) - d) as f32
    };
    let values = (0..125_000).map(value).collect();
    let distance = Some(SignedDistance {
        origin,
        spacing,
        dims,
        values,
    });
    Boundary {
        distance,
        ..Boundary::default()
    }
}

/// A tank filled with a lattice of particles to a depth of `depth` cells.
pub fn tank(cells: [usize; 3], depth: usize) -> (Scene, Particles) {
    let scene = scene(cells.map(|n| n as f64));
    (scene, block([0; 3], [cells[0], depth, cells[2]]))
}
