//! What is allowed, and hardly what was meant: each found by a number, and said with it.

mod motions;
mod solids;
mod still;
mod water;

use std::f64::consts::{PI, TAU};

use self::still::Still;
use super::{Method, Scene, Wall, WaveMaker, seas::STEEPEST, words::shown};
use swell_domain::motion::{Motion, Phases, piston_height_ratio, wave_number};

/// In particle spacings, half a cell of FLIP. Of a sea 1.2 spacings high FLIP keeps 0.96 of the height (docs/validation.md).
const LEAST_HEIGHT: f64 = 1.0;

/// Frames a period, of which each is at least one step.
const LEAST_FRAMES: f64 = 10.0;

/// Part by which a depth that theory is told may be off the water's own. The length of long waves is off by half of it.
const DEPTH: f64 = 0.1;

/// k a of a wave that breaks, over tanh kh: half of 0.142 wave lengths high (Miche 1944).
const BREAKS: f64 = STEEPEST * PI;

/// Layers of particles above which PBF's iterations alone do not hold water at rest (docs/studies.md, pbf-rest).
const LAYERS: f64 = 20.0;

/// The highest crest of a sea over its significant height: of a thousand waves, half of 1.86 times (Longuet-Higgins 1952).
pub(super) const CREST: f64 = 0.93;

/// Waves that a part of the scene makes.
pub(super) struct Made {
    /// The part's key.
    pub(super) key: String,
    /// From trough to crest, or significant, metres.
    pub(super) height: f64,
    /// Above still water, metres.
    pub(super) crest: f64,
    /// Seconds; one solitary wave has none.
    pub(super) period: Option<f64>,
    /// As theory is told it, metres.
    pub(super) depth: Option<f64>,
    /// Seconds until the waves have their full height.
    pub(super) ramp: f64,
    /// When a packet's crests meet, seconds.
    pub(super) meets: Option<f64>,
}

impl Scene {
    /// What of the scene is allowed and hardly meant, a sentence each, with its key first and the number that it was judged by.
    pub fn lints(&self) -> Vec<String> {
        let mut lints = self.lint_tracks();
        self.lint_motions(&mut lints);
        let level = self.still_depth();
        let still = level.map(Still::on_the_floor);
        let makers = self.wave_makers.iter().enumerate();
        let makers: Vec<_> = makers
            .map(|(k, maker)| (k, maker, self.still_beside(maker).or(still)))
            .collect();
        let mut made: Vec<(Option<Wall>, Made)> = Vec::new();
        for (k, maker) in self.wave_makers.iter().enumerate() {
            lints.extend(self.lint_dry_wall(k, maker, level));
        }
        for &(k, maker, still) in &makers {
            let Some(waves) = made_by(k, maker, self, still) else {
                continue;
            };
            self.lint_waves(&waves, still, &mut lints);
            self.lint_packet(&waves, &mut lints);
            if let Some(level) = level.or(still.map(|it| it.depth)) {
                self.lint_return(maker.wall, &waves, level, &mut lints);
            }
            made.push((Some(maker.wall), waves));
        }
        for waves in self.effects.made() {
            self.lint_waves(&waves, still, &mut lints);
            self.lint_packet(&waves, &mut lints);
            made.push((None, waves));
        }
        if let Some(level) = level {
            self.lint_zones(level, &made, &mut lints);
        }
        for &(k, maker, still) in &makers {
            if let (Some(absorption), Some(still)) = (&maker.absorption, still) {
                let key = format!("wave_maker[{k}].absorption");
                lints.extend(lint_depth(&key, absorption.asked().depth, still));
            }
            self.lint_way(k, maker, &mut lints);
            lints.extend(self.lint_sine(k, maker, still));
        }
        self.lint_layers(level, &mut lints);
        self.lint_water(&mut lints);
        self.lint_thin(&mut lints);
        lints.extend(self.effects.lints(self.grain()));
        lints
    }

    fn wave_length(&self, period: f64, depth: f64) -> f64 {
        TAU / wave_number(TAU / period, depth, self.water.gravity.length())
    }

