use std::path::Path;

use crate::{load_scene, parse_scene};

const SCENE: &str = r#"
[shot]
name = "a"
frames = 100
frames_per_second = 20
[domain]
min = [0, 0, 0]
max = [20, 2, 1]
[[water.block]]
min = [0, 0, 0]
max = [20, 1, 1]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
[solver.pbf]
particle_spacing = 0.04
"#;

fn lints(set: &[&str]) -> Vec<String> {
    let set: Vec<String> = set.iter().map(|&text| text.to_owned()).collect();
    let scene = parse_scene(SCENE, Path::new("s.toml"), Path::new(""), &set).expect("valid");
    scene.lints()
}

/// Each suspicious value, paired with a change that removes the warning.
#[test]
fn what_is_hardly_meant_is_said_with_its_key_and_number() {
    // Waves of 2.2987 s are 6.2832 m long on 1 m of water; their group velocity is 2.1 m/s.
    let sine = "wave_maker=[{wall=\"-x\",motion={kind=\"sine\",stroke=0.2,period=2.2987}}]";
    let stokes = |more: &str| {
        let waves = format!("kind=\"stokes\",period=2.2987,{more}");
        format!("effects.generation_zone={{walls=[\"-x\"],length=9.0,waves={{{waves}}}}}")
    };
    let packet = |more: &str| {
        let waves = format!(
            "kind=\"focused\",at=[2.0,0.5],peak_period=2.2987,ramp=0.1,\
             shortest_period=2.0,depth=1.0,{more}"
        );
        format!("effects.generation_zone={{walls=[\"-x\"],length=9.0,waves={{{waves}}}}}")
    };
    let room = "min=[1.0,1.0,0.0],max=[2.0,2.0,1.0]";
    let emitter = |more: &str| format!("emitter=[{{{room},velocity=[1.0,0.0,0.0],{more}}}]");
    let absorbing = |asked: &str| {
        let still = "wall=\"-x\",motion={kind=\"still\"}";
        format!("wave_maker=[{{{still},absorption={{{asked}}}}}]")
    };
    let drain = |more: &str| format!("drain=[{{{room},{more}}}]");
    for (set, good, expected) in [
        (
            vec![stokes("height=0.04,depth=1.0")],
            vec![stokes("height=0.11,depth=1.0")],
            "effects.generation_zone.waves: waves 0.04 m high are 0.80 particle spacings high",
        ),
        (
            vec![stokes("height=0.11,depth=1.2")],
            vec![stokes("height=0.11,depth=1.05")],
            "effects.generation_zone.waves: depth is 1.2 m, and the scene's water is 1 m deep, \
             0.83 times as much",
        ),
        (
            vec![
                stokes("height=0.6,depth=1.0"),
                "domain.max=[20, 1.2, 1]".into(),
            ],
            vec![
                stokes("height=0.3,depth=1.0"),
                "domain.max=[20, 1.2, 1]".into(),
            ],
            "effects.generation_zone.waves: crests 0.300 m above water 1 m deep reach the \
             ceiling, 1.2 m above the floor",
        ),
        (
            vec![stokes("height=0.11,depth=1.0").replace("9.0", "4.0")],
            vec![stokes("height=0.11,depth=1.0").replace("9.0", "5.0")],
            "effects.generation_zone.length: 4 m is 0.64 of a wave length, as waves of 2.2987 s \
             are 6.283 m long on 1 m of water",
        ),
        (
            vec!["effects.absorbing_zone={walls=[\"+x\"],length=3.0,period=2.2987}".into()],
            vec!["effects.absorbing_zone={walls=[\"+x\"],length=3.2,period=2.2987}".into()],
            "effects.absorbing_zone.length: 3 m is 0.48 of a wave length",
        ),
        (
            vec![
                stokes("height=0.11,depth=1.0"),
                "shot.frames_per_second=4".into(),
            ],
            vec![
                stokes("height=0.11,depth=1.0"),
                "shot.frames_per_second=5".into(),
            ],
            "effects.generation_zone.waves: a period of 2.2987 s is 9.2 frames",
        ),
        (
            vec![sine.into(), "shot.frames=500".into()],
            vec![sine.into(), "shot.frames=400".into()],
            "wave_maker[0].motion: waves return from the opposite wall after 21.",
        ),
        (
            vec![sine.into(), "shot.frames=500".into()],
            vec![
                sine.into(),
                "shot.frames=500".into(),
                "effects.absorbing_zone={walls=[\"+x\"],length=9.0,period=2.3}".into(),
            ],
            "and no zone absorbs them",
        ),
        (
            vec![
                "solver.method=pbf".into(),
                "solver.pbf.grid_projection=false".into(),
            ],
            vec!["solver.method=pbf".into()],
            "solver.pbf.grid_projection: 25 layers of particles without it",
        ),
        (
            vec![packet("height=0.35,time=4.9")],
            vec![packet("height=0.33,time=4.9")],
            "effects.generation_zone.waves: a crest of 0.35 m has k a = 0.35 at the peak's 2.2987 \
             s; waves break from 0.34 on",
        ),
        (
            vec![packet("height=0.2,time=5.1")],
            vec![packet("height=0.2,time=5.0")],
            "effects.generation_zone.waves: its crests meet after 5.1 s, and \
             the shot ends after 5 s",
        ),
        (
            vec![emitter("from=5.0")],
            vec![emitter("from=4.9")],
            "emitter[0].from: it begins after 5 s, and the shot ends after 5 s",
        ),
        (
            vec![absorbing("depth=1.2,period=2.3,room=0.2")],
            vec![absorbing("depth=1.05,period=2.3,room=0.2")],
            "wave_maker[0].absorption: depth is 1.2 m, and the scene's water is 1 m deep, 0.83 \
             times as much",
        ),
        (
            vec![
                absorbing("depth=1.0,period=2.3,room=1.2"),
                emitter("from=1.0"),
            ],
            vec![
                absorbing("depth=1.0,period=2.3,room=0.9"),
                emitter("from=1.0"),
            ],
            "emitter[0]: 0.200 m of its volume are behind wave_maker[0] at rest",
        ),
        (
            vec![drain("from=6.0")],
            vec![drain("from=1.0")],
            "drain[0].from: it begins after 6 s, and the shot ends after 5 s",
        ),
        (
            vec![
                sine.into(),
                "effects.absorbing_zone={walls=[\"+x\"],length=3.0,period=1.5}".into(),
            ],
            vec![
                sine.into(),
                "effects.absorbing_zone={walls=[\"+x\"],length=3.2,period=1.5}".into(),
            ],
            "effects.absorbing_zone.length: 3 m is 0.48 of a wave length of \
             wave_maker[0].motion's waves of 2.2987 s",
        ),
        (
            vec!["effects.drag={drop_radius=0.04}".into()],
            vec!["effects.drag={drop_radius=0.03}".into()],
            "effects.drag.drop_radius: a drop of 0.04 m radius holds 2.1 times \
             the water of a particle",
        ),
        // The Reynolds number is √(9.81 × 0.1) × 0.1 × 1000 / μ.
        (
            vec!["effects.viscosity={coefficient=0.001}".into()],
            vec!["effects.viscosity={coefficient=0.1}".into()],
            "effects.viscosity.coefficient: the Reynolds number √(g Δx) Δx / ν of \
             a cell of 0.1 m is 990",
        ),
        // Bond numbers of a spacing of 0.05 m: 1000 × 9.81 × 0.05² / σ.
        (
            vec!["effects.surface_tension={coefficient=0.0728}".into()],
            vec!["effects.surface_tension={coefficient=24.6}".into()],
            "effects.surface_tension.coefficient: the Bond number ρ g d² / σ of a particle \
             spacing of 0.05 m is 33",
        ),
    ] {
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        let found = lints(&set);
        let [only] = &found[..] else {
            panic!("{set:?}: {found:?}")
        };
        assert!(only.contains(expected), "{only}");
        let good: Vec<&str> = good.iter().map(String::as_str).collect();
        assert_eq!(lints(&good), [] as [&str; 0], "{good:?}");
    }
}

