//! Meshes as other programs write them: what a scene makes of them, and what it reports.

use glam::DVec3;
use swell::domain::{mesh::TriangleMesh, signed_distance::SignedDistance};
use swell::files::load_scene;

use crate::support::job::{Job, assert_has};

const POOL: &str = "[shot]\nname = \"pool\"\nframes = 1\nframes_per_second = 24\n[domain]\n\
    min = [0.0, 0.0, 0.0]\n\
    max = [2.0, 1.0, 1.0]\n[[water.block]]\nmin = [0.0, 0.0, 0.0]\nmax = [2.0, 0.5, 1.0]\n\
    [[solid]]\nmesh = \"solid.obj\"\n\
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

/// Area of [`PLAN`], m².
const PLAN_AREA: f64 = 1.2 * 0.2 + 0.4 * 0.45 + 0.4 * 0.4;

/// Extrudes the plan between two heights. Floor and top are one polygon each that begins at corner
/// `first`, or the faces given.
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
    let scene = load_scene(&job.path("scene.toml"), &[]).unwrap();
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
    // 32-bit rounding moves each corner within two metres by up to 2⁻²⁴ m, along edges
    // of 5.3 m in total.
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
    // The bay is open to the water: the distance is that to the nearest of its walls, not
    // to a roof over it.
    let scene = load_scene(&job.path("scene.toml"), &[]).unwrap();
    let field = SignedDistance::from_mesh(&mesh, &scene.domain, 0.05).unwrap();
    let found = field.sample(DVec3::new(1.0, 0.3, 0.65));
    assert!((found - 0.2).abs() < 0.01, "{found}");
    for first in 1..PLAN.len() {
        job.write("solid.obj", &prism(first, None));
        assert_eq!(solid(&job), mesh, "from corner {first}");
    }
    // Negative control: a fan around the first corner covers the bay, and collinear
    // corners open it.
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
    // Two neighbouring corners of the plan are swapped, at both heights.
    let whole = prism(0, None);
    let mut lines: Vec<_> = whole.lines().collect();
    for first in [7, PLAN.len() + 7] {
        lines.swap(first, first + 1);
    }
    let job = Job::of(&[("scene.toml", POOL), ("solid.obj", &lines.join("\n"))]);
    let words = "warning: solid.obj: 2 polygons cross themselves, the first is face 1";
    assert_has(&job.expect(0, "inspect scene.toml"), &[words]);
    job.write("solid.obj", &prism(0, None));
    assert!(!job.expect(0, "inspect scene.toml").contains("warning"));
}

/// An OBJ box of water whose smallest corner and size are in hundredths of a metre, and whose file
/// is shifted by `by` metres.
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

/// Converts an OBJ mesh to a binary STL.
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

/// Water in the UTM coordinates of a survey is the same as that of a file near zero.
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
        let scene = load_scene(&job.path(name), &[]).unwrap();
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
    // Negative control: 32-bit coordinates change the shape, and a warning reports it.
    let (floats, _) = shape("floats.toml");
    assert!((floats.signed_volume() / near.signed_volume() - 1.0).abs() > 0.05);
    let said = job.expect(0, "inspect floats.toml");
    let words = "warning: far.stl: 32-bit floats near its coordinate -5411987";
    assert_has(&said, &[words, "are 5.00e-1 m apart"]);
    assert_has(
        &said,
        &["move it with translate", "particle spacing of 0.02 m"],
    );
}

