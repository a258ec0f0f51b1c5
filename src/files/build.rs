//! Builds a validated scene from its spec: reads files and checks that the parts fit together.

mod solver;

use std::path::Path;

use glam::DVec3;

use super::{
    band, body, budget,
    document::Document,
    effects,
    fit::{comes_into, fits},
    forces, frame, grids, keep,
    keys::{BodySpec, BoxSpec, DomainSpec, MeshSpec, SceneSpec, SolidSpec, SwarmSpec, WaterSpec},
    mesh_sequence, moving_solid, no_slip, periodic,
    placed_mesh::placed_mesh,
    probe, simulated_depth, sources, start_waves, wave_maker,
};
use swell_domain::{bounds::Bounds, sampling};
use swell_scene::{
    PlacedMesh, Scene, SceneError, Solver, Swarm, Water,
    forces::MovingFrame,
    moving_solid::{MAX_MOVING_SOLIDS, MovingSolid},
    origin, projection,
    words::{extent, shown, shown_all},
};

use solver::Solvers;

/// Largest number of particles of a scene: ids have 32 bits, and 2²⁷ particles of 200
/// bytes take 25 GiB.
const MAX_PARTICLES: f64 = 134_217_728.0;

/// Least edge of the domain, metres; equal to the least particle spacing.
const LEAST_EDGE: f64 = 1e-8;

type Result<T> = std::result::Result<T, SceneError>;

/// Initial particle lattice of the chosen solver.
struct Lattice {
    spacing: f64,
    /// Key that determines its spacing.
    key: &'static str,
    /// Least distance between two walls, metres.
    least_gap: f64,
}

