//! Which particles are thrown clear of the water, and how much air is in the rest.
//!
//! What decides is the weight of a particle's neighbours, which changes steadily as they come and go, over the frames around it:
//! their mean weight says how much of the particle is spray, without a step, and which side of the threshold it was on in five frames
//! says whether it belongs to the body, so that none changes there and back from frame to frame to frame.

use rayon::prelude::*;

use super::{
    moment::{Ids, Moment, REACH},
    neighbors::smoothstep,
    uniform::Particle,
};
use crate::scene::look::SpraySpec;

/// Neighbours within two spacings below which a particle is spray (Ihmsen 2012, section 3.3).
const SPRAY_BELOW: f32 = 6.0;
/// Weights between which a particle goes over from all spray to all water.
const TORN: [f32; 2] = [4.0, 8.0];
/// Neighbours of a particle at a calm surface: the lattice's half space has 20, its bulk 32.
const SURFACE_BELOW: f32 = 24.0;
/// Part of its water's volume that drops of thrown water hold: it is mostly air.
const THROWN: f32 = 0.15;
/// Of water that is white and not thrown.
const WHITE: f32 = 0.5;
/// Frames before, at and after: of numbers that go to and fro from frame to frame, nothing is left.
const OVER_TIME: [f32; 2 * REACH as usize + 1] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];

/// A particle's neighbours over the frames around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Standing {
    /// Mean weight.
    pub(super) weight: f32,
    /// Whether it belongs to the body.
    pub(super) is_body: bool,
}

/// Of each particle of a frame. Where a frame is missing, or a particle is not in it, the next one towards the frame itself stands for
/// it.
pub(super) fn standing(moment: &Moment<'_>, spacing: f32) -> Vec<Standing> {
    let own = moment.water.weights(spacing);
    let ids = Ids::of(&moment.water.particles);
    let around = moment.around.map(|water| {
        let water = water?;
        Some((Ids::of(&water.particles), water.weights(spacing)))
    });
    (0..own.len())
        .into_par_iter()
        .map(|index| {
            let id = ids.id(index);
            let in_frame = |k: usize| {
                let (ids, weights) = around[k].as_ref()?;
                Some(weights[ids.find(id)?])
            };
            let here = own[index];
            let before = in_frame(1).unwrap_or(here);
            let after = in_frame(2).unwrap_or(here);
            let first = in_frame(0).unwrap_or(before);
            let last = in_frame(3).unwrap_or(after);
            over_time([first, before, here, after, last])
        })
        .collect()
}

/// Opened and closed by two frames each: a particle belongs to the body for two frames or more at a time, and is spray for two or
/// more, whatever its neighbours do.
fn over_time(weights: [f32; 5]) -> Standing {
    let inside = weights.map(|weight| weight >= SPRAY_BELOW);
    let pair = |k: usize| inside[k] && inside[k + 1];
    let opened = |k: usize| pair(k - 1) || pair(k);
    let is_body = (opened(1) || opened(2)) && (opened(2) || opened(3));
    let weight = weights
        .iter()
        .zip(OVER_TIME)
        .map(|(w, part)| w * part)
        .sum();
    Standing { weight, is_body }
}

/// Gives particles their air, the radius of what of them belongs to the surface, and tag bit 0: cleared for those that were thrown
/// clear. Air at the surface grows from the look's speed to twice that.
pub(super) fn classify(particles: &mut [Particle], standing: &[Standing], look: &SpraySpec) {
    let onset = look.speed_m_per_s as f32;
    (particles.par_iter_mut().zip(standing)).for_each(|(particle, standing)| {
        let weight = standing.weight;
        let [x, y, z] = particle.velocity;
        let speed = (x * x + y * y + z * z).sqrt();
        let open = 1.0 - smoothstep(SPRAY_BELOW, SURFACE_BELOW, weight);
        // A film at rest has as few neighbours as a shred in flight: without speed, none of them whitens.
        let shred = 1.0 - smoothstep(SPRAY_BELOW, 2.0 * SPRAY_BELOW, weight);
        let white = smoothstep(onset, 2.0 * onset, speed) * open
            + 0.3 * smoothstep(0.5 * onset, onset, speed) * shred;
        let body = smoothstep(TORN[0], TORN[1], weight);
        let air = body * WHITE * white + (1.0 - body) * THROWN;
        particle.air = packed(air, body.cbrt());
        if !standing.is_body {
            particle.tag &= !1;
        }
    });
}

/// Of water without air that is all body.
pub(super) const CLEAR: u32 = 0xffff_0000;

