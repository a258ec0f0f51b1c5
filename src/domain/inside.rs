//! Tests whether a mesh has an inside.

use std::{collections::BTreeMap, fmt};

use glam::DVec3;

use super::{bvh::Bvh, holes::Holes, mesh::TriangleMesh};

/// Reason why a mesh does not bound a volume. Coordinates are metres, in the mesh's own frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoInside {
    /// The mesh has no triangles.
    #[error("the mesh has no triangles")]
    Empty,
    /// The mesh is open, such as a tube or a sheet.
    #[error(
        "the mesh is open and has no inside: {why}; {holes}{parts}; close the mesh, or give its \
         walls a thickness if water is to be inside it"
    )]
    Open {
        /// What is wrong with the part that the holes belong to.
        why: &'static str,
        /// The holes of that part.
        holes: Holes,
        /// The connected parts of the whole mesh.
        parts: PartCount,
    },
    /// The mesh is closed but flat.
    #[error("the mesh encloses no volume near {place}: a plate needs a thickness")]
    Flat {
        /// A point of the flat part.
        place: String,
    },
    /// Neighbouring triangles face opposite ways.
    #[error(
        "triangles {first} and {second} (counted from 0) face opposite ways across the edge \
         {edge}; make the normals consistent"
    )]
    Inconsistent {
        /// Index of one triangle.
        first: u32,
        /// Index of the other.
        second: u32,
        /// End points of the edge that they share.
        edge: String,
    },
}

/// Number of connected parts of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartCount {
    /// All connected parts.
    pub count: usize,
    /// Parts that consist of a single triangle.
    pub lone: usize,
}

/// Empty for a connected mesh; otherwise tells which of the parts a message refers to.
impl fmt::Display for PartCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, lone } = self;
        match (count, lone) {
            (..=1, _) => Ok(()),
            (_, 0) => write!(f, " in one of its {count} separate parts"),
            _ => write!(
                f,
                " in one of its {count} separate parts, {lone} of which are a single triangle \
                 (vertices are joined where they are equal, in a text to 7 digits of the mesh's \
                 size, and nowhere else)"
            ),
        }
    }
}

/// Largest fraction of a cross-section that holes may remove (see [`Holes::missing`]). A single
/// hole, or several on one side, remove ½ at most. Above it, holes face one another and water would
/// run through; a tube has 1.
const MOST_MISSING: f64 = 0.6;

/// Winding number that some point just off the surface must reach: the fraction of all directions
/// that the surface covers as seen from there. Beside a plate it is 0.5, under a dome of 60° 0.75,
/// of 90° 0.85, in a cube without a face 0.94.
const INSIDE_WINDING: f64 = 0.75;

impl TriangleMesh {
    /// Checks that the mesh has an inside, one connected part at a time, so that a good building
    /// does not hide a sheet.
    ///
    /// A part passes if its holes do not face one another through it, each measured by itself, and
    /// if the part encloses most of the directions around some point beside its surface. Vertices
    /// must be shared (loading welds them). Returns the holes of an open mesh that passes, which
    /// callers should report: the inside of such a mesh is decided by the generalised winding
    /// number, which closes a hole about as a flat cap would.
    ///
    /// # Errors
    /// [`NoInside`] names the holes, the position or the triangles at fault.
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
        let all = self.parts();
        let parts = PartCount {
            count: all.len(),
            lone: all.iter().filter(|part| part.triangles.len() == 1).count(),
        };
        all.iter().try_for_each(|part| check_part(part, parts))?;
        Ok(Holes::of(self))
    }

    /// Connected parts as separate meshes, in the order of their first triangle.
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

/// Checks that a connected part has an inside.
fn check_part(part: &TriangleMesh, parts: PartCount) -> Result<(), NoInside> {
    let holes = Holes::of(part);
    let open = |why, holes| Err(NoInside::Open { why, holes, parts });
    if holes.missing(part) > MOST_MISSING {
        return open("its holes face one another through it, as in a tube", holes);
    }
    // 64 test points distinguish a solid from a ring or a folded plate; more would only
    // take longer.
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
mod tests {
    use super::super::{
        bounds::Bounds,
        mesh::tests::{box_mesh, cube, sphere},
    };
    use super::*;

    #[test]
    fn a_cube_and_a_sphere_have_an_inside_and_no_hole() {
        assert_eq!(cube().check_inside(), Ok(Holes::default()));
        assert!(sphere(DVec3::ZERO, 1.0, 12).check_inside() == Ok(Holes::default()));
    }

    /// A cube whose triangles each have their own corners, which differ by a rounding.
    #[test]
    fn an_unwelded_mesh_is_told_that_it_falls_into_triangles() {
        let whole = cube();
        let mut loose = TriangleMesh::default();
        for t in 0..whole.triangles.len() {
            let first = loose.vertices.len() as u32;
            let off = 1e-12 * t as f64;
            loose
                .vertices
                .extend(whole.corners(t).map(|corner| corner + off));
            loose.triangles.push([first, first + 1, first + 2]);
        }
        let said = |mesh: &TriangleMesh| mesh.check_inside().expect_err("open").to_string();
        let all = said(&loose);
        assert!(
            all.contains(
                "1 hole: 3 open edges about (0.0000, 0.3333, 0.6667), 1.4142 m across in one of \
                 its 12 separate parts, 12 of which are a single triangle"
            ),
            "{all}"
        );
        // A connected mesh gets no words about parts.
        let mut sheet = cube();
        sheet.triangles.truncate(2);
        assert!(!said(&sheet).contains("parts"), "{}", said(&sheet));
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
            "the mesh is open and has no inside: no place in it is enclosed, as beside a sheet; 1 \
             hole: 4 open edges about (0.0000, 0.5000, 0.5000), 1.4142 m across; close the mesh, \
             or give its walls a thickness if water is to be inside it"
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
