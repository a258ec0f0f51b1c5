//! Emitters and drains: water that enters and leaves during a shot, at the ends of output frames.
//!
//! An emitter's water is a lattice with the particle spacing that moves with the emitter's
//! velocity. A particle is born at the end of the frame in which its lattice position first lies in
//! the emitter and outside of solids; one covered by a solid waits until it emerges. That time
//! depends only on the scene, so that `velocity · open area` enters per second, whatever the frame
//! rate, and the particles of successive frames fit together. An emitter with a level keeps its
//! volume full up to that level instead.

mod flow;
mod solids;

use std::ops::Range;

use glam::DVec3;

use self::flow::Flow;
pub use self::solids::Solids;
use super::{
    bounds::Bounds,
    mesh::TriangleMesh,
    particles::Particles,
    sampling::{CLEARANCE, moved_out, uniform},
    signed_distance::{SignedDistance, SignedDistanceError},
};

/// Relative tolerance for the rounding of floats in comparisons of positions.
const ROUNDING: f64 = 1e-9;

/// Distance from a face of a volume below which a position counts as on it, in spacings, so that
/// coordinates far from zero may round.
const ON_FACE: f64 = 1e-6;

/// Volume where water enters; `S` is the representation of its shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter<S> {
    /// Shape of the volume.
    pub shape: S,
    /// Velocity of the water that enters, m/s.
    pub velocity: DVec3,
    /// Height up to which the emitter keeps its volume full, metres; `None` lets water enter at the
    /// rate that `velocity` gives.
    pub level: Option<f64>,
    /// Time window in which it acts.
    pub window: Window,
}

/// Volume where water leaves; `S` is the representation of its shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Drain<S> {
    /// Shape of the volume.
    pub shape: S,
    /// Height below which water stays, metres.
    pub level: Option<f64>,
    /// Largest outflow, m³/s.
    pub rate: Option<f64>,
    /// Time window in which it acts.
    pub window: Window,
}

impl<S> Emitter<S> {
    /// Returns the emitter with another representation of its shape.
    pub fn with_shape<T>(self, shape: T) -> Emitter<T> {
        Emitter {
            shape,
            velocity: self.velocity,
            level: self.level,
            window: self.window,
        }
    }
}

impl<S> Drain<S> {
    /// Returns the drain with another representation of its shape.
    pub fn with_shape<T>(self, shape: T) -> Drain<T> {
        Drain {
            shape,
            level: self.level,
            rate: self.rate,
            window: self.window,
        }
    }
}

/// Time window of an emitter, drain, force or kill volume. Drains, kill volumes, and emitters with
/// a level act at frames that end after `from` and not after `until`; the water of other emitters
/// is that which enters between the two; forces act between the two.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// Start of the window, seconds from the start of the shot.
    pub from: f64,
    /// End of the window, seconds from the start of the shot; `None` is the end of the shot.
    pub until: Option<f64>,
}

impl Window {
    /// Returns whether a frame that ends at `time` is in the window.
    pub fn holds(&self, time: f64) -> bool {
        time > self.from && !self.is_over(time)
    }

    fn is_over(&self, time: f64) -> bool {
        self.until.is_some_and(|until| time > until)
    }

    /// Returns the fraction of the `length` seconds from `start` that lies in the window.
    pub fn share(&self, start: f64, length: f64) -> f64 {
        if length <= 0.0 {
            return 0.0;
        }
        let end = self
            .until
            .map_or(start + length, |until| until.min(start + length));
        // What acts from the start has acted before it.
        let from = match self.from > 0.0 {
            true => start.max(self.from),
            false => start,
        };
        ((end - from) / length).clamp(0.0, 1.0)
    }

    /// Returns how much of a shot of `duration` seconds lies in the window, seconds.
    pub fn length(&self, duration: f64) -> f64 {
        let end = self.until.map_or(duration, |until| until.min(duration));
        (end - self.from).max(0.0)
    }
}

/// A box, or a mesh within its bounding box.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    bounds: Bounds,
    mesh: Option<SignedDistance>,
}

impl From<Bounds> for Shape {
    fn from(bounds: Bounds) -> Self {
        Self { bounds, mesh: None }
    }
}

impl Shape {
    /// Builds the shape of a closed mesh; `spacing` is that of the particles, metres.
    ///
    /// # Errors
    /// Those of [`SignedDistance::from_mesh`].
    pub fn of_mesh(mesh: &TriangleMesh, spacing: f64) -> Result<Self, SignedDistanceError> {
        Self::sampled(mesh, spacing, 0.5 * spacing)
    }

