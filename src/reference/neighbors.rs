//! Cells, the order of particles in them, and who is within reach of whom.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::domain::{period::Period, places};

/// Particles whose neighbours one task lists.
const BLOCK: usize = 512;

/// Cells over a box at the origin; x is fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    /// Along x, y, z.
    pub dims: [usize; 3],
    /// Metres.
    pub edge: DVec3,
    /// Of the box, where it joins its own end.
    pub period: Period,
}

impl Cells {
    /// Cells that cover a box of `size` metres.
    pub fn new(size: DVec3, edge: f64) -> Self {
        Self::periodic(size, edge, Period::default())
    }

    /// The same where the box joins its own end.
    pub fn periodic(size: DVec3, edge: f64, period: Period) -> Self {
        let dims = period.cells(size, edge);
        Self {
            dims: dims.map(|n| n as usize),
            edge: period.edges(dims, edge),
            period,
        }
    }

    /// The cell of a point; outside the box the nearest, or that of its image.
    pub fn coordinate(&self, x: DVec3) -> [usize; 3] {
        let cell = (x / self.edge).floor().to_array();
        std::array::from_fn(|axis| match self.joins(axis) {
            true => cell[axis].rem_euclid(self.dims[axis] as f64) as usize,
            // A cast saturates: what is below 0 becomes 0.
            false => (cell[axis] as usize).min(self.dims[axis] - 1),
        })
    }

    /// Whether the last cell along an axis lies beside the first.
    fn joins(&self, axis: usize) -> bool {
        self.period.0[axis] > 0.0
    }

    /// The cells about that of a point, it among them, as runs of their places.
    pub fn runs(&self, x: DVec3) -> impl Iterator<Item = Range<usize>> + use<> {
        let ([cx, cy, cz], [nx, ny, nz]) = (self.coordinate(x), self.dims);
        let beside = |axis: usize, at: usize, count: usize| match self.joins(axis) {
            true => [at + count - 1, at, at + 1].map(|k| k % count..k % count + 1),
            // One run, and two that are empty.
            false => [at.saturating_sub(1)..(at + 2).min(count), 0..0, 0..0],
        };
        let [along, rows, layers] = [(0, cx, nx), (1, cy, ny), (2, cz, nz)]
            .map(|(axis, at, count)| beside(axis, at, count));
        layers.into_iter().flatten().flat_map(move |z| {
            let (rows, along) = (rows.clone(), along.clone());
            rows.into_iter().flatten().flat_map(move |y| {
                let row = (z * ny + y) * nx;
                let found = along.clone().into_iter().filter(|run| !run.is_empty());
                found.map(move |run| row + run.start..row + run.end)
            })
        })
    }

    /// Its place in x-fastest order.
    pub fn index(&self, x: DVec3) -> usize {
        let [i, j, k] = self.coordinate(x);
        (k * self.dims[1] + j) * self.dims[0] + i
    }

    fn count(&self) -> usize {
        self.dims.iter().product()
    }

    /// First point of each cell, and one past the last, for points that are sorted by cell.
    pub fn starts(&self, sorted: &[DVec3]) -> Vec<usize> {
        let mut start = vec![0; self.count() + 1];
        for &x in sorted {
            start[self.index(x) + 1] += 1;
        }
        for k in 1..start.len() {
            start[k] += start[k - 1];
        }
        start
    }

    /// The order that sorts points by cell, and within a cell by `id`.
    pub fn order(&self, points: &[DVec3], id: &[u32]) -> Vec<usize> {
        let mut keyed: Vec<(usize, u32, usize)> = points
            .par_iter()
            .zip(id)
            .enumerate()
            .map(|(k, (&x, &id))| (self.index(x), id, k))
            .collect();
        keyed.par_sort_unstable();
        keyed.into_iter().map(|(_, _, k)| k).collect()
    }
}

/// Points in cells: particles first, then samples on solids, each sorted by cell.
#[derive(Clone, Debug)]
pub struct Crowd<'a> {
    /// Cells of edge h or more.
    pub cells: Cells,
    /// Positions, metres.
    pub points: &'a [DVec3],
    /// How many of them are particles.
    pub particles: usize,
}

/// Neighbours of every particle: particles in ascending order, then samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Neighbors {
    blocks: Vec<Block>,
}

/// Lists one after another, with the end of each one's particles and of its samples.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Block {
    ends: Vec<[u32; 2]>,
    members: Vec<u32>,
}

