//! Velocities of the water beside a level set, by which rays see its surface at instants around its
//! own.
//!
//! At `t` seconds from the level set's instant the field at `x` is φ(x − t v(x)). Water that moves
//! as a whole is met exactly; where velocities differ by ∇v, the surface is off by up to
//! ½ t² |v ∇v|.
//! The lattice of velocities has nodes every two voxels: the mean of the particles around a node,
//! by trilinear weights, and where there are none the mean of its neighbours, layer by layer.
//! Between nodes velocities are linear in each of the six tetrahedra of a cell.

use glam::{DVec3, Vec3};

use super::{EDGE, FIRST, FULL, LevelSet, NODES, VALUES};
use crate::parallel;

/// Voxels between two nodes.
const PITCH: u32 = 2;
/// Nodes along the edge of a brick without those of the next brick, and with them.
const OWN: u32 = EDGE / PITCH;
const ALONG: u32 = OWN + 1;
/// Words of a brick: one for each node. Node (i, j, k) is element i + 5 j + 25 k.
pub const WORDS: usize = (ALONG * ALONG * ALONG) as usize;
/// Flags of the table's entry of a brick without values into which the surface may move: from a
/// brick without water, or one entirely in water.
pub const HALO: [u32; 2] = [1 << 30, 1 << 31];
/// Steps of a component on either side of zero.
const STEPS: f32 = 511.0;
/// Layers of nodes without particles that get a velocity where the surface does not move, for
/// voxels of half a spacing: it lies up to 1.25 spacings from the particles, and is looked up
/// between nodes.
const LAYERS: u32 = 6;
/// Voxels by which the surface may be farther than its velocity says.
const MARGIN: f64 = 0.5;

/// A level set's table with velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct Drift {
    /// The table, in which bricks into which the surface may move have the number of their block of
    /// words and a flag of [`HALO`]; then [`WORDS`] for each brick with values and each of those,
    /// in the order of their numbers. A word has ten bits for each component.
    pub table: Vec<u32>,
    /// Largest component of a velocity, m/s: that of 511 steps from 512, which is at rest.
    pub speed: f32,
}

/// Nodes of the bricks with values and of those around them.
struct Lattice {
    /// Bricks along each axis, with one more on the far side for its nodes.
    bricks: [usize; 3],
    /// Number of each brick's block in `nodes`, or `NONE`.
    blocks: Vec<u32>,
    /// Velocity and weight of each node, [`OWN`]³ for each block.
    nodes: Vec<[f64; 4]>,
}

const NONE: u32 = u32::MAX;
/// Nodes of a block.
const BLOCK: usize = (OWN * OWN * OWN) as usize;

impl Lattice {
    /// With the blocks within `ring` bricks of one with values.
    fn around(level: &LevelSet, ring: usize) -> Self {
        let bricks = level.bricks.map(|n| n as usize + 1);
        let mut blocks = vec![NONE; bricks.iter().product()];
        let mut count = 0;
        for (brick, _) in valued(level) {
            let [xs, ys, zs] = [0, 1, 2].map(|axis| {
                let at = brick[axis] as usize;
                at.saturating_sub(ring)..(at + ring + 1).min(bricks[axis])
            });
            for z in zs {
                for y in ys.clone() {
                    for block in &mut blocks[(z * bricks[1] + y) * bricks[0]..][xs.clone()] {
                        if *block == NONE {
                            *block = count;
                            count += 1;
                        }
                    }
                }
            }
        }
        Self {
            bricks,
            blocks,
            nodes: vec![[0.0; 4]; count as usize * BLOCK],
        }
    }

    /// Index of a node; `None` beyond the blocks.
    fn index(&self, at: [i64; 3]) -> Option<usize> {
        let own = i64::from(OWN);
        let inside = |axis: usize| (0..self.bricks[axis] as i64 * own).contains(&at[axis]);
        if !(0..3).all(inside) {
            return None;
        }
        let [x, y, z] = at.map(|c| (c / own) as usize);
        let block = self.blocks[(z * self.bricks[1] + y) * self.bricks[0] + x];
        let [i, j, k] = at.map(|c| (c % own) as usize);
        let own = OWN as usize;
        (block != NONE).then(|| block as usize * BLOCK + i + own * (j + own * k))
    }

