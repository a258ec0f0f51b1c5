//! Waves that are on the water at the start, as specified in a scene.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use swell_domain::{
    bounds::Bounds,
    initial_waves::{InitialWave, InitialWaves},
    mesh::TriangleMesh,
    open_waves::{OpenSea, OpenWaves},
    parallel,
    shape::WaveFloor,
    solitary_wave::SolitaryWave,
};

use crate::{
    Scene, Wall,
    lint::Made,
    open_waves::{Regular, Sea, Waves},
    probe::{Bearer, ProbeKind},
    waves,
    words::shown,
};

/// The domain's floor.
const FLOOR: Wall = Wall {
    axis: 1,
    is_max: false,
};

/// Key of the waves.
pub const KEY: &str = "water.wave";

/// Largest height of a solitary wave, in depths: at this height third-order theory leaves 13 % of
/// √(g d) of the velocities unexplained, and beyond it more.
pub const HIGHEST_SOLITARY: f64 = 0.5;

/// Layers of particles above the highest crest that stand for the air while water is spread.
const AIR_LAYERS: f64 = 3.0;

/// Part of its height up to which a solitary wave may be cut off by the ends of the domain: that of
/// a wave a fifth of the depth high, six depths from its crest.
const CUT: f64 = 0.06;

/// One `[[water.wave]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StartWave {
    /// A solitary wave to third order.
    Solitary(Solitary),
    /// Regular waves to second order; their ramp is not used.
    Stokes(Regular),
    /// Waves of a spectrum with random phases; their ramp is not used.
    Sea(Sea),
}

/// A solitary wave as specified in a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Solitary {
    /// Height of the crest above still water, metres.
    pub height: f64,
    /// Still-water depth, metres.
    pub depth: f64,
    /// Distance of the crest from the domain's least corner, along the wave's direction, metres.
    pub at: f64,
    /// Direction of propagation, from +x towards +z.
    pub direction_degrees: f64,
}

/// The waves at the start of a scene with the space that they take.
pub struct StartWaves {
    /// Their surface and velocities.
    pub waves: InitialWaves,
    /// The box of the water below them and of some air above them.
    pub block: Bounds,
    /// The closed mesh of the air above them.
    pub air: TriangleMesh,
}

impl StartWave {
    /// Returns the depth of still water, metres.
    pub fn depth(&self) -> f64 {
        match self {
            Self::Solitary(wave) => wave.depth,
            Self::Stokes(waves) => waves.depth,
            Self::Sea(sea) => sea.depth,
        }
    }

    /// Returns the height of still water above the domain's floor, metres.
    pub fn level(&self) -> f64 {
        let simulated = match self {
            Self::Solitary(_) => None,
            Self::Stokes(waves) => waves.simulated_depth,
            Self::Sea(sea) => sea.simulated_depth,
        };
        simulated.unwrap_or(self.depth())
    }

    /// Returns the direction of propagation, degrees from +x towards +z.
    pub fn direction_degrees(&self) -> f64 {
        match self {
            Self::Solitary(wave) => wave.direction_degrees,
            Self::Stokes(waves) => waves.direction_degrees,
            Self::Sea(sea) => sea.direction_degrees,
        }
    }

    /// Returns the waves of an open sea that these are; `None` for a solitary wave.
    pub fn open(&self) -> Option<Waves> {
        match self {
            Self::Solitary(_) => None,
            Self::Stokes(waves) => Some(Waves::Stokes(waves.clone())),
            Self::Sea(sea) => Some(Waves::Sea(sea.clone())),
        }
    }

    /// Returns the wave at its full height, for a gravity, m/s².
    pub fn at_start(&self, gravity: f64) -> InitialWave {
        let degrees = self.direction_degrees();
        let direction = DVec2::from_angle(degrees.to_radians());
        match self {
            Self::Solitary(solitary) => InitialWave::Solitary {
                wave: SolitaryWave {
                    height: solitary.height,
                    depth: solitary.depth,
                    gravity,
                },
                direction,
                crest: solitary.at,
            },
            Self::Stokes(regular) => {
                let water = [regular.height, regular.period, regular.depth, gravity];
                let asked = waves::regular(water, Some(0.0));
                InitialWave::Open(OpenWaves::regular(&asked, direction).above(self.level()))
            }
            Self::Sea(sea) => {
                let asked = OpenSea {
                    ramp: 0.0,
                    ..sea.asked(gravity)
                };
                let waves = OpenWaves::sea(&asked, degrees.to_radians());
                InitialWave::Open(waves.above(self.level()))
            }
        }
    }

