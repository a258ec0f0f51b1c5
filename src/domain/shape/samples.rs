//! Samples of a surface whose shape changes: points that stay on their triangles.

use std::ops::RangeInclusive;

use glam::DVec3;

use super::{
    super::{
        bounds::FAR,
        bvh::{Bvh, nearest_point},
        mesh::TriangleMesh,
        parallel,
        sampling::Darts,
    },
    Moment, ShapeSequence,
};

/// A triangle that has grown by this factor in area since points were thrown on it gets more.
const GROWN: f64 = 1.44;

/// A sample of a surface at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position, metres.
    pub position: DVec3,
    /// Area that the sample represents, m².
    pub area: f64,
    /// Velocity, m/s.
    pub velocity: DVec3,
}

/// Samples of a surface that moves.
pub trait SurfaceSamples: std::fmt::Debug + Send + Sync {
    /// Returns the number of samples at any time.
    fn count(&self) -> usize;

    /// Returns the samples at `time` with their mean velocity over the `step` seconds before it;
    /// with a step of 0 they rest. Where the surface has fewer than [`Self::count`], others without
    /// an area lie far away.
    fn at(&self, time: f64, step: f64) -> Vec<SurfacePoint>;
}

/// Samples on all meshes of a sequence, about as far apart as a given spacing. The samples of
/// meshes with the same triangles are the same points of the surface.
#[derive(Clone, Debug)]
pub struct ShapeSamples {
    sequence: ShapeSequence,
    runs: Vec<Run>,
    count: usize,
}

/// Meshes with the same triangles.
#[derive(Clone, Debug)]
struct Run {
    meshes: RangeInclusive<usize>,
    points: Vec<Point>,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
struct Point {
    triangle: u32,
    /// Weights of the triangle's corners.
    weights: [f64; 3],
    /// Area that the sample represents, relative to the triangle's.
    part: f64,
}

impl ShapeSamples {
    /// Samples the meshes of a sequence, at most `spacing` metres apart.
    pub fn new(sequence: &ShapeSequence, spacing: f64) -> Self {
        let meshes = sequence.meshes();
        let mut starts: Vec<usize> = std::iter::once(0).chain(sequence.breaks()).collect();
        starts.push(meshes.len());
        let ranges: Vec<_> = starts.windows(2).map(|it| it[0]..=it[1] - 1).collect();
        let runs: Vec<Run> = parallel::map_slice(&ranges, |range| Run {
            points: points(&meshes[range.clone()], spacing),
            meshes: range.clone(),
        });
        Self {
            sequence: sequence.clone(),
            count: runs.iter().map(|run| run.points.len()).max().unwrap_or(0),
            runs,
        }
    }
}

impl SurfaceSamples for ShapeSamples {
    fn count(&self) -> usize {
        self.count
    }

    fn at(&self, time: f64, step: f64) -> Vec<SurfacePoint> {
        let sequence = &self.sequence;
        let mut now = sequence.moment(time);
        if now.part == 0.0 && now.index > 0 {
            now = Moment {
                index: now.index - 1,
                part: 1.0,
            };
        }
        let is_kept = sequence.keeps_triangles(now.index) || now.part == 0.0;
        let mesh_index = if is_kept { now.index } else { now.index + 1 };
        let run = self
            .runs
            .iter()
            .find(|run| run.meshes.contains(&mesh_index));
        let run = run.expect("each mesh is in a run");
        let mut found = match is_kept {
            true => self.moved(run, now, time, step),
            false => self.arriving(run, now, time, step),
        };
        // Where triangles have grown unevenly, the parts of neighbours are not those of one mesh.
        let whole = match is_kept {
            true => sequence.mesh_at(now).area(),
            false => sequence.meshes()[mesh_index].area(),
        };
        let sum: f64 = found.iter().map(|point| point.area).sum();
        found.iter_mut().for_each(|point| point.area *= whole / sum);
        // Without an area it would count as water where a particle is near.
        let away = SurfacePoint {
            position: DVec3::splat(FAR),
            area: 0.0,
            velocity: DVec3::ZERO,
        };
        found.resize(self.count, away);
        found
    }
}

impl ShapeSamples {
    /// Points that stay on their triangles.
    fn moved(&self, run: &Run, now: Moment, time: f64, step: f64) -> Vec<SurfacePoint> {
        let sequence = &self.sequence;
        let mesh = sequence.mesh_at(now);
        // The points of a run begin with its first mesh, and rest before the first of all.
        let first = *run.meshes.start();
        let begin = match first {
            0 => time - step,
            _ => (time - step).max(sequence.time(first)),
        };
        let before = match time > begin {
            true => sequence.mesh(begin),
            false => mesh.clone(),
        };
        let rate = if time > begin {
            1.0 / (time - begin)
        } else {
            0.0
        };
        parallel::map_slice(&run.points, |point| {
            let [position, from] = [&mesh, &before].map(|mesh| point.place(mesh));
            SurfacePoint {
                position,
                area: point.area(&mesh),
                velocity: (position - from) * rate,
            }
        })
    }

