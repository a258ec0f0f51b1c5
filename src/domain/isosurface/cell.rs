//! Intersection of a surface with one grid cell: loops over the cell's edges, traced face by face.
//!
//! A face whose corners alternate between water and air is resolved by the saddle of its
//! bilinear values (Nielson and Hamann, The asymptotic decider, 1991). Both cells at a face see
//! the same four values, so their loops always match there, and a surface made of such loops has
//! no open edge.

/// Corners of each face, counter-clockwise seen from outside of the cell; corner c lies at (c & 1,
/// c >> 1 & 1, c >> 2).
const FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

/// Edges of a cell: first corner and axis.
pub(super) const EDGES: [(usize, usize); 12] = [
    (0, 0),
    (2, 0),
    (4, 0),
    (6, 0),
    (0, 1),
    (1, 1),
    (4, 1),
    (5, 1),
    (0, 2),
    (1, 2),
    (2, 2),
    (3, 2),
];

/// Marks the absence of an edge.
const NONE: u8 = u8::MAX;

/// Loops of a cell: at most four, over at most twelve edges in all.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loops {
    edges: [u8; 12],
    /// End of each loop in `edges`.
    ends: [u8; 4],
    count: usize,
}

impl Loops {
    /// Traces the loops of a cell from its corner values, which are positive in water. Each loop
    /// runs counter-clockwise seen from the air.
    pub(super) fn of(values: &[f32; 8]) -> Self {
        let next = segments(values);
        let mut loops = Self {
            edges: [NONE; 12],
            ends: [0; 4],
            count: 0,
        };
        let (mut seen, mut filled) = ([false; 12], 0);
        for first in 0..12 {
            if next[first] == NONE || seen[first] {
                continue;
            }
            let mut edge = first;
            while !seen[edge] {
                seen[edge] = true;
                loops.edges[filled] = edge as u8;
                filled += 1;
                edge = usize::from(next[edge]);
            }
            loops.ends[loops.count] = filled as u8;
            loops.count += 1;
        }
        loops
    }

    /// Iterates over the loops, each as a slice of edges.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[u8]> {
        (0..self.count).map(|k| {
            let start = k.checked_sub(1).map_or(0, |before| self.ends[before]);
            &self.edges[usize::from(start)..usize::from(self.ends[k])]
        })
    }
}

/// For each edge with a crossing, the next edge of its loop. The water is on the right if the face
/// between them is seen from outside.
fn segments(values: &[f32; 8]) -> [u8; 12] {
    let is_water = |corner: usize| values[corner] > 0.0;
    let mut next = [NONE; 12];
    for face in FACES {
        let from = |k: usize| face[k % 4];
        // Edges along which the walk round the face enters or leaves the water.
        let enters = |k: usize| !is_water(from(k)) && is_water(from(k + 1));
        let leaves = |k: usize| is_water(from(k)) && !is_water(from(k + 1));
        let edge = |k: usize| edge_between(from(k), from(k + 1));
        let is_torn = (0..4).filter(|&k| enters(k)).count() == 2;
        let water = usize::from(!is_water(face[0]));
        let joins = is_torn && {
            let value = |k: usize| values[from(k)];
            value(water) * value(water + 2) > value(water + 1) * value(water + 3)
        };
        for k in (0..4).filter(|&k| enters(k)) {
            // Goes around the water that begins here or, where the water is connected across the
            // face, around the air that ends here.
            let other = match joins {
                true => (1..4).map(|step| k + 4 - step).find(|&k| leaves(k)),
                false => (1..4).map(|step| k + step).find(|&k| leaves(k)),
            };
            if let Some(other) = other {
                next[usize::from(edge(k))] = edge(other);
            }
        }
    }
    next
}

/// Edge between two corners that differ along one axis.
fn edge_between(a: usize, b: usize) -> u8 {
    let axis = (a ^ b).trailing_zeros() as usize;
    let least = a.min(b);
    let among = EDGES.iter().position(|&edge| edge == (least, axis));
    among.map_or(NONE, |edge| edge as u8)
}

