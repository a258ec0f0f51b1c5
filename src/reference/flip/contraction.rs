//! Reference passes of flip/find_strain, flip/find_contraction and flip/bend_paths.

use glam::DVec3;

use crate::Timings;
use swell_domain::{
    bricks::{Bricks, CELLS},
    poisson::FLUID,
};

use super::{
    Unprojected,
    grid::{along, corner, per_cell},
};

/// Walls and solids cut a cell that they leave less of.
pub(super) const WHOLE: f64 = 0.999;

/// Contraction in a substep up to which paths are straight; from twice as much they are not.
pub const MOST: f64 = 0.05;

/// Faces of one cell and those around it, by offsets from the cell.
struct Around<'a> {
    water: &'a Unprojected<'a>,
    velocity: &'a [DVec3],
    element: u32,
}

fn plus(a: [i32; 3], b: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}

/// A sum, and the sum of the magnitudes of its terms.
type Bounded = [f64; 2];

impl Around<'_> {
    fn at(&self, offset: [i32; 3]) -> usize {
        self.water.bricks.near(self.element, offset) as usize
    }

    fn is_full(&self, offset: [i32; 3]) -> bool {
        self.water.is_full(self.at(offset))
    }

    fn component(&self, component: usize, offset: [i32; 3]) -> f64 {
        self.velocity[self.at(offset)][component]
    }

    fn is_shut(&self, component: usize, offset: [i32; 3]) -> bool {
        self.water.space.open[self.at(offset)][component] == 0.0
    }

    /// Returns whether any face of the cell is closed.
    fn is_bounded(&self) -> bool {
        (0..3).any(|axis| self.is_shut(axis, [0; 3]) || self.is_shut(axis, along(axis, 1)))
    }

    /// Returns the slope of each component along its own axis in the cell at `offset`, m/s per
    /// cell. Of a closed face the particles near it only know the side that they are on: there the
    /// slope follows from the other two.
    fn slopes_along(&self, offset: [i32; 3]) -> [Bounded; 3] {
        let upper = |axis: usize| plus(offset, along(axis, 1));
        let own =
            [0, 1, 2].map(|axis| self.component(axis, upper(axis)) - self.component(axis, offset));
        let is_closed =
            [0, 1, 2].map(|axis| self.is_shut(axis, offset) || self.is_shut(axis, upper(axis)));
        let is_alone = is_closed.iter().filter(|&&is_closed| is_closed).count() == 1;
        [0, 1, 2].map(|axis| {
            let [first, second] = [own[(axis + 1) % 3], own[(axis + 2) % 3]];
            match is_closed[axis] && is_alone {
                true => [-(first + second), first.abs() + second.abs()],
                false => [own[axis], own[axis].abs()],
            }
        })
    }

    /// Returns the sum of the second minors ∂_i u_i ∂_j u_j − ∂_i u_j ∂_j u_i of the velocity's
    /// gradient, (m/s)² per square of a cell. The former slopes are those in the middle of the
    /// cell, the latter those at its edges: on a staggered grid the sum over all cells between
    /// walls is 0, as the minors are a divergence. On closed faces the product is 0, because water
    /// that slides along them has the same velocity into them everywhere. Of the other edges only
    /// those count whose other cells along the axes are full.
    fn minors(&self) -> Bounded {
        let middle = self.slopes_along([0; 3]);
        // The slope of a component on one side of the cell, across another axis.
        let across = |component: usize, side: i32, axis: usize, to: i32| {
            let own = along(component, side.max(0));
            let next = plus(own, along(axis, to));
            f64::from(to) * (self.component(component, next) - self.component(component, own))
        };
        let mut sum = [0.0; 2];
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            sum[0] += middle[a][0] * middle[b][0];
            sum[1] += middle[a][1] * middle[b][1];
            let sides = [(-1, -1), (1, -1), (-1, 1), (1, 1)];
            let products = sides.into_iter().filter_map(|(i, j)| {
                let (of_a, of_b) = (along(a, i.max(0)), along(b, j.max(0)));
                let is_closed = self.is_shut(a, of_a)
                    || self.is_shut(b, of_b)
                    || self.is_shut(a, plus(of_a, along(b, j)))
                    || self.is_shut(b, plus(of_b, along(a, i)));
                let is_inner = self.is_full(along(a, i)) && self.is_full(along(b, j));
                match is_closed {
                    true => Some(0.0),
                    false => is_inner.then(|| across(a, i, b, j) * across(b, j, a, i)),
                }
            });
            let products: Vec<f64> = products.collect();
            for product in &products {
                let part = product / products.len() as f64;
                sum = [sum[0] - part, sum[1] + part.abs()];
            }
        }
        sum
    }

    /// Returns, at the edge between the lower face of `axis` of the cell at `at` and the one at
    /// `at + to`, the mean of a component times the slope there of the face's own component; `None`
    /// if it does not count.
    fn carried_at_edge(
        &self,
        (axis, component): (usize, usize),
        at: [i32; 3],
        side: i32,
    ) -> Option<f64> {
        let back = plus(at, along(axis, -1));
        let to = |from: [i32; 3]| plus(from, along(component, side));
        let edge = |from: [i32; 3]| plus(from, along(component, side.max(0)));
        let is_near = [back, at].map(|from| self.is_full(to(from)));
        let is_closed = self.is_shut(axis, to(at))
            || self.is_shut(component, edge(at))
            || self.is_shut(component, edge(back));
        if is_closed {
            return Some(0.0);
        }
        if is_near == [false; 2] {
            return None;
        }
        let known = [back, at].into_iter().zip(is_near);
        let known = known.filter(|(from, is_near)| *is_near || self.is_full(*from));
        let known: Vec<f64> = known
            .map(|(from, _)| self.component(component, edge(from)))
            .collect();
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        Some(f64::from(side) * mean * (self.component(axis, to(at)) - self.component(axis, at)))
    }

    /// Returns what flows through the lower face of `axis` of the cell at `at`, (m/s)²:
    /// ½ Σ_j (u_i ∂_j u_j − u_j ∂_j u_i), whose divergence is the sum of minors.
    fn through_lower(&self, axis: usize, at: [i32; 3]) -> Bounded {
        if self.is_shut(axis, at) {
            return [0.0; 2];
        }
        let beside = [plus(at, along(axis, -1)), at];
        let known = beside.into_iter().filter(|&offset| self.is_full(offset));
        let slopes: Vec<[Bounded; 3]> = known.map(|offset| self.slopes_along(offset)).collect();
        let own = self.component(axis, at);
        let mut sum = [0.0; 2];
        for component in [(axis + 1) % 3, (axis + 2) % 3] {
            let mean = |k: usize| {
                let all: f64 = slopes.iter().map(|slopes| slopes[component][k]).sum();
                all / slopes.len().max(1) as f64
            };
            sum[0] += own * mean(0);
            sum[1] += own.abs() * mean(1);
            let edges = [-1, 1].into_iter();
            let edges = edges.filter_map(|side| self.carried_at_edge((axis, component), at, side));
            let edges: Vec<f64> = edges.collect();
            for edge in &edges {
                let part = edge / edges.len() as f64;
                sum = [sum[0] - part, sum[1] + part.abs()];
            }
        }
        sum.map(|sum| 0.5 * sum)
    }

    /// Returns the sum of what flows through the faces of a cell, times their open parts and the
    /// straight parts of the paths there, (m/s)².
    fn through_faces(&self, bend: &[f64]) -> Bounded {
        let faces = (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]);
        faces.fold([0.0; 2], |sum, (axis, side)| {
            let at = along(axis, side);
            let open = self.water.space.open[self.at(at)][axis];
            let mut position = local(self.element) + 0.5;
            position[axis] += f64::from(side) - 0.5;
            let straight = straight_at(self.water.bricks, bend, self.element, position);
            let sign = f64::from(2 * side - 1);
            let [own, size] = self.through_lower(axis, at).map(|part| open * part);
            [sum[0] + sign * straight * own, sum[1] + size]
        })
    }
}

