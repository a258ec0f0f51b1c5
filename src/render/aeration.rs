//! Which particles are thrown clear of the water, and how much air is in the rest.

use rayon::prelude::*;

use super::uniform::Particle;
use crate::scene::look::SpraySpec;

/// Neighbours within two spacings below which a particle is spray (Ihmsen 2012, section 3.3).
const SPRAY_BELOW: f32 = 6.0;
/// Neighbours of a particle at a calm surface: the lattice's half space has 20, its bulk 32.
const SURFACE_BELOW: f32 = 24.0;

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Marks particles: tag bit 0 cleared and `aeration` 1 for those with fewer than six neighbours; for those at the surface
/// aeration that grows from the look's speed to twice that.
pub(super) fn classify(particles: &mut [Particle], spacing: f32, look: &SpraySpec) {
    let counts = neighbour_counts(particles, 2.0 * spacing);
    let onset = look.speed_m_per_s as f32;
    particles
        .par_iter_mut()
        .zip(counts)
        .for_each(|(particle, count)| {
            let count = count as f32;
            if count < SPRAY_BELOW {
                particle.tag &= !1;
                particle.aeration = 1.0;
                return;
            }
            let [x, y, z] = particle.velocity;
            let speed = (x * x + y * y + z * z).sqrt();
            let open = 1.0 - smoothstep(SPRAY_BELOW, SURFACE_BELOW, count);
            // A film at rest has as few neighbours as a shred in flight: without speed, none of them whitens.
            let shred = 1.0 - smoothstep(SPRAY_BELOW, 2.0 * SPRAY_BELOW, count);
            particle.aeration = smoothstep(onset, 2.0 * onset, speed) * open
                + 0.3 * smoothstep(0.5 * onset, onset, speed) * shred;
        });
}

/// How many others lie within `reach` of each; 32 is reported as 32, however many more there are.
fn neighbour_counts(particles: &[Particle], reach: f32) -> Vec<u32> {
    const ENOUGH: u32 = 32;
    let cell = |p: &[f32; 3]| p.map(|x| (x / reach).floor() as i32);
    // Sorted by cell, with z the fastest: three cells of a column are one contiguous run.
    let mut order: Vec<([i32; 3], u32)> = particles
        .par_iter()
        .zip(0u32..particles.len() as u32)
        .map(|(particle, index)| (cell(&particle.position), index))
        .collect();
    order.par_sort_unstable();
    let sorted: Vec<[f32; 3]> = order
        .par_iter()
        .map(|&(_, index)| particles[index as usize].position)
        .collect();
    let found: Vec<(u32, u32)> = order
        .par_iter()
        .enumerate()
        .map(|(place, &([cx, cy, cz], index))| {
            let p = sorted[place];
            let mut count = 0;
            'columns: for dx in -1..=1 {
                for dy in -1..=1 {
                    let first = [cx + dx, cy + dy, cz - 1];
                    let after = [cx + dx, cy + dy, cz + 2];
                    let start = order.partition_point(|&(key, _)| key < first);
                    for (q, entry) in sorted[start..].iter().zip(&order[start..]) {
                        if entry.0 >= after {
                            break;
                        }
                        let d = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
                        let near = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < reach * reach;
                        count += u32::from(near && entry.1 != index);
                        if count >= ENOUGH {
                            break 'columns;
                        }
                    }
                }
            }
            (index, count)
        })
        .collect();
    let mut counts = vec![0; particles.len()];
    for (index, count) in found {
        counts[index as usize] = count;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(position: [f32; 3], speed: f32) -> Particle {
        Particle {
            position,
            aeration: 0.0,
            velocity: [speed, 0.0, 0.0],
            tag: 1,
        }
    }

    #[test]
    fn counts_agree_with_every_pair() {
        let mut seed = 7u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0 * 2.0 - 1.0
        };
        let particles: Vec<_> = (0..300)
            .map(|_| at([random(), random(), random()], 0.0))
            .collect();
        let counts = neighbour_counts(&particles, 0.4);
        for (particle, count) in particles.iter().zip(counts) {
            let p = particle.position;
            let all = particles
                .iter()
                .filter(|other| {
                    let q = other.position;
                    q != p && (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f32>() < 0.16
                })
                .count();
            assert_eq!(count as usize, all.min(32));
        }
    }

    #[test]
    fn lone_drops_are_spray_and_still_water_is_clear() {
        let mut particles: Vec<_> = (0..1000)
            .map(|i| at([i % 10, i / 10 % 10, i / 100].map(|x| x as f32 * 0.1), 0.0))
            .collect();
        particles.push(at([5.0, 5.0, 5.0], 1.0));
        let look = SpraySpec {
            density_per_metre: 1.0,
            speed_m_per_s: 3.0,
        };
        classify(&mut particles, 0.1, &look);
        assert_eq!((particles[1000].tag, particles[1000].aeration), (0, 1.0));
        assert!(particles[..1000].iter().all(|p| p.tag == 1));
        assert!(particles[..1000].iter().all(|p| p.aeration == 0.0));
        // The same face at twice the onset is white.
        for particle in &mut particles {
            particle.velocity = [6.0, 0.0, 0.0];
        }
        classify(&mut particles, 0.1, &look);
        assert!(particles[55].aeration > 0.02);
    }
}
