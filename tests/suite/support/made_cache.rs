//! Caches without a solver, for tests of code that reads them.
use std::path::Path;
use swell::files::parse_scene;
use swell::files::scene_to_toml;

use serde_json::{Value, json};
use swell::{
    cache::{
        CacheReader, CacheWriter, Clock, GridRecord, Manifest, ProbeRecord, ProbeValues,
        body_records,
    },
    domain::{
        particles::Particles,
        solver::StepReport,
        sparse_grid::Precision,
        whitewater::{ATTRIBUTES, none},
    },
    files::physics_hash,
};

pub const SCENE: &str = r#"
[shot]
name = "small"
frames = 4
frames_per_second = 60

[domain]
min = [-1.0, 0.5, 0.25]
max = [1.0, 2.5, 1.25]

[[water.block]]
min = [-1.0, 0.5, 0.25]
max = [-0.2, 1.5, 1.25]

[solver]
method = "pbf"

[solver.pbf]
particle_spacing = 0.1
"#;

/// Contents of a generated cache, with hooks that spoil parts of it.
pub struct Made<'a> {
    pub scene: &'a str,
    pub device: &'a str,
    pub last: u32,
    pub spoil: &'a dyn Fn(u32, &mut Particles),
    pub version: &'a str,
    pub grids: Option<GridRecord>,
    pub probes: Vec<ProbeRecord>,
    /// Names of bodies, whose states `spoil` adds.
    pub bodies: &'a [&'a str],
    /// Probe value as a function of frame, probe and column.
    pub seen: &'a dyn Fn(u32, usize, usize) -> Option<f64>,
    pub report: &'a dyn Fn(u32) -> Value,
}

impl Default for Made<'_> {
    fn default() -> Self {
        Self {
            scene: SCENE,
            device: "a device",
            last: 4,
            spoil: &|_, _| {},
            version: "0.1.0",
            grids: None,
            probes: Vec::new(),
            bodies: &[],
            seen: &seen,
            report: &report,
        }
    }
}

impl Made<'_> {
    /// A cache with both grids and two probes.
    pub fn watched() -> Self {
        let probe = |name: &str, columns: &[&str]| ProbeRecord {
            name: name.to_owned(),
            kind: "energy".to_owned(),
            at: Vec::new(),
            columns: columns.iter().map(|&column| column.to_owned()).collect(),
            ..ProbeRecord::default()
        };
        Self {
            grids: Some(GridRecord {
                surface: true,
                velocity: true,
                voxel_size: 0.1,
                origin: [-1.0, 0.5, 0.25],
                precision: Precision::Float,
            }),
            probes: vec![
                probe("near", &["kinetic_j", "potential_j"]),
                probe("far", &["depth_m"]),
            ],
            ..Self::default()
        }
    }
}

/// Default probe values; the second probe is empty before frame 2.
pub fn seen(frame: u32, probe: usize, column: usize) -> Option<f64> {
    (probe == 0 || frame >= 2).then(|| f64::from(frame) + 0.5 * column as f64)
}

/// A stand-in for a solver: a block of 8 × 10 × 10 particles that slides along x and sinks slowly.
pub fn particles(frame: u32) -> Particles {
    let time = frame as f32 / 60.0;
    let place = |k: u32| {
        let [x, y, z] = [k % 8, k / 8 % 10, k / 80].map(|i| 0.1 * i as f32 + 0.05);
        [x - 1.0 + time, 0.5 + y - 0.1 * time * y, 0.25 + z]
    };
    Particles {
        position: (0..800).map(place).collect(),
        velocity: (0..800).map(|k| [1.0, -0.001 * k as f32, 0.0]).collect(),
        id: (0..800).collect(),
        ..Particles::default()
    }
}

pub fn report(frame: u32) -> Value {
    serde_json::to_value(StepReport {
        substeps: 1,
        iterations: 4,
        density_error_mean: 0.001 * f64::from(frame),
        density_error_p99: 0.01,
        density_error_max: 0.02,
        kinetic_energy: 1.0,
        potential_energy: 1.0,
        max_speed: 1.0,
        capped: 0,
        searched: 0,
        boundary_work: 0.0,
        volume: None,
        projection: None,
        exchange: None,
        densest_at: None,
    })
    .unwrap()
}

/// Writes a cache of [`particles`] as a bake would.
pub fn write_cache(path: &Path, made: &Made<'_>) {
    let scene = parse_scene(made.scene, Path::new("s.toml"), Path::new(""), &[]).unwrap();
    let manifest = Manifest {
        format_version: Manifest::FORMAT_VERSION,
        program: "swell".to_owned(),
        program_version: made.version.to_owned(),
        shaders: None,
        shot: scene.shot.name.clone(),
        scene_hash: physics_hash(&scene),
        solver: "pbf".to_owned(),
        device: made.device.to_owned(),
        driver: "its driver 1.2".to_owned(),
        backend: "Vulkan".to_owned(),
        frames_per_second: 60.0,
        particle_spacing: 0.1,
        rest_density: 1000.0,
        origin: [0.0; 3],
        keep: None,
        compression: None,
        grids: made.grids.clone(),
        probes: made.probes.clone(),
        bodies: body_records(made.bodies.iter().map(|&name| name.to_owned())),
        attributes: Vec::new(),
        parent: None,
        warnings: Vec::new(),
        start_particles: 0,
        files: Vec::new(),
    };
    let of = |frame| {
        let mut particles = particles(frame);
        (made.spoil)(frame, &mut particles);
        particles
    };
    let rows = |frame| -> ProbeValues {
        let probes = made.probes.iter().enumerate();
        let row = |(index, probe): (usize, &ProbeRecord)| {
            let columns = 0..probe.columns.len();
            columns
                .map(|column| (made.seen)(frame, index, column))
                .collect()
        };
        probes.map(row).collect()
    };
    let toml = scene_to_toml(&scene, &|_, hash| hash.to_owned());
    let mut writer = CacheWriter::create(
        path,
        manifest,
        &toml,
        &[],
        Clock::default(),
        &of(0),
        &rows(0),
    )
    .unwrap();
    for frame in 1..=made.last {
        let clock = Clock {
            frame,
            time: f64::from(frame) / 60.0,
            substeps: 1,
            steps: frame.into(),
            ..Clock::default()
        };
        writer
            .submit(
                clock,
                of(frame),
                rows(frame),
                (made.report)(frame),
                Value::Null,
            )
            .unwrap();
    }
    writer.finish().unwrap();
}

/// Writes a stream of whitewater of a cache in `cache`, as `swell whitewater` would, that has
/// `of(frame)` in each frame.
pub fn write_stream(cache: &Path, name: &str, of: &dyn Fn(u32) -> Particles) {
    let water = CacheReader::open(cache).unwrap();
    let manifest = Manifest {
        solver: Manifest::WHITEWATER.to_owned(),
        attributes: ATTRIBUTES.map(str::to_owned).to_vec(),
        grids: None,
        probes: Vec::new(),
        start_particles: 0,
        files: Vec::new(),
        ..water.manifest().clone()
    };
    let first = water.entries()[0].clock;
    let mut writer = CacheWriter::create(
        &cache.join("whitewater").join(name),
        manifest,
        water.scene_toml(),
        &[],
        first,
        &none(),
        &Vec::new(),
    )
    .unwrap();
    for entry in &water.entries()[1..] {
        let report = json!({ "water": entry.chain });
        writer
            .submit(
                entry.clock,
                of(entry.frame),
                Vec::new(),
                report,
                Value::Null,
            )
            .unwrap();
    }
    writer.finish().unwrap();
}
