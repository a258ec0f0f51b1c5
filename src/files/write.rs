//! Writes a scene as TOML with all defaults.

use std::path::Path;

use glam::DVec3;
use serde::Serialize;
use toml::{Table, Value};

use super::{
    axis::Axis,
    keep,
    key::{Key, Kind},
    keys,
    sources::Written,
};
use swell_domain::{
    bounds::Bounds,
    motion::{Motion, Phases, RegularWaves, SeaParameters, Spectrum},
    probe::Rate,
};
use swell_scene::{
    Budget, Iteration, Pbf, PlacedMesh, Scene, Solver, Stop,
    probe::{Probe, ProbeKind},
};

/// Returns the scene as TOML with all defaults and with motion tables in place; loading it
/// gives an equal scene. `mesh_path` maps a file and its hash to the path to write, relative to
/// where the text will be stored: [`asset_path`](swell_scene::asset_path) for a cache.
pub fn scene_to_toml(scene: &Scene, mesh_path: &dyn Fn(&Path, &str) -> String) -> String {
    let mut out = String::new();
    write_tables(&mut out, keys::SCENE, "", &written(scene, mesh_path));
    out
}

/// Returns all keys of the scene with their values.
pub(super) fn written(scene: &Scene, mesh_path: &dyn Fn(&Path, &str) -> String) -> Table {
    let mut root = table([
        ("shot", value(&scene.shot)),
        ("domain", Value::Table(written_domain(scene))),
        ("water", Value::Table(written_water(scene, mesh_path))),
        ("solver", Value::Table(written_solver(scene))),
        ("budget", Value::Table(budget(&scene.budget))),
        ("effects", value(&scene.effects)),
    ]);
    let placed = |solid: &PlacedMesh| mesh("mesh", solid, mesh_path);
    let still = scene.solids.iter().map(placed);
    let moving = scene.moving_solids.iter().map(|solid| {
        let mut table = placed(&solid.placed);
        if let Some(slide) = &solid.slide {
            table.insert("direction".to_owned(), vector(slide.direction));
            table.insert("motion".to_owned(), motion(&slide.motion));
        }
        if let Some(turn) = &solid.turn {
            table.insert("pivot".to_owned(), vector(turn.pivot + scene.origin));
            table.insert("axis".to_owned(), vector(turn.axis));
            table.insert("turn".to_owned(), turned(&turn.motion));
        }
        if let Some(track) = &solid.track {
            let poses = value(&track.written(scene.origin));
            let rows = self::table([("poses", poses)]);
            table.insert("track".to_owned(), Value::Table(rows));
        }
        table
    });
    insert_tables(&mut root, "solid", still.chain(moving));
    let makers = scene.wave_makers.iter();
    let makers = makers.map(|maker| {
        let mut rows = table([
            ("wall", value(&maker.wall)),
            ("motion", motion(&maker.motion)),
        ]);
        if let Some(absorption) = &maker.absorption {
            let asked = absorption.asked();
            let absorption = Value::Table(table([
                ("depth", value(&asked.depth)),
                ("period", value(&asked.period)),
                ("room", value(&asked.room)),
            ]));
            rows.insert("absorption".to_owned(), absorption);
        }
        rows
    });
    insert_tables(&mut root, "wave_maker", makers);
    let sources = Written {
        corners: &corners,
        mesh: &|placed| mesh("file", placed, mesh_path),
        origin: scene.origin,
    };
    let emitters = scene.emitters.iter().map(|it| sources.emitter(it));
    insert_tables(&mut root, "emitter", emitters);
    let drains = scene.drains.iter().map(|it| sources.drain(it));
    insert_tables(&mut root, "drain", drains);
    if let Some(grids) = &scene.grids {
        root.insert("grids".to_owned(), value(grids));
    }
    if let Some(particles) = &scene.keep {
        let kept = table([
            ("particles", value(particles)),
            ("compression", value(&keep::name(scene.compression))),
        ]);
        root.insert("keep".to_owned(), Value::Table(kept));
    }
    let probes = scene.probes.iter().map(|it| probe(it, scene));
    insert_tables(&mut root, "probe", probes);
    root
}

fn written_domain(scene: &Scene) -> Table {
    let mut domain = corners(&scene.domain.moved(scene.origin));
    if !scene.no_slip.is_empty() {
        domain.insert("no_slip".to_owned(), value(&scene.no_slip));
    }
    if scene.is_periodic() {
        domain.insert("periodic".to_owned(), value(&Axis::of(scene.periodic)));
    }
    domain
}

