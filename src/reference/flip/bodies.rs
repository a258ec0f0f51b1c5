//! Reference passes of bodies that the water moves.

use glam::DVec3;

use super::{
    FlipSubstep, Model, OpenSpace, Trace,
    grid::{corner, per_cell},
    to_grid::cut_faces,
};
use swell_domain::{
    body::{BodyState, Six, dot, product},
    bricks::Bricks,
    cut_cell::inside,
    poisson::{Coupling, FLUID, System},
};
use swell_scene::step::Substep;

/// How the pressure of cells pushes a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyCells {
    /// Elements that its surface cuts.
    pub element: Vec<u32>,
    /// Area of the surface in each of them over Δx², then its moment about the centre of mass over
    /// Δx², metres.
    pub push: Vec<Six>,
    /// Sums over the cells of what gravity adds to their pressures q between their centres and the
    /// body's surface, m/s.
    pub weight: Six,
    /// Rows of six: ρ Δx³ times the inverse of the mass matrix within the body's freedom.
    pub response: [Six; 6],
}

impl BodyCells {
    /// Returns the change of the body's velocities by that weight.
    pub fn before(&self) -> Six {
        product(&self.response, &self.weight)
    }

    /// Returns the body's part of a system.
    fn of_system(&self, row_of: &[u32]) -> Coupling {
        let with_row = self.element.iter().zip(&self.push);
        let with_row = with_row.filter(|(element, _)| row_of[**element as usize] != u32::MAX);
        let (row, push) = with_row
            .map(|(&element, &push)| (row_of[element as usize], push))
            .unzip();
        Coupling {
            row,
            push,
            response: self.response,
        }
    }
}

/// Adds bodies to a system.
pub(super) fn add_bodies(bodies: &[BodyCells], elements: usize, system: &mut System) {
    if bodies.is_empty() {
        return;
    }
    let mut row_of = vec![u32::MAX; elements];
    for (row, &element) in (0..).zip(&system.cell) {
        row_of[element as usize] = row;
    }
    system.add_bodies(bodies.iter().map(|it| it.of_system(&row_of)).collect());
}

/// Adds to the solids' flux out of each cell that of the bodies' changes of velocity (reference
/// pass of `pressure/carry_flux`).
pub(super) fn carry_flux(bodies: &[BodyCells], changes: &[Six], flux: &mut [f64]) {
    for (body, change) in bodies.iter().zip(changes) {
        for (&element, push) in body.element.iter().zip(&body.push) {
            flux[element as usize] += dot(push, change);
        }
    }
}

/// Reference pass of `flip/couple_bodies`: the cells that each body's surface cuts, where no other
/// solid is nearer. `bodies` are the states at the substep's start.
pub fn couple_bodies(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    (bodies, responses): (&[BodyState], &[[Six; 6]]),
) -> Vec<BodyCells> {
    let size = model.cell_size();
    let least = model.scene.domain.min;
    let first = step.solids.len() - bodies.len();
    let scale = model.scene.water.rest_density * size.powi(3);
    let all = bodies.iter().enumerate();
    all.map(|(index, state)| {
        let centre = state.centre - least;
        let offset = model.offset(index, bodies.len());
        let of_cell = |element: u32| {
            let cell = corner(bricks, element);
            let cut = cut_faces(model, step, cell);
            let closed = [0, 1].map(|side| cut.of_walls[side] - cut.open[side]);
            let [low, high] = [0, 1].map(|side| {
                let own = |axis: usize| match cut.solid[side][axis] == first + index {
                    true => closed[side][axis],
                    false => 0.0,
                };
                DVec3::new(own(0), own(1), own(2))
            });
            let arm = (cell + 0.5) * size - centre;
            // In a cell that other solids cut as well, the volume is not the body's alone.
            let is_alone = [low, high] == closed;
            let missing = match is_alone && space.kind[element as usize] == FLUID {
                true => {
                    let all = step.open_extent(cell).element_product();
                    // From the distances to the body alone: those of all solids are moved outward
                    // as well.
                    let own = step.solids[first + index].corners(cell, size);
                    let part = |own: [f64; 8]| inside(&own.map(|value| value - offset));
                    0.5 * (low + high) - all * own.map_or(0.0, part)
                }
                false => DVec3::ZERO,
            };
            [high - low, step.velocity_step * missing].map(|push| moment(arm, push))
        };
        let cells = per_cell(bricks, of_cell);
        let mut weight = [0.0; 6];
        for [_, more] in &cells {
            weight = std::array::from_fn(|k| weight[k] + more[k]);
        }
        let touched = (0u32..)
            .zip(cells)
            .map(|(element, [push, _])| (element, push));
        let touched = touched.filter(|(_, push)| *push != [0.0; 6]);
        let (element, push) = touched.unzip();
        BodyCells {
            element,
            push,
            weight,
            response: responses[index].map(|row| row.map(|r| scale * r)),
        }
    })
    .collect()
}

/// Returns a push and its moment.
fn moment(arm: DVec3, push: DVec3) -> Six {
    let turn = arm.cross(push);
    [push.x, push.y, push.z, turn.x, turn.y, turn.z]
}