/// Builds the scene.
pub(super) fn scene(doc: &Document<'_>, base_dir: &Path, spec: SceneSpec) -> Result<Scene> {
    let shot = spec.shot;
    let domain = domain(doc, &spec.domain)?;
    let Solvers {
        chosen: solver,
        unchosen,
        lattice,
    } = solver::solvers(doc, spec.solver, &domain)?;
    let periodic = periodic::read(doc, spec.domain.periodic.as_deref().unwrap_or_default())?;
    periodic::check_solver(doc, periodic, &domain, &solver)?;
    let between = spec.effects.act_between_projections();
    let no_slip = no_slip::build(doc, &spec.domain, (solver.method(), between), periodic)?;
    let water = water(doc, base_dir, &spec.water, &domain, &lattice)?;
    periodic::check_gravity(doc, periodic, water.gravity)?;
    periodic::check_current(doc, periodic, water.current)?;
    let around = start_waves::Surroundings {
        domain: &domain,
        periodic,
        gravity: water.gravity,
        spacing: lattice.spacing,
        has_other_water: !water.blocks.is_empty() || !water.meshes.is_empty(),
    };
    start_waves::check(doc, &water.waves, &around)?;
    let around = wave_maker::Surroundings {
        base_dir,
        domain: &domain,
        gravity: water.gravity,
        least_gap: lattice.least_gap,
        spacing: lattice.spacing,
        shot: &shot,
    };
    let (solids, mut moving_solids) = solids(doc, &spec.solid, &around)?;
    let moving = (0..spec.solid.len()).filter(|&k| spec.solid[k].moves());
    let moving: Vec<usize> = moving.collect();
    periodic::check_solids(doc, periodic, &moving_solids, |k| moving[k])?;
    let bodies = bodies(
        doc,
        base_dir,
        &spec.body,
        (lattice.spacing, moving_solids.len()),
        &{
            body::Surroundings {
                domain: &domain,
                periodic,
                has_projection: solver.pbf().is_none_or(|pbf| pbf.grid_projection),
            }
        },
    )?;
    let wave_makers = wave_maker::build_all(doc, &spec.wave_maker, &around)?;
    periodic::check_makers(doc, periodic, &wave_makers)?;
    let around = effects::Surroundings {
        domain: &domain,
        periodic,
        wave_makers: &wave_makers,
        gravity: water.gravity,
        current: water.current,
        least_length: 2.0 * lattice.spacing,
        has_projection: solver.pbf().is_none_or(|pbf| pbf.grid_projection),
    };
    effects::check(&spec.effects, doc, &around)?;
    let around = simulated_depth::Surroundings {
        domain: &domain,
        gravity: water.gravity,
        current: water.current,
        spacing: lattice.spacing,
        start: &water.waves,
        incoming: spec.effects.generated(),
    };
    if let Some(floor) = simulated_depth::floor(doc, &around)? {
        check_count(doc, "water.wave", moving_solids.len() + bodies.len())?;
        moving_solids.push(floor);
    }
    let around = sources::Around {
        domain: &domain,
        shot: &shot,
        gravity: water.gravity,
        spacing: lattice.spacing,
        solids: &solids,
        mesh: &|path, spec| placed_mesh(doc, base_dir, path, "file", (spec, lattice.spacing)),
        block: &|path, spec| bounds(doc, path, spec),
    };
    let emitters = sources::emitters(doc, &spec.emitter, &around)?;
    let drains = sources::drains(doc, &spec.drain, &around)?;
    let forces = forces::forces(doc, &spec.force, &around)?;
    let moved = frame::build(doc, base_dir, &spec.domain, (&domain, water.gravity))?;
    mesh_sequence::check_emitters(doc, &moving_solids, &emitters, lattice.spacing)?;
    let entering = swell_scene::sources::most_entering(&emitters, lattice.spacing, &shot);
    check_particle_count(doc, &water, entering, &domain, &lattice)?;
    let grids = match &spec.grids {
        Some(table) => Some(grids::build(doc, table, &domain, &solver)?),
        None => None,
    };
    let kept = (spec.keep.as_ref().map(|table| keep::build(doc, table))).transpose()?;
    let is_moving: Vec<bool> = spec.solid.iter().map(SolidSpec::moves).collect();
    let around = probe::Around {
        domain: &domain,
        periodic,
        shot: &shot,
        solver: &solver,
        solids: &solids,
        moving: moving_solids.iter().map(|solid| &solid.placed).collect(),
        is_moving: &is_moving,
    };
    let probes = probe::build_all(doc, &spec.probe, &around)?;
    let duration = shot.duration();
    let speeds = (wave_makers
        .iter()
        .map(|maker| maker.motion.peak_speed(0.0, duration)))
    .chain((moving_solids.iter()).map(|solid| solid.peak_speed(&[], 0.0, duration)))
    .chain((bodies.iter()).map(|body| body.peak_speed(&[], 0.0, 0.0)));
    let flip = solver.flip().or(unchosen.as_ref().and_then(Solver::flip));
    let moves = moved.as_ref().map(MovingFrame::motion);
    let inertia = moves.map_or(0.0, |motion| frame::most(motion, &shot));
    let pull = water.gravity.length() + forces::pull(&forces) + inertia;
    let scales = budget::Scales {
        fall: (2.0 * pull * domain.size().length()).sqrt() + forces::speed(&forces, &shot),
        push: speeds.fold(0.0, f64::max) + moves.map_or(0.0, |it| it.jump(0.0, duration)),
        wind: spec.effects.push().speed + spec.effects.frees(projection::grain(&water, &solver)),
        spacing: lattice.spacing,
        tolerance: flip.map_or(0.0, |flip| flip.pressure.tolerance),
    };
    moving_solids.extend(bodies);
    let budget = budget::build(doc, &spec.budget, &shot, &solver, &scales)?;
    let scene = Scene {
        shot,
        origin: origin::of(&domain),
        domain,
        no_slip,
        periodic,
        water,
        solids,
        moving_solids,
        wave_makers,
        emitters,
        drains,
        forces,
        frame: moved,
        solver,
        unchosen,
        grids,
        keep: kept.map(|it| it.particles),
        compression: kept.and_then(|it| it.compression),
        probes,
        budget,
        effects: spec.effects,
    };
    band::check(doc, &scene)?;
    frame::check(doc, &scene)?;
    Ok(scene.into_local())
}