/// Each kind of motion provides its own wave height.
#[test]
fn each_motion_that_makes_waves_is_looked_at() {
    for motion in [
        "kind=\"sine\",stroke=0.02,period=2.2987",
        "kind=\"solitary\",height=0.02,depth=1.0",
        "kind=\"stokes\",height=0.02,period=2.2987,depth=1.0",
        "kind=\"cnoidal\",height=0.02,period=4.0,depth=1.0",
        "kind=\"sea\",significant_height=0.02,peak_period=2.5,depth=1.0",
        "kind=\"focused\",height=0.02,at=0.5,time=4.0,ramp=0.5,peak_period=2.5,depth=1.0",
    ] {
        let maker = format!("wave_maker=[{{wall=\"-x\",motion={{{motion}}}}}]");
        let found = lints(&[&maker]);
        assert!(
            found.len() == 1 && found[0].contains("particle spacings high"),
            "{motion}: {found:?}"
        );
    }
}

/// Includes the scenes of the validation studies.
#[test]
fn what_ships_is_meant() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut read = 0;
    for folder in [scenes.clone(), scenes.join("validation")] {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let file = entry.expect("an entry").path();
            if file.extension().is_some_and(|end| end == "toml") {
                let scene = load_scene(&file, &[]).expect("valid");
                let mut lints = scene.lints();
                // This scene uses the iterations of the paper without grid projection on purpose.
                if file.ends_with("basin.toml") {
                    lints.retain(|lint| !lint.starts_with("solver.pbf.grid_projection: 24 "));
                }
                // The experiment fixes these sizes.
                if file.ends_with("block.toml") {
                    lints.retain(|lint| !lint.starts_with("water.block[0]: 0.6754 m³ "));
                }
                assert_eq!(lints, [] as [&str; 0], "{}", file.display());
                read += 1;
            }
        }
    }
    assert!(read > 12, "{read}");
}