    /// Builds the shape of a closed mesh from distances that are sampled `step` metres apart, in a
    /// box that leaves `margin` metres around it.
    ///
    /// # Errors
    /// Those of [`SignedDistance::from_mesh`].
    pub fn sampled(
        mesh: &TriangleMesh,
        margin: f64,
        step: f64,
    ) -> Result<Self, SignedDistanceError> {
        let bounds = mesh.bounds().unwrap_or_default();
        let room = bounds.grown(margin);
        Ok(Self {
            bounds,
            mesh: Some(SignedDistance::from_mesh(mesh, &room, step)?),
        })
    }

    /// Returns the bounding box, metres.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Returns the distances to the mesh, if the shape is one.
    pub fn mesh(&self) -> Option<&SignedDistance> {
        self.mesh.as_ref()
    }

    /// Returns whether a point lies in the shape.
    pub fn contains(&self, p: DVec3) -> bool {
        self.bounds.contains(p) && self.is_in_mesh(p)
    }

    /// Returns the distance of a point inside from the surface, metres; zero or less outside.
    pub fn depth(&self, p: DVec3) -> f64 {
        let Bounds { min, max } = self.bounds;
        let in_box = (p - min).min(max - p).min_element();
        match &self.mesh {
            Some(mesh) if in_box >= 0.0 => -mesh.sample(p),
            _ => in_box,
        }
    }

    /// Returns the shape moved by `way`, metres.
    #[must_use]
    pub fn moved(mut self, way: DVec3) -> Self {
        self.bounds = self.bounds.moved(way);
        if let Some(mesh) = &mut self.mesh {
            mesh.origin += way;
        }
        self
    }

    /// Whether a point within the bounds is in the mesh, if there is one.
    fn is_in_mesh(&self, p: DVec3) -> bool {
        self.mesh.as_ref().is_none_or(|mesh| mesh.sample(p) < 0.0)
    }
}

/// Particles that entered and left at a frame's end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Exchange {
    /// Number of particles that entered.
    pub entered: u64,
    /// Number of particles that left.
    pub left: u64,
    /// Number of a flow's particles that never enter, because a solid covered them all the way
    /// through the emitter.
    #[serde(default, skip_serializing_if = "is_none")]
    pub blocked: u64,
}

fn is_none(count: &u64) -> bool {
    *count == 0
}

/// Predicted inflow of an emitter without a level, with solids in their poses at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictedInflow {
    /// Flow rate, m³/s.
    pub rate: f64,
    /// Velocity times swept area of its box, m³/s; `None` for a mesh.
    pub asked: Option<f64>,
    /// Fraction of the lattice's particles that enter, 0..1: within the mesh and outside of solids.
    pub open: f64,
    /// Fraction of its cross-section that solids cover, 0..1.
    pub covered: f64,
}

/// All emitters and drains of a scene.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    /// Emitters, in the order in which they act.
    pub emitters: Vec<Emitter<Shape>>,
    /// Drains, which act before the emitters.
    pub drains: Vec<Drain<Shape>>,
    /// Particle spacing, metres.
    pub spacing: f64,
    /// Output frames per second.
    pub frames_per_second: f64,
    /// Box that water may enter, metres.
    pub domain: Bounds,
}

