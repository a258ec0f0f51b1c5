//! Scenes, particles, caches and folders that several test modules start from.

pub mod cache;
pub mod device;
pub mod events;
pub mod flip;
pub mod forces;
pub mod job;
pub mod made_cache;
pub mod mutate;
pub mod paper;
pub mod pressure;
pub mod solvers;
#[cfg(target_os = "linux")]
pub mod tmpfs;
pub mod vdb;
pub mod whitewater;

pub use device::context;

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary, bounds::Bounds, mesh::TriangleMesh, motion::Motion,
        particles::Particles, solver::Solver, solver::StepReport,
    },
    gpu::adapter::Context,
    scene::{
        Budget, Effects, Iteration, Method, Pbf as Settings, PlacedMesh, Placement, Scene, Shot,
        Solver as SolverSettings, Stop, Water,
        flip::Flip,
        moving_solid::{MovingSolid, Slide, Turn},
    },
    solve::{pbf, plan::*},
};

pub const D: f64 = 0.1;

/// A box with default water settings, which tests change as needed.
pub fn scene(size: [f64; 3]) -> Scene {
    Scene {
        shot: Shot {
            name: "test".into(),
            frames: 10,
            frames_per_second: 100.0,
        },
        origin: DVec3::ZERO,
        domain: Bounds {
            min: DVec3::ZERO,
            max: DVec3::from_array(size),
        },
        no_slip: Vec::new(),
        periodic: [false; 3],
        water: Water {
            rest_density: 1000.0,
            gravity: DVec3::new(0.0, -9.81, 0.0),
            current: DVec3::ZERO,
            blocks: Vec::new(),
            meshes: Vec::new(),
            waves: Vec::new(),
            particles: Vec::new(),
        },
        solids: Vec::new(),
        moving_solids: Vec::new(),
        wave_makers: Vec::new(),
        emitters: Vec::new(),
        drains: Vec::new(),
        forces: Vec::new(),
        frame: None,
        solver: SolverSettings::Pbf(Settings {
            particle_spacing: D,
            support_ratio: 2.0,
            iteration: Iteration::RedBlack,
            spectral_radius: 0.98,
            stop: Stop::Iterations(4),
            cfl: 1.0,
            relaxation: 1.0,
            artificial_pressure: 0.0,
            grid_projection: false,
            max_substeps: 32,
        }),
        unchosen: None,
        grids: None,
        keep: None,
        compression: None,
        probes: Vec::new(),
        budget: Budget::default(),
        effects: Effects::default(),
    }
}

/// The scene's settings of both methods, as far as it has them.
fn settings_of(scene: &mut Scene) -> impl Iterator<Item = &mut SolverSettings> {
    [Some(&mut scene.solver), scene.unchosen.as_mut()]
        .into_iter()
        .flatten()
}

/// The scene's settings of PBF, chosen or not.
pub fn pbf_of(scene: &mut Scene) -> &mut Settings {
    let found = settings_of(scene).find_map(|solver| match solver {
        SolverSettings::Pbf(pbf) => Some(pbf),
        SolverSettings::Flip(_) => None,
    });
    found.unwrap()
}

/// The scene's settings of FLIP, chosen or not.
pub fn flip_of(scene: &mut Scene) -> &mut Flip {
    let found = settings_of(scene).find_map(|solver| match solver {
        SolverSettings::Pbf(_) => None,
        SolverSettings::Flip(flip) => Some(flip),
    });
    found.unwrap()
}

/// Chooses a method whose settings the scene has.
pub fn choose(scene: &mut Scene, method: Method) {
    if scene.solver.method() != method {
        let other = scene.unchosen.as_mut().unwrap();
        std::mem::swap(&mut scene.solver, other);
    }
}

