//! Holes of open meshes, and the fraction of a part that they leave open.

use std::{
    collections::{BTreeMap, HashMap},
    fmt,
};

use glam::DVec3;

use super::{bounds::Bounds, mesh::TriangleMesh};

/// Number of holes that a message describes; the rest are counted.
const NAMED: usize = 3;

/// Number of directions that are examined, those of the largest caps. A hole beyond them is smaller
/// than 1/64 of the open area.
const MOST_DIRECTIONS: usize = 64;

/// A closed loop of open edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Hole {
    /// Mean of the loop's vertices, metres.
    pub centre: DVec3,
    /// Diagonal of the bounding box of the loop, metres.
    pub size: f64,
    /// Number of edges of the loop.
    pub edges: usize,
    /// Area vector of any cap that closes the loop, m². It points out of the mesh if the triangles
    /// face outward.
    pub area_vector: DVec3,
}

/// The holes of a mesh, the largest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Holes(pub Vec<Hole>);

impl Holes {
    /// Traces the boundary of a consistently oriented mesh.
    ///
    /// Each triangle adds its three directed edges, and opposite ones cancel. The remaining edges
    /// enter and leave each vertex equally often, and so form closed loops. A loop that meets a
    /// vertex again is cut there, so that two touching holes stay two.
    pub(super) fn of(mesh: &TriangleMesh) -> Self {
        let mut next = BTreeMap::<u32, Vec<u32>>::new();
        for ((a, b), uses) in mesh.edges() {
            let forward = uses.iter().filter(|(_, forward)| *forward).count();
            let backward = uses.len() - forward;
            // The hole's own loop runs against the triangles' edges.
            for _ in backward..forward {
                next.entry(b).or_default().push(a);
            }
            for _ in forward..backward {
                next.entry(a).or_default().push(b);
            }
        }
        let mut holes = Vec::new();
        while let Some((&first, _)) = next.first_key_value() {
            trace(first, &mut next, |walk| {
                holes.push(Hole::around(
                    walk.iter().map(|&v| mesh.vertices[v as usize]),
                ));
            });
        }
        // A stable sort: holes of equal size stay in the order of their vertices.
        holes.sort_by(|a, b| b.size.total_cmp(&a.size));
        Self(holes)
    }

    /// Returns the number of open edges of all holes.
    pub fn edges(&self) -> usize {
        self.0.iter().map(|hole| hole.edges).sum()
    }

    /// Returns the largest fraction of a cross-section of `part` that its holes remove: along the
    /// direction of each hole, the caps' share of the projected area of faces and caps together.
    ///
    /// Caps are added by size, so that opposite holes do not cancel. The area vectors of a capped
    /// part sum to zero: a single hole, however large, has as much area opposite, and the result is
    /// at most ½ (a box without its floor). Above that, holes face one another: 1 is a tube.
    pub(super) fn missing(&self, part: &TriangleMesh) -> f64 {
        let mut caps: Vec<DVec3> = self.0.iter().map(|hole| hole.area_vector).collect();
        caps.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
        let faces: Vec<DVec3> = (0..part.triangles.len())
            .map(|t| part.area_vector(t))
            .collect();
        let along = |vectors: &[DVec3], normal: DVec3| -> f64 {
            vectors.iter().map(|vector| vector.dot(normal).abs()).sum()
        };
        let directions = caps.iter().take(MOST_DIRECTIONS);
        directions
            .filter_map(|cap| cap.try_normalize())
            .map(|normal| {
                let open = along(&caps, normal);
                open / (open + along(&faces, normal))
            })
            .fold(0.0, f64::max)
    }
}

/// Follows edges from `first` until none leads on, and passes each loop that closes on the way
/// to `close`.
fn trace(first: u32, next: &mut BTreeMap<u32, Vec<u32>>, mut close: impl FnMut(&[u32])) {
    let mut walk = vec![first];
    let mut place = HashMap::from([(first, 0)]);
    while let Some(&at) = walk.last() {
        let Some(to) = take(next, at) else {
            return;
        };
        if let Some(&start) = place.get(&to) {
            close(&walk[start..]);
            for vertex in walk.drain(start + 1..) {
                place.remove(&vertex);
            }
        } else {
            place.insert(to, walk.len());
            walk.push(to);
        }
    }
}

/// Removes and returns an edge out of `from`.
fn take(next: &mut BTreeMap<u32, Vec<u32>>, from: u32) -> Option<u32> {
    let out = next.get_mut(&from)?;
    let to = out.pop();
    if out.is_empty() {
        next.remove(&from);
    }
    to
}

