//! Reference passes of shaders/whitewater in f64, one function per pass with its name, and
//! whitewater on the CPU.

use glam::{DVec3, Vec3};

use swell_domain::{
    air,
    boundary::Boundary,
    bounds::Bounds,
    budget::Breach,
    forces::{ForceField, Medium},
    parallel,
    particles::Particles,
    whitewater::{
        AIR_BELOW, CLOSING, CompleteSettings, FLIGHT_STEPS, HALVINGS, KIND, OUTWARD, Potentials,
        SURFACE, WhitewaterKind,
    },
};
use swell_scene::PbfScene;

use super::{ReferenceError, pbf::Model};

/// Water at a frame's end, sorted by cell, with the walls and solids around it. Positions are
/// relative to the domain's minimum corner.
#[derive(Clone, Debug)]
pub struct SortedWater {
    /// Kernels, boundary samples on solids, cells.
    pub model: Model,
    /// Faces of the box, displaced by wave makers.
    pub walls: Bounds,
    /// Positions, metres. Shape (particles).
    pub points: Vec<DVec3>,
    /// Velocities, m/s. Shape (particles).
    pub velocity: Vec<DVec3>,
    /// Index of each particle in the original water. Shape (particles).
    pub order: Vec<usize>,
    starts: Vec<usize>,
    sample_starts: Vec<usize>,
}

/// Result of whitewater/survey for a water particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surveyed {
    /// Water fraction around it.
    pub share: f64,
    /// Outward unit normal; 0 where the density has no gradient.
    pub normal: DVec3,
    /// Length of the density's gradient times h.
    pub steepness: f64,
    /// Confidence that the particle is at the surface, 0 to 1.
    pub sure: f64,
}

/// A whitewater particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct White {
    /// Position, metres.
    pub position: DVec3,
    /// Velocity, m/s.
    pub velocity: DVec3,
    /// Kind.
    pub kind: WhitewaterKind,
    /// Speed at which it rises as a bubble, m/s.
    pub rise: f64,
}

/// A whitewater particle after a frame, with the margin of the decisions made on its path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// The particle after the frame.
    pub white: White,
    /// Water fraction around it.
    pub share: f64,
    /// Smallest difference between a water fraction that decided something and its threshold.
    pub margin: f64,
    /// Whether a solid pushed it, or may have within rounding.
    pub is_pushed: bool,
}

/// Water around a position.
#[derive(Clone, Copy, Debug)]
struct Found {
    share: f64,
    velocity: DVec3,
}

impl SortedWater {
    /// Takes the water of `scene`, which is
    /// [`of_whitewater`](swell_scene::Scene::of_whitewater) of the baked scene, at `time`,
    /// seconds.
    pub fn new(scene: &PbfScene, boundary: &Boundary, water: &Particles, time: f64) -> Self {
        let mut model = Model::new(scene, boundary);
        model.stand(scene, &water.bodies, time, 0.0);
        let origin = scene.domain.min;
        let wide = |v: &[f32; 3]| Vec3::from_array(*v).as_dvec3();
        // The device holds positions in f32, relative to the same corner.
        let local = |p: &[f32; 3]| (wide(p) - origin).as_vec3().as_dvec3();
        let places: Vec<DVec3> = water.position.iter().map(local).collect();
        let order = model.cells.order(&places, &water.id);
        let points: Vec<DVec3> = order.iter().map(|&k| places[k]).collect();
        Self {
            starts: model.cells.starts(&points),
            sample_starts: model.cells.starts(&model.samples),
            velocity: order.iter().map(|&k| wide(&water.velocity[k])).collect(),
            walls: scene.walls(&water.walls, time),
            model,
            points,
            order,
        }
    }

    /// Calls `visit` with each water particle and each boundary sample in the cells around `x`, and
    /// the vector from it to `x`.
    pub fn about(&self, x: DVec3, mut visit: impl FnMut(Neighbor, DVec3)) {
        let period = self.model.period();
        for cells in self.model.cells.runs(x).iter() {
            for j in self.starts[cells.start]..self.starts[cells.end] {
                visit(Neighbor::Water(j), period.shortest(x - self.points[j]));
            }
            for b in self.sample_starts[cells.start]..self.sample_starts[cells.end] {
                let way = period.shortest(x - self.model.samples[b]);
                visit(Neighbor::Sample(self.model.sample_weights[b]), way);
            }
        }
    }