/// `counts` particles on a lattice of spacing `spacing` from `corner`, ids in x-fastest order.
pub fn lattice(corner: [f64; 3], counts: [usize; 3], spacing: [f64; 3]) -> Particles {
    let mut particles = Particles::default();
    for z in 0..counts[2] {
        for y in 0..counts[1] {
            for x in 0..counts[0] {
                let at = |axis: usize, k: usize| {
                    (corner[axis] + (k as f64 + 0.5) * spacing[axis]) as f32
                };
                particles.position.push([at(0, x), at(1, y), at(2, z)]);
                particles.velocity.push([0.0; 3]);
                particles.id.push(particles.id.len() as u32);
            }
        }
    }
    particles
}

/// A hash of `k`, in −1..1.
pub fn noise(k: u64) -> f64 {
    let mut z = (k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Shifts each coordinate by at most `amount` metres.
pub fn jitter(particles: &mut Particles, amount: f64) {
    for (k, position) in particles.position.iter_mut().enumerate() {
        for (axis, x) in position.iter_mut().enumerate() {
            *x += (amount * noise(3 * k as u64 + axis as u64)) as f32;
        }
    }
}

pub fn plan(context: &Context, scene: &Scene, particles: usize, boundary: &Boundary) -> Plan {
    let counts = Counts {
        particles,
        ..Counts::of_solids(boundary)
    };
    Plan::new(scene, counts, device_limits(context))
}

pub fn solver(
    context: &Context,
    scene: &Scene,
    particles: &Particles,
    boundary: &Boundary,
) -> pbf::Pbf {
    let plan = plan(context, scene, particles.len(), boundary);
    let mut solver =
        pbf::Pbf::new(context, &scene.with_pbf().unwrap(), plan, boundary, false).unwrap();
    solver.load(0, particles).unwrap();
    solver
}

/// State and report after `frames` frames of PBF.
pub fn run(
    context: &Context,
    scene: &Scene,
    particles: &Particles,
    frames: u32,
) -> (Particles, StepReport) {
    let mut solver = solver(context, scene, particles, &Boundary::default());
    let mut last = None;
    for _ in 0..frames {
        last = Some(solver.advance().unwrap());
    }
    last.unwrap()
}

/// Largest distance between positions of the same id, metres.
pub fn max_distance(a: &Particles, b: &Particles) -> f64 {
    assert_eq!(a.id, b.id);
    a.position
        .iter()
        .zip(&b.position)
        .map(|(a, b)| glam::Vec3::from_array(*a).distance(glam::Vec3::from_array(*b)) as f64)
        .fold(0.0, f64::max)
}

/// The surface of a box, eight vertices and twelve triangles.
pub fn box_mesh(bounds: Bounds) -> TriangleMesh {
    let corner = |i: usize| {
        let pick = |axis: usize| {
            if i >> axis & 1 == 0 {
                bounds.min[axis]
            } else {
                bounds.max[axis]
            }
        };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    TriangleMesh {
        vertices: (0..8).map(corner).collect(),
        triangles: quads.into_iter().flat_map(halves).collect(),
    }
}

/// A box that translates along `direction`.
pub fn mover(bounds: Bounds, direction: DVec3, motion: Motion) -> MovingSolid {
    MovingSolid {
        placed: placed(box_mesh(bounds)),
        slide: Some(Slide { direction, motion }),
        turn: None,
        track: None,
        sequence: None,
        body: None,
        floor: None,
    }
}

/// Makes `solid` also rotate about an axis through its centre, at `speed` degrees a second.
pub fn turning(mut solid: MovingSolid, axis: DVec3, speed: f64) -> MovingSolid {
    let bounds = solid.placed.mesh.bounds().unwrap();
    let motion = Motion::ConstantVelocity {
        velocity: speed,
        until: None,
    };
    let pivot = 0.5 * (bounds.min + bounds.max);
    solid.turn = Some(Turn::new(pivot, axis, motion, &solid.placed.mesh));
    solid
}

pub fn placed(mesh: TriangleMesh) -> PlacedMesh {
    PlacedMesh {
        file: "box.obj".into(),
        file_hash: String::new(),
        placement: Placement::default(),
        mesh,
        holes: Default::default(),
        rounding: DVec3::ZERO,
        faults: Vec::new(),
    }
}
