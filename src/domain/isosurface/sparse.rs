//! Extracts a mesh around the inside of a sparse level set.

use std::collections::HashMap;

use glam::DVec3;

use super::{
    NEAREST,
    cell::{EDGES, Loops, fan},
    corner,
};
use crate::mesh::TriangleMesh;

/// Values of a narrow band at integer lattice points, negative inside.
pub type Band = HashMap<[i32; 3], f32>;

/// Extracts the mesh where a band is 0, in lattice units, counter-clockwise seen from outside.
/// Cells with a corner outside of the band yield no triangles: where the surface passes through
/// them, the mesh is open.
pub fn around(band: &Band) -> TriangleMesh {
    let mut cells: Vec<[i32; 3]> = band.keys().copied().collect();
    cells.sort_unstable_by_key(|&[x, y, z]| [z, y, x]);
    let mut mesh = Builder::default();
    for cell in cells {
        let values = [0, 1, 2, 3, 4, 5, 6, 7].map(|c| {
            let at = corner([0; 3], c);
            let at = [0, 1, 2].map(|axis| cell[axis].checked_add(at[axis] as i32));
            let [Some(x), Some(y), Some(z)] = at else {
                return None;
            };
            // The inside corresponds to water in `Loops`.
            band.get(&[x, y, z]).map(|value| -value)
        });
        let mut known = [0.0; 8];
        if (values.iter().zip(&mut known)).all(|(value, into)| value.map(|v| *into = v).is_some()) {
            mesh.add(cell, &known);
        }
    }
    mesh.mesh
}

/// Key of a vertex: the least corner of its cell or edge, and the axis of its edge or 3 plus the
/// number of the loop that it is the centre of.
type Key = ([i32; 3], u8);

#[derive(Default)]
struct Builder {
    mesh: TriangleMesh,
    by_key: HashMap<Key, u32>,
}

impl Builder {
    fn add(&mut self, cell: [i32; 3], values: &[f32; 8]) {
        let inside = values.iter().filter(|&&value| value > 0.0).count();
        if inside == 0 || inside == 8 {
            return;
        }
        for (number, edges) in Loops::of(values).iter().enumerate() {
            let ring: Vec<u32> = (edges.iter())
                .map(|&edge| self.on_edge(cell, usize::from(edge), values))
                .collect();
            match fan(edges) {
                Some(apex) => {
                    let at = |k: usize| ring[(apex + k) % ring.len()];
                    (1..ring.len() - 1)
                        .for_each(|k| self.mesh.triangles.push([at(0), at(k), at(k + 1)]));
                }
                None => {
                    let sum: DVec3 = ring.iter().map(|&v| self.mesh.vertices[v as usize]).sum();
                    let middle = self.vertex((cell, 3 + number as u8), sum / ring.len() as f64);
                    (0..ring.len()).for_each(|k| {
                        let next = ring[(k + 1) % ring.len()];
                        self.mesh.triangles.push([middle, ring[k], next]);
                    });
                }
            }
        }
    }

    fn on_edge(&mut self, cell: [i32; 3], edge: usize, values: &[f32; 8]) -> u32 {
        let (from, axis) = EDGES[edge];
        let step = corner([0; 3], from);
        let low = [0, 1, 2].map(|k| cell[k] + step[k] as i32);
        let [a, b] = [from, from | 1 << axis].map(|c| f64::from(values[c]));
        let mut place = DVec3::from_array(low.map(f64::from));
        place[axis] += (a / (a - b)).clamp(NEAREST, 1.0 - NEAREST);
        self.vertex((low, axis as u8), place)
    }

    fn vertex(&mut self, key: Key, place: DVec3) -> u32 {
        let vertices = &mut self.mesh.vertices;
        *self.by_key.entry(key).or_insert_with(|| {
            vertices.push(place);
            vertices.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distances to a sphere, in a band that is `wide` lattice units wide on each side.
    fn sphere(radius: f64, wide: f64) -> Band {
        let centre = DVec3::new(0.3, -0.2, 0.1);
        let reach = (radius + wide) as i32 + 2;
        let mut band = Band::new();
        for z in -reach..=reach {
            for y in -reach..=reach {
                for x in -reach..=reach {
                    let place = DVec3::new(f64::from(x), f64::from(y), f64::from(z));
                    let distance = (place - centre).length() - radius;
                    if distance.abs() < wide {
                        band.insert([x, y, z], distance as f32);
                    }
                }
            }
        }
        band
    }

    #[test]
    fn a_sphere_is_closed_and_has_its_volume() {
        let radius = 9.0;
        let mesh = around(&sphere(radius, 3.0));
        assert!(mesh.open_edges().is_empty());
        let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        // Chords of length 1 lie up to 1/8r inside: 3 · √3² / 8 r² of the volume at most.
        let off = mesh.signed_volume() / volume - 1.0;
        assert!(off.abs() < 9.0 / (8.0 * radius * radius), "{off}");
        // Negative controls: swapping inside and outside flips the mesh, and a band without one
        // side leaves it open.
        let inverted = sphere(radius, 3.0)
            .into_iter()
            .map(|(at, value)| (at, -value));
        assert!(around(&inverted.collect()).signed_volume() < 0.0);
        let torn = sphere(radius, 3.0).into_iter().filter(|(at, _)| at[0] < 5);
        assert!(!around(&torn.collect()).open_edges().is_empty());
    }
}
