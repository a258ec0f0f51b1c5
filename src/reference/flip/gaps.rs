//! Reference pass of flip/close_gaps.

use glam::DVec3;
use swell_domain::{
    bricks::{Bricks, CELLS},
    parallel,
    poisson::{AIR, FLUID},
};

use super::{
    Faces, FlipSubstep, Model, OpenSpace,
    grid::{along, corner, per_cell},
    water::open_parts,
};

/// Most cells of a gap.
const MOST_GAP: i32 = 4;

/// A gap closes if its ends approach by more than this fraction of it.
const CLOSES: f64 = 0.75;

/// They must also approach by more than this fraction of a cell: the density correction handles
/// less.
const LEAST_CLOSING: f64 = 0.25;

/// A face with a smaller open fraction ends a gap: all the water that fills the gap would have to
/// pass it.
const LEAST_WAY: f64 = 0.5;

/// Inflow, in units of gravity's velocity change, from which a surface starts to count as that of a
/// full cell; from twice as much it does. Water at rest on a floor has 1.
const LEAST_INFLOW: f64 = 2.0;

/// End of a gap.
#[derive(Clone, Copy, Debug, Default)]
struct End {
    /// Whether the end is water, rather than a closed face.
    is_water: bool,
    /// Velocity along the axis, m/s.
    velocity: f64,
    /// Number of air cells up to the end.
    cells: i32,
    /// Missing water in all cells up to the end, in cells.
    gap: f64,
    /// The part of `gap` that water beside the cell lacks, in cells.
    beside: f64,
}

/// Water on the grid before the projection.
#[derive(Clone, Copy)]
pub struct Unprojected<'a> {
    /// Scene and grid.
    pub model: &'a Model,
    /// Parameters of the substep.
    pub step: &'a FlipSubstep<'a>,
    /// Layout of the elements.
    pub bricks: &'a Bricks,
    /// Open space, with cell kinds from [`super::find_water`], later from [`close_gaps`].
    pub space: &'a OpenSpace,
    /// Relative densities from [`super::gather_centers`].
    pub density: &'a [f64],
    /// Velocities at the lower faces, including gravity, and before forces.
    pub faces: &'a Faces,
}