fn written_water(scene: &Scene, mesh_path: &dyn Fn(&Path, &str) -> String) -> Table {
    let mut water = table([
        ("rest_density", value(&scene.water.rest_density)),
        ("gravity", vector(scene.water.gravity)),
    ]);
    let blocks = scene.water.blocks.iter();
    let blocks = blocks.map(|block| corners(&block.moved(scene.origin)));
    insert_tables(&mut water, "block", blocks);
    let meshes = scene.water.meshes.iter();
    let meshes = meshes.map(|placed| mesh("file", placed, mesh_path));
    insert_tables(&mut water, "mesh", meshes);
    let waves = scene.water.waves.iter().map(|wave| match value(wave) {
        Value::Table(wave) => wave,
        _ => unreachable!("a wave is a table"),
    });
    insert_tables(&mut water, "wave", waves);
    let swarms = scene.water.particles.iter().map(|swarm| {
        let at = swarm.at.iter().copied().map(vector).collect();
        table([
            ("at", Value::Array(at)),
            ("velocity", vector(swarm.velocity)),
        ])
    });
    insert_tables(&mut water, "particles", swarms);
    water
}

fn written_solver(scene: &Scene) -> Table {
    let mut solver = table([("method", value(&scene.solver.method()))]);
    // The chosen method's settings stand where both are of one method.
    for settings in scene.unchosen.iter().chain([&scene.solver]) {
        let rows = match settings {
            Solver::Pbf(settings) => Value::Table(pbf(settings)),
            Solver::Flip(settings) => value(settings),
        };
        solver.insert(settings.method().name().to_owned(), rows);
    }
    solver
}

/// Writes the tables below `path` in the order of their keys, plain keys before tables.
fn write_tables(out: &mut String, keys: &[Key], path: &str, values: &Table) {
    let is_table = |key: &&Key| matches!(key.kind, Kind::Table(_) | Kind::Tables(_));
    for key in keys.iter().filter(|key| !is_table(key)) {
        if let Some(value) = values.get(key.name) {
            *out += &format!("{} = {}\n", key.name, inline(key, value));
        }
    }
    for key in keys.iter().filter(is_table) {
        let path = match path {
            "" => key.name.to_owned(),
            path => format!("{path}.{}", key.name),
        };
        let (items, head) = match values.get(key.name) {
            None => continue,
            Some(Value::Array(items)) => (items.as_slice(), format!("[[{path}]]")),
            Some(item) => (std::slice::from_ref(item), format!("[{path}]")),
        };
        for table in items.iter().filter_map(Value::as_table) {
            if !out.is_empty() {
                out.push('\n');
            }
            *out += &format!("{head}\n");
            write_tables(out, key.below(), &path, table);
        }
    }
}

