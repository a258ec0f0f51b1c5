//! Reads moving solids: a mesh that slides along a direction, turns about an axis, or both.

use glam::DVec3;

use swell_domain::bounds::Bounds;
use swell_scene::{
    PlacedMesh, SceneError, Shot,
    moving_solid::{MovingSolid, Slide, Turn},
    words::{extent, shown},
};

use super::{
    document::Document,
    fit::comes_into,
    keys::{MeshSpec, SolidSpec, WallMotionSpec},
    motion,
    motion_table::{ANGLES, Allowed, WAYS},
    solid_track,
    speed::check_speed,
    wave_maker,
};

/// Least length of a direction vector; only its direction matters.
const LEAST_DIRECTION: f64 = 1e-6;

type Result<T> = std::result::Result<T, SceneError>;

impl SolidSpec {
    /// Whether it is a moving solid.
    pub(super) fn moves(&self) -> bool {
        let rigid = self.motion.is_some() || self.turn.is_some() || self.track.is_some();
        rigid || self.sequence.is_some()
    }

    /// Returns its mesh at the start, `file` with this hash.
    pub(super) fn placed(&self, file: &str, blake3: Option<&String>) -> MeshSpec {
        MeshSpec {
            file: file.to_owned(),
            blake3: blake3.cloned(),
            translate: self.translate,
            rotate_degrees: self.rotate_degrees,
            scale: self.scale,
        }
    }
}

/// Builds the moving solid at `path` from its mesh and its keys.
pub(super) fn build(
    doc: &Document<'_>,
    path: &str,
    placed: PlacedMesh,
    spec: &SolidSpec,
    around: &wave_maker::Surroundings<'_>,
) -> Result<MovingSolid> {
    let at = |key: &str| format!("{path}.{key}");
    let direction = |key: &str, of: [f64; 3]| {
        let found = DVec3::from_array(of);
        match found.length() < LEAST_DIRECTION {
            true => Err(doc.fault_of(&at(key), "no direction")),
            false => Ok(found),
        }
    };
    let motion = |key: &str, spec: &WallMotionSpec, allowed: Allowed| {
        let by = (around.gravity.length(), allowed);
        motion::build(doc, &at(key), around.base_dir, spec, by)
    };
    let slide = match (spec.direction, &spec.motion) {
        (Some(way), Some(moves)) => {
            let motion = motion("motion", &moves.into(), WAYS)?;
            let direction = direction("direction", way)?;
            Some(Slide { direction, motion })
        }
        _ => None,
    };
    let turn = match (spec.pivot, spec.axis, &spec.turn) {
        (Some(pivot), Some(axis), Some(turns)) => {
            let motion = motion("turn", &turns.into(), ANGLES)?;
            let pivot = DVec3::from_array(pivot);
            Some(Turn::new(
                pivot,
                direction("axis", axis)?,
                motion,
                &placed.mesh,
            ))
        }
        _ => None,
    };
    let track = match &spec.track {
        Some(track) => {
            let around = (around.base_dir, around.shot);
            let (path, mesh) = (at("track"), &placed.mesh);
            Some(solid_track::build(doc, &path, around, track, mesh)?)
        }
        None => None,
    };
    let solid = MovingSolid {
        placed,
        slide,
        turn,
        track,
        sequence: None,
        body: None,
        floor: None,
    };
    check_way(doc, &solid, path, around.domain, around.shot)?;
    Ok(solid)
}

/// Checks that the solid enters the domain at some time and that its motion is plausible: a
/// displacement of more than ten domain lengths or an extreme speed is taken for a typing error.
pub(super) fn check_way(
    doc: &Document<'_>,
    solid: &MovingSolid,
    path: &str,
    domain: &Bounds,
    shot: &Shot,
) -> Result<()> {
    const FAR: f64 = 10.0;
    let key = solid.key();
    let place = format!("{path}.{key}");
    let (farthest, direction) = match &solid.slide {
        Some(slide) => (
            slide.motion.peak_displacement(shot.duration()),
            slide.direction.normalize(),
        ),
        None => (0.0, DVec3::ZERO),
    };
    let size = domain.size().max_element();
    if farthest > FAR * size {
        let problem = format!(
            "within the {} s of the shot the solid moves {} m, and the domain is {} m long",
            shown(shot.duration()),
            shown(farthest),
            shown(size)
        );
        return Err(doc.fault_of(&place, problem));
    }
    let speed = solid.peak_speed(&[], 0.0, shot.duration());
    check_speed(speed).map_err(|problem| doc.fault_of_plain(&place, problem))?;
    let ball = |middle: DVec3, reach: f64| {
        let point = Bounds {
            min: middle,
            max: middle,
        };
        point.grown(reach)
    };
    let joined = |a: Bounds, b: Bounds| Bounds {
        min: a.min.min(b.min),
        max: a.max.max(b.max),
    };
    let way = farthest * direction;
    let swept = match (&solid.track, &solid.turn) {
        (Some(track), _) => {
            let (places, reach) = track.places();
            places.map(|at| ball(at, reach)).reduce(joined)
        }
        // The solid may turn to any angle.
        (None, Some(turn)) => Some(ball(turn.pivot, turn.reach)),
        (None, None) => match &solid.sequence {
            Some(sequence) => Some(sequence.shape.bounds()),
            None => solid.placed.mesh.bounds(),
        },
    };
    let swept = swept.map(|b| joined(b, b.moved(way)));
    if swept.is_some_and(|b| comes_into(&b, domain, solid.placed.rounding)) {
        return Ok(());
    }
    let problem = format!(
        "the solid never enters the domain: its path spans {}, the domain spans {}",
        extent(swept),
        extent(Some(*domain))
    );
    Err(doc.fault_of(&place, problem))
}