    /// Adds the particles' velocities, and divides by their weights.
    fn gather(&mut self, places: &[DVec3], velocities: &[DVec3], pitch: f64) {
        for (place, velocity) in places.iter().zip(velocities) {
            let at = *place / pitch;
            let (low, part) = (at.floor(), at - at.floor());
            for corner in 0..8i64 {
                let bits = [corner & 1, corner >> 1 & 1, corner >> 2];
                let node = [0, 1, 2].map(|axis| low[axis] as i64 + bits[axis]);
                let weigh = |axis: usize| match bits[axis] {
                    1 => part[axis],
                    _ => 1.0 - part[axis],
                };
                let weight = weigh(0) * weigh(1) * weigh(2);
                if let Some(index) = self.index(node) {
                    let own = (*velocity * weight).extend(weight).to_array();
                    for (sum, value) in self.nodes[index].iter_mut().zip(own) {
                        *sum += value;
                    }
                }
            }
        }
        for node in &mut self.nodes {
            if node[3] > 0.0 {
                *node = node.map(|value| value / node[3]);
            }
        }
    }

    /// Gives nodes without a velocity the mean of their neighbours along the axes, layer by layer.
    fn extend(&mut self, layers: u32) {
        let [nx, ny, _] = self.bricks;
        let blocks = self.blocks.iter().enumerate();
        let held: Vec<usize> = (blocks.filter(|(_, block)| **block != NONE))
            .map(|(brick, _)| brick)
            .collect();
        for _ in 0..layers {
            let found: Vec<(usize, [f64; 4])> = parallel::flat_map(0..held.len(), |k| {
                let brick = held[k];
                let corner = [brick % nx, brick / nx % ny, brick / nx / ny];
                let lattice = &*self;
                (0..BLOCK).filter_map(move |node| {
                    let own = OWN as usize;
                    let in_block = [node % own, node / own % own, node / own / own];
                    let at = [0, 1, 2].map(|axis| (corner[axis] * own + in_block[axis]) as i64);
                    lattice.beside(at)
                })
            });
            if found.is_empty() {
                break;
            }
            for (index, value) in found {
                self.nodes[index] = value;
            }
        }
    }

    /// Index and mean of the neighbours of a node without a velocity.
    fn beside(&self, at: [i64; 3]) -> Option<(usize, [f64; 4])> {
        let index = self.index(at)?;
        if self.nodes[index][3] > 0.0 {
            return None;
        }
        let mut sum = [0.0; 4];
        for (axis, step) in (0..3).flat_map(|axis| [(axis, -1), (axis, 1)]) {
            let mut other = at;
            other[axis] += step;
            if let Some(other) = self.index(other) {
                for (sum, value) in sum.iter_mut().zip(self.nodes[other]) {
                    *sum += value;
                }
            }
        }
        (sum[3] > 0.0).then(|| (index, sum.map(|value| value / sum[3])))
    }

    /// Velocities of a brick's nodes.
    fn of_brick(&self, brick: [u32; 3]) -> [Vec3; WORDS] {
        std::array::from_fn(|node| {
            let along = ALONG as usize;
            let own = [node % along, node / along % along, node / along / along];
            let at = [0, 1, 2].map(|axis| i64::from(brick[axis] * OWN) + own[axis] as i64);
            let [x, y, z, _] = self.index(at).map_or([0.0; 4], |index| self.nodes[index]);
            DVec3::new(x, y, z).as_vec3()
        })
    }
}

/// Bricks with values, in the order of their numbers, with their index in the table.
fn valued(level: &LevelSet) -> impl Iterator<Item = ([u32; 3], usize)> {
    let held = level.table.iter().enumerate();
    held.filter(|(_, entry)| **entry >= FIRST)
        .map(|(index, _)| (place(level, index), index))
}

fn place(level: &LevelSet, index: usize) -> [u32; 3] {
    let [nx, ny, _] = level.bricks.map(|n| n as usize);
    [index % nx, index / nx % ny, index / nx / ny].map(|c| c as u32)
}

/// Least and greatest corner, in voxels from the brick's, of the cells that the surface passes
/// through.
fn surface_within(values: &[f32]) -> Option<[DVec3; 2]> {
    let nodes = NODES as usize;
    let is_wet = |x: usize, y: usize, z: usize| values[x + nodes * (y + nodes * z)] > 0.0;
    let mut found: Option<[DVec3; 2]> = None;
    for cell in 0..(EDGE * EDGE * EDGE) as usize {
        let edge = EDGE as usize;
        let [x, y, z] = [cell % edge, cell / edge % edge, cell / edge / edge];
        let count =
            (0..8).filter(|c| is_wet(x + 1 + (c & 1), y + 1 + (c >> 1 & 1), z + 1 + (c >> 2)));
        if !(1..8).contains(&count.count()) {
            continue;
        }
        let low = DVec3::new(x as f64, y as f64, z as f64);
        let [least, most] = found.unwrap_or([low, low + 1.0]);
        found = Some([least.min(low), most.max(low + 1.0)]);
    }
    found
}

