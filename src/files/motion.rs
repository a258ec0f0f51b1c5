//! Motions of walls and solids: reading them from a scene, and writing them.

use std::{f64::consts::PI, path::Path};

use super::{
    document::Document,
    keys::{MotionKind, SolidMotionSpec, TurnSpec, WallMotionSpec},
    motion_table::{Allowed, table},
    regular_waves, seas,
};
use swell_domain::motion::{Motion, Phases, RegularWaves, SeaParameters, Spectrum};
use swell_scene::{SceneError, waves, words::shown};

type Result<T> = std::result::Result<T, SceneError>;

/// Returns the value of a key that the table of keys requires for the kind of the motion.
fn needed<T: Copy>(value: Option<T>) -> T {
    value.expect("the table of keys requires it for this kind")
}

/// Builds the motion of the table at `path` under a gravity, m/s².
pub(super) fn build(
    doc: &Document<'_>,
    path: &str,
    base_dir: &Path,
    spec: &WallMotionSpec,
    (gravity, allowed): (f64, Allowed),
) -> Result<Motion> {
    match spec.kind {
        MotionKind::Still => Ok(Motion::Still),
        MotionKind::ConstantVelocity => Ok(Motion::ConstantVelocity {
            velocity: needed(spec.velocity),
            until: spec.until,
        }),
        MotionKind::Sine => {
            let (stroke, period) = (needed(spec.stroke), needed(spec.period));
            (allowed.check_speed)(PI * stroke / period)
                .map_err(|problem| doc.fault_of_plain(path, problem))?;
            Ok(Motion::Sine {
                stroke,
                period,
                ramp: spec.ramp.unwrap_or(period),
            })
        }
        MotionKind::Solitary => solitary(doc, path, spec, gravity),
        MotionKind::Stokes => regular_waves::stokes(doc, path, regular(spec, gravity)),
        MotionKind::Cnoidal => regular_waves::cnoidal(doc, path, regular(spec, gravity)),
        MotionKind::Sea => {
            let phases = Phases::Random {
                significant_height: needed(spec.significant_height),
                seed: needed(spec.seed),
            };
            sea(doc, path, spec, gravity, phases)
        }
        MotionKind::Focused => {
            let phases = Phases::Focused {
                height: needed(spec.height),
                at: needed(spec.at),
                time: needed(spec.time),
            };
            sea(doc, path, spec, gravity, phases)
        }
        MotionKind::Table => table(doc, path, base_dir, (&spec.file, &spec.points), allowed),
    }
}

fn solitary(doc: &Document<'_>, path: &str, spec: &WallMotionSpec, gravity: f64) -> Result<Motion> {
    let (height, depth) = (needed(spec.height), needed(spec.depth));
    if height > depth {
        let problem = format!(
            "a wave of {} m on {} m of water",
            shown(height),
            shown(depth)
        );
        return Err(doc.fault_of(&format!("{path}.height"), problem));
    }
    if gravity == 0.0 {
        let problem = "a solitary wave needs gravity";
        return Err(doc.fault_of(&format!("{path}.kind"), problem));
    }
    Ok(Motion::Solitary {
        height,
        depth,
        gravity,
    })
}

fn regular(spec: &WallMotionSpec, gravity: f64) -> RegularWaves {
    let [height, period, depth] = [spec.height, spec.period, spec.depth].map(needed);
    waves::regular([height, period, depth, gravity], spec.ramp)
}

fn sea(
    doc: &Document<'_>,
    path: &str,
    spec: &WallMotionSpec,
    gravity: f64,
    phases: Phases,
) -> Result<Motion> {
    let shape = seas::shape(doc, path, needed(spec.spectrum), spec.peak_enhancement)?;
    let water = [needed(spec.peak_period), needed(spec.depth), gravity];
    let asked = SeaParameters {
        second_order: needed(spec.second_order),
        ..seas::asked(shape, water, [spec.shortest_period, spec.ramp], phases)
    };
    seas::build(doc, path, asked)
}

