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

/// A box of water, its least corner and size in hundredths of a metre, whose file has its zero `by` metres off.
fn tub(by: [i64; 2]) -> String {
    let decimal = |hundredths: i64| {
        let sign = if hundredths < 0 { "-" } else { "" };
        let (whole, rest) = (hundredths.abs() / 100, hundredths.abs() % 100);
        format!("{sign}{whole}.{rest:02}")
    };
    let corner = |k: usize| {
        let x = 100 * by[0] + [83, 119][k & 1];
        let z = 100 * by[1] + [21, 79][k >> 2];
        let y = [0, 80][k >> 1 & 1];
        format!("v {} {} {}\n", decimal(x), decimal(y), decimal(z))
    };
    let corners: String = (0..8).map(corner).collect();
    corners + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// The mesh of an OBJ as a binary STL.
fn binary_stl(obj: &str) -> Vec<u8> {
    let format = swell::domain::mesh_file::MeshFormat::Obj;
    let mesh = TriangleMesh::from_bytes(obj.as_bytes(), format, "tub.obj".as_ref()).unwrap();
    let mut out = vec![0; 80];
    out.extend((mesh.triangles.len() as u32).to_le_bytes());
    for t in 0..mesh.triangles.len() {
        let corners = mesh.corners(t).map(|p| p.as_vec3().to_array());
        let floats = [0.0; 3].into_iter().chain(corners.into_iter().flatten());
        out.extend(floats.flat_map(f32::to_le_bytes));
        out.extend([0; 2]);
    }
    out
}

/// Water as a survey has it, in a zone of UTM, is the water that the same file has near zero.
#[test]
fn a_mesh_far_from_zero_keeps_its_shape() {
    let way = [448_213, -5_411_987];
    let water = |file: &str, by: [i64; 2]| {
        let [x, z] = by.map(|by| -by);
        format!("[[water.mesh]]\nfile = \"{file}\"\ntranslate = [{x}.0, 0.0, {z}.0]\n")
    };
    let scene = |water: &str| {
        let (before, rest) = POOL.split_once("[[water.block]]").unwrap();
        let (_, solver) = rest.split_once("[solver]").unwrap();
        format!("{before}{water}[solver]{solver}").replace("= 0.05", "= 0.02")
    };
    let job = Job::of(&[
        ("near.obj", &tub([0, 0])),
        ("far.obj", &tub(way)),
        ("near.toml", &scene(&water("near.obj", [0, 0]))),
        ("far.toml", &scene(&water("far.obj", way))),
        ("floats.toml", &scene(&water("far.stl", way))),
        ("near-floats.toml", &scene(&water("near.stl", [0, 0]))),
    ]);
    std::fs::write(job.path("far.stl"), binary_stl(&tub(way))).unwrap();
    std::fs::write(job.path("near.stl"), binary_stl(&tub([0, 0]))).unwrap();
    let shape = |name: &str| {
        let scene = Scene::load(&job.path(name), &[]).unwrap();
        (scene.water.meshes[0].mesh.clone(), scene.warnings())
    };
    let (near, said) = shape("near.toml");
    assert_eq!(said, Vec::<String>::new());
    assert_eq!(shape("near-floats.toml").1, Vec::<String>::new());
    let (far, said) = shape("far.toml");
    assert_eq!(said, Vec::<String>::new());
    // A decimal rounds to 64 bits, and so does the sum: two halves of 2⁻³⁰ m at 5.4e6 m.
    let apart = |mesh: &TriangleMesh| {
        let pairs = near.vertices.iter().zip(&mesh.vertices);
        pairs
            .map(|(a, b)| (*a - *b).abs().max_element())
            .fold(0.0, f64::max)
    };
    assert!(apart(&far) <= 2.0f64.powi(-30), "{}", apart(&far));
    // The control: in 32 bits the tub is another, and that is told.
    let (floats, _) = shape("floats.toml");
    assert!((floats.signed_volume() / near.signed_volume() - 1.0).abs() > 0.05);
    let words =
        "warning: far.stl: 32-bit floats about its coordinate -5411986.79 are 5.00e-1 m apart";
    let said = job.expect(0, "inspect floats.toml");
    assert!(
        said.contains(&words.replace("-5411986.79", "-5411987")),
        "{said}"
    );
    assert_has(
        &said,
        &["let translate move it", "particle spacing of 0.02 m"],
    );
}
