//! Untrusted files: readers believe no count or size in a header, survive any damage without a
//! panic, and follow no path out of the scene's folder.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    fs,
    path::Path,
};

use crate::support::cache as stand_in;
use crate::support::job::Job;
use crate::support::mutate::mutate;
use proptest::prelude::*;
use swell::{
    cache::{self, CacheReader, CacheWriter, frame},
    domain::{mesh::TriangleMesh, mesh_file::MeshFormat},
    files::study::Study,
};

/// An allocator that records the largest allocation of each thread.
struct Watching;

thread_local! {
    static LARGEST: Cell<usize> = const { Cell::new(0) };
}

fn note(size: usize) {
    // The thread-local is gone while a thread ends.
    let _ = LARGEST.try_with(|largest| largest.set(largest.get().max(size)));
}

// SAFETY: forwards every call to the system's allocator; `note` does not allocate.
unsafe impl GlobalAlloc for Watching {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: the caller upholds the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller upholds the contract of `dealloc`.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(size);
        // SAFETY: the caller upholds the contract of `realloc`.
        unsafe { System.realloc(memory, layout, size) }
    }
}

#[global_allocator]
static WATCHING: Watching = Watching;

/// Returns the largest allocation that `work` makes, bytes.
fn largest(work: impl FnOnce()) -> usize {
    LARGEST.set(0);
    work();
    LARGEST.get()
}

/// Bytes that a kilobyte file may allocate: more than any of its lines or tables needs, less than
/// any of the false counts below asks for.
const MODEST: usize = 1 << 20;

#[test]
fn a_promise_of_a_trillion_is_refused_without_memory_for_it() {
    let header = |format: &str, vertices: &str, faces: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\n\
             property float y\n\
             property float z\nelement face {faces}\nproperty list uchar uint vertex_indices\n\
             end_header\n"
        )
    };
    let mut meshes = Vec::new();
    for many in [
        "1000000000000",
        "4294967295",
        "9223372036854775807",
        "18446744073709551615",
    ] {
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            meshes.push((MeshFormat::Ply, header(format, many, "1").into_bytes()));
            meshes.push((MeshFormat::Ply, header(format, "0", many).into_bytes()));
        }
    }
    // A list property that claims a great length.
    let wide = header("ascii", "3", "1").replace("list uchar uint", "list uint uint");
    meshes.push((
        MeshFormat::Ply,
        format!("{wide}0 0 0\n1 0 0\n0 1 0\n4294967295 0 1 2\n").into_bytes(),
    ));
    let mut stl = vec![0u8; 80];
    stl.extend(u32::MAX.to_le_bytes());
    meshes.push((MeshFormat::Stl, stl));
    meshes.push((MeshFormat::Obj, b"v 0 0 0\nf 1 1000000000000 3\n".to_vec()));
    for (format, bytes) in meshes {
        let words = String::from_utf8_lossy(&bytes).into_owned();
        let cost = largest(|| {
            let read = TriangleMesh::from_bytes(&bytes, format, Path::new("mesh"));
            assert!(read.is_err(), "{words}");
        });
        assert!(cost < MODEST, "{cost} bytes for {words}");
    }
    // One of our frames with a false particle count.
    let good = fs::read(stand_in::baked().join("frames/tank.0001.ply")).unwrap();
    let end = good.windows(11).position(|w| w == b"end_header\n").unwrap();
    let text = String::from_utf8(good[..end].to_vec()).unwrap();
    assert!(text.contains("element vertex 7\n"));
    for many in ["1000000000000", "18446744073709551615", "8", "6"] {
        let mut bytes = text
            .replace("vertex 7", &format!("vertex {many}"))
            .into_bytes();
        bytes.extend(&good[end..]);
        let cost = largest(|| {
            let read = frame::decode(&bytes, Path::new("frame"));
            let said = read.expect_err(many).to_string();
            assert!(said.contains("declares"), "{said}");
        });
        assert!(cost < MODEST, "{cost} bytes for {many} particles");
    }
    // Negative control: a large allocation is detected.
    assert!(largest(|| drop(Vec::<u8>::with_capacity(2 * MODEST))) >= 2 * MODEST);
}