    fn share_of(&self, kernel: f64, solid: f64, wall: f64) -> f64 {
        let scale = self.model.calibration.density_scale;
        scale * kernel / (1.0 - wall - scale * solid).max(0.1)
    }

    /// Reference pass of whitewater/survey: returns [`Surveyed`] of particle `i`.
    pub fn survey(&self, i: usize) -> Surveyed {
        let (x, h) = (self.points[i], self.model.calibration.support_radius);
        let (mut kernel, mut solid, mut gradient) = (0.0, 0.0, DVec3::ZERO);
        self.about(x, |neighbor, way| {
            let q = way.length() / h;
            let w = (1.0 - q * q).max(0.0).powi(3);
            let mass = match neighbor {
                Neighbor::Water(_) => {
                    kernel += w;
                    1.0
                }
                Neighbor::Sample(weight) => {
                    solid += weight * w;
                    weight
                }
            };
            gradient += mass * (1.0 - q).max(0.0).powi(2) * way.normalize_or_zero();
        });
        let (wall, wall_gradient) = self.model.wall_term(x, &self.walls);
        let outward = self.model.calibration.gradient_scale * gradient - wall_gradient;
        let steepness = outward.length() * h;
        let [least, full] = SURFACE;
        Surveyed {
            share: self.share_of(kernel, solid, wall),
            normal: outward.normalize_or_zero(),
            steepness,
            sure: ((steepness - least) / (full - least)).clamp(0.0, 1.0),
        }
    }

    /// Reference pass of whitewater/potentials: returns [`Potentials`] of particle `i`, from the
    /// survey of all particles. Shape (particles).
    pub fn potentials(&self, i: usize, surveyed: &[Surveyed]) -> Potentials {
        let h = self.model.calibration.support_radius;
        let (own, v) = (&surveyed[i], self.velocity[i]);
        let (mut closing, mut crest) = (0.0, 0.0);
        self.about(self.points[i], |neighbor, way| {
            let Neighbor::Water(j) = neighbor else {
                return;
            };
            let w = (1.0 - way.length() / h).max(0.0);
            let (against, along) = (v - self.velocity[j], way.normalize_or_zero());
            closing += (-against.dot(along)).max(0.0) * w;
            let other = &surveyed[j];
            let behind = (4.0 * along.dot(own.normal)).clamp(0.0, 1.0);
            crest += (1.0 - own.normal.dot(other.normal)) * other.sure * behind * w;
        });
        let speed = v.length();
        let cosine = v.dot(own.normal) / speed.max(1e-30);
        let [least, full] = OUTWARD;
        let outward = ((cosine - least) / (full - least)).clamp(0.0, 1.0);
        Potentials {
            trapped_air: CLOSING * closing * own.sure,
            wave_crest: crest * own.sure * outward,
            energy: 0.5 * speed * speed,
            share: own.share,
        }
    }

    fn at(&self, x: DVec3) -> Found {
        let h = self.model.calibration.support_radius;
        let (mut kernel, mut solid, mut velocity) = (0.0, 0.0, DVec3::ZERO);
        self.about(x, |neighbor, way| {
            let w = (1.0 - (way.length() / h).powi(2)).max(0.0).powi(3);
            match neighbor {
                Neighbor::Water(j) => {
                    kernel += w;
                    velocity += w * self.velocity[j];
                }
                Neighbor::Sample(weight) => solid += weight * w,
            }
        });
        let (wall, _) = self.model.wall_term(x, &self.walls);
        Found {
            share: self.share_of(kernel, solid, wall),
            velocity: velocity / kernel.max(1e-20),
        }
    }

    /// Returns the nearest allowed position: off walls, out of solids, in the domain.
    fn allowed(&self, x: DVec3) -> DVec3 {
        self.model.period().wrap(self.model.confine(x, &self.walls))
    }

