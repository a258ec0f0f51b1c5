use std::path::Path;

use glam::DVec3;

use swell_domain::{
    absorber::{AbsorberStates, MOST},
    particles::Particles,
};
use swell_scene::{FlipScene, Method, PbfScene, Scene};

use crate::parse_scene;

/// Spacing 0.1 m, cells of 0.2 m, g = 10 m/s². With `WALL`, the wall -x moves at 3 m/s for one
/// second and +z slowly.
const SCENE: &str = r#"
[shot]
name = "a"
frames = 100
frames_per_second = 5
[domain]
min = [0, 0, 0]
max = [10, 4, 2]
[water]
gravity = [0, -10, 0]
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
max_substeps = 40
[solver.flip]
cell_size = 0.2
max_substeps = 5
[effects]
viscosity = { xsph = 0.2 }
"#;

const WALL: &str = r#"wave_maker=[{ wall = "-x", motion = { kind = "constant_velocity", velocity = 3.0, until = 1.0 } },
    { wall = "+z", motion = { kind = "constant_velocity", velocity = 0.1, until = 5.0 } }]"#;

fn scene(set: &[&str]) -> Scene {
    let set: Vec<String> = set.iter().map(|&text| text.to_owned()).collect();
    parse_scene(SCENE, Path::new("s.toml"), Path::new(""), &set).expect("valid")
}

/// No wall absorbs.
const AT_REST: AbsorberStates = [None; MOST];

fn pbf(set: &[&str]) -> PbfScene<'static> {
    let scene = scene(set);
    scene.with_pbf().expect("a scene of PBF").to_owned_scene()
}

fn flip(set: &[&str]) -> FlipScene<'static> {
    let method = Method::Flip.as_override();
    let scene = scene(&[set, &[&*method]].concat());
    scene.with_flip().expect("a scene of FLIP").to_owned_scene()
}

#[test]
fn pbf_takes_as_many_substeps_as_the_way_has_cfl_lengths() {
    // In a frame of 0.2 s gravity adds 2 m/s. The displacement is (v + 2 m/s) 0.2 s; a substep
    // allows cfl × 0.1 m.
    for (cfl, speed, substeps) in [
        // 0.4 m over 0.02006 m is 19.94, over 0.01994 m 20.06.
        (0.2006, 0.0, 20),
        (0.1994, 0.0, 21),
        // 1.4 m over 0.05015 m is 27.92, over 0.04985 m 28.08.
        (0.5015, 5.0, 28),
        (0.4985, 5.0, 29),
        // A displacement below that of a substep takes one substep.
        (5.0, 0.1, 1),
    ] {
        // The projection would ask for two substeps at least.
        let scene = pbf(&[
            &format!("solver.pbf.cfl={cfl}"),
            "solver.pbf.grid_projection=false",
        ]);
        let found = scene.pbf_substeps((&AT_REST, &[]), 0, speed);
        assert_eq!(found.ok(), Some(substeps), "cfl {cfl}, {speed} m/s");
    }
    let still = pbf(&["water.gravity=[0, 0, 0]", "solver.pbf.cfl=1.0"]);
    assert_eq!(still.pbf_substeps((&AT_REST, &[]), 0, 0.0).ok(), Some(1));
}

/// Drops of 0.05 mm fly with the wind at once, never faster: (2 + 9) m/s × 0.2 s / 0.1 m.
#[test]
fn no_wind_makes_a_drop_faster_than_itself() {
    let windy = "effects.drag={drop_radius=0.00005,wind=[9,0,0]}";
    let found = pbf(&["solver.pbf.cfl=1.0", windy]).pbf_substeps((&AT_REST, &[]), 0, 0.0);
    assert_eq!(found.ok(), Some(22));
    let flip = flip(&[windy]);
    // Solution of 9 t + g t² = 0.6 m.
    let longest = (-9.0 + f64::sqrt(81.0 + 24.0)) / 20.0;
    let substep = flip
        .flip_substep((&AT_REST, &[]), 1, 0.0, 0.2, 0.0, (0, 0.0))
        .expect("few enough")
        .1;
    assert!(
        (substep.length - 0.2 / (0.2 / longest).ceil()).abs() < 1e-12,
        "{substep:?}"
    );
}