/// Any eight bytes of a level set in turn, among them each count, length and offset.
#[test]
fn no_size_in_a_level_set_is_believed() {
    let good = include_bytes!("../domain/files/half.vdb");
    let mut refused = 0;
    for at in (0..900).chain((900..good.len() - 8).step_by(61)) {
        for size in [1u64 << 40, u64::MAX >> 1, u64::MAX] {
            let mut bytes = good.to_vec();
            bytes[at..at + 8].copy_from_slice(&size.to_le_bytes());
            let cost = largest(|| {
                let read = TriangleMesh::from_bytes(&bytes, MeshFormat::Vdb, Path::new("mesh"));
                refused += u32::from(read.is_err());
            });
            assert!(cost < MODEST, "{cost} bytes for {size} at {at}");
        }
    }
    assert!(refused > 1000, "{refused}");
}

/// Contents of the baked cache's ledger, line by line, with another manifest's hash.
fn contents(manifest: &[u8]) -> Vec<Vec<u8>> {
    let text = fs::read_to_string(stand_in::baked().join("frames.jsonl")).unwrap();
    let old = blake3::hash(&fs::read(stand_in::baked().join("manifest.json")).unwrap());
    let new = blake3::hash(manifest);
    let text = text.replace(old.to_hex().as_str(), new.to_hex().as_str());
    let content = |line: &str| format!("{}}}", &line[..line.rfind(",\"chain\":").unwrap()]);
    text.lines()
        .map(|line| content(line).into_bytes())
        .collect()
}

/// Runs everything that reads a cache on a copy whose manifest and ledger are replaced.
fn read_all(manifest: &[u8], ledger: &[u8]) {
    let dir = stand_in::copied();
    fs::write(dir.path().join("manifest.json"), manifest).unwrap();
    fs::write(dir.path().join("frames.jsonl"), ledger).unwrap();
    let _ = cache::survey(dir.path());
    if let Ok(reader) = CacheReader::open(dir.path()) {
        assert!(!reader.entries().is_empty() && reader.first_frame() <= reader.last_frame());
        for entry in reader.entries() {
            let _ = reader.read(entry.frame);
        }
        let _ = reader.asset("city.obj");
    }
    let _ = CacheWriter::resume(dir.path(), &stand_in::manifest());
}

#[test]
fn the_seeds_are_a_cache() {
    let manifest = fs::read(stand_in::baked().join("manifest.json")).unwrap();
    let ledger = stand_in::chained(&manifest, &contents(&manifest));
    assert_eq!(
        ledger,
        fs::read(stand_in::baked().join("frames.jsonl")).unwrap()
    );
    // Another manifest whose hash is in the ledger: readers accept a consistent forgery.
    let text = String::from_utf8(manifest).unwrap();
    let other = text
        .replace("its driver 1.2", "its driver 1.3")
        .into_bytes();
    let dir = stand_in::copied();
    fs::write(dir.path().join("manifest.json"), &other).unwrap();
    fs::write(
        dir.path().join("frames.jsonl"),
        stand_in::chained(&other, &contents(&other)),
    )
    .unwrap();
    CacheReader::open(dir.path()).unwrap().verify().unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_mutation_of_a_manifest_makes_a_reader_panic(
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let manifest = mutate(fs::read(stand_in::baked().join("manifest.json")).unwrap(), &edits);
        read_all(&manifest, &stand_in::chained(&manifest, &contents(&manifest)));
    }

    /// The chain hashes are valid, so that each line gets as far as its own checks.
    #[test]
    fn no_mutation_of_a_ledger_makes_a_reader_panic(
        which in any::<prop::sample::Index>(),
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let manifest = fs::read(stand_in::baked().join("manifest.json")).unwrap();
        let mut lines = contents(&manifest);
        let line = which.index(lines.len());
        lines[line] = mutate(std::mem::take(&mut lines[line]), &edits);
        read_all(&manifest, &stand_in::chained(&manifest, &lines));
    }

    #[test]
    fn no_mutation_of_a_frame_makes_its_reader_panic(
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let good = fs::read(stand_in::baked().join("frames/tank.0002.ply")).unwrap();
        let _ = frame::decode(&mutate(good, &edits), Path::new("frame"));
    }
}