/// Returns the corner of an element's cell, from that of its brick, in cells.
fn local(element: u32) -> DVec3 {
    let cell = element % CELLS;
    DVec3::from_array([cell % 8, cell / 8 % 8, cell / 64].map(f64::from))
}

/// Returns the slots of an element's brick and those on the cell's side of its middle, x fastest.
fn slots_beside(bricks: &Bricks, element: u32) -> [usize; 8] {
    let cell = local(element);
    let brick = &bricks.records[(element / CELLS) as usize];
    std::array::from_fn(|k| {
        let step = |axis: usize| match ((k >> axis) & 1, cell[axis] < 4.0) {
            (0, _) => 1,
            (_, true) => 0,
            (_, false) => 2,
        };
        brick.neighbors[step(0) + 3 * step(1) + 9 * step(2)] as usize
    })
}

/// Returns how straight paths are at a position in cells from the corner of an element's brick, on
/// the cell's side of its middle: linear between the middles of bricks. Absent bricks do not count.
fn straight_at(bricks: &Bricks, bend: &[f64], element: u32, position: DVec3) -> f64 {
    let beside = (position - 4.0).abs() / 8.0;
    let weight = |k: usize| {
        let of = |axis: usize| match (k >> axis) & 1 {
            0 => 1.0 - beside[axis],
            _ => beside[axis],
        };
        of(0) * of(1) * of(2)
    };
    let slots = slots_beside(bricks, element).into_iter().enumerate();
    let present = slots.filter(|(_, slot)| *slot > 0);
    let sums = present.fold([0.0; 2], |[bent, all], (k, slot)| {
        [bent + weight(k) * bend[slot], all + weight(k)]
    });
    1.0 - sums[0] / sums[1]
}

