//! Which particles stand behind others wherever the eye is above the water, so that splats of depth leave them out.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{aeration::is_whole, uniform::Particle};

/// Edge of a cell, particle spacings: at rest 8 particles are in one.
const CELL: f64 = 2.0;
/// Particles of the body in a cell from which on it is full.
const FULL: u8 = 5;

/// Cells over the domain, and how many particles of the body are in each.
struct Cells {
    edge: f32,
    counts: [i64; 3],
    particles: Vec<u8>,
}

impl Cells {
    fn of(particles: &[Particle], size: DVec3, spacing: f64) -> Self {
        let counts = (size / (CELL * spacing)).ceil().max(DVec3::ONE).to_array();
        let counts = counts.map(|n| n as i64);
        let mut cells = Self {
            edge: (CELL * spacing) as f32,
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
        (Vec3::from(particle.position) / self.edge)
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
        if self.index([x, y, z]).is_none() {
            return false;
        }
        let mut around = (-1..=1).flat_map(|dz| (-1..=1).map(move |dy| (dy, dz)));
        around.all(|(dy, dz)| (-1..=1).all(|dx| self.is_full([x + dx, y + dy, z + dz])))
    }
}

/// Of each particle, whether water hides it: all cells about its own are full of whole particles. Places are metres from the least
/// corner of a domain of `size`; `spacing` lies between neighbours at rest, metres.
///
/// Two spacings of water at least lie between it and the air, and a splat reaches 1.25 spacings at most.
pub(super) fn hidden(particles: &[Particle], size: DVec3, spacing: f64) -> Vec<bool> {
    let cells = Cells::of(particles, size, spacing);
    (particles.par_iter())
        .map(|particle| is_whole(particle) && cells.is_deep(cells.cell(particle)))
        .collect()
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
        let found = hidden(&particles, size, 1.0);
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

    #[test]
    fn a_bubble_and_torn_water_hide_nothing() {
        let middle = DVec3::new(20.0, 10.0, 20.0);
        let (particles, size) = block(|p| p.distance(middle) > 3.0);
        let found = hidden(&particles, size, 1.0);
        let about = |p: &Particle| Vec3::from(p.position).as_dvec3().distance(middle);
        let walls = particles.iter().zip(&found).filter(|(p, _)| about(p) < 4.0);
        assert!(walls.clone().count() > 100 && walls.clone().all(|(_, hidden)| !hidden));
        let (mut torn, size) = block(|_| true);
        for particle in &mut torn {
            particle.air = 0xffbf_0000;
        }
        assert!(hidden(&torn, size, 1.0).iter().all(|hidden| !hidden));
        let (mut thrown, size) = block(|_| true);
        for particle in &mut thrown {
            particle.tag = 0;
        }
        assert!(hidden(&thrown, size, 1.0).iter().all(|hidden| !hidden));
    }
}
