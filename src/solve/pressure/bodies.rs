//! Bodies that the water moves, in the projection of FLIP (Batty, Bertails and Bridson 2007).
//!
//! With the coupling J of a body, six numbers a cell, and its response R = ρ Δx³ M⁻¹, pressures q
//! change its velocity by R J q, and such a change lets J^T R J q more water out of each cell. The
//! system is A + J^T R J: as strong a coupling as that of the water with itself, stable for bodies
//! of any density. It costs three dispatches an iteration.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use swell_domain::{
    body::{BodyState, Six},
    bounds::Bounds,
    bricks::{Bricks, CELLS, EDGE, table_dims},
    flip::stored_cells,
};
use swell_gpu::{
    buffer::{Buf, BufferSpec, mirror},
    program::Program,
};
use swell_scene::{
    FlipScene,
    flip::Precision,
    moving_solid::{FreeBody, MovingSolid},
};

use super::{
    super::SolveError,
    blocked,
    buffers::{Real, read_reals, upload_reals},
};

mirror!(
    /// `DeviceBody` of shared/bodies.wgsl.
    DeviceBody {
        /// Centre of mass at the substep's start, relative to the domain's minimum corner, metres.
        centre: [f32; 3],
        /// Index in [`ORDER`] of its first pair.
        first: u32,
        /// Change of the six velocities for each sum of pressures, rows of six.
        response: [[f32; 4]; 9],
        /// Index in [`ORDER`] after its last pair.
        end: u32,
        /// Its number among the solids.
        solid: u32,
        /// Unused.
        padding: [u32; 2],
    }
);

mirror!(
    /// `BodyPair` of shared/bodies.wgsl: a brick and a body that may touch it.
    BodyPair {
        /// Slot of the brick.
        slot: u32,
        /// Index of the body.
        body: u32,
    }
);

/// The bodies' states and responses.
pub const STATES: Buf<DeviceBody> = Buf::new("body_states");
/// Pairs of bricks and bodies, by slot.
pub const PAIRS: Buf<BodyPair> = Buf::new("body_pairs");
/// Pairs by body.
pub const ORDER: Buf<u32> = Buf::new("body_order");
/// Bricks with water that bodies may touch: slot, first pair, pair after the last, 0.
pub const TOUCHED: Buf<[u32; 4]> = Buf::new("body_bricks");
/// For each pair six arrays of 512 cells: area of the body's surface in the cell over Δx², then its
/// moment about the centre of mass over Δx², metres.
pub const COUPLING: Buf<f32> = Buf::new("body_coupling");
/// Six sums of pressures over the cells of each pair.
pub const SUMS: Buf<Real> = Buf::new("body_sums");
/// Change of the six velocities of each body by those pressures, m/s and rad/s; behind them that by
/// the weight of the water between the centres of cells and the body's surface.
pub const CHANGE: Buf<Real> = Buf::new("body_change");

/// Distance beyond a body's box within which its surface may cut a cell, in cells.
const MARGIN: f64 = 1.0;

/// Returns the largest number of pairs of a scene: a body has at most as many bricks as its largest
/// extent in any pose touches.
pub(crate) fn most_pairs(scene: &FlipScene, grid_dims: [u32; 3]) -> usize {
    let size = scene.settings().cell_size;
    let table = table_dims(stored_cells(grid_dims, scene.periodic));
    let of_body = |it: &FreeBody| {
        let cells = 2.0 * (it.reach / size + MARGIN);
        let bricks = (cells / f64::from(EDGE)).floor() as usize + 2;
        table
            .map(|n| bricks.min(n as usize))
            .iter()
            .product::<usize>()
    };
    scene.bodies().map(of_body).sum()
}

/// Returns the buffers of the scene's bodies; none without bodies.
pub(crate) fn planned(scene: &FlipScene, grid_dims: [u32; 3]) -> Vec<BufferSpec> {
    let count = scene.bodies().count();
    if count == 0 {
        return Vec::new();
    }
    let pairs = most_pairs(scene, grid_dims);
    let reals = |buffer: Buf<Real>, count: usize| match scene.settings().pressure.precision {
        Precision::F32 | Precision::F32Refined => buffer.retyped::<f32>().sized(count),
        Precision::F64 => buffer.retyped::<f64>().sized(count),
    };
    vec![
        STATES.sized(count),
        PAIRS.sized(pairs),
        ORDER.sized(pairs),
        TOUCHED.sized(pairs),
        COUPLING.sized(6 * CELLS as usize * pairs),
        reals(SUMS, 6 * pairs),
        reals(CHANGE, 12 * count),
    ]
}

