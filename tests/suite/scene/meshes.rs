//! Meshes as other programs write them: what a scene makes of them, and what it says.

use glam::DVec3;
use swell::{
    domain::{mesh::TriangleMesh, signed_distance::SignedDistance},
    scene::Scene,
};

use crate::support::job::{Job, assert_has};

const POOL: &str = "[shot]\nname = \"pool\"\nframes = 1\nframes_per_second = 24\n[domain]\nmin = [0.0, 0.0, 0.0]\n\
    max = [2.0, 1.0, 1.0]\n[[water.block]]\nmin = [0.0, 0.0, 0.0]\nmax = [2.0, 0.5, 1.0]\n[[solid]]\nmesh = \"solid.obj\"\n\
    [solver]\nmethod = \"pbf\"\n[solver.pbf]\nparticle_spacing = 0.05\n";

/// A basin's plan: x and z of its corners, two of them on a straight edge.
const PLAN: [[f64; 2]; 10] = [
    [0.4, 0.2],
    [1.0, 0.2],
    [1.6, 0.2],
    [1.6, 0.85],
    [1.2, 0.85],
    [1.2, 0.4],
    [0.8, 0.4],
    [0.8, 0.8],
    [0.4, 0.8],
    [0.4, 0.5],
];

/// Square metres of [`PLAN`].
const PLAN_AREA: f64 = 1.2 * 0.2 + 0.4 * 0.45 + 0.4 * 0.4;

/// The plan between two heights; floor and top are one polygon each, whose corners come from `first` on, or these faces.
fn prism(first: usize, floor_and_top: Option<&str>) -> String {
    let count = PLAN.len();
    let ring = |y: f64| PLAN.map(|[x, z]| format!("v {x} {y} {z}\n")).concat();
    let word = |k: usize, base: usize| format!(" {}", (first + k) % count + base);
    let floor: String = (0..count).map(|k| word(k, 1)).collect();
    let top: String = (0..count).rev().map(|k| word(k, count + 1)).collect();
    let side = |k: usize| {
        let (a, b) = (k + 1, (k + 1) % count + 1);
        format!("f {a} {} {} {b}\n", a + count, b + count)
    };
    let sides: String = (0..count).map(side).collect();
    let polygons = format!("f{floor}\nf{top}\n");
    let faces = floor_and_top.unwrap_or(&polygons);
    format!("{}{}{faces}{sides}", ring(-0.05), ring(0.3))
}

fn solid(job: &Job) -> TriangleMesh {
    let scene = Scene::load(&job.path("scene.toml"), &[]).unwrap();
    assert_eq!(scene.warnings(), Vec::<String>::new());
    scene.solids[0].mesh.clone()
}

fn top_area(mesh: &TriangleMesh) -> f64 {
    let up = (0..mesh.triangles.len()).map(|t| mesh.area_vector(t));
    up.filter(|area| area.y > 0.0).map(DVec3::length).sum()
}

#[test]
fn a_bay_in_a_polygon_is_open_whichever_corner_comes_first() {
    let job = Job::of(&[("scene.toml", POOL), ("solid.obj", &prism(0, None))]);
    let mesh = solid(&job);
    // Corners within two metres may be rounded to 32 bits, by 2⁻²⁴ of them each along edges of 5.3 m in all.
    let tolerance = 5.3 * 2.0 * 2.0f64.powi(-24);
    let check = |mesh: &TriangleMesh| {
        assert_eq!(mesh.open_edges(), []);
        assert!(
            (top_area(mesh) - PLAN_AREA).abs() < tolerance,
            "{}",
            top_area(mesh)
        );
    };
    check(&mesh);
    // Water stands in the bay: the distance to the nearest of its walls, not to a roof over it.
    let scene = Scene::load(&job.path("scene.toml"), &[]).unwrap();
    let field = SignedDistance::from_mesh(&mesh, &scene.domain, 0.05).unwrap();
    let found = field.sample(DVec3::new(1.0, 0.3, 0.65));
    assert!((found - 0.2).abs() < 0.01, "{found}");
    for first in 1..PLAN.len() {
        job.write("solid.obj", &prism(first, None));
        assert_eq!(solid(&job), mesh, "from corner {first}");
    }
    // The control: a fan about the first corner has a roof over the bay, and corners on a line open it.
    let fan = |base: usize, [b, c]: [usize; 2]| format!("f {base} {} {}\n", base + b, base + c);
    let fans: String = (1..PLAN.len() - 1)
        .map(|k| fan(1, [k, k + 1]) + &fan(PLAN.len() + 1, [k + 1, k]))
        .collect();
    job.write("solid.obj", &prism(0, Some(&fans)));
    let fanned = solid(&job);
    assert!(top_area(&fanned) > PLAN_AREA + 0.1, "{}", top_area(&fanned));
}

#[test]
fn a_polygon_that_crosses_itself_is_a_warning() {
    let mut crossed = prism(0, None);
    let top = "f 20 19 18";
    assert!(crossed.contains(top));
    crossed = crossed.replace(top, "f 20 18 19");
    let job = Job::of(&[("scene.toml", POOL), ("solid.obj", &crossed)]);
    let words = "warning: solid.obj: 1 polygon crosses itself, the first is face 2";
    assert_has(&job.expect(0, "inspect scene.toml"), &[words]);
    job.write("solid.obj", &prism(0, None));
    assert!(!job.expect(0, "inspect scene.toml").contains("warning"));
}