/// Builds the static solids and the moving ones.
fn solids(
    doc: &Document<'_>,
    specs: &[SolidSpec],
    around: &wave_maker::Surroundings<'_>,
) -> Result<(Vec<PlacedMesh>, Vec<MovingSolid>)> {
    let (mut solids, mut moving) = (Vec::new(), Vec::new());
    for (index, spec) in specs.iter().enumerate() {
        let path = format!("solid[{index}]");
        if !spec.moves() {
            solids.push(static_solid(doc, &path, spec, around)?);
            continue;
        }
        check_count(doc, &path, moving.len())?;
        moving.push(match &spec.sequence {
            Some(sequence) => mesh_sequence::build(doc, &path, (spec, sequence), around)?,
            None => {
                let placed = solid_mesh(doc, &path, spec, around)?;
                moving_solid::build(doc, &path, placed, spec, around)?
            }
        });
    }
    Ok((solids, moving))
}

/// Checks that one more than `count` solids can move.
fn check_count(doc: &Document<'_>, path: &str, count: usize) -> Result<()> {
    if count < MAX_MOVING_SOLIDS {
        return Ok(());
    }
    let problem = format!("at most {MAX_MOVING_SOLIDS} solids and bodies can move");
    Err(doc.fault_of_plain(path, problem))
}

/// Builds the bodies, after `moving` moving solids, for particles `spacing` metres apart.
fn bodies(
    doc: &Document<'_>,
    base_dir: &Path,
    specs: &[BodySpec],
    (spacing, moving): (f64, usize),
    around: &body::Surroundings<'_>,
) -> Result<Vec<MovingSolid>> {
    let build = |(index, spec): (usize, &BodySpec)| {
        let path = format!("body[{index}]");
        check_count(doc, &path, moving + index)?;
        let mesh = (&spec.placed(), spacing);
        let placed = placed_mesh(doc, base_dir, &path, "mesh", mesh)?;
        body::build(doc, index, placed, spec, around)
    };
    let bodies = specs.iter().enumerate().map(build);
    let bodies = bodies.collect::<Result<Vec<_>>>()?;
    body::check_apart(doc, &bodies)?;
    Ok(bodies)
}

/// Reads the domain.
fn domain(doc: &Document<'_>, spec: &DomainSpec) -> Result<Bounds> {
    let DomainSpec { min, max, .. } = *spec;
    let domain = bounds(doc, "domain", &BoxSpec { min, max })?;
    let size = domain.size();
    if size.min_element() >= LEAST_EDGE {
        return Ok(domain);
    }
    let problem = format!("its edges are {} m", shown_all(&size.to_array()));
    Err(doc.fault_of("domain.max", problem))
}

