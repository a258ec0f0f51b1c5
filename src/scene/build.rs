//! From what is written to what is meant: ranges, defaults, files, and how the parts fit.

mod solver;

use std::{ops::Range, path::Path};

use glam::DVec3;
use toml::Spanned;

use super::{
    PlacedMesh, Placement, Scene, Shot, Swarm, Water, budget,
    document::Document,
    error::SceneError,
    grids,
    moving_solid::{self, MAX_MOVING_SOLIDS},
    origin, probe,
    ranges::{self, Interval},
    spec::{BoxSpec, ScaleSpec, SceneSpec, ShotSpec, SolidSpec, SwarmSpec, WaterSpec},
    wave_maker,
    words::{shown, shown_all},
};
use crate::domain::{
    bounds::Bounds,
    mesh::TriangleMesh,
    mesh_file::{self, MeshFormat},
    sampling,
};

/// Most particles of a scene: ids are 32 bits, and 2²⁷ particles of 200 bytes fill 25 GiB.
pub(super) const MAX_PARTICLES: f64 = 134_217_728.0;

/// Largest coordinate of a domain, metres.
const MAX_COORDINATE: f64 = 1e6;

type Result<T> = std::result::Result<T, SceneError>;

/// The lattice on which the chosen solver's particles start.
struct Lattice {
    spacing: f64,
    /// Where the scene says how fine it is.
    span: Range<usize>,
    /// Metres that must stay between two walls.
    least_gap: f64,
}

/// Builds the scene.
pub(super) fn scene(doc: &Document<'_>, base_dir: &Path, spec: SceneSpec) -> Result<Scene> {
    let shot = shot(doc, &spec.shot)?;
    let domain = domain(doc, &spec.domain)?;
    let origin = origin::of(&domain);
    let (solver, lattice) = solver::solver(doc, &spec.solver, &domain)?;
    let water = water(doc, base_dir, &spec.water, &domain, &lattice)?;
    check_particle_count(doc, &water, &domain, &lattice)?;
    let around = wave_maker::Surroundings {
        base_dir,
        domain: &domain,
        gravity: water.gravity,
        least_gap: lattice.least_gap,
        shot: &shot,
    };
    let mut solids = Vec::new();
    let mut moving_solids = Vec::new();
    for solid in &spec.solid {
        match (&solid.direction, &solid.motion) {
            (None, None) => solids.push(static_solid(doc, solid, &around)?),
            (Some(direction), Some(motion)) => {
                moving_solid::check_method(doc, motion.span(), solver.method)?;
                if moving_solids.len() == MAX_MOVING_SOLIDS {
                    let problem = format!("at most {MAX_MOVING_SOLIDS} solids can move");
                    return Err(doc.fault_plain(motion.span(), problem));
                }
                let placed = solid_mesh(doc, base_dir, solid)?;
                moving_solids.push(moving_solid::build(
                    doc, placed, direction, motion, &around,
                )?);
            }
            (Some(direction), None) => {
                return Err(doc.fault_at(direction.span(), "given without motion"));
            }
            (None, Some(motion)) => {
                return Err(doc.fault_at(motion.span(), "given without direction"));
            }
        }
    }
    let wave_makers = wave_maker::build_all(doc, &spec.wave_maker, &around)?;
    if let Some((key, value, allowed)) = spec.effects.fault() {
        return Err(doc.fault_of(&key, value, allowed));
    }
    let grids = spec
        .grids
        .as_ref()
        .map(|table| grids::build(doc, table, &domain, &solver))
        .transpose()?;
    let probes = probe::build_all(doc, &spec.probe, &domain, &solver)?;
    let motions = (wave_makers.iter().map(|maker| &maker.motion))
        .chain(moving_solids.iter().map(|solid| &solid.motion));
    let duration = shot.duration();
    let scales = budget::Scales {
        fall: (2.0 * water.gravity.length() * domain.size().length()).sqrt(),
        push: (motions.map(|motion| motion.peak_speed(0.0, duration))).fold(0.0, f64::max),
        spacing: lattice.spacing,
    };
    let budget = budget::build(doc, &spec.budget, &shot, &solver, &scales)?;
    let scene = Scene {
        shot,
        origin,
        domain,
        water,
        solids,
        moving_solids,
        wave_makers,
        solver,
        grids,
        probes,
        budget,
        effects: spec.effects,
    };
    Ok(scene.into_local())
}

