//! The projection: its system, its inputs and outputs, and a direct solve of the device's own
//! system.

use glam::DVec3;

use crate::{
    comparison::{Comparison, Io, NONE, PassResult, TracedBuffers, comparison, names},
    table::{CheckEntry, CheckTable, pair},
};
use swell_compare::{
    deviation::relative,
    rounding::{U, U64},
};
use swell_domain::poisson::{AIR, System, remove_means};
use swell_gpu::buffer::Buf;
use swell_reference::{
    flip::{Centers, Waters, density_source as reference_density_source},
    poisson::{
        BUDGET, Solver,
        gradients::norm,
        iteration::{differences, least_eigenvalue, products},
    },
};
use swell_scene::flip::{Precision, Preconditioner, Surface};
use swell_solve::{
    SolveError,
    flip::buffers,
    pressure::{
        CORRECTION_TOLERANCE, DONE, Round, blocked,
        buffers::{self as solved, Real},
    },
};

use super::{Elements, FlipState, iteration::SQUARE, rows::*};

/// Comparisons of the passes before and after the iteration.
pub(super) const COMPARISONS: &[Comparison<FlipState>] = &[
    comparison("pressure/build_system", NONE, build_system),
    comparison("pressure/divergence", NONE, divergence),
    comparison("pressure/density_source", NONE, density_source),
    Comparison {
        is_due: FlipState::is_done,
        ..comparison(
            "pressure/project",
            || names![buffers::FACE_VELOCITY, solved::PRESSURE],
            project,
        )
    },
    Comparison {
        is_due: FlipState::is_done,
        ..comparison("pressure/measure_divergence", NONE, measure_divergence)
    },
    Comparison {
        is_due: FlipState::is_done,
        ..comparison("pressure/displace", NONE, displace)
    },
];

/// The device's own system.
pub(super) struct Assembled {
    pub(super) system: System,
    centers: Centers,
    /// Centres whose surface never lies beyond an air cell's centre: where θ exceeds 1, 1/θ has the
    /// rounding error of 1.
    near: Centers,
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Returns the sum of the solution's `terms`.
fn sum(terms: &[Vec<f64>]) -> Vec<f64> {
    let all = |row: usize| terms.iter().map(|term| term[row]).sum();
    (0..terms[0].len()).map(all).collect()
}

impl FlipState {
    fn assembled(&self) -> &Assembled {
        self.assembled
            .as_ref()
            .expect("after pressure/build_system")
    }

    pub(super) fn system(&self) -> &System {
        &self.assembled().system
    }

    /// Returns the device's own system with the bodies that its pressure moves.
    pub(super) fn coupled_system(&self) -> System {
        let system = self.system();
        System {
            bodies: self.touched.couplings(&system.cell, self.elements().cells),
            ..system.clone()
        }
    }

    fn waters(&self) -> Waters<'_> {
        let centers = &self.assembled().centers;
        Waters::new(&self.model, &self.elements().bricks, self.space(), centers)
            .with_contraction(&self.contraction)
    }

    pub(super) fn precision(&self) -> Precision {
        self.model.settings().pressure.precision
    }

    /// Returns the unit roundoff of the projection's precision.
    pub(super) fn unit(&self) -> f64 {
        match self.precision() {
            Precision::F32 | Precision::F32Refined => U,
            Precision::F64 => U64,
        }
    }

    /// Returns whether the solve had ended before the pass.
    fn is_done(&mut self, io: &Io<'_>) -> Result<bool, SolveError> {
        Ok(io.before.control(self.precision())?.state == DONE)
    }

    fn rows_of(&self, values: &[f64]) -> Vec<f64> {
        let rows = self.system().cell.iter();
        rows.map(|&e| values[blocked(e)]).collect()
    }

    /// Reads an array of the projection, by row.
    pub(super) fn by_row(
        &self,
        view: &TracedBuffers<'_>,
        buffer: Buf<Real>,
    ) -> Result<Vec<f64>, SolveError> {
        self.by_row_of(view, buffer, 0)
    }

