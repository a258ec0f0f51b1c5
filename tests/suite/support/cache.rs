//! A cache written by a stand-in for a solver.
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;

use glam::{DQuat, DVec3};
use serde_json::{Value, json};
use swell::cache::{
    self, Asset, CacheError, CacheReader, CacheWriter, Clock, GridRecord, Manifest, ProbeRecord,
    ProbeValues, Summary, body_records,
};
use swell::domain::{body::BodyState, particles::Particles, sparse_grid::Precision};
use tempfile::TempDir;

pub const SCENE: &str = "[shot]\nname = \"tank\"\n";
pub const LEDGER: &str = "frames.jsonl";

pub fn manifest() -> Manifest {
    Manifest {
        format_version: Manifest::FORMAT_VERSION,
        program: "swell".to_owned(),
        program_version: "0.1.0".to_owned(),
        shaders: None,
        shot: "tank".to_owned(),
        scene_hash: "5ce".to_owned(),
        solver: "pbf".to_owned(),
        device: "a device".to_owned(),
        driver: "its driver 1.2".to_owned(),
        backend: "Vulkan".to_owned(),
        frames_per_second: 60.0,
        // Not a short decimal: it must survive the round trip to the last bit.
        particle_spacing: 0.1 + 0.2,
        rest_density: 1000.0,
        origin: [0.0; 3],
        grids: None,
        keep: None,
        compression: None,
        probes: probes(),
        bodies: Vec::new(),
        parent: None,
        warnings: Vec::new(),
        attributes: vec!["foam".to_owned(), "age".to_owned()],
        start_particles: 0,
        files: Vec::new(),
    }
}

pub fn probes() -> Vec<ProbeRecord> {
    let probe = |name: &str, kind: &str, at: &[f64], columns: &[&str]| ProbeRecord {
        name: name.to_owned(),
        kind: kind.to_owned(),
        at: at.to_vec(),
        columns: columns.iter().map(|&column| column.to_owned()).collect(),
        ..ProbeRecord::default()
    };
    vec![
        probe("gauge", "elevation", &[0.5, 1.5], &["elevation_m"]),
        probe("energy-1", "energy", &[], &["kinetic_J", "potential_J"]),
    ]
}

/// Probe values at a time. The elevation gauge is dry in every third frame.
pub fn seen(clock: Clock) -> ProbeValues {
    let wet = !clock.frame.is_multiple_of(3);
    let at = |scale: f64| Some(scale * (1.0 + clock.time).ln());
    vec![vec![at(0.1).filter(|_| wet)], vec![at(1e20), at(-1e-7)]]
}

/// A manifest that declares every stream of the cache format.
pub fn manifest_of_all_streams() -> Manifest {
    let grids = GridRecord {
        surface: true,
        velocity: true,
        voxel_size: 0.6,
        origin: [0.0; 3],
        precision: Precision::Half,
    };
    Manifest {
        grids: Some(grids),
        bodies: body_records(["crate".to_owned()]),
        ..manifest()
    }
}

pub fn bake_all_streams(dir: &Path, last: u32) {
    bake_of(dir, manifest_of_all_streams(), start_of_all_streams(), last);
}

/// A cache of the streams that were in the first format.
pub fn bake_streams_of_format_1(dir: &Path, last: u32) {
    let manifest = Manifest {
        bodies: Vec::new(),
        ..manifest_of_all_streams()
    };
    bake_of(dir, manifest, start(), last);
}

fn bake_of(dir: &Path, manifest: Manifest, start: Particles, last: u32) {
    let clock = Clock::default();
    let seen = seen(clock);
    let writer = CacheWriter::create(dir, manifest, SCENE, &assets(), clock, &start, &seen);
    go_on(writer.unwrap(), clock, start, last).unwrap();
}

pub fn assets() -> Vec<Asset> {
    let asset = |name: &str, bytes: &[u8]| Asset {
        name: name.to_owned(),
        bytes: bytes.to_vec(),
    };
    vec![
        asset("city.obj", b"v 0 0 0"),
        asset("tables/stroke.csv", b"0,1\n"),
    ]
}

/// A stand-in for a solver: frame k depends only on frame k - 1 and the clock.
pub fn step(before: &Particles, clock: Clock, frame: u32) -> (Clock, Particles, Value) {
    let mut after = before.clone();
    for (i, x) in after.position.iter_mut().enumerate() {
        *x = x.map(|c| (c * 1.7 + clock.time as f32 + i as f32).sin());
    }
    for (v, x) in after.velocity.iter_mut().zip(&after.position) {
        *v = x.map(|c| c * 0.3);
    }
    for body in &mut after.bodies {
        body.centre.y = (body.centre.y * 1.3 + clock.time).sin();
    }
    for column in after.attributes.values_mut() {
        column.iter_mut().for_each(|a| *a += 0.1);
    }
    let clock = Clock {
        frame,
        // Accumulates rounding, so that a clock that loses its last bit in the ledger is noticed.
        time: clock.time + 1.0 / 60.0,
        substeps: 1 + frame % 3,
        steps: clock.steps + u64::from(1 + frame % 3),
        ..Clock::default()
    };
    let report = json!({ "density_error": { "mean": 0.1 / f64::from(frame) }, "capped": frame });
    (clock, after, report)
}