impl Sources {
    /// Returns whether there are neither emitters nor drains.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty() && self.drains.is_empty()
    }

    /// Removes from `particles` and adds to them what leaves and enters at the end of a frame, away
    /// from `solids`. New particles come last; their ids count up from `next_id`, which is advanced
    /// to the next free id.
    pub fn exchange(
        &self,
        frame: u32,
        solids: &Solids<'_>,
        particles: &mut Particles,
        next_id: &mut u32,
    ) -> Exchange {
        let end = self.time(frame);
        let before = particles.len();
        for drain in self.drains.iter().filter(|drain| drain.window.holds(end)) {
            let keep = self.kept(drain, frame, particles);
            particles.retain(&keep);
        }
        let left = (before - particles.len()) as u64;
        let (mut entered, mut blocked) = (0, 0);
        for emitter in &self.emitters {
            let born = match emitter.level {
                None => {
                    let brought = Flow::of(self, emitter, solids).brings(frame);
                    blocked += brought.blocked;
                    brought.born
                }
                Some(level) if emitter.window.holds(end) => {
                    self.lacking(emitter, level, frame, particles, solids)
                }
                Some(_) => Vec::new(),
            };
            for (place, id) in born.iter().zip(*next_id..) {
                particles.position.push(place.as_vec3().to_array());
                particles
                    .velocity
                    .push(emitter.velocity.as_vec3().to_array());
                particles.id.push(id);
            }
            *next_id += born.len() as u32;
            entered += born.len() as u64;
        }
        for column in particles.attributes.values_mut() {
            column.resize(particles.position.len(), 0.0);
        }
        Exchange {
            entered,
            left,
            blocked,
        }
    }

    /// Iterates over frames and the number of particles that are certain to exist at their ends,
    /// including what enters there: `start` plus what emitters without a level bring. Empty if a
    /// drain may remove some, or without such emitters.
    pub fn least_counts<'a>(
        &'a self,
        start: usize,
        frames: Range<u32>,
        solids: &Solids<'a>,
    ) -> impl Iterator<Item = (u32, usize)> + 'a {
        let flowing: Vec<_> = (self.emitters.iter())
            .filter(|emitter| emitter.level.is_none())
            .map(|emitter| Flow::of(self, emitter, solids))
            .collect();
        let is_known = self.drains.is_empty() && !flowing.is_empty();
        let frames = if is_known { frames } else { 0..0 };
        let mut count = start;
        frames.map(move |frame| {
            let brought = flowing.iter().map(|flow| flow.brings(frame).born.len());
            count += brought.sum::<usize>();
            (frame, count)
        })
    }

    /// Predicts the inflow of each emitter with only `still` as an obstacle; `None` for emitters
    /// with a level.
    pub fn predicted_inflows(
        &self,
        still: Option<&SignedDistance>,
    ) -> Vec<Option<PredictedInflow>> {
        let solids = Solids::still(still);
        let all = self.emitters.iter();
        all.map(|it| (it.level.is_none()).then(|| Flow::of(self, it, &solids).promise()))
            .collect()
    }

    /// The most particles that each emitter brings within `duration` seconds; `None` where it keeps
    /// a level. Solids, which may move, only take from them.
    pub fn most_entering(&self, duration: f64) -> Vec<Option<u64>> {
        let solids = Solids::still(None);
        let all = self.emitters.iter();
        all.map(|it| {
            let end = it
                .window
                .until
                .map_or(duration, |until| until.min(duration));
            let begin = it.window.from.max(0.0);
            let counts = it.level.is_none();
            counts.then(|| match begin < end {
                true => Flow::of(self, it, &solids).entering(begin, end),
                false => 0,
            })
        })
        .collect()
    }

    fn time(&self, frame: u32) -> f64 {
        f64::from(frame) / self.frames_per_second
    }

    /// Frame whose time span contains `time`: later than the end of the frame before, and not later
    /// than its own.
    fn frame_of(&self, time: f64) -> u32 {
        let near = (time * self.frames_per_second).ceil().max(0.0) as u32;
        // Corrects for the rounding of the product.
        if self.time(near) < time {
            near.saturating_add(1)
        } else if near > 0 && self.time(near - 1) >= time {
            near - 1
        } else {
            near
        }
    }

    /// Position where a particle at `p` enters at the end of a frame: there, or moved to the
    /// clearance that resting water keeps from solids, as far as it gets. `None` within a solid and
    /// outside of the domain.
    fn settled(&self, p: DVec3, frame: u32, solids: &Solids<'_>) -> Option<DVec3> {
        let seconds = self.time(frame);
        let distance = solids.distance(p, seconds);
        let ends = self.domain.grown(10.0 * ON_FACE * self.spacing);
        if distance <= 0.0 || !ends.contains(p) {
            return None;
        }
        let clearance = CLEARANCE * self.spacing;
        if distance >= clearance {
            return Some(p);
        }
        let room = self.domain.grown(-clearance);
        let at = |p| solids.distance(p, seconds);
        let moved = moved_out(p, at, |p| solids.gradient(p, seconds), &room, clearance);
        Some(if at(moved) > 0.0 { moved } else { p })
    }

    /// Positions below `level` where the emitter lacks particles. Its volume is a lattice; where a
    /// block of eight neighbouring positions holds fewer particles than positions, some of the
    /// empty ones are filled.
    fn lacking(
        &self,
        emitter: &Emitter<Shape>,
        level: f64,
        frame: u32,
        particles: &Particles,
        solids: &Solids<'_>,
    ) -> Vec<DVec3> {
        let (shape, d) = (&emitter.shape, self.spacing);
        let mut room = shape.bounds;
        room.max.y = room.max.y.min(level);
        let dims = (0..3).map(|axis| particles_along(room.size()[axis], d));
        let dims: Vec<usize> = dims.collect();
        let count: usize = dims.iter().product();
        let place = |n: usize| {
            let cell = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
            (
                cell,
                room.min + d * DVec3::from_array(cell.map(|i| i as f64 + 0.5)),
            )
        };
        let mut held = vec![0u32; count];
        for x in &particles.position {
            let from = (glam::Vec3::from_array(*x).as_dvec3() - room.min) / d;
            let cell = from.floor().to_array();
            let is_there = |axis: usize| cell[axis] >= 0.0 && cell[axis] < dims[axis] as f64;
            if (0..3).all(is_there) {
                let [i, j, k] = cell.map(|i| i as usize);
                held[(k * dims[1] + j) * dims[0] + i] += 1;
            }
        }
        let blocks: Vec<usize> = dims.iter().map(|n| n.div_ceil(2)).collect();
        let mut wanted = vec![0i64; blocks.iter().product()];
        let block_of = |[i, j, k]: [usize; 3]| (k / 2 * blocks[1] + j / 2) * blocks[0] + i / 2;
        let mut open = Vec::new();
        for (n, &held) in held.iter().enumerate() {
            let (cell, at) = place(n);
            let block = block_of(cell);
            let at = shape.contains(at).then(|| self.settled(at, frame, solids));
            let at = at.flatten();
            wanted[block] += i64::from(at.is_some()) - i64::from(held);
            if let (Some(at), 0) = (at, held) {
                open.push((block, by_chance(frame, n as u32), at));
            }
        }
        open.sort_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).expect("numbers"));
        let mut born = Vec::new();
        for (block, _, at) in open {
            if wanted[block] > 0 {
                wanted[block] -= 1;
                born.push(at);
            }
        }
        born
    }

    /// Returns for each particle whether it stays.
    fn kept(&self, drain: &Drain<Shape>, frame: u32, particles: &Particles) -> Vec<bool> {
        let is_taken = |x: &[f32; 3]| {
            let x = glam::Vec3::from_array(*x).as_dvec3();
            drain.shape.contains(x) && drain.level.is_none_or(|level| x.y > level)
        };
        let mut keep: Vec<bool> = particles.position.iter().map(|x| !is_taken(x)).collect();
        let Some(rate) = drain.rate else {
            return keep;
        };
        let volume = self.spacing.powi(3);
        let gone = |frame: u32| (rate * self.time(frame) / volume * (1.0 + ROUNDING)).floor();
        let most = (gone(frame) - gone(frame.saturating_sub(1))) as usize;
        let mut taken: Vec<usize> = (0..keep.len()).filter(|&k| !keep[k]).collect();
        // A random order spreads the removal evenly over the drain.
        let order = |k: &usize| by_chance(frame, particles.id[*k]);
        taken.sort_by(|a, b| order(a).total_cmp(&order(b)).then(a.cmp(b)));
        for k in taken.into_iter().skip(most) {
            keep[k] = true;
        }
        keep
    }
}

