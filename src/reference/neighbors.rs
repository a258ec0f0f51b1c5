//! Cells, the order of particles in them, and neighbour search.

use std::ops::Range;

use glam::DVec3;
use pulp::{Simd, WithSimd};

use swell_domain::{lanes::widely, parallel, period::Period, places};

/// Particles whose neighbours one task lists.
const BLOCK: usize = 512;

/// Cells over a box at the origin; x is fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    /// Number of cells along x, y, z.
    pub dims: [usize; 3],
    /// Edge lengths of a cell, metres.
    pub edge: DVec3,
    /// Period of the box.
    pub period: Period,
}

impl Cells {
    /// Creates cells that cover a box of `size` metres.
    pub fn new(size: DVec3, edge: f64) -> Self {
        Self::periodic(size, edge, Period::default())
    }

    /// Creates cells that cover a periodic box.
    pub fn periodic(size: DVec3, edge: f64, period: Period) -> Self {
        let dims = period.cells(size, edge);
        Self {
            dims: dims.map(|n| n as usize),
            edge: period.edges(dims, edge),
            period,
        }
    }

    /// Returns the cell of a point; outside the box the nearest cell, or along a periodic axis that
    /// of the point's image.
    pub fn coordinate(&self, x: DVec3) -> [usize; 3] {
        let cell = (x / self.edge).to_array();
        std::array::from_fn(|axis| match self.joins(axis) {
            true => cell[axis].floor().rem_euclid(self.dims[axis] as f64) as usize,
            // A float-to-integer cast truncates and saturates: negative values become 0.
            false => (cell[axis] as usize).min(self.dims[axis] - 1),
        })
    }

    /// Returns whether an axis is periodic.
    fn joins(&self, axis: usize) -> bool {
        self.period.0[axis] > 0.0
    }

    /// Returns the 27 cells around a point, including its own, as runs of cell indices.
    #[inline]
    pub fn runs(&self, x: DVec3) -> Runs {
        let ([cx, cy, cz], [nx, ny, nz]) = (self.coordinate(x), self.dims);
        let beside = |axis: usize, at: usize, count: usize| match self.joins(axis) {
            true => [at + count - 1, at, at + 1].map(|k| [k % count, k % count + 1]),
            // One run, and two empty ones.
            false => [[at.saturating_sub(1), (at + 2).min(count)], [0; 2], [0; 2]],
        };
        let [along, rows, layers] = [(0, cx, nx), (1, cy, ny), (2, cz, nz)]
            .map(|(axis, at, count)| beside(axis, at, count));
        let mut runs = Runs {
            ends: [[0; 2]; 27],
            count: 0,
        };
        for [low, high] in layers {
            for z in low..high {
                for [low, high] in rows {
                    for row in (z * ny + low..z * ny + high).map(|row| row * nx) {
                        for [begin, end] in along {
                            runs.ends[runs.count % 27] = [row + begin, row + end];
                            runs.count += usize::from(begin < end);
                        }
                    }
                }
            }
        }
        runs
    }

    /// Returns the index of a point's cell, x fastest.
    pub fn index(&self, x: DVec3) -> usize {
        let [i, j, k] = self.coordinate(x);
        (k * self.dims[1] + j) * self.dims[0] + i
    }

    fn count(&self) -> usize {
        self.dims.iter().product()
    }

    /// Returns the first point of each cell, and finally the number of points, for points sorted by
    /// cell.
    pub fn starts(&self, sorted: &[DVec3]) -> Vec<usize> {
        self.starts_of(&self.indices(sorted))
    }

    /// Returns the order that sorts points by cell, and by `id` within a cell.
    pub fn order(&self, points: &[DVec3], id: &[u32]) -> Vec<usize> {
        let cells = self.indices(points);
        let mut next = self.starts_of(&cells);
        let mut order = vec![0; points.len()];
        for (k, &cell) in cells.iter().enumerate() {
            order[next[cell]] = k;
            next[cell] += 1;
        }
        let mut rest = &mut order[..];
        let mut first = 0;
        for end in next {
            let (cell, others) = rest.split_at_mut(end - first);
            cell.sort_unstable_by_key(|&k| id[k]);
            (rest, first) = (others, end);
        }
        order
    }

