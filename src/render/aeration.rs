//! Classifies particles as spray or body of water, and estimates the air each of them holds.
//!
//! Both follow from the weight of a particle's neighbours, which changes smoothly as they come and
//! go, over the five frames around it. The mean weight gives a continuous measure of how much of
//! the particle is spray. The side of the threshold that the weight is on in each of the five
//! frames decides whether the particle belongs to the body, so that no particle flips back and
//! forth between consecutive frames.

use glam::{DVec3, Vec3};

use super::{
    RenderScene,
    inputs::{FrameInputs, Ids, REACH},
    neighbors::smoothstep,
    uniform::Particle,
};
use swell_domain::parallel;
use swell_scene::look::SpraySpec;

/// Weight of neighbours within two spacings below which a particle is spray (Ihmsen 2012, section
/// 3.3).
const SPRAY_BELOW: f32 = 6.0;
/// Weights over which a particle blends from all spray to all water.
const TORN: [f32; 2] = [4.0, 8.0];
/// Upper weight of a particle at an open surface. At a calm surface, the half space of the lattice
/// gives 20 neighbours; the bulk has 32.
const SURFACE_BELOW: f32 = 24.0;
/// Air fraction of thrown water relative to full white: a drop stands for mostly air.
const THROWN: f32 = 0.15;
/// Air fraction of white water that belongs to the body.
const WHITE: f32 = 0.5;
/// Weights of the two frames before, the frame itself and the two after. The binomial filter
/// removes oscillations from frame to frame entirely.
const OVER_TIME: [f32; 2 * REACH as usize + 1] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];

/// Distance of a particle's acceleration from gravity, in units of gravity: at the first value the
/// particle is in flight, at the second it is not. A particle at rest has 1.
const FLIGHT: [f32; 2] = [0.5, 1.0];

/// State of a particle over the frames around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Standing {
    /// Mean weight of its neighbours.
    pub(super) weight: f32,
    /// Whether it belongs to the body of water rather than to spray.
    pub(super) is_body: bool,
    /// Degree to which it is in free flight, 0 to 1: moved by nothing but gravity.
    pub(super) flight: f32,
}

/// Gravity and the level of the water at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fall {
    /// Gravity, m/s².
    gravity: Vec3,
    /// Potential −g·x of the water's surface at rest, x from the domain's least corner, m²/s².
    level: f32,
    seconds: f32,
    spacing: f32,
}

impl Fall {
    /// Estimates the level of `particles` particles as that of a box filled to one height against
    /// gravity; the volume of solids is ignored.
    pub(super) fn of(scene: &RenderScene, particles: usize) -> Self {
        let size = scene.domain.size();
        let down = scene.gravity;
        let filled = particles as f64 * scene.particle_spacing.powi(3) / size.element_product();
        let lowest = (-down * size).min(DVec3::ZERO).element_sum();
        let level = lowest + (down * size).abs().element_sum() * filled.min(1.0);
        Self {
            gravity: down.as_vec3(),
            level: level as f32,
            seconds: (1.0 / scene.frames_per_second) as f32,
            spacing: scene.particle_spacing as f32,
        }
    }

    /// Degree to which a particle is in free flight, from its velocities at both ends of `frames`
    /// frame intervals.
    fn flight(&self, [before, after]: [[f32; 3]; 2], frames: usize) -> f32 {
        let pull = self.gravity.length();
        if frames == 0 || pull == 0.0 {
            return 0.0;
        }
        let acceleration =
            (Vec3::from(after) - Vec3::from(before)) / (self.seconds * frames as f32);
        1.0 - smoothstep(
            FLIGHT[0],
            FLIGHT[1],
            (acceleration - self.gravity).length() / pull,
        )
    }

