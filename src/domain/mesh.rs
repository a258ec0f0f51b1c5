//! Triangle meshes: geometry, and whether a mesh has an inside.
//!
//! Files are read by [`crate::domain::mesh_file`].

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use super::{bounds::Bounds, bvh::Bvh, holes::Holes};

/// An indexed triangle mesh, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Metres.
    pub vertices: Vec<DVec3>,
    /// Indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
}

/// Why a mesh does not bound a volume. Coordinates are metres, in the mesh's own frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoInside {
    /// Nothing to enclose anything.
    #[error("the mesh has no triangles")]
    Empty,
    /// A tube, or a sheet.
    #[error("the mesh is open and has no inside: {why}; {holes}; close the mesh")]
    Open {
        /// The fault of the part that they are in.
        why: &'static str,
        /// The holes of that part.
        holes: Holes,
    },
    /// Closed, but flat.
    #[error("the mesh encloses no volume near {place}: a plate needs a thickness")]
    Flat {
        /// A point of the flat part.
        place: String,
    },
    /// Neighbouring triangles that face opposite ways.
    #[error(
        "triangles {first} and {second} (counted from 0) face opposite ways across the edge \
         {edge}; make the normals consistent"
    )]
    Inconsistent {
        /// Index of one triangle.
        first: u32,
        /// Index of the other.
        second: u32,
        /// End points of the edge.
        edge: String,
    },
}

/// Part of a cross-section that holes may take away (see [`Holes::missing`]): ½ is the most of a lone hole or of several
/// on one side; above it they face one another and water would run through, as through a tube, which has 1.
const MOST_MISSING: f64 = 0.6;

/// Winding number that some point just off the surface must reach, the part of all directions that the surface takes
/// up as seen from there. Beside a plate it is 0.5, under a dome of 60° 0.75, of 90° 0.85, in a cube without a face 0.94.
const INSIDE_WINDING: f64 = 0.75;

impl TriangleMesh {
    /// The corners of triangle `index`.
    pub fn corners(&self, index: usize) -> [DVec3; 3] {
        self.triangles[index].map(|v| self.vertices[v as usize])
    }

    /// The smallest box around the vertices; `None` for an empty mesh.
    pub fn bounds(&self) -> Option<Bounds> {
        Bounds::of_points(self.vertices.iter().copied())
    }

    /// Half the cross product of two edges: the normal times the area, m².
    pub fn area_vector(&self, index: usize) -> DVec3 {
        let [a, b, c] = self.corners(index);
        0.5 * (b - a).cross(c - a)
    }

    /// Surface area, m².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| self.area_vector(t).length())
            .sum()
    }

    /// Enclosed volume, m³; negative where the normals point inward. Only for closed meshes.
    pub fn signed_volume(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    /// The mesh moved by `world_from_file`. A mirroring transform also turns the triangles, so
    /// that they stay counter-clockwise seen from outside.
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

    /// Whether the mesh has an inside, part by connected part, so that a good building does not
    /// hide a sheet.
    ///
    /// A part passes if its holes do not face one another through it, each measured by itself, and if some point beside
    /// its surface is enclosed by most of it. Vertices must be shared (loading welds them). Gives the holes of an open
    /// mesh that passes, of which its user has to be told: where such a mesh's inside is, the generalised winding
    /// number decides, which closes a hole about as a flat cap would.
    ///
    /// # Errors
    /// [`NoInside`] names the holes, the place or the triangles at fault.
    pub fn check_inside(&self) -> Result<Holes, NoInside> {
        if self.triangles.is_empty() {
            return Err(NoInside::Empty);
        }
        let edges = self.edges();
        for (&(a, b), uses) in &edges {
            if let [(first, forward), (second, also_forward)] = uses[..]
                && forward == also_forward
            {
                return Err(NoInside::Inconsistent {
                    first,
                    second,
                    edge: self.edge_name(a, b),
                });
            }
        }
        self.parts().iter().try_for_each(check_part)?;
        Ok(Holes::of(self))
    }

    /// Edges that no oppositely directed edge cancels, by vertex indices.
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

    /// For each edge (least vertex first) the triangles that use it, and whether in that order.
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

    /// Connected parts as meshes of their own, in the order of their first triangle.
    fn parts(&self) -> Vec<TriangleMesh> {
        let mut parent: Vec<u32> = (0..self.vertices.len() as u32).collect();
        for &[a, b, c] in &self.triangles {
            for other in [b, c] {
                let (from, to) = (root(&mut parent, a), root(&mut parent, other));
                parent[from as usize] = to;
            }
        }
        let mut by_root = BTreeMap::<u32, usize>::new();
        let mut parts = Vec::<TriangleMesh>::new();
        let mut local = vec![u32::MAX; self.vertices.len()];
        for triangle in &self.triangles {
            let part_index = *by_root
                .entry(root(&mut parent, triangle[0]))
                .or_insert_with(|| {
                    parts.push(TriangleMesh::default());
                    parts.len() - 1
                });
            let part = &mut parts[part_index];
            part.triangles.push(triangle.map(|v| {
                let slot = &mut local[v as usize];
                if *slot == u32::MAX {
                    *slot = part.vertices.len() as u32;
                    part.vertices.push(self.vertices[v as usize]);
                }
                *slot
            }));
        }
        parts
    }

    fn edge_name(&self, a: u32, b: u32) -> String {
        format!(
            "{}-{}",
            point_name(self.vertices[a as usize]),
            point_name(self.vertices[b as usize])
        )
    }
}