    fn indices(&self, points: &[DVec3]) -> Vec<usize> {
        parallel::map_slice(points, |&x| self.index(x))
    }

    fn starts_of(&self, cells: &[usize]) -> Vec<usize> {
        let mut start = vec![0; self.count() + 1];
        for cell in cells {
            start[cell + 1] += 1;
        }
        for k in 1..start.len() {
            start[k] += start[k - 1];
        }
        start
    }
}

/// Up to 27 runs of cells, each with its first cell and its end.
#[derive(Clone, Copy, Debug)]
pub struct Runs {
    ends: [[usize; 2]; 27],
    count: usize,
}

impl Runs {
    /// Iterates over the runs, in ascending order except across a periodic boundary.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = Range<usize>> + use<'_> {
        self.ends[..self.count]
            .iter()
            .map(|&[begin, end]| begin..end)
    }
}

/// Points in cells: particles first, then boundary samples on solids, each sorted by cell.
#[derive(Clone, Debug)]
pub struct SortedPoints<'a> {
    /// Cells of edge h or more.
    pub cells: Cells,
    /// Positions, metres.
    pub points: &'a [DVec3],
    /// Number of particles among the points.
    pub particles: usize,
}

/// Neighbours of every particle: particles in ascending order, then samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Neighbors {
    blocks: Vec<Block>,
}

/// Lists in sequence, with the end of each one's particles and of its samples.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Block {
    ends: Vec<[u32; 2]>,
    members: Vec<u32>,
}

impl Neighbors {
    /// Finds the points closer than `radius` to each particle, by nine runs of three cells
    /// (Hoetzlein 2014).
    pub fn search(crowd: &SortedPoints<'_>, radius: f64) -> Self {
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
                for cells in crowd.cells.runs(x).iter() {
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
                // Runs across a periodic boundary come before runs with smaller indices.
                if period != Period::default() {
                    members[begin..].sort_unstable();
                }
                members.len() as u32
            })
        })
    }

    /// Lists the neighbours of PBF's lists (pbf/build_neighbors): particles by quantized positions,
    /// where these are in use, some of which are slightly farther than `h` and count once they come
    /// within it; boundary samples closer than `h`.
    pub fn listed_within(crowd: &SortedPoints<'_>, h: f64) -> Self {
        let cells = &crowd.cells;
        if !places::can_pack(cells.dims.into_iter(), cells.period != Period::default()) {
            return Self::search(crowd, h);
        }
        let (fluid, solid) = crowd.points.split_at(crowd.particles);
        let (of_fluid, of_solid) = (cells.starts(fluid), cells.starts(solid));
        let inverse = (1.0 / h) as f32;
        let mut words: Vec<u32> =
            parallel::map_slice(fluid, |x| places::word(x.as_vec3().to_array(), inverse));
        words.extend([0; AT_ONCE]);
        Self::listed(crowd.particles, |i, members| {
            let x = crowd.points[i];
            let runs = cells.runs(x);
            widely(NearByWords {
                runs: &runs,
                starts: &of_fluid,
                words: &words,
                own: i,
                members,
            });
            let middle = members.len() as u32;
            for cells in runs.iter().filter(|_| !solid.is_empty()) {
                let run = of_solid[cells.start]..of_solid[cells.end];
                let first = crowd.particles + run.start;
                let is_near = |y: &DVec3| x.distance_squared(*y) < h * h;
                append_near(&solid[run], first, i, members, is_near);
            }
            [middle, members.len() as u32]
        })
    }

    /// Finds the same as [`Self::search`] by testing every pair: slow, but simple enough to be an
    /// oracle.
    pub fn naive(crowd: &SortedPoints<'_>, radius: f64) -> Self {
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

    /// Builds lists from a function `list` that appends the neighbours of a particle and returns
    /// the lengths after its particles and after its samples.
    pub fn listed(
        particles: usize,
        list: impl Fn(usize, &mut Vec<u32>) -> [u32; 2] + Sync,
    ) -> Self {
        let blocks = parallel::map(0..particles.div_ceil(BLOCK), |block| {
            let mut members = Vec::with_capacity(40 * BLOCK);
            let range = block * BLOCK..((block + 1) * BLOCK).min(particles);
            let ends = range.map(|i| list(i, &mut members)).collect();
            Block { ends, members }
        });
        Self { blocks }
    }

    /// Returns the particles near particle `i`, without itself.
    #[inline]
    pub fn fluid(&self, i: usize) -> &[u32] {
        self.of(i).0
    }

    /// Returns the particles near particle `i`, without itself, and the samples; indices of samples
    /// follow those of particles.
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

    /// Iterates over both, particles first.
    pub fn all(&self, i: usize) -> impl Iterator<Item = u32> + '_ {
        let (fluid, solid) = self.of(i);
        fluid.iter().chain(solid).copied()
    }

    /// Returns the total length of all lists; a pair of particles counts twice.
    pub fn pairs(&self) -> usize {
        self.blocks.iter().map(|block| block.members.len()).sum()
    }
}

