//! Surfaces whose shape changes: meshes at evenly spaced times, and what lies between them.
//!
//! Where two meshes have the same triangles, their vertices move straight and evenly from one to
//! the other. Where they do not, there is no point of the one for each of the other: a point of the
//! later surface then comes from the point of the earlier one that is nearest to it.

mod field;
mod floor;
mod meshes;
mod samples;

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::{
    bounds::Bounds, bvh::Bvh, mesh::TriangleMesh, parallel, signed_distance::SignedDistance,
};

pub use field::{ShapeField, ShapeStep};
pub use floor::{FloorSamples, WaveFloor};
pub use samples::{ShapeSamples, SurfacePoint, SurfaceSamples};

/// A time nearer than this to a mesh's own is that, in intervals between meshes.
const SAME: f64 = 1e-6;

/// Meshes at evenly spaced times. Before the first and after the last the surface is at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeSequence(Arc<Meshes>);

#[derive(Clone, Debug, PartialEq)]
struct Meshes {
    meshes: Vec<TriangleMesh>,
    /// Time of the first mesh, seconds.
    begin: f64,
    /// Meshes a second.
    rate: f64,
    /// Between each mesh and the next.
    intervals: Vec<Interval>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Interval {
    /// Whether both meshes have the same triangles.
    keeps_triangles: bool,
    /// Bound on the speed of a point of the surface, m/s.
    speed: f64,
}

/// A time between two meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moment {
    /// Index of the earlier mesh; there always is a later one.
    pub(crate) index: usize,
    /// Part of the interval that has passed, 0 to 1.
    pub(crate) part: f64,
}

impl ShapeSequence {
    /// Creates a sequence of meshes, the first at `begin` seconds, `rate` a second.
    ///
    /// # Panics
    /// If there are fewer than two, or one has no triangles.
    pub fn new(meshes: Vec<TriangleMesh>, begin: f64, rate: f64) -> Self {
        assert!(meshes.len() >= 2, "a shape changes between two meshes");
        let pairs: Vec<_> = meshes.windows(2).collect();
        let intervals = parallel::map_slice(&pairs, |pair| {
            let [a, b] = [&pair[0], &pair[1]];
            let keeps_triangles = is_same_topology(a, b);
            let farthest = match keeps_triangles {
                true => (a.vertices.iter().zip(&b.vertices))
                    .map(|(x, y)| x.distance(*y))
                    .fold(0.0, f64::max),
                false => apart(a, b).max(apart(b, a)),
            };
            Interval {
                keeps_triangles,
                speed: farthest * rate,
            }
        });
        Self(Arc::new(Meshes {
            meshes,
            begin,
            rate,
            intervals,
        }))
    }

    /// Returns the sequence in coordinates with another origin: `way` is added to those of every
    /// point.
    #[must_use]
    pub fn moved(&self, way: DVec3) -> Self {
        let mut inner = Meshes::clone(&self.0);
        let way = DAffine3::from_translation(way);
        for mesh in &mut inner.meshes {
            *mesh = mesh.transformed(&way);
        }
        Self(Arc::new(inner))
    }

    /// Returns the meshes.
    pub fn meshes(&self) -> &[TriangleMesh] {
        &self.0.meshes
    }

    /// Returns the times of the first and of the last mesh, seconds.
    pub fn times(&self) -> [f64; 2] {
        [0, self.0.meshes.len() - 1].map(|index| self.time(index))
    }

    fn time(&self, index: usize) -> f64 {
        self.0.begin + index as f64 / self.0.rate
    }

    /// Returns meshes a second.
    pub fn rate(&self) -> f64 {
        self.0.rate
    }