/// The lists of a substep.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    pairs: Vec<BodyPair>,
    order: Vec<u32>,
    touched: Vec<[u32; 4]>,
    states: Vec<DeviceBody>,
}

impl Lists {
    /// Lists the bricks that each body may touch at the start of a substep, in which they have
    /// these states and responses; `first_solid` is the number of the first body's grid among the
    /// solids'.
    pub(crate) fn new(
        scene: &FlipScene,
        bricks: &Bricks,
        states: &[BodyState],
        responses: &[[Six; 6]],
        first_solid: u32,
    ) -> Self {
        let solids = scene.moving_solids.iter();
        let bodies: Vec<_> = solids.filter(|solid| solid.body.is_some()).collect();
        let mut lists = Self::default();
        for (body, solid) in (0..).zip(&bodies) {
            let slots = touched_slots(scene, bricks, solid, states);
            lists
                .pairs
                .extend(slots.map(|slot| BodyPair { slot, body }));
        }
        lists.pairs.sort_by_key(|pair| (pair.slot, pair.body));
        for (k, solid) in (0..).zip(&bodies) {
            let response = &responses[k as usize];
            lists.add_state(scene, [k, first_solid + k], solid, (states, response));
        }
        for (k, pair) in (0..).zip(&lists.pairs) {
            match lists.touched.last_mut() {
                Some([slot, _, end, _]) if *slot == pair.slot => *end = k + 1,
                _ if pair.slot <= bricks.wet => lists.touched.push([pair.slot, k, k + 1, 0]),
                _ => break,
            }
        }
        lists
    }

    fn add_state(
        &mut self,
        scene: &FlipScene,
        [k, number]: [u32; 2],
        solid: &MovingSolid,
        (all, response): (&[BodyState], &[Six; 6]),
    ) {
        let Some(it) = &solid.body else { return };
        let state = it.state(all);
        let first = self.order.len() as u32;
        let own = (0..).zip(&self.pairs).filter(|(_, pair)| pair.body == k);
        self.order.extend(own.map(|(index, _)| index));
        let volume = scene.settings().cell_size.powi(3);
        let scale = scene.water.rest_density * volume;
        self.states.push(DeviceBody {
            centre: (state.centre - scene.domain.min).as_vec3().to_array(),
            first,
            response: std::array::from_fn(|row| {
                std::array::from_fn(|column| {
                    let place = 4 * row + column;
                    (scale * response[place / 6][place % 6]) as f32
                })
            }),
            end: self.order.len() as u32,
            solid: number,
            padding: [0; 2],
        });
    }

    /// Uploads the lists.
    pub(crate) fn upload(&self, program: &Program) {
        program.upload(STATES, 0, &self.states);
        program.upload(PAIRS, 0, &self.pairs);
        program.upload(ORDER, 0, &self.order);
        program.upload(TOUCHED, 0, &self.touched);
    }

    /// Uploads that the pressure does not move the bodies that are `held`.
    pub(crate) fn upload_held(&self, program: &Program, held: &[bool]) {
        let states = self.states.iter().zip(held);
        let states = states.map(|(state, held)| match held {
            true => DeviceBody {
                response: [[0.0; 4]; 9],
                ..*state
            },
            false => *state,
        });
        program.upload(STATES, 0, &states.collect::<Vec<_>>());
    }

    /// Number of bricks with water that bodies may touch, and number of bodies.
    pub(crate) fn sizes(&self) -> [u32; 2] {
        [self.touched.len() as u32, self.states.len() as u32]
    }
}

