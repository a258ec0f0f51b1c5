mod written;

use std::{fs, path::PathBuf};

use glam::DVec3;

use super::super::{physics_difference, physics_hash};
use super::*;
use crate::scene_to_toml;
use crate::{load_scene, parse_scene, recorded_scene};
use swell_domain::{motion::Motion, sampling, signed_distance::SignedDistance};
use swell_scene::{
    Iteration, Method, PlacedMesh, Solver, Stop, asset_path,
    flip::{Preconditioner, Surface, Transfer},
};

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
    f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";

const FULL: &str = r#"
[shot]
name = "full"
frames = 60
frames_per_second = 30
[domain]
min = [0, 0, 0]
max = [10, 5, 4]
[water]
rest_density = 1025.0
gravity = [0.0, -9.81, 0.0]
[[water.block]]
min = [0, 0, 0]
max = [4, 1, 4]
[[water.mesh]]
file = "cube.obj"
translate = [1.0, 2.0, 1.0]
[[water.particles]]
at = [[5.0, 3.0, 2.0], [5.0, 3.0, 2.0]]
velocity = [1.0, 0.0, -2.0]
[[solid]]
mesh = "cube.obj"
translate = [8.0, 0.0, 2.0]
rotate_degrees = [0.0, 30.0, 0.0]
scale = [1.0, 2.0, 0.5]
[[wave_maker]]
wall = "-x"
motion = { kind = "solitary", height = 0.2, depth = 1.0 }
[[wave_maker]]
wall = "+z"
motion = { kind = "table", file = "push.csv" }
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
iteration = "jacobi"
density_error = 0.01
max_iterations = 40
relaxation = 0.5
[solver.flip]
cell_size = 0.25
transfer = "apic"
pressure = { preconditioner = "ipp", tolerance = 0.05 }
[effects]
vorticity_confinement = { strength = 0.1 }
"#;

fn assets() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    fs::write(dir.path().join("cube.obj"), CUBE).expect("written");
    fs::write(dir.path().join("push.csv"), "time,x\n# rest\n0,0\n1,0.5\n").expect("written");
    dir
}

fn parse(dir: &Path, text: &str, overrides: &[&str]) -> Result<Scene, String> {
    let overrides: Vec<_> = overrides.iter().map(|&s| s.to_owned()).collect();
    parse_scene(text, Path::new("s.toml"), dir, &overrides).map_err(|e| e.to_string())
}

