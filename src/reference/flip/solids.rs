//! Solids by their signed distance: how they cut cells, and how they push particles back.

use glam::{BVec3, DVec3};

use super::Model;
use swell_domain::{
    bounds::Bounds,
    pose::{Passage, Pose},
    signed_distance::SignedDistance,
};

/// Nearer than this to a solid, in cells, counts as inside.
const SKIN: f64 = 1e-4;

/// A solid at one moment.
#[derive(Clone, Copy, Debug)]
pub struct Solid<'a> {
    /// Its distances where it stood at the start, metres.
    pub grid: &'a SignedDistance,
    /// How it goes through the substep.
    pub passage: Passage,
    /// Where it stands.
    pub pose: Pose,
}

/// What of a cell a solid leaves open.
pub(super) struct Cut {
    /// Of its lower and of its upper faces, 0..1.
    pub(super) faces: [DVec3; 2],
    /// Of its volume, 0..1; exact for planes along two axes at most.
    pub(super) volume: f64,
}

impl<'a> Solid<'a> {
    /// At the beginning of a passage.
    pub(super) fn new(grid: &'a SignedDistance, passage: Passage) -> Self {
        Self {
            grid,
            passage,
            pose: passage.start,
        }
    }

    /// As it stands when `share` of the substep is over.
    pub(super) fn after(self, share: f64) -> Self {
        Self {
            pose: self.passage.at(share),
            ..self
        }
    }

    /// Of its point at `x`, m/s.
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        self.passage.velocity_at(x, self.pose.centre)
    }

    /// An upper bound on the speed of its points within its grid, m/s.
    pub fn fastest(&self) -> f64 {
        let spin = self.passage.spin.length();
        let reach = match spin {
            0.0 => 0.0,
            _ => self.grid.reach(self.pose.rest),
        };
        self.passage.velocity.length() + spin * reach
    }

    fn last(&self) -> DVec3 {
        DVec3::from_array(self.grid.dims.map(|n| (n - 1) as f64))
    }

    /// A place in node spacings, as the grid lies.
    fn place(&self, x: DVec3) -> DVec3 {
        (self.pose.back(x) - self.grid.origin) / self.grid.spacing
    }

    /// Distance at the place of the grid that is nearest to `x`, trilinear.
    fn distance(&self, x: DVec3) -> f64 {
        let place = self.place(x).clamp(DVec3::ZERO, self.last());
        self.grid
            .sample(self.grid.origin + self.grid.spacing * place)
    }

    /// The nearest node's distance; far away beyond the grid.
    fn near(&self, x: DVec3) -> f64 {
        let p = self.place(x);
        if p.cmplt(-DVec3::ONE).any() || p.cmpgt(self.last() + 1.0).any() {
            return 1e15;
        }
        let [i, j, k] = (p + 0.5).clamp(DVec3::ZERO, self.last()).to_array();
        self.grid.node(i as usize, j as usize, k as usize)
    }

    /// The nearest node's distance, or from beyond the grid the way there: the solid lies within it.
    pub(super) fn bound(&self, x: DVec3) -> f64 {
        let place = self.place(x);
        let way = self.grid.spacing * place.distance(place.clamp(DVec3::ZERO, self.last()));
        if way > 0.0 { way } else { self.near(x) }
    }

    /// Distances at the corners of a cell, x fastest; `None` where the solid is too far off to cut it.
    pub(super) fn corners(&self, cell: DVec3, cell_size: f64) -> Option<[f64; 8]> {
        let middle = (cell + 0.5) * cell_size;
        if self.near(middle) >= 2.0 * (cell_size + self.grid.spacing) {
            return None;
        }
        let skin = SKIN * cell_size;
        Some(std::array::from_fn(|k| {
            let step = [k & 1, k >> 1 & 1, k >> 2].map(|s| s as f64);
            self.distance((cell + DVec3::from_array(step)) * cell_size) - skin
        }))
    }

    /// Pushes `x` out along the gradient to the contact distance.
    pub(super) fn leave(&self, x: DVec3, contact: f64) -> DVec3 {
        let p = self.place(x);
        if p.cmplt(DVec3::ZERO).any() || p.cmpge(self.last()).any() {
            return x;
        }
        let own = self.grid.origin + self.grid.spacing * p;
        let distance = self.grid.sample(own);
        let [i, j, k] = p.to_array().map(|c| c as usize);
        // Two cells' diagonal: no contact can be interpolated from a node so far off.
        if self.grid.node(i, j, k) > contact + 2.0 * self.grid.spacing || distance >= contact {
            return x;
        }
        let gradient = self.grid.gradient(own);
        // Per metre; the GPU's is per spacing.
        if gradient.length() < 1e-6 {
            return x;
        }
        x + self.pose.turn * gradient.normalize() * (contact - distance)
    }
}

