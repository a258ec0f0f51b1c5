//! `[[probe]]`: what is measured at each frame and written beside the particles.

use glam::{DVec2, DVec3};
use serde::Deserialize;

use super::{
    Iteration, Method, PlacedMesh, Scene, Shot, Solver, Wall, document::Document,
    error::SceneError, words::extent,
};
use swell_domain::{bounds::Bounds, probe::Rate, sparse_grid::EDGE, surface::MAX_BRICKS};

/// A gauge that has a CSV of its own in the cache.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// File-name safe; no other probe of the scene has it, upper and lower case taken alike.
    pub name: String,
    /// What it measures.
    pub kind: ProbeKind,
    /// How often.
    pub rate: Rate,
    /// Seconds up to each look over which the mean, the least and the greatest value are given too.
    pub window: Option<f64>,
}

/// What a probe measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProbeKind {
    /// Height of the water's surface.
    Elevation {
        /// x and z, metres.
        at: DVec2,
    },
    /// Pressure of the water at a point.
    Pressure {
        /// Position, metres.
        at: DVec3,
    },
    /// Kinetic, potential and total energy of all water.
    Energy,
    /// Volume of all water.
    Volume,
    /// Place behind which a part of the water lies.
    Front {
        /// The wall that it heads for.
        towards: Wall,
        /// The part, above 0 and up to 1.
        quantile: f64,
    },
    /// Height of the highest water that hangs together with the body.
    RunUp {
        /// Part of the body below it, above 0 and up to 1.
        quantile: f64,
    },
    /// Volume a second that crosses a plane.
    Flux {
        /// The wall towards which it counts as positive.
        towards: Wall,
        /// Where the plane crosses the axis, metres.
        at: f64,
    },
    /// Force of the pressure on a solid or a wall, and its moment.
    Force {
        /// Who bears it.
        on: Bearer,
        /// Where the moment is taken about, metres.
        about: DVec3,
    },
}

/// What bears a force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bearer {
    /// A solid by its number in [`Scene::solids`].
    Solid(usize),
    /// A solid by its number in [`Scene::moving_solids`].
    MovingSolid(usize),
    /// A face of the domain, with its wave maker.
    Wall(Wall),
}

impl Bearer {
    /// As a scene names it whose solids at rest stand before those that move: a number, or a wall's name.
    pub fn name(self, scene: &Scene) -> String {
        match self {
            Self::Solid(index) => index.to_string(),
            Self::MovingSolid(index) => (scene.solids.len() + index).to_string(),
            Self::Wall(wall) => wall.name().to_owned(),
        }
    }
}

/// A bearer as a scene names it.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
enum BearerSpec {
    Number(usize),
    Wall(Wall),
}

/// Of a front where the scene does not say: spray ahead of a breaking wave is less than the rest.
const FRONT_QUANTILE: f64 = 0.995;
/// The same of a run-up, which leaves out what has come off the body anyway.
const RUN_UP_QUANTILE: f64 = 1.0;

/// Both in words.
pub(super) fn quantile_words() -> String {
    format!("{FRONT_QUANTILE} of a front, {RUN_UP_QUANTILE} of a run_up")
}

