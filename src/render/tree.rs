//! Bounding volume hierarchy over opaque geometry, packed for rays on the device: both boxes of a
//! node in eight words, quantised to sixteen bits per axis.

use glam::{DVec3, Vec3};

use super::uniform::{SetNode, Triangle};
use swell_domain::{bvh::Bvh, mesh::TriangleMesh};

/// Lowest bit of a child's triangle count, as in `shared/rays_set.wgsl`.
const LEAF_SHIFT: u32 = 28;
/// Lattice steps along the longest axis; the rest of 2¹⁶ is a margin for outward rounding.
const STEPS: f64 = 65528.0;
/// Steps by which a box exceeds its outward rounding: a ray's position in steps has an error of
/// 2⁻²⁴ × 2¹⁶.
const MARGIN: f64 = 1.0;

/// A packed hierarchy over triangles.
pub(super) struct Tree {
    /// Least corner of the lattice, metres.
    pub(super) low: [f32; 3],
    /// Lattice step, metres.
    pub(super) step: f32,
    /// Nodes of the hierarchy; never empty.
    pub(super) nodes: Vec<SetNode>,
    /// Triangles in the order of the leaves; a degenerate one where there are none.
    pub(super) sorted: Vec<Triangle>,
}

/// A hierarchy over triangles, whose boxes can be fitted to triangles that have moved.
#[derive(Clone, Debug)]
pub(super) struct Hierarchy {
    /// Nodes, each before those below it.
    boxes: Vec<Node>,
    /// Indices of the triangles, leaf by leaf.
    entries: Vec<u32>,
}

impl Hierarchy {
    /// Builds the hierarchy over triangles.
    pub(super) fn over(triangles: &[Triangle]) -> Self {
        let corners = triangles.iter().flat_map(|it| [it.a, it.b, it.c]);
        let mesh = TriangleMesh {
            vertices: corners.map(|p| Vec3::from(p).as_dvec3()).collect(),
            triangles: (0..triangles.len() as u32)
                .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
                .collect(),
        };
        let tree = Bvh::new(&mesh);
        Self {
            boxes: tree.boxes().collect(),
            entries: tree.entries().to_vec(),
        }
    }

    /// Fits the boxes to the corners that the triangles have in all of `poses`. The nodes keep what
    /// they contain, so triangles that have moved far make large boxes.
    pub(super) fn fit(&mut self, poses: &[&[Triangle]]) {
        for at in (0..self.boxes.len()).rev() {
            let (_, next, count) = self.boxes[at];
            self.boxes[at].0 = match count {
                0 => join(self.boxes[at + 1].0, self.boxes[next as usize].0),
                _ => {
                    let entries = &self.entries[next as usize..(next + count) as usize];
                    let of = |k: u32| poses.iter().map(move |triangles| &triangles[k as usize]);
                    let corners = entries
                        .iter()
                        .flat_map(|&k| of(k))
                        .flat_map(|it| [it.a, it.b, it.c].map(|p| Vec3::from(p).as_dvec3()));
                    corners.map(|p| [p; 2]).fold(NOTHING, join)
                }
            };
        }
    }

    /// Packs the hierarchy for the device, with `triangles` in the order of its leaves.
    pub(super) fn packed(&self, triangles: &[Triangle]) -> Tree {
        let Some((whole, ..)) = self.boxes.first() else {
            return Tree {
                low: [0.0; 3],
                step: 1.0,
                nodes: vec![SetNode::default()],
                sorted: vec![Triangle::default()],
            };
        };
        let lattice = Lattice::over(*whole);
        Tree {
            low: lattice.low.to_array(),
            step: lattice.step,
            nodes: pairs(&self.boxes, &lattice),
            sorted: self.sorted(triangles),
        }
    }

    /// Returns the triangles in the order of the leaves.
    pub(super) fn sorted(&self, triangles: &[Triangle]) -> Vec<Triangle> {
        (self.entries.iter())
            .map(|&k| triangles[k as usize])
            .collect()
    }
}

