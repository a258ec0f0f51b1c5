//! `swell export --foam`: foam on the water's mesh; and what exports of whitewater refuse.

use std::{collections::BTreeMap, f64::consts::PI, fs, ops::Range};

use glam::DVec3;
use swell::domain::{
    particles::Particles,
    whitewater::{SUPPORT, WhitewaterKind},
};

use crate::support::{
    job::Job,
    made_cache::{Made, write_cache, write_stream},
    whitewater::white,
};

/// Spacing of the made cache, and distance between foam particles, metres.
const SPACING: f64 = 0.1;
const STEP: f64 = 0.05;
/// Radius of the particles that [`white`] makes, metres.
const RADIUS: f64 = 0.01;

/// Foam on the surface of the made cache's block, as far as z = 0.75, whose ages are `ages` in turn
/// like the squares of a chessboard; layer over layer as often as `layers` says.
fn foam(layers: usize, ages: [f32; 2]) -> Particles {
    let lattice = || (0..16).flat_map(|i| (0..10).map(move |k| (i, k)));
    let place = |(i, k): (i32, i32)| {
        let [x, z] = [i, k].map(|cell| STEP * (f64::from(cell) + 0.5));
        DVec3::new(x - 1.0, 1.5, z + 0.25)
    };
    let all: Vec<_> = (0..layers)
        .flat_map(|_| lattice())
        .map(|at| (place(at), DVec3::ZERO, WhitewaterKind::Foam))
        .collect();
    let mut made = white(&all);
    let squares = (0..layers)
        .flat_map(|_| lattice())
        .map(|(i, k)| ((i + k) % 2) as usize);
    made.attributes
        .insert("age".to_owned(), squares.map(|of| ages[of]).collect());
    made
}

/// A folder with a made cache and its streams: foam, twice as much, and older foam.
fn made() -> Job {
    let job = Job::of(&[]);
    let cache = job.path("cache");
    write_cache(&cache, &Made::default());
    write_stream(&cache, "default", &|_| foam(1, [1.0, 2.0]));
    write_stream(&cache, "twice", &|_| foam(2, [1.0, 2.0]));
    write_stream(&cache, "older", &|_| foam(1, [1.25, 2.25]));
    job
}

/// The columns of a binary PLY's vertices, all of 32 bits, by name.
fn columns(bytes: &[u8]) -> BTreeMap<String, Vec<f32>> {
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = String::from_utf8_lossy(&bytes[..start]).into_owned();
    let mut lines = header
        .lines()
        .skip_while(|line| !line.starts_with("element vertex"));
    let count: usize = lines
        .next()
        .unwrap()
        .rsplit(' ')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    let names: Vec<_> = lines
        .map_while(|line| line.strip_prefix("property float "))
        .collect();
    let value = |row: usize, column: usize| {
        let at = start + 4 * (row * names.len() + column);
        f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    };
    (names.iter().enumerate())
        .map(|(c, name)| {
            (
                (*name).to_owned(),
                (0..count).map(|row| value(row, c)).collect(),
            )
        })
        .collect()
}

/// The values of an array that a layer of USD has at its frame.
fn primvar(layer: &str, name: &str) -> Vec<f32> {
    let label = format!("float[] primvars:{name}.timeSamples");
    let (_, behind) = layer.split_once(&label).unwrap();
    let (_, list) = behind.split_once('[').unwrap();
    let (list, _) = list.split_once(']').unwrap();
    list.split(',').map(|x| x.trim().parse().unwrap()).collect()
}

/// Bound on the relative error of a kernel's sum over the lattice, by Poisson's summation as in the
/// tests of `level_set::foam`; at `shift` 1/2 of a sum with the signs of a chessboard.
fn lattice_error(shift: f64) -> f64 {
    let per_step = 2.0 * PI * SUPPORT * SPACING / STEP;
    let square = (-40..=40).flat_map(|i| (-40..=40).map(move |k| (i, k)));
    square
        .map(|(i, k): (i32, i32)| (f64::from(i) + shift).hypot(f64::from(k) + shift))
        .filter(|k| *k > 0.0)
        .map(|k| {
            let q = per_step * k;
            48.0 * (2.0 / (PI * (q * q - 9.0).sqrt())).sqrt() / q.powi(3)
        })
        .sum()
}

