//! `swell export` of a whitewater stream: fog, kinds, and points beside the water.

use std::{collections::BTreeMap, f64::consts::PI, fs, io::Cursor};

use glam::DVec3;
use swell::domain::{
    fog::FogRaster,
    particles::Particles,
    vdb,
    whitewater::{WhitewaterKind, of_kinds},
};

use crate::support::{
    job::Job,
    made_cache::{Made, write_cache, write_stream},
    vdb::vdb_print,
    whitewater::white,
};

/// Spray, foam and bubbles in flight through the made cache's domain.
fn mixed(frame: u32) -> Particles {
    let all: Vec<_> = (0..900)
        .map(|k| {
            let part = |n: f64| (f64::from(k + frame) * n).fract();
            let place = DVec3::new(
                2.0 * part(0.618) - 1.0,
                0.5 + 2.0 * part(0.414),
                0.25 + part(0.732),
            );
            let velocity = DVec3::new(4.0 * part(0.236), -3.0 * part(0.303), part(0.123));
            (place, velocity, WhitewaterKind::ALL[k as usize % 3])
        })
        .collect();
    let mut made = white(&all);
    let radii =
        (0..900).map(|k| 0.002 + 0.006 * (k as f32 * 0.55).fract() + 0.001 * (k % 3) as f32);
    made.attributes.insert("radius".to_owned(), radii.collect());
    made
}

/// Volume of the balls of these kinds, and their momentum per density, m³ and m⁴/s.
fn held(white: &Particles, kinds: &[WhitewaterKind]) -> (f64, DVec3) {
    let chosen = (0..white.len()).filter(|&k| {
        kinds
            .iter()
            .any(|kind| kind.number() == white.attributes["kind"][k])
    });
    chosen.fold((0.0, DVec3::ZERO), |(volume, momentum), k| {
        let own = 4.0 / 3.0 * PI * f64::from(white.attributes["radius"][k]).powi(3);
        let velocity = DVec3::from(white.velocity[k].map(f64::from));
        (volume + own, momentum + own * velocity)
    })
}

/// Velocities of fog in the made cache's domain.
fn velocities(white: &Particles, voxel_size: f64) -> BTreeMap<[i32; 3], [f32; 3]> {
    let raster = FogRaster {
        origin: DVec3::new(-1.0, 0.5, 0.25),
        voxel_size,
        frame_seconds: 1.0 / 60.0,
    };
    let leaves = raster.fog(white).velocity.leaves;
    let active = leaves.iter().flat_map(|leaf| {
        let active = (0..512).filter(|&element| leaf.is_active(element));
        active.map(|element| (leaf.voxel(element), leaf.values[element]))
    });
    active.collect()
}

/// Voxels of the density by vdb-rs.
fn densities(bytes: &[u8]) -> BTreeMap<[i32; 3], f32> {
    let mut reader = vdb_rs::VdbReader::new(Cursor::new(bytes)).unwrap();
    let found = reader.read_grid::<f32>("density").unwrap();
    found
        .iter()
        .map(|(at, value, _)| (at.to_array().map(|x| x as i32), value))
        .collect()
}

