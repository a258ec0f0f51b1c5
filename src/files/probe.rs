//! `[[probe]]`: quantities measured at each frame and written beside the particles.

use glam::{DVec2, DVec3};

use super::{
    document::Document,
    keys::{BearerSpec, FRONT_QUANTILE, ProbeSpec, RUN_UP_QUANTILE},
};
use swell_domain::{bounds::Bounds, probe::Rate, sparse_grid::EDGE, surface::MAX_BRICKS};
use swell_scene::{
    Iteration, Method, PlacedMesh, SceneError, Shot, Solver,
    probe::{Bearer, Probe, ProbeKind},
    words::extent,
};

/// Parts of the scene that probes are checked against.
pub(super) struct Around<'a> {
    pub(super) domain: &'a Bounds,
    pub(super) periodic: [bool; 3],
    pub(super) shot: &'a Shot,
    pub(super) solver: &'a Solver,
    pub(super) solids: &'a [PlacedMesh],
    /// Moving solids at their initial placement.
    pub(super) moving: Vec<&'a PlacedMesh>,
    /// For each solid in the scene's order, whether it moves.
    pub(super) is_moving: &'a [bool],
}

/// Builds all probes. The default name of a probe is its kind and its number among
/// those of its kind.
pub(super) fn build_all(
    doc: &Document<'_>,
    specs: &[ProbeSpec],
    around: &Around<'_>,
) -> Result<Vec<Probe>, SceneError> {
    let Around {
        domain,
        shot,
        solver,
        ..
    } = *around;
    let mut probes = Vec::<Probe>::new();
    for (index, spec) in specs.iter().enumerate() {
        let path = format!("probe[{index}]");
        let kind = kind(doc, &path, spec, around)?;
        let unfit = match kind {
            ProbeKind::Pressure { .. } => why_no_pressure(solver),
            ProbeKind::Volume => why_no_volume(domain, solver),
            ProbeKind::Force { .. } => why_no_force(solver),
            _ => None,
        };
        if let Some(problem) = unfit {
            return Err(doc.fault_of(&format!("{path}.kind"), problem));
        }
        if let Some(problem) = why_not_so_often(spec.rate_hz, shot, solver) {
            return Err(doc.fault_of(&format!("{path}.rate_hz"), problem));
        }
        let alike = probes.iter().filter(|p| p.kind.name() == kind.name());
        let default = || format!("{}-{}", kind.name(), alike.count() + 1);
        let probe = Probe {
            name: spec.name.clone().unwrap_or_else(default),
            kind,
            rate: spec.rate_hz,
            window: spec.window,
        };
        let is_alike = |known: &&Probe| known.name.eq_ignore_ascii_case(&probe.name);
        if let Some(known) = probes.iter().find(is_alike) {
            let mut problem = second(&known.name, &probe.name);
            if spec.name.is_none() {
                problem += ", the default for its kind and position: set name to another";
            }
            return Err(doc.fault_of(&format!("{path}.name"), problem));
        }
        probes.push(probe);
    }
    Ok(probes)
}

/// Describes why two probes cannot have these names.
fn second(known: &str, name: &str) -> String {
    let mut problem = format!("a second probe is named {name:?}");
    if known != name {
        problem += &format!(
            ": {known:?} is the same file where upper and lower case are not distinguished, as on \
             Windows and macOS"
        );
    }
    problem
}

/// Reads the kind of the probe at `path` and checks that its point is in the domain.
fn kind(
    doc: &Document<'_>,
    path: &str,
    spec: &ProbeSpec,
    around: &Around<'_>,
) -> Result<ProbeKind, SceneError> {
    let domain = around.domain;
    let fault = |problem: String| doc.fault_of(&format!("{path}.at"), problem);
    let given = spec.at.as_deref().unwrap_or_default();
    let wrong = |count: usize| {
        let problem = format!(
            "{} {}, and a probe of {} takes {count}",
            given.len(),
            if given.len() == 1 {
                "number"
            } else {
                "numbers"
            },
            spec.kind
        );
        fault(problem)
    };
    // The table of keys requires it for these kinds.
    let towards = || {
        let missing = || doc.fault_of(&format!("{path}.axis"), "missing".to_owned());
        spec.axis.ok_or_else(missing)
    };
    let (kind, point) = match spec.kind.as_str() {
        "elevation" => {
            let at = <[f64; 2]>::try_from(given).map_err(|_| wrong(2))?;
            let at = DVec2::from_array(at);
            let point = DVec3::new(at.x, domain.min.y, at.y);
            (ProbeKind::Elevation { at }, point)
        }
        "pressure" => {
            let at = <[f64; 3]>::try_from(given).map_err(|_| wrong(3))?;
            let at = DVec3::from_array(at);
            (ProbeKind::Pressure { at }, at)
        }
        "flux" => {
            let [at] = <[f64; 1]>::try_from(given).map_err(|_| wrong(1))?;
            let towards = towards()?;
            let mut point = domain.min;
            point[towards.axis] = at;
            (ProbeKind::Flux { towards, at }, point)
        }
        "force" => (force(doc, path, spec, around)?, domain.min),
        other => {
            let kind = match other {
                "energy" => ProbeKind::Energy,
                "front" => ProbeKind::Front {
                    towards: towards()?,
                    quantile: spec.quantile.unwrap_or(FRONT_QUANTILE),
                },
                "run_up" => ProbeKind::RunUp {
                    quantile: spec.quantile.unwrap_or(RUN_UP_QUANTILE),
                },
                _ => ProbeKind::Volume,
            };
            (kind, domain.min)
        }
    };
    if domain.contains(point) {
        return Ok(kind);
    }
    let all = extent(Some(*domain));
    Err(fault(format!(
        "{given:?} is outside the domain, which spans {all}"
    )))
}

