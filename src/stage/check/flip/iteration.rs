//! The iteration of a solve: preconditioners, direction, step and scalars; bodies of water that no air touches.

use std::collections::BTreeMap;

use super::{
    Checker,
    fields::*,
    pair_of,
    pressure::{PRODUCTS, differences},
};
use crate::{
    compare::check::{Field, Pair},
    domain::{
        bricks::CELLS,
        poisson::{NONE, System, remove_means},
    },
    gpu::recording::Moment,
    scene::flip::Preconditioner,
    solve::{
        SolveError,
        pressure::{
            DONE, ITERATING, PressureControl64, PressurePhase, VERIFYING, WANTS_POCKETS, blocked,
        },
        trace::Traced,
    },
};

/// Steps of `pressure/reduce`, as in the shader.
const BEGIN: u32 = 0;
const DIRECTION: u32 = 1;
const LENGTH: u32 = 2;
const CHECK: u32 = 3;
const VERIFIED: u32 = 4;
const MOST_RESTARTS: u32 = 16;

/// Passes of the multigrid.
const MULTIGRID: [&str; 6] = [
    "pressure/coarsen",
    "pressure/smooth_first",
    "pressure/smooth",
    "pressure/smooth_corrected",
    "pressure/restrict",
    "pressure/solve_coarse",
];

/// What a pass had before it ran.
#[derive(Default)]
pub(super) struct Iteration {
    control: PressureControl64,
    /// The pass before.
    last: &'static str,
    now: &'static str,
    /// How often each pass was met on each level.
    runs: BTreeMap<(&'static str, u32), usize>,
    direction: Vec<f64>,
    /// Of the solution.
    terms: Vec<Vec<f64>>,
    values: Vec<f64>,
    /// What the bricks' sums of the latest pass that made any come to, and the sum of the terms' magnitudes.
    sum: Option<[f64; 2]>,
}

impl Iteration {
    /// Counts a run of a pass on a level; true for the first few.
    pub(super) fn is_due(&mut self, key: (&'static str, u32)) -> bool {
        let runs = self.runs.entry(key).or_default();
        *runs += 1;
        *runs <= PRODUCTS
    }
}

/// Σ over the lower (`first` = 0) or the upper (1) neighbours of what row `i` shares with them times `value`, and of
/// the magnitudes.
fn shared(system: &System, i: usize, first: usize, value: impl Fn(usize) -> f64) -> [f64; 2] {
    let (mut sum, mut size) = (0.0, 0.0);
    for k in (first..6).step_by(2) {
        if system.neighbor[i][k] != NONE {
            let term = system.coefficient[i][k] * value(system.neighbor[i][k] as usize);
            sum += term;
            size += f64::abs(term);
        }
    }
    [sum, size]
}

fn products(a: &[f64], b: &[f64]) -> [f64; 2] {
    let terms = || a.iter().zip(b).map(|(a, b)| a * b);
    [terms().sum(), terms().map(f64::abs).sum()]
}

impl Checker<'_> {
    pub(super) fn iterate(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        match traced.moment {
            Moment::Before => self.before(traced),
            Moment::After => self.iterated(traced),
        }
    }

    fn control(&self, traced: Traced<'_>) -> Result<PressureControl64, SolveError> {
        traced.pressure_control(self.precision())
    }

    fn before(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let iteration = &mut self.iteration;
        (iteration.last, iteration.now) = (iteration.now, traced.pass);
        self.iteration.control = self.control(traced)?;
        match traced.pass {
            "pressure/direction" => {
                self.iteration.direction = self.by_row(traced, "pressure_direction")?;
            }
            "pressure/advance" => {
                self.iteration.terms = self.terms(traced)?;
                self.iteration.values = self.by_row(traced, "pressure_residual")?;
            }
            "pressure/center" => {
                self.iteration.values = self.by_row(traced, traced.buffer("values"))?;
            }
            _ => {}
        }
        Ok(())
    }