/// A box around nothing.
const NOTHING: [DVec3; 2] = [DVec3::INFINITY, DVec3::NEG_INFINITY];

/// Least box around two boxes.
fn join(a: [DVec3; 2], b: [DVec3; 2]) -> [DVec3; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Least and greatest corners of the box; first entry of a leaf, or right child of an inner node,
/// whose left child follows it; number of entries of a leaf, or 0.
type Node = ([DVec3; 2], u32, u32);

/// One packed node per inner node of the hierarchy, in its order. A hierarchy of a single leaf
/// becomes a node with that leaf on both sides.
fn pairs(boxes: &[Node], lattice: &Lattice) -> Vec<SetNode> {
    if boxes[0].2 > 0 {
        let (sides, child) = (lattice.sides(boxes[0].0), leaf(&boxes[0]));
        return vec![SetNode {
            left: sides,
            left_child: child,
            right: sides,
            right_child: child,
        }];
    }
    // Number of inner nodes before each node.
    let numbers: Vec<u32> = (boxes.iter())
        .scan(0, |inner, node| {
            let before = *inner;
            *inner += u32::from(node.2 == 0);
            Some(before)
        })
        .collect();
    let child = |at: usize| match boxes[at].2 {
        0 => numbers[at],
        _ => leaf(&boxes[at]),
    };
    let inner = (boxes.iter().enumerate()).filter(|(_, node)| node.2 == 0);
    inner
        .map(|(at, node)| {
            let (left, right) = (at + 1, node.1 as usize);
            SetNode {
                left: lattice.sides(boxes[left].0),
                left_child: child(left),
                right: lattice.sides(boxes[right].0),
                right_child: child(right),
            }
        })
        .collect()
}

fn leaf(&(_, first, count): &Node) -> u32 {
    first | count << LEAF_SHIFT
}

/// Lattice to which boxes are rounded.
struct Lattice {
    low: Vec3,
    step: f32,
}

impl Lattice {
    fn over([min, max]: [DVec3; 2]) -> Self {
        // No finer than the resolution of f32 at these coordinates.
        let reach = min.abs().max(max.abs()).max_element();
        let finest = 2.0 * f64::from(f32::EPSILON) * reach;
        let step = ((max - min).max_element() / STEPS).max(finest) as f32;
        let step = step.max(f32::MIN_POSITIVE);
        Self {
            low: (min - 3.0 * f64::from(step)).as_vec3(),
            step,
        }
    }

    /// One word per axis: the lower bound in the low half, the upper bound in the high half.
    fn sides(&self, [min, max]: [DVec3; 2]) -> [u32; 3] {
        let at = |p: DVec3| (p - self.low.as_dvec3()) / f64::from(self.step);
        let low = (at(min).floor() - MARGIN).clamp(DVec3::ZERO, DVec3::splat(65535.0));
        let high = (at(max).ceil() + MARGIN).clamp(DVec3::ZERO, DVec3::splat(65535.0));
        [0, 1, 2].map(|axis| low[axis] as u32 | (high[axis] as u32) << 16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of small triangles, up to far from the origin.
    fn row(count: usize) -> Vec<Triangle> {
        let corner = |k: usize, x: f32, y: f32| [7.0 * k as f32 + x, y, 0.3 * k as f32];
        (0..count)
            .map(|k| Triangle {
                a: corner(k, 0.0, 0.0),
                b: corner(k, 0.4, 0.1),
                c: corner(k, 0.0, 0.9),
                ..Triangle::default()
            })
            .collect()
    }

    fn decoded(tree: &Tree, sides: [u32; 3]) -> [DVec3; 2] {
        let place =
            |word: fn(u32) -> u32| {
                DVec3::from_array([0, 1, 2].map(|k| {
                    f64::from(tree.low[k]) + f64::from(word(sides[k])) * f64::from(tree.step)
                }))
            };
        [place(|word| word & 0xffff), place(|word| word >> 16)]
    }

    /// Checks that each box on the path to a triangle contains it and that no leaf's box exceeds
    /// its triangles by more than the margins.
    fn holds(tree: &Tree, at: u32, within: &[[DVec3; 2]], seen: &mut Vec<u32>) {
        let node = &tree.nodes[at as usize];
        for (sides, child) in [(node.left, node.left_child), (node.right, node.right_child)] {
            let ways = [within, &[decoded(tree, sides)]].concat();
            let count = child >> LEAF_SHIFT;
            if count == 0 {
                assert!(child > at, "{at} leads back to {child}");
                holds(tree, child, &ways, seen);
                continue;
            }
            let first = child & ((1 << LEAF_SHIFT) - 1);
            for k in first..first + count {
                seen.push(k);
                let triangle = &tree.sorted[k as usize];
                for p in [triangle.a, triangle.b, triangle.c] {
                    let p = Vec3::from(p).as_dvec3();
                    for [low, high] in &ways {
                        assert!(
                            p.cmpge(*low).all() && p.cmple(*high).all(),
                            "{p} in {low} to {high}"
                        );
                    }
                }
            }
            let corners = (first..first + count).flat_map(|k| {
                let it = &tree.sorted[k as usize];
                [it.a, it.b, it.c].map(|p| Vec3::from(p).as_dvec3())
            });
            let (min, max) = corners
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
                    (min.min(p), max.max(p))
                });
            let [low, high] = ways[ways.len() - 1];
            let most = (2.0 + MARGIN) * f64::from(tree.step);
            assert!((min - low).max_element() <= most && (high - max).max_element() <= most);
        }
    }

    fn tree(triangles: &[Triangle]) -> Tree {
        Hierarchy::over(triangles).packed(triangles)
    }

    /// The row with every third triangle moved, some of them past others.
    fn moved(count: usize) -> Vec<Triangle> {
        let mut moved = row(count);
        for it in moved.iter_mut().step_by(3) {
            for p in [&mut it.a, &mut it.b, &mut it.c] {
                *p = [p[0] + 20.0, p[1] - 3.0, p[2]];
            }
        }
        moved
    }

    #[test]
    fn every_triangle_is_in_the_boxes_on_the_way_to_it() {
        let fitted = |count| {
            let mut hierarchy = Hierarchy::over(&row(count));
            hierarchy.fit(&[&moved(count)]);
            hierarchy.packed(&moved(count))
        };
        let counts = [1, 2, 4, 5, 9, 100].into_iter();
        for (count, tree) in counts.flat_map(|n| [(n, tree(&row(n))), (n, fitted(n))]) {
            let mut seen = Vec::new();
            holds(&tree, 0, &[], &mut seen);
            seen.sort_unstable();
            seen.dedup();
            assert!(
                seen.iter().copied().eq(0..count as u32),
                "{count}: {seen:?}"
            );
        }
    }

    /// Control of the test above.
    #[test]
    #[should_panic(expected = " in ")]
    fn boxes_that_were_not_fitted_are_seen() {
        let tree = Hierarchy::over(&row(9)).packed(&moved(9));
        holds(&tree, 0, &[], &mut Vec::new());
    }

    #[test]
    fn a_set_without_triangles_has_a_node_and_a_triangle_for_the_bindings() {
        let tree = tree(&[]);
        assert_eq!((tree.nodes.len(), tree.sorted.len()), (1, 1));
    }

    #[test]
    fn a_point_far_from_the_origin_has_a_box() {
        let at = Triangle {
            a: [1e4; 3],
            b: [1e4; 3],
            c: [1e4; 3],
            ..Triangle::default()
        };
        let tree = tree(&[at]);
        holds(&tree, 0, &[], &mut Vec::new());
    }
}
