//! Reference passes of the scene's forces on FLIP's grid and on isolated droplets.

use glam::DVec3;

use super::{
    Faces, FlipSubstep, GridTransfer, Model, OpenSpace, Sorted,
    grid::{along, corner, per_cell},
};
use crate::Timings;
use swell_domain::{
    bricks::{Bricks, CELLS},
    forces::{ForceField, Medium},
    frame::change_by_turn,
    parallel,
};

impl Model {
    /// Whether forces act on the water.
    pub fn has_forces(&self) -> bool {
        self.scene.has_forces_on(Medium::Water)
    }

    /// Returns the forces on the water in a substep.
    pub fn forces(&self, step: &FlipSubstep<'_>) -> ForceField<'_> {
        let span = (step.start + 0.5 * step.length - step.kick, step.kick);
        (self.scene).force_field(Medium::Water, span)
    }

    /// Returns the rotation of velocities by Coriolis's acceleration over half a substep.
    pub fn half_turn(&self, step: &FlipSubstep<'_>) -> Option<(DVec3, f64)> {
        let span = (step.start + 0.5 * step.length - step.kick, step.kick);
        self.scene.half_turn(span)
    }

    /// Returns the velocity change by forces in a substep at a position, m/s.
    fn impulse(&self, field: &ForceField<'_>, step: &FlipSubstep<'_>, place: DVec3) -> DVec3 {
        step.kick * field.at(self.scene.domain.min + place)
    }

    /// Returns the centre of a cell's lower face, metres.
    pub fn face_center(&self, bricks: &Bricks, element: u32, axis: usize) -> DVec3 {
        let place = corner(bricks, element) + 0.5 - 0.5 * DVec3::AXES[axis];
        place * self.cell_size()
    }
}

/// Returns the face velocities after forces, m/s (effects/push_faces). Shapes (elements).
pub fn push_faces(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    velocity: &[DVec3],
) -> Vec<DVec3> {
    let field = model.forces(step);
    per_cell(bricks, |element| {
        let e = element as usize;
        let change = |axis: usize| {
            let place = model.face_center(bricks, element, axis);
            model.impulse(&field, step, place)[axis]
        };
        let change = DVec3::new(change(0), change(1), change(2));
        let is_open = space.open[e].cmpgt(DVec3::ZERO);
        velocity[e] + DVec3::select(is_open, change, DVec3::ZERO)
    })
}

/// Accelerates isolated droplets, which the grid's change of velocity does not reach
/// (effects/push_drops).
pub fn push_drops(
    model: &Model,
    step: &FlipSubstep<'_>,
    position: &[DVec3],
    given: &mut GridTransfer,
) {
    let field = model.forces(step);
    for (i, &place) in position
        .iter()
        .enumerate()
        .filter(|(i, _)| given.is_drop[*i])
    {
        given.velocity[i] += model.impulse(&field, step, place);
        given.carried[i] = given.velocity[i];
    }
}

/// Returns the work of forces on the particles of each cell in bricks with water, over a particle's
/// mass, m²/s² (effects/work_by_cells): from `CELLS` on, in the order of the elements.
pub fn work_by_cells(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    sorted: &Sorted,
    (faces, space): (&Faces, &OpenSpace),
    given: &GridTransfer,
) -> Vec<f64> {
    let field = model.forces(step);
    let at_face = |element: u32, axis: usize, place: DVec3| {
        let e = element as usize;
        let mean = faces.velocity[e][axis] - 0.5 * faces.change[e][axis];
        match space.open[e][axis] > 0.0 {
            true => model.impulse(&field, step, place)[axis] * mean,
            false => 0.0,
        }
    };
    let on_water = |element: u32| -> f64 {
        let along_axis = |axis: usize| {
            let low = model.face_center(bricks, element, axis);
            let high = low + model.cell_size() * DVec3::AXES[axis];
            let next = bricks.near(element, along(axis, 1));
            0.5 * (at_face(element, axis, low) + at_face(next, axis, high))
        };
        (0..3).map(along_axis).sum()
    };
    let on_drop = |i: usize| {
        let change = model.impulse(&field, step, sorted.cloud.position[i]);
        change.dot(given.velocity[i] - 0.5 * (step.velocity_step + change))
    };
    let wet = CELLS as usize..(CELLS * (bricks.wet + 1)) as usize;
    parallel::map(wet, |element| {
        let element = element as u32;
        let (drops, water): (Vec<usize>, Vec<usize>) =
            sorted.of(element).partition(|&i| given.is_drop[i]);
        let on_water = match water.len() {
            0 => 0.0,
            count => count as f64 * on_water(element),
        };
        drops.into_iter().map(on_drop).sum::<f64>() + on_water
    })
}

/// Applies forces to the face velocities before the projection.
pub(super) fn on_faces(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    faces: &mut Faces,
    timings: &mut Timings,
) {
    if model.has_forces() {
        faces.velocity = timings.time("effects/push_faces", || {
            push_faces(model, step, bricks, space, &faces.velocity)
        });
    }
}

/// Turns the velocities of the particles by Coriolis's acceleration over half a substep, where the
/// domain rotates (effects/turn_sorted).
pub(super) fn turn_sorted(
    model: &Model,
    step: &FlipSubstep<'_>,
    velocity: &mut [DVec3],
    timings: &mut Timings,
) {
    if let Some(turn) = model.half_turn(step) {
        timings.time("effects/turn_sorted", || {
            for v in velocity {
                *v += change_by_turn(turn, *v);
            }
        });
    }
}

/// Applies forces to isolated droplets, turns all velocities, and returns the work of all forces,
/// joules.
pub(super) fn after_transfer(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    sorted: &Sorted,
    seen: (&Faces, &OpenSpace),
    given: &mut GridTransfer,
    timings: &mut Timings,
) -> f64 {
    if !model.has_forces() {
        return 0.0;
    }
    timings.time("effects/push_drops", || {
        push_drops(model, step, &sorted.cloud.position, given);
    });
    let work = timings.time("effects/work_by_cells", || {
        work_by_cells(model, step, bricks, sorted, seen, given)
    });
    turn_sorted(model, step, &mut given.velocity, timings);
    if model.half_turn(step).is_some() {
        let drops = given.carried.iter_mut().zip(&given.velocity);
        for ((carried, velocity), _) in drops.zip(&given.is_drop).filter(|(_, is_drop)| **is_drop) {
            *carried = *velocity;
        }
    }
    model.scene.particle_mass() * work.into_iter().sum::<f64>()
}