    fn iterated(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        if traced.pass == "pressure/count_pockets" {
            return self.pockets(traced);
        }
        if traced.pass == "pressure/reduce" {
            return self.reduce(traced);
        }
        if !self.is_turn(traced) {
            return Ok(());
        }
        if MULTIGRID.contains(&traced.pass) {
            // The last sweep of a cycle leaves the sums; a cycle has any number of them.
            if traced.pass == "pressure/smooth" && self.is_early() {
                self.note_sum(traced, ["pressure_residual", "pressure_correction"])?;
            }
            return self.cycle(traced);
        }
        if !self.iteration.is_due((traced.pass, 0)) {
            return Ok(());
        }
        match traced.pass {
            "pressure/divergence" | "pressure/density_source" => {
                self.note_sum(traced, ["pressure_rhs"; 2])
            }
            "pressure/multiply" => {
                self.note_sum(traced, ["pressure_direction", "pressure_product"])
            }
            "pressure/precondition" => self.precondition(traced),
            "pressure/ipp_lower" => self.ipp_lower(traced),
            "pressure/ipp_upper" => self.ipp_upper(traced),
            "pressure/direction" => self.direction(traced),
            "pressure/advance" => self.advance(traced),
            "pressure/verify" => self.verify(traced),
            "pressure/center" => self.center(traced),
            _ => Ok(()),
        }
    }

    /// Whether the solve is at one of the iterations that are compared.
    fn is_early(&self) -> bool {
        let done = self.iteration.runs.get(&("pressure/direction", 0));
        done.is_none_or(|&done| done < PRODUCTS)
    }

    /// Whether the dispatch was one that is compared, and not empty.
    fn is_turn(&self, traced: Traced<'_>) -> bool {
        let Iteration { control, last, .. } = &self.iteration;
        match traced.pass {
            "pressure/divergence" | "pressure/density_source" | "pressure/coarsen" => true,
            // A solve among pockets begins with a verification.
            "pressure/verify" => control.state == VERIFYING || *last == "pressure/center",
            "pressure/center" => match (traced.buffer("values"), *last) {
                ("pressure_rhs", _) => true,
                ("pressure_residual", "pressure/verify") => control.state == VERIFYING,
                _ => control.state == ITERATING,
            },
            _ => control.state == ITERATING,
        }
    }

    /// What the bricks' sums of products of two arrays come to.
    fn note_sum(&mut self, traced: Traced<'_>, names: [&str; 2]) -> Result<(), SolveError> {
        let a = self.by_row(traced, names[0])?;
        let b = self.by_row(traced, names[1])?;
        self.iteration.sum = Some(products(&a, &b));
        Ok(())
    }

    fn add_rows(&mut self, field: &'static Field, rows: &[[f64; 3]]) {
        let cells = &self.built().system.cell;
        let pairs: Vec<Pair<f64>> = (rows.iter().zip(cells))
            .map(|(&[value, exact, tolerance], &e)| pair_of(e as usize, value, exact, tolerance))
            .collect();
        self.table.add(field, &pairs, 0);
    }

    fn precondition(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let unit = self.unit();
        let r = self.by_row(traced, "pressure_residual")?;
        let z = self.by_row(traced, "pressure_correction")?;
        let rows: Vec<_> = match self.model.settings().pressure.preconditioner {
            Preconditioner::Jacobi => {
                let d = self.by_row(traced, "pressure_inverse_diagonal")?;
                (0..r.len())
                    .map(|i| [z[i], d[i] * r[i], unit * (d[i] * r[i]).abs()])
                    .collect()
            }
            _ => (0..r.len()).map(|i| [z[i], r[i], 0.0]).collect(),
        };
        self.add_rows(&PRECONDITIONED, &rows);
        self.iteration.sum = Some(products(&r, &z));
        Ok(())
    }

    fn ipp_lower(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let unit = self.unit();
        let r = self.by_row(traced, "pressure_residual")?;
        let d = self.by_row(traced, "pressure_inverse_diagonal")?;
        let half = self.by_row(traced, "pressure_product")?;
        let system = &self.built().system;
        let of = |i: usize| {
            let [sum, size] = shared(system, i, 0, |j| d[j] * r[j]);
            let exact = d[i] * (r[i] + sum);
            [half[i], exact, 9.0 * unit * d[i] * (r[i].abs() + size)]
        };
        let rows: Vec<_> = (0..r.len()).map(of).collect();
        self.add_rows(&IPP_LOWER, &rows);
        Ok(())
    }

    fn ipp_upper(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let unit = self.unit();
        let r = self.by_row(traced, "pressure_residual")?;
        let d = self.by_row(traced, "pressure_inverse_diagonal")?;
        let half = self.by_row(traced, "pressure_product")?;
        let z = self.by_row(traced, "pressure_correction")?;
        let system = &self.built().system;
        let of = |i: usize| {
            let [sum, size] = shared(system, i, 1, |j| half[j]);
            let exact = half[i] + d[i] * sum;
            [z[i], exact, 9.0 * unit * (half[i].abs() + d[i] * size)]
        };
        let rows: Vec<_> = (0..r.len()).map(of).collect();
        self.add_rows(&IPP_UPPER, &rows);
        self.iteration.sum = Some(products(&r, &z));
        Ok(())
    }

