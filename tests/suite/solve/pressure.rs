//! The pressure solver: rows compared with the f64 builder, iteration counts, true residuals,
//! pockets.
mod bodies;
mod precision;
mod stops;

use crate::support::{
    context,
    pressure::{Rig, settings},
};
use swell::{
    domain::{
        bricks::CELLS,
        poisson::{
            AIR, FLUID, NONE, SOLID,
            cases::{Case, Surface, manufactured, tank, tank_rhs, white_noise},
            remove_means,
        },
    },
    gpu::adapter::{Context, InjectedFault},
    reference::poisson::gradients::{Precondition, norm, solve},
    scene::flip::Preconditioner,
    solve::{
        flip::buffers::{DENSITY_EXCESS, FACE_VELOCITY, SOLID_FLUX},
        pressure::buffers::{BLOCK, DIRECTION, RHS},
    },
};

const SURFACES: [Surface; 2] = [Surface::Voxel, Surface::GhostFluid];

fn rig(context: &Context, case: Case, preconditioner: Preconditioner, tolerance: f64) -> Rig {
    Rig::new(context, case, &settings(preconditioner, tolerance))
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[test]
fn rows_are_those_of_the_f64_builder() {
    let context = context();
    for surface in SURFACES {
        for has_cuts in [false, true] {
            // 20 is not a multiple of the brick size: the box cuts bricks.
            let case = tank(20, surface, has_cuts);
            let mut rig = rig(&context, case, Preconditioner::Multigrid, 1e-3);
            rig.solve(&tank_rhs(&rig.case, &rig.system));
            assert_eq!(rig.wrong_rows(&rig.system), 0, "{surface:?} {has_cuts}");

            // Negative control: one face's fraction off by 1e-4 changes its two rows.
            let mut spoiled = rig.case.clone();
            let row = (rig.system.cell.len() / 2..)
                .find(|&row| rig.system.coefficient[row][2] > 0.0)
                .unwrap();
            let face = spoiled.cells().face(rig.system.cell[row], 2);
            assert!(spoiled.open[face] > 0.0);
            spoiled.open[face] *= 0.9999;
            assert!(rig.wrong_rows(&spoiled.system()) >= 1);
        }
    }
}

#[test]
fn right_hand_sides_are_those_of_the_f64_builder() {
    let context = context();
    let case = tank(20, Surface::GhostFluid, true);
    let mut rig = rig(&context, case, Preconditioner::Multigrid, 1e-3);
    let noise = white_noise(4 * rig.case.kind.len());
    let noise: Vec<f32> = noise.iter().map(|&x| x as f32).collect();
    let (flux, velocity) = noise.split_at(rig.case.kind.len());
    rig.program.upload(SOLID_FLUX, 0, flux);
    rig.upload_planes(FACE_VELOCITY, velocity);
    let projected = rig.project(None);
    let expected = rig.system.rhs(rig.case.cells(), velocity, flux);
    let found = rig.by_row(RHS);
    // Seven terms below 1, each product and sum rounded at 6e-8.
    for (found, expected) in found.iter().zip(&expected) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
    let worst = expected
        .iter()
        .fold(0.0, |worst: f64, b| worst.max(b.abs()));
    assert!((projected.divergence_before * rig.case.cell_size / worst - 1.0).abs() < 1e-6);

    // The projection subtracts the gradient: what is left is the residual, as the f64 builder
    // computes it.
    let after = rig
        .system
        .rhs(rig.case.cells(), &rig.planes(FACE_VELOCITY), flux);
    let left = norm(&after) / norm(&expected);
    assert!(
        (left - projected.solved.residual).abs() < 1e-5,
        "{left} {projected:?}"
    );
    assert!(projected.solved.residual < 1e-3);
    let worst = after.iter().fold(0.0, |worst: f64, b| worst.max(b.abs()));
    assert!((projected.divergence_after * rig.case.cell_size - worst).abs() < 1e-5);
}

/// Iterations to 1e-6 on the tank, for voxel and ghost-fluid surface: the table in
/// docs/performance.md, measured with lavapipe. A difference of one is allowed: the residual falls
/// by a few percent per iteration, and a device that rounds differently may pass the target one
/// iteration off. Without a preconditioner, four units of rounding of the right-hand side change
/// the ghost-fluid surface's counts by 4 (168 to 171, 475 to 479). A multigrid whose last level is
/// swept once, not eight times, takes 13 for 9.
const COUNTS: [(Preconditioner, u32, [u32; 2]); 10] = [
    (Preconditioner::None, 16, [88, 168]),
    (Preconditioner::None, 32, [177, 477]),
    (Preconditioner::Jacobi, 16, [84, 84]),
    (Preconditioner::Jacobi, 32, [173, 171]),
    (Preconditioner::Ipp, 16, [45, 44]),
    (Preconditioner::Ipp, 32, [91, 90]),
    (Preconditioner::Ipp, 64, [186, 185]),
    (Preconditioner::Multigrid, 16, [9, 9]),
    (Preconditioner::Multigrid, 32, [10, 10]),
    (Preconditioner::Multigrid, 64, [10, 11]),
];

#[test]
fn iteration_counts_are_those_on_record() {
    let context = context();
    let mut off = Vec::new();
    for (preconditioner, n, counts) in COUNTS {
        for (surface, count) in SURFACES.into_iter().zip(counts) {
            let mut rig = rig(&context, tank(n, surface, false), preconditioner, 1e-6);
            let solved = rig.solve(&tank_rhs(&rig.case, &rig.system));
            assert!(
                !solved.is_missed,
                "{preconditioner:?} {n} {surface:?} {solved:?}"
            );
            let allowed = match preconditioner {
                Preconditioner::None => 4,
                _ => 1,
            };
            if solved.iterations.abs_diff(count) > allowed {
                off.push((preconditioner, n, surface, count, solved.iterations));
            }
        }
    }
    assert!(off.is_empty(), "{off:?}");
    // Negative control: the multigrid's last level is swept once instead of eight times.
    let mut spoiled = context.clone();
    spoiled.spoil = Some(InjectedFault {
        pass: "pressure/solve_coarse",
        from: "const SWEEPS = 8u;",
        to: "const SWEEPS = 1u;",
    });
    let case = tank(16, Surface::Voxel, false);
    let mut rig = rig(&spoiled, case, Preconditioner::Multigrid, 1e-6);
    let solved = rig.solve(&tank_rhs(&rig.case, &rig.system));
    assert!(solved.iterations > 11, "{solved:?}");
}

/// Negative control of the counts: without its coarse levels the same solver takes several times as
/// many iterations.
#[test]
fn the_coarse_levels_do_the_work() {
    let context = context();
    let case = tank(32, Surface::Voxel, false);
    let mut rig = rig(&context, case, Preconditioner::Multigrid, 1e-6);
    rig.solve(&tank_rhs(&rig.case, &rig.system));
    let excess = vec![0.1f32; rig.case.kind.len()];
    rig.program.upload(DENSITY_EXCESS, 0, &excess);
    let whole = rig.solver.correct(&rig.program, None).unwrap();
    // A block without rows is ignored.
    let coarse = rig.case.bricks.levels[1].start as usize;
    let nothing = vec![0u32; 64 * (rig.case.bricks.slots() - coarse)];
    rig.program.upload(BLOCK, 64 * coarse, &nothing);
    let spoiled = rig.solver.correct(&rig.program, None).unwrap();
    assert!(
        !whole.is_missed && spoiled.iterations > 3 * whole.iterations,
        "{whole:?} {spoiled:?}"
    );
}

/// The device takes as many iterations as the f64 solver; rounding costs at most a few percent.
#[test]
fn counts_follow_the_f64_solver() {
    let context = context();
    let kinds = [
        (Preconditioner::None, Precondition::None),
        (Preconditioner::Jacobi, Precondition::Jacobi),
        (Preconditioner::Ipp, Precondition::Ipp),
    ];
    let case = tank(16, Surface::Voxel, true);
    for (preconditioner, oracle) in kinds {
        let mut rig = rig(&context, case.clone(), preconditioner, 1e-6);
        let b = tank_rhs(&case, &rig.system);
        let found = rig.solve(&b);
        let expected = solve(&rig.system, &b, oracle, 1e-6, 1000);
        let ratio = f64::from(found.iterations) / f64::from(expected.iterations);
        assert!(
            (0.95..=1.05).contains(&ratio),
            "{found:?} {}",
            expected.iterations
        );
        let x = rig.solution();
        // ‖x − x₆₄‖ ≤ κ · residual; κ of the tank is about 500.
        assert!(norm(&difference(&x, &expected.x)) < 1e-3 * norm(&expected.x));
    }
}

/// θ → 0 (hard case 11): at most 1.2 times the iterations of the voxel surface.
#[test]
fn surfaces_close_to_cell_centres_cost_nothing() {
    let context = context();
    let mut counts = Vec::new();
    for surface in SURFACES {
        let mut case = tank(24, surface, false);
        for (distance, &kind) in case.distance.iter_mut().zip(&case.kind) {
            if kind == FLUID {
                *distance *= 1e-6;
            }
        }
        let mut rig = rig(&context, case, Preconditioner::Multigrid, 1e-6);
        let solved = rig.solve(&tank_rhs(&rig.case, &rig.system));
        assert!(!solved.is_missed);
        counts.push(f64::from(solved.iterations));
    }
    assert!(counts[1] <= 1.2 * counts[0], "{counts:?}");
}

/// Second order in p (L2): from n = 16 to 64 the error falls as the square of the spacing.
#[test]
fn manufactured_pressure_converges_with_second_order() {
    let context = context();
    let error = |n: u32| {
        let (case, b, q) = manufactured(n);
        let mut rig = rig(&context, case, Preconditioner::Multigrid, 1e-6);
        let solved = rig.solve(&b);
        assert!(!solved.is_missed, "{solved:?}");
        let x = rig.solution();
        norm(&difference(&x, &q)) / norm(&q)
    };
    let errors = [16, 32, 64].map(error);
    let order = (errors[0] / errors[2]).log2() / 2.0;
    assert!(order >= 1.8, "{order} {errors:?}");
    // Negative control: a surface that is off by up to half a cell has an error of first order.
    let (case, b, q) = manufactured(64);
    let case = Case {
        surface: Surface::Voxel,
        ..case
    };
    let mut rig = rig(&context, case, Preconditioner::Multigrid, 1e-6);
    rig.solve(&b);
    let voxel = norm(&difference(&rig.solution(), &q)) / norm(&q);
    assert!(voxel > 5.0 * errors[2], "{voxel} {errors:?}");
}

/// The reported residual is that of the downloaded solution in the f64 system, even at tolerances
/// that a solution in a single f32 word cannot reach.
#[test]
fn the_reported_residual_is_true() {
    let context = context();
    let (case, b, _) = manufactured(64);
    // The right-hand side as the device has it.
    let b: Vec<f64> = b.iter().map(|&b| f64::from(b as f32)).collect();
    for tolerance in [1e-4, 1e-6] {
        let mut rig = rig(&context, case.clone(), Preconditioner::Multigrid, tolerance);
        let solved = rig.solve(&b);
        let residual = |x: &[f64]| {
            let r = difference(&b, &rig.system.apply(x));
            norm(&r) / norm(&b)
        };
        let x = rig.solution();
        // Rows are rounded to f32 (6e-8 each, of fluxes some 10 times b here).
        let truth = residual(&x);
        assert!(
            (truth - solved.residual).abs() < 0.02 * truth + 5e-7,
            "{truth:e} {solved:?}"
        );
        assert!(!solved.is_missed);
        // Negative control: the solution rounded to one word has a residual of about ε ‖A‖ ‖x‖ /
        // ‖b‖.
        let rounded: Vec<f64> = x.iter().map(|&x| f64::from(x as f32)).collect();
        assert!(residual(&rounded) > 1e-5, "{:e}", residual(&rounded));
    }
}

/// Enclosed water in solid: `rooms` are boxes (least and greatest cell) filled completely, in a box
/// of n³ cells, above an open tank of height `tank_height`.
fn pockets(n: u32, rooms: &[[[u32; 3]; 2]], tank_height: u32) -> Case {
    let rooms = rooms.to_vec();
    let is_in = |c: [u32; 3], [a, b]: [[u32; 3]; 2]| (0..3).all(|k| (a[k]..=b[k]).contains(&c[k]));
    let kind = move |c: [u32; 3]| {
        if c[1] < tank_height {
            return if c[1] < tank_height / 2 { FLUID } else { AIR };
        }
        if rooms.iter().any(|&room| is_in(c, room)) {
            FLUID
        } else {
            SOLID
        }
    };
    Case::new([n; 3], 1.0 / f64::from(n), kind, |_, _| 1.0, |_| 0.0)
}

#[test]
fn pockets_converge_and_stay() {
    let context = context();
    let one = [[[2, 2, 2], [20, 21, 19]]];
    let many = [
        [[1, 12, 1], [3, 12, 1]],
        [[5, 12, 1], [6, 13, 2]],
        [[3, 14, 3], [22, 22, 22]],
        [[9, 12, 9], [9, 12, 10]],
    ];
    for (rooms, height, count) in [(&one[..], 0, 1), (&many[..], 10, 4)] {
        let case = Case {
            surface: Surface::Voxel,
            ..pockets(24, rooms, height)
        };
        for preconditioner in [Preconditioner::Multigrid, Preconditioner::Ipp] {
            let mut rig = rig(&context, case.clone(), preconditioner, 1e-6);
            let known = rig.system.pockets();
            assert_eq!(known.len(), count);
            let mut b = tank_rhs(&case, &rig.system);
            remove_means(&mut b, &known);
            rig.set_rhs(&b);
            let projected = rig.project(None);
            assert!(!projected.solved.is_missed, "{projected:?}");
            assert_eq!(projected.pockets, count as u32);
            // The mean that is left after rounding b to f32.
            assert!(
                projected.incompatible < 1e-6 / case.cell_size,
                "{projected:?}"
            );
            assert!(
                preconditioner != Preconditioner::Multigrid || projected.solved.iterations <= 15,
                "{projected:?}"
            );

            // The solution is stable: 40 further iterations do not increase the residual. The
            // recursion drifts from the true residual by the rounding of each step, 6e-8
            // √iterations ‖b‖ times a small factor.
            let mut further = settings(preconditioner, 1e-12);
            further.max_iterations = projected.solved.iterations + 40;
            let solved = Rig::new(&context, case.clone(), &further).solve(&b);
            assert!(solved.is_missed && solved.residual < 1e-6, "{solved:?}");
        }
    }
}

/// A solid that crushes the first pocket: the part that cannot be removed is reported, and the rest
/// is solved.
#[test]
fn incompatible_pockets_are_reported() {
    let context = context();
    let rooms = [[[3, 12, 3], [12, 19, 12]], [[16, 12, 16], [19, 13, 19]]];
    let case = Case {
        surface: Surface::Voxel,
        ..pockets(24, &rooms, 10)
    };
    let mut rig = rig(&context, case, Preconditioner::Multigrid, 1e-6);
    let known = rig.system.pockets();
    let mut b = tank_rhs(&rig.case, &rig.system);
    remove_means(&mut b, &known);
    for &row in &known[0] {
        b[row as usize] += 0.25;
    }
    rig.set_rhs(&b);
    let projected = rig.project(None);
    assert!(!projected.solved.is_missed, "{projected:?}");
    assert_eq!(projected.pockets, 2);
    let mean = projected.incompatible * rig.case.cell_size;
    assert!((mean - 0.25).abs() < 1e-5, "{mean}");
    // The divergence after the projection shows it.
    assert!(
        (projected.divergence_after * rig.case.cell_size - 0.25).abs() < 1e-3,
        "{projected:?}"
    );
}

#[test]
fn no_divergence_takes_no_iteration() {
    let context = context();
    for preconditioner in [Preconditioner::Multigrid, Preconditioner::None] {
        let mut rig = rig(
            &context,
            tank(16, Surface::GhostFluid, true),
            preconditioner,
            1e-6,
        );
        // Solves once before, so that nothing is zero by chance.
        let b = tank_rhs(&rig.case, &rig.system);
        assert!(rig.solve(&b).iterations > 0);
        let solved = rig.solve(&vec![0.0; b.len()]);
        assert_eq!(
            (solved.iterations, solved.residual, solved.is_missed),
            (0, 0.0, false)
        );
        assert!(rig.solution().iter().all(|&x| x == 0.0));
    }
}

/// Drops of one cell, a cell without an open face, an empty box, all in the same arrays.
#[test]
fn pressure_of_odd_cells_converges_while_bricks_change() {
    let context = context();
    let hash = |c: [u32; 3]| (c[0] * 7 + c[1] * 13 + c[2] * 29 + c[0] * c[1] * c[2]) % 11;
    let spray = Case::new(
        [32, 24, 16],
        0.1,
        |c| match c {
            [1, 1, 1] => FLUID,
            [0..=2, 0..=2, 0..=2] => SOLID,
            _ if hash(c) == 0 || c[1] < 4 => FLUID,
            _ => AIR,
        },
        |_, _| 1.0,
        |x| 0.03 * (40.0 * x.x).sin() * (31.0 * x.z).cos() - 0.01,
    );
    let mut rig = rig(&context, spray.clone(), Preconditioner::Multigrid, 1e-6);
    let b = white_noise(rig.system.cell.len());
    assert_eq!(rig.system.dropped.len(), 1);
    let before = rig.solve(&b);
    assert!(before.iterations <= 15 && !before.is_missed, "{before:?}");
    let x = rig.solution();
    assert_eq!(rig.project(None).dropped, 1);

    let empty = Case::new([32, 24, 16], 0.1, |_| AIR, |_, _| 1.0, |_| 1.0);
    let corner = Case::new(
        [32, 24, 16],
        0.1,
        |c| if c[0] < 5 && c[1] < 5 { FLUID } else { AIR },
        |_, _| 1.0,
        |x| x.x.max(x.y) - 0.5,
    );
    for case in [empty, corner, spray] {
        rig.case = case;
        rig.system = rig.case.system();
        rig.upload_case();
        let b = white_noise(rig.system.cell.len());
        let solved = rig.solve(&b);
        assert!(!solved.is_missed && (solved.iterations > 0) != b.is_empty());
    }
    // Data left behind by other bricks changes nothing: the same bytes.
    assert!(rig.solution() == x);
}

#[test]
fn the_same_bytes_twice() {
    let context = context();
    let run = |preconditioner| {
        let case = tank(32, Surface::GhostFluid, true);
        let mut rig = rig(&context, case, preconditioner, 1e-5);
        let b = tank_rhs(&rig.case, &rig.system);
        let first = rig.solve(&b);
        let solution = rig.solution();
        // The first batch of iterations that is submitted has another size in the second solve.
        assert_eq!(rig.solve(&b), first);
        assert!(rig.solution() == solution);
        (first, solution, rig.planes(FACE_VELOCITY))
    };
    for preconditioner in [Preconditioner::Multigrid, Preconditioner::Ipp] {
        assert!(run(preconditioner) == run(preconditioner));
    }
}

/// (Mx, y) = (x, My), (Mx, x) > 0; M x is the first search direction for the residual x.
#[test]
fn preconditioners_are_symmetric_and_positive() {
    let context = context();
    for preconditioner in [
        Preconditioner::Jacobi,
        Preconditioner::Ipp,
        Preconditioner::Multigrid,
    ] {
        let case = tank(32, Surface::GhostFluid, true);
        let mut once = settings(preconditioner, 1e-9);
        once.max_iterations = 1;
        let mut rig = Rig::new(&context, case, &once);
        let rows = rig.system.cell.len();
        let noise = white_noise(2 * rows);
        let (x, y) = noise.split_at(rows);
        let mut image = |b: &[f64]| {
            rig.solve(b);
            rig.by_row(DIRECTION)
        };
        let (mx, my) = (image(x), image(y));
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        // Rounding: some 100 operations at 6e-8 on terms of size ‖Mx‖ ‖y‖, of random sign.
        let scale = norm(&mx) * norm(y);
        let gap = (dot(&mx, y) - dot(x, &my)).abs() / scale;
        assert!(gap < 2e-6, "{preconditioner:?} {gap:e}");
        assert!(dot(&mx, x) > 0.0 && dot(&my, y) > 0.0);
        // Negative control: the value of one cell off by 1 % of ‖Mx‖.
        let mut spoiled = mx.clone();
        spoiled[rows / 2] += 0.01 * norm(&mx);
        let gap = (dot(&spoiled, y) - dot(x, &my)).abs() / scale;
        assert!(gap > 2e-6, "{gap:e}");
    }
}

/// Displacements whose divergence is the excess density, on the projection's system; velocities do
/// not change.
#[test]
fn the_correction_carries_the_excess_out() {
    let context = context();
    let mut rig = rig(
        &context,
        tank(24, Surface::GhostFluid, true),
        Preconditioner::Multigrid,
        1e-5,
    );
    rig.solve(&tank_rhs(&rig.case, &rig.system));
    let velocity = rig.planes(FACE_VELOCITY);
    let mut excess = vec![0.5f32; rig.case.kind.len()];
    for (&element, &value) in rig
        .system
        .cell
        .iter()
        .zip(&white_noise(rig.system.cell.len()))
    {
        excess[element as usize] = 0.1 * value as f32;
    }
    rig.program.upload(DENSITY_EXCESS, 0, &excess);
    let solved = rig.solver.correct(&rig.program, None).unwrap();
    assert!(
        solved.iterations > 0 && solved.residual <= 1e-2,
        "{solved:?}"
    );
    let displacement = rig.displacements();
    let none = vec![0.0; rig.case.kind.len()];
    let carried = rig.system.rhs(rig.case.cells(), &displacement, &none);
    let wanted: Vec<f64> = rig
        .system
        .cell
        .iter()
        .map(|&e| -f64::from(excess[e as usize]) * rig.case.cell_size)
        .collect();
    let left = norm(&difference(&carried, &wanted)) / norm(&wanted);
    assert!((left - solved.residual).abs() < 1e-5, "{left} {solved:?}");
    assert!(rig.planes(FACE_VELOCITY) == velocity);
    for (face, &d) in displacement.iter().enumerate() {
        assert!(d == 0.0 || rig.case.open[face] > 0.0);
    }
}

/// Faces between two cells of air, and closed faces, keep their velocity.
#[test]
fn other_faces_keep_their_velocity() {
    let context = context();
    let mut rig = rig(
        &context,
        tank(16, Surface::GhostFluid, true),
        Preconditioner::Multigrid,
        1e-5,
    );
    let stride = rig.case.kind.len();
    let before: Vec<f32> = white_noise(3 * stride).iter().map(|&x| x as f32).collect();
    rig.upload_planes(FACE_VELOCITY, &before);
    rig.program.upload(SOLID_FLUX, 0, &vec![0.0f32; stride]);
    rig.project(None);
    let after = rig.planes(FACE_VELOCITY);
    let cells = rig.case.cells();
    let mut changed = 0;
    for element in CELLS..CELLS * (rig.case.bricks.active + 1) {
        for axis in 0..3 {
            let face = axis * stride + element as usize;
            let kinds =
                [element, cells.neighbor(element, 2 * axis)].map(|e| rig.case.kind[e as usize]);
            let is_open =
                rig.case.open[face] > 0.0 && kinds.contains(&FLUID) && !kinds.contains(&SOLID);
            assert!(is_open || before[face] == after[face]);
            changed += usize::from(before[face] != after[face]);
        }
    }
    assert!(changed > 5000);
    assert!(rig.system.neighbor.iter().flatten().any(|&j| j == NONE));
}