    /// Reads one of the arrays that a buffer of the projection holds, by row.
    pub(super) fn by_row_of(
        &self,
        view: &TracedBuffers<'_>,
        buffer: Buf<Real>,
        array: usize,
    ) -> Result<Vec<f64>, SolveError> {
        let Elements { cells, stride, .. } = *self.elements();
        let values = view.reals(&buffer, self.precision(), array * stride + cells)?;
        Ok(self.rows_of(&values[array * stride..]))
    }

    /// Reads the terms whose sum is the solution, by row.
    pub(super) fn terms(&self, view: &TracedBuffers<'_>) -> Result<Vec<Vec<f64>>, SolveError> {
        let Elements { cells, stride, .. } = *self.elements();
        let (precision, terms) = (self.precision(), self.precision().terms());
        let values = view.reals(&solved::SOLUTION, precision, stride * (terms - 1) + cells)?;
        let term = |k: usize| self.rows_of(&values[k * stride..]);
        Ok((0..terms).map(term).collect())
    }

    /// Returns [`OF_DIFFERENCE`] of all terms, by element.
    fn difference_errors(&self, terms: &[Vec<f64>]) -> Vec<f64> {
        let near = &self.assembled().near;
        let waters = Waters::new(&self.model, &self.elements().bricks, self.space(), near);
        let mut errors = vec![0.0; self.elements().cells];
        for term in terms {
            let differences = waters.displace(&waters.by_element(self.system(), term));
            for (error, difference) in errors.iter_mut().zip(&differences) {
                *error += OF_DIFFERENCE.of([self.unit(), difference.length()]);
            }
        }
        errors
    }

    /// Returns Σ |f u| plus the magnitudes of the solids' flux and of that of contraction for each
    /// row.
    fn flow(&self, velocity: &[DVec3]) -> Vec<f64> {
        let (bricks, space) = (&self.elements().bricks, self.space());
        let of_row = |&element: &u32| {
            let through = |e: u32, axis: usize| {
                let e = e as usize;
                (space.open[e][axis] * velocity[e][axis]).abs()
            };
            let sum: f64 = (0..3)
                .map(|axis| {
                    let mut up = [0; 3];
                    up[axis] = 1;
                    through(element, axis) + through(bricks.near(element, up), axis)
                })
                .sum();
            let made_up = self.contraction.get(element as usize).unwrap_or(&0.0);
            sum + space.solid_flux[element as usize].abs() + made_up.abs()
        };
        self.system().cell.iter().map(of_row).collect()
    }

    /// Adds one value per row to the table.
    pub(super) fn add_rows<const N: usize>(
        &self,
        table: &mut CheckTable,
        entry: &'static CheckEntry<N>,
        one: impl Fn(usize) -> (f64, f64, [f64; N]) + Send + Sync,
    ) {
        let cells = &self.system().cell;
        table.each(entry, 0..cells.len(), |row| {
            let (value, exact, magnitudes) = one(row);
            pair(cells[row] as usize, value, exact, magnitudes)
        });
    }

    /// Compares the largest divergence that the device recorded with that of `rows`.
    fn add_noted(
        &self,
        table: &mut CheckTable,
        entry: &'static CheckEntry<2>,
        found: f32,
        [rows, flow]: [&[f64]; 2],
    ) {
        let size = self.model.cell_size();
        let largest = |of: &[f64]| of.iter().fold(0.0, |most: f64, v| most.max(v.abs())) / size;
        let most = largest(rows);
        table.add(entry, [pair(0, found, most, [largest(flow), most])]);
    }

    /// Returns ‖b − A x‖ / ‖b‖, and [`ALLOWED`] for a requested tolerance `asked`.
    fn residual(&self, system: &System, b: &[f64], x: &[f64], asked: f64) -> [f64; 2] {
        let size = norm(b);
        let residual = relative(norm(&minus(b, &system.apply(x))), size);
        let spread = norm(&differences(system, x));
        [residual, ALLOWED.of([asked, self.unit(), spread, size])]
    }
}

