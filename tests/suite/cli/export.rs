//! `swell export` as a user runs it: what it writes, resumes, shares and refuses.

use std::{collections::BTreeMap, fs, path::Path};
use swell::files::load_look;

use glam::DVec3;
use swell::{
    domain::{mesh::TriangleMesh, mesh_file::MeshFormat},
    render::eye,
};
use tempfile::TempDir;

use crate::support::{
    job::Job,
    made_cache::{Made, write_cache},
};

/// Water volume of a made cache, m³: its particles times their volume.
const VOLUME: f64 = 800.0 * 0.001;

/// A folder with a cache that no solver made.
fn made() -> Job {
    let job = Job::of(&[("look.toml", crate::support::job::LOOK)]);
    write_cache(&job.path("cache"), &Made::default());
    job
}

fn mesh(file: &Path) -> TriangleMesh {
    TriangleMesh::load(file).unwrap()
}

/// Names in a folder with their contents, except for the folder of records.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    entries
        .filter(|entry| entry.path().is_file())
        .map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, fs::read(entry.path()).unwrap())
        })
        .collect()
}

#[test]
fn meshes_are_closed_and_hold_the_water() {
    let job = made();
    fs::create_dir(job.path("out")).unwrap();
    let said = job.expect(0, "export cache --mesh out/m.%04d.ply --frames 0,2,4");
    assert!(said.contains("3 files made"), "{said}");
    job.expect(0, "export cache --mesh out/m.%04d.obj --frames 2");
    for name in ["m.0000.ply", "m.0002.ply", "m.0004.ply", "m.0002.obj"] {
        let found = mesh(&job.path("out").join(name));
        assert!(found.open_edges().is_empty(), "{name}");
        let ratio = found.signed_volume() / VOLUME;
        assert!((ratio - 1.0).abs() <= 0.01, "{name}: {ratio}");
        // The block's position: it touches the sides of the domain, where it is flat.
        let bounds = found.bounds().unwrap();
        let low = DVec3::new(-1.0, 0.5, 0.25);
        assert!(
            (bounds.min - low).abs().max_element() < 0.1,
            "{name}: {bounds:?}"
        );
        assert_eq!(bounds.min.z, 0.25, "{name}");
    }
    let [ply, obj] = ["m.0002.ply", "m.0002.obj"].map(|name| mesh(&job.path("out").join(name)));
    assert_eq!(ply.triangles, obj.triangles);
    // Negative control: a missing triangle opens the mesh, and an inverted mesh has a
    // negative volume.
    let bytes = fs::read(job.path("out/m.0002.ply")).unwrap();
    let count = format!("element face {}", ply.triangles.len());
    let fewer = format!("element face {}", ply.triangles.len() - 1);
    let at = bytes
        .windows(count.len())
        .position(|w| w == count.as_bytes())
        .unwrap();
    assert_eq!(count.len(), fewer.len());
    let mut spoiled = bytes.clone();
    spoiled[at..at + fewer.len()].copy_from_slice(fewer.as_bytes());
    spoiled.truncate(bytes.len() - 13);
    let open = TriangleMesh::from_bytes(&spoiled, MeshFormat::Ply, Path::new("m.ply")).unwrap();
    assert!(!open.open_edges().is_empty());
}

/// The columns after x y z nx ny nz of a PLY that we wrote.
fn velocities(bytes: &[u8]) -> Vec<[f32; 3]> {
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = String::from_utf8_lossy(&bytes[..start]).into_owned();
    let count = header
        .lines()
        .find_map(|line| line.strip_prefix("element vertex "));
    let count: usize = count.unwrap().parse().unwrap();
    let row = |k: usize| {
        let at = |c: usize| start + 36 * k + 4 * c;
        [6, 7, 8].map(|c| f32::from_le_bytes(bytes[at(c)..at(c) + 4].try_into().unwrap()))
    };
    (0..count).map(row).collect()
}

#[test]
fn vertices_go_as_the_particles_do() {
    let job = made();
    job.expect(0, "export cache --mesh m.%04d.ply --frames 1");
    let found = velocities(&fs::read(job.path("m.0001.ply")).unwrap());
    // All particles move along x with 1 m/s, and along y with a thousandth of their number.
    assert!(
        found
            .iter()
            .all(|v| (v[0] - 1.0).abs() < 1e-4 && v[2].abs() < 1e-4)
    );
    let [least, most] =
        [f32::min, f32::max].map(|pick| found.iter().map(|v| v[1]).reduce(pick).unwrap());
    assert!(
        (-1.3..-0.5).contains(&least) && (-0.2..0.4).contains(&most),
        "{least} {most}"
    );
}