/// The value, if it is in the range; NaN never is.
pub(super) fn number(doc: &Document<'_>, value: &Spanned<f64>, range: &Interval) -> Result<f64> {
    let v = *value.get_ref();
    if range.contains(&v) {
        Ok(v)
    } else {
        Err(out_of_range(doc, value))
    }
}

/// That a number is not what its key allows.
pub(super) fn out_of_range(doc: &Document<'_>, value: &Spanned<f64>) -> SceneError {
    let problem = format!("{} is out of range", shown(*value.get_ref()));
    doc.fault_at(value.span(), problem)
}

fn number_or(
    doc: &Document<'_>,
    value: &Option<Spanned<f64>>,
    default: f64,
    range: &Interval,
) -> Result<f64> {
    value
        .as_ref()
        .map_or(Ok(default), |value| number(doc, value, range))
}

fn whole(doc: &Document<'_>, value: &Spanned<i64>, max: u32) -> Result<u32> {
    let v = *value.get_ref();
    u32::try_from(v)
        .ok()
        .filter(|v| (1..=max).contains(v))
        .ok_or_else(|| doc.fault_at(value.span(), format!("{v} is out of range")))
}

pub(super) fn vector(doc: &Document<'_>, value: &Spanned<[f64; 3]>, limit: f64) -> Result<DVec3> {
    let v = DVec3::from_array(*value.get_ref());
    if v.is_finite() && v.abs().max_element() <= limit {
        Ok(v)
    } else {
        Err(doc.fault_at(
            value.span(),
            format!("{} is out of range", shown_all(&v.to_array())),
        ))
    }
}

fn vector_or(
    doc: &Document<'_>,
    value: &Option<Spanned<[f64; 3]>>,
    default: DVec3,
    limit: f64,
) -> Result<DVec3> {
    value
        .as_ref()
        .map_or(Ok(default), |value| vector(doc, value, limit))
}

/// Whether a name can be a part of a file's.
pub(super) fn is_file_stem(name: &str) -> bool {
    (1..=100).contains(&name.len())
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.'))
}

fn shot(doc: &Document<'_>, spec: &ShotSpec) -> Result<Shot> {
    let name = spec.name.get_ref();
    if !is_file_stem(name) {
        return Err(doc.fault_at(spec.name.span(), format!("{name:?} is no safe file name")));
    }
    Ok(Shot {
        name: name.clone(),
        frames: whole(doc, &spec.frames, 1_000_000)?,
        frames_per_second: number(doc, &spec.frames_per_second, &ranges::FRAMES_PER_SECOND)?,
    })
}

/// The box of the whole scene.
fn domain(doc: &Document<'_>, spec: &BoxSpec) -> Result<Bounds> {
    let domain = bounds(doc, spec)?;
    let size = domain.size();
    if ranges::EDGE.contains(&size.min_element()) {
        return Ok(domain);
    }
    let problem = format!("its edges are {} m", shown_all(&size.to_array()));
    Err(doc.fault_at(spec.max.span(), problem))
}

/// A box with positive edges.
fn bounds(doc: &Document<'_>, spec: &BoxSpec) -> Result<Bounds> {
    let min = vector(doc, &spec.min, MAX_COORDINATE)?;
    let max = vector(doc, &spec.max, MAX_COORDINATE)?;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if min[axis] >= max[axis] {
            let problem = format!(
                "the box is inverted: {name} ends at {} but starts at {}",
                shown(max[axis]),
                shown(min[axis])
            );
            return Err(doc.fault_at(spec.max.span(), problem));
        }
    }
    Ok(Bounds { min, max })
}

