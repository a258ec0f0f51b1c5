//! How much water a scene holds, as `inspect` and a bake report it: requested and made, none, too
//! much, and in open meshes.

use crate::support::job::{Job, assert_has};

const SCENE: &str = r#"
[shot]
name = "water"
frames = 24
frames_per_second = 24

[domain]
min = [0.0, 0.0, 0.0]
max = [0.8, 0.8, 0.8]

[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.8, 0.4, 0.8]

[solver]
method = "flip"

[solver.flip]
cell_size = 0.2

[solver.pbf]
particle_spacing = 0.1
"#;

fn job() -> Job {
    Job::of(&[("water.toml", SCENE)])
}

const BAKE: &str = "bake water.toml --device cpu --frames 1";

#[test]
fn the_volume_that_is_made_stands_beside_the_one_asked_for() {
    let job = job();
    let told = "256 particles (0 removed inside solids), 0.2560 m³ of water of 0.2560 m³ asked for";
    let said = job.expect(0, "inspect water.toml");
    assert_has(&said, &[told]);
    assert!(!said.contains("warning"), "{said}");
    assert_has(&job.expect(0, &format!("{BAKE} -o whole")), &[told]);

    // 0.37 m: 3.7 layers are rounded to four.
    job.edit(
        "water.toml",
        "max = [0.8, 0.4, 0.8]",
        "max = [0.8, 0.37, 0.8]",
    );
    let lint = "water.block[0]: 0.2368 m³ are requested and 0.2560 m³ are made, 8.1 % more: it is \
        filled with whole layers, 8 × 4 × 8 particles";
    let told = "256 particles (0 removed inside solids), 0.2560 m³ of water of 0.2368 m³ asked for";
    for words in ["inspect water.toml", &format!("{BAKE} -o off")] {
        assert_has(&job.expect(0, words), &[&format!("warning: {lint}"), told]);
    }
    assert_has(&job.expect(2, "inspect water.toml --deny lint"), &[lint]);
    let plan = job.json(0, "inspect water.toml");
    assert!(
        (plan["volume"].as_f64().unwrap() - 0.256).abs() < 1e-12,
        "{plan}"
    );
    assert!((plan["volume_asked"].as_f64().unwrap() - 0.2368).abs() < 1e-12);
    let said = job.expect(0, &format!("{BAKE} -o dry --dry-run"));
    assert_has(
        &said,
        &["256 particles at the start, 0.2560 m³ of water of 0.2368 m³ asked for"],
    );
    // A bake that begins from a frame requests no water.
    let said = job.expect(
        0,
        "bake water.toml --device cpu --frames 2 --from off:1 -o branch",
    );
    assert_has(&said, &["0.2560 m³ of water\n"]);
}

/// An emitter 1.5 rows wide, and one that is open for less than a layer.
#[test]
fn emitters_that_rows_or_windows_round_are_told_of() {
    let job = job();
    let emitter =
        |of: &str| format!("--set emitter=[{{min=[0.2,0.5,0.2],max=[0.5,0.7,0.6],velocity={of}}}]");
    // Whole rows of 0.1 m.
    for of in ["[1,0,0]", "[0,0,-1]", "[0,-1,0]"] {
        let said = job.expect(0, &format!("inspect water.toml {}", emitter(of)));
        assert!(!said.contains("warning"), "{said}");
    }
    let thin = "--set emitter=[{min=[0.2,0.5,0.2],max=[0.5,0.65,0.6],velocity=[1,0,0]}]";
    let lint = "emitter[0]: its box and velocity ask for 0.06000 m³/s, and 0.08000 m³/s enter, \
                33.3 % more: across the flow there are whole rows of particles 0.1 m apart";
    for words in [
        format!("inspect water.toml {thin}"),
        format!("{BAKE} {thin} -o rounded"),
    ] {
        assert_has(&job.expect(0, &words), &[&format!("warning: {lint}")]);
    }
    let denied = job.expect(2, &format!("inspect water.toml {thin} --deny lint"));
    assert_has(&denied, &[lint]);

    let pulse = |from: f64, until: f64| {
        let of = format!("[1,0,0],from={from:?},until={until:?}");
        format!("inspect water.toml {}", emitter(&of))
    };
    let lint = "emitter[0]: nothing enters: no layer of particles comes in within its 0.04000 s";
    let said = job.expect(0, &pulse(0.06, 0.1));
    assert_has(&said, &[lint, "at most 0 particles more"]);
    let said = job.expect(0, &pulse(0.12, 0.16));
    assert!(!said.contains("nothing enters"), "{said}");
    assert_has(&said, &["at most 8 particles more"]);
}