#[test]
fn tables_hold_what_the_cache_does() {
    let job = made();
    job.expect(
        0,
        "export cache --npy p.%04d.npy --csv p.%04d.csv --bgeo p.%04d.bgeo --frames 3",
    );
    let cache = swell::cache::CacheReader::open(&job.path("cache")).unwrap();
    let wanted = cache.read(3).unwrap();
    let text = fs::read_to_string(job.path("p.0003.csv")).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let row: Vec<f32> = line.split(',').map(|x| x.parse().unwrap()).collect();
        row
    });
    let rows: Vec<_> = rows.collect();
    assert_eq!(rows.len(), wanted.len());
    for (k, row) in rows.iter().enumerate() {
        assert_eq!(row[1..4], wanted.position[k]);
        assert_eq!(row[4..7], wanted.velocity[k]);
    }
    let npy = fs::read(job.path("p.0003.npy")).unwrap();
    let last = &npy[npy.len() - 28..];
    let place: Vec<f32> = last[..12]
        .chunks(4)
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    assert_eq!(place, wanted.position[wanted.len() - 1]);
    assert_eq!(last[24..], wanted.id[wanted.len() - 1].to_le_bytes());
    let bgeo = fs::read(job.path("p.0003.bgeo")).unwrap();
    assert!(bgeo.starts_with(b"BgeoV") && bgeo.len() > 800 * 32);
}

#[test]
fn grids_are_those_that_the_bake_kept() {
    let job = Job::of(&[]);
    write_cache(&job.path("cache"), &Made::watched());
    job.expect(0, "export cache --vdb g.%04d.vdb --frames 2");
    let kept = fs::read(job.path("cache/grids/small.0002.vdb")).unwrap();
    assert!(fs::read(job.path("g.0002.vdb")).unwrap() == kept);
    assert!(
        fs::read(job.path("cache/grids/small.0003.vdb")).unwrap() != kept,
        "the control"
    );
    // A bake that kept no grids gets them from the scene's defaults.
    let bare = made();
    bare.expect(0, "export cache --vdb g.%04d.vdb --frames 2");
    let parsed = vdb_rs::VdbReader::new(std::io::Cursor::new(
        fs::read(bare.path("g.0002.vdb")).unwrap(),
    ));
    let reader = parsed.unwrap();
    let mut names = reader.available_grids();
    names.sort();
    assert_eq!(names, ["surface", "vel"]);
}

#[test]
fn a_shot_names_its_layers_and_its_camera() {
    let job = made();
    job.expect(
        0,
        "export cache --usd s.usda --look look.toml --frames 1-4x2",
    );
    let root = fs::read_to_string(job.path("s.usda")).unwrap();
    for part in [
        "@./s.0001.usda@, @./s.0003.usda@",
        "def Camera \"camera\"",
        "def Points \"water\"",
    ] {
        assert!(root.contains(part), "{part}: {root}");
    }
    assert!(job.path("s.0003.usda").is_file() && job.path("s.manifest.usda").is_file());
    assert!(!job.path("s.0002.usda").exists());
    // The shot's camera, read by a look, equals the look's own. The export of more frames below
    // extends the root and keeps the layers.
    let text = crate::support::job::LOOK.replace("focal_length_mm = 35.0", "file = \"s.usda\"");
    let is_of_camera = |line: &&str| !line.starts_with("position") && !line.starts_with("target");
    let lines: Vec<_> = text.lines().filter(is_of_camera).collect();
    job.write("again.toml", &lines.join("\n"));
    let per_second = job.json(0, "inspect cache")["frames_per_second"]
        .as_f64()
        .unwrap();
    for frame in [1.0, 3.0] {
        let [own, again] = ["look.toml", "again.toml"].map(|file| {
            let look = load_look(&job.path(file)).unwrap();
            eye(&look, DVec3::ZERO, frame, per_second)
        });
        assert!((own.position - again.position).length() < 1e-12);
        assert!((own.forward - again.forward).length() < 1e-12);
        assert!((own.up - again.up).length() < 1e-12);
        // The layer stores lengths in 32 bits.
        assert!((own.focal / again.focal - 1.0).abs() < 3e-7);
    }
    let said = job.expect(0, "export cache --usd s.usda --look look.toml --frames 1-4");
    assert!(
        said.contains("2 already existed") || said.contains("3 already existed"),
        "{said}"
    );
    assert!(
        fs::read_to_string(job.path("s.usda"))
            .unwrap()
            .contains("s.0002.usda")
    );
    let mesh = Job::of(&[]);
    write_cache(&mesh.path("cache"), &Made::default());
    mesh.expect(0, "export cache --usd s.usda --usd-water mesh --frames 1");
    let layer = fs::read_to_string(mesh.path("s.0001.usda")).unwrap();
    assert!(layer.contains("faceVertexIndices.timeSamples") && !layer.contains("ids"));
}

