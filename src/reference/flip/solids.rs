//! Solids by their signed distance: how they cut cells and push particles back.

use std::sync::Arc;

use glam::{BVec3, DVec3};

use super::Model;
use swell_domain::{
    pose::{Passage, Pose},
    shape::ShapeStep,
    signed_distance::SignedDistance,
};

/// A distance to a solid below this, in cells, counts as inside.
const SKIN: f64 = 1e-4;

/// Slope that cannot be told from level, as a multiple of a particle's share of a full cell.
const LEAST_SLOPE: f64 = 0.5;

/// Distance from a solid, in cells: friction is full below it, and none from twice that on. Half
/// the spacing of eight particles per cell.
const TOUCHES: f64 = 0.25;

/// A film on solids, in which particles have Coulomb friction with them: the grid knows its depth
/// only to half a particle of a full cell, so that surface slopes below that, and speeds below that
/// of a fall by that height, cannot be told from rest. That slope is the coefficient, and friction
/// fades between that speed and 1.41 times it.
pub(super) struct Film {
    /// Gravity times the substep's kick, m/s.
    pub(super) velocity_step: DVec3,
    /// See [`Substep::kick`](swell_scene::step::Substep::kick), seconds.
    pub(super) kick: f64,
    /// Edge length of a cell, metres.
    pub(super) cell_size: f64,
    /// Fraction of a full cell that a particle fills.
    pub(super) particle_share: f64,
    /// Whether the particle is an isolated droplet: it has static friction only.
    pub(super) is_drop: bool,
}

/// A solid at one moment.
#[derive(Clone, Debug)]
pub struct Solid<'a> {
    /// Signed distances in the initial pose, metres; of a solid whose shape changes only the grid
    /// without its values.
    pub grid: &'a SignedDistance,
    /// Surface of a solid whose shape changes.
    pub shape: Option<Arc<ShapeStep>>,
    /// Part of the substep that has passed.
    pub share: f64,
    /// Motion through the substep.
    pub passage: Passage,
    /// Pose at this moment.
    pub pose: Pose,
}

/// Open fractions of a cell that is cut by solids.
pub(super) struct Cut {
    /// Open fractions of the lower and of the upper faces, 0 to 1.
    pub(super) faces: [DVec3; 2],
    /// Open fraction of the volume, 0 to 1; exact for planes that vary along at most two axes.
    pub(super) volume: f64,
}

impl<'a> Solid<'a> {
    /// Creates a solid in its pose at the start of a passage.
    pub(super) fn new(grid: &'a SignedDistance, passage: Passage) -> Self {
        Self {
            grid,
            shape: None,
            share: 0.0,
            passage,
            pose: passage.start,
        }
    }

    /// Returns the solid with the shape that it has in this substep.
    pub(super) fn shaped(self, shape: Option<Arc<ShapeStep>>) -> Self {
        Self { shape, ..self }
    }

    /// Returns the solid in its pose after the fraction `share` of the substep.
    pub(super) fn after(&self, share: f64) -> Self {
        Self {
            pose: self.passage.at(share),
            share,
            ..self.clone()
        }
    }