/// Reads the body that bears a force, and the reference point of the moment: by default the centre
/// of the body at the start.
fn force(
    doc: &Document<'_>,
    path: &str,
    spec: &ProbeSpec,
    around: &Around<'_>,
) -> Result<ProbeKind, SceneError> {
    let fault = |problem: &str| doc.fault_of(&format!("{path}.solid"), problem.to_owned());
    let (on, bounds) = match spec.solid {
        None => return Err(fault("missing")),
        Some(BearerSpec::Wall(wall)) if around.periodic[wall.axis] => {
            return Err(fault(&format!(
                "there is no wall {}: domain.periodic joins both ends",
                wall.name()
            )));
        }
        Some(BearerSpec::Wall(wall)) => {
            let mut face = *around.domain;
            if wall.is_max {
                face.min[wall.axis] = face.max[wall.axis];
            } else {
                face.max[wall.axis] = face.min[wall.axis];
            }
            (Bearer::Wall(wall), Some(face))
        }
        Some(BearerSpec::Number(number)) => {
            let Some((&moves, before)) = around
                .is_moving
                .get(..=number)
                .and_then(<[bool]>::split_last)
            else {
                let count = around.is_moving.len();
                return Err(fault(&format!(
                    "{number}: the scene has {count} [[solid]], counted from 0"
                )));
            };
            let index = before.iter().filter(|&&other| other == moves).count();
            if moves {
                let mesh = &around.moving[index].mesh;
                (Bearer::MovingSolid(index), mesh.bounds())
            } else {
                (Bearer::Solid(index), around.solids[index].mesh.bounds())
            }
        }
    };
    let middle = |bounds: Bounds| 0.5 * (bounds.min + bounds.max);
    let about = spec.about.map(DVec3::from_array);
    let about = about.or(bounds.map(middle)).unwrap_or_default();
    Ok(ProbeKind::Force { on, about })
}

/// PBF's pressure is defined at particles, not on faces.
fn why_no_force(solver: &Solver) -> Option<String> {
    (solver.method() == Method::Pbf).then(|| {
        "solver pbf has no pressure on faces that a force could be summed from; choose \
         solver.method = \"flip\""
            .to_owned()
    })
}

/// Samples are taken at the ends of substeps, so their rate is limited by the number of substeps.
fn why_not_so_often(rate: Rate, shot: &Shot, solver: &Solver) -> Option<String> {
    let Rate::Hertz(rate) = rate else {
        return None;
    };
    let highest = shot.frames_per_second * f64::from(solver.max_substeps());
    let is_possible = LEAST_RATE <= rate && rate <= highest;
    (!is_possible).then(|| {
        format!(
            "{rate} a second; from {LEAST_RATE} to {highest} are possible: shot.frames_per_second \
             × solver.{}.max_substeps",
            solver.method().name()
        )
    })
}

/// Hz: one sample in about a quarter of an hour.
const LEAST_RATE: f64 = 1e-3;

/// PBF's pressure is the sum of its multipliers λ, which is complete only if all
/// corrections derive from λ.
fn why_no_pressure(solver: &Solver) -> Option<String> {
    let pbf = solver.pbf()?;
    if pbf.grid_projection {
        return None;
    }
    let why = if pbf.iteration == Iteration::Chebyshev {
        "with solver.pbf.iteration = \"chebyshev\" a part of each correction carries over from the \
         one before, which no pressure represents"
    } else if pbf.artificial_pressure > 0.0 {
        "with solver.pbf.artificial_pressure above 0 particles are also held apart by a force that \
         no pressure represents"
    } else {
        return None;
    };
    Some(why.to_owned())
}

/// The volume is counted on voxels of one spacing; their bricks are addressed by a
/// table over the water.
fn why_no_volume(domain: &Bounds, solver: &Solver) -> Option<String> {
    let brick = solver.particle_spacing() * f64::from(EDGE);
    let bricks = (domain.size() / brick).ceil();
    let is_too_large = bricks.element_product() > MAX_BRICKS;
    is_too_large.then(|| {
        format!("the domain has more than {MAX_BRICKS} bricks of {EDGE}³ particle spacings")
    })
}