/// Returns the weight of the midpoint rule in the path from `x`, in cells, within the cell of an
/// element.
pub(super) fn bend_at(bricks: &Bricks, bend: &[f64], element: u32, x: DVec3) -> f64 {
    let position = x - corner(bricks, element) + local(element);
    1.0 - straight_at(bricks, bend, element, position)
}

impl Unprojected<'_> {
    /// Returns whether a cell is full of water.
    fn is_full(&self, element: usize) -> bool {
        self.space.kind[element] == FLUID && self.density[element] >= 0.5
    }

    /// Returns whether a cell is full of water, and open but for a thousandth and `lean`.
    pub fn strains(&self, element: u32, lean: f64) -> bool {
        let e = element as usize;
        self.is_full(e) && self.space.volume[e] >= WHOLE - lean
    }

    fn around<'a>(&'a self, velocity: &'a [DVec3], element: u32) -> Around<'a> {
        Around {
            water: self,
            velocity,
            element,
        }
    }

    /// Returns what straight paths by the velocities `of` faces contract by in a substep, as a part
    /// of the cell's volume, and the sum of the magnitudes of its terms. `bend` has the part of the
    /// midpoint rule in each slot.
    pub fn contraction(&self, of: &[DVec3], bend: &[f64], element: u32) -> [f64; 2] {
        let around = self.around(of, element);
        let slots = slots_beside(self.bricks, element);
        let is_straight = slots.iter().all(|&slot| bend[slot] == 0.0);
        let is_whole = self.space.volume[element as usize] >= WHOLE;
        let sum = match is_straight && is_whole && !around.is_bounded() {
            true => around.minors(),
            false => around.through_faces(bend),
        };
        let square = self.rate().powi(2);
        [-square * sum[0], square * sum[1]]
    }

    /// Returns cells per m/s in a substep.
    pub fn rate(&self) -> f64 {
        self.step.length / self.model.cell_size()
    }

    /// Returns the largest of a value over the cells that count of the 27 bricks around each, by
    /// slot.
    pub fn spread(&self, lean: f64, value: impl Fn(u32) -> f64 + Sync) -> Vec<f64> {
        let cells = per_cell(self.bricks, |element| match self.strains(element, lean) {
            true => value(element),
            false => 0.0,
        });
        let own: Vec<f64> = cells
            .chunks(CELLS as usize)
            .map(|cells| cells.iter().copied().fold(0.0, f64::max))
            .collect();
        let mut found = vec![0.0_f64; own.len()];
        for (slot, most) in own.iter().enumerate().skip(1) {
            for &near in &self.bricks.records[slot].neighbors {
                if near > 0 {
                    found[near as usize] = most.max(found[near as usize]);
                }
            }
        }
        found
    }

    /// Reference pass of flip/find_strain: returns the weight of the midpoint rule in each slot
    /// where straight paths by the velocities before forces would contract the water by much, there
    /// or in a brick beside it. Cells count that are open but for a thousandth and `lean`.
    pub fn strain(&self, lean: f64) -> Vec<f64> {
        let rate = self.rate();
        self.spread(lean, |element| {
            bend_of(rate.powi(2) * self.around(&self.faces.change, element).minors()[0])
        })
    }

    /// Returns the weight of the midpoint rule in particles' paths in each slot: where `strained`
    /// has it, and where the projected velocities contract the water by much more or less than the
    /// projection has made up for by the fluxes `made_up`, there or in a brick beside it. Cells are
    /// counted as in [`Self::strain`].
    pub fn bend(&self, made_up: &[f64], strained: &[f64], lean: f64) -> Vec<f64> {
        let rate = self.rate();
        let mut bend = self.spread(lean, |element| {
            let lost = self.contraction(&self.faces.velocity, strained, element)[0];
            bend_of(lost - made_up[element as usize] * rate)
        });
        for (bend, strained) in bend.iter_mut().zip(strained) {
            *bend = bend.max(*strained);
        }
        bend
    }
}

