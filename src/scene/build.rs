//! From what is written to what is meant: ranges, defaults, files, and how the parts fit.

use std::{ops::Range, path::Path};

use glam::DVec3;
use toml::Spanned;

use super::{
    Iteration, Pbf, PlacedMesh, Placement, Scene, Shot, Solver, Stop, Water,
    document::Document,
    error::SceneError,
    grids,
    spec::{BoxSpec, PbfSpec, ScaleSpec, SceneSpec, ShotSpec, SolidSpec, WaterSpec},
    wave_maker,
};
use crate::domain::{
    bounds::Bounds,
    mesh::TriangleMesh,
    mesh_file::{self, MeshFormat},
    sampling,
};

/// Most particles of a scene: ids are 32 bits, and 2²⁷ particles of 200 bytes fill 25 GiB.
pub(super) const MAX_PARTICLES: f64 = 134_217_728.0;

/// Most cells of the neighbour grid, and along one axis.
const MAX_CELLS: f64 = 2_147_483_647.0;
const MAX_AXIS_CELLS: f64 = 65_536.0;

/// Largest coordinate of a domain, metres.
const MAX_COORDINATE: f64 = 1e6;

/// f32 positions at the far end of the domain must still tell apart this fraction of a spacing.
const POSITION_RESOLUTION: f64 = 1.0 / 16.0;

type Result<T> = std::result::Result<T, SceneError>;

/// Builds the scene.
pub(super) fn scene(doc: &Document<'_>, base_dir: &Path, spec: SceneSpec) -> Result<Scene> {
    let shot = shot(doc, &spec.shot)?;
    let domain = domain(doc, &spec.domain)?;
    if spec.solver.method.get_ref() != "pbf" {
        let problem = format!("{:?} is no method", spec.solver.method.get_ref());
        return Err(doc.fault_at(spec.solver.method.span(), problem));
    }
    let spacing_span = spec.solver.pbf.particle_spacing.span();
    let pbf = pbf(doc, &spec.solver.pbf, &domain)?;
    let water = water(doc, base_dir, &spec.water, &domain, &pbf)?;
    check_particle_count(doc, &water, &domain, &pbf, spacing_span)?;
    let solids = spec
        .solid
        .iter()
        .map(|solid| solid_mesh(doc, base_dir, solid, &domain))
        .collect::<Result<_>>()?;
    let wave_makers = wave_maker::build_all(
        doc,
        base_dir,
        &spec.wave_maker,
        &wave_maker::Surroundings {
            domain: &domain,
            gravity: water.gravity,
            spacing: pbf.particle_spacing,
            shot: &shot,
        },
    )?;
    if let Some((key, allowed)) = spec.effects.fault() {
        return Err(doc.fault_of(&key, allowed));
    }
    let spacing = pbf.particle_spacing;
    let grids = spec
        .grids
        .as_ref()
        .map(|table| grids::build(doc, table, &domain, spacing, 2.0 * spacing))
        .transpose()?;
    Ok(Scene {
        shot,
        domain,
        water,
        solids,
        wave_makers,
        solver: Solver { pbf },
        grids,
        effects: spec.effects,
    })
}

/// The value, if `is_allowed`; NaN never is.
pub(super) fn number(
    doc: &Document<'_>,
    value: &Spanned<f64>,
    is_allowed: impl Fn(f64) -> bool,
) -> Result<f64> {
    let v = *value.get_ref();
    if v.is_finite() && is_allowed(v) {
        Ok(v)
    } else {
        Err(doc.fault_at(value.span(), format!("{v} is out of range")))
    }
}

fn number_or(
    doc: &Document<'_>,
    value: &Option<Spanned<f64>>,
    default: f64,
    is_allowed: impl Fn(f64) -> bool,
) -> Result<f64> {
    value
        .as_ref()
        .map_or(Ok(default), |value| number(doc, value, is_allowed))
}

fn whole(doc: &Document<'_>, value: &Spanned<i64>, max: u32) -> Result<u32> {
    let v = *value.get_ref();
    u32::try_from(v)
        .ok()
        .filter(|v| (1..=max).contains(v))
        .ok_or_else(|| doc.fault_at(value.span(), format!("{v} is out of range")))
}

