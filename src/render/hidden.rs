//! Finds particles that other water hides from any eye above the water. Depth splats skip them, and
//! blocks of water take their place in the thickness along a line of sight.

use glam::{DVec3, Vec3};

use super::{
    aeration::is_whole,
    uniform::{Block, Particle},
};
use swell_domain::parallel;

/// Edge of a cell, particle spacings: at rest it holds 8 particles.
const CELL: f64 = 2.0;
/// Number of particles of the body at which a cell counts as full.
const FULL: u8 = 5;
/// Largest number of cells along a side of a block; a longer block would cover many pixels that see
/// nothing of it.
const LONGEST: usize = 8;
/// Block index of a cell that is in no block.
const NONE: u32 = u32::MAX;

/// Whether the particle belongs to the body at full size and holds no air; as spray it may be
/// visible where the surface is not.
fn is_clear(particle: &Particle) -> bool {
    is_whole(particle) && particle.air & 0xffff == 0
}

/// Numbers of clear particles in the cells of the box around all of them.
struct Cells {
    edge: f64,
    /// Position in the domain of the box's first cell.
    first: [i64; 3],
    counts: [usize; 3],
    particles: Vec<u8>,
}

impl Cells {
    /// Returns `None` where no particle is clear.
    fn of(particles: &[Particle], size: DVec3, spacing: f64) -> Option<Self> {
        let edge = CELL * spacing;
        let most = (size / edge).ceil().max(DVec3::ONE).to_array();
        let most = most.map(|n| n as i64 - 1);
        let (mut low, mut high) = (most, [0; 3]);
        let clear = || particles.iter().filter(|it| is_clear(it));
        for cell in clear().map(|particle| cell(particle, edge)) {
            for axis in 0..3 {
                low[axis] = low[axis].min(cell[axis].clamp(0, most[axis]));
                high[axis] = high[axis].max(cell[axis].clamp(0, most[axis]));
            }
        }
        clear().next()?;
        let counts = [0, 1, 2].map(|axis| (high[axis] - low[axis] + 1) as usize);
        let mut cells = Self {
            edge,
            first: low,
            counts,
            particles: vec![0; counts.iter().product()],
        };
        for particle in clear() {
            if let Some(at) = cells.index(cell(particle, edge)) {
                cells.particles[at] = cells.particles[at].saturating_add(1);
            }
        }
        Some(cells)
    }

    fn index(&self, cell: [i64; 3]) -> Option<usize> {
        let from = |axis: usize| usize::try_from(cell[axis] - self.first[axis]).ok();
        let [x, y, z] = [from(0)?, from(1)?, from(2)?];
        let is_in = x < self.counts[0] && y < self.counts[1] && z < self.counts[2];
        is_in.then(|| self.place([x, y, z]))
    }