impl Hole {
    fn around(vertices: impl ExactSizeIterator<Item = DVec3> + Clone) -> Self {
        let edges = vertices.len();
        let centre = vertices.clone().sum::<DVec3>() / edges as f64;
        let ends = vertices.clone().cycle().skip(1);
        let area = vertices
            .clone()
            .zip(ends)
            .map(|(a, b)| 0.5 * (a - centre).cross(b - centre));
        Self {
            centre,
            size: Bounds::of_points(vertices.clone()).map_or(0.0, |box_| box_.size().length()),
            edges,
            area_vector: area.sum(),
        }
    }
}

impl fmt::Display for Hole {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            centre: c, size, ..
        } = self;
        let edges = self.edges;
        write!(
            f,
            "{edges} open edges about ({:.4}, {:.4}, {:.4}), {size:.4} m across",
            c.x, c.y, c.z
        )
    }
}

/// Formats in one line: how many holes, and where the largest are.
impl fmt::Display for Holes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.len() {
            1 => write!(f, "1 hole: ")?,
            count => write!(f, "{count} holes with {} open edges: ", self.edges())?,
        }
        for (index, hole) in self.0.iter().take(NAMED).enumerate() {
            let comma = if index == 0 { "" } else { ", " };
            write!(f, "{comma}{hole}")?;
        }
        match self.0.len().saturating_sub(NAMED) {
            0 => Ok(()),
            more => write!(f, ", and {more} more, none larger"),
        }
    }
}

