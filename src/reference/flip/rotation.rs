//! Reference passes of shaders/effects/grid_curl.wgsl and grid_confinement.wgsl.

use glam::DVec3;

use super::{
    FlipSubstep, Model, OpenSpace,
    grid::{along, per_cell},
};
use swell_domain::{bricks::Bricks, poisson::FLUID};

fn is_water(space: &OpenSpace, element: u32) -> bool {
    space.kind[element as usize] == FLUID
}

/// Returns the mean velocity of a cell's faces along each axis.
fn at_center(bricks: &Bricks, velocity: &[DVec3], element: u32) -> DVec3 {
    let upper = |axis: usize| velocity[bricks.near(element, along(axis, 1)) as usize][axis];
    0.5 * (velocity[element as usize] + DVec3::new(upper(0), upper(1), upper(2)))
}

/// Returns ω = ∇ × u at the centres of cells with water, 1/s, by differences between the
/// neighbouring cells; one-sided if a neighbour has no water. Shape (elements).
pub fn grid_curl(
    model: &Model,
    bricks: &Bricks,
    space: &OpenSpace,
    velocity: &[DVec3],
) -> Vec<DVec3> {
    per_cell(bricks, |element| {
        if !is_water(space, element) {
            return DVec3::ZERO;
        }
        let slope = |axis: usize| {
            let [before, after] = [-1, 1].map(|step| bricks.near(element, along(axis, step)));
            let count = [before, after].map(|e| f64::from(u8::from(is_water(space, e))));
            let value = |e: u32| {
                let kept = if is_water(space, e) { e } else { element };
                at_center(bricks, velocity, kept)
            };
            (value(after) - value(before)) / (model.cell_size() * (count[0] + count[1]).max(1.0))
        };
        let [x, y, z] = [0, 1, 2].map(slope);
        DVec3::new(y.z - z.y, z.x - x.z, x.y - y.x)
    })
}

/// Returns the velocities after vorticity confinement a = ε Δx (N × ω), N = η/|η|, η = ∇|ω| (Fedkiw
/// et al. 2001), at faces between two cells of water.
pub fn grid_confinement(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    strength: f64,
    vorticity: &[DVec3],
    velocity: &[DVec3],
) -> Vec<DVec3> {
    let at = |element: u32, offset: [i32; 3]| vorticity[bricks.near(element, offset) as usize];
    // N × ω along the normal of the lower face, 1/s.
    let confinement = |element: u32, normal: usize| {
        let own = at(element, [0; 3]);
        let before = at(element, along(normal, -1));
        let slope = |axis: usize| {
            if axis == normal {
                return 2.0 * (own.length() - before.length());
            }
            let central = |back: i32| {
                let [low, high] = [-1, 1].map(|step| {
                    let mut offset = along(axis, step);
                    offset[normal] = back;
                    at(element, offset).length()
                });
                high - low
            };
            0.5 * (central(0) + central(-1))
        };
        let slope = DVec3::new(slope(0), slope(1), slope(2));
        let steepness = slope.length();
        // Below the rounding error of |ω| in f32 the direction is noise.
        if steepness <= 1e-5 * (own.length() + before.length()) {
            return 0.0;
        }
        (slope / steepness).cross(0.5 * (own + before))[normal]
    };
    per_cell(bricks, |element| {
        let e = element as usize;
        let pushed = |axis: usize| {
            let is_between = is_water(space, element)
                && is_water(space, bricks.near(element, along(axis, -1)))
                && space.open[e][axis] > 0.0;
            if is_between {
                confinement(element, axis)
            } else {
                0.0
            }
        };
        let push = DVec3::new(pushed(0), pushed(1), pushed(2));
        velocity[e] + step.kick * strength * model.cell_size() * push
    })
}