#[test]
fn fog_holds_the_volume_and_the_momentum_of_its_particles() {
    let job = Job::of(&[]);
    write_cache(&job.path("half"), &Made::default());
    // As precise as the grids that the bake kept, which are of 32 bits.
    write_cache(&job.path("float"), &Made::watched());
    for cache in ["half", "float"] {
        write_stream(&job.path(cache), "default", &mixed);
    }
    let export = |cache: &str, out: &str, more: &str| {
        let words = format!("export {cache} --stream default --fog {out}.%04d.vdb --frames 2");
        job.expect(0, &format!("{words} {more}"));
        fs::read(job.path(&format!("{out}.0002.vdb"))).unwrap()
    };
    let white = mixed(2);
    let all = [
        ("", &[WhitewaterKind::Spray][..], 0.1),
        ("--kinds foam,bubble", &WhitewaterKind::ALL[1..], 0.1),
        (
            "--kinds bubbles,spray,foam --fog-voxel 0.03",
            &WhitewaterKind::ALL,
            0.03,
        ),
    ];
    for (index, (more, kinds, voxel)) in all.into_iter().enumerate() {
        let (volume, momentum) = held(&white, kinds);
        let float = export("float", &format!("float{index}"), more);
        let density = densities(&float);
        // vdb-rs reads no vectors: OpenVDB tells their number and extremes below.
        let velocity = velocities(&of_kinds(white.clone(), kinds), voxel);
        let own = |density: &f32| f64::from(*density) * f64::powi(voxel, 3);
        let sum: f64 = density.values().map(own).sum();
        // Each voxel rounds to f32.
        assert!(
            (sum / volume - 1.0).abs() < 2f64.powi(-23),
            "{more}: {sum} {volume}"
        );
        let moving = density
            .iter()
            .map(|(at, density)| own(density) * DVec3::from(velocity[at].map(f64::from)));
        let off = moving.sum::<DVec3>() - momentum;
        assert!(
            off.length() < 5.0 * 2f64.powi(-22) * volume,
            "{more}: {off}"
        );
        assert!(velocity.len() > density.len(), "{more}");
        // Half precision rounds by 2⁻¹¹, and below 2⁻¹⁴ by 2⁻²⁵.
        let half = export("half", &format!("half{index}"), more);
        let rounded = densities(&half);
        assert!(rounded.keys().eq(density.keys()));
        let error: f64 = density
            .values()
            .map(|it| own(&it.mul_add(2f32.powi(-11), 2f32.powi(-25))))
            .sum();
        let sum_of_half: f64 = rounded.values().map(own).sum();
        assert!(
            (sum_of_half - sum).abs() < error && sum_of_half != sum,
            "{more}"
        );
        // Negative control: the particles of other kinds.
        let other = held(&white, &[WhitewaterKind::Foam]).0;
        assert!((sum / other - 1.0).abs() > 1e-3, "{more}");

        for (bytes, is_half) in [(&float, "false"), (&half, "true")] {
            let found = vdb_print(bytes).unwrap();
            let names: Vec<_> = found.keys().map(String::as_str).collect();
            assert_eq!(names, ["density", "vel"]);
            let printed = |grid: &str, key: &str| found[grid][key].clone();
            assert_eq!(printed("density", "class"), "fog volume");
            assert_eq!(printed("density", "Type"), "Tree_float_5_4_3");
            assert_eq!(printed("vel", "Type"), "Tree_vec3s_5_4_3");
            assert_eq!(printed("vel", "vector_type"), "contravariant relative");
            assert_eq!(printed("density", "is_saved_as_half_float"), is_half);
            assert_eq!(
                printed("density", "file_voxel_count"),
                density.len().to_string()
            );
            assert_eq!(
                printed("vel", "file_voxel_count"),
                velocity.len().to_string()
            );
            assert_eq!(printed("density", "voxel size"), voxel.to_string());
            let most = density.values().copied().fold(0.0, f32::max);
            let number = printed("density", "Max value").parse::<f32>().unwrap();
            assert!((number / most - 1.0).abs() < 1e-3, "{number} {most}");
            // Vectors are ordered by their first components; half precision rounds 4 m/s by 2⁻⁹.
            let order = |a: &&[f32; 3], b: &&[f32; 3]| a.partial_cmp(b).unwrap();
            for (key, exact) in [
                ("Min value", velocity.values().min_by(order)),
                ("Max value", velocity.values().max_by(order)),
            ] {
                let vector = printed("vel", key);
                let vector = vector.trim_matches(['[', ']']).split(", ");
                for (printed, exact) in vector.zip(exact.unwrap()) {
                    let off = printed.parse::<f32>().unwrap() - exact;
                    assert!(off.abs() < 2f32.powi(-9), "{key}: {off}");
                }
            }
            let ours = vdb::grids(bytes).unwrap();
            let classes = ours.iter().map(|grid| grid.class.as_str());
            assert_eq!(classes.collect::<Vec<_>>(), ["fog volume", "unknown"]);
            assert_eq!(ours[0].voxels, Some(density.len() as u64));
        }
    }
    // The level set's reader refuses a fog, and names what there is.
    let refused = vdb::level_set(&export("half", "last", "")).unwrap_err();
    assert!(refused.contains("density, vel"), "{refused}");
    // Other kinds are another file.
    let other = "export half --stream default --fog last.%04d.vdb --frames 2 --kinds foam";
    job.expect_clear(4, other, "exported in another way");
}