    /// Speed, m/s, with which a flying particle passes the height of the water at rest
    /// (Torricelli); its own speed below that height and where it does not fly.
    fn speed(&self, particle: &Particle, flight: f32) -> f32 {
        let above = -self.gravity.dot(particle.position.into()) - self.level;
        let own = Vec3::from(particle.velocity).length_squared();
        (own + 2.0 * flight * above.max(0.0)).sqrt()
    }
}

/// Computes the state of each particle of a frame. Where a frame is missing or lacks the particle,
/// the nearest frame towards the current one takes its place.
pub(super) fn standing(inputs: &FrameInputs<'_>, fall: &Fall) -> Vec<Standing> {
    let own = inputs.water.weights(fall.spacing);
    let ids = Ids::of(&inputs.water.particles);
    let around = inputs.around.map(|water| {
        let water = water?;
        let particles = &water.particles;
        Some((
            Ids::of(particles),
            water.weights(fall.spacing),
            &particles.velocity,
        ))
    });
    parallel::map(0..own.len(), |index| {
        let id = ids.id(index);
        let here = (own[index], inputs.water.particles.velocity[index], 0);
        let or = |k: usize, near: (f32, [f32; 3], usize)| {
            let found = around[k].as_ref().and_then(|(ids, weights, velocities)| {
                let place = ids.find(id)?;
                Some((weights[place], velocities[place], near.2 + 1))
            });
            found.unwrap_or(near)
        };
        let [before, after] = [or(1, here), or(2, here)];
        let [first, last] = [or(0, before), or(3, after)];
        let weights = [first, before, here, after, last].map(|it| it.0);
        Standing {
            flight: fall.flight([first.1, last.1], first.2 + last.2),
            ..over_time(weights)
        }
    })
}

/// Filters the neighbour weights of five frames. Membership of the body is opened and closed with
/// two frames each: a particle is body, or spray, for at least two frames at a time, whatever its
/// neighbours do.
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
    Standing {
        weight,
        is_body,
        flight: 0.0,
    }
}

/// Sets the air of particles and the radius of their share of the surface, and clears tag bit 0 of
/// those that were thrown clear. Air at the surface grows between the look's onset speed and twice
/// that. A particle in flight counts with the speed it was thrown at: it took up its air then, and
/// slows as it rises without losing that air.
pub(super) fn classify(
    particles: &mut [Particle],
    standing: &[Standing],
    look: &SpraySpec,
    fall: &Fall,
) {
    let onset = look.speed_m_per_s as f32;
    parallel::for_each_mut(particles, |k, particle| {
        let standing = &standing[k];
        let weight = standing.weight;
        let speed = fall.speed(particle, standing.flight);
        let open = 1.0 - smoothstep(SPRAY_BELOW, SURFACE_BELOW, weight);
        // A film at rest has as few neighbours as a shred in flight; the speed keeps it from
        // whitening.
        let shred = 1.0 - smoothstep(SPRAY_BELOW, 2.0 * SPRAY_BELOW, weight);
        let white = smoothstep(onset, 2.0 * onset, speed) * open
            + 0.3 * smoothstep(0.5 * onset, onset, speed) * shred;
        let body = smoothstep(TORN[0], TORN[1], weight);
        let air = body * WHITE * white + (1.0 - body) * THROWN;
        let company = smoothstep(0.0, TORN[0], weight);
        particle.air = packed(air, company, body.cbrt());
        if !standing.is_body {
            particle.tag &= !1;
        }
    });
}

/// Value of `air` for water without air that belongs wholly to the body.
pub(super) const CLEAR: u32 = 0xffff_0000;

/// Mask of the bits of `air` that hold the particle's radius in the surface.
const RADIUS: u32 = 0xffc0_0000;

/// Whether the particle belongs to the body and is drawn at full size.
pub(super) fn is_whole(particle: &Particle) -> bool {
    particle.tag & 1 == 1 && particle.air & RADIUS == RADIUS
}