fn build_system(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let settings = state.model.settings();
    let elements = state.elements();
    let cells = elements.cells;
    let centers = Centers {
        density: Vec::new(),
        excess: match settings.density_correction {
            true => elements.scalars(&io.after, buffers::DENSITY_EXCESS)?,
            false => Vec::new(),
        },
        distance: match settings.surface {
            Surface::GhostFluid => elements.scalars(&io.after, buffers::LIQUID_DISTANCE)?,
            Surface::Voxel => Vec::new(),
        },
    };
    let has_diagonal = matches!(
        settings.pressure.preconditioner,
        Preconditioner::Jacobi | Preconditioner::Ipp
    );
    let kinds = &state.space().kind;
    let outside = centers.distance.iter().zip(kinds);
    let near = Centers {
        distance: outside
            .map(|(distance, kind)| match *kind {
                AIR => distance.max(0.0),
                _ => *distance,
            })
            .collect(),
        ..centers.clone()
    };
    let system_of =
        |centers| Waters::new(&state.model, &elements.bricks, state.space(), centers).system();
    let (system, sizes) = (system_of(&centers), system_of(&near).dirichlet);
    let coefficient = io
        .after
        .get(solved::COEFFICIENT, 2 * elements.stride + cells)?;
    let block = io.after.get(solved::BLOCK, cells / 8)?;
    let (stride, wet) = (elements.stride, elements.wet());
    let is_row = |e: usize| {
        let place = blocked(e as u32);
        block[place / 512 * 64 + place % 64] >> (8 + place % 512 / 64) & 1
    };
    let mut expected = vec![0; wet.len()];
    for &element in &system.cell {
        expected[element as usize - wet.start] = 1;
    }
    state.assembled = Some(Assembled {
        system,
        centers,
        near,
    });
    let (system, unit) = (state.system(), state.unit());
    let dirichlet = state.by_row(&io.after, solved::DIRICHLET)?;
    state.add_rows(io.table, &DIRICHLET, |row| {
        let exact = system.dirichlet[row];
        (dirichlet[row], exact, [unit, sizes[row]])
    });
    io.table.each(&COEFFICIENT, 0..system.cell.len(), |row| {
        let element = system.cell[row];
        let found = |axis: usize| f64::from(coefficient[axis * stride + blocked(element)]);
        let reference = |axis: usize| system.coefficient[row][2 * axis];
        let [found, reference] = [
            DVec3::new(found(0), found(1), found(2)),
            DVec3::new(reference(0), reference(1), reference(2)),
        ];
        pair(element as usize, found, reference, [])
    });
    io.table
        .add_exact(&ROWS, &wet.map(is_row).collect::<Vec<_>>(), &expected);
    if has_diagonal {
        let inverse = state.by_row(&io.after, solved::INVERSE_DIAGONAL)?;
        state.add_rows(io.table, &INVERSE, |row| {
            let exact = 1.0 / system.diagonal[row];
            let air = sizes[row] - system.dirichlet[row];
            (inverse[row], exact, [unit, exact + air * exact * exact])
        });
    }
    Ok(())
}

fn divergence(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    state.note_sum(io, SQUARE, [solved::RHS; 2])?;
    let velocity = state
        .elements()
        .planes(&io.before, buffers::FACE_VELOCITY)?;
    let reference = state.waters().divergence(state.system(), &velocity);
    let flow = state.flow(&velocity);
    let (rhs, unit) = (state.by_row(&io.after, solved::RHS)?, state.unit());
    state.add_rows(io.table, &RHS, |row| {
        (rhs[row], reference[row], [unit, flow[row]])
    });
    let found = io.after.one(solved::STATS)?.divergence_before;
    state.add_noted(io.table, &BEFORE, found, [&reference, &flow]);
    Ok(())
}

fn density_source(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    state.note_sum(io, SQUARE, [solved::RHS; 2])?;
    let rhs = state.by_row(&io.after, solved::RHS)?;
    let centers = &state.assembled().centers;
    let reference = reference_density_source(&state.model, state.system(), centers);
    state.add_rows(io.table, &SOURCE, |row| {
        (rhs[row], reference[row], [reference[row].abs()])
    });
    Ok(())
}

