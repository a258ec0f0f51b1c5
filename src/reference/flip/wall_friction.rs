//! No-slip walls (flip/wall_friction).

use glam::DVec3;

use super::{
    Faces, FlipSubstep, Model, OpenSpace,
    grid::{corner, per_cell},
};
use swell_domain::{bricks::Bricks, flip::VON_KARMAN};

/// Bit that is set if particles gave a component a velocity.
const KNOWN: u32 = 0x80;

/// Slows water within a cell of no-slip walls along them, by the shear stress ρ (κ u)² of Prandtl's
/// mixing length κ y with the mean gradient u / y between the wall, where water is at rest, and a
/// face at distance y.
pub fn wall_friction(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    faces: &mut Faces,
) {
    let rates = friction_rates(model, step, bricks, space, faces);
    for (velocity, rate) in faces.velocity.iter_mut().zip(rates) {
        *velocity /= 1.0 + step.length * rate;
    }
}

/// Returns the rates at which [`wall_friction`] slows each component at the lower faces, 1/s. Shape
/// (elements).
pub fn friction_rates(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    faces: &Faces,
) -> Vec<DVec3> {
    let is_known = |e: usize, axis: usize| faces.layer[e] >> (8 * axis) & KNOWN != 0;
    // The velocity along `other` at the lower face along `own`: the mean of those of the four faces
    // around it to which particles gave a velocity.
    let velocity_across = |element: u32, own: usize, other: usize| {
        let about = (0..4).map(|k| {
            let mut offset = [0; 3];
            offset[other] = k & 1;
            offset[own] = -(k >> 1);
            bricks.near(element, offset) as usize
        });
        let known: Vec<f64> = about
            .filter(|&e| is_known(e, other))
            .map(|e| faces.change[e][other])
            .collect();
        known.iter().sum::<f64>() / known.len().max(1) as f64
    };
    per_cell(bricks, |element| {
        let e = element as usize;
        let parts = model.wall_parts(step, corner(bricks, element) + 0.5);
        let rate = |own: usize| {
            if space.open[e][own] == 0.0 || !is_known(e, own) {
                return 0.0;
            }
            let of_walls = [1, 2].map(|turn| {
                let (across, other) = ((own + turn) % 3, (own + 3 - turn) % 3);
                let along = faces.change[e][own].hypot(velocity_across(element, own, other));
                parts[across] * along
            });
            VON_KARMAN * VON_KARMAN / model.cell_size() * (of_walls[0] + of_walls[1])
        };
        match parts == DVec3::ZERO {
            true => DVec3::ZERO,
            false => DVec3::new(rate(0), rate(1), rate(2)),
        }
    })
}

impl Model {
    /// Returns the part of the layer of one cell beside each no-slip wall that rows of faces at
    /// `place` represent, across each axis.
    fn wall_parts(&self, step: &FlipSubstep<'_>, place: DVec3) -> DVec3 {
        let part = |distance: f64| (1.5 - distance).clamp(0.0, 1.0);
        (self.scene.no_slip.iter()).fold(DVec3::ZERO, |mut parts, wall| {
            let axis = wall.axis;
            parts[axis] += match wall.is_max {
                true => part(step.cut.max[axis] - place[axis]),
                false => part(place[axis] - step.cut.min[axis]),
            };
            parts
        })
    }
}