    /// Returns what lints have to know of the wave `index`.
    fn made(&self, index: usize) -> Made {
        let key = format!("{KEY}[{index}]");
        match self {
            Self::Solitary(wave) => Made {
                key,
                height: wave.height,
                crest: wave.height,
                period: None,
                depth: Some(wave.depth),
                simulated_depth: None,
                ramp: 0.0,
                meets: None,
            },
            Self::Stokes(waves) => Waves::Stokes(waves.clone()).made(key),
            Self::Sea(sea) => Waves::Sea(sea.clone()).made(key),
        }
    }
}

impl Scene {
    /// Returns the waves at the start; `None` if the scene has none.
    pub fn initial_waves(&self) -> Option<InitialWaves> {
        let gravity = self.water.gravity.length();
        let waves = self.water.waves.iter();
        InitialWaves::new(waves.map(|wave| wave.at_start(gravity)).collect())
    }

    /// Returns the waves at the start with the space that they take; `None` without waves.
    pub fn start_waves(&self) -> Option<StartWaves> {
        let waves = self.initial_waves()?;
        let (room, spacing) = (self.start_domain(), self.particle_spacing());
        let surface = waves.over(&room, self.domain.min, self.solid_margin(), spacing);
        let highest = surface.highest();
        let layers = ((highest - room.min.y) / spacing).ceil() + AIR_LAYERS;
        let mut block = room;
        block.max.y = (room.min.y + layers * spacing).min(room.max.y);
        if let Some(floor) = self.wave_floor() {
            let [mean, most] = floor.heights();
            let dry = ((self.domain.min.y + mean - most - room.min.y) / spacing).floor();
            block.min.y += dry.max(0.0) * spacing;
        }
        let top = self.domain.max.y.max(highest) + self.solid_margin();
        Some(StartWaves {
            waves,
            block,
            air: surface.air(top),
        })
    }

    /// Returns the volume of water below the waves of the start, m³; 0 without any.
    pub(crate) fn wave_volume(&self) -> f64 {
        let (room, spacing) = (self.start_domain(), self.particle_spacing());
        let below_floor = self.wave_floor().map_or(0.0, |floor| floor.volume(&room));
        self.initial_waves().map_or(0.0, |waves| {
            waves.volume(&room, self.domain.min, spacing) - below_floor
        })
    }

    /// Warns about bodies and probes that reach the floor below waves, and about waves that walls
    /// reflect while the floor moves as if they did not.
    pub(crate) fn lint_floor(&self, lints: &mut Vec<String>) {
        let Some(floor) = self.wave_floor() else {
            return;
        };
        let highest = floor.bounds().max.y;
        for solid in self.moving_solids.iter().filter(|it| it.body.is_some()) {
            let lowest = solid.placed.mesh.bounds().map(|it| it.min.y);
            if let Some(lowest) = lowest.filter(|lowest| *lowest < highest) {
                lints.push(format!(
                    "body.mesh of {}: it reaches down to {:.3} m, and below {:.3} m no water is \
                     simulated that would carry it; a greater simulated_depth does",
                    solid.placed.name(),
                    lowest + self.origin.y,
                    highest + self.origin.y
                ));
            }
        }
        let is_below = |kind: &ProbeKind| match kind {
            ProbeKind::Pressure { at } => at.y < highest,
            ProbeKind::Force { on, .. } => *on == Bearer::Wall(FLOOR),
            _ => false,
        };
        for (index, probe) in self.probes.iter().enumerate() {
            if is_below(&probe.kind) {
                lints.push(format!(
                    "probe[{index}]: it measures nothing below {:.3} m, where no water is \
                     simulated (simulated_depth)",
                    highest + self.origin.y
                ));
            }
        }
        let is_open = self.effects.generated().is_some();
        if !is_open && !self.periodic[0] && !self.periodic[2] {
            lints.push(format!(
                "{KEY}[0].simulated_depth: walls reflect the waves, and the floor moves as if they \
                 did not; add a generation zone or a periodic axis"
            ));
        }
    }

