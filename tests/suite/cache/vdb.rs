//! Grid files against independent readers, OpenVDB's own `vdb_print` and vdb-rs, and how a
//! cache keeps them.
use std::{collections::BTreeMap, fs, io::Cursor, path::Path};
use swell::files::parse_scene;
use swell::files::scene_to_toml;

use glam::DVec3;
use serde_json::Value;
use swell::{
    cache::{
        CacheError, CacheReader, CacheWriter, Clock, GridRecord, Manifest, directory_hash,
        frame::Stamp,
        stream::{GRIDS, PARTICLES},
        vdb::{self, Grids},
    },
    domain::{
        particles::Particles,
        sparse_grid::{Precision, SparseGrid},
        surface::Raster,
    },
    files::physics_hash,
};

use crate::support::vdb::vdb_print;

const RASTER: Raster = Raster {
    origin: DVec3::new(-0.5, 0.25, 0.0),
    voxel_size: 0.0625,
    particle_spacing: 0.0625,
};

/// A ball of 2 m that turns and rises, large enough for leaves without a surface, across
/// indices of either sign.
fn ball(time: f64) -> Particles {
    let mut particles = Particles::default();
    let d = RASTER.particle_spacing;
    for k in 0..32i32.pow(3) {
        let at = DVec3::new(
            f64::from(k % 32),
            f64::from(k / 32 % 32),
            f64::from(k / 1024),
        );
        let p = d * (at - 15.5);
        if p.length() < 1.0 {
            let v = DVec3::new(-p.z, 0.5 + 0.1 * p.y, p.x);
            particles.position.push((p + time * v).as_vec3().to_array());
            particles.velocity.push(v.as_vec3().to_array());
            particles.id.push(particles.id.len() as u32);
        }
    }
    particles
}

/// Active voxels and their values.
fn active<T: Copy>(grid: &SparseGrid<T>) -> impl Iterator<Item = ([i32; 3], T)> {
    grid.leaves.iter().flat_map(|leaf| {
        let active = (0..512).filter(|&element| leaf.is_active(element));
        active.map(|element| (leaf.voxel(element), leaf.values[element]))
    })
}

fn grids() -> Grids {
    Grids {
        surface: Some(RASTER.surface(&ball(0.0))),
        velocity: Some(RASTER.velocity(&ball(0.0))),
    }
}

fn encoded(precision: Precision) -> Vec<u8> {
    let stamp = Stamp {
        origin: DVec3::ZERO,
        program: "swell",
        program_version: "0.1.0",
        shot: "ball",
        frame: 7,
        time: 0.25,
    };
    let mut bytes = Vec::new();
    let written = vdb::encode(&mut bytes, &stamp, &grids(), precision).unwrap();
    assert_eq!(written.bytes, bytes.len() as u64);
    assert_eq!(written.hash, blake3::hash(&bytes));
    bytes
}

/// What `vdb_print` should print about one of our grids.
fn expected<T>(
    grid: &SparseGrid<T>,
    class: &str,
    kind: &str,
    precision: Precision,
) -> BTreeMap<String, String> {
    let (min, max) = grid.active_bounds().unwrap();
    let count = grid.active_count().to_string();
    let grouped: Vec<_> = count.as_bytes().rchunks(3).rev().collect();
    let entries = [
        ("class", class.to_owned()),
        ("Type", format!("Tree_{kind}_5_4_3")),
        (
            "Bounding box of active voxels",
            format!("{min:?} -> {max:?}"),
        ),
        (
            "Number of active voxels",
            String::from_utf8(grouped.join(&b',')).unwrap(),
        ),
        ("file_voxel_count", count),
        ("voxel size", grid.voxel_size.to_string()),
        (
            "is_saved_as_half_float",
            (precision == Precision::Half).to_string(),
        ),
    ];
    entries.map(|(key, value)| (key.to_owned(), value)).into()
}

fn check(
    found: &BTreeMap<String, String>,
    expected: &BTreeMap<String, String>,
) -> Result<(), String> {
    for (key, value) in expected {
        if found.get(key) != Some(value) {
            return Err(format!("{key}: {:?}, and not {value:?}", found.get(key)));
        }
    }
    Ok(())
}