/// Reference pass of `flip/carry_bodies`: adds to closed faces the change of velocity of the body
/// that closes them.
pub fn carry_bodies(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    (bodies, changes): (&[BodyState], &[Six]),
    velocity: &mut [DVec3],
) {
    let first = step.solids.len() - bodies.len();
    let added = per_cell(bricks, |element| {
        let cell = corner(bricks, element);
        let cut = cut_faces(model, step, cell);
        if cut.near.is_empty() {
            return DVec3::ZERO;
        }
        let solid = cut.solid[0];
        let middle = (cell + 0.5) * model.cell_size();
        let of_axis = |axis: usize| {
            let is_closed = space.open[element as usize][axis] == 0.0;
            let body = solid[axis].checked_sub(first);
            let Some(body) = body.filter(|_| is_closed && cut.of_walls[0][axis] > 0.0) else {
                return 0.0;
            };
            let [vx, vy, vz, wx, wy, wz] = changes[body];
            let arm = middle - (bodies[body].centre - model.scene.domain.min);
            (DVec3::new(vx, vy, vz) + DVec3::new(wx, wy, wz).cross(arm))[axis]
        };
        DVec3::new(of_axis(0), of_axis(1), of_axis(2))
    });
    for (velocity, added) in velocity.iter_mut().zip(added) {
        *velocity += added;
    }
}

/// Returns the bodies with all these changes of their velocities.
pub(super) fn sped_up<'a>(
    bodies: &[BodyState],
    all: impl Iterator<Item = &'a Vec<Six>>,
) -> Vec<BodyState> {
    let mut bodies = bodies.to_vec();
    for changes in all {
        for (state, change) in bodies.iter_mut().zip(changes) {
            *state = state.sped_up(change);
        }
    }
    bodies
}

/// What contacts did to the bodies, where it is too much for the water not to know of it.
pub(super) struct Stopped {
    /// Changes of the bodies' velocities, m/s and rad/s.
    pub(super) changes: Vec<Six>,
    /// Which bodies keep their velocities in the projection that follows.
    held: Vec<bool>,
}

impl Stopped {
    /// Compares states before and after contacts in a substep of `length` seconds; `None` where no
    /// body was stopped or turned aside.
    pub(super) fn new(
        model: &Model,
        before: &[BodyState],
        after: &[BodyState],
        length: f64,
    ) -> Option<Self> {
        let held = model.scene.stopped(before, after, length);
        let both = after.iter().zip(before);
        let changes = both.map(|(after, before)| after.change_since(before));
        held.contains(&true).then(|| Self {
            changes: changes.collect(),
            held,
        })
    }

    /// Returns the bodies, without a response those that were stopped.
    pub(super) fn held(&self, bodies: &[BodyCells]) -> Vec<BodyCells> {
        let mut all = bodies.to_vec();
        for (body, _) in all.iter_mut().zip(&self.held).filter(|(_, held)| **held) {
            body.response = [[0.0; 6]; 6];
        }
        all
    }

    /// Adds to the bodies' velocities what the projection changed; returns that with the changes
    /// before it.
    pub(super) fn pushed(&self, by_pressure: &[Six], bodies: &mut [BodyState]) -> Vec<Six> {
        for (state, change) in bodies.iter_mut().zip(by_pressure) {
            *state = state.sped_up(change);
        }
        let both = self.changes.iter().zip(by_pressure);
        both.map(|(a, b)| std::array::from_fn(|k| a[k] + b[k]))
            .collect()
    }
}

impl Model {
    /// Returns the bodies' states after gravity and moorings have acted, without the water.
    pub fn predicted(&self, bodies: &[BodyState], substep: &Substep) -> Vec<BodyState> {
        let gravity = self.scene.water.gravity;
        let all = self.scene.bodies().zip(bodies);
        all.map(|(it, state)| {
            let state = BodyState {
                // Sums of lengths round.
                time: substep.start,
                ..*state
            };
            it.body.accelerated(&state, gravity, substep.kick)
        })
        .collect()
    }

    /// Returns the bodies' responses to impulses in a substep; see [`Body::held_response`].
    ///
    /// [`Body::held_response`]: swell_domain::body::Body::held_response
    pub fn responses(&self, bodies: &[BodyState], kick: f64) -> Vec<[Six; 6]> {
        let all = self.scene.bodies().zip(bodies);
        all.map(|(it, state)| it.body.held_response(state, kick))
            .collect()
    }

    /// Moves bodies to the end of a substep.
    pub(super) fn moved(&self, bodies: &[BodyState], length: f64) -> Vec<BodyState> {
        let all = self.scene.bodies().zip(bodies);
        all.map(|(it, state)| it.body.moved(state, length))
            .collect()
    }
}

impl Trace {
    /// Returns the changes of the bodies' velocities by the water in the substep.
    pub fn body_changes(&self) -> Vec<Six> {
        let mut sums = vec![[0.0; 6]; self.bodies.len()];
        let before: Vec<Six> = self.coupled.iter().map(BodyCells::before).collect();
        let all = self.projections().map(|projected| &projected.changes);
        for changes in [&before].into_iter().chain(all) {
            for (sum, change) in sums.iter_mut().zip(changes) {
                *sum = std::array::from_fn(|k| sum[k] + change[k]);
            }
        }
        sums
    }
}