    /// Returns, in order, the indices of meshes whose triangles are not those of the mesh before.
    pub fn breaks(&self) -> impl Iterator<Item = usize> + '_ {
        let intervals = self.0.intervals.iter().enumerate();
        intervals
            .filter(|(_, it)| !it.keeps_triangles)
            .map(|(index, _)| index + 1)
    }

    /// Returns the smallest box around all meshes.
    pub fn bounds(&self) -> Bounds {
        let points = self.0.meshes.iter().flat_map(|mesh| &mesh.vertices);
        Bounds::of_points(points.copied()).expect("no mesh is empty")
    }

    /// Returns the bytes that the meshes take in memory.
    pub fn bytes(&self) -> usize {
        let of = |mesh: &TriangleMesh| {
            size_of_val(&mesh.vertices[..]) + size_of_val(&mesh.triangles[..])
        };
        self.0.meshes.iter().map(of).sum()
    }

    /// Bounds the speed of a point of the surface within `[t0, t1]`, m/s.
    pub fn peak_speed(&self, t0: f64, t1: f64) -> f64 {
        let intervals = self.0.intervals.iter().enumerate();
        let during = intervals.filter(|(index, _)| {
            let slack = SAME / self.0.rate;
            self.time(*index) <= t1 - slack && self.time(index + 1) >= t0 + slack
        });
        during.map(|(_, it)| it.speed).fold(0.0, f64::max)
    }

    /// Returns the interval around a time, and how far into it the time is.
    pub(crate) fn moment(&self, time: f64) -> Moment {
        let last = self.0.meshes.len() - 1;
        let mut at = ((time - self.0.begin) * self.0.rate).clamp(0.0, last as f64);
        if (at - at.round()).abs() < SAME {
            at = at.round();
        }
        let index = (at as usize).min(last - 1);
        Moment {
            index,
            part: at - index as f64,
        }
    }

    pub(crate) fn keeps_triangles(&self, index: usize) -> bool {
        self.0.intervals[index].keeps_triangles
    }

    /// Returns the largest distance by which a point of the surface moves in an interval, metres.
    pub(crate) fn farthest(&self, index: usize) -> f64 {
        self.0.intervals[index].speed / self.0.rate
    }

    /// Returns the mesh at a time, seconds. Between two meshes of different triangles it is the
    /// later one.
    pub fn mesh(&self, time: f64) -> TriangleMesh {
        self.mesh_at(self.moment(time))
    }

    /// Returns the index of the first mesh with the triangles that [`Self::mesh`] has at a time,
    /// of those that have them up to then.
    pub fn triangles_of(&self, time: f64) -> usize {
        let Moment { index, part } = self.moment(time);
        let is_later = part == 1.0 || part > 0.0 && !self.keeps_triangles(index);
        let mut first = index + usize::from(is_later);
        while first > 0 && self.keeps_triangles(first - 1) {
            first -= 1;
        }
        first
    }

    pub(crate) fn mesh_at(&self, Moment { index, part }: Moment) -> TriangleMesh {
        let [a, b] = [&self.0.meshes[index], &self.0.meshes[index + 1]];
        match part {
            0.0 => a.clone(),
            1.0 => b.clone(),
            _ if !self.keeps_triangles(index) => b.clone(),
            _ => TriangleMesh {
                vertices: (a.vertices.iter().zip(&b.vertices))
                    .map(|(x, y)| x.lerp(*y, part))
                    .collect(),
                triangles: a.triangles.clone(),
            },
        }
    }
}

/// Whether two meshes have the same triangles.
fn is_same_topology(a: &TriangleMesh, b: &TriangleMesh) -> bool {
    a.vertices.len() == b.vertices.len() && a.triangles == b.triangles
}

/// Returns the largest distance of a vertex of `a` from the surface of `b`, metres.
fn apart(a: &TriangleMesh, b: &TriangleMesh) -> f64 {
    let tree = Bvh::new(b);
    let distance = |x: &DVec3| tree.nearest(*x, f64::INFINITY).map_or(0.0, |(d, _)| d);
    a.vertices.iter().map(distance).fold(0.0, f64::max)
}

/// Returns a distance grid with other values.
fn with_values(grid: &SignedDistance, values: Vec<f32>) -> SignedDistance {
    SignedDistance {
        origin: grid.origin,
        spacing: grid.spacing,
        dims: grid.dims,
        values,
    }
}

#[cfg(test)]
mod tests;
