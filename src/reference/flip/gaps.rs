//! Twin of the pass that closes gaps (flip/close_gaps).

use swell_domain::{
    bricks::{Bricks, CELLS},
    poisson::{AIR, FLUID},
};

use super::{
    Model, Room, Step,
    grid::{along, corner, per_cell},
    water::open_parts,
};

/// Cells of a gap, at most.
const MOST_GAP: i32 = 4;

/// A gap closes where its ends meet by more than this part of it.
const CLOSES: f64 = 0.75;

/// And by more than this part of a cell: what is less the density correction takes away.
const LEAST_CLOSING: f64 = 0.25;

/// A face that is open by less ends a gap: it would have to let through all that the gap takes.
const LEAST_WAY: f64 = 0.5;

/// Where a gap ends.
#[derive(Clone, Copy, Debug, Default)]
struct End {
    /// Whether it is water, or a face that is closed.
    is_water: bool,
    /// m/s, along the axis.
    velocity: f64,
    /// Cells of air up to the end.
    cells: i32,
    /// What all cells up to the end lack, in cells.
    gap: f64,
    /// Of that, what water beside the cell lacks.
    beside: f64,
}

/// What is known where gaps are looked for.
pub struct Gaps<'a> {
    /// The scheme.
    pub model: &'a Model,
    /// The substep.
    pub step: &'a Step<'a>,
    /// Where the elements are.
    pub bricks: &'a Bricks,
    /// With kinds from [`super::find_water`].
    pub room: &'a Room,
    /// From [`super::gather_centers`].
    pub density: &'a [f64],
    /// Of the lower faces, with gravity, m/s. Shape (elements, 3 components).
    pub velocity: &'a [glam::DVec3],
}

impl Gaps<'_> {
    /// What a cell lacks along an axis, in cells.
    fn lack(&self, element: u32, axis: usize) -> f64 {
        let parts = open_parts(self.step, self.bricks, self.room, element);
        let room = (parts[axis] * parts[3]).min(1.0);
        room * (1.0 - self.density[element as usize]).clamp(0.0, 1.0)
    }

    /// What walls leave of a cell's faces across an axis.
    fn across(&self, element: u32, axis: usize) -> f64 {
        let extent = self.step.open_extent(corner(self.bricks, element));
        extent[(axis + 1) % 3] * extent[(axis + 2) % 3]
    }

    /// The end of a gap on one side of a cell, none where it is too far; `lean` moves what is decided.
    fn end(&self, element: u32, axis: usize, side: i32, lean: f64) -> Option<End> {
        let mut end = End::default();
        for k in 0..MOST_GAP {
            let here = self.bricks.near(element, along(axis, side * k));
            let there = self.bricks.near(element, along(axis, side * (k + 1)));
            let face = if side > 0 { there } else { here } as usize;
            let open = self.room.open[face][axis];
            let least = (LEAST_WAY + lean) * self.across(here, axis);
            if (side < 0 || there >= CELLS) && open < least {
                // Of a face that is closed in part the velocity is the water's.
                let moves = !self.model.scene.moving_solids.is_empty();
                end.velocity = match open > 0.0 {
                    true if moves => self.room.closed_velocity[face][axis],
                    true => 0.0,
                    false => self.velocity[face][axis],
                };
                return Some(end);
            }
            if there < CELLS {
                return None;
            }
            let lack = self.lack(there, axis);
            end.gap += lack;
            if self.density[there as usize] >= 0.5 {
                end.is_water = true;
                end.velocity = self.velocity[face][axis];
                end.beside = if k == 0 { lack } else { 0.0 };
                return Some(end);
            }
            end.cells += 1;
        }
        None
    }

    /// What of a cell is filled in the substep because the ends of a gap meet, in cells, times the area across; none where none
    /// do. `lean` moves what is decided, so that what is decided by rounding is known.
    pub fn filled(&self, element: u32, lean: f64) -> Option<f64> {
        let is_looked_at = self.room.kind[element as usize] == AIR;
        let is_wet = element < CELLS * (self.bricks.wet + 1);
        let along_axis = |axis: usize| {
            let low = self.end(element, axis, -1, lean)?;
            let high = self.end(element, axis, 1, lean)?;
            let own = self.lack(element, axis);
            let gap = own + low.gap + high.gap;
            let closing =
                (low.velocity - high.velocity) * self.step.length / self.model.cell_size();
            let closes = closing > (CLOSES * gap).max(LEAST_CLOSING) + lean;
            let is_near = low.cells + high.cells < MOST_GAP;
            if !closes || !is_near || !(low.is_water || high.is_water) {
                return None;
            }
            let lack = self.across(element, axis) * (own + low.beside + high.beside);
            Some(lack * (closing / gap.max(1e-6)).clamp(0.0, 1.0))
        };
        (0..3)
            .filter(|_| is_looked_at && is_wet)
            .filter_map(along_axis)
            .max_by(f64::total_cmp)
    }
}

/// Makes the cells of gaps that close water: kinds and fluxes of the room, and distances of the surface, metres.
pub fn close_gaps(gaps: &Gaps<'_>, distance: &mut [f64]) -> Room {
    let filled = per_cell(gaps.bricks, |element| gaps.filled(element, 0.0));
    let size = gaps.model.cell_size();
    let mut room = gaps.room.clone();
    for (e, part) in filled.into_iter().enumerate() {
        if let Some(part) = part {
            room.kind[e] = FLUID;
            room.solid_flux[e] += part * size / gaps.step.length;
            distance[e] = -size;
        }
    }
    room
}
