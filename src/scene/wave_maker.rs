//! Wave-makers: which keys a motion takes, its table, and whether the walls stay apart.

use std::{f64::consts::PI, fs::File, io::Read as _, path::Path};

use glam::DVec3;
use toml::Spanned;

use super::{
    Shot, Wall, WaveMaker,
    build::{chain, number},
    document::{Document, unknown_key},
    error::SceneError,
    ranges::{Interval, LENGTH, PERIOD, SPEED, UNTIL},
    spec::{MotionSpec, WaveMakerSpec},
    words::{shown, shown_all},
};
use crate::domain::{bounds::Bounds, motion::Motion};

/// Largest motion table read, bytes: ten hours at 60 points a second.
const MAX_TABLE_BYTES: u64 = 64 << 20;

type Result<T> = std::result::Result<T, SceneError>;

/// What a motion has to fit into.
pub(super) struct Surroundings<'a> {
    pub(super) base_dir: &'a Path,
    pub(super) domain: &'a Bounds,
    pub(super) gravity: DVec3,
    /// Between two walls, or a wall and the opposite face, metres.
    pub(super) least_gap: f64,
    pub(super) shot: &'a Shot,
}

/// Builds and checks all of them.
pub(super) fn build_all(
    doc: &Document<'_>,
    specs: &[WaveMakerSpec],
    around: &Surroundings<'_>,
) -> Result<Vec<WaveMaker>> {
    let mut makers = Vec::<WaveMaker>::new();
    for spec in specs {
        let wall = wall(doc, &spec.wall)?;
        if makers.iter().any(|m| m.wall == wall) {
            let problem = format!("a second wave maker on the wall {}", wall.name());
            return Err(doc.fault_at(spec.wall.span(), problem));
        }
        let motion = motion(doc, around.base_dir, &spec.motion, around.gravity)?;
        let size = around.domain.size()[wall.axis];
        let room = size - around.least_gap;
        let reach = motion.peak_displacement(around.shot.duration());
        if reach > room {
            let problem = format!(
                "the wall {} crosses the whole domain: within the {} s of the shot it moves {} m of {} m",
                wall.name(),
                shown(around.shot.duration()),
                shown(reach),
                shown(size)
            );
            return Err(doc.fault_at(spec.motion.span(), problem));
        }
        let opposite = makers
            .iter()
            .find(|m| m.wall.axis == wall.axis && m.wall.is_max != wall.is_max);
        if let Some(opposite) = opposite
            && let Some(t) = meeting_time(&motion, &opposite.motion, room, around.shot.duration())
        {
            let problem = format!(
                "the walls {} and {} collide {t:.3} s into the shot",
                opposite.wall.name(),
                wall.name()
            );
            return Err(doc.fault_at(spec.motion.span(), problem));
        }
        makers.push(WaveMaker { wall, motion });
    }
    Ok(makers)
}

/// When two motions together first use up `room`. Steps through the shot, and from each time no
/// farther than the walls can get at their peak speed, so that no meeting is stepped over.
fn meeting_time(a: &Motion, b: &Motion, room: f64, duration: f64) -> Option<f64> {
    const STEPS: u32 = 10_000;
    let step = duration / f64::from(STEPS);
    (0..STEPS).map(|i| step * f64::from(i)).find(|&t| {
        let gap = room - a.displacement(t) - b.displacement(t);
        let closing = a.peak_speed(t, t + step) + b.peak_speed(t, t + step);
        gap < closing * step
    })
}

fn wall(doc: &Document<'_>, spec: &Spanned<String>) -> Result<Wall> {
    Wall::NAMED
        .iter()
        .find(|(name, _)| name == spec.get_ref())
        .map(|(_, wall)| *wall)
        .ok_or_else(|| doc.fault_at(spec.span(), format!("{:?} is no wall", spec.get_ref())))
}

/// A motion's table with the keys that its kind takes.
struct Keys<'a, 'b> {
    doc: &'a Document<'b>,
    motion: &'a Spanned<MotionSpec>,
}

impl Keys<'_, '_> {
    fn needed(&self, value: &Option<Spanned<f64>>, name: &str, range: &Interval) -> Result<f64> {
        match value {
            Some(value) => number(self.doc, value, range),
            None => Err(self.doc.missing(self.motion.span(), name)),
        }
    }

    /// Refuses keys that stand there but mean nothing to this kind.
    fn only(&self, allowed: &[&str]) -> Result<()> {
        let m = self.motion.get_ref();
        let given = [
            ("velocity", m.velocity.as_ref().map(Spanned::span)),
            ("until", m.until.as_ref().map(Spanned::span)),
            ("stroke", m.stroke.as_ref().map(Spanned::span)),
            ("period", m.period.as_ref().map(Spanned::span)),
            ("ramp", m.ramp.as_ref().map(Spanned::span)),
            ("height", m.height.as_ref().map(Spanned::span)),
            ("depth", m.depth.as_ref().map(Spanned::span)),
            ("file", m.file.as_ref().map(Spanned::span)),
            ("points", m.points.as_ref().map(Spanned::span)),
        ];
        for (name, span) in given {
            if let Some(span) = span
                && !allowed.contains(&name)
            {
                let allowed: Vec<_> = allowed.iter().map(|&s| s.to_owned()).collect();
                let problem = format!(
                    "{} in a motion of kind {:?}",
                    unknown_key(name, &allowed),
                    m.kind.get_ref()
                );
                return Err(self.doc.fault_plain(span, problem));
            }
        }
        Ok(())
    }
}