#[test]
fn everything_that_is_written_is_meant() {
    let dir = assets();
    let scene = parse(dir.path(), FULL, &[]).expect("valid");
    assert_eq!(scene.shot.duration(), 2.0);
    assert_eq!(scene.domain.max, DVec3::new(10.0, 5.0, 4.0));
    assert_eq!(scene.water.rest_density, 1025.0);
    assert_eq!(
        scene.water.meshes[0].mesh.bounds().expect("a cube").min,
        DVec3::new(1.0, 2.0, 1.0)
    );
    let solid = &scene.solids[0];
    assert!((solid.mesh.signed_volume() - 1.0).abs() < 1e-12);
    assert_eq!(
        solid.file_hash,
        blake3::hash(CUBE.as_bytes()).to_hex().to_string()
    );
    // A cache's copy of the file has the same name.
    let copy = PlacedMesh {
        file: asset_path(&solid.file, &solid.file_hash).into(),
        ..solid.clone()
    };
    assert_ne!(copy.file.file_stem(), solid.file.file_stem());
    assert_eq!([copy.name(), solid.name()], ["cube", "cube"]);
    // The corner (1, 0, 0) scaled, then rotated by 30° about y, then translated.
    let corner = solid.placement.world_from_file().transform_point3(DVec3::X);
    let expected = DVec3::new(8.0 + 30f64.to_radians().cos(), 0.0, 2.0 - 0.5);
    assert!((corner - expected).length() < 1e-12);
    assert_eq!(scene.wave_makers[0].wall.name(), "-x");
    assert_eq!(
        scene.wave_makers[1].motion,
        Motion::Table {
            points: vec![[0.0, 0.0], [1.0, 0.5]]
        }
    );
    let pbf = scene.solver.pbf().expect("PBF");
    assert_eq!(pbf.iteration, Iteration::Jacobi);
    assert_eq!(
        pbf.stop,
        Stop::DensityError {
            density_error: 0.01,
            max_iterations: 40
        }
    );
    assert_eq!(
        (pbf.support_ratio, pbf.cfl, pbf.relaxation, pbf.max_substeps),
        (2.0, 1.0, 0.5, 32)
    );
    let unchosen = scene.unchosen.as_ref().and_then(Solver::flip);
    let flip = unchosen.expect("a table");
    assert_eq!(flip.transfer, Transfer::Apic);
    assert_eq!(flip.pressure.preconditioner, Preconditioner::Ipp);
    assert_eq!((flip.cell_size, flip.particle_spacing()), (0.25, 0.125));
    // Defaults.
    assert_eq!((flip.particles_per_cell, flip.pic_blend), (8, 0.05));
    assert_eq!((flip.cfl, flip.max_substeps), (3.0, 32));
    assert_eq!(flip.surface, Surface::GhostFluid);
    assert!(flip.density_correction);
    assert_eq!(flip.pressure.max_iterations, 400);
    assert_eq!(scene.budget.residual, Some(0.05), "never below tolerance");
    assert_eq!(scene.budget.volume, None, "not measured unless asked for");
    assert_eq!(scene.budget.energy, Some(0.25));
    let set = ["budget.energy=false", "budget.volume=0.02"];
    let other = parse(dir.path(), FULL, &set).expect("valid").budget;
    assert_eq!((other.energy, other.volume), (None, Some(0.02)));
    assert_eq!(scene.effects.viscosity, None);
    assert_eq!(
        scene.effects.vorticity_confinement.map(|v| v.strength),
        Some(0.1)
    );
}

/// The numbers of the README, one by one.
#[test]
fn what_a_scene_leaves_out_is_what_its_page_says() {
    let text = "[shot]\nname = \"a\"\nframes = 10\nframes_per_second = 50\n\
        [domain]\nmin = [0, 0, 0]\nmax = [4, 3, 12]\n[solver]\nmethod = \"pbf\"\n\
        [solver.pbf]\nparticle_spacing = 0.1\n[solver.flip]\ncell_size = 0.2\n\
        [grids]\nsurface = true\n[[wave_maker]]\nwall = \"-x\"\n\
        motion = { kind = \"sine\", stroke = 0.5, period = 2.0 }\n";
    let load = |set: &[&str]| parse(Path::new(""), text, set).expect("valid");
    let scene = load(&[]);
    assert_eq!(scene.water.rest_density, 1000.0);
    assert_eq!(scene.water.gravity, DVec3::new(0.0, -9.81, 0.0));
    let pbf = scene.solver.pbf().expect("PBF");
    assert_eq!(pbf.stop, Stop::Iterations(4));
    assert!(pbf.grid_projection);
    assert_eq!(pbf.iteration, Iteration::RedBlack);
    let numbers = [
        pbf.support_ratio,
        pbf.cfl,
        pbf.relaxation,
        pbf.artificial_pressure,
    ];
    assert_eq!((numbers, pbf.max_substeps), ([2.0, 1.0, 1.0, 0.0], 32));
    let unchosen = scene.unchosen.as_ref().and_then(Solver::flip);
    let flip = unchosen.expect("a table");
    let pressure = &flip.pressure;
    assert_eq!(
        (flip.cfl, flip.pic_blend, pressure.tolerance),
        (3.0, 0.05, 1e-5)
    );
    assert_eq!((flip.max_substeps, pressure.max_iterations), (32, 400));
    assert_eq!(pressure.preconditioner, Preconditioner::Multigrid);
    let voxels = |scene: &Scene| scene.grids.as_ref().map(|grids| grids.voxel_size);
    assert_eq!(voxels(&scene), Some(0.2), "two particle spacings");
    // The default ramp is one period.
    let sine = Motion::Sine {
        stroke: 0.5,
        period: 2.0,
        ramp: 2.0,
    };
    assert_eq!(scene.wave_makers[0].motion, sine);
    let chebyshev = load(&["solver.pbf.iteration=chebyshev"]);
    let pbf = chebyshev.solver.pbf().expect("PBF");
    assert_eq!((pbf.relaxation, pbf.spectral_radius), (0.7, 0.98));
    // The diagonal of 4 × 3 × 12 m is 13 m. The wall moves at up to π stroke / period; within the
    // shot, 0.2 s of the ramp, its bound is lower.
    let speed = scene.budget.speed.expect("a limit");
    let fall = (2.0 * 9.81 * 13.0_f64).sqrt();
    let push = scene.wave_makers[0].motion.peak_speed(0.0, 0.2);
    assert!(
        (speed / (4.0 * (fall + push)) - 1.0).abs() < 1e-14,
        "{speed}"
    );
    assert!(push < 0.25 * std::f64::consts::PI);
    let limits = |scene: &Scene| {
        let b = &scene.budget;
        let of_reports = [b.density_error_mean, b.density_error_p99, b.capped];
        (of_reports, [b.residual, b.divergence, b.energy, b.volume])
    };
    let of_reports = [0.5, 5.0, 0.01].map(Some);
    let of_pbf = [Some(0.01), Some(0.1), Some(0.25), None];
    assert_eq!(limits(&scene), (of_reports, of_pbf));
    let flip = load(&["solver.method=flip"]);
    assert_eq!(limits(&flip).1[2], Some(0.1));
    assert_eq!(voxels(&flip), Some(0.2), "its cells");
    assert_eq!(flip.budget.speed, scene.budget.speed);
}