/// The largest frame number has no successor.
#[test]
fn a_parent_at_the_last_frame_number_is_read_or_refused() {
    let manifest = fs::read_to_string(stand_in::baked().join("manifest.json")).unwrap();
    let last = u32::MAX;
    let parent = format!(
        "\"parent\": {{ \"shot\": \"a\", \"solver\": \"pbf\", \"scene_hash\": \"\", \"frame\": \
         {last}, \"blake3\": \"\" }},\n  \"start_particles\""
    );
    let manifest = manifest
        .replace("\"start_particles\"", &parent)
        .into_bytes();
    let lines = contents(&manifest);
    read_all(&manifest, &stand_in::chained(&manifest, &lines));
    let renumber = |line: &Vec<u8>, frame: u32| {
        let text = String::from_utf8(line.clone()).unwrap();
        let text = text.replace("\"frame\":0,", &format!("\"frame\":{frame},"));
        text.replace("tank.0000.", &format!("tank.{frame}."))
            .into_bytes()
    };
    read_all(
        &manifest,
        &stand_in::chained(&manifest, &[renumber(&lines[0], last)]),
    );
    read_all(
        &manifest,
        &stand_in::chained(&manifest, &[renumber(&lines[0], last), lines[1].clone()]),
    );
}

#[test]
fn scenes_and_looks_stay_in_their_folders_unless_told() {
    let job = Job::new();
    fs::create_dir(job.path("scenes")).unwrap();
    fs::rename(job.path("small.toml"), job.path("scenes/small.toml")).unwrap();
    let edit = |from: &str, to: &str| job.edit("scenes/small.toml", from, to);
    edit("mesh = \"box.obj\"", "mesh = \"../box.obj\"");
    let bake = "bake scenes/small.toml --device cpu --frames 1 -o";
    let refused = |words: &str, expected: &[&str]| {
        let said = job.expect(2, words);
        for part in expected
            .iter()
            .chain(&["leads out of the folder", "--allow-outside"])
        {
            assert!(said.contains(part), "{part}: {said}");
        }
    };
    refused(
        &format!("{bake} mesh"),
        &["scenes/small.toml:16: solid[0].mesh"],
    );
    refused("inspect scenes/small.toml", &["solid[0].mesh"]);
    refused("check scenes/small.toml", &["solid[0].mesh"]);
    assert!(!job.path("mesh").exists());
    job.expect(0, &format!("{bake} mesh --allow-outside"));
    job.expect(0, "inspect scenes/small.toml --allow-outside");
    // The cache has its own copy of the mesh and needs no permission.
    job.expect(0, "verify mesh");
    job.expect(0, "render mesh --look look.toml -o pictures");
    let absolute = job.path("box.obj");
    edit("../box.obj", absolute.to_str().unwrap());
    refused(&format!("{bake} absolute"), &["solid[0].mesh"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../box.obj", job.path("scenes/link.obj")).unwrap();
        edit(absolute.to_str().unwrap(), "link.obj");
        refused(&format!("{bake} link"), &["solid[0].mesh"]);
        fs::remove_file(job.path("scenes/link.obj")).unwrap();
    }
    fs::copy(job.path("box.obj"), job.path("scenes/link.obj")).unwrap();
    job.expect(0, &format!("{bake} link"));
    fs::write(job.path("push.csv"), "0,0\n1,0.1\n").unwrap();
    edit(
        "kind = \"sine\", stroke = 0.3, period = 0.5, ramp = 0.1",
        "kind = \"table\", file = \"../push.csv\"",
    );
    refused(&format!("{bake} table"), &["wave_maker[0].motion.file"]);
    job.expect(0, &format!("{bake} table --allow-outside"));
    // An override on the command line follows the same rule.
    refused(
        &format!("{bake} set --set wave_maker[0].motion.file=/etc/passwd"),
        &["wave_maker[0].motion.file"],
    );
    // A look and its sky.
    fs::create_dir(job.path("looks")).unwrap();
    let look = fs::read_to_string(job.path("look.toml")).unwrap();
    // A panorama is twice as wide as high.
    let wide = look.replace("height = 36", "height = 32").replace(
        "film_back_mm = [36.0, 20.25]",
        "film_back_mm = [36.0, 18.0]",
    );
    fs::write(job.path("wide.toml"), wide).unwrap();
    job.expect(0, "render link --look wide.toml -o sky --frames 1");
    let sky = "model = \"panorama\"\nfile = \"../sky/small.0001.exr\"";
    fs::write(
        job.path("looks/look.toml"),
        look.replace("model = \"hosek_wilkie\"", sky),
    )
    .unwrap();
    let render = "render link --look looks/look.toml -o under";
    refused(render, &["looks/look.toml:", "sky.file"]);
    job.expect(0, &format!("{render} --allow-outside"));
    // A study may name scenes and looks anywhere; the files that these name must lie
    // in their folders.
    fs::create_dir(job.path("studies-of")).unwrap();
    let study = fs::read_to_string(job.path("study.toml")).unwrap();
    let study = study
        .replace("small.toml", "../scenes/small.toml")
        .replace("look.toml", "../look.toml");
    fs::write(job.path("studies-of/study.toml"), study).unwrap();
    refused(
        "study studies-of/study.toml -o out",
        &["wave_maker[0].motion.file"],
    );
    assert!(!job.path("out").exists());
}

/// Reading a pipe would never end.
#[cfg(unix)]
#[test]
fn a_mesh_that_is_a_pipe_is_refused() {
    let job = Job::new();
    let made = std::process::Command::new("mkfifo")
        .arg(job.path("pipe.obj"))
        .status();
    assert!(made.unwrap().success());
    job.edit("small.toml", "box.obj", "pipe.obj");
    let said = job.expect(2, "inspect small.toml");
    assert!(
        said.contains("not a plain file") && said.contains("small.toml:"),
        "{said}"
    );
}

/// Meshes whose holes face each other are refused; with other holes a mesh is accepted, and every
/// command and the cache report them.
#[test]
fn an_open_mesh_is_told_of_everywhere_and_a_tube_is_refused() {
    let job = Job::new();
    // Waves of half a second would break, which is a warning too.
    job.edit("small.toml", "period = 0.5", "period = 2.0");
    job.expect(0, "bake small.toml --device cpu --frames 1 -o closed");
    // The cache has its own copy under a name of its own.
    let told = ".obj is open and treated as closed: 1 hole: 4 open edges about (0.5000, 0.5000, \
        0.7000), 0.5657 m across; inside is where its winding number is above one half";
    let manifest = |cache: &str| fs::read_to_string(job.path(cache).join("manifest.json")).unwrap();
    assert!(!manifest("closed").contains("warnings"));
    assert!(!job.expect(0, "inspect small.toml").contains("warning"));
    // The box without its floor.
    job.edit("box.obj", "f 1 2 6 5\n", "");
    for words in [
        "inspect small.toml",
        "bake small.toml --device cpu --frames 1 -o open",
        "bake small.toml --device cpu --frames 1 -o json --progress json",
        "inspect open",
        "check small.toml",
        "check open",
    ] {
        let said = job.expect(0, words);
        assert!(said.contains(told), "{words}: {said}");
    }
    assert!(manifest("open").contains(told));
    let study = Study::load(&job.path("study.toml")).unwrap();
    let [warning] = &study.warnings()[..] else {
        panic!("{:?}", study.warnings());
    };
    assert!(warning.contains(told), "{warning}");
    // And without its roof: the contributions of two opposite holes do not cancel.
    job.edit("box.obj", "f 4 8 7 3\n", "");
    for words in [
        "inspect small.toml",
        "check small.toml",
        "bake small.toml -o tube",
    ] {
        let said = job.expect(2, words);
        for part in [
            "small.toml:16: solid[0].mesh",
            "its holes face one another through it, as in a tube; 2 holes with 8 open edges: \
             4 open edges about (0.5000, 0.5000, 0.7000), 0.5657 m across, \
             4 open edges about (0.5000, 1.0000, 0.7000), 0.5657 m across",
        ] {
            assert!(said.contains(part), "{words}: {said}");
        }
    }
}