/// Returns whether two edges lie on one face of the cell, where a line between them may also belong
/// to the neighbouring cell.
fn share_face(a: u8, b: u8) -> bool {
    let [a, b] = [a, b].map(|edge| EDGES[usize::from(edge)]);
    (0..3).any(|normal| {
        let side =
            |(corner, axis): (usize, usize)| (axis != normal).then_some(corner >> normal & 1);
        side(a).is_some() && side(a) == side(b)
    })
}

/// Position in a loop from which a triangle fan has no diagonal within a face; `None` if there is
/// no such position.
pub(super) fn fan(edges: &[u8]) -> Option<usize> {
    let n = edges.len();
    let is_free = |apex: &usize| {
        let diagonals = (2..n - 1).map(|step| edges[(apex + step) % n]);
        diagonals
            .into_iter()
            .all(|other| !share_face(edges[*apex], other))
    };
    (0..n).find(is_free)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values for all patterns of water and air, with magnitudes that resolve each saddle
    /// either way.
    fn patterns() -> impl Iterator<Item = [f32; 8]> {
        (0..256usize).flat_map(|pattern| {
            (0..16u32).map(move |round| {
                std::array::from_fn(|corner| {
                    let size = 0.1 + (corner as u32 * 7 + round * 5) as f32 % 11.0;
                    if pattern >> corner & 1 == 1 {
                        size
                    } else {
                        -size
                    }
                })
            })
        })
    }

    #[test]
    fn each_crossed_edge_is_in_one_loop() {
        for values in patterns() {
            let loops = Loops::of(&values);
            let mut uses = [0; 12];
            for edges in loops.iter() {
                assert!(edges.len() >= 3, "{values:?}");
                edges.iter().for_each(|&edge| uses[usize::from(edge)] += 1);
            }
            for (edge, &(corner, axis)) in EDGES.iter().enumerate() {
                let is_crossed = (values[corner] > 0.0) != (values[corner | 1 << axis] > 0.0);
                assert_eq!(uses[edge], i32::from(is_crossed), "{values:?}");
            }
        }
    }

    #[test]
    fn neighbours_agree_about_the_face_between_them() {
        // Segments on a cell's face x = 1, compared with those of the cell mirrored there, which
        // shares the face.
        let on = |values: &[f32; 8]| {
            let next = segments(values);
            let is_there = |edge: usize| {
                let (corner, axis) = EDGES[edge];
                axis != 0 && corner & 1 == 1
            };
            let pairs = (0..12).filter(|&e| is_there(e) && next[e] != NONE);
            let mut pairs: Vec<_> = pairs
                .filter(|&e| is_there(usize::from(next[e])))
                .map(|e| (e, usize::from(next[e])))
                .collect();
            pairs.sort_unstable();
            pairs
        };
        for values in patterns() {
            let mirrored: [f32; 8] = std::array::from_fn(|corner| values[corner | 1]);
            let own: [f32; 8] = std::array::from_fn(|corner| values[corner]);
            // The neighbour's face x = 0 has these values; its loops run the opposite way.
            let next = segments(&mirrored);
            let beyond = |edge: usize| {
                let (corner, axis) = EDGES[edge];
                usize::from(edge_between(corner & !1, corner & !1 | 1 << axis))
            };
            for (from, to) in on(&own) {
                assert_eq!(usize::from(next[beyond(to)]), beyond(from), "{values:?}");
            }
        }
    }

    #[test]
    fn the_saddle_decides_a_torn_face() {
        // Water at two opposite corners of the face z = 0, once a lot and once a little.
        let of = |water: f32| {
            let values = [water, -1.0, -1.0, water, -1.0, -1.0, -1.0, -1.0];
            Loops::of(&values)
                .iter()
                .map(<[u8]>::len)
                .collect::<Vec<_>>()
        };
        assert_eq!(of(0.5), [3, 3]);
        assert_eq!(of(2.0), [6]);
    }
}
