//! Births: how many whitewater particles each water particle emits, and where they begin.

use glam::{DVec3, Vec3};

use super::{
    AGE, AIR_BELOW, CompleteSettings, KIND, LIFE, Potentials, RADIUS, WhitewaterKind, random,
    thresholds::grown,
};
use crate::{bounds::Bounds, parallel, particles::Particles, period::Period};

/// Random channels reserved per birth.
const CHANNELS: u32 = 8;

/// Water at a frame's end.
#[derive(Clone, Copy, Debug)]
pub struct SeedWater<'a> {
    /// The water's particles.
    pub water: &'a Particles,
    /// Potentials of each particle.
    pub potentials: &'a [Potentials],
    /// Frame number.
    pub frame: u32,
    /// Time since the previous frame, seconds.
    pub seconds: f64,
    /// Particle spacing, metres.
    pub spacing: f64,
    /// Gravity, m/s².
    pub gravity: f64,
    /// The domain's box at this time, with wave makers at their positions.
    pub walls: Bounds,
    /// The domain's least corner, metres.
    pub corner: DVec3,
    /// Periods of the domain.
    pub period: Period,
}

/// Particles born at a frame.
#[derive(Clone, Debug, Default)]
pub struct Births {
    born: Vec<Born>,
}

#[derive(Clone, Copy, Debug)]
struct Born {
    position: Vec3,
    velocity: Vec3,
    kind: WhitewaterKind,
    life: f32,
    radius: f32,
}

impl Births {
    /// Emits n = Φ_ke (k_ta Φ_ta u d² + k_wc Φ_wc d³) Δt whitewater particles per water particle,
    /// with stochastic rounding: after Ihmsen 2012, eq. 8, whose rates are of a particle, but of
    /// what a particle stands for. At the surface it stands for an area d², which closes the volume
    /// u d² a second where it meets water at the speed u, as the air that a plunging jet entrains
    /// grows with its area and its speed (Kiger and Duncan 2012); in a crest for the volume d³.
    ///
    /// They begin in a cylinder around its position along its velocity, with a radius and a length
    /// of half a spacing; the paper's length, the distance moved in a frame, would lead ahead of
    /// the water.
    pub fn of(settings: &CompleteSettings, source: &SeedWater<'_>) -> Self {
        let n = source.water.len();
        let born = parallel::flat_map(0..n, |i| {
            let (potential, strength) = strength(settings, source, &source.potentials[i]);
            let id = source.water.id[i];
            let chance = random(settings.seed, id, source.frame, 0);
            let count = (strength + chance).floor() as u32;
            (0..count).map(move |k| seed(settings, source, i, potential, 1 + k * CHANNELS))
        });
        Self { born }
    }

    /// Returns the number of births.
    pub fn len(&self) -> usize {
        self.born.len()
    }

    /// Returns whether there are no births.
    pub fn is_empty(&self) -> bool {
        self.born.is_empty()
    }

    /// Appends the new particles with ids from `next` on, and returns the next free id.
    pub fn join(&self, particles: &mut Particles, next: u32) -> u32 {
        let born = &self.born;
        particles
            .position
            .extend(born.iter().map(|b| b.position.to_array()));
        particles
            .velocity
            .extend(born.iter().map(|b| b.velocity.to_array()));
        particles.id.extend((next..).take(born.len()));
        let mut extend = |name: &str, of: &dyn Fn(&Born) -> f32| {
            let column = particles.attributes.entry(name.to_owned()).or_default();
            column.extend(born.iter().map(of));
        };
        extend(AGE, &|_| 0.0);
        extend(KIND, &|b| b.kind.number());
        extend(LIFE, &|b| b.life);
        extend(RADIUS, &|b| b.radius);
        next + born.len() as u32
    }
}