    /// Index of a cell, from its position relative to the first one.
    fn place(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// Position relative to the first cell, from a cell's index.
    fn at(&self, index: usize) -> [usize; 3] {
        let [width, height, _] = self.counts;
        [
            index % width,
            index / width % height,
            index / (width * height),
        ]
    }

    /// Whether a cell is full. Cells below the domain count as full, because the ground hides what
    /// is below it; beyond the other sides there is air.
    fn is_full(&self, cell: [i64; 3]) -> bool {
        let count = self.index(cell).map(|at| self.particles[at]);
        count.map_or(cell[1] < 0, |count| count >= FULL)
    }

    /// For each cell, whether it and its 26 neighbours are full.
    fn deep(&self) -> Vec<bool> {
        let is_deep = |index: usize| {
            let cell = self.at(index);
            let [x, y, z] = [0, 1, 2].map(|axis| cell[axis] as i64 + self.first[axis]);
            let mut around = (-1..=1).flat_map(|dz| (-1..=1).map(move |dy| (dy, dz)));
            self.particles[index] >= FULL
                && around.all(|(dy, dz)| (-1..=1).all(|dx| self.is_full([x + dx, y + dy, z + dz])))
        };
        parallel::map(0..self.particles.len(), is_deep)
    }

    /// Divides the deep cells into disjoint blocks. Returns the first and end cells (exclusive) of
    /// each block, and the block of each cell.
    fn blocks(&self, deep: &[bool]) -> (Vec<[[usize; 3]; 2]>, Vec<u32>) {
        let mut block_of = vec![NONE; deep.len()];
        let mut blocks: Vec<[[usize; 3]; 2]> = Vec::new();
        for index in (0..deep.len()).filter(|&index| deep[index]) {
            if block_of[index] != NONE {
                continue;
            }
            let low = self.at(index);
            let mut high = low.map(|c| c + 1);
            for axis in 0..3 {
                while high[axis] < self.counts[axis].min(low[axis] + LONGEST) {
                    let (mut first, mut end) = (low, high);
                    first[axis] = high[axis];
                    end[axis] += 1;
                    let is_free = |at: usize| deep[at] && block_of[at] == NONE;
                    if !between(first, end).all(|cell| is_free(self.place(cell))) {
                        break;
                    }
                    high = end;
                }
            }
            for cell in between(low, high) {
                block_of[self.place(cell)] = blocks.len() as u32;
            }
            blocks.push([low, high]);
        }
        (blocks, block_of)
    }

    /// Lower corner of a cell, given relative to the first one, in metres.
    fn corner(&self, cell: [usize; 3]) -> [f32; 3] {
        [0, 1, 2].map(|axis| ((cell[axis] as i64 + self.first[axis]) as f64 * self.edge) as f32)
    }
}

fn cell(particle: &Particle, edge: f64) -> [i64; 3] {
    let place = Vec3::from(particle.position).as_dvec3() / edge;
    place.floor().to_array().map(|c| c as i64)
}

/// Cells from `low` up to but excluding `high`.
fn between(low: [usize; 3], high: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let rows = (low[2]..high[2]).flat_map(move |z| (low[1]..high[1]).map(move |y| (y, z)));
    rows.flat_map(move |(y, z)| (low[0]..high[0]).map(move |x| [x, y, z]))
}

/// Water of a frame that is hidden behind other water.
#[derive(Default)]
pub(super) struct Hidden {
    /// For each particle, whether water hides it: its cell and all cells around that are full.
    pub(super) particles: Vec<bool>,
    /// Blocks that replace the hidden particles, in no order of depth.
    pub(super) blocks: Vec<Block>,
}

impl Hidden {
    /// Finds the hidden particles. Positions are metres from the least corner of a domain of
    /// `size`; `spacing` is the distance between neighbours at rest, metres.
    ///
    /// At least two spacings of water lie between a hidden particle and the air, and a splat
    /// reaches 1.25 spacings at most.
    pub(super) fn of(particles: &[Particle], size: DVec3, spacing: f64) -> Self {
        let Some(cells) = Cells::of(particles, size, spacing) else {
            return Self {
                particles: vec![false; particles.len()],
                blocks: Vec::new(),
            };
        };
        let (spans, block_of) = cells.blocks(&cells.deep());
        let block = |particle: &Particle| match is_clear(particle) {
            true => (cells.index(cell(particle, cells.edge))).map_or(NONE, |at| block_of[at]),
            false => NONE,
        };
        let of: Vec<u32> = parallel::map_slice(particles, block);
        let mut sums = vec![(0.0, DVec3::ZERO); spans.len()];
        for (particle, &block) in particles
            .iter()
            .zip(&of)
            .filter(|(_, block)| **block != NONE)
        {
            let (count, velocity) = &mut sums[block as usize];
            *count += 1.0;
            *velocity += Vec3::from(particle.velocity).as_dvec3();
        }
        let stands = |([low, high], (count, velocity)): (&[[usize; 3]; 2], &(f64, DVec3))| {
            let inside: usize = (0..3).map(|axis| high[axis] - low[axis]).product();
            Block {
                low: cells.corner(*low),
                filled: (count / (inside as f64 * CELL.powi(3))) as f32,
                high: cells.corner(*high),
                velocity: (*velocity / *count).as_vec3().to_array(),
                ..Block::default()
            }
        };
        Self {
            particles: of.iter().map(|&block| block != NONE).collect(),
            blocks: spans.iter().zip(&sums).map(stands).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aeration::CLEAR;

    const SIDE: i32 = 24;

    /// Jittered block of `SIDE` particles along each axis with a spacing of 1, on the ground in the
    /// middle of a domain, filtered by `keep`; the jitter is up to a quarter.
    fn block(keep: impl Fn(DVec3) -> bool) -> (Vec<Particle>, DVec3) {
        let mut seed = 7u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / 16_777_216.0 - 0.5
        };
        let mut particles = Vec::new();
        for k in 0..SIDE.pow(3) {
            let at = DVec3::new(
                f64::from(k % SIDE) + 8.5 + 0.5 * random(),
                f64::from(k / SIDE % SIDE) + 0.5 + 0.5 * random(),
                f64::from(k / SIDE.pow(2)) + 8.5 + 0.5 * random(),
            );
            if keep(at) {
                particles.push(Particle {
                    position: at.as_vec3().to_array(),
                    air: CLEAR,
                    tag: 1,
                    ..Particle::default()
                });
            }
        }
        (particles, DVec3::new(40.0, 40.0, 40.0))
    }

    /// Distance to the air above and beside the block, spacings.
    fn depth(p: [f32; 3]) -> f64 {
        let p = Vec3::from(p).as_dvec3();
        let sides = (p - 8.0).min(32.0 - p);
        sides.x.min(sides.z).min(24.0 - p.y)
    }

    #[test]
    fn what_is_near_air_is_seen() {
        let (particles, size) = block(|_| true);
        let found = Hidden::of(&particles, size, 1.0).particles;
        let deep = |least: f64| {
            let of =
                |(p, hidden): (&Particle, &bool)| (depth(p.position) > least).then_some(*hidden);
            particles
                .iter()
                .zip(&found)
                .filter_map(of)
                .collect::<Vec<_>>()
        };
        // At least a cell's edge, and less than two, lies between a hidden particle and the air, at
        // the ground too.
        let shallow = particles
            .iter()
            .zip(&found)
            .filter(|(p, _)| depth(p.position) < CELL - 0.5);
        assert!(shallow.clone().count() > 1000 && shallow.clone().all(|(_, hidden)| !hidden));
        assert!(
            deep(2.0 * CELL + 0.5).iter().all(|hidden| *hidden)
                && deep(2.0 * CELL + 0.5).len() > 4000
        );
    }

    /// Air lies beyond the sides of the domain, and half-filled cells are not full.
    #[test]
    fn sides_and_thin_water_hide_nothing() {
        let (mut particles, size) = block(|_| true);
        for particle in &mut particles {
            particle.position[0] -= 8.25;
        }
        let found = Hidden::of(&particles, size, 1.0).particles;
        let at_side = |p: &Particle| p.position[0] < CELL as f32;
        let beside = particles.iter().zip(&found).filter(|(p, _)| at_side(p));
        assert!(beside.clone().count() > 1000 && beside.clone().all(|(_, hidden)| !hidden));
        assert!(found.iter().any(|hidden| *hidden));
        // Four of the eight particles of each cell.
        let thin = |fewer: bool| {
            let (particles, size) = block(|p| !fewer || (p.x as i32 + p.y as i32) % 2 == 0);
            Hidden::of(&particles, size, 1.0)
                .particles
                .iter()
                .any(|hidden| *hidden)
        };
        assert!(thin(false) && !thin(true));
    }

    #[test]
    fn a_bubble_and_torn_water_hide_nothing() {
        let middle = DVec3::new(20.0, 10.0, 20.0);
        let (particles, size) = block(|p| p.distance(middle) > 3.0);
        let found = Hidden::of(&particles, size, 1.0).particles;
        let about = |p: &Particle| Vec3::from(p.position).as_dvec3().distance(middle);
        let walls = particles.iter().zip(&found).filter(|(p, _)| about(p) < 4.0);
        assert!(walls.clone().count() > 100 && walls.clone().all(|(_, hidden)| !hidden));
        let (mut torn, size) = block(|_| true);
        for particle in &mut torn {
            particle.air = 0xffbf_0000;
        }
        assert!(
            Hidden::of(&torn, size, 1.0)
                .particles
                .iter()
                .all(|hidden| !hidden)
        );
        let (mut thrown, size) = block(|_| true);
        for particle in &mut thrown {
            particle.tag = 0;
        }
        assert!(
            Hidden::of(&thrown, size, 1.0)
                .particles
                .iter()
                .all(|hidden| !hidden)
        );
    }

    /// Particles with air may be visible as spray.
    #[test]
    fn what_holds_air_is_not_hidden() {
        let (mut particles, size) = block(|_| true);
        for particle in particles.iter_mut().step_by(5) {
            particle.air |= 1;
        }
        let found = Hidden::of(&particles, size, 1.0).particles;
        assert!(found.iter().any(|hidden| *hidden));
        assert!(found.iter().step_by(5).all(|hidden| !hidden));
    }

    /// Blocks contain each hidden particle exactly once, are disjoint, and have the particles'
    /// volume and mean velocity.
    #[test]
    fn blocks_stand_for_what_is_hidden() {
        for spacing in [1.0, 0.17] {
            let middle = DVec3::new(20.0, 10.0, 20.0);
            let (mut particles, size) = block(|p| p.distance(middle) > 3.0);
            for particle in &mut particles {
                particle.position = particle.position.map(|x| x * spacing);
                particle.velocity = [particle.position[1], 3.0, 0.0];
            }
            let found = Hidden::of(&particles, f64::from(spacing) * size, spacing.into());
            let is_in = |p: [f32; 3], block: &Block| {
                (0..3).all(|axis| block.low[axis] <= p[axis] && p[axis] < block.high[axis])
            };
            let mut held = vec![(0, 0.0); found.blocks.len()];
            for (particle, hidden) in particles.iter().zip(&found.particles) {
                let within =
                    (0..held.len()).filter(|&k| is_in(particle.position, &found.blocks[k]));
                let within: Vec<usize> = within.collect();
                assert_eq!(
                    within.len(),
                    usize::from(*hidden),
                    "{:?}",
                    particle.position
                );
                for k in within {
                    held[k].0 += 1;
                    held[k].1 += f64::from(particle.velocity[0]);
                }
            }
            for (block, (count, speed)) in found.blocks.iter().zip(&held) {
                let sides = (Vec3::from(block.high) - Vec3::from(block.low)).as_dvec3();
                let sides = sides / f64::from(spacing);
                assert!(sides.max_element() < CELL * LONGEST as f64 + 1e-4);
                let expected = f64::from(*count) / sides.element_product();
                assert!((f64::from(block.filled) - expected).abs() < 1e-5 * expected);
                let mean = speed / f64::from(*count);
                assert!((f64::from(block.velocity[0]) - mean).abs() < 1e-5 * mean);
                assert_eq!(block.velocity[1..], [3.0, 0.0]);
            }
            // Cells hold 8 particles, and most cells are in blocks of many.
            let all: u32 = held.iter().map(|(count, _)| count).sum();
            assert!(
                all > 4000 && held.len() as u32 * 8 * 8 < all,
                "{all} in {}",
                held.len()
            );
        }
    }

    #[test]
    fn without_water_nothing_is_hidden() {
        let (particles, size) = block(|_| false);
        assert!(Hidden::of(&particles, size, 1.0).blocks.is_empty());
    }
}