/// Wind of 20 m/s on a drop of 1 mm radius, C_D = 0.44: 3/8 × 1.225/999.1 × 0.44 × 20² / 0.001
/// = 80.9 m/s², which is 16.2 m/s in a frame of 0.2 s.
#[test]
fn wind_shortens_substeps() {
    let of = |more: &[&str]| pbf(&[&["solver.pbf.cfl=1.0"], more].concat());
    let windy = "effects.drag={drop_radius=0.001,wind=[0,0,20]}";
    assert_eq!(of(&[]).pbf_substeps((&AT_REST, &[]), 0, 0.0).ok(), Some(4));
    // (2 + 16.2) m/s × 0.2 s / 0.1 m.
    assert_eq!(
        of(&[windy]).pbf_substeps((&AT_REST, &[]), 0, 0.0).ok(),
        Some(37)
    );
    let still = "effects.drag={drop_radius=0.001}";
    assert_eq!(
        of(&[still]).pbf_substeps((&AT_REST, &[]), 0, 0.0).ok(),
        Some(4)
    );
    let length = |more: &str| {
        let substep = flip(&[more]).flip_substep((&AT_REST, &[]), 1, 0.0, 0.2, 0.0, (0, 0.0));
        substep.expect("few enough").1.length
    };
    // 0.141 s with gravity only, for surface waves, and 0.081 s in the wind for 3 × 0.2 m; two
    // steps or three in 0.2 s.
    assert!((length(still) - 0.1).abs() < 1e-12 && (length(windy) - 0.2 / 3.0).abs() < 1e-12);
}

/// A force of 31 m/s² beside gravity, and its time: (10 + 31) m/s² × (0.2 s)² / 0.1 m.
#[test]
fn forces_shorten_substeps_while_they_act() {
    let force =
        "force=[{kind=\"acceleration\",acceleration=[0,0,31],from=0.2,until=0.4,on=[\"water\"]}]";
    let of = |more: &[&str]| pbf(&[&["solver.pbf.cfl=1.0"], more].concat());
    let substeps = |frame: u32| of(&[force]).pbf_substeps((&AT_REST, &[]), frame, 0.0).ok();
    assert_eq!([0, 1, 2].map(substeps), [Some(4), Some(17), Some(4)]);
    let length = |more: &[&str], start: f64| {
        let substep = flip(more).flip_substep((&AT_REST, &[]), 1, start, 0.2, 0.0, (0, 0.0));
        substep.expect("few enough").1.length
    };
    // √(0.2 m / 41 m/s²) = 0.070 s for surface waves; 0.141 s with gravity only.
    assert!((length(&[force], 0.2) - 0.2 / 3.0).abs() < 1e-12);
    assert!((length(&[force], 0.4) - 0.1).abs() < 1e-12);
    let white = force.replace("water", "whitewater");
    assert!((length(&[&white], 0.2) - 0.1).abs() < 1e-12);
}

/// √(1000 kg/m³ × (0.2 m)³ / (2π σ)) is 0.0598 s for σ = 356 N/m: four substeps in 0.2 s. Cells
/// of 0.1 m take √8 less: ten substeps with PBF's cells of twice 0.05 m.
#[test]
fn capillary_waves_shorten_substeps() {
    let tension = "effects.surface_tension={coefficient=356.0}";
    let still = [
        "water.gravity=[0, 0, 0]",
        "water.rest_density=1000",
        "solver.pbf.cfl=1.0",
    ];
    let tense = [&still[..], &[tension]].concat();
    let with = |set| [&tense[..], &[set]].concat();
    assert_eq!(
        pbf(&tense).pbf_substeps((&AT_REST, &[]), 0, 0.0).ok(),
        Some(4)
    );
    let fine = pbf(&with("solver.pbf.particle_spacing=0.05"));
    assert_eq!(fine.pbf_substeps((&AT_REST, &[]), 0, 0.0).ok(), Some(10));
    let substep = flip(&tense).flip_substep((&AT_REST, &[]), 1, 0.0, 0.2, 0.0, (0, 0.0));
    assert!((substep.expect("few enough").1.length - 0.05).abs() < 1e-12);
    let few = flip(&with("solver.flip.max_substeps=3"));
    let breach = few
        .flip_substep((&AT_REST, &[]), 1, 0.0, 0.2, 0.0, (0, 0.0))
        .expect_err("4 are asked");
    let said = breach.to_string();
    assert!(
        said.contains("effects.surface_tension no longer than 5.98"),
        "{said}"
    );
    // Control: without surface tension one is enough.
    assert_eq!(
        pbf(&still).pbf_substeps((&AT_REST, &[]), 0, 0.0).ok(),
        Some(1)
    );
}

#[test]
fn pbf_refuses_more_substeps_than_it_may_take_and_takes_as_many() {
    // (v + 2 m/s) 0.2 s over 0.1 m: 38 m/s give 80 substeps.
    let most = |count: u32| pbf(&[&format!("solver.pbf.max_substeps={count}")]);
    assert_eq!(
        most(81).pbf_substeps((&AT_REST, &[]), 3, 38.01).ok(),
        Some(81)
    );
    assert_eq!(
        most(82).pbf_substeps((&AT_REST, &[]), 3, 38.01).ok(),
        Some(81)
    );
    let breach = most(80)
        .pbf_substeps((&AT_REST, &[]), 3, 38.01)
        .expect_err("81 are asked");
    let said = breach.to_string();
    assert!(
        said.contains("frame 4") && said.contains("81") && said.contains("80"),
        "{said}"
    );
}