/// Appends the points of a run that are near point `own`; the run's first point has index `first`.
///
/// Branch-free: six of seven candidates are too far, in an unpredictable order.
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

/// Appends the particles that are near a particle according to their quantized positions.
struct NearByWords<'a> {
    runs: &'a Runs,
    /// First particle of each cell.
    starts: &'a [usize],
    /// Position words of the particles, and [`AT_ONCE`] padding words.
    words: &'a [u32],
    /// Index of the particle.
    own: usize,
    members: &'a mut Vec<u32>,
}

/// Number of words that are compared at once, and of neighbours that are collected before they are
/// appended to the list.
const AT_ONCE: usize = 8;
const HELD: usize = 128;

/// Indices of a byte's set bits, packed to the front; the remaining entries are unused.
const BITS: [[u8; AT_ONCE]; 1 << AT_ONCE] = {
    let mut bits = [[0; AT_ONCE]; 1 << AT_ONCE];
    let mut byte = 0;
    while byte < bits.len() {
        let (mut bit, mut count) = (0, 0);
        while bit < AT_ONCE {
            if byte >> bit & 1 == 1 {
                bits[byte][count] = bit as u8;
                count += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    bits
};

impl WithSimd for NearByWords<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let word = self.words[self.own];
        let (mut held, mut count) = ([0; HELD], 0);
        for &[begin, end] in &self.runs.ends[..self.runs.count] {
            let (mut first, end) = (self.starts[begin], self.starts[end]);
            while first < end {
                if count > HELD - AT_ONCE {
                    self.members.extend_from_slice(&held[..count]);
                    count = 0;
                }
                let mut near = 0;
                for (k, &other) in self.words[first..first + AT_ONCE].iter().enumerate() {
                    near |= usize::from(places::are_near(word, other)) << k;
                }
                // Excludes the particle itself, and words after the end of the run.
                let itself = self.own.wrapping_sub(first);
                near &= !(usize::from(itself < AT_ONCE) << (itself % AT_ONCE));
                near &= (1 << (end - first).min(AT_ONCE)) - 1;
                // Branch-free: six of seven candidates are too far, in an unpredictable order.
                let room = held[count..count + AT_ONCE].iter_mut();
                for (room, &bit) in room.zip(&BITS[near]) {
                    *room = first as u32 + u32::from(bit);
                }
                count += near.count_ones() as usize;
                first += AT_ONCE;
            }
        }
        self.members.extend_from_slice(&held[..count]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns Halton points: no two coincide, and they form no lattice.
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

    /// Periodic along z in a slab of three cells, along x and z, and along all axes.
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
            let crowd = SortedPoints {
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
            // With walls instead, some neighbours are not found.
            let walled = SortedPoints {
                cells: Cells {
                    period: Period::default(),
                    ..cells
                },
                ..crowd
            };
            assert!(Neighbors::search(&walled, 0.2).pairs() < slow.pairs());
        }
    }

    /// A uniform cloud, one packed into a corner, and one that extends beyond the box.
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

    /// Returns points of both kinds, sorted by their cells.
    fn crowded(cells: Cells, fluid: &[DVec3], solid: &[DVec3]) -> Vec<DVec3> {
        let sorted = |points: &[DVec3]| {
            let id: Vec<u32> = (0..points.len() as u32).collect();
            let order = cells.order(points, &id).into_iter();
            order.map(|k| points[k]).collect::<Vec<_>>()
        };
        [sorted(fluid), sorted(solid)].concat()
    }

    /// Search by quantized positions finds exactly the pairs whose words are close, among all pairs
    /// within the reach of the lists. One cloud is so dense that runs of cells are longer than the
    /// held batch.
    #[test]
    fn words_find_whom_every_pair_of_them_tells() {
        let (size, h) = (DVec3::new(2.3, 0.9, 1.4), 0.2);
        let cells = Cells::new(size, h);
        for scale in [1.0, 0.3] {
            let cloud = |count| halton(count, size * scale);
            let points = crowded(cells, &cloud(1500), &cloud(90));
            let crowd = SortedPoints {
                cells,
                points: &points,
                particles: 1500,
            };
            let inverse = (1.0 / h) as f32;
            let word = |i: usize| places::word(points[i].as_vec3().to_array(), inverse);
            let (found, near) = (
                Neighbors::listed_within(&crowd, h),
                Neighbors::naive(&crowd, h),
            );
            let reach = Neighbors::naive(&crowd, h * (1.0 + places::SKIN) + 1e-6);
            let (mut most, mut beyond) = (0, 0);
            for i in 0..crowd.particles {
                let is_told = |j: &&u32| places::are_near(word(i), word(**j as usize));
                let told: Vec<u32> = reach.fluid(i).iter().filter(is_told).copied().collect();
                assert_eq!(found.of(i), (&told[..], near.of(i).1), "particle {i}");
                most = most.max(told.len());
                beyond += told.len() - near.fluid(i).len();
            }
            assert!(scale == 1.0 || most > 2 * HELD, "{most}");
            // The lists differ from those by distance: the comparison can fail.
            assert!(beyond > 0);
        }
    }

    /// Sorted by cell, and by id within a cell, whatever the order of the ids.
    #[test]
    fn order_is_that_of_cells_and_numbers() {
        let size = DVec3::new(2.3, 0.9, 1.4);
        let cells = Cells::new(size, 0.2);
        let points = halton(1500, size);
        let id: Vec<u32> = (0..1500).map(|k| k * 7919 % 1500).collect();
        let order = cells.order(&points, &id);
        let key = |&k: &usize| (cells.index(points[k]), id[k]);
        assert!(order.is_sorted_by_key(key));
        let mut all = order.clone();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..1500));
        // Negative control: without sorting, the ids do not ascend.
        assert!(!(0..1500).collect::<Vec<usize>>().is_sorted_by_key(key));
    }

    fn check(size: DVec3, fluid: Vec<DVec3>, solid: Vec<DVec3>) {
        let cells = Cells::new(size, 0.21);
        let particles = fluid.len();
        let points = crowded(cells, &fluid, &solid);
        let crowd = SortedPoints {
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
        let narrow = SortedPoints {
            cells: Cells::new(size, 0.1),
            ..crowd
        };
        assert!(Neighbors::search(&narrow, 0.2).pairs() < slow.pairs());
    }
}