    /// Returns the velocity of the solid's material point at `x`, m/s; where the shape changes, of
    /// the point of its surface that is nearest to the nodes around `x`.
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        let rigid = self.passage.velocity_at(x, self.pose.centre);
        match &self.shape {
            Some(shape) => rigid + shape.velocity_at(x),
            None => rigid,
        }
    }

    /// Returns the distance at a point in the initial pose, metres.
    fn sample(&self, own: DVec3) -> f64 {
        match &self.shape {
            Some(shape) => shape.sample(own, self.share),
            None => self.grid.sample(own),
        }
    }

    /// Returns its gradient.
    fn gradient(&self, own: DVec3) -> DVec3 {
        match &self.shape {
            Some(shape) => shape.gradient(own, self.share),
            None => self.grid.gradient(own),
        }
    }

    /// Returns the distance at a node, metres.
    fn node(&self, [i, j, k]: [usize; 3]) -> f64 {
        match &self.shape {
            Some(shape) => shape.node([i, j, k], self.share),
            None => self.grid.node(i, j, k),
        }
    }

    /// Slows the velocity `v` of a particle at `x` along the solid by the friction of a film (see
    /// [`Film`]), m/s.
    pub(super) fn slowed(&self, x: DVec3, v: DVec3, film: &Film) -> DVec3 {
        let touch = TOUCHES * film.cell_size;
        if self.near(x) >= 2.0 * (touch + self.grid.spacing) {
            return v;
        }
        let way = 0.5 * touch;
        let difference =
            |axis: DVec3| self.distance(x + way * axis) - self.distance(x - way * axis);
        let slope = DVec3::from_array(DVec3::AXES.map(difference));
        let normal = slope / slope.length().max(1e-20);
        let part = (2.0 - self.distance(x) / touch).clamp(0.0, 1.0);
        let pressing = (-film.velocity_step.dot(normal)).max(0.0);
        let most = part * LEAST_SLOPE * film.particle_share * pressing;
        let beside = v - self.velocity_at(x);
        let along = beside - normal * beside.dot(normal);
        let speed = along.length();
        let gravity = film.velocity_step.length() / film.kick;
        let square = 2.0 * gravity * LEAST_SLOPE * film.particle_share * film.cell_size;
        let over = match film.is_drop {
            true => speed / most.max(1e-20),
            false => speed * speed / square.max(1e-20),
        };
        v - along * ((2.0 - over).clamp(0.0, 1.0) * most / speed.max(1e-20)).min(1.0)
    }

    /// Returns an upper bound on the speed of points within the solid's grid, m/s.
    pub fn fastest(&self) -> f64 {
        let spin = self.passage.spin.length();
        let reach = match spin {
            0.0 => 0.0,
            _ => self.grid.reach(self.pose.rest),
        };
        let shape = self.shape.as_ref().map_or(0.0, |shape| shape.fastest);
        self.passage.velocity.length() + spin * reach + shape
    }

    fn last(&self) -> DVec3 {
        DVec3::from_array(self.grid.dims.map(|n| (n - 1) as f64))
    }

    /// Returns a position in node spacings, in the grid's frame.
    fn place(&self, x: DVec3) -> DVec3 {
        (self.pose.back(x) - self.grid.origin) / self.grid.spacing
    }

    /// Returns the trilinear distance at the point of the grid that is closest to `x`.
    fn distance(&self, x: DVec3) -> f64 {
        let place = self.place(x).clamp(DVec3::ZERO, self.last());
        self.sample(self.grid.origin + self.grid.spacing * place)
    }

    /// Returns the distance at the nearest node; far away outside the grid.
    fn near(&self, x: DVec3) -> f64 {
        let p = self.place(x);
        if p.cmplt(-DVec3::ONE).any() || p.cmpgt(self.last() + 1.0).any() {
            return 1e15;
        }
        let [i, j, k] = (p + 0.5).clamp(DVec3::ZERO, self.last()).to_array();
        self.node([i, j, k].map(|c| c as usize))
    }

    /// Returns the distance at the nearest node, or outside the grid the distance to the grid,
    /// which contains the solid.
    pub(super) fn bound(&self, x: DVec3) -> f64 {
        let place = self.place(x);
        let way = self.grid.spacing * place.distance(place.clamp(DVec3::ZERO, self.last()));
        if way > 0.0 { way } else { self.near(x) }
    }

    /// Returns the distances at the corners of a cell, x fastest; `None` if the solid is too far
    /// away to cut it.
    pub(super) fn corners(&self, cell: DVec3, cell_size: f64) -> Option<[f64; 8]> {
        let corner = |k: usize| {
            let step = [k & 1, k >> 1 & 1, k >> 2].map(|s| s as f64);
            self.at_corner(cell + DVec3::from_array(step), cell_size)
        };
        self.may_cut(cell, cell_size)
            .then(|| std::array::from_fn(corner))
    }

    /// Returns whether the solid comes close enough to a cell to cut it.
    pub(super) fn may_cut(&self, cell: DVec3, cell_size: f64) -> bool {
        let middle = (cell + 0.5) * cell_size;
        self.near(middle) < 2.0 * (cell_size + self.grid.spacing)
    }

    /// Returns the distance at a corner of cells, at `x`, in cells, metres.
    pub(super) fn at_corner(&self, x: DVec3, cell_size: f64) -> f64 {
        self.distance(x * cell_size) - SKIN * cell_size
    }

    /// Pushes `x` out along the gradient to the contact distance.
    pub(super) fn leave(&self, x: DVec3, contact: f64) -> DVec3 {
        let p = self.place(x);
        if p.cmplt(DVec3::ZERO).any() || p.cmpge(self.last()).any() {
            return x;
        }
        let own = self.grid.origin + self.grid.spacing * p;
        let distance = self.sample(own);
        let node = p.to_array().map(|c| c as usize);
        // Twice the spacing exceeds a cell's diagonal: with a node this far away, no contact can
        // occur within the cell.
        if self.node(node) > contact + 2.0 * self.grid.spacing || distance >= contact {
            return x;
        }
        let gradient = self.gradient(own);
        // Here the gradient is per metre; on the GPU it is per spacing.
        if gradient.length() < 1e-6 {
            return x;
        }
        x + self.pose.turn * gradient.normalize() * (contact - distance)
    }
}