#[test]
fn openvdb_reads_what_was_written() {
    let grids = grids();
    let (surface, velocity) = (grids.surface.unwrap(), grids.velocity.unwrap());
    assert!(!surface.inside.is_empty() && surface.leaves.len() > 8);
    for precision in [Precision::Half, Precision::Float] {
        let bytes = encoded(precision);
        let found = vdb_print(&bytes).unwrap();
        assert_eq!(found.len(), 2);
        let of_surface = expected(&surface, "level set", "float", precision);
        let of_velocity = expected(&velocity, "staggered", "vec3s", precision);
        check(&found["surface"], &of_surface).unwrap();
        check(&found["vel"], &of_velocity).unwrap();

        // Extremes over the tree's values; vectors compare by their first components.
        // Half precision rounds at most three voxels, or one m/s, by 2⁻¹¹; `vdb_print`
        // prints six digits.
        let number = |key: &str| found["surface"][key].parse::<f32>().unwrap();
        let tolerance = 3.0 * 0.0625 * 2f32.powi(-11) + 1e-6;
        let distances = || active(&surface).map(|(_, value)| value);
        let (min, max) = (distances().reduce(f32::min), distances().reduce(f32::max));
        assert!((number("Min value") - min.unwrap()).abs() < tolerance);
        assert!((number("Max value") - max.unwrap()).abs() < tolerance);
        assert!((number("Background value") - 0.1875).abs() < tolerance);
        let order = |a: &[f32; 3], b: &[f32; 3]| a.partial_cmp(b).unwrap();
        let velocities = || active(&velocity).map(|(_, value)| value);
        for (key, exact) in [
            ("Min value", velocities().min_by(order)),
            ("Max value", velocities().max_by(order)),
        ] {
            let vector = found["vel"][key].trim_matches(['[', ']']).split(", ");
            for (printed, exact) in vector.zip(exact.unwrap()) {
                assert!(
                    (printed.parse::<f32>().unwrap() - exact).abs() < 5e-4 + 1e-6,
                    "{key}"
                );
            }
        }

        // Negative control: another class name of the same length, and one grid's values
        // against the other's.
        let mut spoilt = bytes.clone();
        let at = find(&spoilt, b"level set");
        spoilt[at..at + 9].copy_from_slice(b"level sit");
        let found = vdb_print(&spoilt).unwrap();
        assert!(check(&found["surface"], &of_surface).is_err());
        assert!(check(&found["vel"], &of_surface).is_err());
        // Negative control: one byte of the last leaf's zipped values.
        let mut spoilt = bytes.clone();
        let last = spoilt.len() - 40;
        spoilt[last] ^= 0x55;
        assert!(vdb_print(&spoilt).is_err());
    }
}

fn find(bytes: &[u8], word: &[u8]) -> usize {
    bytes.windows(word.len()).position(|w| w == word).unwrap()
}

/// Active voxels of the level set as vdb-rs reads them.
fn vdb_rs(bytes: &[u8]) -> BTreeMap<[i32; 3], f32> {
    let mut reader = vdb_rs::VdbReader::new(Cursor::new(bytes)).unwrap();
    let grid = reader.read_grid::<f32>("surface").unwrap();
    let vdb_rs::Map::ScaleTranslateMap {
        translation,
        scale_values,
        ..
    } = grid.transform
    else {
        panic!("{:?}", grid.transform);
    };
    assert_eq!(scale_values.to_array(), [RASTER.voxel_size; 3]);
    let first_centre = RASTER.origin + 0.5 * RASTER.voxel_size;
    assert_eq!(translation.to_array(), first_centre.to_array());
    grid.iter()
        .map(|(at, value, level)| {
            assert!(matches!(level, vdb_rs::VdbLevel::Voxel));
            (at.to_array().map(|x| x as i32), value)
        })
        .collect()
}

#[test]
fn vdb_rs_reads_the_level_set_voxel_by_voxel() {
    let surface = grids().surface.unwrap();
    let written: BTreeMap<_, _> = active(&surface).collect();
    assert_eq!(vdb_rs(&encoded(Precision::Float)), written);
    let half = vdb_rs(&encoded(Precision::Half));
    assert!(half.keys().eq(written.keys()));
    for (half, written) in half.values().zip(written.values()) {
        // Rounding to nearest is off by half a unit of 2⁻¹⁰.
        assert!((half - written).abs() <= written.abs() * 2f32.powi(-11) + 1e-7);
    }
    // Negative control: half precision differs from float, or neither test would mean anything.
    assert_ne!(half, written);
}

