//! Distances to a surface whose shape changes, and its velocities, at the nodes of one grid.
//!
//! The grid is around the surface at all times, so that its size never changes. Distances are
//! sampled at keys, which are so near each other in time that no point of the surface moves farther
//! than a node spacing between two, and are linear in between: a solid that is resolved by the grid
//! does not open as it moves.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, PoisonError},
};

use glam::DVec3;

use super::{
    super::{
        bounds::Bounds,
        parallel,
        signed_distance::{SignedDistance, SignedDistanceError, grid_dims},
        thin::Needed,
    },
    ShapeSequence, WaveFloor,
    meshes::MeshKeys,
    with_values,
};

/// Keys that stay in memory: those around the present time, and the one before.
const KEPT: usize = 3;

/// Distances to a surface over time. Results follow from the time alone, so that a bake that is
/// resumed has the same.
#[derive(Clone, Debug)]
pub struct ShapeField {
    core: Arc<Core>,
    /// What is added to positions of nodes, metres.
    way: DVec3,
    /// What is added to distances, metres.
    shift: f64,
}

#[derive(Debug)]
struct Core {
    keys: Box<dyn Keys>,
    /// The grid, without values.
    grid: SignedDistance,
    cache: Mutex<Cache>,
}

/// The times at which distances to a surface are sampled.
pub(super) trait Keys: std::fmt::Debug + Send + Sync {
    /// The part that contains a time, by the key at its beginning, and how much of it has passed.
    fn place(&self, time: f64) -> (Key, f64);

    /// The key after one.
    fn after(&self, key: Key) -> Key;

    /// Duration of the part after a key, seconds.
    fn duration(&self, key: Key) -> f64;

    /// Samples distances at a key, and velocities before it, at the nodes of a grid.
    fn sampled(&self, grid: &SignedDistance, key: Key) -> Nodes;
}

#[derive(Debug, Default)]
struct Cache {
    keys: VecDeque<(Key, Arc<Nodes>)>,
    last: Option<([u64; 2], Arc<ShapeStep>)>,
}

/// A time at which distances are sampled: this part of this interval begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    pub(super) index: usize,
    pub(super) part: u32,
}

/// Distances at a key, metres, and velocities over the part before it, m/s.
#[derive(Debug)]
pub(super) struct Nodes {
    pub(super) distance: Vec<f32>,
    pub(super) velocity: Vec<[f32; 3]>,
}

/// A surface in a substep.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeStep {
    /// Distances at the beginning.
    pub before: SignedDistance,
    /// Distances at the end, on the same grid.
    pub after: SignedDistance,
    /// Mean velocity of the point of the surface nearest to each node, m/s.
    pub velocity: Vec<[f32; 3]>,
    /// Largest of these speeds, m/s.
    pub fastest: f64,
}

impl ShapeField {
    /// Prepares the distances to `sequence` on a grid with nodes `spacing` metres apart and
    /// `margin` metres around all meshes. Where a mesh is thinner than `needed`, if that is given,
    /// it is [thickened](crate::thin::thicken).
    ///
    /// # Errors
    /// If the grid has too many nodes.
    pub fn new(
        sequence: &ShapeSequence,
        margin: f64,
        spacing: f64,
        needed: Option<Needed>,
    ) -> Result<Self, SignedDistanceError> {
        let bounds = sequence.bounds().grown(margin);
        Self::of(MeshKeys::new(sequence, spacing, needed), &bounds, spacing)
    }

    /// Prepares the distances to a floor below water, on a grid with nodes `spacing` metres apart
    /// and `margin` metres around the domain.
    ///
    /// # Errors
    /// If the grid has too many nodes.
    pub fn of_floor(
        floor: &WaveFloor,
        margin: f64,
        spacing: f64,
    ) -> Result<Self, SignedDistanceError> {
        Self::of(floor.clone(), &floor.bounds().grown(margin), spacing)
    }

    fn of(
        keys: impl Keys + 'static,
        bounds: &Bounds,
        spacing: f64,
    ) -> Result<Self, SignedDistanceError> {
        let grid = SignedDistance {
            origin: bounds.min,
            spacing,
            dims: grid_dims(bounds, spacing)?,
            values: Vec::new(),
        };
        Ok(Self {
            core: Arc::new(Core {
                keys: Box::new(keys),
                grid,
                cache: Mutex::default(),
            }),
            way: DVec3::ZERO,
            shift: 0.0,
        })
    }

    /// Returns the field in coordinates with another origin: `way` is added to those of every node.
    #[must_use]
    pub fn moved(&self, way: DVec3) -> Self {
        Self {
            way: self.way + way,
            ..self.clone()
        }
    }

    /// Returns the field with `shift` metres added to each distance.
    #[must_use]
    pub fn shifted(&self, shift: f64) -> Self {
        Self {
            shift: self.shift + shift,
            ..self.clone()
        }
    }

    /// Returns the number of nodes.
    pub fn nodes(&self) -> usize {
        self.core.grid.dims.iter().product()
    }

    /// Returns how often distances are sampled within `[t0, t1]`, seconds, and the bytes that they
    /// take in memory while a bake runs, at most.
    pub fn cost(&self, t0: f64, t1: f64) -> (usize, usize) {
        let [first, last] = [t0, t1].map(|time| self.core.keys.place(time));
        let mut keys = 1;
        let mut key = first.0;
        while key < last.0 {
            (key, keys) = (self.core.keys.after(key), keys + 1);
        }
        let keys = keys + usize::from(last.1 > 0.0);
        let of_key = size_of::<f32>() + size_of::<[f32; 3]>();
        let of_step = 2 * size_of::<f32>() + size_of::<[f32; 3]>();
        (keys, self.nodes() * (KEPT * of_key + of_step))
    }