fn project(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let terms = state.terms(&io.after)?;
    let (errors, x) = (state.difference_errors(&terms), sum(&terms));
    let waters = state.waters();
    let mut reference = elements.planes(&io.before, buffers::FACE_VELOCITY)?;
    waters.project(&waters.by_element(state.system(), &x), &mut reference);
    let velocity = elements.planes(&io.after, buffers::FACE_VELOCITY)?;
    io.table.each(&PROJECTED, elements.active(), |e| {
        pair(
            e,
            velocity[e],
            reference[e],
            [errors[e], reference[e].length()],
        )
    });
    let pressure = elements.scalars(&io.after, solved::PRESSURE)?;
    let earlier = match io.before.window(&solved::PHASES)?.step == Round::AfterContacts as u32 {
        true => elements.scalars(&io.before, solved::PRESSURE)?,
        false => vec![0.0; pressure.len()],
    };
    let scale = state.scene.water.rest_density * state.model.cell_size() / elements.substep.kick;
    state.add_rows(io.table, &PRESSURE, |row| {
        let element = state.system().cell[row] as usize;
        let exact = earlier[element] + scale * x[row];
        (
            pressure[element],
            exact,
            [exact.abs() + earlier[element].abs()],
        )
    });
    whole(state, x, &velocity, io)
}

/// Solves the device's own system directly and compares the result with that of the iteration.
fn whole(state: &FlipState, mut x: Vec<f64>, velocity: &[DVec3], io: &mut Io<'_>) -> PassResult {
    let mut b = state.by_row(&io.after, solved::RHS)?;
    let coupled = state.coupled_system();
    let system = &coupled;
    let solver = match Solver::new(system, BUDGET) {
        Ok(solver) => solver,
        Err(_) => {
            let why = "the direct factor of its system could not be made";
            io.table.unchecked.push(("whole projection", why));
            return Ok(());
        }
    };
    remove_means(&mut b, solver.pockets());
    remove_means(&mut x, solver.pockets());
    let exact = solver.solve(&b).x;
    let size = norm(&b);
    let asked = state.model.settings().pressure.tolerance;
    let [residual, allowed] = state.residual(system, &b, &x, asked);
    let off = minus(&x, &exact);
    let least = least_eigenvalue(&solver, b.len());
    // Also covers NaN, the result without any rows.
    if least.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
        let why = "nothing to solve: only drops, or water that no air touches in one cell";
        io.table.unchecked.push(("whole projection", why));
        return Ok(());
    }
    let energy = products(&off, &system.apply(&off)).value.max(0.0).sqrt();
    let mut after = state.waters().divergence(system, velocity);
    remove_means(&mut after, solver.pockets());
    let (flow, spread) = (norm(&state.flow(velocity)), norm(&differences(system, &x)));
    let far = FAR.of([allowed, size]);
    let apart = relative(norm(&off), norm(&exact));
    let left = relative(norm(&after), size);
    io.table.add(&RESIDUAL, [pair(0, residual, 0.0, [allowed])]);
    io.table
        .add(&SOLUTION, [pair(0, apart, 0.0, [far, least, norm(&exact)])]);
    io.table.add(&ENERGY, [pair(0, energy, 0.0, [far, least])]);
    io.table.add(
        &DIVERGENCE,
        [pair(0, left, 0.0, [allowed, flow, spread, size])],
    );
    Ok(())
}

fn measure_divergence(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let velocity = state
        .elements()
        .planes(&io.before, buffers::FACE_VELOCITY)?;
    let reference = state.waters().divergence(state.system(), &velocity);
    let found = io.after.one(solved::STATS)?.divergence_after;
    state.add_noted(
        io.table,
        &AFTER,
        found,
        [&reference, &state.flow(&velocity)],
    );
    Ok(())
}

fn displace(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let terms = state.terms(&io.after)?;
    let (errors, x) = (state.difference_errors(&terms), sum(&terms));
    let waters = state.waters();
    let reference = waters.displace(&waters.by_element(state.system(), &x));
    let elements = state.elements();
    let found = elements.planes(&io.after, buffers::face_displacement(elements.stride))?;
    io.table.each(&DISPLACEMENT, elements.active(), |e| {
        pair(
            e,
            found[e],
            reference[e],
            [errors[e], reference[e].length()],
        )
    });
    let mut b = state.by_row(&io.after, solved::RHS)?;
    remove_means(&mut b, &state.system().pockets());
    let [residual, allowed] = state.residual(state.system(), &b, &x, CORRECTION_TOLERANCE);
    io.table
        .add(&CORRECTION, [pair(0, residual, 0.0, [allowed])]);
    Ok(())
}