/// Returns a box with corners at `min` and `max`, as OBJ.
fn cuboid(min: [f64; 3], max: [f64; 3]) -> String {
    let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { min } else { max }[axis]);
    let corners: String = (0..8)
        .map(|k| {
            let [x, y, z] = corner(k);
            format!("v {x} {y} {z}\n")
        })
        .collect();
    corners + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// Returns the lints of a scene beside a file `box.obj`.
fn lints_beside(mesh: &str, scene: &str) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("box.obj"), mesh).expect("written");
    let scene = parse_scene(scene, Path::new("s.toml"), folder.path(), &[]).expect("valid");
    scene.lints()
}

fn only(found: &[String], expected: &str) {
    let [only] = found else {
        panic!("{expected}: {found:?}")
    };
    assert!(only.starts_with(expected), "{only}");
}

#[test]
fn a_table_that_moves_nothing_or_stops_short_is_said() {
    let wall = |points: &str| {
        format!("wave_maker=[{{wall=\"-x\",motion={{kind=\"table\",points={points}}}}}]")
    };
    for (points, good, expected) in [
        (
            "[[6.0,0.0],[8.0,1.0]]",
            "[[4.0,0.0],[6.0,1.0]]",
            "wave_maker[0].motion: its table moves nothing before 6 s, and the shot ends after 5 s",
        ),
        (
            "[[1001.0,0.0],[1021.0,0.2],[1041.0,0.4],[1061.0,0.4]]",
            "[[0.0,0.0],[1.0,0.2],[2.0,0.4],[3.0,0.4]]",
            "wave_maker[0].motion: its table moves nothing before 1001 s, and the shot ends after \
             5 s; its times are seconds, and frame 1061 is at 53.05 s",
        ),
        (
            "[[0.0,0.0],[20.0,0.2],[40.0,0.4],[60.0,0.6],[80.0,0.8],[100.0,0.8]]",
            "[[0.0,0.0],[1.0,0.2],[2.0,0.4],[3.0,0.6],[4.0,0.8],[5.0,0.8]]",
            "wave_maker[0].motion: 5 of 6 points of its table, all at whole numbers, lie after the \
             shot's 5 s; its times are seconds, and frame 100 is at 5 s",
        ),
        (
            "[[0.0,0.0],[1.0,0.2],[2.0,0.4],[3.0,0.6]]",
            "[[0.0,0.0],[1.0,0.2],[2.0,0.4],[5.0,0.6]]",
            "wave_maker[0].motion: its table ends in mid-motion: up to its last point, at 3 s, it \
             moves at 0.2 m/s, and stops there within 1 s",
        ),
        (
            "[[0.0,0.0],[5.0,0.0]]",
            "[[0.0,0.0],[5.0,0.1]]",
            "wave_maker[0].motion: all points of its table are at 0, so that nothing moves",
        ),
    ] {
        only(&lints(&[&wall(points)]), expected);
        assert_eq!(lints(&[&wall(good)]), [] as [&str; 0], "{good}");
    }
    // Solids are checked like walls.
    let door = cuboid([10.0, 0.5, 0.2], [10.4, 0.9, 0.6]);
    let slide =
        "direction = [1, 0, 0]\nmotion = { kind = \"table\", points = [[9.0, 0.0], [9.5, 1.0]] }\n";
    let turn = "pivot = [10, 0, 0]\naxis = [0, 1, 0]\n\
                turn = { kind = \"table\", points = [[9.0, 0.0], [9.5, 90.0]] }\n";
    for (moves, key) in [(slide, "solid.motion of box"), (turn, "solid.turn of box")] {
        let scene = format!("{SCENE}[[solid]]\nmesh = \"box.obj\"\n{moves}");
        only(
            &lints_beside(&door, &scene),
            &format!("{key}: its table moves nothing before 9 s"),
        );
        let early = scene.replace("9.0", "1.0").replace("9.5", "4.5");
        assert_eq!(lints_beside(&door, &early), [] as [&str; 0]);
    }
}