    /// Returns whether a solid pushes at a position, or may within rounding.
    fn is_touched(&self, x: DVec3) -> bool {
        let reach = 1.001 * self.model.contact_distance();
        let movers = self.model.movers.iter().map(|it| it.solid.sample(x));
        let still = self.model.distance.iter().map(|solid| solid.sample(x));
        movers.chain(still).any(|distance| distance < reach)
    }

    /// Reference pass of whitewater/advance: moves a whitewater particle over `seconds` to this
    /// water's frame, pulled by `pull`.
    pub fn advance(
        &self,
        settings: &CompleteSettings,
        pull: &Pull<'_>,
        seconds: f64,
        white: White,
    ) -> Moved {
        let start = white.position;
        let before = white.velocity;
        let is_drop = white.kind == WhitewaterKind::Spray;
        let gravity = pull.gravity;
        let (way, mut velocity) = match is_drop {
            true => fly(settings, pull, seconds, (start, before)),
            false => (seconds * before, before),
        };
        let mut margin = f64::INFINITY;
        let mut look = |x: DVec3| {
            let found = self.at(x);
            margin = margin.min((found.share - AIR_BELOW).abs());
            (found, found.share >= AIR_BELOW)
        };
        let mut is_pushed = self.is_touched(start + way);
        let mut place = self.allowed(start + way);
        let (mut water, is_in_water) = look(place);
        if white.kind != WhitewaterKind::Foam && is_in_water == is_drop {
            let (mut near, mut far) = (0.0, 1.0);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (near + far);
                is_pushed |= self.is_touched(start + middle * way);
                let there = self.allowed(start + middle * way);
                let (found, is_found) = look(there);
                if is_found {
                    (place, water) = (there, found);
                }
                match is_found == is_in_water {
                    true => far = middle,
                    false => near = middle,
                }
            }
            velocity = match water.share >= AIR_BELOW {
                true => water.velocity,
                false => before,
            };
        } else if white.kind == WhitewaterKind::Foam && !is_in_water {
            velocity = before + seconds * pull.at(start);
        } else if !is_drop {
            let (rise, kept) = match white.kind {
                WhitewaterKind::Bubble => (white.rise, (-seconds / settings.response).exp()),
                WhitewaterKind::Foam | WhitewaterKind::Spray => (0.0, 0.0),
            };
            let aim = water.velocity - rise * gravity.normalize_or_zero();
            velocity = aim + kept * (before - aim);
            let end = start + 0.5 * seconds * (before + velocity);
            is_pushed |= self.is_touched(end);
            place = self.allowed(end);
        }
        let white = White {
            position: place,
            velocity,
            kind: WhitewaterKind::of_share(water.share),
            rise: white.rise,
        };
        Moved {
            white,
            share: water.share,
            margin: WhitewaterKind::THRESHOLDS
                .iter()
                .map(|threshold| (water.share - threshold).abs())
                .fold(margin, f64::min),
            is_pushed,
        }
    }
}

/// A neighbour of a position.
#[derive(Clone, Copy, Debug)]
pub enum Neighbor {
    /// Index of a water particle.
    Water(usize),
    /// Weight of a boundary sample.
    Sample(f64),
}

/// Gravity and forces on drops in the air over a frame.
#[derive(Clone, Debug)]
pub struct Pull<'a> {
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// The scene's forces on whitewater.
    pub forces: ForceField<'a>,
    /// Position of the domain's minimum corner, metres.
    corner: DVec3,
}

impl<'a> Pull<'a> {
    /// Takes those of a scene in the `seconds` up to `time`.
    pub fn new(scene: &'a PbfScene, time: f64, seconds: f64) -> Self {
        Self {
            gravity: scene.water.gravity,
            forces: scene.force_field(Medium::Whitewater, (time - seconds, seconds)),
            corner: scene.domain.min,
        }
    }

    /// Returns the acceleration at a position, m/s².
    fn at(&self, place: DVec3) -> DVec3 {
        self.gravity + self.forces.at(self.corner + place)
    }
}