impl Unprojected<'_> {
    /// Returns the length along an axis that a cell lacks, in cells.
    fn lack(&self, element: u32, axis: usize) -> f64 {
        let parts = open_parts(self.step, self.bricks, self.space, element);
        let space = (parts[axis] * parts[3]).min(1.0);
        space * (1.0 - self.density[element as usize]).clamp(0.0, 1.0)
    }

    /// Returns the area of a cell's faces across an axis that walls leave open.
    fn across(&self, element: u32, axis: usize) -> f64 {
        let extent = self.step.open_extent(corner(self.bricks, element));
        extent[(axis + 1) % 3] * extent[(axis + 2) % 3]
    }

    /// Returns the end of a gap on one side of a cell, if it is close enough. `lean` shifts the
    /// threshold for closed faces.
    fn end(&self, element: u32, axis: usize, side: i32, lean: f64) -> Option<End> {
        let mut end = End::default();
        for k in 0..MOST_GAP {
            let here = self.bricks.near(element, along(axis, side * k));
            let there = self.bricks.near(element, along(axis, side * (k + 1)));
            let face = if side > 0 { there } else { here } as usize;
            let open = self.space.open[face][axis];
            let least = (LEAST_WAY + lean) * self.across(here, axis);
            if (side < 0 || there >= CELLS) && open < least {
                // On a partly closed face the velocity is that of the water.
                let moves = !self.model.scene.moving_solids.is_empty();
                end.velocity = match open > 0.0 {
                    true if moves => self.space.closed_velocity[face][axis],
                    true => 0.0,
                    false => self.faces.velocity[face][axis],
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
                end.velocity = self.faces.velocity[face][axis];
                end.beside = if k == 0 { lack } else { 0.0 };
                return Some(end);
            }
            end.cells += 1;
        }
        None
    }

    /// Returns whether a cell is in a brick with particles.
    fn is_wet(&self, element: u32) -> bool {
        element < CELLS * (self.bricks.wet + 1)
    }

    /// Returns the terms of the velocity that the projection has to stop in a cell, m/s: of the
    /// lower faces, of the upper faces and of walls and solids. Their sum is the right-hand side of
    /// the cell's row, before inlets, wall friction and effects.
    pub fn inflow(&self, element: u32) -> [DVec3; 3] {
        let through =
            |face: u32| self.space.open[face as usize] * self.faces.velocity[face as usize];
        let upper = |axis: usize| through(self.bricks.near(element, along(axis, 1)))[axis];
        [
            through(element),
            -DVec3::new(upper(0), upper(1), upper(2)),
            -DVec3::X * self.space.solid_flux[element as usize],
        ]
    }

    /// Returns whether an inflow may change the distance to a cell's surface.
    pub fn is_hit(&self, element: u32) -> bool {
        let is_water = self.space.kind[element as usize] == FLUID;
        is_water && self.is_wet(element) && self.least_inflow() > 0.0
    }

    /// Returns the least inflow by which a surface counts as that of a full cell in part, m/s.
    pub fn least_inflow(&self) -> f64 {
        LEAST_INFLOW * self.step.velocity_step.length()
    }

    /// Returns the smallest open fraction of a cell's faces.
    fn least_open(&self, element: u32) -> f64 {
        let open = |face: u32, axis: usize| self.space.open[face as usize][axis];
        let upper = |axis: usize| open(self.bricks.near(element, along(axis, 1)), axis);
        (0..3)
            .map(|axis| open(element, axis).min(upper(axis)))
            .fold(1.0, f64::min)
    }

    /// Returns the distance to the surface by which the projection finds a cell's pressure, metres.
    /// A surface that water is about to hit moves on with it: near a cell's centre, where the
    /// pressure is 0, it would let all inflow out through the faces towards air, at a speed that
    /// grows without bound as θ and the substep shrink. Such a cell counts as full, in proportion
    /// to its least open face: beside a wall that would stop a whole cell of water at once where
    /// part of one arrives.
    pub fn hit_distance(&self, element: u32, own: f64) -> f64 {
        if !self.is_hit(element) {
            return own;
        }
        let inflow: DVec3 = self.inflow(element).into_iter().sum();
        let part = (inflow.element_sum() / self.least_inflow() - 1.0).clamp(0.0, 1.0);
        own + part * self.least_open(element) * (own.min(-self.model.cell_size()) - own)
    }

    /// Returns the volume of a cell that fills in the substep because the ends of a gap meet, in
    /// cells: the missing length times the area across; `None` if no gap closes. `lean` shifts the
    /// thresholds, to find decisions that rounding may change.
    pub fn filled(&self, element: u32, lean: f64) -> Option<f64> {
        let is_looked_at = self.space.kind[element as usize] == AIR;
        let is_wet = self.is_wet(element);
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

/// Turns the cells of closing gaps into water: returns the updated kinds and fluxes, and updates
/// the distances to the surface, metres, also where water hits a surface.
pub fn close_gaps(gaps: &Unprojected<'_>, distance: &mut [f64]) -> OpenSpace {
    let filled = per_cell(gaps.bricks, |element| gaps.filled(element, 0.0));
    parallel::for_each_mut(distance, |e, distance| {
        *distance = gaps.hit_distance(e as u32, *distance);
    });
    let size = gaps.model.cell_size();
    let mut space = gaps.space.clone();
    for (e, part) in filled.into_iter().enumerate() {
        if let Some(part) = part {
            space.kind[e] = FLUID;
            space.solid_flux[e] += part * size / gaps.step.length;
            distance[e] = -size;
        }
    }
    space
}