/// Two parts of 1, of 16 bits each: the lower one is of air.
fn packed(air: f32, radius: f32) -> u32 {
    let bits = |part: f32| (part.clamp(0.0, 1.0) * 65535.0).round() as u32;
    bits(air) | bits(radius) << 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{domain::particles::Particles, render::moment::Water};

    fn random() -> impl FnMut() -> f32 {
        let mut seed = 7u32;
        move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0 * 2.0 - 1.0
        }
    }

    /// Whether each is body in five frames that begin at each of a run of weights but the last four.
    fn kinds(run: &[f32], rule: &dyn Fn(&[f32; 5]) -> bool) -> Vec<bool> {
        run.windows(5)
            .map(|w| rule(&[w[0], w[1], w[2], w[3], w[4]]))
            .collect()
    }

    fn flips(kinds: &[bool]) -> usize {
        let there_and_back = |w: &&[bool]| w[0] != w[1] && w[1] != w[2];
        kinds.windows(3).filter(there_and_back).count()
    }

    #[test]
    fn none_changes_there_and_back() {
        let mut random = random();
        let (mut steady, mut today, mut changes) = (0, 0, 0);
        for _ in 0..2000 {
            let run: Vec<f32> = (0..24).map(|_| SPRAY_BELOW + 2.0 * random()).collect();
            let now = kinds(&run, &|w| over_time(*w).is_body);
            steady += flips(&now);
            changes += now.windows(2).filter(|w| w[0] != w[1]).count();
            // The control: the frame's own neighbours alone.
            today += flips(&kinds(&run, &|w| w[2] >= SPRAY_BELOW));
        }
        assert_eq!(steady, 0);
        // Half of all frames in between, of numbers that are drawn anew each frame.
        assert!(today > 2000 * 4, "{today}");
        // And yet it changes where that lasts.
        assert!(changes > 2000, "{changes}");
    }

    /// Every run of ten frames that are above and below, all 1024 of them.
    #[test]
    fn none_of_all_runs_changes_there_and_back() {
        for bits in 0u32..1024 {
            let run: Vec<f32> = (0..10)
                .map(|k| if bits >> k & 1 == 1 { 9.0 } else { 3.0 })
                .collect();
            let now = kinds(&run, &|w| over_time(*w).is_body);
            assert_eq!(flips(&now), 0, "{bits:010b}");
        }
        // What stays stays, and a change that lasts is there in its own frame.
        let lasting = [3.0, 3.0, 3.0, 9.0, 9.0, 9.0, 9.0];
        assert_eq!(
            kinds(&lasting, &|w| over_time(*w).is_body),
            [false, true, true]
        );
    }

    /// A weight that goes to and fro from frame to frame leaves no trace in the mean.
    #[test]
    fn the_mean_weight_is_steady() {
        let mean = |shift: f32| {
            let weights = [1.0, -1.0, 1.0, -1.0, 1.0].map(|sign| 6.0 + shift * sign);
            over_time(weights).weight
        };
        assert!((mean(2.0) - mean(-2.0)).abs() < 1e-5);
        assert!((mean(2.0) - 6.0).abs() < 1e-5);
    }

    fn at(position: [f32; 3], speed: f32) -> Particle {
        Particle {
            position,
            air: CLEAR,
            velocity: [speed, 0.0, 0.0],
            tag: 1,
        }
    }

    fn air(particle: &Particle) -> f32 {
        (particle.air & 0xffff) as f32 / 65535.0
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
        let water = Water::new(Particles {
            position: particles.iter().map(|p| p.position).collect(),
            velocity: particles.iter().map(|p| p.velocity).collect(),
            id: (0..1001).collect(),
            ..Particles::default()
        });
        let white = Particles::default();
        let standing = standing(&Moment::alone(&water, &white), 0.1);
        classify(&mut particles, &standing, &look);
        let drop = particles[1000];
        assert_eq!((drop.tag, drop.air >> 16), (0, 0));
        assert!((air(&drop) - THROWN).abs() < 1e-4);
        assert!(particles[..1000].iter().all(|p| p.tag == 1));
        // A corner of the lattice has 3 and 3 and 1 neighbours: it is torn a little.
        let calm = |p: &&Particle| p.air == CLEAR;
        assert!(particles[..1000].iter().filter(calm).count() >= 992);
        // The same face at twice the onset is white.
        for particle in &mut particles {
            particle.velocity = [6.0, 0.0, 0.0];
        }
        classify(&mut particles, &standing, &look);
        assert!(air(&particles[55]) > 0.01);
    }
}