#[test]
fn a_wall_counts_in_the_frames_in_which_it_moves_and_only_there() {
    // Without gravity, 3 m/s are 6 spacings in a frame of 0.2 s and 1 m/s two. The wall rests
    // from frame 5 on.
    let scene = pbf(&["water.gravity=[0, 0, 0]", "solver.pbf.cfl=0.999", WALL]);
    let counts: Vec<_> = (0..7)
        .map(|frame| scene.pbf_substeps((&AT_REST, &[]), frame, 1.0).ok())
        .collect();
    let expected = [7, 7, 7, 7, 7, 3, 3].map(Some);
    assert_eq!(counts, expected);
    // The faster of the two counts, not their sum.
    assert_eq!(scene.pbf_substeps((&AT_REST, &[]), 0, 4.0).ok(), Some(9));
}

#[test]
fn flip_takes_substeps_in_which_nothing_moves_further_than_cfl_cells() {
    // v t + g t² = 3 × 0.2 m with 4 m/s and 10 m/s²: t = (√(16 + 24) − 4) / 20 s.
    let scene = flip(&[]);
    let longest = (40f64.sqrt() - 4.0) / 20.0;
    for (part, count) in [(0.9995, 4.0), (1.0005, 5.0)] {
        let remaining = 4.0 * longest * part;
        let (wanted, substep) = scene
            .flip_substep((&AT_REST, &[]), 1, 0.3, remaining, 4.0, (0, 0.0))
            .expect("few enough");
        assert_eq!(wanted, count, "{part}");
        // The substeps are equal, and this is the first.
        let length = remaining / count;
        let cells = (4.0 + 10.0 * length) * length / 0.2;
        assert!((substep.length / length - 1.0).abs() < 1e-15);
        assert!((substep.displacement / cells - 1.0).abs() < 1e-14);
        assert!(substep.start == 0.3 && substep.displacement <= 3.0);
    }
}

#[test]
fn flip_takes_substeps_in_which_short_surface_waves_are_stable() {
    // Δt = √(0.2 m / 10 m/s²), where 3 cells would allow √3 times that.
    let scene = flip(&[]);
    let longest = 0.02f64.sqrt();
    for (part, count) in [(0.9995, 4.0), (1.0005, 5.0)] {
        let remaining = 4.0 * longest * part;
        let found = scene.flip_substep((&AT_REST, &[]), 1, 0.3, remaining, 0.0, (0, 0.0));
        assert_eq!(found.expect("few enough").0, count, "{part}");
    }
    // PBF's projection has cells of 0.2 m too; in its own steps of gravity's fall, 10 m/s² × 0.2 s,
    // particles may go far with this CFL number.
    let wanted = |more| pbf(&["solver.pbf.cfl=5.0", more]).pbf_substeps((&AT_REST, &[]), 0, 0.0);
    assert_eq!(wanted("solver.pbf.grid_projection=true").ok(), Some(2));
    assert_eq!(wanted("solver.pbf.grid_projection=false").ok(), Some(1));
    // The message names what asks for more than is allowed.
    let scene = flip(&["solver.flip.max_substeps=1"]);
    let found = scene.flip_substep((&AT_REST, &[]), 1, 0.0, 0.2, 0.0, (0, 0.0));
    let detail = found
        .err()
        .and_then(|breach| breach.detail)
        .unwrap_or_default();
    assert!(
        detail.contains("for surface waves of two cells no longer than 1.414e-1 s"),
        "{detail}"
    );
}

#[test]
fn flip_counts_the_substeps_that_are_over_and_walls() {
    let scene = flip(&["water.gravity=[0, 0, 0]", WALL]);
    // 3.99 m/s for 0.3 s are 5.985 cells: two substeps of at most 3.
    let count = |speed, done| scene.flip_substep((&AT_REST, &[]), 1, 1.0, 0.3, speed, (done, 0.0));
    assert_eq!(count(3.99, 0).ok().map(|found| found.0), Some(2.0));
    assert_eq!(count(3.99, 3).ok().map(|found| found.0), Some(2.0));
    assert!(count(3.99, 4).is_err(), "six, and five may be");
    // In the first second the wall is faster than the water: 3 m/s for 0.41 s are 6.15 cells.
    let beside = |start| {
        scene
            .flip_substep((&AT_REST, &[]), 1, start, 0.41, 0.0, (0, 0.0))
            .ok()
    };
    assert_eq!(beside(0.5).map(|found| found.0), Some(3.0));
    assert_eq!(beside(1.0).map(|found| found.0), Some(1.0));
}

