//! Which particles stand behind others wherever the eye is above the water, and the blocks of water that stand for them: splats of depth
//! leave them out, and the way through them is that through the blocks.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    aeration::is_whole,
    uniform::{Block, Particle},
};

/// Edge of a cell, particle spacings: at rest 8 particles are in one.
const CELL: f64 = 2.0;
/// Particles of the body in a cell from which on it is full.
const FULL: u8 = 5;
/// Cells along a side of a block, at most: a longer one would cover many pixels that see nothing of it.
const LONGEST: usize = 4;

/// Cells over the domain, and how many particles of the body are in each.
struct Cells {
    edge: f64,
    counts: [i64; 3],
    particles: Vec<u8>,
}

impl Cells {
    fn of(particles: &[Particle], size: DVec3, spacing: f64) -> Self {
        let counts = (size / (CELL * spacing)).ceil().max(DVec3::ONE).to_array();
        let counts = counts.map(|n| n as i64);
        let mut cells = Self {
            edge: CELL * spacing,
            counts,
            particles: vec![0; counts.iter().product::<i64>() as usize],
        };
        for particle in particles.iter().filter(|it| is_whole(it)) {
            if let Some(at) = cells.index(cells.cell(particle)) {
                cells.particles[at] = cells.particles[at].saturating_add(1);
            }
        }
        cells
    }

    fn cell(&self, particle: &Particle) -> [i64; 3] {
        (Vec3::from(particle.position) / self.edge as f32)
            .floor()
            .to_array()
            .map(|c| c as i64)
    }

    fn index(&self, cell: [i64; 3]) -> Option<usize> {
        let is_in = |axis: usize| (0..self.counts[axis]).contains(&cell[axis]);
        let [x, y, z] = cell;
        let index = (z * self.counts[1] + y) * self.counts[0] + x;
        (0..3).all(is_in).then_some(index as usize)
    }

    /// The ground hides what is below it; beyond the other sides there is air.
    fn is_full(&self, cell: [i64; 3]) -> bool {
        let count = self.index(cell).map(|at| self.particles[at]);
        count.map_or(cell[1] < 0, |count| count >= FULL)
    }

    /// Whether a cell of the domain and the 26 about it are full.
    fn is_deep(&self, [x, y, z]: [i64; 3]) -> bool {
        let mut around = (-1..=1).flat_map(|dz| (-1..=1).map(move |dy| (dy, dz)));
        around.all(|(dy, dz)| (-1..=1).all(|dx| self.is_full([x + dx, y + dy, z + dz])))
    }

    /// Of each cell, whether it is deep.
    fn deep(&self) -> Vec<bool> {
        let [width, height, _] = self.counts;
        (0..self.particles.len() as i64)
            .into_par_iter()
            .map(|at| self.is_deep([at % width, at / width % height, at / (width * height)]))
            .collect()
    }

    /// Blocks of deep cells, each of which is in one: every cell of `deep` becomes false.
    fn blocks(&self, deep: &mut [bool], spacing: f64) -> Vec<Block> {
        let [width, height, depth] = self.counts.map(|n| n as usize);
        let index = |[x, y, z]: [usize; 3]| (z * height + y) * width + x;
        let mut blocks = Vec::new();
        for at in 0..deep.len() {
            if !deep[at] {
                continue;
            }
            let low = [at % width, at / width % height, at / (width * height)];
            let mut high = low.map(|c| c + 1);
            for (axis, side) in [width, height, depth].into_iter().enumerate() {
                while high[axis] < side.min(low[axis] + LONGEST) {
                    let (mut first, mut end) = (low, high);
                    first[axis] = high[axis];
                    end[axis] += 1;
                    if !between(first, end).all(|cell| deep[index(cell)]) {
                        break;
                    }
                    high = end;
                }
            }
            let mut count = 0.0;
            for cell in between(low, high) {
                count += f64::from(self.particles[index(cell)]);
                deep[index(cell)] = false;
            }
            let cells: usize = (0..3).map(|axis| high[axis] - low[axis]).product();
            let volume = cells as f64 * self.edge.powi(3);
            blocks.push(Block {
                low: low.map(|c| (c as f64 * self.edge) as f32),
                filled: (count * spacing.powi(3) / volume) as f32,
                high: high.map(|c| (c as f64 * self.edge) as f32),
                ..Block::default()
            });
        }
        blocks
    }
}