/// Whether a connected part has an inside.
fn check_part(part: &TriangleMesh) -> Result<(), NoInside> {
    let holes = Holes::of(part);
    let open = |why, holes| Err(NoInside::Open { why, holes });
    if holes.missing(part) > MOST_MISSING {
        return open("its holes face one another through it, as in a tube", holes);
    }
    // 64 places tell a solid from a ring or a folded plate; more would only cost time.
    let bvh = Bvh::new(part);
    let stride = part.triangles.len().div_ceil(64);
    let has_inside = (0..part.triangles.len()).step_by(stride).any(|t| {
        let area_vector = part.area_vector(t);
        let offset = area_vector.normalize() * (1e-3 * area_vector.length().sqrt());
        let centre = part.corners(t).into_iter().sum::<DVec3>() / 3.0;
        [centre - offset, centre + offset]
            .into_iter()
            .any(|p| bvh.winding_number(p).abs() > INSIDE_WINDING)
    });
    if has_inside {
        Ok(())
    } else if holes.0.is_empty() {
        Err(NoInside::Flat {
            place: point_name(part.vertices[0]),
        })
    } else {
        open("no place in it is enclosed, as beside a sheet", holes)
    }
}

fn point_name(p: DVec3) -> String {
    format!("({:.4}, {:.4}, {:.4})", p.x, p.y, p.z)
}

/// Union-find with path halving.
fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
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

    /// A closed sphere from `rings` × 2·`rings` quads.
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
        // Twelve terms of 1/6 that round on their own.
        assert!((cube.signed_volume() - 1.0).abs() < 1e-15);
        let mirror = DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0));
        let mirrored = cube.transformed(&mirror);
        assert!((mirrored.signed_volume() - 2.0).abs() < 2e-15);
        assert!(cube.open_edges().is_empty());
        assert_eq!(cube.check_inside(), Ok(Holes::default()));
        assert!(sphere(DVec3::ZERO, 1.0, 12).check_inside() == Ok(Holes::default()));
    }

    #[test]
    fn a_building_without_its_floor_still_has_an_inside() {
        let mut open = box_mesh(Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(2.0, 4.0, 2.0),
        });
        // The quad at the least y.
        open.triangles.drain(4..6);
        assert_eq!(open.open_edges().len(), 4);
        let holes = open.check_inside().expect("a house without its floor");
        assert_eq!((holes.0.len(), holes.edges()), (1, 4));
        assert_eq!(holes.0[0].centre, DVec3::new(1.0, 0.0, 1.0));
        assert_eq!(holes.0[0].area_vector, DVec3::new(0.0, -4.0, 0.0));
    }

    #[test]
    fn sheets_and_plates_are_refused_by_name() {
        let mut sheet = cube();
        sheet.triangles.truncate(2);
        let error = sheet.check_inside().expect_err("a square is open");
        assert_eq!(
            error.to_string(),
            "the mesh is open and has no inside: no place in it is enclosed, as beside a sheet; 1 hole: 4 open \
             edges about (0.0000, 0.5000, 0.5000), 1.4142 m across; close the mesh"
        );

        let mut two_sided = sheet.clone();
        two_sided
            .triangles
            .extend(sheet.triangles.iter().map(|&[a, b, c]| [a, c, b]));
        assert!(matches!(
            two_sided.check_inside(),
            Err(NoInside::Flat { .. })
        ));

        // A ring of paper: no net area vector, open above and below.
        let mut ring = box_mesh(Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(1.0, 0.05, 1.0),
        });
        ring.triangles.drain(4..8);
        assert!(matches!(ring.check_inside(), Err(NoInside::Open { .. })));
    }

    #[test]
    fn one_turned_triangle_is_found() {
        let mut cube = cube();
        cube.triangles[5].swap(0, 1);
        let Err(NoInside::Inconsistent { first, second, .. }) = cube.check_inside() else {
            panic!("triangle 5 is turned");
        };
        assert!(first == 5 || second == 5, "{first} {second}");
    }

    #[test]
    fn a_good_part_does_not_hide_a_bad_one() {
        let mut mesh = cube();
        let base = mesh.vertices.len() as u32;
        mesh.vertices
            .extend([(5.0, 0.0), (6.0, 0.0), (5.0, 1.0)].map(|(x, z)| DVec3::new(x, 0.5, z)));
        mesh.triangles.push([base, base + 1, base + 2]);
        let Err(NoInside::Open { holes, .. }) = mesh.check_inside() else {
            panic!("a triangle beside a cube");
        };
        assert_eq!((holes.0.len(), holes.edges()), (1, 3));
    }
}