    /// Returns the distances at a time, seconds.
    pub fn at(&self, time: f64) -> SignedDistance {
        let mut cache = self.cache();
        let values = self.core.values(&mut cache, time);
        self.out(with_values(&self.core.grid, values))
    }

    /// Returns the surface in the `length` seconds from `start`.
    pub fn step(&self, start: f64, length: f64) -> Arc<ShapeStep> {
        let mut cache = self.cache();
        let asked = [start, length].map(f64::to_bits);
        let step = match &cache.last {
            Some((of, step)) if *of == asked => step.clone(),
            _ => {
                let step = Arc::new(self.core.step(&mut cache, start, length));
                cache.last = Some((asked, step.clone()));
                step
            }
        };
        if self.way == DVec3::ZERO && self.shift == 0.0 {
            return step;
        }
        Arc::new(ShapeStep {
            before: self.out(step.before.clone()),
            after: self.out(step.after.clone()),
            ..ShapeStep::clone(&step)
        })
    }

    /// The cache is consistent whatever a thread that panicked did with it.
    fn cache(&self) -> std::sync::MutexGuard<'_, Cache> {
        (self.core.cache.lock()).unwrap_or_else(PoisonError::into_inner)
    }

    fn out(&self, mut grid: SignedDistance) -> SignedDistance {
        grid.origin += self.way;
        if self.shift != 0.0 {
            let shift = self.shift as f32;
            grid.values.iter_mut().for_each(|value| *value += shift);
        }
        grid
    }
}

impl Core {
    fn values(&self, cache: &mut Cache, time: f64) -> Vec<f32> {
        let (key, passed) = self.keys.place(time);
        let before = (passed < 1.0).then(|| self.nodes(cache, key));
        let after = (passed > 0.0).then(|| self.nodes(cache, self.keys.after(key)));
        match (before, after) {
            (Some(before), Some(after)) => {
                let [a, b] = [&before.distance, &after.distance];
                parallel::map(0..a.len(), |n| {
                    let [a, b] = [a[n], b[n]].map(f64::from);
                    (a + passed * (b - a)) as f32
                })
            }
            (Some(one), None) | (None, Some(one)) => one.distance.clone(),
            (None, None) => unreachable!("no number is both below 1 and not above 0"),
        }
    }

    fn step(&self, cache: &mut Cache, start: f64, length: f64) -> ShapeStep {
        let end = start + length;
        let before = self.values(cache, start);
        let mut velocity = vec![[0.0f32; 3]; before.len()];
        let ([mut key, last], [mut passed, last_passed]) = {
            let [a, b] = [start, end].map(|time| self.keys.place(time));
            ([a.0, b.0], [a.1, b.1])
        };
        while length > 0.0 && key <= last {
            let until = if key == last { last_passed } else { 1.0 };
            let part = (until - passed) * self.keys.duration(key) / length;
            if part > 0.0 {
                let nodes = self.nodes(cache, self.keys.after(key));
                parallel::for_each_mut(&mut velocity, |n, velocity| {
                    for (sum, v) in velocity.iter_mut().zip(nodes.velocity[n]) {
                        *sum = (f64::from(*sum) + part * f64::from(v)) as f32;
                    }
                });
            }
            (key, passed) = (self.keys.after(key), 0.0);
        }
        let after = self.values(cache, end);
        let speeds = velocity
            .iter()
            .map(|v| DVec3::from(v.map(f64::from)).length_squared());
        let fastest = speeds.fold(0.0, f64::max).sqrt();
        ShapeStep {
            before: with_values(&self.grid, before),
            after: with_values(&self.grid, after),
            velocity,
            fastest,
        }
    }

    fn nodes(&self, cache: &mut Cache, key: Key) -> Arc<Nodes> {
        if let Some((_, nodes)) = cache.keys.iter().find(|(of, _)| *of == key) {
            return nodes.clone();
        }
        let nodes = Arc::new(self.keys.sampled(&self.grid, key));
        if cache.keys.len() == KEPT {
            cache.keys.pop_front();
        }
        cache.keys.push_back((key, nodes.clone()));
        nodes
    }
}

impl ShapeStep {
    /// Returns the distance at `x` after the fraction `share` of the substep, metres, as
    /// [`SignedDistance::sample`].
    pub fn sample(&self, x: DVec3, share: f64) -> f64 {
        let [a, b] = [&self.before, &self.after].map(|grid| grid.sample(x));
        a + share * (b - a)
    }

    /// Returns its gradient, as [`SignedDistance::gradient`].
    pub fn gradient(&self, x: DVec3, share: f64) -> DVec3 {
        let [a, b] = [&self.before, &self.after].map(|grid| grid.gradient(x));
        a + share * (b - a)
    }

    /// Returns the distance at a node after the fraction `share` of the substep, metres.
    pub fn node(&self, [i, j, k]: [usize; 3], share: f64) -> f64 {
        let [a, b] = [&self.before, &self.after].map(|grid| grid.node(i, j, k));
        a + share * (b - a)
    }

    /// Returns the velocity of the surface near `x`, m/s: the trilinear interpolation between the
    /// nodes, beyond the grid that at the nearest point of it.
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        let ([i, j, k], u) = self.before.cell_of(x);
        let [nx, ny, _] = self.before.dims;
        let mut sum = DVec3::ZERO;
        for corner in 0..8 {
            let step = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weights = [0, 1, 2].map(|a| if step[a] == 0 { 1.0 - u[a] } else { u[a] });
            let node = i + step[0] + nx * (j + step[1] + ny * (k + step[2]));
            let velocity = DVec3::from(self.velocity[node].map(f64::from));
            sum += weights.iter().product::<f64>() * velocity;
        }
        sum
    }
}