/// Cells from `low` on and before `high`.
fn between(low: [usize; 3], high: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let rows = (low[2]..high[2]).flat_map(move |z| (low[1]..high[1]).map(move |y| (y, z)));
    rows.flat_map(move |(y, z)| (low[0]..high[0]).map(move |x| [x, y, z]))
}

/// What of a frame's water is behind other water.
#[derive(Default)]
pub(super) struct Hidden {
    /// Of each particle, whether water hides it: all cells about its own are full of whole particles.
    pub(super) particles: Vec<bool>,
    /// What stands for these, front or back in no order.
    pub(super) blocks: Vec<Block>,
}

impl Hidden {
    /// Places are metres from the least corner of a domain of `size`; `spacing` lies between neighbours at rest, metres.
    ///
    /// Two spacings of water at least lie between what is hidden and the air, and a splat reaches 1.25 spacings at most.
    pub(super) fn of(particles: &[Particle], size: DVec3, spacing: f64) -> Self {
        let cells = Cells::of(particles, size, spacing);
        let mut deep = cells.deep();
        let is_deep =
            |particle: &Particle| cells.index(cells.cell(particle)).is_some_and(|at| deep[at]);
        let hidden = particles
            .par_iter()
            .map(|particle| is_whole(particle) && is_deep(particle))
            .collect();
        Self {
            particles: hidden,
            blocks: cells.blocks(&mut deep, spacing),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::aeration::CLEAR;

    const SIDE: i32 = 24;

    /// A block of so many particles along each side, a spacing of 1 apart and moved by up to a quarter of that, on the ground in the
    /// middle of a domain; `keep` says which are there.
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

    /// Distance to the air over and beside the block, spacings.
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
        // A cell's edge lies between it and the air, and less than two more: at the ground too.
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

    /// Beyond a side of the domain there is air; cells with half of their particles are not full.
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
        // Of each cell's eight particles four.
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

    /// Blocks hold each hidden particle once, overlap nowhere, and have their volume.
    #[test]
    fn blocks_stand_for_what_is_hidden() {
        let middle = DVec3::new(20.0, 10.0, 20.0);
        let (particles, size) = block(|p| p.distance(middle) > 3.0);
        let found = Hidden::of(&particles, size, 1.0);
        let is_in = |p: [f32; 3], block: &Block| {
            (0..3).all(|axis| block.low[axis] <= p[axis] && p[axis] < block.high[axis])
        };
        let mut held = vec![0; found.blocks.len()];
        for (particle, hidden) in particles.iter().zip(&found.particles) {
            let within = (0..held.len()).filter(|&k| is_in(particle.position, &found.blocks[k]));
            let within: Vec<usize> = within.collect();
            assert_eq!(
                within.len(),
                usize::from(*hidden),
                "{:?}",
                particle.position
            );
            within.iter().for_each(|&k| held[k] += 1);
        }
        for (block, held) in found.blocks.iter().zip(&held) {
            let sides = (Vec3::from(block.high) - Vec3::from(block.low)).as_dvec3();
            assert!(sides.max_element() <= CELL * LONGEST as f64);
            let expected = f64::from(*held) / sides.element_product();
            assert!((f64::from(block.filled) - expected).abs() < 1e-6 * expected);
        }
        // Cells of 8 particles: most are in blocks of many cells.
        let all: u32 = held.iter().sum();
        assert!(
            all > 4000 && held.len() as u32 * 8 * 8 < all,
            "{all} in {}",
            held.len()
        );
    }
}
