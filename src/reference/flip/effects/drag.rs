//! Air drag on particles before the transfer to the grid.

use glam::DVec3;

use super::{
    super::{FlipSubstep, Model, Sorted, grid::neighborhood},
    Acts, Flying,
};
use crate::Timings;
use swell_domain::{
    air::{blown, exposure},
    bricks::{Bricks, CELLS},
    flip::PLANE_SHARE,
    parallel,
    poisson::SOLID,
};
use swell_scene::effects::drag::Settings;

/// Returns the water fraction around a particle of a cell: the other particles over what the open
/// ones of 27 cells hold. It is 0 for a lone particle, 1 deep in water. `kind` gives the kinds of
/// cells; walls and solids are excluded.
pub fn share(model: &Model, bricks: &Bricks, kind: &[u32], sorted: &Sorted, element: u32) -> f64 {
    let cell = bricks.cell(element);
    let is_beyond = |offset: [i32; 3]| {
        (0..3).any(|axis| {
            let there = i64::from(cell[axis]) + i64::from(offset[axis]);
            !model.scene.periodic[axis] && !(0..i64::from(model.cells[axis])).contains(&there)
        })
    };
    let is_open = |offset: &[i32; 3]| {
        let other = bricks.near(element, *offset);
        !is_beyond(*offset) && (other < CELLS || kind[other as usize] != SOLID)
    };
    let open: Vec<[i32; 3]> = neighborhood().filter(is_open).collect();
    let inside = |offset: &[i32; 3]| sorted.of(bricks.near(element, *offset)).len();
    let particles: usize = open.iter().map(inside).sum();
    let held = open.len().max(1) as f64 * f64::from(model.settings().particles_per_cell);
    (particles.max(1) - 1) as f64 / held
}

/// Returns the velocities of the sorted particles after drag in a step, without gravity's change in
/// the step, m/s (effects/drag_by_cells).
pub fn drag_by_cells(
    settings: &Settings,
    step: &FlipSubstep<'_>,
    sorted: &Sorted,
    share: impl Fn(u32) -> f64 + Sync,
) -> Vec<DVec3> {
    let wet = CELLS as usize..sorted.start.len() - 1;
    parallel::flat_map(wet, |element| {
        let element = element as u32;
        let own = sorted.of(element);
        let part = match own.is_empty() {
            true => 0.0,
            false => exposure(share(element), PLANE_SHARE),
        };
        sorted.cloud.velocity[own].iter().map(move |&v| match part {
            0.0 => v,
            part => {
                let both = [v, step.velocity_step];
                let seconds = part * step.kick;
                blown(both, settings.wind(), settings.drop_radius, seconds) - step.velocity_step
            }
        })
    })
}

impl Acts for Settings {
    fn on_particles(&self, flying: Flying<'_>, sorted: &mut Sorted, timings: &mut Timings) {
        let Flying {
            model,
            step,
            bricks,
            kind,
        } = flying;
        sorted.cloud.velocity = timings.time("effects/drag_by_cells", || {
            drag_by_cells(self, step, sorted, |element| {
                share(model, bricks, kind, sorted, element)
            })
        });
    }
}