impl Neighbors {
    /// Who is nearer than `radius` to each particle, by nine runs of three cells (Hoetzlein 2014).
    pub fn search(crowd: &Crowd<'_>, radius: f64) -> Self {
        let (fluid, solid) = crowd.points.split_at(crowd.particles);
        let groups = [
            (0, fluid, crowd.cells.starts(fluid)),
            (crowd.particles, solid, crowd.cells.starts(solid)),
        ];
        let period = crowd.cells.period;
        Self::listed(crowd.particles, |i, members| {
            let x = crowd.points[i];
            groups.each_ref().map(|(first, points, starts)| {
                let begin = members.len();
                for cells in crowd.cells.runs(x) {
                    let run = starts[cells.start]..starts[cells.end];
                    let first = first + run.start;
                    if period == Period::default() {
                        let is_near = |y: &DVec3| x.distance_squared(*y) < radius * radius;
                        append_near(&points[run], first, i, members, is_near);
                    } else {
                        let near = |x: DVec3| period.shortest(x).length_squared() < radius * radius;
                        let found = run
                            .zip(first..)
                            .filter(|(k, j)| *j != i && near(x - points[*k]));
                        members.extend(found.map(|(_, j)| j as u32));
                    }
                }
                // Runs across a joint come before those that they follow.
                if period != Period::default() {
                    members[begin..].sort_unstable();
                }
                members.len() as u32
            })
        })
    }

    /// Whom PBF's lists have (pbf/build_neighbors): particles by words for places, where these tell them, of which some are a little farther
    /// than `h` and count once they come within it; samples on solids nearer than `h`.
    pub fn listed_within(crowd: &Crowd<'_>, h: f64) -> Self {
        let cells = &crowd.cells;
        if !places::are_told(cells.dims.into_iter(), cells.period != Period::default()) {
            return Self::search(crowd, h);
        }
        let (fluid, solid) = crowd.points.split_at(crowd.particles);
        let (of_fluid, of_solid) = (cells.starts(fluid), cells.starts(solid));
        let inverse = (1.0 / h) as f32;
        let words: Vec<u32> = fluid
            .par_iter()
            .map(|x| places::word(x.as_vec3().to_array(), inverse))
            .collect();
        Self::listed(crowd.particles, |i, members| {
            let (x, own) = (crowd.points[i], words[i]);
            for cells in cells.runs(x) {
                let run = of_fluid[cells.start]..of_fluid[cells.end];
                let first = run.start;
                let is_near = |&word: &u32| places::are_near(own, word);
                append_near(&words[run], first, i, members, is_near);
            }
            let middle = members.len() as u32;
            for cells in cells.runs(x) {
                let run = of_solid[cells.start]..of_solid[cells.end];
                let first = crowd.particles + run.start;
                let is_near = |y: &DVec3| x.distance_squared(*y) < h * h;
                append_near(&solid[run], first, i, members, is_near);
            }
            [middle, members.len() as u32]
        })
    }

    /// The same by asking every pair: slow, and with nothing in it to go wrong.
    pub fn naive(crowd: &Crowd<'_>, radius: f64) -> Self {
        let x = crowd.points;
        Self::listed(crowd.particles, |i, members| {
            [0..crowd.particles, crowd.particles..x.len()].map(|group| {
                let r2 = |j: usize| crowd.cells.period.shortest(x[i] - x[j]).length_squared();
                let near = |&j: &usize| j != i && r2(j) < radius * radius;
                members.extend(group.filter(near).map(|j| j as u32));
                members.len() as u32
            })
        })
    }

    /// `list` appends the neighbours of a particle and gives the lengths after its particles and its samples.
    pub fn listed(
        particles: usize,
        list: impl Fn(usize, &mut Vec<u32>) -> [u32; 2] + Sync,
    ) -> Self {
        let blocks = (0..particles.div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                let mut members = Vec::with_capacity(40 * BLOCK);
                let range = block * BLOCK..((block + 1) * BLOCK).min(particles);
                let ends = range.map(|i| list(i, &mut members)).collect();
                Block { ends, members }
            })
            .collect();
        Self { blocks }
    }

    /// Particles near particle `i`, itself apart.
    #[inline]
    pub fn fluid(&self, i: usize) -> &[u32] {
        self.of(i).0
    }

    /// Particles near particle `i`, itself apart, and samples; samples count on from the particles.
    #[inline]
    pub fn of(&self, i: usize) -> (&[u32], &[u32]) {
        let block = &self.blocks[i / BLOCK];
        let local = i % BLOCK;
        let first = if local == 0 {
            0
        } else {
            block.ends[local - 1][1] as usize
        };
        let [middle, end] = block.ends[local].map(|end| end as usize);
        (&block.members[first..middle], &block.members[middle..end])
    }

    /// Both, one after the other.
    pub fn all(&self, i: usize) -> impl Iterator<Item = u32> + '_ {
        let (fluid, solid) = self.of(i);
        fluid.iter().chain(solid).copied()
    }

    /// Pairs in all, each of two particles counted from either side.
    pub fn pairs(&self) -> usize {
        self.blocks.iter().map(|block| block.members.len()).sum()
    }
}