/// Gravity is omitted because it is that of the water.
impl From<&Motion> for WallMotionSpec {
    fn from(motion: &Motion) -> Self {
        match motion {
            Motion::Still => Self::default(),
            Motion::ConstantVelocity { velocity, until } => Self {
                kind: MotionKind::ConstantVelocity,
                velocity: Some(*velocity),
                until: *until,
                ..Self::default()
            },
            Motion::Sine {
                stroke,
                period,
                ramp,
            } => Self {
                kind: MotionKind::Sine,
                stroke: Some(*stroke),
                period: Some(*period),
                ramp: Some(*ramp),
                ..Self::default()
            },
            Motion::Solitary { height, depth, .. } => Self {
                kind: MotionKind::Solitary,
                height: Some(*height),
                depth: Some(*depth),
                ..Self::default()
            },
            Motion::Stokes(stokes) => Self::of_waves(MotionKind::Stokes, stokes.waves()),
            Motion::Cnoidal(cnoidal) => Self::of_waves(MotionKind::Cnoidal, cnoidal.waves()),
            Motion::Sea(sea) => Self::of_sea(sea.asked()),
            Motion::Table { points } => Self {
                kind: MotionKind::Table,
                points: Some(points.clone()),
                ..Self::default()
            },
        }
    }
}

impl WallMotionSpec {
    fn of_waves(kind: MotionKind, waves: &RegularWaves) -> Self {
        Self {
            kind,
            height: Some(waves.height),
            period: Some(waves.period),
            depth: Some(waves.depth),
            ramp: Some(waves.ramp),
            ..Self::default()
        }
    }

    fn of_sea(asked: &SeaParameters) -> Self {
        let of_phases = match asked.phases {
            Phases::Random {
                significant_height,
                seed,
            } => Self {
                kind: MotionKind::Sea,
                significant_height: Some(significant_height),
                seed: Some(seed),
                ..Self::default()
            },
            Phases::Focused { height, at, time } => Self {
                kind: MotionKind::Focused,
                height: Some(height),
                at: Some(at),
                time: Some(time),
                ..Self::default()
            },
        };
        let has_peak = asked.spectrum != Spectrum::PiersonMoskowitz;
        Self {
            depth: Some(asked.depth),
            spectrum: Some(asked.spectrum),
            peak_enhancement: has_peak.then_some(asked.peak_enhancement),
            peak_period: Some(asked.peak_period),
            shortest_period: Some(asked.shortest_period),
            ramp: Some(asked.ramp),
            second_order: Some(asked.second_order),
            ..of_phases
        }
    }
}

/// Converts the motion of a solid, which is one of a wall with fewer kinds, in both directions.
macro_rules! motion_of_solid {
    ($spec:ident, $velocity:ident, $stroke:ident) => {
        impl From<&$spec> for WallMotionSpec {
            fn from(spec: &$spec) -> Self {
                Self {
                    kind: spec.kind,
                    velocity: spec.$velocity,
                    until: spec.until,
                    stroke: spec.$stroke,
                    period: spec.period,
                    ramp: spec.ramp,
                    file: spec.file.clone(),
                    points: spec.points.clone(),
                    ..Self::default()
                }
            }
        }

        impl From<WallMotionSpec> for $spec {
            fn from(spec: WallMotionSpec) -> Self {
                Self {
                    kind: spec.kind,
                    $velocity: spec.velocity,
                    until: spec.until,
                    $stroke: spec.stroke,
                    period: spec.period,
                    ramp: spec.ramp,
                    file: spec.file,
                    points: spec.points,
                }
            }
        }
    };
}

motion_of_solid!(SolidMotionSpec, velocity, stroke);
// Angles take the place of distances.
motion_of_solid!(TurnSpec, degrees_per_second, swing_degrees);