/// Vertices of the flat surface at these z, away from the edge where the block ends.
fn flat(columns: &BTreeMap<String, Vec<f32>>, z: Range<f32>) -> Vec<usize> {
    let is_flat = |k: &usize| columns["ny"][*k] > 0.999 && columns["y"][*k] > 1.4;
    let vertices = 0..columns["x"].len();
    vertices
        .filter(is_flat)
        .filter(|&k| columns["x"][k] < -0.45 && z.contains(&columns["z"][k]))
        .collect()
}

/// Compares foam on the flat surface with the closed form: discs of the first stream's number and
/// ages on one half, none on the other. Returns how many vertices have had their coverage and their
/// age compared, and how many have none.
fn check(columns: &BTreeMap<String, Vec<f32>>) -> Result<[usize; 3], String> {
    let wanted = PI * RADIUS.powi(2) / STEP.powi(2);
    // The lattice; a surface that is not level has 1 / 0.999 as many discs per area.
    let share_error = lattice_error(0.0) + 1e-3 + 1e-5;
    let age_error = 0.5 * lattice_error(0.5) / (1.0 - lattice_error(0.0));
    // Half of the foam ends at z = 0.75, and the kernel reaches 0.2 m.
    let (covered, bare) = (flat(columns, 0.25..0.55), flat(columns, 0.96..1.25));
    let mut ages = 0;
    for &k in &covered {
        let (coverage, age) = (columns["foam"][k], columns["foam_age"][k]);
        let share = -(-f64::from(coverage)).ln_1p();
        if (share / wanted - 1.0).abs() > share_error {
            return Err(format!("coverage {coverage}: {share} and not {wanted}"));
        }
        // A wall does not continue a chessboard.
        if columns["x"][k] > -0.79 && columns["z"][k] > 0.46 {
            ages += 1;
            if (f64::from(age) - 1.5).abs() > age_error {
                return Err(format!("age {age}"));
            }
        }
    }
    for &k in &bare {
        if [columns["foam"][k], columns["foam_age"][k]] != [0.0; 2] {
            return Err(format!("foam beyond its edge: {}", columns["foam"][k]));
        }
    }
    Ok([covered.len(), ages, bare.len()])
}

#[test]
fn foam_on_a_mesh_has_its_density_and_its_age() {
    let job = made();
    let export = |stream: &str| {
        let words =
            format!("export cache --mesh {stream}.%04d.ply --frames 1 --voxels 4 --foam {stream}");
        job.expect(0, &words);
        columns(&fs::read(job.path(&format!("{stream}.0001.ply"))).unwrap())
    };
    let found = export("default");
    let counts = check(&found).unwrap();
    assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
    assert!(lattice_error(0.0) < 4e-3 && lattice_error(0.5) < 2e-2);
    // Negative controls: twice as many discs, and the same ones a quarter of a second later.
    assert!(check(&export("twice")).unwrap_err().contains("coverage"));
    assert!(check(&export("older")).unwrap_err().contains("age 1.7"));

    // Without the option the other columns are the same, and there are no more.
    job.expect(
        0,
        "export cache --mesh plain.%04d.ply --frames 1 --voxels 4",
    );
    let plain = columns(&fs::read(job.path("plain.0001.ply")).unwrap());
    assert_eq!(plain.len() + 2, found.len());
    assert!(plain.iter().all(|(name, values)| *values == found[name]));

    // The name may be left out, a standing file is skipped, and one of another stream refused.
    let said = job.expect(
        0,
        "export cache --mesh default.%04d.ply --frames 1 --voxels 4 --foam",
    );
    assert!(said.contains("1 already existed"), "{said}");
    let other = "export cache --mesh default.%04d.ply --frames 1 --voxels 4 --foam twice";
    job.expect_clear(4, other, "exported in another way");
    // A stream that was made again is other foam.
    fs::remove_dir_all(job.path("cache/whitewater/default")).unwrap();
    write_stream(&job.path("cache"), "default", &|_| foam(2, [1.0, 2.0]));
    let again = "export cache --mesh default.%04d.ply --frames 1 --voxels 4 --foam";
    job.expect_clear(4, again, "of another");
}