/// Appends which of a run of points, the first of them `first`, are near point `own`.
///
/// Without a branch on that: six of seven candidates are too far, at no time that can be foretold.
#[inline]
fn append_near<T>(
    run: &[T],
    first: usize,
    own: usize,
    members: &mut Vec<u32>,
    is_near: impl Fn(&T) -> bool,
) {
    let begin = members.len();
    members.resize(begin + run.len(), 0);
    let mut end = begin;
    for (j, other) in (first..).zip(run) {
        members[end] = j as u32;
        end += usize::from(is_near(other) & (j != own));
    }
    members.truncate(end);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Halton points: no two on one spot, no lattice.
    fn halton(count: usize, size: DVec3) -> Vec<DVec3> {
        let radical = |mut k: usize, base: usize| {
            let (mut value, mut weight) = (0.0, 1.0);
            while k > 0 {
                weight /= base as f64;
                value += weight * (k % base) as f64;
                k /= base;
            }
            value
        };
        (1..=count)
            .map(|k| size * DVec3::new(radical(k, 2), radical(k, 3), radical(k, 5)))
            .collect()
    }

    /// In a slab of three cells, and along x and z as well.
    #[test]
    fn search_goes_on_across_a_joint() {
        let size = DVec3::new(2.3, 0.9, 0.63);
        for axes in [DVec3::Z, DVec3::new(1.0, 0.0, 1.0), DVec3::ONE] {
            let period = Period(size * axes);
            let cells = Cells::periodic(size, 0.2, period);
            let points = halton(900, size);
            let id: Vec<u32> = (0..points.len() as u32).collect();
            let order = cells.order(&points, &id).into_iter();
            let points: Vec<DVec3> = order.map(|k| points[k]).collect();
            let crowd = Crowd {
                cells,
                points: &points,
                particles: points.len(),
            };
            let (fast, slow) = (
                Neighbors::search(&crowd, 0.2),
                Neighbors::naive(&crowd, 0.2),
            );
            for i in 0..points.len() {
                assert_eq!(fast.of(i), slow.of(i), "particle {i}");
            }
            // With walls there, some are not found.
            let walled = Crowd {
                cells: Cells {
                    period: Period::default(),
                    ..cells
                },
                ..crowd
            };
            assert!(Neighbors::search(&walled, 0.2).pairs() < slow.pairs());
        }
    }

    /// An even cloud, one that is packed into a corner, and one that reaches out of the box.
    #[test]
    fn search_finds_whom_the_naive_one_finds() {
        let size = DVec3::new(2.3, 0.9, 1.4);
        for (scale, shift) in [(1.0, 0.0), (0.3, 0.0), (1.4, -0.25)] {
            let cloud = |count: usize, flat: DVec3| -> Vec<DVec3> {
                let points = halton(count, size * flat * scale);
                points.into_iter().map(|x| x + shift).collect()
            };
            check(
                size,
                cloud(1500, DVec3::ONE),
                cloud(200, DVec3::new(1.0, 0.1, 1.0)),
            );
        }
    }

    fn check(size: DVec3, fluid: Vec<DVec3>, solid: Vec<DVec3>) {
        let cells = Cells::new(size, 0.21);
        let sorted = |points: Vec<DVec3>| {
            let id: Vec<u32> = (0..points.len() as u32).collect();
            let order = cells.order(&points, &id).into_iter();
            order.map(|k| points[k]).collect::<Vec<_>>()
        };
        let particles = fluid.len();
        let mut points = sorted(fluid);
        points.extend(sorted(solid));
        let crowd = Crowd {
            cells,
            points: &points,
            particles,
        };
        let (fast, slow) = (
            Neighbors::search(&crowd, 0.2),
            Neighbors::naive(&crowd, 0.2),
        );
        assert!(slow.pairs() > 4 * particles);
        assert!((0..particles).any(|i| !slow.of(i).1.is_empty()));
        let sorted = |list: &[u32]| {
            let mut list = list.to_vec();
            list.sort_unstable();
            list
        };
        for i in 0..particles {
            let (fluid, solid) = fast.of(i);
            let (expected_fluid, expected_solid) = slow.of(i);
            assert_eq!(sorted(fluid), expected_fluid, "particle {i}");
            assert_eq!(sorted(solid), expected_solid, "particle {i}");
        }
        // Cells smaller than the radius lose pairs: the comparison can fail.
        let narrow = Crowd {
            cells: Cells::new(size, 0.1),
            ..crowd
        };
        assert!(Neighbors::search(&narrow, 0.2).pairs() < slow.pairs());
    }
}