    /// Waves that the cells, the frames, the water or the domain do not fit.
    fn lint_waves(&self, waves: &Made, still: Option<Still>, lints: &mut Vec<String>) {
        let key = &waves.key;
        let spacing = self.particle_spacing();
        if waves.height < LEAST_HEIGHT * spacing {
            lints.push(format!(
                "{key}: waves {} m high are {:.2} particle spacings high; below {LEAST_HEIGHT} little of them is left",
                shown(waves.height),
                waves.height / spacing
            ));
        }
        if let Some(period) = waves.period {
            let frames = period / self.shot.frame_seconds();
            if frames < LEAST_FRAMES {
                lints.push(format!(
                    "{key}: a period of {} s is {frames:.1} frames; below {LEAST_FRAMES} waves may be a few steps each",
                    shown(period)
                ));
            }
        }
        let Some(still) = still else {
            return;
        };
        if let Some(depth) = waves.depth {
            lints.extend(lint_depth(key, depth, still));
        }
        let room = self.domain.size().y - still.floor;
        if still.depth + waves.crest > room {
            lints.push(format!(
                "{key}: crests {:.3} m above water {} m deep reach the ceiling, {} m above the floor",
                waves.crest,
                shown(still.depth),
                shown(room)
            ));
        }
    }

    /// Waves that run over the whole flume and back within the shot, where nothing takes them.
    fn lint_return(&self, wall: Wall, waves: &Made, level: f64, lints: &mut Vec<String>) {
        let has_solids = !self.solids.is_empty() || !self.moving_solids.is_empty();
        let zones = self.effects.absorbing();
        let mut walls = zones.iter().flat_map(|(_, absorbs)| absorbs.zone.walls);
        let is_absorbed = walls.any(|other| other.axis == wall.axis);
        let makers = self.wave_makers.iter();
        let takes = |maker: &WaveMaker| maker.wall == wall && maker.absorption.is_some();
        let is_absorbed = is_absorbed || self.wave_makers.iter().any(takes);
        let mut moving = makers.filter(|other| other.wall.axis == wall.axis && other.wall != wall);
        let Some(period) = waves.period else {
            return;
        };
        if has_solids || is_absorbed || moving.next().is_some() || wall.axis == 1 {
            return;
        }
        let k = TAU / self.wave_length(period, level);
        let group = (0.5 + k * level / (2.0 * k * level).min(300.0).sinh()) * TAU / (period * k);
        let back = waves.ramp + 2.0 * self.domain.size()[wall.axis] / group;
        let duration = self.shot.duration();
        if back < duration {
            lints.push(format!(
                "{}: waves are back from the wall opposite after {back:.1} s of {} s, and no zone absorbs them",
                waves.key,
                shown(duration)
            ));
        }
    }

    /// Crests that break before they meet, or meet when the shot is over.
    fn lint_packet(&self, waves: &Made, lints: &mut Vec<String>) {
        let (Some(meets), Some(period), Some(depth)) = (waves.meets, waves.period, waves.depth)
        else {
            return;
        };
        let k = TAU / self.wave_length(period, depth);
        let (steep, breaks) = (k * waves.crest, BREAKS * (k * depth).tanh());
        if steep > breaks {
            lints.push(format!(
                "{}: a crest of {} m has k a = {steep:.2} at the peak's {} s; waves break from {breaks:.2} on (Miche 1944)",
                waves.key,
                shown(waves.crest),
                shown(period)
            ));
        }
        let duration = self.shot.duration();
        if meets > duration {
            lints.push(format!(
                "{}: its crests meet after {} s, and the shot ends after {} s",
                waves.key,
                shown(meets),
                shown(duration)
            ));
        }
    }