    fn direction(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let unit = self.unit();
        let z = self.by_row(traced, "pressure_correction")?;
        let p = self.by_row(traced, "pressure_direction")?;
        let beta = self.iteration.control.beta;
        let rows: Vec<_> = (z.iter().zip(&self.iteration.direction).zip(p))
            .map(|((z, before), p)| {
                let kept = beta * before;
                [p, z + kept, 2.0 * unit * (z.abs() + kept.abs())]
            })
            .collect();
        self.add_rows(&DIRECTED, &rows);
        Ok(())
    }

    fn advance(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let p = self.by_row(traced, "pressure_direction")?;
        let q = self.by_row(traced, "pressure_product")?;
        let r = self.by_row(traced, "pressure_residual")?;
        let (terms, unit) = (self.terms(traced)?, self.unit());
        let alpha = self.iteration.control.alpha;
        let Iteration {
            terms: before,
            values,
            ..
        } = &self.iteration;
        let of_x = |i: usize| {
            let way = alpha * p[i];
            let at = |terms: &[Vec<f64>]| terms.iter().map(|term| term[i]).sum::<f64>();
            let tolerance = match &terms[..] {
                [one] => unit * (2.0 * way.abs() + one[i].abs()),
                // What the first word loses, and of the step what is beyond its factors' leading 12 bits.
                [large, small, ..] => {
                    let kept = unit * large[i].abs() + way.abs() / 512.0;
                    unit * (small[i].abs() + 4.0 * kept)
                }
                [] => 0.0,
            };
            [at(&terms), at(before) + way, tolerance]
        };
        let of_r = |i: usize| {
            let way = alpha * q[i];
            [
                r[i],
                values[i] - way,
                2.0 * unit * (values[i].abs() + way.abs()),
            ]
        };
        let solution: Vec<_> = (0..p.len()).map(of_x).collect();
        let residual: Vec<_> = (0..p.len()).map(of_r).collect();
        self.add_rows(&ADVANCED_SOLUTION, &solution);
        self.add_rows(&ADVANCED_RESIDUAL, &residual);
        self.iteration.sum = Some(products(&r, &r));
        Ok(())
    }

    fn verify(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let (terms, unit) = (self.terms(traced)?, self.unit());
        let b = self.by_row(traced, "pressure_rhs")?;
        let r = self.by_row(traced, "pressure_residual")?;
        let system = &self.built().system;
        let images: Vec<_> = terms.iter().map(|term| system.apply(term)).collect();
        let errors: Vec<_> = terms.iter().map(|term| differences(system, term)).collect();
        let of = |i: usize| {
            let exact = images.iter().fold(b[i], |left, image| left - image[i]);
            let size = images
                .iter()
                .fold(b[i].abs(), |size, image| size + image[i].abs());
            let error: f64 = errors.iter().map(|error| error[i]).sum();
            [r[i], exact, unit * (12.0 * error + 2.0 * size)]
        };
        let rows: Vec<_> = (0..b.len()).map(of).collect();
        self.add_rows(&VERIFIED_RESIDUAL, &rows);
        self.iteration.sum = Some(products(&r, &r));
        Ok(())
    }

    fn center(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let unit = self.unit();
        let found = self.by_row(traced, traced.buffer("values"))?;
        let before = &self.iteration.values;
        let pockets = self.built().system.pockets();
        let mut exact = before.clone();
        remove_means(&mut exact, &pockets);
        let mut tolerance = vec![0.0; before.len()];
        for pocket in &pockets {
            let n = pocket.len() as f64;
            let size: f64 = pocket.iter().map(|&i| before[i as usize].abs()).sum();
            for &i in pocket {
                let i = i as usize;
                let of_mean = (n / 256.0 + 14.0) * size / n;
                tolerance[i] = unit * (of_mean + before[i].abs());
            }
        }
        let rows: Vec<_> = (0..found.len())
            .map(|i| [found[i], exact[i], tolerance[i]])
            .collect();
        self.add_rows(&CENTERED, &rows);
        Ok(())
    }