/// Strength of the stronger of the two causes, 0 to 1, and expected number of births.
fn strength(
    settings: &CompleteSettings,
    source: &SeedWater<'_>,
    potentials: &Potentials,
) -> (f64, f64) {
    let (thresholds, d) = (&settings.thresholds, source.spacing);
    // A drop in the air traps none.
    let trapped_air = match potentials.share < AIR_BELOW {
        true => 0.0,
        false => grown(
            potentials.steepness(d, source.gravity),
            thresholds.trapped_air,
        ),
    };
    let wave_crest = grown(potentials.wave_crest, thresholds.wave_crest);
    let energy = grown(potentials.energy, thresholds.energy);
    let closed = trapped_air * potentials.trapped_air * d * d;
    let rate =
        settings.trapped_air_rate * closed + settings.wave_crest_rate * wave_crest * d.powi(3);
    (
        energy * trapped_air.max(wave_crest),
        energy * rate * source.seconds,
    )
}

fn seed(
    settings: &CompleteSettings,
    source: &SeedWater<'_>,
    i: usize,
    potential: f64,
    channel: u32,
) -> Born {
    let random = |k: u32| random(settings.seed, source.water.id[i], source.frame, channel + k);
    let (x, v) = (
        Vec3::from_array(source.water.position[i]).as_dvec3(),
        Vec3::from_array(source.water.velocity[i]).as_dvec3(),
    );
    let along = v.try_normalize().unwrap_or(DVec3::Y);
    let (across, aside) = along.any_orthonormal_pair();
    let (sin, cos) = (std::f64::consts::TAU * random(0)).sin_cos();
    // Uniform over the disc.
    let r = 0.5 * source.spacing * random(1).sqrt();
    let offset =
        r * (cos * across + sin * aside) + 0.5 * source.spacing * (random(2) - 0.5) * along;
    let inside = (x + offset).clamp(source.walls.min, source.walls.max);
    let between = |[least, greatest]: [f64; 2], part: f64| least + (greatest - least) * part;
    // Stronger causes give foam with a longer life (Ihmsen 2012, section 3.3).
    let life = between(settings.lifetime, potential * random(3));
    let place = source.period.wrap(inside - source.corner) + source.corner;
    Born {
        position: place.as_vec3(),
        velocity: v.as_vec3(),
        kind: WhitewaterKind::of_share(source.potentials[i].share),
        life: life as f32,
        // Most are small: the square puts the mean at a third of the range.
        radius: between(settings.radius, random(4).powi(2)) as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{none, tests_support::settings};
    use super::*;

    fn water(count: u32) -> Particles {
        Particles {
            position: vec![[0.5; 3]; count as usize],
            velocity: vec![[3.0, 0.0, 0.0]; count as usize],
            id: (0..count).collect(),
            ..Particles::default()
        }
    }

    fn source<'a>(water: &'a Particles, potentials: &'a [Potentials]) -> SeedWater<'a> {
        SeedWater {
            water,
            potentials,
            frame: 3,
            seconds: 0.04,
            spacing: 0.1,
            gravity: 10.0,
            walls: Bounds {
                min: DVec3::ZERO,
                max: DVec3::ONE,
            },
            corner: DVec3::ZERO,
            period: Period::default(),
        }
    }

    /// Water at 3 m/s that meets water at this speed.
    fn potentials(count: usize, trapped_air: f64) -> Vec<Potentials> {
        vec![
            Potentials {
                trapped_air,
                wave_crest: 0.0,
                energy: 4.5,
                share: 0.5,
            };
            count
        ]
    }

    /// Rate times closed volume, within four standard errors of as many coin flips.
    #[test]
    fn births_follow_the_rate() {
        let water = water(4000);
        let settings = settings();
        let born = |of: &[Potentials]| Births::of(&settings, &source(&water, of)).len() as f64;
        // 0.5 m/s on 0.01 m² close 2e-4 m³ in 0.04 s, of which 0.5 are born: 0.5 · 3 / (0.1 · 10)
        // is far above the limiting steepness.
        let count = born(&potentials(4000, 0.5));
        let expected = settings.trapped_air_rate * 0.5 * 0.01 * 0.04 * 4000.0;
        assert_eq!(expected, 2000.0);
        assert!(
            (count - expected).abs() < 4.0 * (0.25 * 4000f64).sqrt(),
            "{count}"
        );
        // At 0.05 m/s it is 0.15, half of the way up.
        let count = born(&potentials(4000, 0.05));
        assert!((count - 100.0).abs() < 4.0 * 10.0, "{count}");
        // Nothing is born of a slope that waves keep, without energy, and of a drop.
        assert_eq!(born(&potentials(4000, 0.033)), 0.0);
        let mut slow = potentials(4000, 0.5);
        slow.iter_mut()
            .for_each(|p| p.energy = settings.thresholds.energy[0]);
        assert_eq!(born(&slow), 0.0);
        let mut drops = potentials(4000, 0.5);
        drops.iter_mut().for_each(|p| p.share = 0.1);
        assert_eq!(born(&drops), 0.0);
        // Crests: 5e4 of 1e-3 m³ in 0.04 s are 2.
        let mut crests = potentials(4000, 0.0);
        crests
            .iter_mut()
            .for_each(|p| p.wave_crest = settings.thresholds.wave_crest[1]);
        assert_eq!(born(&crests), 8000.0);
    }

    /// An area at which water meets water, and a volume of crests, have the same births at three
    /// spacings, within four standard errors.
    #[test]
    fn births_do_not_depend_on_the_spacing() {
        let settings = settings();
        let born = |d: f64, crest: f64, count: f64| {
            let water = water(count as u32);
            let one = Potentials {
                trapped_air: 0.8,
                wave_crest: crest,
                energy: 4.5,
                share: 0.5,
            };
            let potentials = vec![one; water.len()];
            let source = SeedWater {
                spacing: d,
                ..source(&water, &potentials)
            };
            Births::of(&settings, &source).len() as f64
        };
        for d in [0.2, 0.1, 0.05] {
            // 10 m²: 2500 · 0.8 · 10 · 0.04 = 800.
            let of_area = born(d, 0.0, 10.0 / (d * d));
            assert!(
                (of_area - 800.0).abs() < 4.0 * 800f64.sqrt(),
                "{d}: {of_area}"
            );
            // 2 m³ of crests, of which the area closes its part too.
            let of_volume = born(d, settings.thresholds.wave_crest[1], 2.0 / (d * d * d));
            let crests = 5e4 * 2.0 * 0.04 + 2500.0 * 0.8 * 2.0 / d * 0.04;
            assert!(
                (of_volume - crests).abs() < 4.0 * crests.sqrt(),
                "{d}: {of_volume} {crests}"
            );
        }
    }

    #[test]
    fn births_are_about_their_water_with_ids_of_their_own() {
        let water = water(50);
        let settings = settings();
        let full = potentials(50, 1.0);
        let births = Births::of(&settings, &source(&water, &full));
        let mut all = none();
        let next = births.join(&mut all, 7);
        assert_eq!(next, 7 + births.len() as u32);
        assert_eq!(all.id, (7..next).collect::<Vec<_>>());
        assert!(
            all.attributes
                .values()
                .all(|column| column.len() == all.len())
        );
        for (k, x) in all.position.iter().enumerate() {
            let offset = Vec3::from_array(*x) - Vec3::splat(0.5);
            // Across the velocity up to half a spacing, along it a quarter.
            assert!(
                offset.x.abs() <= 0.0251 && offset.length() < 0.06,
                "{offset}"
            );
            let (life, radius) = (all.attributes[LIFE][k], all.attributes[RADIUS][k]);
            let within =
                |value: f32, [least, most]: [f64; 2]| (least as f32..=most as f32).contains(&value);
            assert!(within(life, settings.lifetime) && within(radius, settings.radius));
        }
        // The result is reproducible, and differs for another seed.
        let again = Births::of(&settings, &source(&water, &full));
        let mut twice = none();
        again.join(&mut twice, 7);
        assert_eq!(all, twice);
        let other = CompleteSettings {
            seed: 9,
            ..settings.clone()
        };
        let mut others = none();
        Births::of(&other, &source(&water, &full)).join(&mut others, 7);
        assert_ne!(all.position[0], others.position[0]);
    }
}
