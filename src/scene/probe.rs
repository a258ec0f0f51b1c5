//! `[[probe]]`: what is measured at each frame and written beside the particles.

use std::fmt::{self, Write as _};

use glam::{DVec2, DVec3};
use serde::Deserialize;
use toml::Spanned;

use super::{
    Iteration, Method, Solver,
    build::{extent, is_file_stem},
    document::Document,
    error::SceneError,
};
use crate::domain::{bounds::Bounds, sparse_grid::EDGE, surface::MAX_BRICKS};

/// A gauge that has a CSV of its own in the cache.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// File-name safe; no other probe of the scene has it, upper and lower case taken alike.
    pub name: String,
    /// What it measures.
    pub kind: ProbeKind,
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
}

impl ProbeKind {
    /// Names that scenes use.
    const NAMES: [&str; 4] = ["elevation", "pressure", "energy", "volume"];

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMES[match self {
            Self::Elevation { .. } => 0,
            Self::Pressure { .. } => 1,
            Self::Energy => 2,
            Self::Volume => 3,
        }]
    }

    /// What it gives a frame, with the units.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Elevation { .. } => &["elevation_m"],
            Self::Pressure { .. } => &["pressure_Pa"],
            Self::Energy => &["kinetic_J", "potential_J", "total_J"],
            Self::Volume => &["volume_m3"],
        }
    }

    /// World coordinates of its point, metres: x and z, or x, y and z, or none. `origin` is the scene's.
    pub fn at(self, origin: DVec3) -> Vec<f64> {
        match self {
            Self::Elevation { at } => (at + DVec2::new(origin.x, origin.z)).to_array().to_vec(),
            Self::Pressure { at } => (at + origin).to_array().to_vec(),
            Self::Energy | Self::Volume => Vec::new(),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProbeSpec {
    kind: Spanned<String>,
    name: Option<Spanned<String>>,
    at: Option<Spanned<Vec<f64>>>,
}

/// Builds all of them. A probe without a name is called by its kind and its place among those of its kind.
pub(super) fn build_all(
    doc: &Document<'_>,
    specs: &[Spanned<ProbeSpec>],
    domain: &Bounds,
    solver: &Solver,
) -> Result<Vec<Probe>, SceneError> {
    let mut probes = Vec::<Probe>::new();
    for table in specs {
        let spec = table.get_ref();
        let kind = kind(doc, table, domain)?;
        if matches!(kind, ProbeKind::Pressure { .. }) {
            check_pressure(doc, &spec.kind, solver)?;
        }
        if kind == ProbeKind::Volume {
            check_volume(doc, &spec.kind, domain, solver)?;
        }
        let alike = probes.iter().filter(|p| p.kind.name() == kind.name());
        let default = || format!("{}-{}", kind.name(), alike.count() + 1);
        let name = spec.name.as_ref();
        let probe = Probe {
            name: name.map_or_else(default, |name| name.get_ref().clone()),
            kind,
        };
        let span = name.map_or(spec.kind.span(), Spanned::span);
        if !is_file_stem(&probe.name) {
            return Err(doc.fault_at(span, format!("{:?} is no safe file name", probe.name)));
        }
        let is_alike = |known: &&Probe| known.name.eq_ignore_ascii_case(&probe.name);
        if let Some(known) = probes.iter().find(is_alike) {
            return Err(doc.fault_at(span, second(&known.name, &probe.name)));
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

fn kind(
    doc: &Document<'_>,
    table: &Spanned<ProbeSpec>,
    domain: &Bounds,
) -> Result<ProbeKind, SceneError> {
    let spec = table.get_ref();
    let kind = match spec.kind.get_ref().as_str() {
        "elevation" => {
            let [x, z] = point(doc, table)?;
            let at = DVec2::new(x, z);
            ProbeKind::Elevation { at }
        }
        "pressure" => {
            let at = DVec3::from_array(point(doc, table)?);
            ProbeKind::Pressure { at }
        }
        "energy" => ProbeKind::Energy,
        "volume" => ProbeKind::Volume,
        other => return Err(doc.fault_at(spec.kind.span(), format!("{other:?} is no probe"))),
    };
    let is_within = match kind {
        ProbeKind::Elevation { at } => domain.contains(DVec3::new(at.x, domain.min.y, at.y)),
        ProbeKind::Pressure { at } => domain.contains(at),
        ProbeKind::Energy | ProbeKind::Volume => true,
    };
    match &spec.at {
        Some(at) if !is_within => {
            let all = extent(Some(*domain));
            let problem = format!(
                "{:?} is outside of the domain, which reaches over {all}",
                at.get_ref()
            );
            Err(doc.fault_at(at.span(), problem))
        }
        Some(at) if kind.at(DVec3::ZERO).is_empty() => {
            let problem = format!("a probe of {} has no place", kind.name());
            Err(doc.fault_at(at.span(), problem))
        }
        _ => Ok(kind),
    }
}

fn point<const N: usize>(
    doc: &Document<'_>,
    table: &Spanned<ProbeSpec>,
) -> Result<[f64; N], SceneError> {
    let spec = table.get_ref();
    let Some(at) = &spec.at else {
        return Err(doc.missing(table.span(), "at"));
    };
    let given = at.get_ref();
    <[f64; N]>::try_from(given.as_slice()).map_err(|_| {
        let problem = format!(
            "{} numbers, and a probe of {} takes {N}",
            given.len(),
            spec.kind.get_ref()
        );
        doc.fault_at(at.span(), problem)
    })
}

/// PBF's pressure is the sum of its multipliers, which says all only where corrections are λ's and nothing else.
fn check_pressure(
    doc: &Document<'_>,
    kind: &Spanned<String>,
    solver: &Solver,
) -> Result<(), SceneError> {
    if solver.method != Method::Pbf {
        return Ok(());
    }
    let pbf = solver.pbf();
    let why = if pbf.iteration == Iteration::Chebyshev {
        "with solver.pbf.iteration = \"chebyshev\" a part of each correction goes on from the one before, which no \
         pressure stands for"
    } else if pbf.artificial_pressure > 0.0 {
        "with solver.pbf.artificial_pressure above 0 particles are also held apart by a force that no pressure stands for"
    } else {
        return Ok(());
    };
    Err(doc.fault_at(kind.span(), why))
}

/// The volume is that of a level set at voxels of one spacing, whose bricks have a table over the water.
fn check_volume(
    doc: &Document<'_>,
    kind: &Spanned<String>,
    domain: &Bounds,
    solver: &Solver,
) -> Result<(), SceneError> {
    let spacing = match solver.method {
        Method::Pbf => solver.pbf().particle_spacing,
        Method::Flip => solver.flip().particle_spacing(),
    };
    let bricks = (domain.size() / (spacing * f64::from(EDGE))).ceil();
    if bricks.element_product() <= MAX_BRICKS {
        return Ok(());
    }
    let problem =
        format!("the domain has more than {MAX_BRICKS} bricks of {EDGE}³ particle spacings");
    Err(doc.fault_at(kind.span(), problem))
}

/// As [`super::Scene::to_toml`] writes it.
pub(super) fn write(out: &mut String, probe: &Probe, origin: DVec3) -> fmt::Result {
    writeln!(out, "\n[[probe]]")?;
    writeln!(out, "name = {:?}", probe.name)?;
    writeln!(out, "kind = {:?}", probe.kind.name())?;
    let at = probe.kind.at(origin);
    if at.is_empty() {
        return Ok(());
    }
    writeln!(out, "at = {at:?}")
}