fn vector(doc: &Document<'_>, value: &Spanned<[f64; 3]>, limit: f64) -> Result<DVec3> {
    let v = DVec3::from_array(*value.get_ref());
    if v.is_finite() && v.abs().max_element() <= limit {
        Ok(v)
    } else {
        Err(doc.fault_at(
            value.span(),
            format!("[{}, {}, {}] is out of range", v.x, v.y, v.z),
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

fn shot(doc: &Document<'_>, spec: &ShotSpec) -> Result<Shot> {
    let name = spec.name.get_ref();
    let is_safe = (1..=100).contains(&name.len())
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.'));
    if !is_safe {
        return Err(doc.fault_at(spec.name.span(), format!("{name:?} is no safe file name")));
    }
    Ok(Shot {
        name: name.clone(),
        frames: whole(doc, &spec.frames, 1_000_000)?,
        frames_per_second: number(doc, &spec.frames_per_second, |v| v > 0.0 && v <= 1e5)?,
    })
}

/// A box with positive edges.
fn bounds(doc: &Document<'_>, spec: &BoxSpec) -> Result<Bounds> {
    let min = vector(doc, &spec.min, MAX_COORDINATE)?;
    let max = vector(doc, &spec.max, MAX_COORDINATE)?;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if min[axis] >= max[axis] {
            let problem = format!(
                "the box is inverted: {name} ends at {} but starts at {}",
                max[axis], min[axis]
            );
            return Err(doc.fault_at(spec.max.span(), problem));
        }
    }
    Ok(Bounds { min, max })
}

fn domain(doc: &Document<'_>, spec: &BoxSpec) -> Result<Bounds> {
    bounds(doc, spec)
}

fn pbf(doc: &Document<'_>, spec: &PbfSpec, domain: &Bounds) -> Result<Pbf> {
    let particle_spacing = number(doc, &spec.particle_spacing, |v| v > 0.0)?;
    let support_ratio = number_or(doc, &spec.support_ratio, 2.0, |v| (1.5..=4.0).contains(&v))?;
    check_grid(
        doc,
        spec.particle_spacing.span(),
        domain,
        particle_spacing,
        support_ratio,
    )?;
    Ok(Pbf {
        particle_spacing,
        support_ratio,
        iteration: iteration(doc, &spec.iteration)?,
        stop: stop(doc, spec)?,
        cfl: number_or(doc, &spec.cfl, 1.0, |v| v > 0.0 && v <= 5.0)?,
        relaxation: number_or(doc, &spec.relaxation, 1.0, |v| v > 0.0 && v <= 1.5)?,
        artificial_pressure: number_or(doc, &spec.artificial_pressure, 0.0, |v| {
            (0.0..=10.0).contains(&v)
        })?,
        max_substeps: spec
            .max_substeps
            .as_ref()
            .map_or(Ok(32), |v| whole(doc, v, 10_000))?,
    })
}

fn iteration(doc: &Document<'_>, spec: &Option<Spanned<String>>) -> Result<Iteration> {
    let Some(spec) = spec else {
        return Ok(Iteration::RedBlack);
    };
    match spec.get_ref().as_str() {
        "red_black" => Ok(Iteration::RedBlack),
        "jacobi" => Ok(Iteration::Jacobi),
        other => Err(doc.fault_at(spec.span(), format!("{other:?} is no iteration"))),
    }
}

fn stop(doc: &Document<'_>, spec: &PbfSpec) -> Result<Stop> {
    match (&spec.iterations, &spec.density_error, &spec.max_iterations) {
        (None, None, None) => Ok(Stop::Iterations(4)),
        (Some(iterations), None, None) => Ok(Stop::Iterations(whole(doc, iterations, 10_000)?)),
        (None, Some(density_error), Some(max_iterations)) => Ok(Stop::DensityError {
            density_error: number(doc, density_error, |v| v > 0.0 && v < 1.0)?,
            max_iterations: whole(doc, max_iterations, 10_000)?,
        }),
        (Some(iterations), _, _) => {
            let other = match &spec.density_error {
                Some(_) => "density_error",
                None => "max_iterations",
            };
            Err(doc.fault_at(iterations.span(), format!("given together with {other}")))
        }
        (None, Some(density_error), None) => {
            Err(doc.fault_at(density_error.span(), "given without max_iterations"))
        }
        (None, None, Some(max_iterations)) => {
            Err(doc.fault_at(max_iterations.span(), "given without density_error"))
        }
    }
}

/// The neighbour grid has cells of the support radius; its indices are 32 bits.
fn check_grid(
    doc: &Document<'_>,
    span: Range<usize>,
    domain: &Bounds,
    spacing: f64,
    support_ratio: f64,
) -> Result<()> {
    let cells = (domain.size() / (spacing * support_ratio)).ceil();
    let all = cells.x * cells.y * cells.z;
    let axis = cells.max_element();
    if all > MAX_CELLS || axis > MAX_AXIS_CELLS {
        let problem = format!(
            "the grid would overflow: a domain of {} × {} × {} m takes {:.3e} × {:.3e} × {:.3e} \
             = {all:.3e} cells of {} m",
            domain.size().x,
            domain.size().y,
            domain.size().z,
            cells.x,
            cells.y,
            cells.z,
            spacing * support_ratio
        );
        return Err(doc.fault_at(span, problem));
    }
    let farthest = domain.min.abs().max(domain.max.abs()).max_element();
    let resolution = farthest * f64::from(f32::EPSILON);
    if resolution > POSITION_RESOLUTION * spacing {
        let problem = format!(
            "{spacing} m is too fine {farthest} m from the origin, where positions (32 bit) are \
             {resolution:.2e} m apart"
        );
        return Err(doc.fault_at(span, problem));
    }
    Ok(())
}

fn water(
    doc: &Document<'_>,
    base_dir: &Path,
    spec: &WaterSpec,
    domain: &Bounds,
    pbf: &Pbf,
) -> Result<Water> {
    let blocks = spec
        .block
        .iter()
        .map(|block| water_block(doc, block, domain, pbf))
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
        rest_density: number_or(doc, &spec.rest_density, 1000.0, |v| v > 0.0 && v <= 1e6)?,
        gravity: vector_or(doc, &spec.gravity, DVec3::new(0.0, -9.81, 0.0), 1e4)?,
        blocks,
        meshes,
    })
}

fn water_block(doc: &Document<'_>, spec: &BoxSpec, domain: &Bounds, pbf: &Pbf) -> Result<Bounds> {
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
    if sampling::block_dims(&block, domain, pbf.particle_spacing).contains(&0) {
        let size = block.size();
        let problem = format!(
            "the block, {} × {} × {} m, is too thin for one layer of particles {} m apart",
            size.x, size.y, size.z, pbf.particle_spacing
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

fn extent(bounds: Option<Bounds>) -> String {
    bounds.map_or_else(
        || "nothing".to_owned(),
        |b| {
            format!(
                "[{}, {}, {}] to [{}, {}, {}]",
                b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z
            )
        },
    )
}

fn check_particle_count(
    doc: &Document<'_>,
    water: &Water,
    domain: &Bounds,
    pbf: &Pbf,
    span: Range<usize>,
) -> Result<()> {
    let d = pbf.particle_spacing;
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
    let count = in_blocks + in_meshes;
    if count > MAX_PARTICLES {
        let problem = format!("the water would take about {count:.3e} particles {d} m apart");
        return Err(doc.fault_at(span, problem));
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

fn solid_mesh(
    doc: &Document<'_>,
    base_dir: &Path,
    spec: &SolidSpec,
    domain: &Bounds,
) -> Result<PlacedMesh> {
    let file = MeshSpec {
        path: &spec.mesh,
        blake3: &spec.blake3,
        translate: &spec.translate,
        rotate_degrees: &spec.rotate_degrees,
        scale: &spec.scale,
    };
    let placed = placed_mesh(doc, base_dir, &file)?;
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
    let file = base_dir.join(spec.path.get_ref());
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
    let world_from_file = placement.world_from_file();
    let mesh = in_file.transformed(&world_from_file);
    mesh.check_inside()
        .map_err(|error| fail(format!("{}: {error}", file.display())))?;
    Ok(PlacedMesh {
        file,
        file_hash,
        placement,
        world_from_file,
        mesh,
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
            format!("[{}, {}, {}] is out of range", scale.x, scale.y, scale.z),
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