/// Returns the displacement, metres, of a drop in the air, and its velocity after it, m/s.
fn fly(
    settings: &CompleteSettings,
    pull: &Pull<'_>,
    seconds: f64,
    (place, start): (DVec3, DVec3),
) -> (DVec3, DVec3) {
    let wind = DVec3::from_array(settings.wind);
    let step = seconds / f64::from(FLIGHT_STEPS);
    let (mut way, mut velocity) = (DVec3::ZERO, start);
    for _ in 0..FLIGHT_STEPS {
        let before = velocity;
        let against = before - wind;
        let resistance = air::resistance(settings.drop_radius, against.length());
        velocity = wind + (against + step * pull.at(place + way)) / (1.0 + step * resistance);
        way += 0.5 * step * (before + velocity);
    }
    (way, velocity)
}

/// Whitewater for the frames of one bake, on the CPU.
#[derive(Debug)]
pub struct Whitewater {
    scene: PbfScene<'static>,
    boundary: Boundary,
    settings: Option<CompleteSettings>,
    /// The water of a frame, the frame's end and its length, seconds.
    water: Option<(SortedWater, f64, f64)>,
}

impl Whitewater {
    /// Creates whitewater for the water of `scene`, which is
    /// [`of_whitewater`](swell_scene::Scene::of_whitewater) of the baked
    /// scene.
    pub fn new(scene: &PbfScene, boundary: &Boundary) -> Self {
        Self {
            scene: scene.to_owned_scene(),
            boundary: boundary.clone(),
            settings: None,
            water: None,
        }
    }

    /// Prepares the motion of whitewater with these settings.
    pub fn set(&mut self, settings: &CompleteSettings) {
        self.settings = Some(settings.clone());
    }

    /// Takes the water of the frame at `time`, `seconds` after the previous one, and returns the
    /// potentials of its particles, in the water's order.
    pub fn survey(&mut self, water: &Particles, time: f64, seconds: f64) -> Vec<Potentials> {
        let sorted = SortedWater::new(&self.scene, &self.boundary, water, time);
        let n = water.len();
        let surveyed: Vec<Surveyed> = parallel::map(0..n, |i| sorted.survey(i));
        let found: Vec<Potentials> = parallel::map(0..n, |i| sorted.potentials(i, &surveyed));
        let mut in_order = vec![Potentials::default(); n];
        for (&place, potentials) in sorted.order.iter().zip(found) {
            in_order[place] = potentials;
        }
        self.water = Some((sorted, time, seconds));
        in_order
    }

    /// Moves whitewater from the previous frame to that of the last [`Self::survey`].
    ///
    /// # Errors Returns an error if a value is not finite.
    ///
    /// # Panics Panics if [`Self::set`] or [`Self::survey`] was not called.
    pub fn advance(&self, white: &mut Particles, frame: u32) -> Result<(), ReferenceError> {
        let (Some(settings), Some((water, time, seconds))) = (&self.settings, &self.water) else {
            panic!("settings and water come before moves");
        };
        let origin = self.scene.domain.min;
        let pull = Pull::new(&self.scene, *time, *seconds);
        let wide = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
        let one = |k: usize| {
            let one = White {
                position: (wide(white.position[k]) - origin).as_vec3().as_dvec3(),
                velocity: wide(white.velocity[k]),
                kind: WhitewaterKind::of_number(white.attributes[KIND][k])
                    .unwrap_or(WhitewaterKind::Foam),
                rise: f64::from(settings.rise_of(white.id[k]) as f32),
            };
            water.advance(settings, &pull, *seconds, one).white
        };
        let moved: Vec<White> = parallel::map(0..white.len(), one);
        for (k, moved) in moved.iter().enumerate() {
            white.position[k] = (moved.position + origin).as_vec3().to_array();
            white.velocity[k] = moved.velocity.as_vec3().to_array();
            if let Some(own) = white.attributes.get_mut(KIND) {
                own[k] = moved.kind.number();
            }
        }
        match white.first_not_finite(None) {
            None => Ok(()),
            Some((count, first)) => Err(Breach::not_finite(frame, count, Some(first)).into()),
        }
    }
}