#[test]
fn a_wall_that_goes_through_a_solid_is_said() {
    let scene = |wall: &str, way: f64| {
        let motion = format!("kind = \"table\", points = [[0.0, 0.0], [2.0, {way}], [4.0, {way}]]");
        format!(
            "{SCENE}[[solid]]\nmesh = \"box.obj\"\n[[wave_maker]]\nwall = \"{wall}\"\n\
             motion = {{ {motion} }}\n"
        )
    };
    let pier = |x: f64| cuboid([x, 0.0, 0.3], [x + 0.4, 0.8, 0.7]);
    for (wall, x) in [("-x", 1.0), ("+x", 18.6)] {
        only(
            &lints_beside(&pier(x), &scene(wall, 1.2)),
            "wave_maker[0].motion: the wall moves 1.2 m inward, and from 1 m on through the solid \
             box, which does not move",
        );
        assert_eq!(lints_beside(&pier(x), &scene(wall, 0.9)), [] as [&str; 0]);
    }
    // Controls: a floor that begins behind the wall or at its face, and one thinner than a spacing.
    for floor in [
        cuboid([-1.0, -0.5, -0.5], [3.0, 0.3, 1.5]),
        cuboid([0.0, 0.0, 0.0], [3.0, 0.3, 1.0]),
        cuboid([0.5, 0.0, 0.0], [3.0, 0.04, 1.0]),
    ] {
        assert_eq!(lints_beside(&floor, &scene("-x", 1.2)), [] as [&str; 0]);
    }
}

#[test]
fn a_wall_without_water_is_said() {
    let motion = "kind = \"table\", points = [[0.0, 0.0], [2.0, 0.1], [4.0, 0.1]]";
    let scene = |from: f64, more: &str| {
        let water = format!("[[water.block]]\nmin = [{from:?}, 0, 0]\nmax = [20, 1, 1]\n");
        let text = SCENE.replace(
            "[[water.block]]\nmin = [0, 0, 0]\nmax = [20, 1, 1]\n",
            &water,
        );
        format!("{text}{more}[[wave_maker]]\nwall = \"-x\"\nmotion = {{ {motion} }}\n")
    };
    let solid = "[[solid]]\nmesh = \"box.obj\"\n";
    let dry =
        "wave_maker[0]: no water is beside its wall at rest, though water 1 m deep is on the floor";
    let block = cuboid([-1.0, -1.0, -1.0], [2.0, 3.0, 2.0]);
    only(&lints_beside(&block, &scene(0.0, solid)), dry);
    only(&lints_beside(&block, &scene(2.0, "")), dry);
    // Controls: a solid as high as half of the water, one that leaves a gap of two spacings, and
    // water that an emitter may bring.
    let gap = cuboid([-1.0, -1.0, 0.1], [2.0, 3.0, 2.0]);
    assert_eq!(lints_beside(&gap, &scene(0.0, solid)), [] as [&str; 0]);
    let low = cuboid([-1.0, -1.0, -1.0], [2.0, 0.5, 2.0]);
    assert_eq!(lints_beside(&low, &scene(0.0, solid)), [] as [&str; 0]);
    let emitter = "[[emitter]]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\nvelocity = [1, 0, 0]\n";
    assert_eq!(lints_beside(&low, &scene(2.0, emitter)), [] as [&str; 0]);
}