impl Drift {
    /// Adds velocities to a level set of particles at `places`, metres, which move at `velocities`,
    /// m/s. Its surface may be looked up for `seconds` before and after its instant.
    pub fn new(level: &LevelSet, places: &[DVec3], velocities: &[DVec3], seconds: f64) -> Self {
        let most = velocities
            .iter()
            .fold(0.0f64, |most, v| most.max(v.length()));
        // Voxels by which the surface moves; water that is faster than that loses its velocity.
        let reach = (most * seconds / level.voxel).min(f64::from(3 * EDGE));
        let edge = f64::from(EDGE);
        let ring = 1 + ((reach - 0.5 * edge) / edge).ceil().max(0.0) as usize;
        let mut lattice = Lattice::around(level, ring);
        lattice.gather(places, velocities, f64::from(PITCH) * level.voxel);
        // Layers grow along the axes, up to √3 of a distance.
        lattice.extend(LAYERS + (3f64.sqrt() * reach / f64::from(PITCH)).ceil() as u32);
        let held: Vec<([u32; 3], usize)> = valued(level).collect();
        let of_held: Vec<[Vec3; WORDS]> =
            parallel::map_slice(&held, |&(brick, _)| lattice.of_brick(brick));
        let reached = reached(level, &held, &of_held, seconds);
        let mut table = level.table.clone();
        let mut count = held.len() as u32;
        let mut halo = Vec::new();
        for (entry, index) in table.iter_mut().zip(0..) {
            if *entry < FIRST && reached[index] {
                let kind = usize::from(*entry == FULL);
                *entry = (FIRST + count) | HALO[kind];
                count += 1;
                halo.push(place(level, index));
            }
        }
        let of_halo: Vec<[Vec3; WORDS]> =
            parallel::map_slice(&halo, |&brick| lattice.of_brick(brick));
        let all = || of_held.iter().chain(&of_halo).flatten();
        let speed = all().fold(0.0f32, |most, v| most.max(v.abs().max_element()));
        table.extend(all().map(|&velocity| packed(velocity, speed)));
        Self { table, speed }
    }
}

/// Bricks into which the surface may move, by their index in the table.
fn reached(
    level: &LevelSet,
    held: &[([u32; 3], usize)],
    velocities: &[[Vec3; WORDS]],
    seconds: f64,
) -> Vec<bool> {
    let mut reached = vec![false; level.table.len()];
    let boxes: Vec<Option<[DVec3; 2]>> = parallel::map(0..held.len(), |k| {
        let [low, high] = surface_within(&level.values[k * VALUES..][..VALUES])?;
        let most = velocities[k]
            .iter()
            .fold(0.0f32, |most, v| most.max(v.length()));
        let way = f64::from(most) * seconds / level.voxel;
        if way == 0.0 {
            return None;
        }
        let reach = way + MARGIN;
        let corner = DVec3::from_array(held[k].0.map(|c| f64::from(c * EDGE)));
        Some([corner + low - reach, corner + high + reach])
    });
    for [low, high] in boxes.into_iter().flatten() {
        let [xs, ys, zs] = [0, 1, 2].map(|axis| {
            let last = level.bricks[axis] as usize;
            let at = |p: f64| (p / f64::from(EDGE)).floor().max(0.0) as usize;
            at(low[axis])..(at(high[axis]) + 1).min(last)
        });
        for z in zs {
            for y in ys.clone() {
                let row = (z * level.bricks[1] as usize + y) * level.bricks[0] as usize;
                reached[row..][xs.clone()].fill(true);
            }
        }
    }
    reached
}

/// Ten bits for each component: 512 at rest, 511 steps to `speed` either way.
fn packed(velocity: Vec3, speed: f32) -> u32 {
    if speed == 0.0 {
        return 512 | 512 << 10 | 512 << 20;
    }
    let [x, y, z] = (velocity / speed * STEPS)
        .round()
        .to_array()
        .map(|step| (step + 512.0) as u32);
    x | y << 10 | z << 20
}

#[cfg(test)]
mod tests {
    use super::*;

    const D: f64 = 0.1;

    fn unpacked(word: u32, speed: f32) -> DVec3 {
        let step = |bits: u32| f64::from(bits & 1023) - 512.0;
        DVec3::new(step(word), step(word >> 10), step(word >> 20)) / 511.0 * f64::from(speed)
    }