/// Folder names are taken literally, and a root in text names its layers whatever
/// characters they have.
#[test]
fn names_hold_what_file_systems_take() {
    let job = made();
    fs::create_dir(job.path("100%#1")).unwrap();
    job.expect(
        0,
        "export cache --frames 1-2 --mesh 100%#1/m.%04d.usd --npy 100%#1/p.##.npy \
         --usd 100%#1/take@2.usd --look look.toml",
    );
    let made = files(&job.path("100%#1"));
    let names: Vec<_> = made.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "m.0001.usd",
            "m.0002.usd",
            "p.01.npy",
            "p.02.npy",
            "take@2.0001.usd",
            "take@2.0002.usd",
            "take@2.manifest.usd",
            "take@2.sky.exr",
            "take@2.usd",
        ]
    );
    let root = String::from_utf8(made["take@2.usd"].clone()).unwrap();
    let layers = "[@@@./take@2.0001.usd@@@, @@@./take@2.0002.usd@@@]";
    assert!(root.contains(layers), "{root}");
    // A reader resolves the escaped names.
    let text =
        crate::support::job::LOOK.replace("focal_length_mm = 35.0", "file = \"100%#1/take@2.usd\"");
    let is_of_camera = |line: &&str| !line.starts_with("position") && !line.starts_with("target");
    let lines: Vec<_> = text.lines().filter(is_of_camera).collect();
    job.write("again.toml", &lines.join("\n"));
    job.expect(0, "inspect again.toml");
    // Negative controls: a number in a folder's name and names that USD cannot express are refused.
    job.expect_clear(2, "export cache --npy %04d/p.npy", "the file's name in");
    let words = ["export", "cache", "--usd", "two\nlines.usda"];
    let output = job.command("").args(words).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.code() == Some(2) && said.contains("has a line end"),
        "{said}"
    );
}

/// The first of the frames has the requested number, in names and in USD; the
/// contents are unchanged.
#[test]
fn files_are_numbered_from_another_frame() {
    let job = made();
    for folder in ["plain", "moved", "shared"] {
        fs::create_dir(job.path(folder)).unwrap();
    }
    let words = |folder: &str, more: &str| {
        format!(
            "export cache --frames 2-4x2 --npy {folder}/p.%04d.npy --usd {folder}/s.usda \
             --look look.toml {more}"
        )
    };
    job.expect(0, &words("plain", ""));
    job.expect(0, &words("moved", "--number-from 1001"));
    let moved = files(&job.path("moved"));
    let names: Vec<_> = moved.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "p.1001.npy",
            "p.1003.npy",
            "s.1001.usda",
            "s.1003.usda",
            "s.manifest.usda",
            "s.sky.exr",
            "s.usda"
        ]
    );
    let plain = files(&job.path("plain"));
    assert_eq!(moved["p.1003.npy"], plain["p.0004.npy"]);
    assert_ne!(moved["p.1001.npy"], moved["p.1003.npy"]);
    let [root, layer, own] = [&moved["s.usda"], &moved["s.1003.usda"], &plain["s.usda"]]
        .map(|bytes| String::from_utf8(bytes.clone()).unwrap());
    for part in [
        "startTimeCode = 1001",
        "endTimeCode = 1003",
        "active = [(1001, 0), (1003, 1)]",
        "assetPaths = [@./s.1001.usda@, @./s.1003.usda@]",
        "times = [(1001, 1001), (1003, 1003)]",
    ] {
        assert!(root.contains(part), "{part}: {root}");
    }
    assert!(
        layer.contains("startTimeCode = 1003") && layer.contains("    1003: ["),
        "{layer}"
    );
    // What the set does at a frame, here its camera, it does at the new number.
    let at = |text: &str, number: u32| {
        let before = format!("{number}: ( (");
        let line = text.lines().find(|line| line.trim().starts_with(&before));
        line.unwrap().trim().trim_start_matches(&before).to_owned()
    };
    assert_eq!(at(&root, 1003), at(&own, 4));
    // Shares have the numbers of the whole range.
    for k in 1..=2 {
        job.expect(
            0,
            &words("shared", &format!("--number-from 1001 --chunk {k}/2")),
        );
    }
    assert_eq!(files(&job.path("shared")), moved);
    // A repeated export resumes; an existing file of another frame is refused and kept.
    let said = job.expect(0, &words("moved", "--number-from 1001"));
    assert!(said.contains("0 files made"), "{said}");
    job.expect(
        4,
        "export cache --npy moved/p.%04d.npy --frames 1-4 --number-from 1001",
    );
    assert_eq!(files(&job.path("moved")), moved);
    job.expect(
        0,
        "export cache --npy moved/p.%04d.npy --frames 4 --number-from 1001 --overwrite",
    );
    assert_eq!(files(&job.path("moved"))["p.1001.npy"], plain["p.0004.npy"]);
    // A shot whose layers would have other names keeps its root.
    let standing = files(&job.path("moved"));
    let again =
        "export cache --frames 2-4x2 --usd moved/s.usda --look look.toml --number-from 2001";
    job.expect_clear(4, again, "exported in another way");
    assert_eq!(files(&job.path("moved")), standing);
    job.expect_clear(2, &words("moved", "--number-from x"), "--number-from");
}