/// An assumed depth is compared with the water beside the wall, for a mesh as for a box, and above
/// the solids that are its floor.
#[test]
fn a_depth_is_that_beside_the_wall() {
    let scene = |water: &str, solid: &str, depth: f64| {
        let block = "[[water.block]]\nmin = [0, 0, 0]\nmax = [20, 1, 1]\n";
        assert!(SCENE.contains(block));
        let motion =
            format!("kind = \"stokes\", height = 0.11, period = 2.2987, depth = {depth:?}");
        let text = SCENE.replace(block, water);
        format!("{text}{solid}[[wave_maker]]\nwall = \"-x\"\nmotion = {{ {motion} }}\n")
    };
    let of_mesh = "[[water.mesh]]\nfile = \"box.obj\"\n";
    let pool = cuboid([0.0; 3], [20.0, 1.0, 1.0]);
    only(
        &lints_beside(&pool, &scene(of_mesh, "", 1.2)),
        "wave_maker[0].motion: depth is 1.2 m, and the scene's water is 1 m deep, 0.83 times as \
         much",
    );
    assert_eq!(
        lints_beside(&pool, &scene(of_mesh, "", 1.05)),
        [] as [&str; 0]
    );
    let block = |y: f64| format!("[[water.block]]\nmin = [0, {y:?}, 0]\nmax = [20, 1, 1]\n");
    let solid = "[[solid]]\nmesh = \"box.obj\"\n";
    let floor = cuboid([-1.0, -1.0, -1.0], [21.0, 0.4, 2.0]);
    for bottom in [0.0, 0.4] {
        only(
            &lints_beside(&floor, &scene(&block(bottom), solid, 1.0)),
            "wave_maker[0].motion: depth is 1 m, and the scene's water is 0.6 m deep, 0.60 times \
             as much, on solids 0.4 m high beside the wall",
        );
        let good = scene(&block(bottom), solid, 0.6);
        assert_eq!(lints_beside(&floor, &good), [] as [&str; 0], "{bottom}");
    }
    // Control: a solid that hangs above, and a floor that begins farther away.
    for other in [
        cuboid([-1.0, 0.5, -1.0], [21.0, 0.8, 2.0]),
        cuboid([5.0, -1.0, -1.0], [21.0, 0.4, 2.0]),
    ] {
        assert_eq!(
            lints_beside(&other, &scene(&block(0.0), solid, 1.0)),
            [] as [&str; 0]
        );
    }
}

#[test]
fn a_stroke_whose_waves_break_is_said() {
    let sine = |stroke: f64, period: f64| {
        format!(
            "wave_maker=[{{wall=\"-x\",motion={{kind=\"sine\",stroke={stroke:?},\
             period={period:?}}}}}]"
        )
    };
    only(
        &lints(&[&sine(0.7, 2.2987)]),
        "wave_maker[0].motion: by linear theory a stroke of 0.7 m makes waves 0.687 m high; waves \
         of 2.2987 s on 1 m of water break from 0.680 m on (Miche 1944)",
    );
    let long = lints(&[&sine(3.2, 8.0)]);
    assert!(
        long.len() == 1 && long[0].contains("from 0.780 m on (McCowan 1894)"),
        "{long:?}"
    );
    for (stroke, period) in [(0.69, 2.2987), (3.0, 8.0)] {
        assert_eq!(lints(&[&sine(stroke, period)]), [] as [&str; 0], "{stroke}");
    }
}