/// Iterates over the slots of bricks that a body may touch in its pose at the start of a substep.
fn touched_slots<'a>(
    scene: &FlipScene,
    bricks: &'a Bricks,
    solid: &MovingSolid,
    states: &[BodyState],
) -> impl Iterator<Item = u32> + use<'a> {
    let size = scene.settings().cell_size;
    let time = solid.body.as_ref().map_or(0.0, |it| it.state(states).time);
    let pose = solid.pose(states, time).affine();
    let place = DAffine3::from_translation(-scene.domain.min) * pose;
    let bounds = solid.placed.mesh.bounds().map(|b| turned(&b, &place));
    let (low, high) = bounds.map_or((DVec3::ZERO, DVec3::NEG_ONE), |b| {
        (b.min / size - MARGIN, b.max / size + MARGIN)
    });
    let brick = |x: f64, axis: usize| {
        let last = f64::from(bricks.table_dims[axis]) - 1.0;
        (x / f64::from(EDGE)).floor().clamp(0.0, last) as u32
    };
    let ranges = [0, 1, 2].map(|axis| brick(low[axis], axis)..=brick(high[axis], axis));
    let [nx, ny, _] = bricks.table_dims;
    let [xs, ys, zs] = ranges;
    let at = zs.flat_map(move |z| {
        let xs = xs.clone();
        (ys.clone()).flat_map(move |y| xs.clone().map(move |x| (z * ny + y) * nx + x))
    });
    let slots = at.map(|index| bricks.table[index as usize]);
    slots.filter(|&slot| slot != 0 && slot <= bricks.active)
}

/// Returns the box around a box in another place.
fn turned(b: &Bounds, place: &DAffine3) -> Bounds {
    let corners = (0..8).map(|k| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { b.min } else { b.max }[axis];
        place.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    });
    let none = Bounds {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };
    corners.fold(none, |b, x| Bounds {
        min: b.min.min(x),
        max: b.max.max(x),
    })
}

/// Reads the change of each body's velocities by the last projection, and that before it.
pub(crate) fn changes(
    program: &Program,
    precision: Precision,
    bodies: usize,
) -> Result<[Vec<Six>; 2], SolveError> {
    let all = read_reals(program, &CHANGE, precision, 12 * bodies)?;
    let six = |c: &[f64]| std::array::from_fn(|k| c[k]);
    let (by_pressure, before) = all.split_at(6 * bodies);
    Ok([by_pressure, before].map(|all| all.chunks_exact(6).map(six).collect()))
}

/// Uploads changes of the bodies' velocities before a projection, by contacts.
pub(crate) fn upload_changes(program: &Program, precision: Precision, changes: &[Six]) {
    upload_reals(
        program,
        &CHANGE,
        precision,
        6 * changes.len(),
        changes.as_flattened(),
    );
}

/// Removes the means of each body's coupling over its cells in each pocket, so that the pressure
/// there, which is determined up to a constant, moves no body by that constant. `labels` are the
/// projection's, in blocked order.
pub(super) fn remove_means(
    program: &Program,
    labels: &[u32],
    bodies: usize,
) -> Result<(), SolveError> {
    let planes = 6 * CELLS as usize;
    let pairs = program
        .read(STATES, bodies)?
        .last()
        .map_or(0, |body| body.end);
    let pairs = program.read(PAIRS, pairs as usize)?;
    let mut coupling = program.read(COUPLING, planes * pairs.len())?;
    let label = |pair: &BodyPair, cell: u32| {
        let place = blocked(CELLS * pair.slot + cell);
        labels.get(place).copied().filter(|label| *label != 0)
    };
    let at = |pair: usize, k: usize, cell: u32| planes * pair + CELLS as usize * k + cell as usize;
    let mut sums: BTreeMap<(u32, u32), (Six, f64)> = BTreeMap::new();
    let mut touched = Vec::new();
    for (index, pair) in pairs.iter().enumerate() {
        for cell in 0..CELLS {
            let push: Six = std::array::from_fn(|k| f64::from(coupling[at(index, k, cell)]));
            let Some(label) = label(pair, cell).filter(|_| push != [0.0; 6]) else {
                continue;
            };
            let (sum, count) = sums.entry((label, pair.body)).or_default();
            *sum = std::array::from_fn(|k| sum[k] + push[k]);
            *count += 1.0;
            touched.push((index, cell, (label, pair.body)));
        }
    }
    if touched.is_empty() {
        return Ok(());
    }
    for (index, cell, of) in touched {
        let (sum, count) = &sums[&of];
        for (k, sum) in sum.iter().enumerate() {
            let value = &mut coupling[at(index, k, cell)];
            *value = (f64::from(*value) - sum / count) as f32;
        }
    }
    program.upload(COUPLING, 0, &coupling);
    Ok(())
}