#[test]
fn a_scene_without_water_is_told_of() {
    let job = job();
    let dry = "--set water.block=[]";
    let none = "water: the scene holds no water, and no [[emitter]] brings any";
    for words in [
        format!("inspect water.toml {dry}"),
        format!("{BAKE} {dry} -o dry"),
        format!("{BAKE} {dry} -o dried --dry-run"),
    ] {
        let said = job.expect(0, &words);
        assert_has(&said, &[&format!("warning: {none}"), "0 particles"]);
        assert!(!said.contains("1 particles"), "{said}");
    }
    assert_has(
        &job.expect(2, &format!("{BAKE} {dry} -o denied --deny lint")),
        &[none],
    );
    assert_eq!(
        job.json(0, &format!("inspect water.toml {dry}"))["particles"],
        0
    );
    // One particle gives the singular.
    let one = format!("{dry} --set water.particles=[{{at=[[0.4,0.4,0.4]]}}]");
    let said = job.expect(0, &format!("inspect water.toml {one}"));
    assert_has(&said, &["1 particle ("]);
    assert!(!said.contains("holds no water"), "{said}");

    // A solid over all of it.
    job.write("box.obj", BOX);
    job.edit(
        "water.toml",
        "[solver]\n",
        "[[solid]]\nmesh = \"box.obj\"\n[solver]\n",
    );
    let covered = "water: solids or walls cover all of the scene's water, and no particle is left";
    for words in [
        "inspect water.toml".to_owned(),
        format!("{BAKE} -o covered"),
    ] {
        assert_has(
            &job.expect(0, &words),
            &[&format!("warning: {covered}"), "0 particles (256 removed"],
        );
    }
    let denied = job.expect(2, "inspect water.toml --deny lint");
    assert_has(&denied, &["denied by --deny lint", covered]);
    // Negative control: half of it.
    job.edit(
        "water.toml",
        "mesh = \"box.obj\"",
        "mesh = \"box.obj\"\ntranslate = [0.5, 0.0, 0.0]",
    );
    let said = job.expect(0, "inspect water.toml");
    assert!(
        !said.contains(covered) && said.contains("(128 removed"),
        "{said}"
    );
}

/// From -0.1 to 0.9 m, except for its height: 0.7 m.
const BOX: &str = "v -0.1 -0.1 -0.1\nv 0.9 -0.1 -0.1\nv 0.9 0.7 -0.1\nv -0.1 0.7 -0.1\n\
    v -0.1 -0.1 0.9\nv 0.9 -0.1 0.9\nv 0.9 0.7 0.9\nv -0.1 0.7 0.9\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";

/// A full box into which a sixteenth more water flows: 32 particles to 512.
#[test]
fn an_overfull_box_is_told_of_from_five_per_cent_on() {
    let job = job();
    job.edit(
        "water.toml",
        "max = [0.8, 0.4, 0.8]",
        "max = [0.8, 0.8, 0.8]",
    );
    job.edit(
        "water.toml",
        "[solver]\n",
        "[[emitter]]\nmin = [0.2, 0.2, 0.2]\nmax = [0.6, 0.6, 0.6]\nvelocity = [0.0, 0.2, 0.0]\n\
         [solver]\n",
    );
    let overfull = "warning: the domain is overfull: 544 particles represent 0.5440 m³ of water, \
        and it has room for 0.5120 m³";
    for solver in ["flip", "pbf"] {
        let bake = format!("bake water.toml --device cpu --solver {solver}");
        let said = job.expect(0, &format!("{bake} -o {solver}"));
        assert_has(&said, &[overfull]);
        // FLIP's densities show it as well, in each frame.
        let dense = "the water is 6 % too dense on average: its volume is not kept";
        assert_eq!(said.contains(dense), solver == "flip", "{said}");
        // Negative control: half as much.
        let said = job.expect(0, &format!("{bake} --frames 1-8 -o {solver}-less"));
        assert!(
            !said.contains("overfull") && !said.contains("too dense"),
            "{said}"
        );
    }
}

#[test]
fn water_in_an_open_mesh_is_told_of() {
    let job = job();
    // A cup: the box without its lid, 0.1 to 0.7 m, and its bottom at 0.1 m.
    let cup = BOX
        .replace("-0.1", "0.1")
        .replace("0.9", "0.7")
        .replace("f 4 8 7 3\n", "");
    job.write("cup.obj", &cup);
    job.edit(
        "water.toml",
        "[solver]\n",
        "[[solid]]\nmesh = \"cup.obj\"\n[solver]\n",
    );
    let open = "cup.obj is open and treated as closed: 1 hole: 4 open edges about";
    let container = "the scene puts water inside it, and that water is removed: an open mesh is \
        solid up to a flat cap over each hole";
    for words in ["inspect water.toml", &format!("{BAKE} -o cup")] {
        let said = job.expect(0, words);
        let warned = said
            .lines()
            .filter(|line| line.starts_with("warning: cup.obj"));
        let [warning] = warned.collect::<Vec<_>>()[..] else {
            panic!("one warning: {said}");
        };
        assert_has(warning, &[open, container]);
    }
    // Negative control: water beside it.
    job.edit(
        "water.toml",
        "max = [0.8, 0.4, 0.8]",
        "max = [0.8, 0.1, 0.8]",
    );
    let said = job.expect(0, "inspect water.toml");
    assert!(said.contains(open) && !said.contains("container"), "{said}");
    // As a water mesh it is full.
    let water = "--set solid=[] --set water.mesh=[{file=\"cup.obj\"}]";
    let said = job.expect(0, &format!("inspect water.toml {water}"));
    assert_has(&said, &[open, "water fills this container up to there"]);
}
