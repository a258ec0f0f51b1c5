//! Bounding volume hierarchy over a mesh: exact nearest triangle, ray casts and generalised
//! winding number.

use glam::DVec3;

use super::mesh::TriangleMesh;

/// Triangles in a leaf.
const LEAF_SIZE: usize = 4;

/// A cluster farther away than this many of its radii counts as a single dipole. Barill et al. 2018
/// use 2; here only the side of 0.5 on which the number lies matters.
const FAR_RADII: f64 = 3.0;

/// Bounding volume hierarchy of a mesh: built once per mesh, then read by many threads.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// Triangle corners in leaf order.
    corners: Vec<[DVec3; 3]>,
    /// Triangle index in the mesh of each entry of `corners`.
    index: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// Area-weighted centre of the cluster, and the distance from it to its furthest corner.
    centre: DVec3,
    radius: f64,
    /// Σ area × normal.
    area_vector: DVec3,
    /// First entry of a leaf, or the right child of an inner node, whose left child follows
    /// it directly.
    first_or_right: u32,
    /// Number of entries of a leaf; 0 marks an inner node.
    count: u32,
}

impl Bvh {
    /// Builds the tree of a mesh; an empty mesh gives an empty tree.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let mut index: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let corners: Vec<_> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let mut nodes = Vec::with_capacity(2 * index.len().div_ceil(LEAF_SIZE));
        if !index.is_empty() {
            build(&corners, &mut index, 0, &mut nodes);
        }
        Self {
            nodes,
            corners: index.iter().map(|&t| corners[t as usize]).collect(),
            index,
        }
    }

    /// Iterates over the nodes for other traversals: least and greatest corner of the box; first
    /// entry of a leaf or right child of an inner node (the left child follows the node directly);
    /// number of entries of a leaf, or 0.
    pub fn boxes(&self) -> impl Iterator<Item = ([DVec3; 2], u32, u32)> {
        let nodes = self.nodes.iter();
        nodes.map(|node| ([node.min, node.max], node.first_or_right, node.count))
    }

    /// Returns the triangle index in the mesh of each leaf entry.
    pub fn entries(&self) -> &[u32] {
        &self.index
    }

    /// Returns the distance in metres to the nearest triangle and its index in the mesh; `None` if
    /// none is nearer than `bound`.
    pub fn nearest(&self, p: DVec3, bound: f64) -> Option<(f64, u32)> {
        if self.nodes.is_empty() {
            return None;
        }
        let mut best_squared = bound * bound;
        let mut best = None;
        let mut stack = Stack::new();
        stack.push(0, self.nodes[0].distance_squared(p));
        while let Some((at, distance_squared)) = stack.pop() {
            if distance_squared >= best_squared {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for entry in node.entries() {
                    let [a, b, c] = self.corners[entry];
                    let squared = (nearest_point(p, a, b, c) - p).length_squared();
                    if squared < best_squared {
                        best_squared = squared;
                        best = Some(self.index[entry]);
                    }
                }
                continue;
            }
            let (left, right) = (at + 1, node.first_or_right);
            let left_squared = self.nodes[left as usize].distance_squared(p);
            let right_squared = self.nodes[right as usize].distance_squared(p);
            // The nearer child is pushed last, so that it is visited first.
            if left_squared < right_squared {
                stack.push(right, right_squared);
                stack.push(left, left_squared);
            } else {
                stack.push(left, left_squared);
                stack.push(right, right_squared);
            }
        }
        best.map(|index| (best_squared.sqrt(), index))
    }

    /// Returns the first triangle along a ray, on either side, that is nearer than `bound`: the
    /// distance in lengths of `direction` and its index in the mesh (Möller and Trumbore 1997).
    pub fn first_along(&self, origin: DVec3, direction: DVec3, bound: f64) -> Option<(f64, u32)> {
        let mut nearest = bound;
        let mut found = None;
        let mut stack = Stack::new();
        if !self.nodes.is_empty() {
            stack.push(0, 0.0);
        }
        while let Some((at, _)) = stack.pop() {
            let node = &self.nodes[at as usize];
            if !node.is_met(origin, direction, nearest) {
                continue;
            }
            if node.count == 0 {
                stack.push(node.first_or_right, 0.0);
                stack.push(at + 1, 0.0);
                continue;
            }
            for entry in node.entries() {
                let t = along(self.corners[entry], origin, direction);
                if let Some(t) = t.filter(|&t| t < nearest) {
                    nearest = t;
                    found = Some(self.index[entry]);
                }
            }
        }
        found.map(|index| (nearest, index))
    }

    /// Returns the generalised winding number (Jacobson et al. 2013): 1 inside and 0 outside of a
    /// closed mesh, in between near holes, negative for a mesh turned inside out.
    pub fn winding_number(&self, p: DVec3) -> f64 {
        let mut solid_angle = 0.0;
        let mut stack = Stack::new();
        if !self.nodes.is_empty() {
            stack.push(0, 0.0);
        }
        while let Some((at, _)) = stack.pop() {
            let node = &self.nodes[at as usize];
            let to_centre = node.centre - p;
            let squared = to_centre.length_squared();
            if squared > (FAR_RADII * node.radius).powi(2) {
                solid_angle += to_centre.dot(node.area_vector) / (squared * squared.sqrt());
            } else if node.count > 0 {
                for entry in node.entries() {
                    solid_angle += triangle_solid_angle(p, self.corners[entry]);
                }
            } else {
                stack.push(at + 1, 0.0);
                stack.push(node.first_or_right, 0.0);
            }
        }
        solid_angle / (4.0 * std::f64::consts::PI)
    }
}

