//! Triangle meshes and their geometry. [`crate::inside`] checks whether a mesh has an inside, and
//! [`crate::mesh_file`] reads files.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use super::bounds::Bounds;

/// An indexed triangle mesh, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions, metres.
    pub vertices: Vec<DVec3>,
    /// Triangles as indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Returns the closed mesh between a sheet and the plane y = `top` above it. `points` are the
    /// sheet's, x fastest, of `counts` squares along x and z.
    pub fn between_sheets(points: Vec<DVec3>, counts: [u32; 2], top: f64) -> Self {
        let layer = points.len() as u32;
        let lid: Vec<_> = points.iter().map(|p| DVec3::new(p.x, top, p.z)).collect();
        let vertices = points.into_iter().chain(lid).collect();
        let [nx, nz] = counts;
        let row = nx + 1;
        let mut triangles = Vec::new();
        let mut quad = |[a, b, c, d]: [u32; 4]| triangles.extend([[a, b, c], [a, c, d]]);
        for k in 0..nz {
            for i in 0..nx {
                let a = k * row + i;
                // Seen from below and from above.
                quad([a, a + 1, a + 1 + row, a + row]);
                let a = a + layer;
                quad([a, a + row, a + 1 + row, a + 1]);
            }
        }
        // Sides, from the corner of two neighbours on the rim.
        let mut side = |a: u32, b: u32| quad([a, a + layer, b + layer, b]);
        for i in 0..nx {
            side(i, i + 1);
            side(nz * row + i + 1, nz * row + i);
        }
        for k in 0..nz {
            side((k + 1) * row, k * row);
            side(k * row + nx, (k + 1) * row + nx);
        }
        Self {
            vertices,
            triangles,
        }
    }

    /// Returns the corners of triangle `index`, metres.
    pub fn corners(&self, index: usize) -> [DVec3; 3] {
        self.triangles[index].map(|v| self.vertices[v as usize])
    }

    /// Returns the smallest box around the vertices; `None` for an empty mesh.
    pub fn bounds(&self) -> Option<Bounds> {
        Bounds::of_points(self.vertices.iter().copied())
    }

    /// Returns the area vector of triangle `index`, m²: half the cross product of two edges, which
    /// is normal times area.
    pub fn area_vector(&self, index: usize) -> DVec3 {
        let [a, b, c] = self.corners(index);
        0.5 * (b - a).cross(c - a)
    }

    /// Returns the surface area, m².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| self.area_vector(t).length())
            .sum()
    }

    /// Returns the enclosed volume, m³; negative if the normals point inward. Meaningful only for
    /// closed meshes.
    pub fn signed_volume(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    /// Returns the mesh transformed by `world_from_file`. A mirroring transform also reverses the
    /// triangles, so that they stay counter-clockwise seen from outside.
    pub fn transformed(&self, world_from_file: &DAffine3) -> Self {
        let mirrored = world_from_file.matrix3.determinant() < 0.0;
        Self {
            vertices: self
                .vertices
                .iter()
                .map(|&v| world_from_file.transform_point3(v))
                .collect(),
            triangles: self
                .triangles
                .iter()
                .map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] })
                .collect(),
        }
    }

    /// Returns the edges that are not cancelled by an oppositely directed one, by vertex indices.
    pub fn open_edges(&self) -> Vec<(u32, u32)> {
        let is_open = |uses: &[(u32, bool)]| {
            let forward = uses.iter().filter(|(_, forward)| *forward).count();
            2 * forward != uses.len()
        };
        self.edges()
            .into_iter()
            .filter(|(_, uses)| is_open(uses))
            .map(|(edge, _)| edge)
            .collect()
    }

    /// For each edge (smaller vertex first), the triangles that use it, and whether they traverse
    /// it in that order.
    pub(super) fn edges(&self) -> BTreeMap<(u32, u32), Vec<(u32, bool)>> {
        let mut edges = BTreeMap::<_, Vec<_>>::new();
        for (index, &[a, b, c]) in self.triangles.iter().enumerate() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                edges
                    .entry((from.min(to), from.max(to)))
                    .or_default()
                    .push((index as u32, from < to));
            }
        }
        edges
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A closed box of twelve triangles.
    pub(crate) fn box_mesh(bounds: Bounds) -> TriangleMesh {
        let corner = |i: u32| {
            DVec3::new(
                if i & 1 == 0 {
                    bounds.min.x
                } else {
                    bounds.max.x
                },
                if i & 2 == 0 {
                    bounds.min.y
                } else {
                    bounds.max.y
                },
                if i & 4 == 0 {
                    bounds.min.z
                } else {
                    bounds.max.z
                },
            )
        };
        let quads = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        TriangleMesh {
            vertices: (0..8).map(corner).collect(),
            triangles: quads
                .iter()
                .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
                .collect(),
        }
    }

    /// The unit cube.
    pub(crate) fn cube() -> TriangleMesh {
        box_mesh(Bounds {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        })
    }

    /// A closed sphere of `rings` × 2·`rings` quads.
    pub(crate) fn sphere(centre: DVec3, radius: f64, rings: u32) -> TriangleMesh {
        let sectors = 2 * rings;
        let mut vertices = vec![centre + DVec3::Y * radius];
        for ring in 1..rings {
            let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            for sector in 0..sectors {
                let turn = std::f64::consts::TAU * f64::from(sector) / f64::from(sectors);
                let (s, c) = polar.sin_cos();
                vertices.push(centre + radius * DVec3::new(s * turn.sin(), c, s * turn.cos()));
            }
        }
        vertices.push(centre - DVec3::Y * radius);
        let at = |ring: u32, sector: u32| 1 + (ring - 1) * sectors + sector % sectors;
        let last = vertices.len() as u32 - 1;
        let mut triangles = Vec::new();
        for s in 0..sectors {
            triangles.push([0, at(1, s), at(1, s + 1)]);
            triangles.push([last, at(rings - 1, s + 1), at(rings - 1, s)]);
            for r in 1..rings - 1 {
                triangles.push([at(r, s), at(r + 1, s), at(r + 1, s + 1)]);
                triangles.push([at(r, s), at(r + 1, s + 1), at(r, s + 1)]);
            }
        }
        TriangleMesh {
            vertices,
            triangles,
        }
    }

    #[test]
    fn a_cube_has_its_area_and_volume_and_keeps_them_when_mirrored() {
        let cube = cube();
        assert_eq!(cube.area(), 6.0);
        // Twelve terms of 1/6, each rounded.
        assert!((cube.signed_volume() - 1.0).abs() < 1e-15);
        let mirror = DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0));
        let mirrored = cube.transformed(&mirror);
        assert!((mirrored.signed_volume() - 2.0).abs() < 2e-15);
        assert!(cube.open_edges().is_empty());
    }
}