#[test]
fn export_skips_complete_files() {
    let job = made();
    fs::create_dir(job.path("out")).unwrap();
    let words = "export cache --mesh out/m.%04d.ply --npy out/p.%04d.npy";
    let said = job.expect(0, words);
    assert!(said.contains("8 files made"), "{said}");
    let first = files(&job.path("out"));
    assert_eq!(first.len(), 8);
    let said = job.expect(0, words);
    assert!(
        said.contains("0 files made") && said.contains("8 already existed"),
        "{said}"
    );
    // A truncated file and a missing one are made again, with the same bytes.
    let half = &first["m.0002.ply"][..1000];
    fs::write(job.path("out/m.0002.ply"), half).unwrap();
    fs::remove_file(job.path("out/p.0004.npy")).unwrap();
    let said = job.expect(0, words);
    assert!(said.contains("2 files made"), "{said}");
    assert_eq!(files(&job.path("out")), first);
    // Other settings are refused, and nothing is touched.
    let said = job.expect(4, &format!("{words} --voxels 1"));
    assert!(
        said.contains("exported in another way") && said.contains("--overwrite"),
        "{said}"
    );
    assert_eq!(files(&job.path("out")), first);
    job.expect(0, &format!("{words} --voxels 1 --overwrite"));
    assert_ne!(files(&job.path("out")), first);
}

#[test]
fn shares_fill_one_folder_as_one_export_does() {
    let job = made();
    for folder in ["whole", "shared"] {
        fs::create_dir(job.path(folder)).unwrap();
    }
    job.expect(0, "export cache --mesh whole/m.%04d.ply --usd whole/s.usda");
    let share = |k: u32| {
        let words =
            format!("export cache --mesh shared/m.%04d.ply --usd shared/s.usda --chunk {k}/3");
        job.command(&words).spawn().unwrap()
    };
    let running: Vec<_> = (1..=3).map(share).collect();
    for mut process in running {
        assert!(process.wait().unwrap().success());
    }
    assert_eq!(files(&job.path("whole")), files(&job.path("shared")));
    let said = job.expect(2, "export cache --mesh shared/m.%04d.ply --chunk 4/3");
    assert!(said.contains("there is no share 4 of 3"), "{said}");
}