/// Distance along a ray to a triangle, in lengths of `direction`.
fn along([a, b, c]: [DVec3; 3], origin: DVec3, direction: DVec3) -> Option<f64> {
    let (ab, ac, from_a) = (b - a, c - a, origin - a);
    let p = direction.cross(ac);
    let volume = ab.dot(p);
    let u = from_a.dot(p) / volume;
    let q = from_a.cross(ab);
    let v = direction.dot(q) / volume;
    let t = ac.dot(q) / volume;
    // A ray in the triangle's plane divides by zero, and no comparison with the NaN holds.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

impl Node {
    /// Returns whether a ray enters the node's box before `nearest`.
    fn is_met(&self, origin: DVec3, direction: DVec3, nearest: f64) -> bool {
        let (mut enter, mut leave) = (0.0f64, nearest);
        for axis in 0..3 {
            let a = (self.min[axis] - origin[axis]) / direction[axis];
            let b = (self.max[axis] - origin[axis]) / direction[axis];
            // A ray in the plane of a side gives 0 / 0; min and max ignore NaN.
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
    }

    fn entries(&self) -> std::ops::Range<usize> {
        let first = self.first_or_right as usize;
        first..first + self.count as usize
    }

    fn distance_squared(&self, p: DVec3) -> f64 {
        (p - p.clamp(self.min, self.max)).length_squared()
    }
}

/// A stack of fixed size: median splits keep the depth below 32, and each level leaves one
/// entry behind.
struct Stack {
    entries: [(u32, f64); 64],
    len: usize,
}

impl Stack {
    fn new() -> Self {
        Self {
            entries: [(0, 0.0); 64],
            len: 0,
        }
    }

    fn push(&mut self, node: u32, distance_squared: f64) {
        self.entries[self.len] = (node, distance_squared);
        self.len += 1;
    }

    fn pop(&mut self) -> Option<(u32, f64)> {
        self.len = self.len.checked_sub(1)?;
        Some(self.entries[self.len])
    }
}

/// Appends the subtree over `order` (entries from `first` on) and leaves `order` in leaf order.
fn build(corners: &[[DVec3; 3]], order: &mut [u32], first: usize, nodes: &mut Vec<Node>) {
    let at = nodes.len();
    nodes.push(cluster(corners, order));
    if order.len() <= LEAF_SIZE {
        nodes[at].first_or_right = first as u32;
        nodes[at].count = order.len() as u32;
        return;
    }
    let size = nodes[at].max - nodes[at].min;
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let key = |t: u32| corners[t as usize].iter().map(|v| v[axis]).sum::<f64>();
    let middle = order.len() / 2;
    // Ties are broken by index, so that the tree depends only on the mesh.
    order.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    let (left, right) = order.split_at_mut(middle);
    build(corners, left, first, nodes);
    nodes[at].first_or_right = nodes.len() as u32;
    build(corners, right, first + middle, nodes);
}

fn cluster(corners: &[[DVec3; 3]], order: &[u32]) -> Node {
    let mut min = DVec3::INFINITY;
    let mut max = DVec3::NEG_INFINITY;
    let (mut area, mut moment, mut area_vector) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for &t in order {
        let [a, b, c] = corners[t as usize];
        min = min.min(a).min(b).min(c);
        max = max.max(a).max(b).max(c);
        let vector = 0.5 * (b - a).cross(c - a);
        area += vector.length();
        moment += vector.length() * (a + b + c) / 3.0;
        area_vector += vector;
    }
    let centre = if area > 0.0 {
        moment / area
    } else {
        0.5 * (min + max)
    };
    let radius = order
        .iter()
        .flat_map(|&t| corners[t as usize])
        .map(|v| (v - centre).length())
        .fold(0.0, f64::max);
    Node {
        min,
        max,
        centre,
        radius,
        area_vector,
        first_or_right: 0,
        count: 0,
    }
}

/// Returns the point of triangle `abc` that is nearest to `p` (Ericson 2005, §5.1.5).
pub fn nearest_point(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
}

/// Signed solid angle of a triangle seen from `p` (Van Oosterom and Strackee 1983), positive where
/// the back faces `p`.
fn triangle_solid_angle(p: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|v| v - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let numerator = a.dot(b.cross(c));
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * numerator.atan2(denominator)
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::{cube, sphere};
    use super::*;

    fn probes() -> impl Iterator<Item = DVec3> {
        (0..1000u32).map(|i| {
            let r2 = |k: f64| (0.5 + k * f64::from(i)).fract();
            DVec3::new(r2(0.8191725), r2(0.6710436), r2(0.5497004)) * 4.0 - DVec3::splat(2.0)
        })
    }

    #[test]
    fn the_tree_agrees_with_a_scan_over_all_triangles() {
        let mesh = sphere(DVec3::new(0.2, -0.1, 0.3), 1.0, 20);
        let bvh = Bvh::new(&mesh);
        for p in probes() {
            let scanned = (0..mesh.triangles.len())
                .map(|t| {
                    let [a, b, c] = mesh.corners(t);
                    (nearest_point(p, a, b, c) - p).length()
                })
                .fold(f64::INFINITY, f64::min);
            let (distance, _) = bvh
                .nearest(p, f64::INFINITY)
                .expect("the mesh is not empty");
            assert_eq!(distance, scanned);
            assert!(bvh.nearest(p, 0.999 * scanned).is_none());

            let exact: f64 = (0..mesh.triangles.len())
                .map(|t| triangle_solid_angle(p, mesh.corners(t)))
                .sum::<f64>()
                / (4.0 * std::f64::consts::PI);
            // Clusters are approximated beyond 3 radii: the neglected second-order term is below
            // (1/3)² of a cluster's contribution, and clusters of both signs cancel.
            assert!((bvh.winding_number(p) - exact).abs() < 0.03, "{p} {exact}");
        }
    }

    /// Slanted triangles whose boxes contain the origin are visited first and come within 1.005 of
    /// it. The squares' boxes are as near as the squares, 1: a bound that is 2 % too large (1 % in
    /// the distance) would skip them.
    #[test]
    fn a_box_as_near_as_its_triangle_is_looked_into() {
        let mut mesh = TriangleMesh {
            vertices: Vec::new(),
            triangles: Vec::new(),
        };
        let mut add = |corners: [DVec3; 3]| {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(corners);
            mesh.triangles.push([first, first + 1, first + 2]);
        };
        for k in 0..16 {
            let further = 1.0 + 0.01 * f64::from(k);
            let arm = 1.005 * 3f64.sqrt() * further;
            add([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| -arm * axis));
            let at = |y, z| DVec3::new(further, y, z);
            add([at(-1.0, -1.0), at(1.0, -1.0), at(0.0, 2.0)]);
        }
        let (distance, _) = (Bvh::new(&mesh).nearest(DVec3::ZERO, f64::INFINITY)).expect("32");
        assert_eq!(distance, 1.0);
    }

    #[test]
    fn the_winding_number_is_one_inside_and_turns_with_the_mesh() {
        let mesh = cube();
        let bvh = Bvh::new(&mesh);
        let inside = DVec3::new(0.3, 0.6, 0.9);
        assert!((bvh.winding_number(inside) - 1.0).abs() < 1e-12);
        assert!(bvh.winding_number(DVec3::new(1.5, 0.5, 0.5)).abs() < 0.05);
        let mut turned = mesh;
        turned.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!((Bvh::new(&turned).winding_number(inside) + 1.0).abs() < 1e-12);
    }

    #[test]
    fn every_region_of_a_triangle_is_hit() {
        let [a, b, c] = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let cases = [
            (DVec3::new(-1.0, -1.0, 1.0), a),
            (DVec3::new(2.0, -0.5, 0.0), b),
            (DVec3::new(-0.5, 2.0, 0.0), c),
            (DVec3::new(0.5, -1.0, 0.0), DVec3::new(0.5, 0.0, 0.0)),
            (DVec3::new(-1.0, 0.5, 0.0), DVec3::new(0.0, 0.5, 0.0)),
            (DVec3::new(1.0, 1.0, 2.0), DVec3::new(0.5, 0.5, 0.0)),
            (DVec3::new(0.25, 0.25, 3.0), DVec3::new(0.25, 0.25, 0.0)),
        ];
        for (p, expected) in cases {
            assert!(
                (nearest_point(p, a, b, c) - expected).length() < 1e-15,
                "{p}"
            );
        }
    }
}