#[test]
fn foam_is_a_primvar_of_meshes_in_usd() {
    let job = made();
    job.expect(
        0,
        "export cache --frames 1-2 --foam --mesh m.%04d.ply --usd s.usda --usd-water mesh",
    );
    job.expect(0, "export cache --frames 1 --foam --mesh m.%04d.usda");
    let wanted = columns(&fs::read(job.path("m.0001.ply")).unwrap());
    for file in ["m.0001.usda", "s.0001.usda"] {
        let layer = fs::read_to_string(job.path(file)).unwrap();
        for name in ["foam", "foam_age"] {
            assert_eq!(primvar(&layer, name), wanted[name], "{file} {name}");
            let declared = format!("float[] primvars:{name} (interpolation = \"vertex\")");
            assert!(layer.contains(&declared), "{file}: {declared}");
        }
    }
    // Negative control: another frame has other vertices.
    let layer = fs::read_to_string(job.path("s.0002.usda")).unwrap();
    assert_ne!(primvar(&layer, "foam"), wanted["foam"]);
    for file in ["s.usda", "s.manifest.usda"] {
        let text = fs::read_to_string(job.path(file)).unwrap();
        assert!(text.contains("float[] primvars:foam_age"), "{text}");
    }
    // Only what was asked for.
    job.expect(
        0,
        "export cache --frames 1 --usd plain.usda --usd-water mesh",
    );
    for file in ["plain.usda", "plain.manifest.usda", "plain.0001.usda"] {
        assert!(
            !fs::read_to_string(job.path(file))
                .unwrap()
                .contains("primvars")
        );
    }
}

#[test]
fn faults_of_whitewater_exports_are_one_line_with_exit_code() {
    let job = made();
    let clear = |code, words: &str, part: &str| job.expect_clear(code, words, part);
    clear(
        2,
        "export cache --mesh m.%04d.obj --foam",
        "OBJ has no place for values of vertices; write the mesh as .ply, .usda, .usd or .usdc \
         (--foam)",
    );
    clear(
        2,
        "export cache --npy p.%04d.npy --foam",
        "no mesh of the water",
    );
    clear(
        2,
        "export cache --usd s.usda --foam",
        "no mesh of the water",
    );
    clear(
        4,
        "export cache --mesh m.%04d.ply --foam storm",
        "cache/whitewater/storm does not exist",
    );
    for option in ["--stream", "--foam", "--usd-whitewater", "--wet"] {
        let words = format!("export cache --usd u.usda {option} ../whitewater/default");
        clear(2, &words, option);
    }
    clear(
        2,
        "export cache --fog f.%04d.vdb",
        "no stream is exported (--stream)",
    );
    clear(
        2,
        "export cache --npy p.%04d.npy --kinds foam",
        "no stream of it is exported",
    );
    let fog = "export cache --stream default --fog";
    clear(2, &format!("{fog} f.%04d.abc"), "fog is written as .vdb");
    clear(2, &format!("{fog} f.%04d.vdb --kinds smoke"), "smoke");
    for size in ["0.02", "0.9", "nan", "-1"] {
        let words = format!("{fog} f.%04d.vdb --fog-voxel={size}");
        clear(2, &words, "cache allows 0.025 to 0.8 m");
    }
    clear(2, "export cache --npy p.%04d.npy --fog-voxel 0.1", "--fog");
    // Frames that a stream does not have, and streams of other water.
    write_cache(
        &job.path("longer"),
        &Made {
            last: 6,
            ..Made::default()
        },
    );
    fs::rename(job.path("cache/whitewater"), job.path("longer/whitewater")).unwrap();
    clear(
        4,
        "export longer --mesh m.%04d.ply --foam",
        "frames 0 to 4, not 5",
    );
    let moved = Made {
        device: "another",
        ..Made::default()
    };
    write_cache(&job.path("other"), &moved);
    fs::rename(job.path("longer/whitewater"), job.path("other/whitewater")).unwrap();
    for words in [
        "--mesh m.%04d.ply --foam",
        "--fog f.%04d.vdb --stream default",
    ] {
        clear(
            4,
            &format!("export other {words}"),
            "water that no longer exists",
        );
    }
    // A folder among the streams that is none.
    write_cache(&job.path("other/whitewater/bake"), &Made::default());
    clear(
        4,
        "export other --mesh m.%04d.ply --foam bake",
        "no stream of whitewater",
    );
    let files = fs::read_dir(job.folder.path()).unwrap().map(Result::unwrap);
    assert!(
        files.into_iter().all(|entry| entry.path().is_dir()),
        "nothing was written"
    );
}