#[test]
fn a_frame_gives_the_same_bytes_on_any_number_of_threads() {
    let pool = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| encoded(Precision::Half))
    };
    assert!(pool(1) == pool(5));
    let Grids { surface, velocity } = grids();
    let leaves = surface.unwrap().leaves.len() + 3 * velocity.unwrap().leaves.len();
    let size = |precision| encoded(precision).len();
    let (half, float) = (size(Precision::Half), size(Precision::Float));
    println!("{leaves} leaves of numbers: {half} and {float} bytes");
    // Compressed and without inactive values: less than half the size of the leaves' contents.
    assert!(half < float && float < leaves * 512 * 4 / 2);
}

fn manifest(grids: Option<GridRecord>) -> Manifest {
    Manifest {
        format_version: Manifest::FORMAT_VERSION,
        program: "swell".to_owned(),
        program_version: "0.1.0".to_owned(),
        shaders: None,
        shot: "ball".to_owned(),
        scene_hash: "5ce".to_owned(),
        solver: "flip".to_owned(),
        device: "a device".to_owned(),
        driver: "its driver".to_owned(),
        backend: "Vulkan".to_owned(),
        frames_per_second: 24.0,
        particle_spacing: RASTER.particle_spacing,
        rest_density: 1000.0,
        origin: [0.0; 3],
        attributes: Vec::new(),
        grids,
        keep: None,
        compression: None,
        probes: Vec::new(),
        bodies: Vec::new(),
        parent: None,
        warnings: Vec::new(),
        start_particles: 0,
        files: Vec::new(),
    }
}

fn record() -> GridRecord {
    GridRecord {
        surface: true,
        velocity: true,
        voxel_size: RASTER.voxel_size,
        origin: RASTER.origin.to_array(),
        precision: Precision::Half,
    }
}

fn go_on(mut writer: CacheWriter, first: u32, last: u32) {
    for frame in first..=last {
        let clock = Clock {
            frame,
            time: f64::from(frame) / 24.0,
            substeps: 1,
            steps: frame.into(),
            ..Clock::default()
        };
        let particles = ball(clock.time);
        writer
            .submit(clock, particles, Vec::new(), Value::Null, Value::Null)
            .unwrap();
    }
    writer.finish().unwrap();
}

fn bake(dir: &Path, grids: Option<GridRecord>, last: u32) {
    let writer = CacheWriter::create(
        dir,
        manifest(grids),
        "",
        &[],
        Clock::default(),
        &ball(0.0),
        &Vec::new(),
    )
    .unwrap();
    go_on(writer, 1, last);
}

#[test]
fn a_cache_keeps_the_grids_of_each_frame_and_a_resumed_one_has_the_same_bytes() {
    let whole = tempfile::tempdir().unwrap();
    bake(whole.path(), Some(record()), 3);
    let reader = CacheReader::open(whole.path()).unwrap();
    let report = reader.verify().unwrap();
    let mut bytes = 0;
    for entry in reader.entries() {
        let grids = entry.file(GRIDS).unwrap();
        assert_eq!(grids.file, format!("grids/ball.{:04}.vdb", entry.frame));
        let content = fs::read(whole.path().join(&grids.file)).unwrap();
        assert_eq!(grids.bytes, content.len() as u64);
        assert_eq!(grids.blake3, blake3::hash(&content).to_hex().as_str());
        assert_eq!(vdb_print(&content).unwrap().len(), 2);
        bytes += entry.file(PARTICLES).unwrap().bytes + grids.bytes;
    }
    assert_eq!(report.bytes, bytes);

    let broken = tempfile::tempdir().unwrap();
    bake(broken.path(), Some(record()), 1);
    // What a crash leaves behind: the grids of a frame without a line, and half of the next file.
    let folder = broken.path().join("grids");
    fs::write(folder.join("ball.0002.vdb"), "torn").unwrap();
    fs::write(folder.join("ball.0003.vdb.tmp"), "torn").unwrap();
    let given = manifest(Some(record()));
    let (writer, last, _) = CacheWriter::resume(broken.path(), &given).unwrap();
    assert_eq!(last.frame, 1);
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
    go_on(writer, 2, 3);
    assert_eq!(
        directory_hash(broken.path()).unwrap(),
        directory_hash(whole.path()).unwrap()
    );
}