/// Reads a box and checks that its edges are positive.
fn bounds(doc: &Document<'_>, path: &str, spec: &BoxSpec) -> Result<Bounds> {
    let [min, max] = [spec.min, spec.max].map(DVec3::from_array);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if min[axis] >= max[axis] {
            let problem = format!(
                "the box is inverted: {name} ends at {} but starts at {}",
                shown(max[axis]),
                shown(min[axis])
            );
            return Err(doc.fault_of(&format!("{path}.max"), problem));
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
    let mut water = Water {
        rest_density: spec.rest_density,
        gravity: DVec3::from_array(spec.gravity),
        current: DVec3::from_array(spec.current.unwrap_or_default()),
        blocks: Vec::new(),
        meshes: Vec::new(),
        waves: spec.wave.clone(),
        particles: Vec::new(),
    };
    for (index, block) in spec.block.iter().enumerate() {
        let path = format!("water.block[{index}]");
        water
            .blocks
            .push(water_block(doc, &path, block, domain, lattice)?);
    }
    for (index, mesh) in spec.mesh.iter().enumerate() {
        let path = format!("water.mesh[{index}]");
        water.meshes.push(water_mesh(
            doc,
            base_dir,
            &path,
            mesh,
            (domain, lattice.spacing),
        )?);
    }
    for (index, swarm) in spec.particles.iter().enumerate() {
        let path = format!("water.particles[{index}].at");
        water
            .particles
            .push(self::swarm(doc, &path, swarm, domain)?);
    }
    Ok(water)
}

fn water_mesh(
    doc: &Document<'_>,
    base_dir: &Path,
    path: &str,
    spec: &MeshSpec,
    (domain, spacing): (&Bounds, f64),
) -> Result<PlacedMesh> {
    let placed = placed_mesh(doc, base_dir, path, "file", (spec, spacing))?;
    if placed
        .mesh
        .bounds()
        .is_some_and(|b| fits(&b, domain, placed.rounding))
    {
        return Ok(placed);
    }
    let problem = format!(
        "the water does not fit: it spans {}, the domain spans {}",
        extent(placed.mesh.bounds()),
        extent(Some(*domain))
    );
    Err(doc.fault_of(&format!("{path}.file"), problem))
}

fn swarm(doc: &Document<'_>, path: &str, spec: &SwarmSpec, domain: &Bounds) -> Result<Swarm> {
    let at: Vec<_> = spec.at.iter().copied().map(DVec3::from_array).collect();
    // A NaN is in no box.
    if let Some(p) = at.iter().find(|p| !domain.contains(**p)) {
        let problem = format!(
            "{} is not in the domain, {}",
            shown_all(&p.to_array()),
            extent(Some(*domain))
        );
        return Err(doc.fault_of(path, problem));
    }
    Ok(Swarm {
        at,
        velocity: DVec3::from_array(spec.velocity),
    })
}

fn water_block(
    doc: &Document<'_>,
    path: &str,
    spec: &BoxSpec,
    domain: &Bounds,
    lattice: &Lattice,
) -> Result<Bounds> {
    let block = bounds(doc, path, spec)?;
    if !fits(&block, domain, DVec3::ZERO) {
        let corner = Bounds {
            min: block.min,
            max: block.min,
        };
        let name = if fits(&corner, domain, DVec3::ZERO) {
            "max"
        } else {
            "min"
        };
        let problem = format!(
            "the water does not fit: the block spans {}, the domain spans {}",
            extent(Some(block)),
            extent(Some(*domain))
        );
        return Err(doc.fault_of(&format!("{path}.{name}"), problem));
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
        return Err(doc.fault_of(&format!("{path}.max"), problem));
    }
    Ok(block)
}

fn check_particle_count(
    doc: &Document<'_>,
    water: &Water,
    entering: f64,
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
    // A mesh is filled on a grid over its bounds, which must fit as well.
    let in_meshes = water
        .meshes
        .iter()
        .filter_map(|m| m.mesh.bounds())
        .map(|b| b.volume() / d.powi(3))
        .sum::<f64>();
    let below_waves = start_waves::most_volume(&water.waves, domain) / d.powi(3);
    let placed: usize = water.particles.iter().map(|swarm| swarm.at.len()).sum();
    let count = in_blocks + in_meshes + below_waves + placed as f64 + entering;
    if count > MAX_PARTICLES {
        let problem = format!(
            "the water would take about {count:.3e} particles {} m apart",
            shown(d)
        );
        return Err(doc.fault_of(lattice.key, problem));
    }
    Ok(())
}

fn static_solid(
    doc: &Document<'_>,
    path: &str,
    spec: &SolidSpec,
    around: &wave_maker::Surroundings<'_>,
) -> Result<PlacedMesh> {
    let domain = around.domain;
    let placed = solid_mesh(doc, path, spec, around)?;
    let overlaps = placed
        .mesh
        .bounds()
        .is_some_and(|b| comes_into(&b, domain, placed.rounding));
    if overlaps {
        return Ok(placed);
    }
    let problem = format!(
        "the mesh lies outside the domain: it spans {}, the domain spans {}",
        extent(placed.mesh.bounds()),
        extent(Some(*domain))
    );
    Err(doc.fault_of(&format!("{path}.mesh"), problem))
}

fn solid_mesh(
    doc: &Document<'_>,
    path: &str,
    spec: &SolidSpec,
    around: &wave_maker::Surroundings<'_>,
) -> Result<PlacedMesh> {
    let key = format!("{path}.mesh");
    let Some(mesh) = &spec.mesh else {
        return Err(doc.fault_of(&key, "missing"));
    };
    let mesh = (&spec.placed(mesh, spec.blake3.as_ref()), around.spacing);
    placed_mesh(doc, around.base_dir, path, "mesh", mesh)
}