/// Returns the sums over the corners of a cell's lower faces, or of its upper ones for `side` = 1.
pub(super) fn face_sums(corners: &[f64; 8], side: usize) -> DVec3 {
    let sum = |axis: usize| {
        (0..8)
            .filter(|k| k >> axis & 1 == side)
            .map(|k| corners[k])
            .sum()
    };
    DVec3::new(sum(0), sum(1), sum(2))
}

/// Returns how much the distance grows over a cell along each axis, metres.
pub(super) fn rise(corners: &[f64; 8]) -> DVec3 {
    (face_sums(corners, 1) - face_sums(corners, 0)) / 4.0
}

/// Computes how planes through a cell's corner distances cut it (Batty et al. 2007).
pub(super) fn cut(corners: &[f64; 8]) -> Cut {
    let part = |axis: usize, side: usize| {
        let (s, t) = ([1, 0, 0][axis], [2, 2, 1][axis]);
        open_part(std::array::from_fn(|k| {
            corners[side << axis | (k & 1) << s | (k >> 1) << t]
        }))
    };
    let faces = [0, 1].map(|side| DVec3::new(part(0, side), part(1, side), part(2, side)));
    let center = corners.iter().sum::<f64>() / 8.0;
    let volume = 0.5 + center / rise(corners).abs().element_sum().max(1e-20);
    Cut {
        faces,
        volume: volume.clamp(0.0, 1.0),
    }
}

/// Half cells along an axis of the hat function around a cell's centre: start of each, in cells
/// from the cell's minimum corner, and the function's mean over it.
const HALVES: [(f64, f64); 4] = [(-0.5, 0.25), (0.0, 0.75), (0.5, 0.75), (1.0, 0.25)];

/// What solids leave open of the hat function around a cell's centre.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OpenHat {
    /// Integral over the volume outside solids, relative to that outside walls only, 0 to 1.
    pub(super) part: f64,
    /// The same for each of four layers, half a cell thick, from the lowest up.
    pub(super) layers: [f64; 4],
}

impl OpenHat {
    /// Without solids.
    pub(super) const WHOLE: Self = Self {
        part: 1.0,
        layers: [1.0; 4],
    };