#[test]
fn walls_stand_where_their_motions_have_brought_them() {
    let scene = scene(&[WALL]);
    for (time, x, z) in [(0.0, 0.0, 2.0), (0.5, 1.5, 1.95), (2.0, 3.0, 1.8)] {
        let walls = scene.walls(&AT_REST, time);
        let (min, max) = (DVec3::new(x, 0.0, 0.0), DVec3::new(10.0, 4.0, z));
        assert!((walls.min - min).length() < 1e-14, "{time}: {walls:?}");
        assert!((walls.max - max).length() < 1e-14, "{time}: {walls:?}");
    }
    // Half the wall's speed over a step half-way through which it stops.
    let velocity = scene.wall_velocity(&AT_REST, 1.1, 0.2);
    assert!((velocity.min - DVec3::new(1.5, 0.0, 0.0)).length() < 1e-13);
    assert!((velocity.max - DVec3::new(0.0, 0.0, -0.1)).length() < 1e-13);
    assert_eq!(scene.wall_velocity(&AT_REST, 0.5, 0.0).min, DVec3::ZERO);
}

#[test]
fn substeps_of_a_frame_take_together_what_the_frame_takes() {
    // pic_blend 0.05 and XSPH's 0.2 leave 0.95 × 0.8 of the particles' velocity.
    let scene = flip(&[]);
    let frame = 0.2;
    for parts in [[0.2, 0.0, 0.0], [0.1, 0.05, 0.05], [0.19, 0.005, 0.005]] {
        assert!((parts.iter().sum::<f64>() - frame).abs() < 1e-15);
        let left: f64 = parts
            .iter()
            .map(|&length| 1.0 - scene.substep_pic_blend(length))
            .product();
        assert!((left - 0.95 * 0.8).abs() < 1e-14, "{parts:?}: {left}");
    }
}

#[test]
fn a_shot_lasts_as_many_frames_as_it_has() {
    let shot = scene(&["shot.frames_per_second=24", "shot.frames=36"]).shot;
    assert_eq!(shot.duration(), 1.5);
    assert!((24.0 * shot.frame_seconds() - 1.0).abs() < 1e-15);
}

/// 1 kg per particle, a corner away from the world's origin, and oblique gravity.
fn sums() -> Scene {
    let text = r#"
        [shot]
        name = "sums"
        frames = 1
        frames_per_second = 50
        [domain]
        min = [1.0, 2.0, 3.0]
        max = [3.0, 5.0, 7.0]
        [water]
        gravity = [3.0, -10.0, 0.0]
        [[water.block]]
        min = [1.0, 2.0, 3.0]
        max = [1.5, 2.5, 3.5]
        [solver]
        method = "pbf"
        [solver.pbf]
        particle_spacing = 0.1
    "#;
    parse_scene(text, Path::new("sums.toml"), Path::new("."), &[]).expect("a scene")
}

/// By hand: 900 of 1000 densities are no error, the others are 1 + k/1000 for k = 1 to 100. The
/// mean is 5.05 / 1000, 990 of them are at most 0.090, and the largest is 0.1. Each 1 + k/1000
/// is rounded to 2⁻⁵³.
#[test]
fn density_errors_have_their_mean_their_tail_and_their_largest() {
    let of = |k: u32| match k * 7919 % 1000 {
        k if k < 900 => 0.5 + f64::from(k) / 1800.0,
        k => 1.0 + f64::from(k - 899) / 1000.0,
    };
    let report = sums().report(&Particles::default(), (0..1000).map(of));
    let found = [
        report.density_error_mean,
        report.density_error_p99,
        report.density_error_max,
    ];
    for (found, expected) in found.into_iter().zip([0.005_05, 0.09, 0.1]) {
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }
    let none = sums().report(&Particles::default(), [].into_iter());
    assert_eq!(none.density_error_mean.to_bits(), 0.0f64.to_bits());
    assert_eq!((none.density_error_p99, none.density_error_max), (0.0, 0.0));
}

/// 1 kg at 5 m/s and 1 kg at 1 m/s; 2 m along gravity's x lower the energy by 6 J each, 0.5 m
/// of height add 5 J.
#[test]
fn energies_are_those_of_the_particles() {
    let state = Particles {
        position: vec![[1.0, 2.5, 3.0], [3.0, 2.0, 4.0]],
        velocity: vec![[3.0, 0.0, -4.0], [0.0, 1.0, 0.0]],
        id: vec![0, 1],
        ..Particles::default()
    };
    let report = sums().report(&state, [].into_iter());
    assert!((report.kinetic_energy - 13.0).abs() < 1e-12);
    assert!((report.potential_energy - (5.0 - 6.0)).abs() < 1e-12);
    assert_eq!(report.max_speed, 5.0);
    // Relative to the lowest point, 2 m along x: 6 J more per particle.
    let total = sums().total_energy(2, &report);
    assert!((total - 24.0).abs() < 1e-12, "{total}");
}
