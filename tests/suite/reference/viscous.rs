//! The viscous solve in f64: its error is within the requested tolerance, and between moving plates
//! it converges to a Couette flow.

use glam::DVec3;
use swell::{
    domain::{relaxation::Relaxation, solver::Solver},
    reference::flip::{
        Flip as Reference, Model, Trace,
        effects::{
            FaceInputs,
            viscosity::{ViscousCell, stresses, viscosity_relax, viscosity_weigh},
        },
        survey,
    },
    scene::{Wall, effects::viscosity::Settings, step::Substep},
};

use super::flip::cases::{Case, FRAME, dam, slope};
use crate::support::flip::{DX, block, scene};

/// A substep of a case, and its reference grid.
struct Grid {
    reference: Reference,
    substep: Substep,
    trace: Trace,
}

impl Grid {
    fn of(case: &Case) -> Self {
        let mut reference = Reference::new(&case.scene.with_flip().unwrap(), &case.boundary);
        reference.load(FRAME, &case.particles).unwrap();
        let cloud = reference.cloud();
        let found = survey(reference.model(), &cloud);
        let length = case.scene.shot.frame_seconds();
        let start = f64::from(FRAME) * length;
        let (_, substep) = (reference.model().scene)
            .flip_substep(
                (&case.particles.walls, &[]),
                FRAME + 1,
                start,
                length,
                found.speed,
                (0, 0.0),
            )
            .unwrap();
        let trace = reference.substep(&cloud, &found.is_wet, &substep).unwrap();
        Self {
            reference,
            substep,
            trace,
        }
    }

    fn model(&self) -> &Model {
        self.reference.model()
    }

    fn cells(&self) -> Vec<ViscousCell> {
        let step = self.model().step(&self.substep, &Default::default(), &[]);
        viscosity_weigh(FaceInputs {
            model: self.model(),
            step: &step,
            bricks: &self.trace.bricks,
            space: &self.trace.space,
            centers: &self.trace.centers,
            old: &self.trace.faces.change,
        })
    }

    /// Runs a number of iterations from `start`.
    fn solved(
        &self,
        cells: &[ViscousCell],
        start: &[DVec3],
        how: &Relaxation,
        iterations: u32,
    ) -> Vec<DVec3> {
        let mut state = (start.to_vec(), vec![DVec3::ZERO; start.len()]);
        for n in 0..iterations {
            let [reach, gain, momentum, _] = how.of_iteration(n == 0);
            let grid = (&self.trace.bricks, cells);
            state = viscosity_relax(grid, [reach, gain, momentum], start, (&state.0, &state.1));
        }
        state.0
    }

    /// √Σ D (a − b)² over the faces that move, with the system's diagonal D: the norm of
    /// the error bound.
    fn apart(&self, cells: &[ViscousCell], reach: f64, a: &[DVec3], b: &[DVec3]) -> f64 {
        let mut sum = 0.0;
        for (element, cell) in cells.iter().enumerate() {
            for axis in (0..3).filter(|&axis| cell.moves[axis]) {
                let at = (&self.trace.bricks, cells);
                let stress = stresses(at, a, element as u32, axis).y;
                let mass = if cell.is_whole[axis] { 1.0 } else { 0.5 };
                sum += (mass + reach * stress) * (a[element][axis] - b[element][axis]).powi(2);
            }
        }
        sum.sqrt()
    }
}