    /// Zones that are short beside the waves that they are for, or that the scene makes.
    fn lint_zones(&self, level: f64, made: &[(Option<Wall>, Made)], lints: &mut Vec<String>) {
        for (name, absorbs) in self.effects.absorbing() {
            let (length, period, least) = (absorbs.zone.length, absorbs.period, absorbs.least);
            let wave = self.wave_length(period, level);
            if length < least * wave {
                lints.push(format!(
                    "effects.{name}.length: {} m is {:.2} of a wave length, as waves of {} s are {wave:.3} m long on {} m of water; \
                     one and a half are good, {least} the least",
                    shown(length),
                    length / wave,
                    shown(period),
                    shown(level)
                ));
                continue;
            }
            for (_, waves) in made {
                let Some(longer) = waves.period.filter(|other| *other > period) else {
                    continue;
                };
                let wave = self.wave_length(longer, level);
                if length < least * wave {
                    lints.push(format!(
                        "effects.{name}.length: {} m is {:.2} of a wave length of {}'s waves of {} s; {least} is the least, and its \
                         period is {} s",
                        shown(length),
                        length / wave,
                        waves.key,
                        shown(longer),
                        shown(period)
                    ));
                }
            }
        }
    }

    /// PBF's iterations alone under many layers.
    fn lint_layers(&self, level: Option<f64>, lints: &mut Vec<String>) {
        if self.solver.method != Method::Pbf || self.solver.pbf().grid_projection {
            return;
        }
        let layers = level.map_or(0.0, |level| level / self.particle_spacing());
        if layers > LAYERS {
            lints.push(format!(
                "solver.pbf.grid_projection: {layers:.0} layers of particles without it; above {LAYERS} water at rest simmers"
            ));
        }
    }
}

/// A depth that theory is told and the water does not have.
fn lint_depth(key: &str, depth: f64, still: Still) -> Option<String> {
    let on = match still.floor {
        0.0 => String::new(),
        floor => format!(", on solids {} m high beside the wall", shown(floor)),
    };
    ((depth / still.depth - 1.0).abs() > DEPTH).then(|| {
        format!(
            "{key}: depth is {} m, and the scene's water stands {} m deep, {:.2} times as much{on}",
            shown(depth),
            shown(still.depth),
            still.depth / depth
        )
    })
}

/// The waves of the `index`-th wave maker, where its motion makes waves of a height that theory knows.
fn made_by(index: usize, maker: &WaveMaker, scene: &Scene, still: Option<Still>) -> Option<Made> {
    let key = format!("wave_maker[{index}].motion");
    let of = |height, crest, period, depth, ramp| Made {
        key: key.clone(),
        height,
        crest,
        period: Some(period),
        depth: Some(depth),
        ramp,
        meets: None,
    };
    Some(match &maker.motion {
        Motion::Sine {
            stroke,
            period,
            ramp,
        } => {
            let level = still?.depth;
            let k = TAU / scene.wave_length(*period, level);
            let height = stroke * piston_height_ratio(k, level);
            of(height, 0.5 * height, *period, level, *ramp)
        }
        Motion::Solitary { height, depth, .. } => Made {
            key,
            height: *height,
            crest: *height,
            period: None,
            depth: Some(*depth),
            ramp: 0.0,
            meets: None,
        },
        Motion::Stokes(stokes) => {
            let waves = stokes.waves();
            of(
                waves.height,
                0.5 * waves.height,
                waves.period,
                waves.depth,
                waves.ramp,
            )
        }
        Motion::Cnoidal(cnoidal) => {
            let waves = cnoidal.waves();
            of(
                waves.height,
                waves.height,
                waves.period,
                waves.depth,
                waves.ramp,
            )
        }
        Motion::Sea(sea) => {
            let asked = sea.asked();
            let (height, crest) = match asked.phases {
                Phases::Random {
                    significant_height, ..
                } => (significant_height, CREST * significant_height),
                Phases::Focused { height, .. } => (height, height),
            };
            let meets = match asked.phases {
                Phases::Focused { time, .. } => Some(time),
                Phases::Random { .. } => None,
            };
            Made {
                meets,
                ..of(height, crest, asked.peak_period, asked.depth, asked.ramp)
            }
        }
        Motion::Still | Motion::ConstantVelocity { .. } | Motion::Table { .. } => return None,
    })
}

#[cfg(test)]
mod tests;
