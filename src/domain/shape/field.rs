//! Distances to a surface whose shape changes, and its velocities, at the nodes of one grid.
//!
//! The grid is around all meshes of the sequence, so that its size never changes. Distances are
//! sampled at keys, which are so near each other in time that no point of the surface moves farther
//! than a node spacing between two, and are linear in between: a solid that is resolved by the grid
//! does not open as it moves. Between two meshes with different triangles there are no keys.
//!
//! A node has the velocity of the point of the surface that is nearest to it.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, PoisonError},
};

use glam::DVec3;

use super::{
    super::{
        bounds::Bounds,
        bvh::{Bvh, nearest_point},
        mesh::TriangleMesh,
        parallel,
        signed_distance::{SignedDistance, SignedDistanceError, grid_dims, sampled},
        thin::{Needed, thicken},
    },
    Moment, ShapeSequence,
    samples::{nearest, weights},
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
    sequence: ShapeSequence,
    /// The grid, without values.
    grid: SignedDistance,
    /// Number of parts of each interval between two meshes.
    parts: Vec<u32>,
    /// Thickness up to which meshes are thickened.
    needed: Option<Needed>,
    cache: Mutex<Cache>,
}

#[derive(Debug, Default)]
struct Cache {
    keys: VecDeque<(Key, Arc<Nodes>)>,
    last: Option<([u64; 2], Arc<ShapeStep>)>,
}

/// A time at which distances are sampled: this part of the interval after this mesh begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    index: usize,
    part: u32,
}

/// Distances at a key, metres, and velocities over the part before it, m/s.
#[derive(Debug)]
struct Nodes {
    distance: Vec<f32>,
    velocity: Vec<[f32; 3]>,
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
    /// it is [thickened](thicken).
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
        let grid = SignedDistance {
            origin: bounds.min,
            spacing,
            dims: grid_dims(&bounds, spacing)?,
            values: Vec::new(),
        };
        let intervals = 0..sequence.meshes().len() - 1;
        let parts = intervals.map(|index| match sequence.keeps_triangles(index) {
            true => (sequence.farthest(index) / spacing).ceil().max(1.0) as u32,
            false => 1,
        });
        Ok(Self {
            core: Arc::new(Core {
                sequence: sequence.clone(),
                grid,
                parts: parts.collect(),
                needed,
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

    /// Returns the sequence, in its own coordinates.
    pub fn sequence(&self) -> &ShapeSequence {
        &self.core.sequence
    }

    /// Returns the number of nodes.
    pub fn nodes(&self) -> usize {
        self.core.grid.dims.iter().product()
    }

    /// Returns how often distances are sampled within `[t0, t1]`, seconds, and the bytes that they
    /// take in memory while a bake runs, at most.
    pub fn cost(&self, t0: f64, t1: f64) -> (usize, usize) {
        let [first, last] = [t0, t1].map(|time| self.core.place(time));
        let mut keys = 1;
        let mut key = first.0;
        while key < last.0 {
            (key, keys) = (self.core.after(key), keys + 1);
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
    /// The part that contains a time, by the key at its beginning, and how much of it has passed.
    fn place(&self, time: f64) -> (Key, f64) {
        let Moment { index, part } = self.sequence.moment(time);
        let parts = self.parts[index];
        let at = part * f64::from(parts);
        let part = (at as u32).min(parts - 1);
        (Key { index, part }, at - f64::from(part))
    }

    /// The key after one.
    fn after(&self, Key { index, part }: Key) -> Key {
        match part + 1 < self.parts[index] {
            true => Key {
                index,
                part: part + 1,
            },
            false => Key {
                index: index + 1,
                part: 0,
            },
        }
    }

    /// Duration of a part, seconds.
    fn duration(&self, key: Key) -> f64 {
        1.0 / (self.sequence.rate() * f64::from(self.parts[key.index]))
    }

    fn values(&self, cache: &mut Cache, time: f64) -> Vec<f32> {
        let (key, passed) = self.place(time);
        let before = (passed < 1.0).then(|| self.nodes(cache, key));
        let after = (passed > 0.0).then(|| self.nodes(cache, self.after(key)));
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
            let [a, b] = [start, end].map(|time| self.place(time));
            ([a.0, b.0], [a.1, b.1])
        };
        while length > 0.0 && key <= last {
            let until = if key == last { last_passed } else { 1.0 };
            let part = (until - passed) * self.duration(key) / length;
            if part > 0.0 {
                let nodes = self.nodes(cache, self.after(key));
                parallel::for_each_mut(&mut velocity, |n, velocity| {
                    for (sum, v) in velocity.iter_mut().zip(nodes.velocity[n]) {
                        *sum = (f64::from(*sum) + part * f64::from(v)) as f32;
                    }
                });
            }
            (key, passed) = (self.after(key), 0.0);
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
        let nodes = Arc::new(self.sampled(key));
        if cache.keys.len() == KEPT {
            cache.keys.pop_front();
        }
        cache.keys.push_back((key, nodes.clone()));
        nodes
    }

    /// Samples distances at a key, and velocities before it.
    fn sampled(&self, key: Key) -> Nodes {
        let (sequence, meshes) = (&self.sequence, self.sequence.meshes());
        let rate = sequence.rate();
        let part = match key.part {
            0 => 0.0,
            part => f64::from(part) / f64::from(self.parts[key.index]),
        };
        let mesh = match key.part {
            0 => meshes[key.index].clone(),
            _ => sequence.mesh_at(Moment {
                index: key.index,
                part,
            }),
        };
        let earlier = match key.part {
            0 => key.index.checked_sub(1),
            _ => Some(key.index),
        };
        match earlier {
            None => self.with_velocities(&mesh, &|_, _, _| DVec3::ZERO),
            Some(index) if sequence.keeps_triangles(index) => {
                let [a, b] = [&meshes[index], &meshes[index + 1]];
                let ways: Vec<DVec3> = (a.vertices.iter().zip(&b.vertices))
                    .map(|(a, b)| rate * (*b - *a))
                    .collect();
                self.with_velocities(&mesh, &|x, triangle, corners| {
                    let [u, v, w] = weights(x, corners);
                    let [a, b, c] = mesh.triangles[triangle].map(|k| ways[k as usize]);
                    u * a + v * b + w * c
                })
            }
            Some(index) => {
                let tree = Bvh::new(&meshes[index]);
                let most = rate * sequence.farthest(index);
                self.with_velocities(&mesh, &|x, _, _| {
                    let velocity = rate * (x - nearest(&meshes[index], &tree, x));
                    velocity.clamp_length_max(most)
                })
            }
        }
    }

    /// Samples the distance to a mesh. `velocity` is that of a point of the mesh, given with the
    /// index and the corners of its triangle.
    fn with_velocities(
        &self,
        mesh: &TriangleMesh,
        velocity: &(impl Fn(DVec3, usize, [DVec3; 3]) -> DVec3 + Sync),
    ) -> Nodes {
        let grid = &self.grid;
        let nodes = sampled(
            mesh,
            (grid.origin, grid.spacing, grid.dims),
            &|p, triangle| {
                let triangle = triangle as usize;
                let corners = mesh.corners(triangle);
                let [a, b, c] = corners;
                let x = nearest_point(p, a, b, c);
                velocity(x, triangle, corners).as_vec3().to_array()
            },
        );
        let (mut distance, velocity) = nodes.into_iter().unzip();
        if let Some(needed) = self.needed {
            let mut field = with_values(grid, distance);
            thicken(&mut field, &[mesh], &[true], &Bounds::EVERYWHERE, needed);
            distance = field.values;
        }
        Nodes { distance, velocity }
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