#[test]
fn faults_of_export_are_one_line_with_exit_code() {
    let job = made();
    let clear = |code, words: &str, part: &str| job.expect_clear(code, words, part);
    clear(2, "export cache", "nothing to export");
    clear(
        2,
        "export cache --mesh m.ply",
        "place for the frame's number",
    );
    clear(
        2,
        "export cache --mesh m.%04d.abc",
        "a mesh is written as .ply, .obj, .usda, .usd, .usdc",
    );
    clear(2, "export cache --usd s.usda --look gone.toml", "gone.toml");
    clear(
        2,
        "export cache --npy p.%04d.npy --look look.toml",
        "no USD shot is exported",
    );
    clear(2, "export cache --mesh cache/m.%04d.ply", "in the cache");
    clear(
        2,
        "export cache --usd s.usdc --python no-such-python",
        "pip install usd-core",
    );
    clear(
        4,
        "export cache --npy p.%04d.npy --frames 3-9",
        "frames 0 to 4, not 5",
    );
    clear(
        4,
        "export cache --npy p.%04d.npy --stream default",
        "swell whitewater",
    );
    clear(4, "export gone --npy p.%04d.npy", "gone");
    fs::write(job.path("p.0002.npy"), "mine").unwrap();
    clear(
        4,
        "export cache --npy p.%04d.npy",
        "p.0002.npy is not from an export",
    );
    assert!(!job.path("p.0001.npy").exists(), "nothing was written");
    assert_eq!(fs::read(job.path("p.0002.npy")).unwrap(), b"mine");
    let film = "film_back_mm = [36.0, 20.25]\n";
    job.edit("look.toml", film, "file = \"gone.glb\"\n");
    job.edit("look.toml", "focal_length_mm = 35.0\n", film);
    job.edit(
        "look.toml",
        "position = [-2.0, 3.0, 2.5]\ntarget = [0.0, 1.0, 0.75]\n",
        "",
    );
    clear(2, "export cache --usd s.usda --look look.toml", "gone.glb");
}

/// A film back of 36 × 24 mm with an image of 16 : 9, at 35 mm: the exported camera has the part of
/// it that the image covers, in tenths of a scene unit (1 m).
#[test]
fn a_camera_s_fitted_film_is_exported() {
    let job = made();
    job.edit("look.toml", "[36.0, 20.25]", "[36.0, 24.0]");
    let lengths = |out: &str| {
        job.expect(0, &format!("export cache --usd {out} --look look.toml"));
        let text = fs::read_to_string(job.path(out)).unwrap();
        ["focalLength", "horizontalAperture", "verticalAperture"].map(|key| {
            let (_, behind) = text.split_once(key).unwrap();
            // Of several frames, the first one's value.
            let from = behind.strip_prefix(".timeSamples = {").unwrap_or(behind);
            let value = from.trim_start_matches(" = ").trim();
            let value = value.strip_prefix("1: ").unwrap_or(value);
            let end = value.find([',', '\n']).unwrap();
            value[..end].parse::<f64>().unwrap()
        })
    };
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    let by_width = lengths("width.usda");
    assert!(near(by_width, [0.35, 0.36, 0.2025]), "{by_width:?}");
    job.edit("look.toml", "[camera]\n", "[camera]\nfit = \"height\"\n");
    let by_height = lengths("height.usda");
    assert!(near(by_height, [0.35, 1.28 / 3.0, 0.24]), "{by_height:?}");
    assert!(!near(by_height, by_width));
    let said = job.expect(0, "inspect look.toml");
    let words = "camera of 35 mm on film of 36 × 24 mm, where the image takes 42.67 × 24, ";
    assert!(said.contains(words), "{said}");
}

#[test]
fn a_damaged_frame_ends_an_export_with_whole_files() {
    let job = made();
    let frame = job.path("cache/frames/small.0003.ply");
    let mut bytes = fs::read(&frame).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&frame, bytes).unwrap();
    let said = job.expect(4, "export cache --mesh m.%04d.ply");
    assert!(said.contains("small.0003.ply is damaged"), "{said}");
    let there: Vec<String> = files(job.folder.path()).into_keys().collect();
    assert_eq!(there, ["look.toml", "m.0001.ply", "m.0002.ply"]);
    assert!(mesh(&job.path("m.0002.ply")).open_edges().is_empty());
}

#[cfg(unix)]
#[test]
fn an_export_that_is_killed_leaves_whole_files_and_goes_on() {
    let job = made();
    fs::create_dir(job.path("out")).unwrap();
    let words = "export cache --mesh out/m.%04d.ply --voxels 4";
    let begun = std::time::Instant::now();
    let mut process = job.command(words).spawn().unwrap();
    // Waits for the first file, so that the kill falls in the middle on any machine.
    while !job.path("out/m.0001.ply").exists() && begun.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    process.kill().unwrap();
    process.wait().unwrap();
    for name in files(&job.path("out")).keys() {
        assert!(
            mesh(&job.path("out").join(name)).open_edges().is_empty(),
            "{name}"
        );
    }
    job.expect(0, words);
    let whole = TempDir::new().unwrap();
    let all = format!(
        "export cache --mesh {}/m.%04d.ply --voxels 4",
        whole.path().display()
    );
    job.expect(0, &all);
    assert_eq!(files(&job.path("out")), files(whole.path()));
}