    /// A pocket's cells have its least element for a label, all else 0.
    fn pockets(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let labels = self.cells::<u32>(traced, "pressure_label")?;
        let counted = traced.pressure_stats()?.pockets;
        let wet = (CELLS * (self.layout().bricks.wet + 1)) as usize;
        let system = &self.built().system;
        let pockets = system.pockets();
        let mut expected = vec![0; wet];
        for pocket in &pockets {
            let places = || pocket.iter().map(|&row| blocked(system.cell[row as usize]));
            let least = places().min().unwrap_or(0) as u32;
            for place in places() {
                expected[place] = least;
            }
        }
        let first = CELLS as usize;
        (self.table).add_exact(&LABELS, &labels[first..wet], &expected[first..]);
        (self.table).add_exact(&POCKETS, &[counted], &[pockets.len() as u32]);
        Ok(())
    }

    /// The bricks' sums and what follows from them.
    fn reduce(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let phase = traced.uniform::<PressurePhase>("phase")?;
        let before = self.iteration.control;
        let wanted = if phase.step == VERIFIED {
            VERIFYING
        } else {
            ITERATING
        };
        let is_turn = phase.step == BEGIN || before.state == wanted;
        let Some([sum, size]) = self.iteration.sum.take().filter(|_| is_turn) else {
            return Ok(());
        };
        let after = self.control(traced)?;
        let found = traced.pressure_stats()?.pockets;
        // Of a brick's 8 cells a thread, its 64 threads, and the bricks.
        let (terms, unit) = (f64::from(phase.sum_count) / 256.0 + 60.0, self.unit());
        let expected = Expected::new(
            &phase,
            [before, after],
            [sum, unit * terms * size],
            found,
            unit,
        );
        let pairs: Vec<_> = (expected.scalars.iter().enumerate())
            .map(|(k, &(value, exact, tolerance))| pair_of(k, value, exact, tolerance))
            .collect();
        self.table.add(&SCALARS, &pairs, 0);
        let decided = |c: &PressureControl64| [c.state, c.iterations, c.is_first, c.restarts];
        if expected.is_tie {
            self.table.add::<f64>(&DECIDED, &[], 1);
        } else {
            (self.table).add_exact(&DECIDED, &decided(&after), &decided(&expected.control));
        }
        Ok(())
    }
}

/// What `pressure/reduce` should come to.
struct Expected {
    /// State and counts.
    control: PressureControl64,
    /// The device's, what it should be, and by how much it may be off.
    scalars: Vec<(f64, f64, f64)>,
    /// Rounding decides the state.
    is_tie: bool,
}

impl Expected {
    /// `sum` is what the bricks' sums come to, give or take `slack`; `found` how many pockets were counted.
    fn new(
        phase: &PressurePhase,
        [before, after]: [PressureControl64; 2],
        [sum, slack]: [f64; 2],
        found: u32,
        unit: f64,
    ) -> Self {
        let mut control = before;
        let mut is_tie = false;
        let mut scalars = vec![match phase.step {
            BEGIN => (after.rhs_square, sum, slack),
            DIRECTION => (after.product, sum, slack),
            LENGTH => {
                let alpha = before.product / sum;
                let error = (slack / sum).abs() + 4.0 * unit;
                (after.alpha, alpha, alpha.abs() * error / (1.0 - error))
            }
            _ => (after.residual_square, sum, slack),
        }];
        let target = f64::from(phase.tolerance_square) * before.rhs_square;
        let is_reached = sum <= target;
        match phase.step {
            BEGIN => {
                control = PressureControl64 {
                    state: match (phase.has_pockets == 0 && found > 0, sum > 0.0) {
                        (true, _) => WANTS_POCKETS,
                        (_, true) => ITERATING,
                        _ => DONE,
                    },
                    is_first: 1,
                    ..PressureControl64::default()
                };
                scalars.push((after.residual_square, sum, slack));
            }
            DIRECTION => {
                control.is_first = 0;
                is_tie = sum <= slack;
                let beta = match before.is_first {
                    1 => [0.0; 2],
                    _ => [sum, slack + 4.0 * unit * sum.abs()].map(|v| v / before.product),
                };
                scalars.push((after.beta, beta[0], beta[1].abs()));
            }
            LENGTH => is_tie = sum <= slack,
            CHECK => {
                control.iterations += 1;
                if is_reached || control.iterations >= phase.max_iterations {
                    control.state = VERIFYING;
                }
                is_tie = (sum - target).abs() <= slack + 2.0 * unit * target;
            }
            _ => {
                (control.restarts, control.is_first) = (before.restarts + 1, 1);
                let is_over = before.iterations >= phase.max_iterations;
                let is_last = is_reached || is_over || control.restarts > MOST_RESTARTS;
                control.state = if is_last { DONE } else { ITERATING };
                is_tie = (sum - target).abs() <= slack + 2.0 * unit * target;
            }
        }
        Self {
            control,
            scalars,
            is_tie,
        }
    }
}