/// Corners and faces of a box that reaches from zero to `size`.
fn box_to(size: [f64; 3]) -> String {
    let end = |k: usize, axis: usize| if k >> axis & 1 == 0 { 0.0 } else { size[axis] };
    let corner = |k: usize| format!("v {:?} {:?} {:?}\n", end(k, 0), end(k, 1), end(k, 2));
    let corners: String = (0..8).map(corner).collect();
    corners + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// 0.075 in 32 bits is 0.07500000298: a file in 32-bit floats, or decimals printed from them, still
/// describes a mesh as wide as the domain.
#[test]
fn a_mesh_as_wide_as_the_domain_fits_into_it() {
    let head = "[shot]\nname = \"a\"\nframes = 1\nframes_per_second = 24\n[domain]\n\
        min = [0.0, 0.0, 0.0]\n\
        max = [0.075, 0.9, 0.3]\n[solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = 0.0125\n";
    let water = "[[water.mesh]]\nfile = \"FILE\"\n";
    let emitter =
        "[[emitter]]\nmesh = { file = \"FILE\" }\nvelocity = [0.0, 0.0, 0.0]\nlevel = 0.7\n";
    let drain = "[[drain]]\nmesh = { file = \"FILE\" }\nlevel = 0.7\n";
    // 0.7 rounds down in 32 bits.
    let job = Job::of(&[
        (
            "wide.obj",
            &box_to([0.075, 0.7, 0.3].map(|x| f64::from(x as f32))),
        ),
        ("wider.obj", &box_to([0.07500002, 0.7, 0.3])),
        ("lower.obj", &box_to([0.075, 0.6999998, 0.3])),
    ]);
    std::fs::write(job.path("wide.stl"), binary_stl(&box_to([0.075, 0.7, 0.3]))).unwrap();
    for table in [water, emitter, drain] {
        let read = |file: &str| {
            let text = format!("{head}{}", table.replace("FILE", file));
            job.write("scene.toml", &text);
            load_scene(&job.path("scene.toml"), &[]).map_err(|error| error.to_string())
        };
        for file in ["wide.obj", "wide.stl"] {
            read(file).unwrap_or_else(|error| panic!("{file}: {error}"));
        }
        // Negative control: off by more than five times the rounding.
        let said = read("wider.obj").expect_err("wider");
        assert_has(&said, &["not fit", "0.07500002", "0.075"]);
        if table != water {
            let said = read("lower.obj").expect_err("lower");
            assert_has(&said, &["0.7 m is not within its volume"]);
        }
    }
}

/// A solid that only touches the domain is outside it, even if rounding puts it inside.
#[test]
fn a_solid_that_touches_the_domain_is_outside_of_it() {
    let job = Job::of(&[("solid.obj", &box_to([1.0, 1.0, f64::from(0.3f32)]))]);
    let read = |z: &str| {
        let placed = format!("\"solid.obj\"\ntranslate = [0.0, 0.0, {z}]");
        job.write("scene.toml", &POOL.replace("\"solid.obj\"", &placed));
        load_scene(&job.path("scene.toml"), &[]).map_err(|error| error.to_string())
    };
    let said = read("-0.3").expect_err("beside the domain");
    assert_has(&said, &["outside the domain"]);
    assert!(read("-0.2999").is_ok());
}

/// Every kind of text file that a scene, a look or a study is read from, in UTF-16 with and without
/// a byte order mark, and in UTF-8 with one.
#[test]
fn texts_of_other_encodings_say_what_to_do() {
    let job = Job::new();
    let mesh = std::fs::read_to_string(job.path("box.obj")).unwrap();
    let scene = std::fs::read_to_string(job.path("small.toml")).unwrap();
    let maker = "motion = { kind = \"sine\", stroke = 0.3, period = 0.5, ramp = 0.1 }";
    assert!(scene.contains(maker));
    let scene = scene.replace(maker, "motion = { kind = \"table\", file = \"way.csv\" }");
    let track = "track = { file = \"door.gltf\", node = \"door\" }";
    let door = "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"name\":\"door\"}]}";
    let look = std::fs::read_to_string(job.path("look.toml")).unwrap();
    job.write("scene.toml", &scene);
    job.write("way.csv", "0,0\n1,0.1\n");
    job.write("door.gltf", door);
    job.write("look.toml", &look);
    let moved = scene.replace(
        "mesh = \"box.obj\"",
        &format!("mesh = \"box.obj\"\n{track}"),
    );
    job.write("moved.toml", &moved);
    let stl = {
        let format = swell::domain::mesh_file::MeshFormat::Obj;
        let mesh = TriangleMesh::from_bytes(mesh.as_bytes(), format, "m".as_ref()).unwrap();
        let mut text = "solid box\n".to_owned();
        for t in 0..mesh.triangles.len() {
            text += "facet normal 0 0 0\nouter loop\n";
            for v in mesh.corners(t) {
                text += &format!("vertex {} {} {}\n", v.x, v.y, v.z);
            }
            text += "endloop\nendfacet\n";
        }
        text + "endsolid box\n"
    };
    job.write("box.stl", &stl);
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 4\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n\
        3 0 1 3\n3 1 2 3\n3 0 3 2\n";
    job.write("box.ply", ply);
    for (file, command, code) in [
        ("scene.toml", "inspect scene.toml", 2),
        ("box.obj", "inspect scene.toml", 2),
        ("way.csv", "inspect scene.toml", 2),
        ("door.gltf", "inspect moved.toml", 2),
        ("look.toml", "inspect look.toml", 2),
        ("study.toml", "inspect study.toml", 2),
        ("box.stl", "inspect box.stl", 4),
        ("box.ply", "inspect box.ply", 4),
        ("door.gltf", "inspect door.gltf", 4),
    ] {
        let text = std::fs::read_to_string(job.path(file)).unwrap();
        let set = |bytes: &[u8]| std::fs::write(job.path(file), bytes).unwrap();
        for marked in [format!("\u{feff}{text}"), text.clone()] {
            let wide: Vec<u8> = marked.encode_utf16().flat_map(u16::to_le_bytes).collect();
            set(&wide);
            let said = job.expect(code, command);
            assert_has(&said, &[file, "UTF-16; save it as UTF-8"]);
            assert_eq!(said.trim_end().lines().count(), 1, "{said}");
        }
        // UTF-8 with a byte order mark; and the control, unchanged.
        set(format!("\u{feff}{text}").as_bytes());
        job.expect(0, command);
        set(text.as_bytes());
        job.expect(0, command);
    }
}

#[test]
fn backslashes_in_paths_say_what_to_write() {
    let job = Job::new();
    std::fs::create_dir(job.path("sub")).unwrap();
    std::fs::copy(job.path("box.obj"), job.path("sub/box.obj")).unwrap();
    std::fs::copy(job.path("box.obj"), job.path("sub/city.obj")).unwrap();
    let scene = std::fs::read_to_string(job.path("small.toml")).unwrap();
    let named = |mesh: &str| {
        job.write("named.toml", &scene.replace("\"box.obj\"", mesh));
        let line = 1 + scene
            .lines()
            .position(|line| line.contains("box.obj"))
            .unwrap();
        (format!("named.toml:{line}: "), "inspect named.toml")
    };
    for mesh in [
        // A control character, an invalid escape, an escape with too few digits, a
        // literal backslash.
        r#""sub\box.obj""#,
        r#""sub\city.obj""#,
        r#""C:\Users\box.obj""#,
        r#"'sub\box.obj'"#,
    ] {
        let (place, words) = named(mesh);
        let said = job.expect(2, words);
        assert_has(&said, &[&place, "use / between folders"]);
        assert!(
            said.chars().all(|c| c == '\n' || !c.is_control()),
            "{said:?}"
        );
    }
    let (_, words) = named("\"sub/box.obj\"");
    job.expect(0, words);
}
