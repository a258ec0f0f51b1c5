//! The projection: its passes, and the device's own system solved directly.

use glam::DVec3;

use super::{Checker, Layout, fields::*, pair, pair_of};
use crate::{
    compare::{
        check::Pair,
        deviation::relative,
        rounding::{U, U64},
    },
    domain::{
        bricks::{Bricks, CELLS},
        poisson::{NONE, System, remove_means},
    },
    gpu::recording::Moment,
    reference::{
        flip::{Centers, Room, Waters, density_source},
        poisson::{BUDGET, Solver, gradients::norm},
    },
    scene::flip::{Precision, Preconditioner, Surface},
    solve::{
        SolveError,
        pressure::{CORRECTION_TOLERANCE, DONE, blocked},
        trace::Traced,
    },
};

/// Runs of an iteration's pass that are compared: each is as good as any.
pub(super) const PRODUCTS: usize = 3;

/// Inverse iterations for the least eigenvalue.
const EIGEN_STEPS: usize = 8;

/// The device's own system.
pub(super) struct Built {
    pub(super) system: System,
    centers: Centers,
}

/// Σ |f u| and the solids' flux of each row.
fn flow(bricks: &Bricks, room: &Room, system: &System, velocity: &[DVec3]) -> Vec<f64> {
    let of_row = |&element: &u32| {
        let through = |e: u32, axis: usize| {
            let e = e as usize;
            (room.open[e][axis] * velocity[e][axis]).abs()
        };
        let sum: f64 = (0..3)
            .map(|axis| {
                let mut up = [0; 3];
                up[axis] = 1;
                through(element, axis) + through(bricks.near(element, up), axis)
            })
            .sum();
        sum + room.solid_flux[element as usize].abs()
    };
    system.cell.iter().map(of_row).collect()
}

/// Σ c |x − x'| and what air takes, of each row.
pub(super) fn differences(system: &System, x: &[f64]) -> Vec<f64> {
    (0..x.len())
        .map(|i| {
            let shared = system.neighbor[i].iter().zip(&system.coefficient[i]);
            let inner: f64 = shared
                .filter(|(j, _)| **j != NONE)
                .map(|(&j, c)| c * (x[i] - x[j as usize]).abs())
                .sum();
            inner + system.dirichlet[i] * x[i].abs()
        })
        .collect()
}