/// Returns the weight of the midpoint rule in the paths of water of which a substep contracts an
/// unknown part.
fn bend_of(part: f64) -> f64 {
    (part.abs() / MOST - 1.0).clamp(0.0, 1.0)
}

/// Returns the fluxes, m/s, that the projection has to let into the cells because water that
/// strains contracts when its particles go straight on: paths x + Δt u multiply volumes by
/// 1 + Δt ∇·u + Δt² m + …, with the sum m of the second minors of ∇u, which ∇·u = −Δt m makes up
/// for. `strained` is from [`Unprojected::strain`].
pub fn find_contraction(water: &Unprojected<'_>, strained: &[f64]) -> Vec<f64> {
    per_cell(water.bricks, |element| {
        match water.is_full(element as usize) {
            true => water.contraction(&water.faces.change, strained, element)[0] / water.rate(),
            false => 0.0,
        }
    })
}

/// What is known of straight paths before the projection; empty if none are straight.
#[derive(Default)]
pub(super) struct Straight {
    /// From [`Unprojected::strain`].
    strained: Vec<f64>,
    /// From [`find_contraction`].
    pub(super) contraction: Vec<f64>,
}

impl Straight {
    pub(super) fn before_projection(water: &Unprojected<'_>, timings: &mut Timings) -> Self {
        let strained = timings.time("flip/find_strain", || water.strain(0.0));
        let find = || find_contraction(water, &strained);
        let contraction = timings.time("flip/find_contraction", find);
        Self {
            strained,
            contraction,
        }
    }

    /// Reference pass of flip/bend_paths, after the projection; empty if paths are not straight.
    pub(super) fn bend(&self, water: &Unprojected<'_>) -> Vec<f64> {
        match self.contraction[..] {
            [] => Vec::new(),
            _ => water.bend(&self.contraction, &self.strained, 0.0),
        }
    }
}
