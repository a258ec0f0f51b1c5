//! Bodies that the water moves: their coupling with cells, and their part in the projection.

use glam::{DQuat, DVec3, Vec3};

use crate::{
    comparison::{Comparison, Io, NONE, PassResult, TracedBuffers, comparison, names},
    table::pair,
};
use swell_domain::{
    body::{BodyState, Six, dot, product},
    bricks::CELLS,
    poisson::Coupling,
};
use swell_gpu::buffer::Buf;
use swell_reference::{
    flip::{BodyCells, carry_bodies as reference_carry, couple_bodies as reference_couple},
    poisson::iteration::products,
};
use swell_solve::{
    SolveError,
    buffers::POSED_SOLIDS,
    flip::buffers,
    params::PosedSolid,
    pressure::{
        DONE, ITERATING, VERIFYING,
        bodies::{self as device, DeviceBody},
        buffers::{self as solved, Real},
    },
};

use super::{FlipState, iteration::*, rows::*};

/// Comparisons of the passes over bodies.
pub(super) const COMPARISONS: &[Comparison<FlipState>] = &[
    comparison("flip/couple_bodies", NONE, couple_bodies),
    on_bodies("pressure/push_bodies", NONE, push_bodies),
    on_bodies("pressure/move_bodies", NONE, move_bodies),
    on_bodies(
        "pressure/couple",
        || names![solved::CORRECTION, solved::RESIDUAL],
        couple,
    ),
    on_bodies(
        "pressure/carry_flux",
        || names![buffers::SOLID_FLUX],
        carry_flux,
    ),
    comparison(
        "flip/carry_bodies",
        || names![buffers::FACE_VELOCITY],
        carry_bodies,
    ),
];