#[test]
fn damaged_missing_and_unasked_grids_are_found() {
    let dir = tempfile::tempdir().unwrap();
    bake(dir.path(), Some(record()), 2);
    let path = dir.path().join("grids/ball.0001.vdb");
    let good = fs::read(&path).unwrap();
    let mut bad = good.clone();
    bad[good.len() / 2] ^= 1;
    let problem = |content: Option<&[u8]>| {
        match content {
            Some(content) => fs::write(&path, content).unwrap(),
            None => fs::remove_file(&path).unwrap(),
        }
        let report = swell::cache::survey(dir.path()).unwrap();
        let [problem] = &report.problems[..] else {
            panic!("{report:?}");
        };
        assert_eq!(problem.file, path);
        problem.what.clone()
    };
    assert_eq!(problem(Some(&bad)), "its BLAKE3 checksum does not match");
    assert!(problem(Some(&good[1..])).contains("bytes instead of"));
    assert_eq!(problem(None), "it is missing");
    let resumed = CacheWriter::resume(dir.path(), &manifest(Some(record())));
    assert!(matches!(resumed, Err(CacheError::Damaged { file, .. }) if file == path));

    fs::write(&path, &good).unwrap();
    // A resume reads the last frame first, including its grids.
    let last = dir.path().join("grids/ball.0002.vdb");
    let mut content = fs::read(&last).unwrap();
    content[100] ^= 1;
    fs::write(&last, &content).unwrap();
    let resumed = CacheWriter::resume(dir.path(), &manifest(Some(record())));
    assert!(matches!(resumed, Err(CacheError::Damaged { file, .. }) if file == last));
    content[100] ^= 1;
    fs::write(&last, &content).unwrap();

    let coarser = GridRecord {
        voxel_size: 0.25,
        ..record()
    };
    for other in [None, Some(coarser)] {
        let resumed = CacheWriter::resume(dir.path(), &manifest(other));
        assert!(
            matches!(&resumed, Err(CacheError::OtherScene { field, .. }) if field == "grids"),
            "{resumed:?}"
        );
    }

    let plain = tempfile::tempdir().unwrap();
    bake(plain.path(), None, 1);
    assert!(!plain.path().join("grids").exists());
    for file in ["manifest.json", "frames.jsonl"] {
        let text = fs::read_to_string(plain.path().join(file)).unwrap();
        assert!(!text.contains("grids"), "{file}");
    }
}

const SCENE: &str = r#"
[shot]
name = "tank"
frames = 2
frames_per_second = 24
[domain]
min = [0, 0, 0]
max = [2, 1, 1]
[[water.block]]
min = [0, 0, 0]
max = [1, 1, 1]
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
[solver.flip]
cell_size = 0.25
particles_per_cell = 27
"#;

#[test]
fn scenes_ask_for_grids() {
    let parse = |table: &str, set: &[&str]| {
        let set: Vec<_> = set.iter().map(|&s| s.to_owned()).collect();
        parse_scene(
            &format!("{SCENE}{table}"),
            Path::new("a.toml"),
            Path::new(""),
            &set,
        )
    };
    let plain = parse("", &[]).unwrap();
    assert_eq!(plain.grids, None);
    assert!(!scene_to_toml(&plain, &|_, _| String::new()).contains("grids"));
    let pbf = parse("[grids]\nsurface = true\n", &[]).unwrap();
    let grids = pbf.grids.unwrap();
    assert_eq!((grids.voxel_size, grids.velocity), (0.2, false));
    assert_eq!(grids.precision, Precision::Half);
    let flip = parse("[grids]\nsurface = true\n", &["solver.method=flip"]).unwrap();
    assert_eq!(flip.grids.unwrap().voxel_size, 0.25);
    let written = scene_to_toml(&pbf, &|_, _| String::new());
    let again = parse_scene(&written, Path::new("b.toml"), Path::new(""), &[]).unwrap();
    assert_eq!(again, pbf);
    // Grids are derived from the particles and are therefore no part of the physics.
    assert_eq!(physics_hash(&pbf), physics_hash(&plain));

    for (table, key, words) in [
        ("", "grids", "neither surface nor velocity"),
        (
            "surface = false",
            "grids.surface",
            "neither surface nor velocity",
        ),
        (
            "surface = true\nvoxel_size = 0.02",
            "grids.voxel_size",
            "0.02 is out of range",
        ),
        (
            "surface = true\nvoxel_size = nan",
            "grids.voxel_size",
            "out of range",
        ),
        (
            "surface = true\nprecision = \"double\"",
            "grids.precision",
            "\"half\" or \"float\"",
        ),
        (
            "velocty = true",
            "grids.velocty",
            "the nearest is \"velocity\"",
        ),
    ] {
        let error = parse(&format!("[grids]\n{table}\n"), &[])
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(key) && error.contains(words),
            "{table}: {error}"
        );
    }
}