/// Builds a motion's table.
pub(super) fn motion(
    doc: &Document<'_>,
    base_dir: &Path,
    spec: &Spanned<MotionSpec>,
    gravity: DVec3,
) -> Result<Motion> {
    let keys = Keys { doc, motion: spec };
    let m = spec.get_ref();
    match m.kind.get_ref().as_str() {
        "constant_velocity" => {
            keys.only(&["velocity", "until"])?;
            Ok(Motion::ConstantVelocity {
                velocity: keys.needed(&m.velocity, "velocity", &SPEED)?,
                until: match &m.until {
                    Some(until) => Some(number(doc, until, &UNTIL)?),
                    None => None,
                },
            })
        }
        "sine" => {
            keys.only(&["stroke", "period", "ramp"])?;
            let period = keys.needed(&m.period, "period", &PERIOD)?;
            let stroke = keys.needed(&m.stroke, "stroke", &LENGTH)?;
            check_speed(PI * stroke / period)
                .map_err(|problem| doc.fault_plain(spec.span(), problem))?;
            Ok(Motion::Sine {
                stroke,
                period,
                ramp: match &m.ramp {
                    Some(ramp) if *ramp.get_ref() != 0.0 => number(doc, ramp, &PERIOD)?,
                    Some(_) => 0.0,
                    None => period,
                },
            })
        }
        "solitary" => {
            keys.only(&["height", "depth"])?;
            let depth = keys.needed(&m.depth, "depth", &LENGTH)?;
            let height = keys.needed(&m.height, "height", &LENGTH)?;
            if let Some(span) = m.height.as_ref().map(Spanned::span)
                && height > depth
            {
                let problem = format!(
                    "a wave of {} m on {} m of water",
                    shown(height),
                    shown(depth)
                );
                return Err(doc.fault_at(span, problem));
            }
            if gravity.length() == 0.0 {
                return Err(doc.fault_at(m.kind.span(), "a solitary wave needs gravity"));
            }
            Ok(Motion::Solitary {
                height,
                depth,
                gravity: gravity.length(),
            })
        }
        "table" => {
            keys.only(&["file", "points"])?;
            table(doc, base_dir, spec)
        }
        other => Err(doc.fault_at(m.kind.span(), format!("{other:?} is no kind of motion"))),
    }
}

fn table(doc: &Document<'_>, base_dir: &Path, spec: &Spanned<MotionSpec>) -> Result<Motion> {
    let m = spec.get_ref();
    let (points, span) = match (&m.points, &m.file) {
        (Some(points), None) => (points.get_ref().clone(), points.span()),
        (None, Some(file)) => {
            let path = doc.find(base_dir, file)?;
            let points = read_table(&path).map_err(|problem| {
                doc.fault_at(file.span(), format!("{}: {problem}", path.display()))
            })?;
            (points, file.span())
        }
        (Some(points), Some(_)) => {
            return Err(doc.fault_at(points.span(), "given together with file"));
        }
        (None, None) => return Err(doc.missing(spec.span(), "points")),
    };
    check_points(&points).map_err(|problem| doc.fault_at(span, problem))?;
    Ok(Motion::Table { points })
}

fn check_points(points: &[[f64; 2]]) -> std::result::Result<(), String> {
    if points.len() < 2 {
        return Err(format!("{} points are too few", points.len()));
    }
    for (i, [t, x]) in points.iter().enumerate() {
        // 1e9 keeps sums and products of them finite.
        if !((0.0..=1e9).contains(t) && (0.0..=1e9).contains(x)) {
            return Err(format!(
                "point {i}, {}, is out of range",
                shown_all(&[*t, *x])
            ));
        }
    }
    if points[0][1] != 0.0 {
        return Err(format!("the first displacement is {}", shown(points[0][1])));
    }
    for (i, pair) in points.windows(2).enumerate() {
        if pair[1][0] - pair[0][0] < 1e-6 {
            return Err(format!(
                "the time of point {}, {} s, is not a microsecond after {} s",
                i + 1,
                shown(pair[1][0]),
                shown(pair[0][0])
            ));
        }
        check_speed((pair[1][1] - pair[0][1]).abs() / (pair[1][0] - pair[0][0]))
            .map_err(|problem| format!("up to point {}, {problem}", i + 1))?;
    }
    Ok(())
}

/// What a motion's keys together come to has the range that a velocity has.
fn check_speed(speed: f64) -> std::result::Result<(), String> {
    if speed <= *SPEED.end() {
        return Ok(());
    }
    Err(format!(
        "it moves at {} m/s; allowed: up to {} m/s",
        shown(speed),
        shown(*SPEED.end())
    ))
}

/// `time,displacement` a line; empty lines, those that start with `#`, and one line of titles are
/// skipped.
fn read_table(path: &Path) -> std::result::Result<Vec<[f64; 2]>, String> {
    let mut text = String::new();
    File::open(path)
        .and_then(|file| file.take(MAX_TABLE_BYTES + 1).read_to_string(&mut text))
        .map_err(|e| chain(&e))?;
    if text.len() as u64 > MAX_TABLE_BYTES {
        return Err(format!("larger than {} MiB", MAX_TABLE_BYTES >> 20));
    }
    let mut points = Vec::new();
    let mut is_first = true;
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let values: Vec<Option<f64>> = line.split(',').map(|v| v.trim().parse().ok()).collect();
        match values[..] {
            [Some(t), Some(x)] => points.push([t, x]),
            [None, None] if is_first => {}
            _ => {
                return Err(format!(
                    "line {}: {line:?} is not time,displacement",
                    number + 1
                ));
            }
        }
        is_first = false;
    }
    Ok(points)
}