/// Of the solution's terms.
fn sum(terms: &[Vec<f64>]) -> Vec<f64> {
    let all = |row: usize| terms.iter().map(|term| term[row]).sum();
    (0..terms[0].len()).map(all).collect()
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Checker<'_> {
    pub(super) fn pressure(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        self.iterate(traced)?;
        match (traced.moment, traced.pass) {
            (Moment::After, "pressure/build_system") => self.build_system(traced),
            (Moment::After, "pressure/divergence") => self.divergence(traced),
            (Moment::After, "pressure/multiply") => self.multiply(traced),
            (Moment::After, "pressure/density_source") => self.density_source(traced),
            (Moment::Before, "pressure/project" | "pressure/displace") => {
                self.is_done = traced.pressure_control(self.precision())?.state == DONE;
                self.old = self.planes(traced, "face_velocity")?;
                Ok(())
            }
            (Moment::After, "pressure/project") if self.is_done => self.project(traced),
            (Moment::After, "pressure/measure_divergence") if self.is_done => self.after(traced),
            (Moment::After, "pressure/displace") if self.is_done => self.displace(traced),
            _ => Ok(()),
        }
    }

    fn waters<'b>(&'b self, built: &'b Built) -> Waters<'b> {
        let Layout { bricks, .. } = self.layout();
        Waters::new(&self.model, bricks, self.room(), &built.centers)
    }

    pub(super) fn built(&self) -> &Built {
        self.system.as_ref().expect("after pressure/build_system")
    }

    pub(super) fn precision(&self) -> Precision {
        self.model.settings().pressure.precision
    }

    /// Unit roundoff of what the projection computes in.
    pub(super) fn unit(&self) -> f64 {
        match self.precision() {
            Precision::F32 | Precision::F32Refined => U,
            Precision::F64 => U64,
        }
    }

    /// The first `count` values of an array of the pressure's own, in the precision that it is kept in.
    pub(super) fn reals(
        &self,
        traced: Traced<'_>,
        name: &str,
        count: usize,
    ) -> Result<Vec<f64>, SolveError> {
        traced.reals(&name.into(), self.precision(), count)
    }

    /// An array of the pressure's own, by row.
    pub(super) fn by_row(&self, traced: Traced<'_>, name: &str) -> Result<Vec<f64>, SolveError> {
        let values = self.reals(traced, name, self.layout().cells)?;
        let rows = self.built().system.cell.iter();
        Ok(rows.map(|&e| values[blocked(e)]).collect())
    }

    /// The terms that the solution is the sum of, by row.
    pub(super) fn terms(&self, traced: Traced<'_>) -> Result<Vec<Vec<f64>>, SolveError> {
        let Layout { cells, stride, .. } = *self.layout();
        let last = stride * (self.precision().terms() - 1);
        let values = self.reals(traced, "pressure_solution", last + cells)?;
        let term = |k: usize| {
            let rows = self.built().system.cell.iter();
            rows.map(|&e| values[k * stride + blocked(e)]).collect()
        };
        Ok((0..self.precision().terms()).map(term).collect())
    }

    /// What differences of the solution across faces err by: those of its terms, which may cancel.
    fn difference_errors(&self, terms: &[Vec<f64>]) -> Vec<f64> {
        let built = self.built();
        let waters = self.waters(built);
        let mut errors = vec![0.0; self.layout().cells];
        for term in terms {
            let differences = waters.displace(&waters.by_element(&built.system, term));
            for (error, difference) in errors.iter_mut().zip(&differences) {
                *error += 24.0 * self.unit() * difference.length();
            }
        }
        errors
    }

    fn build_system(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let settings = self.model.settings();
        let centers = Centers {
            density: Vec::new(),
            excess: match settings.density_correction {
                true => self.scalars(traced, "density_excess")?,
                false => Vec::new(),
            },
            distance: match settings.surface {
                Surface::GhostFluid => self.scalars(traced, "liquid_distance")?,
                Surface::Voxel => Vec::new(),
            },
        };
        let Layout {
            bricks,
            cells,
            stride,
            ..
        } = self.layout();
        let system = Waters::new(&self.model, bricks, self.room(), &centers).system();
        let dirichlet = self.reals(traced, "pressure_dirichlet", *cells)?;
        let coefficient = traced.read::<f32>("pressure_coefficient", 2 * stride + cells)?;
        let block = traced.read::<u32>("pressure_block", cells / 8)?;
        let wet = CELLS..CELLS * (bricks.wet + 1);
        let mut row_of = vec![NONE; *cells];
        for (row, &element) in system.cell.iter().enumerate() {
            row_of[element as usize] = row as u32;
        }
        let inverse = match settings.pressure.preconditioner {
            Preconditioner::Jacobi | Preconditioner::Ipp => {
                self.reals(traced, "pressure_inverse_diagonal", *cells)?
            }
            Preconditioner::None | Preconditioner::Multigrid => Vec::new(),
        };
        let (mut airs, mut shared, mut inverses) = (Vec::new(), Vec::new(), Vec::new());
        let (mut rows, mut expected) = (Vec::new(), Vec::new());
        for element in wet {
            let e = element as usize;
            let place = blocked(element);
            let of_block = place / 512 * 64 + place % 64;
            rows.push(block[of_block] >> (8 + place % 512 / 64) & 1);
            expected.push(u32::from(row_of[e] != NONE));
            if row_of[e] == NONE {
                continue;
            }
            let row = row_of[e] as usize;
            let exact = system.dirichlet[row];
            airs.push(pair_of(
                e,
                dirichlet[place],
                exact,
                24.0 * self.unit() * exact,
            ));
            if let Some(&found) = inverse.get(place) {
                let exact = 1.0 / system.diagonal[row];
                inverses.push(pair_of(e, found, exact, 36.0 * self.unit() * exact));
            }
            let lower = |values: &dyn Fn(usize) -> f64| DVec3::new(values(0), values(1), values(2));
            let found = lower(&|axis| f64::from(coefficient[axis * stride + place]));
            let twin = lower(&|axis| system.coefficient[row][2 * axis]);
            shared.push(pair(e, found, twin, 0.0));
        }
        self.table.add(&DIRICHLET, &airs, 0);
        self.table.add(&COEFFICIENT, &shared, 0);
        self.table.add_exact(&ROWS, &rows, &expected);
        if !inverse.is_empty() {
            self.table.add(&INVERSE, &inverses, 0);
        }
        self.system = Some(Built { system, centers });
        Ok(())
    }

    /// The largest divergence that the device noted, against `rows`.
    fn noted(&self, found: f32, rows: &[f64], flow: &[f64]) -> Pair<f64> {
        let size = self.model.cell_size();
        let largest = |of: &[f64]| of.iter().fold(0.0, |most: f64, v| most.max(v.abs())) / size;
        let tolerance = 10.0 * U * largest(flow) + 4.0 * U * largest(rows);
        pair_of(0, f64::from(found), largest(rows), tolerance)
    }

    fn divergence(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let velocity = self.planes(traced, "face_velocity")?;
        let built = self.built();
        let twin = self.waters(built).divergence(&built.system, &velocity);
        let flow = flow(&self.layout().bricks, self.room(), &built.system, &velocity);
        let rhs = self.by_row(traced, "pressure_rhs")?;
        let pairs: Vec<_> = (0..rhs.len())
            .map(|row| {
                let element = built.system.cell[row] as usize;
                pair_of(element, rhs[row], twin[row], 10.0 * self.unit() * flow[row])
            })
            .collect();
        let noted = self.noted(traced.pressure_stats()?.divergence_before, &twin, &flow);
        self.table.add(&RHS, &pairs, 0);
        self.table.add(&BEFORE, &[noted], 0);
        Ok(())
    }

    fn multiply(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        if self.products == PRODUCTS {
            return Ok(());
        }
        let direction = self.by_row(traced, "pressure_direction")?;
        if direction.iter().all(|&value| value == 0.0) {
            return Ok(());
        }
        let product = self.by_row(traced, "pressure_product")?;
        let system = &self.built().system;
        let (twin, errors) = (system.apply(&direction), differences(system, &direction));
        let pairs: Vec<_> = (0..twin.len())
            .map(|row| {
                let tolerance = 12.0 * self.unit() * errors[row];
                pair_of(
                    system.cell[row] as usize,
                    product[row],
                    twin[row],
                    tolerance,
                )
            })
            .collect();
        self.table.add(&PRODUCT, &pairs, 0);
        self.products += 1;
        Ok(())
    }

    fn project(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let terms = self.terms(traced)?;
        let errors = self.difference_errors(&terms);
        let x = sum(&terms);
        let built = self.built();
        let waters = self.waters(built);
        let mut twin = self.old.clone();
        waters.project(&waters.by_element(&built.system, &x), &mut twin);
        let velocity = self.planes(traced, "face_velocity")?;
        let pairs: Vec<_> = (self.active())
            .map(|e| {
                let tolerance = errors[e] + 2.0 * U * twin[e].length();
                pair(e, velocity[e], twin[e], tolerance)
            })
            .collect();
        let pressure = self.scalars(traced, "pressure")?;
        let scale =
            self.scene.water.rest_density * self.model.cell_size() / self.layout().substep.length;
        let pascals: Vec<_> = (built.system.cell.iter().zip(&x))
            .map(|(&e, x)| {
                let exact = scale * x;
                pair_of(
                    e as usize,
                    pressure[e as usize],
                    exact,
                    4.0 * U * exact.abs(),
                )
            })
            .collect();
        self.table.add(&PROJECTED, &pairs, 0);
        self.table.add(&PRESSURE, &pascals, 0);
        self.whole(traced, x, &velocity)
    }

    /// The device's own system solved directly, against what its iterations came to.
    fn whole(
        &mut self,
        traced: Traced<'_>,
        mut x: Vec<f64>,
        velocity: &[DVec3],
    ) -> Result<(), SolveError> {
        let mut b = self.by_row(traced, "pressure_rhs")?;
        let built = self.built();
        let system = &built.system;
        let solver = match Solver::new(system, BUDGET) {
            Ok(solver) => solver,
            Err(_) => {
                let why = "the direct factor of its system could not be made";
                self.table.unchecked.push(("whole projection", why));
                return Ok(());
            }
        };
        remove_means(&mut b, solver.pockets());
        remove_means(&mut x, solver.pockets());
        let exact = solver.solve(&b).x;
        let size = norm(&b);
        let spread = norm(&differences(system, &x));
        let residual = relative(norm(&minus(&b, &system.apply(&x))), size);
        let asked = self.model.settings().pressure.tolerance;
        let allowed = asked * (1.0 + 1e-6) + relative(12.0 * self.unit() * spread, size);
        let off = minus(&x, &exact);
        let least = least_eigenvalue(&solver, b.len());
        let energy = dot(&off, &system.apply(&off)).max(0.0).sqrt();
        let mut after = self.waters(built).divergence(system, velocity);
        remove_means(&mut after, solver.pockets());
        let flow = norm(&flow(&self.layout().bricks, self.room(), system, velocity));
        let rounding = relative(30.0 * U * (flow + spread), size);
        let far = 1.5 * allowed * size;
        let apart = relative(norm(&off), norm(&exact));
        let may_part = relative(far / least, norm(&exact));
        let left = relative(norm(&after), size);
        self.table
            .add(&RESIDUAL, &[pair_of(0, residual, 0.0, allowed)], 0);
        self.table
            .add(&SOLUTION, &[pair_of(0, apart, 0.0, may_part)], 0);
        let of_energy = pair_of(0, energy, 0.0, far / least.sqrt());
        self.table.add(&ENERGY, &[of_energy], 0);
        let of_divergence = pair_of(0, left, 0.0, allowed + rounding);
        self.table.add(&DIVERGENCE, &[of_divergence], 0);
        Ok(())
    }

    fn after(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let velocity = self.planes(traced, "face_velocity")?;
        let built = self.built();
        let twin = self.waters(built).divergence(&built.system, &velocity);
        let flow = flow(&self.layout().bricks, self.room(), &built.system, &velocity);
        let noted = self.noted(traced.pressure_stats()?.divergence_after, &twin, &flow);
        self.table.add(&AFTER, &[noted], 0);
        self.is_done = false;
        Ok(())
    }

    fn density_source(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let rhs = self.by_row(traced, "pressure_rhs")?;
        let built = self.built();
        let twin = density_source(&self.model, &built.system, &built.centers);
        let pairs: Vec<_> = (0..rhs.len())
            .map(|row| {
                let element = built.system.cell[row] as usize;
                pair_of(element, rhs[row], twin[row], 2.0 * U * twin[row].abs())
            })
            .collect();
        self.table.add(&SOURCE, &pairs, 0);
        Ok(())
    }

    fn displace(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let terms = self.terms(traced)?;
        let errors = self.difference_errors(&terms);
        let x = sum(&terms);
        let mut b = self.by_row(traced, "pressure_rhs")?;
        let built = self.built();
        let system = &built.system;
        let waters = self.waters(built);
        let twin = waters.displace(&waters.by_element(system, &x));
        let found = self.planes(traced, "face_displacement")?;
        let pairs: Vec<_> = (self.active())
            .map(|e| pair(e, found[e], twin[e], errors[e] + U * twin[e].length()))
            .collect();
        remove_means(&mut b, &system.pockets());
        let size = norm(&b);
        let residual = relative(norm(&minus(&b, &system.apply(&x))), size);
        let spread = norm(&differences(system, &x));
        let allowed =
            CORRECTION_TOLERANCE * (1.0 + 1e-6) + relative(12.0 * self.unit() * spread, size);
        self.table.add(&DISPLACEMENT, &pairs, 0);
        self.table
            .add(&CORRECTION, &[pair_of(0, residual, 0.0, allowed)], 0);
        self.is_done = false;
        Ok(())
    }
}

/// By inverse iterations from a vector of hashed signs; what a few of them reach is at most a few percent above it.
fn least_eigenvalue(solver: &Solver<'_>, rows: usize) -> f64 {
    let sign = |k: usize| {
        let hash = (k as u32 + 1).wrapping_mul(0x9e37_79b9) >> 31;
        1.0 + f64::from(hash)
    };
    let mut y: Vec<f64> = (0..rows).map(sign).collect();
    let mut eigenvalue = f64::INFINITY;
    for _ in 0..EIGEN_STEPS {
        let size = norm(&y);
        for value in &mut y {
            *value /= size;
        }
        y = solver.solve(&y).x;
        eigenvalue = 1.0 / norm(&y);
    }
    eigenvalue
}