fn water(
    doc: &Document<'_>,
    base_dir: &Path,
    spec: &WaterSpec,
    domain: &Bounds,
    lattice: &Lattice,
) -> Result<Water> {
    let blocks = spec
        .block
        .iter()
        .map(|block| water_block(doc, block, domain, lattice))
        .collect::<Result<_>>()?;
    let meshes = spec
        .mesh
        .iter()
        .map(|mesh| {
            let file = MeshSpec {
                path: &mesh.file,
                blake3: &mesh.blake3,
                translate: &mesh.translate,
                rotate_degrees: &mesh.rotate_degrees,
                scale: &mesh.scale,
            };
            let placed = placed_mesh(doc, base_dir, &file)?;
            let fits = placed.mesh.bounds().is_some_and(|b| fits(&b, domain));
            if fits {
                return Ok(placed);
            }
            let problem = format!(
                "the water does not fit: it reaches over {}, the domain over {}",
                extent(placed.mesh.bounds()),
                extent(Some(*domain))
            );
            Err(doc.fault_at(mesh.file.span(), problem))
        })
        .collect::<Result<_>>()?;
    Ok(Water {
        rest_density: number_or(doc, &spec.rest_density, 1000.0, &ranges::REST_DENSITY)?,
        gravity: vector_or(doc, &spec.gravity, DVec3::new(0.0, -9.81, 0.0), 1e4)?,
        blocks,
        meshes,
        particles: spec
            .particles
            .iter()
            .map(|swarm| self::swarm(doc, swarm, domain))
            .collect::<Result<_>>()?,
    })
}

fn swarm(doc: &Document<'_>, spec: &SwarmSpec, domain: &Bounds) -> Result<Swarm> {
    let at: Vec<_> = spec
        .at
        .get_ref()
        .iter()
        .copied()
        .map(DVec3::from_array)
        .collect();
    // NaN is in no box.
    if let Some(p) = at.iter().find(|p| !domain.contains(**p)) {
        let problem = format!(
            "{} is not in the domain, {}",
            shown_all(&p.to_array()),
            extent(Some(*domain))
        );
        return Err(doc.fault_at(spec.at.span(), problem));
    }
    Ok(Swarm {
        at,
        velocity: vector_or(doc, &spec.velocity, DVec3::ZERO, 1e4)?,
    })
}

fn water_block(
    doc: &Document<'_>,
    spec: &BoxSpec,
    domain: &Bounds,
    lattice: &Lattice,
) -> Result<Bounds> {
    let block = bounds(doc, spec)?;
    if !fits(&block, domain) {
        let starts_inside = fits(
            &Bounds {
                min: block.min,
                max: block.min,
            },
            domain,
        );
        let span = if starts_inside {
            spec.max.span()
        } else {
            spec.min.span()
        };
        let problem = format!(
            "the water does not fit: the block reaches over {}, the domain over {}",
            extent(Some(block)),
            extent(Some(*domain))
        );
        return Err(doc.fault_at(span, problem));
    }
    if sampling::block_dims(&block, domain, lattice.spacing).contains(&0) {
        let size = block.size();
        let problem = format!(
            "the block, {} × {} × {} m, is too thin for one layer of particles {} m apart",
            shown(size.x),
            shown(size.y),
            shown(size.z),
            shown(lattice.spacing)
        );
        return Err(doc.fault_at(spec.max.span(), problem));
    }
    Ok(block)
}

/// Whether `inner` lies in the domain, up to the rounding of decimal fractions.
fn fits(inner: &Bounds, domain: &Bounds) -> bool {
    let room = domain.grown(1e-9 * domain.size().max_element());
    room.contains(inner.min) && room.contains(inner.max)
}

pub(super) fn extent(bounds: Option<Bounds>) -> String {
    bounds.map_or_else(
        || "nothing".to_owned(),
        |b| {
            let [min, max] = [b.min, b.max].map(|corner| shown_all(&corner.to_array()));
            format!("{min} to {max}")
        },
    )
}

fn check_particle_count(
    doc: &Document<'_>,
    water: &Water,
    domain: &Bounds,
    lattice: &Lattice,
) -> Result<()> {
    let d = lattice.spacing;
    let in_blocks = water
        .blocks
        .iter()
        .map(|block| {
            sampling::block_dims(block, domain, d)
                .map(|n| n as f64)
                .iter()
                .product::<f64>()
        })
        .sum::<f64>();
    // A mesh is filled on a grid over its bounds, which has to fit as well.
    let in_meshes = water
        .meshes
        .iter()
        .filter_map(|m| m.mesh.bounds())
        .map(|b| b.volume() / d.powi(3))
        .sum::<f64>();
    let placed: usize = water.particles.iter().map(|swarm| swarm.at.len()).sum();
    let count = in_blocks + in_meshes + placed as f64;
    if count > MAX_PARTICLES {
        let problem = format!(
            "the water would take about {count:.3e} particles {} m apart",
            shown(d)
        );
        return Err(doc.fault_at(lattice.span.clone(), problem));
    }
    Ok(())
}