impl TriangleMesh {
    /// Returns the enclosed volume, m³, with a flat cap over each hole, whichever way the
    /// triangles face.
    pub fn capped_volume(&self) -> f64 {
        let holes = Holes::of(self);
        let caps = holes
            .0
            .iter()
            .map(|hole| hole.centre.dot(hole.area_vector) / 3.0);
        (self.signed_volume() + caps.sum::<f64>()).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{
        inside::NoInside,
        mesh::tests::{box_mesh, sphere},
    };
    use super::*;

    /// A prism of `sides` about the z axis, radius 1, from −`half` to `half`, with the
    /// requested caps.
    fn prism(sides: u32, half: f64, caps: [bool; 2]) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for z in [-half, half] {
            for k in 0..sides {
                let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(sides)).sin_cos();
                mesh.vertices.push(DVec3::new(c, s, z));
            }
        }
        for k in 0..sides {
            let (a, b) = (k, (k + 1) % sides);
            mesh.triangles.push([a, b, b + sides]);
            mesh.triangles.push([a, b + sides, a + sides]);
        }
        for k in 1..sides - 1 {
            if caps[0] {
                mesh.triangles.push([0, k + 1, k]);
            }
            if caps[1] {
                mesh.triangles.push([sides, sides + k, sides + k + 1]);
            }
        }
        mesh
    }

    #[test]
    fn two_opposite_holes_do_not_cancel() {
        // A tube, ten radii long, and the same with one cap and with both.
        let tube = prism(48, 5.0, [false, false]);
        let Err(NoInside::Open { holes, .. }) = tube.check_inside() else {
            panic!("a tube lets water through: {:?}", tube.check_inside());
        };
        assert_eq!(holes.0.len(), 2);
        assert_eq!(holes.edges(), 96);
        for hole in &holes.0 {
            assert!(
                hole.centre.truncate().length() < 1e-12 && hole.centre.z.abs() == 5.0,
                "{hole}"
            );
            // 2 √2: the box around a circle of radius 1, which the 48 corners touch.
            assert!((hole.size - 8f64.sqrt()).abs() < 1e-12, "{hole}");
            // A regular polygon's area, 48/2 sin(τ/48), pointing out of the mesh.
            let area = 24.0 * (std::f64::consts::TAU / 48.0).sin();
            let outward = area * hole.centre.z.signum();
            assert!((hole.area_vector - DVec3::Z * outward).length() < 1e-12);
        }
        // A tube's cross-section is fully open; of a cup's, half is closed.
        assert!((holes.missing(&tube) - 1.0).abs() < 1e-12);
        let cup = prism(48, 5.0, [true, false]);
        let taken = cup.check_inside().expect("a cup");
        assert_eq!((taken.0.len(), taken.edges()), (1, 48));
        assert!((taken.missing(&cup) - 0.5).abs() < 1e-12);
        assert_eq!(
            prism(48, 5.0, [true, true]).check_inside(),
            Ok(Holes::default())
        );
    }

    #[test]
    fn a_tube_is_refused_at_any_length_and_angle() {
        use glam::{DAffine3, DQuat};
        for half in [0.1, 1.0, 100.0] {
            let tube = prism(12, half, [false, false]);
            let turned = DAffine3::from_rotation_translation(
                DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -2.0),
                DVec3::new(30.0, 0.1, -7.0),
            );
            for mesh in [tube.transformed(&turned), tube] {
                let error = mesh.check_inside().expect_err("a tube").to_string();
                assert!(
                    error.contains("2 holes with 24 open edges: 12 open edges about"),
                    "{half} {error}"
                );
            }
        }
    }

    #[test]
    fn a_hole_is_found_where_a_triangle_was_and_touching_ones_are_told_apart() {
        let whole = sphere(DVec3::splat(0.5), 0.5, 20);
        let mut open = whole.clone();
        let corners = open.corners(300);
        open.triangles.remove(300);
        let holes = open.check_inside().expect("a small hole");
        assert_eq!((holes.0.len(), holes.edges()), (1, 3));
        let [a, b, c] = corners;
        assert!((holes.0[0].centre - (a + b + c) / 3.0).length() < 1e-12);
        assert!((holes.0[0].area_vector - whole.area_vector(300)).length() < 1e-15);

        // Two triangles of the fan around the north pole that share only the pole.
        let mut open = whole.clone();
        let fan: Vec<usize> = (0..whole.triangles.len())
            .filter(|&t| whole.triangles[t].contains(&0))
            .collect();
        for t in [fan[9], fan[2]] {
            open.triangles.remove(t);
        }
        let holes = open.check_inside().expect("two small holes");
        assert_eq!((holes.0.len(), holes.edges()), (2, 6));

        // Seven holes that do not touch: three are described, the rest counted.
        let mut open = whole;
        for k in (0..7).rev() {
            open.triangles.remove(200 + 60 * k);
        }
        let text = open.check_inside().expect("small holes").to_string();
        assert!(
            text.starts_with("7 holes with 21 open edges: 3 open edges about ("),
            "{text}"
        );
        assert!(text.ends_with(", and 4 more, none larger"), "{text}");
        assert_eq!(text.matches("m across").count(), 3, "{text}");
    }

    #[test]
    fn domes_and_windows_have_an_inside_and_shallow_ones_do_not() {
        // The upper part of a sphere, cut at `rings` of 20 from the pole.
        let dome = |rings: usize| {
            let mut mesh = sphere(DVec3::ZERO, 1.0, 20);
            let lowest = (std::f64::consts::PI * rings as f64 / 20.0).cos() - 1e-9;
            let vertices = mesh.vertices.clone();
            mesh.triangles
                .retain(|t| t.iter().all(|&v| vertices[v as usize].y >= lowest));
            mesh
        };
        // At the pole of a cap of half-angle a the rim takes 2π (1 − sin(a/2)) of 4π: the winding
        // number is ½ + ½ sin(a/2), 0.69 at 45° and 0.85 at 90°.
        let shallow = dome(5).check_inside();
        let Err(NoInside::Open { holes, why, .. }) = shallow else {
            panic!("{shallow:?}");
        };
        assert_eq!((holes.0.len(), holes.edges()), (1, 40));
        assert!(why.contains("enclosed"), "{why}");
        assert_eq!(dome(10).check_inside().expect("half a sphere").0.len(), 1);

        // Two windows in opposite walls, each a quarter of its wall: 2 · ¼ of 2.
        let unit = Bounds {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        };
        let mut windows = box_mesh(unit);
        // A vertex in the middle of each z wall splits it into four triangles.
        windows.triangles.truncate(8);
        for (z, [a, b, c, d]) in [(0.0, [0, 2, 3, 1]), (1.0, [4, 5, 7, 6])] {
            let middle = windows.vertices.len() as u32;
            windows.vertices.push(DVec3::new(0.5, 0.5, z));
            windows.triangles.extend([[a, b, middle], [b, c, middle]]);
            windows.triangles.push([c, d, middle]);
        }
        let taken = windows.check_inside().expect("two windows");
        assert_eq!((taken.0.len(), taken.edges()), (2, 6));
        assert!((taken.missing(&windows) - 0.25).abs() < 1e-12);
    }
}