#[test]
fn either_solver_of_a_scene_can_be_chosen() {
    let dir = assets();
    let scene = parse(dir.path(), FULL, &[]).expect("valid");
    assert_eq!(scene.particle_spacing(), 0.1);
    let flip = parse(dir.path(), FULL, &["solver.method=flip"]).expect("valid");
    assert_eq!(flip.particle_spacing(), 0.125);
    assert_eq!(flip.unchosen.as_ref(), Some(&scene.solver));
    assert_eq!(scene.unchosen.as_ref(), Some(&flip.solver));
    assert_ne!(physics_hash(&scene), physics_hash(&flip));
    // The other solver is not checked against the scene.
    let coarse = "solver.flip.cell_size=2.0";
    parse(dir.path(), FULL, &[coarse]).expect("valid with PBF");
    parse(dir.path(), FULL, &[coarse, "solver.method=flip"]).expect_err("two cells across");
}

#[test]
fn overrides_reach_everywhere_and_take_bare_words() {
    let dir = assets();
    let overrides = [
        "solver.pbf.iteration=red_black",
        "solver.pbf.particle_spacing = 0.2",
        "water.block[0].max=[2, 1, 4]",
        "water.block.0.min=[0.5, 0, 0]",
        "effects.viscosity.xsph=0.02",
        "shot.name=other-name",
    ];
    let scene = parse(dir.path(), FULL, &overrides).expect("valid");
    assert_eq!(
        scene.solver.pbf().expect("PBF").iteration,
        Iteration::RedBlack
    );
    assert_eq!(scene.solver.pbf().expect("PBF").particle_spacing, 0.2);
    assert_eq!(scene.water.blocks[0].max.x, 2.0);
    assert_eq!(scene.water.blocks[0].min.x, 0.5);
    assert_eq!(scene.effects.viscosity.and_then(|v| v.xsph), Some(0.02));
    assert_eq!(scene.shot.name, "other-name");

    for (bad, expected) in [
        ("frames", "no \"=\""),
        ("=3", "not a dotted key"),
        ("shot..frames=3", "not a dotted key"),
        ("shot.frames=", "neither a TOML value"),
        ("shot.frames={", "neither a TOML value"),
        (
            "shot.frames.x=3",
            "cannot be set within a value of type integer",
        ),
        (
            "water.block[7].max=[1,1,1]",
            "not an index into an array of 1",
        ),
        (
            "shot.frames=0",
            "with shot.frames=0: shot.frames: 0 is out of range; allowed: a whole number",
        ),
        (
            "solver.pbf.iteratons=3",
            "solver.pbf.iteratons: unknown key in [solver.pbf]; the nearest is \"iterations\"",
        ),
        (
            "shot.fps=24",
            "shot.fps: unknown key in [shot]; the nearest is \"frames_per_second\"",
        ),
        (
            "water.block=[{min=[0,0,0],max=[99,1,1]}]",
            "water.block[0].max: the water does not fit",
        ),
    ] {
        let message = parse(dir.path(), FULL, &[bad]).expect_err(bad);
        assert!(message.contains(expected), "{message} lacks {expected}");
        assert!(message.contains(bad), "{message}");
    }
}