#[test]
fn the_error_that_is_left_is_what_was_asked_for() {
    for (name, mut case) in [("dam", dam()), ("slope", slope())] {
        case.scene.no_slip = [0, 2, 4].map(|k| Wall::NAMED[k].1).to_vec();
        let grid = Grid::of(&case);
        let cells = grid.cells();
        assert!(cells.iter().any(|cell| cell.moves[0]));
        assert!((cells.iter()).all(|cell| ViscousCell::of_word(cell.word()) == *cell));
        let start = &grid.trace.faces.velocity;
        for reach in [0.1, 3.0, 100.0] {
            let close = Relaxation::new(reach, 1.0, 1.0, 1e-12);
            let exact = grid.solved(&cells, start, &close, close.iterations);
            for tolerance in [1e-1, 1e-3, 1e-5] {
                let how = Relaxation::new(reach, 1.0, 1.0, tolerance);
                let found = grid.solved(&cells, start, &how, how.iterations);
                let whole = grid.apart(&cells, reach, start, &exact);
                let left = grid.apart(&cells, reach, &found, &exact) / whole;
                println!(
                    "{name} {reach}: {left:.2e} of {tolerance} by {} iterations",
                    how.iterations
                );
                assert!(left <= tolerance, "{name} {reach}: {left} {tolerance}");
                // Negative control: a quarter of the iterations is not enough.
                let few = grid.solved(&cells, start, &how, how.iterations / 4);
                let left = grid.apart(&cells, reach, &few, &exact) / whole;
                assert!(left > tolerance, "{name} {reach}: {left} {tolerance}");
            }
        }
    }
}

/// Viscous stress never increases the kinetic energy, and conserves momentum where no
/// wall is no-slip.
#[test]
fn stress_takes_energy_and_keeps_momentum() {
    let grid = Grid::of(&dam());
    let cells = grid.cells();
    let start = &grid.trace.faces.velocity;
    let sums = |v: &[DVec3]| {
        let mut momentum = DVec3::ZERO;
        let mut energy = 0.0;
        for (cell, v) in cells.iter().zip(v) {
            for axis in (0..3).filter(|&axis| cell.moves[axis]) {
                let mass = if cell.is_whole[axis] { 1.0 } else { 0.5 };
                momentum[axis] += mass * v[axis];
                energy += mass * v[axis] * v[axis];
            }
        }
        (momentum, energy)
    };
    let how = Relaxation::new(2.0, 1.0, 1.0, 1e-10);
    let (before, energy) = sums(start);
    let (after, left) = sums(&grid.solved(&cells, start, &how, how.iterations));
    assert!(left < 0.9 * energy, "{left} {energy}");
    // Free-slip walls absorb normal momentum; along z, where both are at rest, there is none.
    let size = (energy * cells.len() as f64).sqrt();
    assert!((after.z - before.z).abs() < 1e-8 * size, "{before} {after}");
}

/// Between a still lower plate and an upper plate at 1 m/s, one step long enough to forget the
/// start gives the velocities of Couette flow, which the finite differences represent exactly.
#[test]
fn between_moving_plates_it_is_a_couette_flow() {
    let mut scene = scene([8.0, 8.0, 8.0]);
    scene.periodic = [true, false, true];
    scene.no_slip = [2, 3].map(|k| Wall::NAMED[k].1).to_vec();
    scene.water.gravity = DVec3::ZERO;
    scene.shot.frames_per_second = 50.0;
    scene.effects.viscosity = Some(Settings::newtonian(1.0));
    let case = Case {
        scene,
        particles: block([0; 3], [8, 8, 8]),
        ..dam()
    };
    let grid = Grid::of(&case);
    let cells = grid.cells();
    let bricks = &grid.trace.bricks;
    let place = |element: usize| bricks.cell(element as u32);
    // Closed cells above the box are the upper plate.
    let is_above = |element: usize| element >= 512 && place(element)[1] >= 8;
    let start: Vec<DVec3> = (0..cells.len())
        .map(|e| DVec3::X * f64::from(u8::from(is_above(e))))
        .collect();
    assert!(start.contains(&DVec3::X), "the upper plate has faces");
    let how = Relaxation::new(1e4, 1.0, 1.0, 1e-9);
    let found = grid.solved(&cells, &start, &how, how.iterations);
    let mut seen = 0;
    for (element, cell) in cells.iter().enumerate().filter(|(_, cell)| cell.moves[0]) {
        assert!(cell.is_water);
        let y = (f64::from(place(element)[1]) + 0.5) * DX;
        // The remaining pull of the mass term M u* is 1 / κ.
        assert!(
            (found[element].x - y / (8.0 * DX)).abs() < 2e-3,
            "{y} {}",
            found[element]
        );
        seen += 1;
    }
    assert_eq!(seen, 512);
}
