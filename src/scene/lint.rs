//! What is allowed, and hardly what was meant: each found by a number, and said with it.

use std::f64::consts::{PI, TAU};

use super::{Method, Scene, Wall, WaveMaker, words::shown};
use swell_domain::{
    bounds::Bounds,
    motion::{Motion, Phases, piston_height_ratio, wave_number},
    sources::Window,
};

/// In particle spacings, half a cell of FLIP. Of a sea 1.2 spacings high FLIP keeps 0.96 of the height (docs/validation.md).
const LEAST_HEIGHT: f64 = 1.0;

/// Frames a period, of which each is at least one step.
const LEAST_FRAMES: f64 = 10.0;

/// Part by which a depth that theory is told may be off the water's own. The length of long waves is off by half of it.
const DEPTH: f64 = 0.1;

/// k a of a wave that breaks, over tanh kh: half of 0.142 wave lengths high (Miche 1944).
const BREAKS: f64 = 0.142 * PI;

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
        let level = self.still_depth();
        let made: Vec<(Option<Wall>, Made)> = (self.wave_makers.iter().enumerate())
            .filter_map(|(k, maker)| Some((Some(maker.wall), made_by(k, maker, self, level)?)))
            .chain(self.effects.made().into_iter().map(|made| (None, made)))
            .collect();
        for (wall, waves) in &made {
            self.lint_waves(waves, level, &mut lints);
            self.lint_packet(waves, &mut lints);
            if let (Some(wall), Some(level)) = (wall, level) {
                self.lint_return(*wall, waves, level, &mut lints);
            }
        }
        if let Some(level) = level {
            self.lint_zones(level, &made, &mut lints);
            for (k, maker) in self.wave_makers.iter().enumerate() {
                if let Some(absorption) = &maker.absorption {
                    let key = format!("wave_maker[{k}].absorption");
                    lints.extend(lint_depth(&key, absorption.asked().depth, level));
                }
            }
        }
        self.lint_layers(level, &mut lints);
        self.lint_sources(&mut lints);
        self.lint_thin(&mut lints);
        lints.extend(self.effects.lints(self.grain()));
        lints
    }

    /// How deep the water of the scene's blocks stands above the floor at the start, metres; `None` where none stands there, or where
    /// gravity does not go along -y.
    fn still_depth(&self) -> Option<f64> {
        let gravity = self.water.gravity;
        let is_down = gravity.x == 0.0 && gravity.z == 0.0 && gravity.y < 0.0;
        let floor = self.domain.min.y;
        let blocks = self.water.blocks.iter();
        let standing = blocks.filter(|block| block.min.y <= floor + self.particle_spacing());
        let top = standing.map(|block| block.max.y - floor);
        let deepest = top.fold(0.0, f64::max).min(self.domain.size().y);
        (is_down && deepest > 0.0).then_some(deepest)
    }

    fn wave_length(&self, period: f64, depth: f64) -> f64 {
        TAU / wave_number(TAU / period, depth, self.water.gravity.length())
    }

    /// Waves that the cells, the frames, the water or the domain do not fit.
    fn lint_waves(&self, waves: &Made, level: Option<f64>, lints: &mut Vec<String>) {
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
        let Some(level) = level else {
            return;
        };
        if let Some(depth) = waves.depth {
            lints.extend(lint_depth(key, depth, level));
        }
        let height = self.domain.size().y;
        if level + waves.crest > height {
            lints.push(format!(
                "{key}: crests {:.3} m above water {} m deep reach the ceiling, {} m above the floor",
                waves.crest,
                shown(level),
                shown(height)
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

    /// Water that enters or leaves only when the shot is over.
    fn lint_sources(&self, lints: &mut Vec<String>) {
        let mut emitters = self.emitters.iter().map(|it| ("emitter", it.window));
        let mut drains = self.drains.iter().map(|it| ("drain", it.window));
        let duration = self.shot.duration();
        let late = |list: &mut dyn Iterator<Item = (&str, Window)>, lints: &mut Vec<String>| {
            for (index, (name, window)) in list.enumerate() {
                if window.from >= duration {
                    lints.push(format!(
                        "{name}[{index}].from: it begins after {} s, and the shot ends after {} s",
                        shown(window.from),
                        shown(duration)
                    ));
                }
            }
        };
        late(&mut emitters, lints);
        late(&mut drains, lints);
        self.lint_rooms(lints);
    }

    /// Water that enters where a wall stands.
    fn lint_rooms(&self, lints: &mut Vec<String>) {
        for (index, emitter) in self.emitters.iter().enumerate() {
            let Bounds { min, max } = emitter.shape.bounds();
            for (k, maker) in self.wave_makers.iter().enumerate() {
                let axis = maker.wall.axis;
                let behind = match maker.wall.is_max {
                    true => max[axis] - (self.domain.max[axis] - maker.room()),
                    false => self.domain.min[axis] + maker.room() - min[axis],
                };
                if behind > 1e-6 {
                    lints.push(format!(
                        "emitter[{index}]: {behind:.3} m of its room are behind wave_maker[{k}] at rest, and nothing enters there"
                    ));
                }
            }
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
fn lint_depth(key: &str, depth: f64, level: f64) -> Option<String> {
    ((depth / level - 1.0).abs() > DEPTH).then(|| {
        format!(
            "{key}: depth is {} m, and the scene's water stands {} m deep, {:.2} times as much",
            shown(depth),
            shown(level),
            level / depth
        )
    })
}

/// The waves of the `index`-th wave maker, where its motion makes waves of a height that theory knows.
fn made_by(index: usize, maker: &WaveMaker, scene: &Scene, level: Option<f64>) -> Option<Made> {
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
            let level = level?;
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
mod tests {
    use std::path::Path;

    use super::*;

    const SCENE: &str = r#"
[shot]
name = "a"
frames = 100
frames_per_second = 20
[domain]
min = [0, 0, 0]
max = [20, 2, 1]
[[water.block]]
min = [0, 0, 0]
max = [20, 1, 1]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
[solver.pbf]
particle_spacing = 0.04
"#;

    fn lints(set: &[&str]) -> Vec<String> {
        let set: Vec<String> = set.iter().map(|&text| text.to_owned()).collect();
        let scene = Scene::parse(SCENE, Path::new("s.toml"), Path::new(""), &set).expect("valid");
        scene.lints()
    }

    /// Each with what mends it.
    #[test]
    fn what_is_hardly_meant_is_said_with_its_key_and_number() {
        // Waves of 2.2987 s are 6.2832 m long on 1 m of water, and their energy goes at 2.1 m/s.
        let sine = "wave_maker=[{wall=\"-x\",motion={kind=\"sine\",stroke=0.2,period=2.2987}}]";
        let stokes = |more: &str| {
            let waves = format!("kind=\"stokes\",period=2.2987,{more}");
            format!("effects.generation_zone={{walls=[\"-x\"],length=9.0,waves={{{waves}}}}}")
        };
        let packet = |more: &str| {
            let waves = format!(
                "kind=\"focused\",at=[2.0,0.5],peak_period=2.2987,ramp=0.1,shortest_period=2.0,depth=1.0,{more}"
            );
            format!("effects.generation_zone={{walls=[\"-x\"],length=9.0,waves={{{waves}}}}}")
        };
        let room = "min=[1.0,1.0,0.0],max=[2.0,2.0,1.0]";
        let emitter = |more: &str| format!("emitter=[{{{room},velocity=[1.0,0.0,0.0],{more}}}]");
        let absorbing = |asked: &str| {
            let still = "wall=\"-x\",motion={kind=\"still\"}";
            format!("wave_maker=[{{{still},absorption={{{asked}}}}}]")
        };
        let drain = |more: &str| format!("drain=[{{{room},{more}}}]");
        for (set, good, expected) in [
            (
                vec![stokes("height=0.04,depth=1.0")],
                vec![stokes("height=0.11,depth=1.0")],
                "effects.generation_zone.waves: waves 0.04 m high are 0.80 particle spacings high",
            ),
            (
                vec![stokes("height=0.11,depth=1.2")],
                vec![stokes("height=0.11,depth=1.05")],
                "effects.generation_zone.waves: depth is 1.2 m, and the scene's water stands 1 m deep, 0.83 times as much",
            ),
            (
                vec![
                    stokes("height=0.6,depth=1.0"),
                    "domain.max=[20, 1.2, 1]".into(),
                ],
                vec![
                    stokes("height=0.3,depth=1.0"),
                    "domain.max=[20, 1.2, 1]".into(),
                ],
                "effects.generation_zone.waves: crests 0.300 m above water 1 m deep reach the ceiling, 1.2 m above the floor",
            ),
            (
                vec![stokes("height=0.11,depth=1.0").replace("9.0", "4.0")],
                vec![stokes("height=0.11,depth=1.0").replace("9.0", "5.0")],
                "effects.generation_zone.length: 4 m is 0.64 of a wave length, as waves of 2.2987 s are 6.283 m long on 1 m of water",
            ),
            (
                vec!["effects.absorbing_zone={walls=[\"+x\"],length=3.0,period=2.2987}".into()],
                vec!["effects.absorbing_zone={walls=[\"+x\"],length=3.2,period=2.2987}".into()],
                "effects.absorbing_zone.length: 3 m is 0.48 of a wave length",
            ),
            (
                vec![
                    stokes("height=0.11,depth=1.0"),
                    "shot.frames_per_second=4".into(),
                ],
                vec![
                    stokes("height=0.11,depth=1.0"),
                    "shot.frames_per_second=5".into(),
                ],
                "effects.generation_zone.waves: a period of 2.2987 s is 9.2 frames",
            ),
            (
                vec![sine.into(), "shot.frames=500".into()],
                vec![sine.into(), "shot.frames=400".into()],
                "wave_maker[0].motion: waves are back from the wall opposite after 21.",
            ),
            (
                vec![sine.into(), "shot.frames=500".into()],
                vec![
                    sine.into(),
                    "shot.frames=500".into(),
                    "effects.absorbing_zone={walls=[\"+x\"],length=9.0,period=2.3}".into(),
                ],
                "and no zone absorbs them",
            ),
            (
                vec![
                    "solver.method=pbf".into(),
                    "solver.pbf.grid_projection=false".into(),
                ],
                vec!["solver.method=pbf".into()],
                "solver.pbf.grid_projection: 25 layers of particles without it",
            ),
            (
                vec![packet("height=0.35,time=4.9")],
                vec![packet("height=0.33,time=4.9")],
                "effects.generation_zone.waves: a crest of 0.35 m has k a = 0.35 at the peak's 2.2987 s; waves break from 0.34 on",
            ),
            (
                vec![packet("height=0.2,time=5.1")],
                vec![packet("height=0.2,time=5.0")],
                "effects.generation_zone.waves: its crests meet after 5.1 s, and the shot ends after 5 s",
            ),
            (
                vec![emitter("from=5.0")],
                vec![emitter("from=4.9")],
                "emitter[0].from: it begins after 5 s, and the shot ends after 5 s",
            ),
            (
                vec![absorbing("depth=1.2,period=2.3,room=0.2")],
                vec![absorbing("depth=1.05,period=2.3,room=0.2")],
                "wave_maker[0].absorption: depth is 1.2 m, and the scene's water stands 1 m deep, 0.83 times as much",
            ),
            (
                vec![
                    absorbing("depth=1.0,period=2.3,room=1.2"),
                    emitter("from=1.0"),
                ],
                vec![
                    absorbing("depth=1.0,period=2.3,room=0.9"),
                    emitter("from=1.0"),
                ],
                "emitter[0]: 0.200 m of its room are behind wave_maker[0] at rest",
            ),
            (
                vec![drain("from=6.0")],
                vec![drain("from=1.0")],
                "drain[0].from: it begins after 6 s, and the shot ends after 5 s",
            ),
            (
                vec![
                    sine.into(),
                    "effects.absorbing_zone={walls=[\"+x\"],length=3.0,period=1.5}".into(),
                ],
                vec![
                    sine.into(),
                    "effects.absorbing_zone={walls=[\"+x\"],length=3.2,period=1.5}".into(),
                ],
                "effects.absorbing_zone.length: 3 m is 0.48 of a wave length of wave_maker[0].motion's waves of 2.2987 s",
            ),
            (
                vec!["effects.drag={drop_radius=0.04}".into()],
                vec!["effects.drag={drop_radius=0.03}".into()],
                "effects.drag.drop_radius: a drop of 0.04 m radius holds 2.1 times the water of a particle",
            ),
            // √(9.81 × 0.1) × 0.1 × 1000 / μ.
            (
                vec!["effects.viscosity={coefficient=0.001}".into()],
                vec!["effects.viscosity={coefficient=0.1}".into()],
                "effects.viscosity.coefficient: the Reynolds number √(g Δx) Δx / ν of a cell of 0.1 m is 990",
            ),
            // Bond numbers of a spacing of 0.05 m: 1000 × 9.81 × 0.05² / σ.
            (
                vec!["effects.surface_tension={coefficient=0.0728}".into()],
                vec!["effects.surface_tension={coefficient=24.6}".into()],
                "effects.surface_tension.coefficient: the Bond number ρ g d² / σ of a particle spacing of 0.05 m is 33",
            ),
        ] {
            let set: Vec<&str> = set.iter().map(String::as_str).collect();
            let found = lints(&set);
            let [only] = &found[..] else {
                panic!("{set:?}: {found:?}")
            };
            assert!(only.contains(expected), "{only}");
            let good: Vec<&str> = good.iter().map(String::as_str).collect();
            assert_eq!(lints(&good), [] as [&str; 0], "{good:?}");
        }
    }

    /// Each kind of motion hands in a height of its own.
    #[test]
    fn each_motion_that_makes_waves_is_looked_at() {
        for motion in [
            "kind=\"sine\",stroke=0.02,period=2.2987",
            "kind=\"solitary\",height=0.02,depth=1.0",
            "kind=\"stokes\",height=0.02,period=2.2987,depth=1.0",
            "kind=\"cnoidal\",height=0.02,period=4.0,depth=1.0",
            "kind=\"sea\",significant_height=0.02,peak_period=2.5,depth=1.0",
            "kind=\"focused\",height=0.02,at=0.5,time=4.0,ramp=0.5,peak_period=2.5,depth=1.0",
        ] {
            let maker = format!("wave_maker=[{{wall=\"-x\",motion={{{motion}}}}}]");
            let found = lints(&[&maker]);
            assert!(
                found.len() == 1 && found[0].contains("particle spacings high"),
                "{motion}: {found:?}"
            );
        }
    }

    /// Those of the studies by theory as well.
    #[test]
    fn what_ships_is_meant() {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let mut read = 0;
        for folder in [scenes.clone(), scenes.join("validation")] {
            for entry in std::fs::read_dir(folder).expect("a folder") {
                let file = entry.expect("an entry").path();
                if file.extension().is_some_and(|end| end == "toml") {
                    let scene = Scene::load(&file, &[]).expect("valid");
                    let mut lints = scene.lints();
                    // The paper's iterations alone are what it is there for.
                    if file.ends_with("basin.toml") {
                        lints.retain(|lint| !lint.starts_with("solver.pbf.grid_projection: 24 "));
                    }
                    // Canopies before shops are as thick as such things are.
                    if file.ends_with("wave-city.toml") {
                        lints.retain(|lint| !lint.starts_with("solid[0]: city is 0.1000 m thick"));
                    }
                    assert_eq!(lints, [] as [&str; 0], "{}", file.display());
                    read += 1;
                }
            }
        }
        assert!(read > 12, "{read}");
    }
}