/// What `[[solid]]` and `[[water.mesh]]` have in common.
struct MeshSpec<'a> {
    path: &'a Spanned<String>,
    blake3: &'a Option<Spanned<String>>,
    translate: &'a Option<Spanned<[f64; 3]>>,
    rotate_degrees: &'a Option<Spanned<[f64; 3]>>,
    scale: &'a Option<Spanned<ScaleSpec>>,
}

fn solid_mesh(doc: &Document<'_>, base_dir: &Path, spec: &SolidSpec) -> Result<PlacedMesh> {
    let file = MeshSpec {
        path: &spec.mesh,
        blake3: &spec.blake3,
        translate: &spec.translate,
        rotate_degrees: &spec.rotate_degrees,
        scale: &spec.scale,
    };
    placed_mesh(doc, base_dir, &file)
}

fn static_solid(
    doc: &Document<'_>,
    spec: &SolidSpec,
    around: &wave_maker::Surroundings<'_>,
) -> Result<PlacedMesh> {
    let domain = around.domain;
    let placed = solid_mesh(doc, around.base_dir, spec)?;
    let overlaps = placed
        .mesh
        .bounds()
        .is_some_and(|b| b.min.cmplt(domain.max).all() && b.max.cmpgt(domain.min).all());
    if overlaps {
        return Ok(placed);
    }
    let problem = format!(
        "the mesh lies outside of the domain: it reaches over {}, the domain over {}",
        extent(placed.mesh.bounds()),
        extent(Some(*domain))
    );
    Err(doc.fault_at(spec.mesh.span(), problem))
}

fn placed_mesh(doc: &Document<'_>, base_dir: &Path, spec: &MeshSpec<'_>) -> Result<PlacedMesh> {
    let fail = |problem: String| doc.fault_at(spec.path.span(), problem);
    let file = doc.find(base_dir, spec.path)?;
    let bytes = MeshFormat::of(&file)
        .and_then(|format| Ok((format, mesh_file::read_bytes(&file)?)))
        .and_then(|(format, bytes)| Ok((TriangleMesh::from_bytes(&bytes, format, &file)?, bytes)));
    let (in_file, bytes) = bytes.map_err(|error| fail(chain(&error)))?;
    let file_hash = blake3::hash(&bytes).to_hex().to_string();
    if let Some(expected) = spec.blake3
        && *expected.get_ref() != file_hash
    {
        let problem = format!("{} has BLAKE3 {file_hash}", file.display());
        return Err(doc.fault_at(expected.span(), problem));
    }
    let placement = Placement {
        translate: vector_or(doc, spec.translate, DVec3::ZERO, 1e9)?,
        rotate_degrees: vector_or(doc, spec.rotate_degrees, DVec3::ZERO, 1e6)?,
        scale: scale(doc, spec.scale)?,
    };
    let mesh = in_file.transformed(&placement.world_from_file());
    let holes = mesh
        .check_inside()
        .map_err(|error| fail(format!("{}: {error}", file.display())))?;
    Ok(PlacedMesh {
        file,
        file_hash,
        placement,
        mesh,
        holes,
    })
}

fn scale(doc: &Document<'_>, spec: &Option<Spanned<ScaleSpec>>) -> Result<DVec3> {
    let Some(spec) = spec else {
        return Ok(DVec3::ONE);
    };
    let scale = match *spec.get_ref() {
        ScaleSpec::Uniform(s) => DVec3::splat(s),
        ScaleSpec::PerAxis(s) => DVec3::from_array(s),
    };
    let size = scale.abs();
    if size.min_element() >= 1e-6 && size.max_element() <= 1e6 {
        Ok(scale)
    } else {
        Err(doc.fault_at(
            spec.span(),
            format!("{} is out of range", shown_all(&scale.to_array())),
        ))
    }
}

/// An error and its causes in one line.
pub(super) fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}