    /// Points of the later of two meshes with different triangles, on their way there from the
    /// nearest points of the earlier one.
    fn arriving(&self, run: &Run, now: Moment, time: f64, step: f64) -> Vec<SurfacePoint> {
        let meshes = self.sequence.meshes();
        // After the last mesh the surface rests.
        let until = time.min(self.sequence.time(now.index + 1));
        let rate = match step {
            0.0 => 0.0,
            _ => self.sequence.rate() * ((until - (time - step)) / step).clamp(0.0, 1.0),
        };
        let [earlier, later] = [&meshes[now.index], &meshes[now.index + 1]];
        let tree = Bvh::new(earlier);
        parallel::map_slice(&run.points, |point| {
            let end = point.place(later);
            let way = end - nearest(earlier, &tree, end);
            SurfacePoint {
                position: end - (1.0 - now.part) * way,
                area: point.area(later),
                velocity: rate * way,
            }
        })
    }
}

impl Point {
    fn place(&self, mesh: &TriangleMesh) -> DVec3 {
        let [a, b, c] = mesh.corners(self.triangle as usize);
        let [u, v, w] = self.weights;
        u * a + v * b + w * c
    }

    fn area(&self, mesh: &TriangleMesh) -> f64 {
        self.part * mesh.area_vector(self.triangle as usize).length()
    }
}

/// Returns the point of a mesh that is nearest to `x`.
pub(super) fn nearest(mesh: &TriangleMesh, tree: &Bvh, x: DVec3) -> DVec3 {
    tree.nearest(x, f64::INFINITY).map_or(x, |(_, triangle)| {
        let [a, b, c] = mesh.corners(triangle as usize);
        nearest_point(x, a, b, c)
    })
}

/// Returns the weights of a triangle's corners at a point of it; the nearest corner alone where the
/// triangle has no area.
pub(super) fn weights(x: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac, ax) = (b - a, c - a, x - a);
    let (bb, bc, cc) = (ab.dot(ab), ab.dot(ac), ac.dot(ac));
    let (xb, xc) = (ax.dot(ab), ax.dot(ac));
    let square = bb * cc - bc * bc;
    if square > 1e-24 * bb * cc {
        let v = ((cc * xb - bc * xc) / square).clamp(0.0, 1.0);
        let w = ((bb * xc - bc * xb) / square).clamp(0.0, 1.0 - v);
        return [1.0 - v - w, v, w];
    }
    let apart = [a, b, c].map(|corner| corner.distance_squared(x));
    match apart {
        [a, b, c] if a <= b && a <= c => [1.0, 0.0, 0.0],
        [_, b, c] if b <= c => [0.0, 1.0, 0.0],
        _ => [0.0, 0.0, 1.0],
    }
}

/// Throws points on meshes with the same triangles: on the largest of them, then on each where it
/// is larger.
fn points(meshes: &[TriangleMesh], spacing: f64) -> Vec<Point> {
    let areas: Vec<f64> = meshes.iter().map(TriangleMesh::area).collect();
    let largest = (0..meshes.len()).max_by(|&a, &b| areas[a].total_cmp(&areas[b]));
    let Some(largest) = largest else {
        return Vec::new();
    };
    let area_of = |mesh: &TriangleMesh, t: usize| mesh.area_vector(t).length();
    let triangles = 0..meshes[largest].triangles.len();
    let mut most: Vec<f64> = triangles.clone().map(|_| 0.0).collect();
    let mut darts = Darts::new(spacing);
    let mut found: Vec<(u32, [f64; 3])> = Vec::new();
    let others = (0..meshes.len()).filter(|&k| k != largest);
    for k in std::iter::once(largest).chain(others) {
        let mesh = &meshes[k];
        let grown: Vec<bool> = triangles
            .clone()
            .map(|t| area_of(mesh, t) > GROWN * most[t])
            .collect();
        if !grown.contains(&true) {
            continue;
        }
        let place = |it: &(u32, [f64; 3])| placed(mesh, it);
        darts.carry(mesh, |k| place(&found[k]));
        let around = mesh.bounds().map(|bounds| bounds.grown(spacing));
        darts.throw(mesh, &around.unwrap_or_default(), |t| grown[t]);
        for k in found.len()..darts.positions.len() {
            let triangle = darts.triangles[k];
            let corners = mesh.corners(triangle as usize);
            found.push((triangle, weights(darts.positions[k], corners)));
        }
        for t in triangles.clone().filter(|&t| grown[t]) {
            most[t] = area_of(mesh, t);
        }
    }
    let mesh = &meshes[largest];
    darts.carry(mesh, |k| placed(mesh, &found[k]));
    let parts = darts.areas(areas[largest]);
    let all = found.into_iter().zip(parts);
    all.map(|((triangle, weights), area)| {
        let whole = area_of(mesh, triangle as usize);
        Point {
            triangle,
            weights,
            part: if whole > 0.0 { area / whole } else { 0.0 },
        }
    })
    .collect()
}

fn placed(mesh: &TriangleMesh, &(triangle, [u, v, w]): &(u32, [f64; 3])) -> DVec3 {
    let [a, b, c] = mesh.corners(triangle as usize);
    u * a + v * b + w * c
}
