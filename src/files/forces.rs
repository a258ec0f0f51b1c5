//! `[[force]]`: accelerations in a room, for a time.

use glam::DVec3;

use super::{
    document::Document,
    fit::comes_into,
    keys::ForceSpec,
    sources::{Around, room, window},
};
use swell_domain::{
    forces::{Force, ForceKind, Law},
    sources::Window,
};
use swell_scene::{
    SceneError, Shot,
    forces::PlacedForce,
    words::{chain, extent},
};

/// Least length of an axis; only its direction matters.
const LEAST_DIRECTION: f64 = 1e-6;

type Result<T> = std::result::Result<T, SceneError>;

pub(super) fn forces(
    doc: &Document<'_>,
    specs: &[ForceSpec],
    around: &Around<'_>,
) -> Result<Vec<PlacedForce>> {
    let all = specs.iter().enumerate();
    all.map(|(index, spec)| force(doc, &format!("force[{index}]"), spec, around))
        .collect()
}

fn force(
    doc: &Document<'_>,
    path: &str,
    spec: &ForceSpec,
    around: &Around<'_>,
) -> Result<PlacedForce> {
    if spec.on.is_empty() {
        let problem = "names nothing; allowed: water, whitewater";
        return Err(doc.fault_of_plain(&format!("{path}.on"), problem));
    }
    let mut placed = PlacedForce {
        region: None,
        force: Force {
            kind: kind(doc, path, spec)?,
            room: None,
            fade: spec.fade,
            window: window(doc, path, spec.from, spec.until)?,
            on: spec.on.clone(),
        },
    };
    let Some((region, key)) = room(doc, path, (&spec.min, &spec.max, &spec.mesh), around)? else {
        if spec.fade > 0.0 {
            let problem = "it has no room that it could fade in from: name min and max, or mesh";
            return Err(doc.fault_of_plain(&format!("{path}.fade"), problem));
        }
        return Ok(placed);
    };
    if !comes_into(&region.bounds(), around.domain, region.rounding()) {
        let problem = format!(
            "it lies outside of the domain: it spans {}, the domain spans {}",
            extent(Some(region.bounds())),
            extent(Some(*around.domain))
        );
        return Err(doc.fault_of(&key, problem));
    }
    let shape = region.force_room(around.spacing);
    placed.force.room = Some(shape.map_err(|error| doc.fault_of(&key, chain(&error)))?);
    placed.region = Some(region);
    Ok(placed)
}

fn kind(doc: &Document<'_>, path: &str, spec: &ForceSpec) -> Result<ForceKind> {
    let missing = |key: &str| doc.fault_of(&format!("{path}.{key}"), "missing");
    let vector = |key: &str, value: Option<[f64; 3]>| {
        value.map(DVec3::from_array).ok_or_else(|| missing(key))
    };
    let law = || {
        Ok(Law {
            strength: spec.strength.ok_or_else(|| missing("strength"))?,
            core: spec.core.ok_or_else(|| missing("core"))?,
            falloff: spec.falloff.unwrap_or_default(),
        })
    };
    let [_, vortex, attract] = ForceKind::NAMES;
    if spec.kind == attract {
        return Ok(ForceKind::Attract {
            at: vector("at", spec.at)?,
            law: law()?,
        });
    }
    if spec.kind != vortex {
        return Ok(ForceKind::Acceleration(vector(
            "acceleration",
            spec.acceleration,
        )?));
    }
    let axis = vector("axis", spec.axis)?;
    if axis.length() < LEAST_DIRECTION {
        return Err(doc.fault_of(&format!("{path}.axis"), "it has no direction"));
    }
    Ok(ForceKind::Vortex {
        at: vector("at", spec.at)?,
        axis: axis.normalize(),
        law: law()?,
    })
}

/// Speed that forces may give to water in the shot, m/s, beyond that of a fall: a vortex pushes
/// water along its circle again and again.
pub(super) fn speed(forces: &[PlacedForce], shot: &Shot) -> f64 {
    let length = |window: &Window| window.length(shot.duration());
    let vortices = forces.iter().map(|it| match it.force.kind {
        ForceKind::Vortex { .. } => it.force.kind.most() * length(&it.force.window),
        _ => 0.0,
    });
    vortices.sum()
}

/// Largest acceleration by forces, m/s², of which a fall is one.
pub(super) fn pull(forces: &[PlacedForce]) -> f64 {
    forces.iter().map(|it| it.force.kind.most()).sum()
}

/// Returns what a file says of a force, apart from its room; world coordinates, metres.
pub(super) fn written(force: &Force, origin: DVec3) -> ForceSpec {
    let mut spec = ForceSpec {
        kind: ForceKind::NAMES[force.kind.number()].to_owned(),
        min: None,
        max: None,
        mesh: None,
        fade: force.fade,
        acceleration: None,
        at: None,
        axis: None,
        strength: None,
        core: None,
        falloff: None,
        on: force.on.clone(),
        from: force.window.from,
        until: force.window.until,
    };
    let mut set = |at: DVec3, law: &Law| {
        spec.at = Some((at + origin).to_array());
        (spec.strength, spec.core) = (Some(law.strength), Some(law.core));
        spec.falloff = Some(law.falloff);
    };
    match &force.kind {
        ForceKind::Acceleration(acceleration) => {
            spec.acceleration = Some(acceleration.to_array());
        }
        ForceKind::Vortex { at, axis, law } => {
            set(*at, law);
            spec.axis = Some(axis.to_array());
        }
        ForceKind::Attract { at, law } => set(*at, law),
        // The motion of the domain is none of the scene's forces.
        ForceKind::Frame(..) => {}
    }
    spec
}