/// Returns a comparison of the first few runs in each part of a solve that are not empty.
const fn on_bodies(
    pass: &'static str,
    keeps: fn() -> Vec<String>,
    compare: fn(&mut FlipState, &mut Io<'_>) -> PassResult,
) -> Comparison<FlipState> {
    Comparison {
        is_due: |state, io| {
            let part = state.body_part(io)?;
            let Some(part) = part else { return Ok(false) };
            let is_due = state.is_due(io, part);
            if !is_due && io.pass == "pressure/couple" {
                // A sum of an earlier run does not describe what this one wrote.
                state.sums = [None; 4];
            }
            Ok(is_due)
        },
        ..comparison(pass, keeps, compare)
    }
}

/// What the device has of bodies in a substep.
#[derive(Default)]
pub(super) struct Touched {
    states: Vec<DeviceBody>,
    pairs: Vec<device::BodyPair>,
    /// Six arrays of cells for each pair.
    coupling: Vec<f64>,
}

impl Touched {
    fn read(io: &Io<'_>, bodies: usize) -> Result<Self, SolveError> {
        let states = io.after.get(device::STATES, bodies)?;
        let pairs = states.last().map_or(0, |body| body.end as usize);
        Ok(Self {
            states,
            pairs: io.after.get(device::PAIRS, pairs)?,
            coupling: io
                .after
                .scalars(device::COUPLING, 6 * CELLS as usize * pairs)?,
        })
    }

    /// Returns a cell's coupling in a pair.
    fn push(&self, pair: usize, cell: usize) -> Six {
        let cells = CELLS as usize;
        std::array::from_fn(|k| self.coupling[cells * (6 * pair + k) + cell])
    }

    /// Iterates over pairs and the elements of their bricks, with the coupling there.
    fn cells(&self) -> impl Iterator<Item = (usize, usize, Six)> {
        let cells = CELLS as usize;
        (0..self.pairs.len()).flat_map(move |pair| {
            let first = cells * self.pairs[pair].slot as usize;
            (0..cells).map(move |cell| (pair, first + cell, self.push(pair, cell)))
        })
    }

    fn response(&self, body: usize) -> [Six; 6] {
        let rows = self.states[body].response;
        let at = |place: usize| f64::from(rows[place / 4][place % 4]);
        std::array::from_fn(|i| std::array::from_fn(|j| at(6 * i + j)))
    }

    /// Returns the flux out of each element by changes of the bodies' velocities, and the sum of
    /// its terms' magnitudes.
    fn flux(&self, elements: usize, changes: &[Six]) -> [Vec<f64>; 2] {
        let [mut flux, mut size] = [vec![0.0; elements], vec![0.0; elements]];
        for (pair, element, push) in self.cells() {
            if element < elements {
                let change = &changes[self.pairs[pair].body as usize];
                flux[element] += dot(&push, change);
                size[element] += dot(&push.map(f64::abs), &change.map(f64::abs));
            }
        }
        [flux, size]
    }

    /// Returns the bodies' part of a system with these rows.
    pub(super) fn couplings(&self, cell: &[u32], elements: usize) -> Vec<Coupling> {
        let mut row_of = vec![u32::MAX; elements];
        for (row, &element) in (0..).zip(cell) {
            row_of[element as usize] = row;
        }
        let mut all: Vec<_> = (0..self.states.len())
            .map(|body| Coupling {
                response: self.response(body),
                ..Coupling::default()
            })
            .collect();
        for (pair, element, push) in self.cells() {
            let has_row = element < elements && row_of[element] != u32::MAX;
            if has_row && push != [0.0; 6] {
                let body = &mut all[self.pairs[pair].body as usize];
                body.row.push(row_of[element]);
                body.push.push(push);
            }
        }
        all
    }
}

impl FlipState {
    /// Takes over the bodies' poses and velocities that the device has.
    pub(super) fn refresh_bodies(&mut self, io: &Io<'_>) -> PassResult {
        if !self.scene.has_bodies() {
            return Ok(());
        }
        let all = io.before.one(POSED_SOLIDS)?;
        let solids = &all.solids[..all.count as usize];
        let bodies = solids.len() - self.scene.bodies().count()..;
        let wide = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
        let start = self.elements().substep.start;
        let state = |solid: &PosedSolid| BodyState {
            time: start,
            centre: self.scene.domain.min + wide(solid.centre),
            turn: {
                let [x, y, z, w] = solid.back.map(f64::from);
                DQuat::from_xyzw(x, y, z, w).conjugate().normalize()
            },
            velocity: wide(solid.velocity),
            spin: wide(solid.spin),
        };
        self.bodies = solids[bodies].iter().map(state).collect();
        Ok(())
    }

    /// Returns the number of the part of a solve in which a pass over bodies runs: 0 in an
    /// iteration, 1 in a verification, 2 at the end; `None` where its dispatch is empty.
    fn body_part(&mut self, io: &Io<'_>) -> Result<Option<u32>, SolveError> {
        let state = io.before.control(self.precision())?.state;
        let phase = io.before.window(&solved::PHASES)?;
        if io.pass == "pressure/push_bodies" {
            self.follows_verify = io.last == "pressure/verify";
        }
        if phase.step >= OF_WEIGHT {
            return Ok(Some(phase.step + 1));
        }
        let (part, wanted) = match (phase.step, self.follows_verify) {
            (0, _) => (0, ITERATING),
            (_, true) => (1, VERIFYING),
            (_, false) => (2, DONE),
        };
        Ok((state == wanted && phase.body_bricks > 0).then_some(part))
    }

    fn of_pairs(&self, view: &TracedBuffers<'_>, count: usize) -> Result<Vec<Six>, SolveError> {
        self.sixes(view, &device::SUMS, count)
    }

    /// Returns the changes of the bodies' velocities by the pressure, and those before the solve.
    fn changes(&self, view: &TracedBuffers<'_>) -> Result<[Vec<Six>; 2], SolveError> {
        let count = self.bodies.len();
        let mut by_pressure = self.sixes(view, &device::CHANGE, 2 * count)?;
        let before = by_pressure.split_off(count);
        Ok([by_pressure, before])
    }

    /// Returns those that a run of a pass writes or reads.
    fn changes_of(&self, io: &Io<'_>, view: &TracedBuffers<'_>) -> Result<Vec<Six>, SolveError> {
        let [by_pressure, before] = self.changes(view)?;
        let is_before = io.before.window(&solved::PHASES)?.step >= OF_WEIGHT;
        Ok(if is_before { before } else { by_pressure })
    }

    fn sixes(
        &self,
        view: &TracedBuffers<'_>,
        buffer: &Buf<Real>,
        count: usize,
    ) -> Result<Vec<Six>, SolveError> {
        let values = view.reals(buffer, self.precision(), 6 * count)?;
        let six = |c: &[f64]| std::array::from_fn(|k| c[k]);
        Ok(values.chunks_exact(6).map(six).collect())
    }

    /// Returns what a run of pressure/push_bodies sums, by row.
    fn pushing(&self, io: &Io<'_>) -> Result<Vec<f64>, SolveError> {
        if io.before.window(&solved::PHASES)?.step == 0 {
            let last = self.by_row(&io.before, solved::DIRECTION)?;
            return Ok(self.direction(io, &last)?[0].clone());
        }
        let terms = self.terms(&io.before)?;
        Ok((0..terms[0].len())
            .map(|row| terms.iter().map(|term| term[row]).sum())
            .collect())
    }
}

/// Step of the passes that take the sums of flip/couple_bodies; with the next one they take none.
const OF_WEIGHT: u32 = 2;

/// Compares the coupling of every cell with every body: also that of bricks that no pair lists.
fn couple_bodies(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let touched = Touched::read(io, state.bodies.len())?;
    let cells = state.elements().cells;
    let found_of = |body: usize| {
        let mut found = vec![[0.0; 6]; cells];
        let own = touched.cells();
        for (_, element, push) in own.filter(|(p, ..)| touched.pairs[*p].body as usize == body) {
            found[element] = push;
        }
        found
    };
    let error = state.distance_error();
    let [exact, less, more] = [0.0, -error, error].map(|shift| state.coupled(shift));
    let place = CUT.of([state.place()]);
    for body in 0..exact.len() {
        let of = |all: &[BodyCells]| spread(&all[body], cells);
        let (found, exact_of) = (found_of(body), of(&exact));
        let others = [of(&less), of(&more)];
        let half = |six: &Six, first: usize| DVec3::new(six[first], six[first + 1], six[first + 2]);
        let moved = |element: usize, first: usize| {
            let exact = half(&exact_of[element], first);
            let apart = |other: &Vec<Six>| (half(&other[element], first) - exact).length();
            others.iter().map(apart).fold(0.0, f64::max)
        };
        let size = state.model.cell_size();
        let reach = state.bodies[body].centre;
        let arm = |element: usize| {
            let cell = state.elements().bricks.cell(element as u32);
            let middle = (DVec3::from_array(cell.map(f64::from)) + 0.5) * size;
            (middle - (reach - state.scene.domain.min)).length()
        };
        io.table
            .each(&TOUCHED_AREA, state.elements().active(), |element| {
                let [found, exact] = [&found[element], &exact_of[element]].map(|six| half(six, 0));
                pair(element, found, exact, [place, moved(element, 0)])
            });
        io.table
            .each(&TOUCHED_MOMENT, state.elements().active(), |element| {
                let [found, exact] = [&found[element], &exact_of[element]].map(|six| half(six, 3));
                pair(
                    element,
                    found,
                    exact,
                    [place, arm(element), moved(element, 3)],
                )
            });
        let response = touched.response(body);
        // The pose that the device's grids have is rounded.
        let turned =
            (exact[body].response[3..].iter().flatten()).fold(0.0, |a: f64, b| a.max(b.abs()));
        io.table.each(&RESPONSE, 0..36, |k| {
            let exact = exact[body].response[k / 6][k % 6];
            pair(k, response[k / 6][k % 6], exact, [exact.abs(), turned])
        });
    }
    let pairs = touched.pairs.len();
    let found = state.of_pairs(&io.after, pairs)?;
    for (body, exact) in exact.iter().enumerate() {
        let own = |pair: &usize| touched.pairs[*pair].body as usize == body;
        let all: Vec<usize> = (0..pairs).filter(own).collect();
        let apart = |k: usize| {
            let apart = |other: &[BodyCells]| (other[body].weight[k] - exact.weight[k]).abs();
            apart(&less).max(apart(&more))
        };
        let cells = exact.element.len() as f64;
        let velocity = state.step().velocity_step.length();
        let arm = state.scene.domain.size().length();
        io.table.each(&WEIGHT, 0..6, |k| {
            let found: f64 = all.iter().map(|&pair| found[pair][k]).sum();
            let arm = if k < 3 { 1.0 } else { arm };
            pair(
                6 * body + k,
                found,
                exact.weight[k],
                [place, cells * velocity * arm, apart(k)],
            )
        });
    }
    state.touched = touched;
    Ok(())
}

/// Returns a body's coupling by element.
fn spread(cells: &BodyCells, elements: usize) -> Vec<Six> {
    let mut all = vec![[0.0; 6]; elements];
    for (&element, &push) in cells.element.iter().zip(&cells.push) {
        if let Some(place) = all.get_mut(element as usize) {
            *place = push;
        }
    }
    all
}

fn push_bodies(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    // Pockets, once found, change it.
    state.touched = Touched::read(io, state.bodies.len())?;
    let values = state.pushing(io)?;
    let (unit, touched) = (state.unit(), &state.touched);
    let mut by_element = vec![0.0; state.elements().cells];
    for (&element, value) in state.system().cell.iter().zip(&values) {
        by_element[element as usize] = *value;
    }
    let wet = state.elements().wet();
    let pairs = touched.pairs.len();
    let [mut sums, mut sizes] = [vec![[0.0; 6]; pairs], vec![[0.0; 6]; pairs]];
    for (pair, element, push) in touched.cells().filter(|(_, e, _)| wet.contains(e)) {
        for k in 0..6 {
            let term = push[k] * by_element[element];
            sums[pair][k] += term;
            sizes[pair][k] += term.abs();
        }
    }
    let found = state.of_pairs(&io.after, pairs)?;
    let is_wet = |pair: usize| wet.contains(&(CELLS as usize * touched.pairs[pair].slot as usize));
    io.table.each(&PUSH, 0..6 * pairs, |index| {
        let (pair_of, k) = (index / 6, index % 6);
        let magnitudes = [unit, sizes[pair_of][k]];
        let one = pair(index, found[pair_of][k], sums[pair_of][k], magnitudes);
        is_wet(pair_of).then_some(one)
    });
    Ok(())
}

fn move_bodies(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (unit, touched) = (state.unit(), &state.touched);
    let sums = state.of_pairs(&io.before, touched.pairs.len())?;
    let wet = state.elements().bricks.wet;
    let found = state.changes_of(io, &io.after)?;
    let is_none = io.before.window(&solved::PHASES)?.step > OF_WEIGHT;
    let is_weight = io.before.window(&solved::PHASES)?.step == OF_WEIGHT;
    let count = found.len();
    let [mut all, mut sizes] = [vec![[0.0; 6]; count], vec![[0.0; 6]; count]];
    for (pair, sum) in touched.pairs.iter().zip(&sums) {
        // Bricks without water have no pressures.
        for k in (0..6).filter(|_| (pair.slot <= wet || is_weight) && !is_none) {
            all[pair.body as usize][k] += sum[k];
            sizes[pair.body as usize][k] += sum[k].abs();
        }
    }
    io.table.each(&BODY_CHANGE, 0..6 * count, |index| {
        let (body, k) = (index / 6, index % 6);
        let response = touched.response(body);
        let exact = product(&response, &all[body])[k];
        let size = dot(&response[k].map(f64::abs), &sizes[body]);
        let terms = touched.pairs.len() as f64;
        pair(index, found[body][k], exact, [unit, terms, size])
    });
    Ok(())
}

fn couple(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let unit = state.unit();
    let [changes, _] = state.changes(&io.before)?;
    let [flux, sizes] = state.touched.flux(state.elements().cells, &changes);
    let cell = state.system().cell.clone();
    let is_product = io.before.window(&solved::PHASES)?.step == 0;
    let (entry, sign, [before, after]) = match is_product {
        true => {
            let all =
                [&io.before, &io.after].map(|view| state.by_row_of(view, solved::CORRECTION, 1));
            let [before, after] = all;
            (&COUPLED_PRODUCT, 1.0, [before?, after?])
        }
        false => {
            let all = [&io.before, &io.after].map(|view| state.by_row(view, solved::RESIDUAL));
            let [before, after] = all;
            (&COUPLED_RESIDUAL, -1.0, [before?, after?])
        }
    };
    state.add_rows(io.table, entry, |row| {
        let e = cell[row] as usize;
        let exact = before[row] + sign * flux[e];
        (after[row], exact, [unit, sizes[e], exact.abs()])
    });
    if is_product {
        let last = state.by_row(&io.before, solved::DIRECTION)?;
        let [p, sizes] = state.direction(io, &last)?;
        let r = state.by_row(&io.after, solved::RESIDUAL)?;
        state.note_products([&p, &sizes], &r, &after);
    } else {
        state.sums[SQUARE] = Some(products(&after, &after));
    }
    Ok(())
}

fn carry_flux(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (unit, elements) = (state.unit(), state.elements());
    let changes = state.changes_of(io, &io.before)?;
    let [flux, sizes] = state.touched.flux(elements.cells, &changes);
    let before = elements.scalars(&io.before, buffers::SOLID_FLUX)?;
    let after = elements.scalars(&io.after, buffers::SOLID_FLUX)?;
    io.table.each(&CARRIED_FLUX, elements.wet(), |e| {
        let exact = before[e] + flux[e];
        pair(e, after[e], exact, [unit, sizes[e], exact.abs()])
    });
    if let Some(space) = &mut state.space {
        space.solid_flux = after;
    }
    Ok(())
}

fn carry_bodies(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let [by_pressure, before] = state.changes(&io.before)?;
    let both = by_pressure.iter().zip(&before);
    let changes: Vec<Six> = both
        .map(|(a, b)| std::array::from_fn(|k| a[k] + b[k]))
        .collect();
    let mut exact = elements.planes(&io.before, buffers::FACE_VELOCITY)?;
    let (step, bodies) = (state.step(), (&state.bodies[..], &changes[..]));
    let bricks = &elements.bricks;
    reference_carry(
        &state.model,
        &step,
        bricks,
        state.space(),
        bodies,
        &mut exact,
    );
    let found = elements.planes(&io.after, buffers::FACE_VELOCITY)?;
    let reach = state.scene.domain.size().length();
    let most = |change: &Six| {
        let [x, y, z, a, b, c] = *change;
        DVec3::new(x, y, z).length() + reach * DVec3::new(a, b, c).length()
    };
    let most = changes.iter().map(most).fold(0.0, f64::max);
    io.table.each(&CARRIED_FACES, elements.active(), |e| {
        pair(e, found[e], exact[e], [most, exact[e].length()])
    });
    Ok(())
}

impl FlipState {
    /// Returns the reference's coupling with the solids' distances shifted by `shift`, metres.
    fn coupled(&self, shift: f64) -> Vec<BodyCells> {
        self.with_shifted_solids(shift, DVec3::ZERO, |model, step| {
            let bricks = &self.elements().bricks;
            // Moorings are taut or slack by the velocity before gravity.
            let kick = self.elements().substep.kick;
            let responses = self.model.responses(&self.begun.bodies, kick);
            let bodies = (&self.bodies[..], &responses[..]);
            reference_couple(model, step, bricks, self.space(), bodies)
        })
    }
}