#[test]
fn the_scene_of_a_cache_that_is_older_than_a_key_is_read_as_it_was_baked() {
    let dir = assets();
    let file = Path::new("scene.toml");
    let now = parse(dir.path(), FULL, &[]).expect("valid");
    let written = scene_to_toml(&now, &|_, _| "cube.obj".to_owned());
    let older = written.replace("grid_projection = true\n", "");
    assert_ne!(older, written);
    let recorded = recorded_scene(&older, file, dir.path()).expect("valid");
    assert!(!recorded.solver.pbf().expect("PBF").grid_projection);
    let difference = physics_difference(&older, &written).expect("TOML");
    assert_eq!(
        difference.as_deref(),
        Some("solver.pbf.grid_projection was false, is now true")
    );
    // Controls: a cache that has the key, and a new scene that leaves it out.
    assert_eq!(
        recorded_scene(&written, file, dir.path()).expect("valid"),
        now
    );
    let today = parse_scene(&older, file, dir.path(), &[]).expect("valid");
    assert!(today.solver.pbf().expect("PBF").grid_projection);
    // A key in a table of an array.
    let sea = "{kind=\"sea\",significant_height=0.1,peak_period=3.0,shortest_period=2.0,depth=1.0}";
    let sea = format!("wave_maker=[{{wall=\"-x\",motion={sea}}}]");
    let scene = parse(dir.path(), FULL, &[&sea]).expect("valid");
    let written = scene_to_toml(&scene, &|_, _| "cube.obj".to_owned());
    let older = written.replace(", second_order = false", "");
    assert_ne!(older, written);
    assert_eq!(physics_difference(&older, &written).expect("TOML"), None);
    let corrected = written.replace("second_order = false", "second_order = true");
    assert_eq!(
        physics_difference(&older, &corrected)
            .expect("TOML")
            .as_deref(),
        Some("wave_maker[0].motion.second_order was false, is now true")
    );
}