    /// Samples 4³ half cells, each cut by a plane. `corners` are the distances at the cell's
    /// corners. If particles are mirrored at walls, so are solids. Layers are along the axis
    /// closest to gravity.
    pub(super) fn of(
        model: &Model,
        step: &super::FlipSubstep<'_>,
        solids: &[&Solid<'_>],
        cell: DVec3,
        corners: &[f64; 8],
    ) -> Self {
        let (walls, cell_size) = (&step.cut, model.cell_size());
        let rise = ((face_sums(corners, 1) - face_sums(corners, 0)) / 4.0).abs();
        let width = (0.5 * rise.element_sum()).max(1e-20);
        let is_within = (cell + 0.5).cmpge(walls.min) & (cell + 0.5).cmple(walls.max);
        let mirrors = is_within & BVec3::splat(model.settings().density_correction);
        // As on the GPU: in f32 another axis may be the closest.
        let gravity = step.velocity_step.as_vec3().to_array();
        let axis = (0..3).fold(0, |most, axis| {
            if gravity[axis].abs() >= gravity[most].abs() {
                axis
            } else {
                most
            }
        });
        let (mut open, mut all) = ([0.0; 4], [0.0; 4]);
        for k in 0..64 {
            let half = [k & 3, k >> 2 & 3, k >> 4];
            let halves = half.map(|half| HALVES[half]);
            let low = cell + DVec3::from_array(halves.map(|(from, _)| from));
            let size = ((low + 0.5).min(walls.max) - low.max(walls.min)).max(DVec3::ZERO);
            let size = DVec3::select(mirrors, DVec3::splat(0.5), size);
            let hat = DVec3::from_array(halves.map(|(_, mean)| mean)) * size;
            let middle = low + 0.25;
            let image = middle.max(2.0 * walls.min - middle);
            let image = image.min(2.0 * walls.max - image);
            let place = cell_size * DVec3::select(mirrors, image, middle);
            let distances = solids.iter().map(|solid| solid.distance(place));
            let distance = distances.fold(1e15, f64::min) - SKIN * cell_size;
            let layer = match gravity[axis] > 0.0 {
                true => 3 - half[axis],
                false => half[axis],
            };
            all[layer] += hat.element_product();
            open[layer] += hat.element_product() * (0.5 + distance / width).clamp(0.0, 1.0);
        }
        let part = |open: f64, all: f64| if all > 0.0 { open / all } else { 1.0 };
        Self {
            part: part(open.iter().sum(), all.iter().sum()),
            layers: std::array::from_fn(|k| part(open[k], all[k])),
        }
    }
}

/// Returns the open fraction of a square from the distances at its corners (0,0), (1,0), (0,1),
/// (1,1).
fn open_part(corners: [f64; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let slopes = [(b + d - a - c).abs() / 2.0, (c + d - b - a).abs() / 2.0];
    let steep = slopes[0].max(slopes[1]);
    let flat = slopes[0].min(slopes[1]);
    let center = (a + b + c + d) / 4.0;
    let smaller = if center.abs() <= 0.5 * (steep - flat) {
        0.5 - center.abs() / steep.max(1e-20)
    } else {
        // Beyond the linear range only a corner is left, a triangle.
        let far = (0.5 * (steep + flat) - center.abs()).max(0.0);
        far * far / (2.0 * steep * flat).max(1e-20)
    };
    if center > 0.0 { 1.0 - smaller } else { smaller }
}

/// Removes the velocity component against a push.
fn stopped(v: DVec3, push: DVec3) -> DVec3 {
    v - push * (v.dot(push).min(0.0) / push.length_squared().max(1e-30))
}

/// Removes the velocity component into the walls that `x` touches or is beyond. The walls are moved
/// inward by the contact distance.
pub(super) fn at_walls(model: &Model, step: &super::FlipSubstep<'_>, v: DVec3, x: DVec3) -> DVec3 {
    let contact = model.contact_distance();
    let [slowest, fastest] = step.wall_velocity;
    let v = DVec3::select(x.cmplt(step.walls.min + contact), v.max(slowest), v);
    DVec3::select(x.cmpgt(step.walls.max - contact), v.min(fastest), v)
}

/// Each round at least halves the penetration depth of a particle between a wall and a solid at
/// 45°.
const CORNER_ROUNDS: usize = 4;

/// Moves a particle from `start` by `way` among solids, ignoring walls; returns its position and
/// velocity.
pub(super) fn go(
    model: &Model,
    step: &super::FlipSubstep<'_>,
    start: DVec3,
    way: DVec3,
    velocity: DVec3,
) -> (DVec3, DVec3) {
    let contact = model.contact_distance();
    let fastest = step.solids.iter().map(Solid::fastest);
    let most = way.length() + fastest.fold(0.0, f64::max) * step.length;
    let is_near =
        |solid: &Solid<'_>| solid.bound(start) < most + contact + 2.0 * solid.grid.spacing;
    if !step.solids.iter().any(is_near) {
        return (start + way, velocity);
    }
    // Steps of at most half a node spacing, so that thin solids are not skipped.
    let steps = (2.0 * most / step.solids[0].grid.spacing).ceil() as usize + 1;
    let (mut x, mut v) = (start, velocity);
    for k in 1..=steps {
        x += way / steps as f64;
        for solid in &step.solids {
            let next = x;
            let solid = solid.after(k as f64 / steps as f64);
            x = solid.leave(next, contact);
            let pushing = solid.velocity_at(x);
            v = pushing + stopped(v - pushing, x - next);
        }
    }
    let v = at_walls(model, step, v, x);
    let (low, high) = (step.walls.min + contact, step.walls.max - contact);
    if x != x.clamp(low, high) {
        // Between a solid and a wall, each of them would push the particle into the other.
        for _ in 0..CORNER_ROUNDS {
            for solid in &step.solids {
                x = solid.after(1.0).leave(x.clamp(low, high), contact);
            }
        }
    }
    (x, v)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELL: f64 = 0.2;
    const GRAVITY: f64 = 9.81;
    const STEP: f64 = 1.0 / 24.0;

    /// A plane that falls by `slope` per metre along x, as the distance to what is below it.
    fn plane(slope: f64) -> (SignedDistance, DVec3) {
        let normal = DVec3::new(slope, 1.0, 0.0).normalize();
        let (spacing, dims) = (0.05, [20, 20, 20]);
        let node = |k: usize| DVec3::new((k % 20) as f64, (k / 20 % 20) as f64, (k / 400) as f64);
        let values = (0..8000)
            .map(|k| normal.dot(spacing * node(k) - DVec3::splat(0.5)) as f32)
            .collect();
        let grid = SignedDistance {
            origin: DVec3::ZERO,
            spacing,
            dims,
            values,
        };
        (grid, normal)
    }

    /// Water that gravity has moved down a plane for a step: on 1:20 it stays; on 1:8 friction
    /// takes g cos θ / 16 of it, with eight particles in a cell. Half a cell off the plane, and
    /// where it runs faster than 1.41 times √(2 g Δx / 16), it keeps its velocity; so does a
    /// droplet that slides.
    #[test]
    fn films_rest_on_gentle_slopes_and_run_down_steep_ones() {
        let film = |is_drop: bool| Film {
            velocity_step: -GRAVITY * STEP * DVec3::Y,
            kick: STEP,
            cell_size: CELL,
            particle_share: 1.0 / 8.0,
            is_drop,
        };
        for (slope, rests) in [(1.0 / 20.0, true), (1.0 / 8.0, false)] {
            let (grid, normal) = plane(slope);
            let rest = Pose::START;
            let solid = Solid::new(&grid, Passage::resting(rest));
            let fall = -GRAVITY * STEP * DVec3::Y;
            let v = fall - normal * fall.dot(normal);
            let at = |cells: f64| DVec3::splat(0.5) + cells * CELL * normal;
            let found = solid.slowed(at(0.1), v, &film(false));
            let friction = -fall.dot(normal) / 16.0;
            let expected = match rests {
                true => DVec3::ZERO,
                false => v * (1.0 - friction / v.length()),
            };
            // Distances are kept in 32 bits.
            assert!(
                (found - expected).length() < 1e-6,
                "{slope}: {found} {expected}"
            );
            let fast = v.normalize() * 1.42 * (2.0 * GRAVITY * CELL / 16.0).sqrt();
            assert_eq!(solid.slowed(at(0.51), v, &film(false)), v);
            assert_eq!(solid.slowed(at(0.1), fast, &film(false)), fast);
            assert_eq!(solid.slowed(at(0.1), fast, &film(true)), fast);
        }
    }
}