    /// Returns the floor that moves with the waves, where a part of their depth is simulated.
    pub fn wave_floor(&self) -> Option<&WaveFloor> {
        self.moving_solids.iter().find_map(|it| it.floor.as_ref())
    }

    /// Returns the height above the domain's floor of still water below the waves of the start,
    /// metres.
    pub(crate) fn wave_depth(&self) -> Option<f64> {
        self.water.waves.first().map(StartWave::level)
    }

    /// Warns about solitary waves that the ends of the domain cut off.
    pub(crate) fn lint_cut_waves(&self, lints: &mut Vec<String>) {
        let (room, gravity) = (self.start_domain(), self.water.gravity.length());
        for (index, wave) in self.water.waves.iter().enumerate() {
            let InitialWave::Solitary {
                wave,
                direction,
                crest,
            } = wave.at_start(gravity)
            else {
                continue;
            };
            let corner = |x: f64, z: f64| {
                let from = DVec2::new(x - self.domain.min.x, z - self.domain.min.z);
                direction.dot(from) - crest
            };
            let (min, max) = (room.min, room.max);
            let ends = [
                (min.x, min.z),
                (min.x, max.z),
                (max.x, min.z),
                (max.x, max.z),
            ];
            let ends = ends.map(|(x, z)| corner(x, z));
            let behind = ends.into_iter().fold(f64::INFINITY, f64::min);
            let ahead = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let nearest = if -behind < ahead { behind } else { ahead };
            let left = wave.elevation(nearest) / wave.height;
            if left > CUT {
                lints.push(format!(
                    "{KEY}[{index}].at: the domain ends {:.2} m from the crest, where the wave \
                     still has {:.0} % of its height",
                    nearest.abs(),
                    100.0 * left
                ));
            }
        }
    }

    /// Warns about waves that come in and do not carry on those of the start.
    pub(crate) fn lint_incoming(&self, lints: &mut Vec<String>) {
        let gravity = self.water.gravity;
        let (Some(incoming), Some(made)) = (
            self.effects
                .waves(gravity)
                .filter(|_| !self.water.waves.is_empty()),
            self.effects.made(),
        ) else {
            return;
        };
        let start = self.water.waves.iter();
        let start = start.map(|wave| wave.at_start(gravity.length()));
        let is_same = |wave: InitialWave| match wave {
            InitialWave::Open(waves) => waves.lines == incoming.lines,
            InitialWave::Solitary { .. } => false,
        };
        if !start.into_iter().any(is_same) {
            lints.push(format!(
                "{}: they are other waves than those of {KEY}, which they damp where they come in",
                made.key
            ));
        } else if incoming.ramp() > 0.0 {
            lints.push(format!(
                "{}.ramp: these waves grow from rest within {} s, and damp those of {KEY} until \
                 then; 0 carries them on",
                made.key,
                shown(incoming.ramp())
            ));
        }
    }

    /// Warns about waves that together reach the ceiling, though none does alone.
    pub(crate) fn lint_sum(&self, lints: &mut Vec<String>) {
        let crests: f64 = self.made_at_start().map(|made| made.crest).sum();
        let (Some(depth), room) = (self.wave_depth(), self.domain.size().y) else {
            return;
        };
        if self.water.waves.len() > 1 && depth + crests > room {
            lints.push(format!(
                "{KEY}: the crests of all waves, where they meet, are {crests:.3} m above water {} \
                 m deep, and the ceiling is {} m above the floor",
                shown(depth),
                shown(room)
            ));
        }
    }

    /// Returns what lints have to know of the waves of the start.
    pub(crate) fn made_at_start(&self) -> impl Iterator<Item = Made> + '_ {
        let waves = self.water.waves.iter().enumerate();
        waves.map(|(index, wave)| wave.made(index))
    }

    /// Sets the velocities that particles have at the start: those of the current and the waves.
    pub fn move_at_start(&self, position: &[[f32; 3]], velocity: &mut [[f32; 3]]) {
        let current = self.water.current;
        let waves = self.initial_waves();
        if waves.is_none() && current == DVec3::ZERO {
            return;
        }
        parallel::for_each_mut(velocity, |k, velocity| {
            let place = DVec3::from_array(position[k].map(f64::from)) - self.domain.min;
            let of_waves = waves.as_ref().map_or(DVec3::ZERO, |it| it.velocity(place));
            *velocity = (current + of_waves).as_vec3().to_array();
        });
    }
}