pub fn start() -> Particles {
    let n = 7;
    Particles {
        position: (0..n).map(|i| [i as f32, 0.5, -0.0]).collect(),
        velocity: vec![[0.0; 3]; n],
        id: (0..n as u32).map(|i| i * 3).collect(),
        attributes: [("age", 1.0), ("foam", 0.0)]
            .map(|(name, value)| (name.to_owned(), vec![value; n]))
            .into(),
        ..Particles::default()
    }
}

/// The start of a cache with every stream: with a body.
pub fn start_of_all_streams() -> Particles {
    let body = BodyState {
        time: 0.0,
        centre: DVec3::new(0.1, 0.2, 0.3),
        turn: DQuat::from_rotation_x(0.7),
        velocity: DVec3::new(-1.0 / 3.0, 0.0, 1e-20),
        spin: DVec3::Y,
    };
    Particles {
        bodies: vec![body],
        ..start()
    }
}

pub fn create(dir: &Path) -> CacheWriter {
    let clock = Clock::default();
    CacheWriter::create(
        dir,
        manifest(),
        SCENE,
        &assets(),
        clock,
        &start(),
        &seen(clock),
    )
    .unwrap()
}

/// Writes frames `clock.frame + 1 ..= last`, starting from the given state.
pub fn go_on(
    mut writer: CacheWriter,
    mut clock: Clock,
    mut particles: Particles,
    last: u32,
) -> Result<Summary, CacheError> {
    for frame in clock.frame + 1..=last {
        let report;
        (clock, particles, report) = step(&particles, clock, frame);
        let seconds = json!({ "seconds": Instant::now().elapsed().as_secs_f64() });
        writer.submit(clock, particles.clone(), seen(clock), report, seconds)?;
    }
    writer.finish()
}

pub fn bake(dir: &Path, last: u32) -> Summary {
    go_on(create(dir), Clock::default(), start(), last).unwrap()
}

pub fn resume(dir: &Path, last: u32) -> Result<Summary, CacheError> {
    let (writer, entry, particles) = CacheWriter::resume(dir, &manifest())?;
    go_on(writer, entry.clock, particles, last)
}

/// A baked cache of frames 0 to 4 that tests copy.
pub fn baked() -> &'static Path {
    static BAKED: OnceLock<TempDir> = OnceLock::new();
    BAKED
        .get_or_init(|| {
            let dir = tempfile::tempdir().unwrap();
            bake(dir.path(), 4);
            dir
        })
        .path()
}

pub fn copied() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    for file in files(baked()) {
        let to = dir.path().join(&file);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(baked().join(&file), to).unwrap();
    }
    dir
}

/// Paths of all files below `dir`, relative to it, sorted.
pub fn files(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.push(path.strip_prefix(dir).unwrap().to_owned());
            }
        }
    }
    found.sort();
    found
}

pub fn damaged_file<T: std::fmt::Debug>(result: Result<T, CacheError>) -> PathBuf {
    match result {
        Err(CacheError::Damaged { file, .. }) => file,
        other => panic!("expected damage: {other:?}"),
    }
}

pub fn first_problem(dir: &Path) -> PathBuf {
    damaged_file(cache::survey(dir).unwrap().into_result())
}

/// Reads every frame that the ledger lists, which checks its checksum; returns the last frame.
pub fn ledger_holds(dir: &Path) -> u32 {
    let reader = CacheReader::open(dir).unwrap();
    for entry in reader.entries() {
        reader.read(entry.frame).unwrap();
    }
    reader.last_frame()
}

/// A ledger whose lines have these contents, chained by BLAKE3 to a manifest with these bytes.
pub fn chained(manifest: &[u8], lines: &[Vec<u8>]) -> Vec<u8> {
    let mut chain = blake3::hash(manifest);
    let mut ledger = Vec::new();
    for line in lines {
        let mut hasher = blake3::Hasher::new();
        hasher.update(chain.as_bytes());
        hasher.update(line);
        chain = hasher.finalize();
        let open = line.strip_suffix(b"}").unwrap_or(line);
        ledger.extend_from_slice(open);
        ledger.extend_from_slice(format!(",\"chain\":\"{}\"}}\n", chain.to_hex()).as_bytes());
    }
    ledger
}