/// Sums over the corners of a cell's lower faces, or (`side` = 1) its upper ones.
pub(super) fn face_sums(corners: &[f64; 8], side: usize) -> DVec3 {
    let sum = |axis: usize| {
        (0..8)
            .filter(|k| k >> axis & 1 == side)
            .map(|k| corners[k])
            .sum()
    };
    DVec3::new(sum(0), sum(1), sum(2))
}

/// How planes through a cell's corner distances cut it (Batty et al. 2007).
pub(super) fn cut(corners: &[f64; 8]) -> Cut {
    let part = |axis: usize, side: usize| {
        let (s, t) = ([1, 0, 0][axis], [2, 2, 1][axis]);
        open_part(std::array::from_fn(|k| {
            corners[side << axis | (k & 1) << s | (k >> 1) << t]
        }))
    };
    let faces = [0, 1].map(|side| DVec3::new(part(0, side), part(1, side), part(2, side)));
    let center = corners.iter().sum::<f64>() / 8.0;
    let slopes = ((face_sums(corners, 1) - face_sums(corners, 0)) / 4.0).abs();
    let volume = 0.5 + center / slopes.element_sum().max(1e-20);
    Cut {
        faces,
        volume: volume.clamp(0.0, 1.0),
    }
}

/// Half cells along an axis of the hat about a cell's centre: from where each begins, in cells from the cell's least corner, and the
/// hat's mean over it.
const HALVES: [(f64, f64); 4] = [(-0.5, 0.25), (0.0, 0.75), (0.5, 0.75), (1.0, 0.25)];

/// Part of the hat about a cell's centre that solids leave of what the walls at `walls` do (in cells), half a cell along each axis
/// at a time, each by a plane; `corners` are the distances at the cell's. Where water is mirrored at walls, solids are.
pub(super) fn open_part_of_hat(
    solids: &[&Solid<'_>],
    walls: &Bounds,
    is_mirrored: bool,
    cell: DVec3,
    cell_size: f64,
    corners: &[f64; 8],
) -> f64 {
    let rise = ((face_sums(corners, 1) - face_sums(corners, 0)) / 4.0).abs();
    let width = (0.5 * rise.element_sum()).max(1e-20);
    let is_within = (cell + 0.5).cmpge(walls.min) & (cell + 0.5).cmple(walls.max);
    let mirrors = is_within & BVec3::splat(is_mirrored);
    let (mut open, mut all) = (0.0, 0.0);
    for k in 0..64 {
        let halves = [k & 3, k >> 2 & 3, k >> 4].map(|half| HALVES[half]);
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
        all += hat.element_product();
        open += hat.element_product() * (0.5 + distance / width).clamp(0.0, 1.0);
    }
    if all > 0.0 { open / all } else { 1.0 }
}

/// Open part of a square from the distances at its corners (0,0), (1,0), (0,1), (1,1).
fn open_part(corners: [f64; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let slopes = [(b + d - a - c).abs() / 2.0, (c + d - b - a).abs() / 2.0];
    let steep = slopes[0].max(slopes[1]);
    let flat = slopes[0].min(slopes[1]);
    let center = (a + b + c + d) / 4.0;
    let smaller = if center.abs() <= 0.5 * (steep - flat) {
        0.5 - center.abs() / steep.max(1e-20)
    } else {
        // Past the flat stretch only a corner is left, a triangle.
        let far = (0.5 * (steep + flat) - center.abs()).max(0.0);
        far * far / (2.0 * steep * flat).max(1e-20)
    };
    if center > 0.0 { 1.0 - smaller } else { smaller }
}

/// The velocity of what was pushed back: without its part against the push.
fn stopped(v: DVec3, push: DVec3) -> DVec3 {
    v - push * (v.dot(push).min(0.0) / push.length_squared().max(1e-30))
}

/// Without what of a velocity leads into the walls that `x` lies at or beyond, which are moved in by the contact distance.
pub(super) fn at_walls(model: &Model, step: &super::Step<'_>, v: DVec3, x: DVec3) -> DVec3 {
    let contact = model.contact_distance();
    let [slowest, fastest] = step.wall_velocity;
    let v = DVec3::select(x.cmplt(step.walls.min + contact), v.max(slowest), v);
    DVec3::select(x.cmpgt(step.walls.max - contact), v.min(fastest), v)
}

/// Each halves, or better, how deep one that lies between a wall and a solid 45° off is in either.
const CORNER_ROUNDS: usize = 4;

/// Where a particle comes to that goes `way` from `start` among solids, walls apart, and its velocity then.
pub(super) fn go(
    model: &Model,
    step: &super::Step<'_>,
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
    // In steps of at most half a node spacing, so that nothing thin is stepped over.
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
        // Where a solid and a wall meet, each would push into the other.
        for _ in 0..CORNER_ROUNDS {
            for solid in &step.solids {
                x = solid.after(1.0).leave(x.clamp(low, high), contact);
            }
        }
    }
    (x, v)
}