#[test]
fn physics_is_compared_by_key() {
    let dir = assets();
    let written = |overrides: &[&str], path: &str| {
        let scene = parse(dir.path(), FULL, overrides).expect("valid");
        (
            scene_to_toml(&scene, &|_, _| path.to_owned()),
            physics_hash(&scene),
        )
    };
    let (base, base_hash) = written(&[], "assets/a.obj");
    // The last two are a setting of the solver that is not chosen, and the limit on substeps.
    let same: [&[&str]; 5] = [
        &[],
        &["shot.frames=7"],
        &["shot.name=b"],
        &["solver.flip.cell_size=0.3"],
        &["solver.pbf.max_substeps=9"],
    ];
    for overrides in same {
        let (other, hash) = written(overrides, "b.obj");
        assert_eq!(physics_difference(&base, &other).expect("TOML"), None);
        assert_eq!(hash, base_hash);
    }
    for (set, expected) in [
        (
            "solver.pbf.particle_spacing=0.125",
            "solver.pbf.particle_spacing was 0.1, is now 0.125",
        ),
        (
            "solver.method=flip",
            "solver.method was \"pbf\", is now \"flip\"",
        ),
        (
            "effects.viscosity.xsph=0.5",
            "effects.viscosity.xsph was absent, is now 0.5",
        ),
        (
            "shot.frames_per_second=24",
            "shot.frames_per_second was 30.0, is now 24.0",
        ),
        (
            "solid[0].scale=1.0",
            "solid[0].scale[1] was 2.0, is now 1.0",
        ),
    ] {
        let (other, hash) = written(&[set], "a.obj");
        assert_eq!(
            physics_difference(&base, &other).expect("TOML").as_deref(),
            Some(expected)
        );
        assert_ne!(hash, base_hash);
    }
    let (flip, flip_hash) = written(&["solver.method=flip"], "a.obj");
    let limit = "budget.residual=0.5";
    for (set, expected) in [
        ("budget.speed=false", None),
        ("budget.volume=0.1", None),
        ("solver.pbf.iteration=red_black", None),
        (limit, None),
        (
            "solver.flip.pressure.tolerance=0.01",
            Some("solver.flip.pressure.tolerance was 0.05, is now 0.01"),
        ),
    ] {
        let (other, hash) = written(&["solver.method=flip", set, limit], "a.obj");
        let difference = physics_difference(&flip, &other).expect("TOML");
        assert_eq!(difference.as_deref(), expected);
        assert_eq!(hash == flip_hash, expected.is_none());
    }
    fs::write(dir.path().join("cube.obj"), format!("{CUBE}# another\n")).expect("written");
    let (other, hash) = written(&[], "assets/a.obj");
    let difference = physics_difference(&base, &other)
        .expect("TOML")
        .expect("another file");
    assert!(
        difference.starts_with("solid[0].blake3 was"),
        "{difference}"
    );
    assert_ne!(hash, base_hash);
    assert!(matches!(
        physics_difference("[", &base),
        Err(SceneError::NotToml { .. })
    ));
}

#[test]
fn the_scenes_that_ship_fit_together() {
    let scenes = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    for (name, in_blocks, has_solid) in [
        ("quickstart", 41_712, true),
        ("wave-city", 201_000, true),
        ("dam-break", 81_920, false),
        ("wave-tank", 200 * 10 * 30, true),
    ] {
        let scene = load_scene(&scenes.join(name).with_extension("toml"), &[]).expect(name);
        assert_eq!(scene.shot.name, name);
        let d = scene.particle_spacing();
        // FLIP starts from the same particles.
        let flip = [Method::Flip.as_override()];
        let flip = load_scene(&scenes.join(name).with_extension("toml"), &flip).expect(name);
        assert_eq!(flip.particle_spacing(), d, "{name}");
        let solids = scene.solids.iter().map(|s| &s.mesh);
        let solid = SignedDistance::from_meshes(solids, &scene.domain, 2.0 * d).expect(name);
        assert_eq!(solid.is_some(), has_solid);
        let blocks = &scene.water.blocks;
        let fill = sampling::fill_water(blocks, [], solid.as_ref(), &scene.domain, d);
        let fill = fill.expect("no water meshes");
        assert_eq!(fill.particles.len() + fill.removed, in_blocks, "{name}");
        // Only the beach displaces water: (4 m × 1 m / 2 + 4 m × 1 m) × 3 m.
        let displaced = fill.removed as f64 * d.powi(3);
        let expected = if name == "wave-tank" { 18.0 } else { 0.0 };
        assert!(
            (displaced - expected).abs() <= 0.01 * expected,
            "{name} {displaced}"
        );
        for solid in &scene.solids {
            let samples = sampling::boundary_samples(&solid.mesh, &scene.domain, d);
            assert!(samples.len() > 1000, "{name}");
        }
    }
}