impl ProbeKind {
    /// Names that scenes use.
    pub(super) const NAMES: [&str; 8] = [
        "elevation",
        "pressure",
        "energy",
        "volume",
        "front",
        "run_up",
        "flux",
        "force",
    ];

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMES[match self {
            Self::Elevation { .. } => 0,
            Self::Pressure { .. } => 1,
            Self::Energy => 2,
            Self::Volume => 3,
            Self::Front { .. } => 4,
            Self::RunUp { .. } => 5,
            Self::Flux { .. } => 6,
            Self::Force { .. } => 7,
        }]
    }

    /// What it gives a frame, with the units.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Elevation { .. } => &["elevation_m"],
            Self::Pressure { .. } => &["pressure_Pa"],
            Self::Energy => &["kinetic_J", "potential_J", "total_J"],
            Self::Volume => &["volume_m3"],
            Self::Front { .. } => &["front_m"],
            Self::RunUp { .. } => &["run_up_m"],
            Self::Flux { .. } => &["flux_m3/s"],
            Self::Force { .. } => &[
                "force_x_N",
                "force_y_N",
                "force_z_N",
                "moment_x_Nm",
                "moment_y_Nm",
                "moment_z_Nm",
            ],
        }
    }

    /// World coordinates of its point, metres: x and z, or x, y and z, or that of a plane, or none; of a force what its
    /// moment is about. `origin` is the
    /// scene's.
    pub fn at(self, origin: DVec3) -> Vec<f64> {
        match self {
            Self::Elevation { at } => (at + DVec2::new(origin.x, origin.z)).to_array().to_vec(),
            Self::Pressure { at } | Self::Force { about: at, .. } => {
                (at + origin).to_array().to_vec()
            }
            Self::Flux { towards, at } => vec![at + origin[towards.axis]],
            Self::Energy | Self::Volume | Self::Front { .. } | Self::RunUp { .. } => Vec::new(),
        }
    }

    /// The direction that counts as positive or ahead, where it has one.
    pub fn towards(self) -> Option<Wall> {
        match self {
            Self::Front { towards, .. } | Self::Flux { towards, .. } => Some(towards),
            _ => None,
        }
    }

    /// The part of the water that it looks at, where it has one.
    pub fn quantile(self) -> Option<f64> {
        match self {
            Self::Front { quantile, .. } | Self::RunUp { quantile } => Some(quantile),
            _ => None,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProbeSpec {
    kind: String,
    name: Option<String>,
    at: Option<Vec<f64>>,
    axis: Option<Wall>,
    quantile: Option<f64>,
    #[serde(default)]
    rate_hz: Rate,
    window: Option<f64>,
    solid: Option<BearerSpec>,
    about: Option<[f64; 3]>,
}

/// What of a scene its probes are held against.
pub(super) struct Around<'a> {
    pub(super) domain: &'a Bounds,
    pub(super) periodic: [bool; 3],
    pub(super) shot: &'a Shot,
    pub(super) solver: &'a Solver,
    pub(super) solids: &'a [PlacedMesh],
    /// Those that move, as they are placed at the start.
    pub(super) moving: Vec<&'a PlacedMesh>,
    /// Of the scene's solids in its own order, whether each moves.
    pub(super) is_moving: &'a [bool],
}

/// Builds all of them. A probe without a name is called by its kind and its place among those of its kind.
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
                problem += ", which it has by its kind and place: give it another";
            }
            return Err(doc.fault_of(&format!("{path}.name"), problem));
        }
        probes.push(probe);
    }
    Ok(probes)
}

/// Why a probe cannot have a name beside another probe's.
fn second(known: &str, name: &str) -> String {
    let mut problem = format!("a second probe of the name {name:?}");
    if known != name {
        problem += &format!(
            ": {known:?} is the same file where upper and lower case are not told apart, as on Windows and macOS"
        );
    }
    problem
}

/// What the table at `path` measures, with its point in the domain.
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
    // The keys need it where a kind does.
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
        "{given:?} is outside of the domain, which reaches over {all}"
    )))
}

/// Who bears a force, and what its moment is about: the middle of that at the start where the table does not say.
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
                    "{number}: the scene has {count} [[solid]], which count from 0"
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

/// A pressure on particles is none on faces.
fn why_no_force(solver: &Solver) -> Option<String> {
    (solver.method == Method::Pbf).then(|| {
        "solver pbf has no pressure on faces that a force could be summed from; choose solver.method = \"flip\""
            .to_owned()
    })
}

/// A look is at a substep's end, so there are at most as many as substeps.
fn why_not_so_often(rate: Rate, shot: &Shot, solver: &Solver) -> Option<String> {
    let Rate::Hertz(rate) = rate else {
        return None;
    };
    let most = match solver.method {
        Method::Pbf => solver.pbf().max_substeps,
        Method::Flip => solver.flip().max_substeps,
    };
    let highest = shot.frames_per_second * f64::from(most);
    let is_possible = LEAST_RATE <= rate && rate <= highest;
    (!is_possible).then(|| {
        format!(
            "{rate} a second; from {LEAST_RATE} to {highest} are possible: shot.frames_per_second × solver.{}.max_substeps",
            solver.method.name()
        )
    })
}

/// Hz: a look in a quarter of an hour.
const LEAST_RATE: f64 = 1e-3;

/// PBF's pressure is the sum of its multipliers, which says all only where corrections are λ's and nothing else.
fn why_no_pressure(solver: &Solver) -> Option<String> {
    if solver.method != Method::Pbf {
        return None;
    }
    let pbf = solver.pbf();
    if pbf.grid_projection {
        return None;
    }
    let why = if pbf.iteration == Iteration::Chebyshev {
        "with solver.pbf.iteration = \"chebyshev\" a part of each correction goes on from the one before, which no \
         pressure stands for"
    } else if pbf.artificial_pressure > 0.0 {
        "with solver.pbf.artificial_pressure above 0 particles are also held apart by a force that no pressure stands for"
    } else {
        return None;
    };
    Some(why.to_owned())
}

/// The volume is counted on voxels of one spacing, whose bricks have a table over the water.
fn why_no_volume(domain: &Bounds, solver: &Solver) -> Option<String> {
    let spacing = match solver.method {
        Method::Pbf => solver.pbf().particle_spacing,
        Method::Flip => solver.flip().particle_spacing(),
    };
    let bricks = (domain.size() / (spacing * f64::from(EDGE))).ceil();
    let is_too_large = bricks.element_product() > MAX_BRICKS;
    is_too_large.then(|| {
        format!("the domain has more than {MAX_BRICKS} bricks of {EDGE}³ particle spacings")
    })
}