/// A frame without spray: a file whose grids have no voxels, which OpenVDB reads.
#[test]
fn a_frame_without_fog_is_a_file() {
    let job = Job::of(&[]);
    write_cache(&job.path("cache"), &Made::default());
    let is_calm = |frame| of_kinds(mixed(frame), &WhitewaterKind::ALL[1..]);
    write_stream(&job.path("cache"), "default", &is_calm);
    job.expect(
        0,
        "export cache --stream default --fog f.%04d.vdb --frames 3",
    );
    let bytes = fs::read(job.path("f.0003.vdb")).unwrap();
    let found = vdb_print(&bytes).unwrap();
    for grid in ["density", "vel"] {
        assert_eq!(found[grid]["file_voxel_count"], "0");
    }
    // Negative control: the same frame has foam.
    job.expect(
        0,
        "export cache --stream default --fog g.%04d.vdb --frames 3 --kinds foam",
    );
    let found = vdb_print(&fs::read(job.path("g.0003.vdb")).unwrap()).unwrap();
    assert_ne!(found["density"]["file_voxel_count"], "0");
}

/// The kinds of a stream apply to its tables and points too.
#[test]
fn tables_have_the_kinds_that_were_asked_for() {
    let job = Job::of(&[]);
    write_cache(&job.path("cache"), &Made::default());
    write_stream(&job.path("cache"), "default", &mixed);
    let rows = |out: &str, more: &str| {
        let words = format!("export cache --stream default --csv {out}.%04d.csv --frames 2 {more}");
        job.expect(0, &words);
        let text = fs::read_to_string(job.path(&format!("{out}.0002.csv"))).unwrap();
        text.lines().skip(1).map(str::to_owned).collect::<Vec<_>>()
    };
    let all = rows("all", "");
    let some = rows("some", "--kinds spray,bubble");
    let kept: Vec<_> = (all.iter().enumerate())
        .filter(|(k, _)| k % 3 != 1)
        .map(|(_, row)| row.clone())
        .collect();
    assert_eq!((all.len(), some.len()), (900, 600));
    assert_eq!(some, kept);
}

#[test]
fn a_shot_has_whitewater_beside_its_water() {
    let job = Job::of(&[]);
    write_cache(&job.path("cache"), &Made::default());
    write_stream(&job.path("cache"), "default", &mixed);
    let words = "export cache --frames 1-2";
    job.expect(
        0,
        &format!("{words} --usd s.usda --usd-whitewater --kinds spray,foam"),
    );
    job.expect(0, &format!("{words} --usd plain.usda"));
    job.expect(
        0,
        &format!("{words} --stream default --usd alone.usda --kinds spray,foam"),
    );
    // The prim of a layer, its name left out.
    let prim = |file: &str, name: &str| {
        let text = fs::read_to_string(job.path(file)).unwrap();
        let (_, behind) = text.split_once(&format!("def Points \"{name}\"")).unwrap();
        let (body, _) = behind.split_once("\n    }\n").unwrap();
        body.to_owned()
    };
    for frame in ["0001", "0002"] {
        let [both, plain, alone] = ["s", "plain", "alone"].map(|of| format!("{of}.{frame}.usda"));
        assert_eq!(prim(&both, "water"), prim(&plain, "water"));
        assert_eq!(prim(&both, "whitewater"), prim(&alone, "default"));
        let text = fs::read_to_string(job.path(&plain)).unwrap();
        assert!(!text.contains("whitewater"));
    }
    // Negative control: another frame has other points.
    assert_ne!(
        prim("s.0002.usda", "whitewater"),
        prim("s.0001.usda", "whitewater")
    );
    let manifest = fs::read_to_string(job.path("s.manifest.usda")).unwrap();
    assert_eq!(
        manifest.matches("point3f[] points\n").count(),
        2,
        "{manifest}"
    );
    let root = fs::read_to_string(job.path("s.usda")).unwrap();
    assert!(root.contains("def Points \"whitewater\""), "{root}");
    // Beside a mesh with foam as well; the records tell them apart.
    job.expect(
        0,
        &format!("{words} --usd m.usda --usd-water mesh --foam --usd-whitewater default"),
    );
    let layer = fs::read_to_string(job.path("m.0001.usda")).unwrap();
    for part in [
        "def Mesh \"water\"",
        "def Points \"whitewater\"",
        "primvars:foam_age",
    ] {
        assert!(layer.contains(part), "{part}");
    }
    let clear = |code, more: &str, part: &str| {
        job.expect_clear(code, &format!("{words} {more}"), part);
    };
    clear(
        4,
        "--usd s.usda --usd-whitewater",
        "exported in another way",
    );
    clear(
        4,
        "--usd t.usda --usd-whitewater gone",
        "cache/whitewater/gone does not exist",
    );
    clear(2, "--npy p.%04d.npy --usd-whitewater", "--usd");
    clear(
        2,
        "--usd t.usda --usd-whitewater --stream default",
        "--stream",
    );
    assert!(!job.path("t.usda").exists() && !job.path("p.0001.npy").exists());
}
