use std::path::Path;

use crate::{parse_scene, scene_to_toml};
use swell_domain::absorber::MOST;
use swell_scene::Scene;

const SCENE: &str = r#"
[shot]
name = "float"
frames = 4
frames_per_second = 24
[domain]
min = [0, 0, 0]
max = [2, 1, 1]
[[water.block]]
min = [0, 0, 0]
max = [2, 0.5, 1]
[[body]]
mesh = "assets/crate.obj"
scale = 0.3
translate = [0.5, 0.5, 0.5]
density = 400.0
velocity = [0.1, 0.0, 0.0]
spin = [0.0, 33.3, 0.0]
mooring = [{ anchor = [0.5, 0.0, 0.5], at = [0.5, 0.35, 0.5], length = 0.4, stiffness = 1e4 }]
[[body]]
mesh = "assets/drop.obj"
scale = 0.1
translate = [1.5, 0.5, 0.5]
mass = 2.0
hinge = { at = [1.4, 0.5, 0.5], axis = [0, 0, 2] }
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
[solver.pbf]
particle_spacing = 0.05
"#;

fn load(set: &[&str]) -> Result<Scene, String> {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let set: Vec<String> = set.iter().map(|&it| it.to_owned()).collect();
    parse_scene(SCENE, Path::new("float.toml"), &scenes, &set).map_err(|error| error.to_string())
}

#[test]
fn a_scene_with_bodies_reads_back_as_it_was_written() {
    let scene = load(&[]).unwrap();
    let bodies: Vec<_> = scene.bodies().collect();
    assert_eq!(bodies.len(), 2);
    assert!((bodies[0].body.mass.mass - 400.0 * 0.027).abs() < 0.2);
    assert_eq!(bodies[1].body.mass.mass, 2.0);
    assert!((bodies[0].body.velocity[4] - 33.3f64.to_radians()).abs() < 1e-15);
    let text = scene_to_toml(&scene, &|file, _| file.to_str().unwrap().to_owned());
    let again = crate::parse_scene_within(
        &text,
        Path::new("again.toml"),
        Path::new("/"),
        &[],
        crate::Reach::Anywhere,
    );
    assert_eq!(again.unwrap().moving_solids, scene.moving_solids);
}

#[test]
fn bodies_that_cannot_be_are_refused_with_their_key() {
    let crate_at = "mesh=\"assets/crate.obj\",scale=0.3";
    let one = |keys: &str| format!("body=[{{{crate_at},{keys}}}]");
    for (set, key, part) in [
        (
            one("translate=[0.5,0.5,0.5]"),
            "body[0].density",
            "needs its density or its mass",
        ),
        (
            one("translate=[0.5,0.5,0.5],mass=0.0"),
            "body[0].mass",
            "1e-9",
        ),
        (
            one("translate=[1.9,0.5,0.5],density=1"),
            "body[0].mesh",
            "does not fit",
        ),
        (
            one("translate=[0.5,0.5,0.5],density=1,free=[]"),
            "body[0].free",
            "free along no axis",
        ),
        (
            one("translate=[0.5,0.5,0.5],density=1,free=[\"x\",\"x\"]"),
            "body[0].free",
            "listed twice",
        ),
        (
            one("translate=[0.5,0.5,0.5],density=1,inertia=[1,1,3]"),
            "body[0].inertia",
            "no body has",
        ),
        (
            one("translate=[0.5,0.5,0.5],density=1,hinge={at=[0,0,0],axis=[0,0,0]}"),
            "body[0].hinge.axis",
            "no direction",
        ),
        (
            "body=[{mesh=\"assets/crate.obj\",scale=0.3,translate=[0.5,0.5,0.5],density=1},\
             {mesh=\"assets/crate.obj\",scale=0.3,translate=[0.6,0.5,0.6],density=1}]"
                .to_owned(),
            "body[1].mesh",
            "overlaps body[0]",
        ),
    ] {
        let said = load(&[&set]).expect_err(&set);
        assert!(said.contains(key) && said.contains(part), "{set}: {said}");
    }
    let pbf = load(&["solver.method=\"pbf\"", "solver.pbf.grid_projection=false"]);
    assert!(pbf.expect_err("no projection").contains("grid_projection"));
    assert!(load(&["solver.method=\"pbf\""]).is_ok());
    let periodic = load(&[
        "domain.periodic=[\"z\"]",
        "domain.max=[2,1,0.8]",
        "water.block=[{min=[0,0,0],max=[2,0.5,0.8]}]",
    ]);
    assert!(periodic.expect_err("moves along z").contains("body[0]"));
    // Bodies may touch.
    let touching = "body=[{mesh=\"assets/crate.obj\",scale=0.3,translate=[0.5,0.5,0.5],density=1},\
                    {mesh=\"assets/crate.obj\",scale=0.3,translate=[0.8,0.5,0.5],density=1}]";
    assert!(load(&[touching]).is_ok());
}

/// Half a cell of 0.1 m at 2 m/s and with 9.81 m/s² takes 0.0225 s; 5 cells and waves allow
/// 0.101 s.
#[test]
fn no_point_of_a_body_goes_farther_than_half_a_cell() {
    let scene = load(&[
        "body=[{mesh=\"assets/crate.obj\",scale=0.3,translate=[0.5,0.5,0.5],density=400,\
         velocity=[2,0,0]}]",
        "solver.flip.cfl=5",
    ]);
    let scene = scene.unwrap();
    let flip = scene.with_flip().unwrap();
    let states = scene.bodies_at_start();
    let moving = (&[None; MOST], &states[..]);
    let (_, substep) = (flip.flip_substep(moving, 1, 0.0, 0.25, 0.0, (0, 0.0))).unwrap();
    assert!(
        (substep.length - 0.25 / 12.0).abs() < 1e-12,
        "{}",
        substep.length
    );
}
