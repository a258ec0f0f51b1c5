//! Distances to the meshes of a sequence. Between two meshes with different triangles there are no
//! keys.
//!
//! A node has the velocity of the point of the surface that is nearest to it.

use glam::DVec3;

use super::{
    super::{
        bounds::Bounds,
        bvh::{Bvh, nearest_point},
        mesh::TriangleMesh,
        signed_distance::{SignedDistance, sampled},
        thin::{Needed, thicken},
    },
    Moment, ShapeSequence,
    field::{Key, Keys, Nodes},
    samples::{nearest, weights},
    with_values,
};

/// A sequence of meshes, sampled so often that no point moves farther than a node spacing.
#[derive(Debug)]
pub(super) struct MeshKeys {
    sequence: ShapeSequence,
    /// Number of parts of each interval between two meshes.
    parts: Vec<u32>,
    /// Thickness up to which meshes are thickened.
    needed: Option<Needed>,
}

impl MeshKeys {
    /// Keys for a grid with nodes `spacing` metres apart.
    pub(super) fn new(sequence: &ShapeSequence, spacing: f64, needed: Option<Needed>) -> Self {
        let intervals = 0..sequence.meshes().len() - 1;
        let parts = intervals.map(|index| match sequence.keeps_triangles(index) {
            true => (sequence.farthest(index) / spacing).ceil().max(1.0) as u32,
            false => 1,
        });
        Self {
            sequence: sequence.clone(),
            parts: parts.collect(),
            needed,
        }
    }

    /// Samples the distance to a mesh. `velocity` is that of a point of the mesh, given with the
    /// index and the corners of its triangle.
    fn with_velocities(
        &self,
        grid: &SignedDistance,
        mesh: &TriangleMesh,
        velocity: &(impl Fn(DVec3, usize, [DVec3; 3]) -> DVec3 + Sync),
    ) -> Nodes {
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

impl Keys for MeshKeys {
    fn place(&self, time: f64) -> (Key, f64) {
        let Moment { index, part } = self.sequence.moment(time);
        let parts = self.parts[index];
        let at = part * f64::from(parts);
        let part = (at as u32).min(parts - 1);
        (Key { index, part }, at - f64::from(part))
    }

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

    fn duration(&self, key: Key) -> f64 {
        1.0 / (self.sequence.rate() * f64::from(self.parts[key.index]))
    }

    fn sampled(&self, grid: &SignedDistance, key: Key) -> Nodes {
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
            None => self.with_velocities(grid, &mesh, &|_, _, _| DVec3::ZERO),
            Some(index) if sequence.keeps_triangles(index) => {
                let [a, b] = [&meshes[index], &meshes[index + 1]];
                let ways: Vec<DVec3> = (a.vertices.iter().zip(&b.vertices))
                    .map(|(a, b)| rate * (*b - *a))
                    .collect();
                self.with_velocities(grid, &mesh, &|x, triangle, corners| {
                    let [u, v, w] = weights(x, corners);
                    let [a, b, c] = mesh.triangles[triangle].map(|k| ways[k as usize]);
                    u * a + v * b + w * c
                })
            }
            Some(index) => {
                let tree = Bvh::new(&meshes[index]);
                let most = rate * sequence.farthest(index);
                self.with_velocities(grid, &mesh, &|x, _, _| {
                    let velocity = rate * (x - nearest(&meshes[index], &tree, x));
                    velocity.clamp_length_max(most)
                })
            }
        }
    }
}
