//! Water without particles: to the device with a state, from substep to substep through changing
//! bricks, and back.

use super::{
    Flip,
    buffers::*,
    capacity::{bricks, capacity_of},
};
use crate::{SolveError, plan::Counts, trace::DeepBegun};
use swell_domain::{
    bricks::{Bricks, CELLS, EDGE},
    deep::{Deep, order},
    particles::{Particles, max_speed},
};

/// Where the deep water is between two substeps.
pub(super) struct DeepState {
    /// Bricks of [`DEEP`].
    layout: Bricks,
    /// Bricks that had water in the frame so far: what is deep may be in any of them, and has
    /// particles around it that move as far.
    was_wet: Vec<bool>,
    /// Largest speed of the deep water at the frame's start, m/s.
    pub(super) speed: f64,
}

impl Flip {
    /// Loads the deep cells of a state.
    pub(super) fn load_deep(&mut self, particles: &Particles) -> Result<(), SolveError> {
        let Some(band) = self.scene.band() else {
            return Ok(());
        };
        let was_wet = band.wet_bricks(particles);
        let layout = bricks(&self.scene, self.plan.grid_dims, &was_wet, 1);
        let grown = self.plan.counts.bricks.grown(capacity_of(&layout));
        if grown != self.plan.counts.bricks {
            self.refit(Counts {
                bricks: grown,
                ..self.plan.counts
            })?;
        }
        let mut values = vec![0.0f32; (layout.wet as usize + 1) * DEEP_VALUES * CELLS as usize];
        let deep = &particles.deep;
        for ((cell, depth), velocity) in deep.cell.iter().zip(&deep.depth).zip(&deep.velocity) {
            let first = first_value(layout.element(cell.map(i64::from)));
            let all = [velocity[0], velocity[1], velocity[2], *depth];
            for (plane, value) in all.into_iter().enumerate() {
                values[first + plane * CELLS as usize] = value;
            }
        }
        self.program.upload(DEEP, 0, &values);
        self.deep = Some(DeepState {
            layout,
            was_wet,
            speed: max_speed(&deep.velocity),
        });
        Ok(())
    }

    /// Adds the bricks that may hold deep water to those that hold particles.
    pub(super) fn with_deep(&mut self, is_wet: &[bool]) -> Vec<bool> {
        let Some(deep) = &mut self.deep else {
            return is_wet.to_vec();
        };
        for (was, is) in deep.was_wet.iter_mut().zip(is_wet) {
            *was |= is;
        }
        deep.was_wet.clone()
    }

    /// Refits the buffers to other counts, and keeps what is deep.
    pub(super) fn refit_around_deep(&mut self, counts: Counts) -> Result<(), SolveError> {
        let Some(deep) = &self.deep else {
            return self.refit(counts);
        };
        let count = (deep.layout.wet as usize + 1) * DEEP_VALUES * CELLS as usize;
        let values = self.program.read(DEEP, count)?;
        self.refit(counts)?;
        self.program.upload(DEEP, 0, &values);
        Ok(())
    }

    /// Returns the deep water at the end of a substep.
    pub(super) fn look_deep(&self) -> Result<Deep, SolveError> {
        if self.deep.is_none() {
            return Ok(Deep::default());
        }
        let count = (self.bricks.wet as usize + 1) * DEEP_VALUES * CELLS as usize;
        Ok(read(
            &self.scene,
            &self.bricks,
            &self.program.read(DEEP, count)?,
        ))
    }

    /// Returns what the next substep begins with.
    pub(super) fn deep_begun(&self) -> DeepBegun {
        let deep = self.deep.as_ref();
        deep.map_or_else(DeepBegun::default, |deep| DeepBegun {
            was_wet: deep.was_wet.clone(),
            speed: deep.speed,
        })
    }

    /// Lets the substep on the present bricks find the deep water of the one before.
    pub(super) fn relate_deep(&mut self) {
        let Some(deep) = &mut self.deep else {
            return;
        };
        let before = |slot: &u32| if *slot <= deep.layout.wet { *slot } else { 0 };
        let mut slots = vec![0u32; self.bricks.slots()];
        for (slot, old) in self.bricks.table.iter().zip(&deep.layout.table) {
            slots[*slot as usize] = before(old);
        }
        slots[0] = 0;
        self.program.upload(DEEP_SLOT, 0, &slots);
        deep.layout = self.bricks.clone();
    }
}

/// Index in [`DEEP`] of an element's first value.
fn first_value(element: u32) -> usize {
    let (slot, local) = (element / CELLS, element % CELLS);
    DEEP_VALUES * (slot * CELLS) as usize + local as usize
}

/// Returns all cells with water of a downloaded [`DEEP`]: those that have a depth.
pub(super) fn read(scene: &swell_scene::FlipScene, bricks: &Bricks, values: &[f32]) -> Deep {
    let Some(band) = scene.band() else {
        return Deep::default();
    };
    let mut deep = Deep {
        grid: band.grid,
        ..Deep::default()
    };
    // Slots with particles come first.
    let mut slots: Vec<u32> = (1..=bricks.wet).collect();
    slots.sort_by_key(|slot| order(bricks.records[*slot as usize].coordinate.map(|k| EDGE * k)));
    let elements = slots
        .iter()
        .flat_map(|slot| CELLS * slot..CELLS * (slot + 1));
    for element in elements {
        let cell = bricks.cell(element);
        let value = |plane: usize| values[first_value(element) + plane * CELLS as usize];
        let is_inside = (0..3).all(|axis| cell[axis] < band.grid.cells[axis]);
        if is_inside && value(3) > 0.0 {
            deep.cell.push(cell);
            deep.depth.push(value(3));
            deep.velocity.push([0, 1, 2].map(value));
        }
    }
    deep
}