/// Formats a value in one line. `{:?}` of a float is the shortest decimal that reads back as the
/// same number, and valid TOML.
fn inline(key: &Key, value: &Value) -> String {
    match value {
        Value::Float(number) => format!("{number:?}"),
        Value::Array(items) => {
            let items: Vec<_> = items.iter().map(|item| inline(key, item)).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Table(table) => {
            let rows = key.below().iter().filter_map(|below| {
                let value = table.get(below.name)?;
                Some(format!("{} = {}", below.name, inline(below, value)))
            });
            format!("{{ {} }}", rows.collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

/// Converts a number, a name or plain settings.
fn value(of: &impl Serialize) -> Value {
    Value::try_from(of).expect("numbers and names are TOML")
}

fn vector(v: DVec3) -> Value {
    value(&v.to_array())
}

fn table<const N: usize>(rows: [(&str, Value); N]) -> Table {
    let rows = rows.into_iter();
    rows.map(|(key, value)| (key.to_owned(), value)).collect()
}

fn insert_tables(into: &mut Table, key: &str, tables: impl Iterator<Item = Table>) {
    let tables: Vec<_> = tables.map(Value::Table).collect();
    if !tables.is_empty() {
        into.insert(key.to_owned(), Value::Array(tables));
    }
}

fn corners(bounds: &Bounds) -> Table {
    table([("min", vector(bounds.min)), ("max", vector(bounds.max))])
}

fn mesh(key: &str, mesh: &PlacedMesh, mesh_path: &dyn Fn(&Path, &str) -> String) -> Table {
    let placement = &mesh.placement;
    table([
        (key, value(&mesh_path(&mesh.file, &mesh.file_hash))),
        ("blake3", value(&mesh.file_hash)),
        ("translate", vector(placement.translate)),
        ("rotate_degrees", vector(placement.rotate_degrees)),
        ("scale", vector(placement.scale)),
    ])
}

fn pbf(pbf: &Pbf) -> Table {
    let mut rows = table([
        ("particle_spacing", value(&pbf.particle_spacing)),
        ("support_ratio", value(&pbf.support_ratio)),
        ("iteration", value(&pbf.iteration)),
        ("cfl", value(&pbf.cfl)),
        ("relaxation", value(&pbf.relaxation)),
        ("artificial_pressure", value(&pbf.artificial_pressure)),
        ("grid_projection", value(&pbf.grid_projection)),
        ("max_substeps", value(&pbf.max_substeps)),
    ]);
    if pbf.iteration == Iteration::Chebyshev {
        rows.insert("spectral_radius".to_owned(), value(&pbf.spectral_radius));
    }
    rows.extend(match pbf.stop {
        Stop::Iterations(iterations) => table([("iterations", value(&iterations))]),
        Stop::DensityError {
            density_error,
            max_iterations,
        } => table([
            ("density_error", value(&density_error)),
            ("max_iterations", value(&max_iterations)),
        ]),
    });
    rows
}

fn motion(motion: &Motion) -> Value {
    let (kind, rows) = match motion {
        Motion::Still => ("still", Table::new()),
        Motion::ConstantVelocity { velocity, until } => {
            let mut rows = table([("velocity", value(velocity))]);
            if let Some(until) = until {
                rows.insert("until".to_owned(), value(until));
            }
            ("constant_velocity", rows)
        }
        Motion::Sine {
            stroke,
            period,
            ramp,
        } => {
            let rows = table([
                ("stroke", value(stroke)),
                ("period", value(period)),
                ("ramp", value(ramp)),
            ]);
            ("sine", rows)
        }
        // The gravity is that of the water.
        Motion::Solitary { height, depth, .. } => {
            let rows = table([("height", value(height)), ("depth", value(depth))]);
            ("solitary", rows)
        }
        Motion::Stokes(stokes) => ("stokes", regular(stokes.waves())),
        Motion::Cnoidal(cnoidal) => ("cnoidal", regular(cnoidal.waves())),
        Motion::Sea(sea) => waves(sea.asked()),
        Motion::Table { points } => ("table", table([("points", value(points))])),
    };
    let mut all = table([("kind", value(&kind))]);
    all.extend(rows);
    Value::Table(all)
}

/// Gravity is omitted because it is that of the water.
fn regular(waves: &RegularWaves) -> Table {
    table([
        ("height", value(&waves.height)),
        ("period", value(&waves.period)),
        ("depth", value(&waves.depth)),
        ("ramp", value(&waves.ramp)),
    ])
}

/// Writes a rotation: a motion with the keys of angles.
fn turned(turn: &Motion) -> Value {
    let Value::Table(mut all) = motion(turn) else {
        return motion(turn);
    };
    for (of_way, of_angle) in [
        ("velocity", "degrees_per_second"),
        ("stroke", "swing_degrees"),
    ] {
        if let Some(found) = all.remove(of_way) {
            all.insert(of_angle.to_owned(), found);
        }
    }
    Value::Table(all)
}

/// Gravity is omitted because it is that of the water.
fn waves(asked: &SeaParameters) -> (&'static str, Table) {
    let mut rows = table([
        ("depth", value(&asked.depth)),
        ("spectrum", value(&asked.spectrum)),
        ("peak_period", value(&asked.peak_period)),
        ("shortest_period", value(&asked.shortest_period)),
        ("ramp", value(&asked.ramp)),
        ("second_order", value(&asked.second_order)),
    ]);
    if asked.spectrum != Spectrum::PiersonMoskowitz {
        rows.insert(
            "peak_enhancement".to_owned(),
            value(&asked.peak_enhancement),
        );
    }
    let (kind, of_kind) = match &asked.phases {
        Phases::Random {
            significant_height,
            seed,
        } => (
            "sea",
            table([
                ("significant_height", value(significant_height)),
                ("seed", value(seed)),
            ]),
        ),
        Phases::Focused { height, at, time } => (
            "focused",
            table([
                ("height", value(height)),
                ("at", value(at)),
                ("time", value(time)),
            ]),
        ),
    };
    rows.extend(of_kind);
    (kind, rows)
}

fn probe(probe: &Probe, scene: &Scene) -> Table {
    let mut rows = table([
        ("name", value(&probe.name)),
        ("kind", value(&probe.kind.name())),
    ]);
    let at = probe.kind.at(scene.origin);
    if let ProbeKind::Force { on, .. } = probe.kind {
        let name = on.name(scene);
        let number = name.parse::<i64>().map(Value::Integer);
        rows.insert("solid".to_owned(), number.unwrap_or(Value::String(name)));
        rows.insert("about".to_owned(), value(&at));
    } else if !at.is_empty() {
        rows.insert("at".to_owned(), value(&at));
    }
    if let Some(towards) = probe.kind.towards() {
        rows.insert("axis".to_owned(), value(&towards));
    }
    if let Some(quantile) = probe.kind.quantile() {
        rows.insert("quantile".to_owned(), value(&quantile));
    }
    if probe.rate != Rate::Frame {
        rows.insert("rate_hz".to_owned(), value(&probe.rate));
    }
    if let Some(window) = probe.window {
        rows.insert("window".to_owned(), value(&window));
    }
    rows
}

fn budget(budget: &Budget) -> Table {
    let rows = budget.rows().into_iter();
    let limit = |limit: Option<f64>| limit.map_or(Value::Boolean(false), Value::Float);
    rows.map(|(watched, value)| (watched.name().to_owned(), limit(value)))
        .collect()
}