    /// A ball of particles about `centre`.
    fn ball(centre: DVec3, radius: f64) -> Vec<DVec3> {
        let side = || -20..20;
        let all = side().flat_map(|x| side().flat_map(move |y| side().map(move |z| [x, y, z])));
        all.map(|p| (DVec3::from_array(p.map(f64::from)) + 0.5) * D)
            .filter(|p| p.length() < radius)
            .map(|p| centre + p)
            .collect()
    }

    fn with(places: &[DVec3], velocity: impl Fn(DVec3) -> DVec3) -> (LevelSet, Drift) {
        let level = LevelSet::new(places, DVec3::splat(4.0), D);
        let velocities: Vec<DVec3> = places.iter().map(|&p| velocity(p)).collect();
        let drift = Drift::new(&level, places, &velocities, 0.02);
        (level, drift)
    }

    /// Entry and words of the brick at `p`.
    fn at<'a>(level: &LevelSet, drift: &'a Drift, p: DVec3) -> (u32, &'a [u32]) {
        let [x, y, z] = (p / level.voxel / f64::from(EDGE))
            .to_array()
            .map(|c| c as usize);
        let [nx, ny, _] = level.bricks.map(|n| n as usize);
        let entry = drift.table[(z * ny + y) * nx + x];
        let number = (entry & !(HALO[0] | HALO[1])) as usize;
        match number.checked_sub(FIRST as usize) {
            Some(block) => (
                entry,
                &drift.table[level.table.len() + block * WORDS..][..WORDS],
            ),
            None => (entry, &[]),
        }
    }

    #[test]
    fn water_that_moves_as_a_whole_has_its_velocity_all_around() {
        let centre = DVec3::splat(2.0);
        let velocity = DVec3::new(9.0, -4.0, 2.5);
        let (level, drift) = with(&ball(centre, 0.5), |_| velocity);
        // Six tenths of a metre from the centre, and as far as the surface moves, 0.2 m, on.
        let mut seen = 0;
        for k in 0..200 {
            let turn = 2.4 * f64::from(k);
            let up = (f64::from(k) + 0.5) / 100.0 - 1.0;
            let across = (1.0 - up * up).sqrt();
            let away = DVec3::new(across * turn.cos(), up, across * turn.sin());
            for far in [0.4, 0.5, 0.6, 0.7] {
                let (entry, words) = at(&level, &drift, centre + far * away);
                if far < 0.7 {
                    assert_ne!(entry, 0, "{far} {away}");
                }
                let off = |velocity: DVec3| {
                    let off = words
                        .iter()
                        .map(|&word| unpacked(word, drift.speed) - velocity);
                    off.fold(0.0, |most: f64, it| most.max(it.length()))
                };
                let is_all_known = words
                    .iter()
                    .all(|&word| unpacked(word, drift.speed).x > 0.0);
                if !words.is_empty() && is_all_known {
                    // Half a step of each component.
                    assert!(off(velocity) < 9.0 / 1022.0 * 3f64.sqrt() + 1e-5);
                    assert!(off(1.01 * velocity) > 9.0 / 1022.0 * 3f64.sqrt() + 1e-5);
                    seen += 1;
                }
            }
        }
        assert!(seen > 300, "{seen}");
    }

    #[test]
    fn only_bricks_that_the_surface_reaches_are_added() {
        let places = ball(DVec3::splat(2.0), 1.2);
        let count = |speed: f64| {
            let (level, drift) = with(&places, |_| speed * DVec3::X);
            let entries = &drift.table[..level.table.len()];
            for (found, before) in entries.iter().zip(&level.table) {
                match (found & HALO[0] > 0, found & HALO[1] > 0) {
                    (false, false) => assert_eq!(found, before),
                    (is_dry, _) => assert_eq!(*before, u32::from(!is_dry)),
                }
            }
            let halo = entries.iter().filter(|entry| **entry >= HALO[0]).count();
            let held = level.values.len() / VALUES;
            assert_eq!(drift.table.len(), entries.len() + (held + halo) * WORDS);
            halo
        };
        let [slow, fast] = [0.0, 20.0].map(count);
        assert!(slow == 0 && fast > 20, "{slow} {fast}");
    }

    #[test]
    fn a_lattice_without_water_is_empty() {
        let (level, drift) = with(&[], |_| DVec3::X);
        assert_eq!((drift.table, drift.speed), (level.table, 0.0));
    }
}