/// A pseudo-random number from 0 to 1, the same in each bake.
fn by_chance(frame: u32, of: u32) -> f64 {
    uniform(u64::from(frame) << 32 | u64::from(of))
}

/// Returns how many particles fit into `length`, at least one.
pub fn particles_along(length: f64, spacing: f64) -> usize {
    ((length / spacing).round() as usize).max(1)
}

/// Returns whether water of this velocity stays in a box of this size for a frame of `seconds`:
/// otherwise the particles that enter would be beyond the box at the frame's end.
pub fn is_long_enough(size: DVec3, velocity: DVec3, seconds: f64) -> bool {
    (velocity.abs() * seconds)
        .cmple(size * (1.0 + ROUNDING))
        .all()
}

/// Flow rate through a box, m³/s: velocity times the area of the faces that look along it.
fn swept(size: DVec3, velocity: DVec3) -> f64 {
    let faces = DVec3::new(size.y * size.z, size.z * size.x, size.x * size.y);
    velocity.abs().dot(faces)
}

/// The same of a lattice of particles, which has whole rows across a flow along axes.
pub fn flow(size: DVec3, velocity: DVec3, spacing: f64) -> f64 {
    let across = DVec3::from_array(std::array::from_fn(|axis| match velocity[axis] {
        0.0 => particles_along(size[axis], spacing) as f64 * spacing,
        _ => size[axis],
    }));
    swept(across, velocity)
}

#[cfg(test)]
mod promise_tests;
#[cfg(test)]
mod tests;