/// Packs three fractions of 1: 16 bits of air, 6 of company (0 for a lone particle, 1 from a
/// neighbour weight of `TORN[0]` on), 10 of the radius.
fn packed(air: f32, company: f32, radius: f32) -> u32 {
    let bits = |part: f32, most: f32| (part.clamp(0.0, 1.0) * most).round() as u32;
    bits(air, 65535.0) | bits(company, 63.0) << 16 | bits(radius, 1023.0) << 22
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inputs::WaterParticles;
    use swell_domain::particles::Particles;

    fn random() -> impl FnMut() -> f32 {
        let mut seed = 7u32;
        move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0 * 2.0 - 1.0
        }
    }

    /// Whether the particle is body, for each window of five frames in a run of weights.
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
            // Control: the frame's own neighbours only.
            today += flips(&kinds(&run, &|w| w[2] >= SPRAY_BELOW));
        }
        assert_eq!(steady, 0);
        // With independent random weights, about half of all frames flip.
        assert!(today > 2000 * 4, "{today}");
        // A change that lasts still comes through.
        assert!(changes > 2000, "{changes}");
    }

    /// Checks all 1024 runs of ten frames that are above or below the threshold.
    #[test]
    fn none_of_all_runs_changes_there_and_back() {
        for bits in 0u32..1024 {
            let run: Vec<f32> = (0..10)
                .map(|k| if bits >> k & 1 == 1 { 9.0 } else { 3.0 })
                .collect();
            let now = kinds(&run, &|w| over_time(*w).is_body);
            assert_eq!(flips(&now), 0, "{bits:010b}");
        }
        // A steady state stays, and a lasting change takes effect in its own frame.
        let lasting = [3.0, 3.0, 3.0, 9.0, 9.0, 9.0, 9.0];
        assert_eq!(
            kinds(&lasting, &|w| over_time(*w).is_body),
            [false, true, true]
        );
    }

    /// A weight that alternates from frame to frame leaves no trace in the mean.
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

    #[test]
    fn three_parts_share_a_word() {
        let word = packed(0.25, 1.0 / 3.0, 0.75);
        assert_eq!(word & 0xffff, 16384);
        assert_eq!(word >> 16 & 63, 21);
        assert_eq!(word >> 22, 767);
        assert_eq!(packed(0.0, 1.0, 1.0), CLEAR);
        // A neighbour weight of half the upper bound of `TORN` gives half the company.
        let mut particle = [at([0.0; 3], 0.0)];
        let standing = [Standing {
            weight: 0.5 * TORN[0],
            is_body: false,
            flight: 0.0,
        }];
        let look = SpraySpec {
            density_per_metre: 1.0,
            speed_m_per_s: 3.0,
        };
        classify(&mut particle, &standing, &look, &still(0.1));
        assert_eq!(particle[0].air >> 16, 32);
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
        let fall = still(0.1);
        let water = WaterParticles::new(Particles {
            position: particles.iter().map(|p| p.position).collect(),
            velocity: particles.iter().map(|p| p.velocity).collect(),
            id: (0..1001).collect(),
            ..Particles::default()
        });
        let white = Particles::default();
        let standing = standing(&FrameInputs::alone(&water, &white), &fall);
        classify(&mut particles, &standing, &look, &fall);
        let drop = particles[1000];
        assert_eq!((drop.tag, drop.air >> 16), (0, 0));
        assert!((air(&drop) - THROWN).abs() < 1e-4);
        assert!(particles[..1000].iter().all(|p| p.tag == 1));
        // Particles at the lattice's corners have 7 neighbours and are slightly torn.
        let calm = |p: &&Particle| p.air == CLEAR;
        assert!(particles[..1000].iter().filter(calm).count() >= 992);
        // The same face at twice the onset speed is white.
        for particle in &mut particles {
            particle.velocity = [6.0, 0.0, 0.0];
        }
        classify(&mut particles, &standing, &look, &fall);
        assert!(air(&particles[55]) > 0.01);
    }

    fn still(spacing: f32) -> Fall {
        Fall {
            gravity: Vec3::new(0.0, -10.0, 0.0),
            level: 10.0,
            seconds: 0.05,
            spacing,
        }
    }

    /// Mean air of a shred of water, 3 m high, under a constant acceleration over the frames around
    /// it: with all four neighbouring frames, and with none.
    fn air_of_a_shred(velocity: [f32; 3], acceleration: [f32; 3]) -> [f32; 2] {
        let fall = still(0.1);
        let position: Vec<[f32; 3]> = (0..27)
            .map(|i| [i % 3, i / 3 % 3, i / 9].map(|x| x as f32 * 0.1))
            .map(|[x, y, z]| [x, y + 3.0, z])
            .collect();
        let at_frame = |k: f32| {
            let v = [0, 1, 2].map(|axis| velocity[axis] + k * fall.seconds * acceleration[axis]);
            WaterParticles::new(Particles {
                position: position.clone(),
                velocity: vec![v; position.len()],
                id: (0..position.len() as u32).collect(),
                ..Particles::default()
            })
        };
        let frames = [-2.0, -1.0, 0.0, 1.0, 2.0].map(at_frame);
        let [first, before, water, after, last] = &frames;
        let white = Particles::default();
        let alone = FrameInputs::alone(water, &white);
        let around = FrameInputs {
            around: [first, before, after, last].map(Some),
            ..alone
        };
        let look = SpraySpec {
            density_per_metre: 1.0,
            speed_m_per_s: 3.0,
        };
        [around, alone].map(|inputs| {
            let mut packed: Vec<_> = position.iter().map(|&p| at(p, 0.0)).collect();
            for particle in &mut packed {
                particle.velocity = velocity;
            }
            classify(&mut packed, &standing(&inputs, &fall), &look, &fall);
            packed.iter().map(air).sum::<f32>() / packed.len() as f32
        })
    }

    /// Thrown water stays white at the top of its flight, where it hardly moves; a film at rest at
    /// the same height is clear.
    #[test]
    fn water_keeps_its_air_as_it_flies() {
        let flying = [0.0, -10.0, 0.0];
        let [top, unknown] = air_of_a_shred([0.0; 3], flying);
        let [resting, _] = air_of_a_shred([0.0; 3], [0.0; 3]);
        assert_eq!(resting, unknown);
        assert!(top > resting + 0.03, "{top} {resting}");
        // Its air is that of water 2 m below, where it was thrown at √(2 · 10 · 2) m/s.
        let speed = still(0.1).speed(&at([0.0, 3.0, 0.0], 0.0), 1.0);
        assert!((speed - 40f32.sqrt()).abs() < 1e-5, "{speed}");
    }

    /// The level is the height to which water fills the box, for any direction of gravity.
    #[test]
    fn water_rests_where_its_box_is_filled_to() {
        let scene = |gravity: DVec3| RenderScene {
            origin: DVec3::ZERO,
            domain: swell_domain::bounds::Bounds {
                min: DVec3::new(-1.0, 2.0, 0.0),
                max: DVec3::new(3.0, 4.0, 5.0),
            },
            solids: Vec::new(),
            wet: None,
            parts: Vec::new(),
            particle_spacing: 0.5,
            frames_per_second: 24.0,
            gravity,
            wave_makers: Vec::new(),
            moving: Vec::new(),
            waves: None,
        };
        // 80 particles of 0.125 m³ fill a quarter of 40 m³: half a metre of 2 m, 1 m of 4 m.
        let level = |gravity| Fall::of(&scene(gravity), 80).level;
        assert!((level(DVec3::new(0.0, -10.0, 0.0)) - 5.0).abs() < 1e-5);
        assert!((level(DVec3::new(10.0, 0.0, 0.0)) + 30.0).abs() < 1e-5);
        assert_eq!(level(DVec3::ZERO), 0.0);
    }
}
