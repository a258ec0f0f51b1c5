use super::super::mesh::tests::cube;
use super::*;

const SQUARE_OBJ: &str = "# a square\nmtllib missing.mtl\nv 0 0 0\nv 2 0 0 0.5 0.5 0.5\n\
    v 2 2 0\nv 0 2 0\nvn 0 0 1\no part\nf 1/1/1 2//1 3 -1\n";
const SQUARE_PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n\
    property double y\nproperty int z\nproperty uchar red\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n0 0 0 255\n2 0 0 255\n2 2 0 255\n\
    0 2 0 255\n4 0 1 2 3\n";

pub(super) fn parse(format: MeshFormat, bytes: &[u8]) -> Result<TriangleMesh, String> {
    TriangleMesh::from_bytes(bytes, format, Path::new("m")).map_err(|e| e.to_string())
}

fn stl_of(mesh: &TriangleMesh, ascii: bool) -> Vec<u8> {
    let mut text = b"solid cube\n".to_vec();
    let mut binary = vec![b' '; 80];
    binary[..6].copy_from_slice(b"solid ");
    binary.extend((mesh.triangles.len() as u32).to_le_bytes());
    for t in 0..mesh.triangles.len() {
        text.extend(b"facet normal 0 0 0\nouter loop\n");
        binary.extend([0u8; 12]);
        for v in mesh.corners(t) {
            text.extend(format!("vertex {} {} {}\n", v.x, v.y, v.z).into_bytes());
            for x in v.to_array() {
                binary.extend((x as f32).to_le_bytes());
            }
        }
        text.extend(b"endloop\nendfacet\n");
        binary.extend([0u8; 2]);
    }
    text.extend(b"endsolid cube\n");
    if ascii { text } else { binary }
}

fn ply_of(mesh: &TriangleMesh, little: bool) -> Vec<u8> {
    let order = if little { "little" } else { "big" };
    let mut out = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nelement face {}\n\
         property list uchar uint vertex_index\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for v in &mesh.vertices {
        for x in v.to_array() {
            let bits = (x as f32).to_bits();
            out.extend(if little {
                bits.to_le_bytes()
            } else {
                bits.to_be_bytes()
            });
        }
    }
    for t in &mesh.triangles {
        out.push(3);
        for i in t {
            out.extend(if little {
                i.to_le_bytes()
            } else {
                i.to_be_bytes()
            });
        }
    }
    out
}

#[test]
fn a_square_comes_out_of_obj_and_ascii_ply_alike() {
    let obj = parse(MeshFormat::Obj, SQUARE_OBJ.as_bytes()).expect("valid OBJ");
    assert_eq!(obj.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(obj.area(), 4.0);
    let ply = parse(MeshFormat::Ply, SQUARE_PLY.as_bytes()).expect("valid PLY");
    assert_eq!(ply, obj);
}

#[test]
fn a_cube_survives_stl_and_binary_ply_welded_and_closed() {
    let cube = cube();
    let files = [
        (MeshFormat::Stl, stl_of(&cube, true)),
        (MeshFormat::Stl, stl_of(&cube, false)),
        (MeshFormat::Ply, ply_of(&cube, true)),
        (MeshFormat::Ply, ply_of(&cube, false)),
    ];
    for (format, bytes) in files {
        let mesh = parse(format, &bytes).expect("valid file");
        assert_eq!(mesh.vertices.len(), 8, "{format:?}");
        assert!((mesh.signed_volume() - 1.0).abs() < 1e-15);
        assert!(mesh.open_edges().is_empty());
    }
}

/// Decimals keep their digits far from zero; 32-bit floats do not, and are reported as such.
#[test]
fn texts_are_read_in_64_bits() {
    let way = DVec3::new(448_214.2, 0.0, -5_411_987.6);
    let far = cube().transformed(&glam::DAffine3::from_translation(way));
    let obj = |mesh: &TriangleMesh| {
        let vertices = mesh.vertices.iter();
        let vertices: String = vertices
            .map(|v| format!("v {} {} {}\n", v.x, v.y, v.z))
            .collect();
        let faces = mesh.triangles.iter().map(|t| t.map(|v| v + 1));
        let faces: String = faces.map(|[a, b, c]| format!("f {a} {b} {c}\n")).collect();
        (vertices + &faces).into_bytes()
    };
    let ply = |mesh: &TriangleMesh, kind: &str| {
        let vertices = mesh.vertices.iter();
        let vertices: String = vertices
            .map(|v| format!("{} {} {}\n", v.x, v.y, v.z))
            .collect();
        let faces = mesh.triangles.iter();
        let faces: String = faces.map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
        let header = format!(
            "ply\nformat ascii 1.0\nelement vertex 8\nproperty {kind} x\nproperty {kind} y\n\
             property {kind} z\n\
             element face 12\nproperty list uchar int vertex_indices\nend_header\n"
        );
        (header + &vertices + &faces).into_bytes()
    };
    let read = |format, bytes: Vec<u8>| {
        Loaded::from_bytes(&bytes, format, Path::new("m")).expect("a mesh")
    };
    for (format, bytes) in [
        (MeshFormat::Obj, obj(&far)),
        (MeshFormat::Ply, ply(&far, "float")),
        (MeshFormat::Ply, ply(&far, "double")),
        (MeshFormat::Stl, stl_of(&far, true)),
    ] {
        let found = read(format, bytes);
        assert_eq!(found.digits, Digits::Text);
        assert_eq!(found.mesh.bounds(), far.bounds(), "{format:?}");
        assert_eq!(
            (found.mesh.vertices.len(), found.mesh.open_edges().len()),
            (8, 0)
        );
        assert_eq!(found.farthest(), -5_411_987.6);
    }
    // Negative control: floats there are half a metre apart.
    for (format, bytes) in [
        (MeshFormat::Ply, ply_of(&far, true)),
        (MeshFormat::Stl, stl_of(&far, false)),
    ] {
        let found = read(format, bytes);
        assert_eq!(found.digits, Digits::Single);
        assert_ne!(found.mesh.bounds(), far.bounds(), "{format:?}");
        assert_eq!(found.rounding().z, 0.25);
    }
}

/// Corners that two faces share, with coordinates computed in 64 bits in two ways.
#[test]
fn last_digits_of_a_text_part_no_corners() {
    let cube = String::from_utf8(stl_of(&cube(), true)).expect("text");
    for (from, to) in [
        ("vertex 1 0 0", "vertex 0.9999999999999999 0 0"),
        ("vertex 1 0 0", "vertex 1 -0 6.1e-17"),
        ("vertex 1 1 1", "vertex 1.00000001 1 1"),
    ] {
        assert!(cube.matches(from).count() > 1, "{from}");
        let mesh = parse(MeshFormat::Stl, cube.replacen(from, to, 1).as_bytes()).expect("a cube");
        assert_eq!(
            (mesh.vertices.len(), mesh.open_edges().len()),
            (8, 0),
            "{to}"
        );
    }
    // Negative control: a difference visible in 32 bits makes another corner.
    let torn = cube.replacen("vertex 1 1 1", "vertex 1.000001 1 1", 1);
    let mesh = parse(MeshFormat::Stl, torn.as_bytes()).expect("a mesh");
    assert!(mesh.vertices.len() == 9 && !mesh.open_edges().is_empty());
}

/// An L of area 4 that starts at each of its corners, in both formats with polygons.
#[test]
fn polygons_that_are_not_convex_are_cut_alike_in_obj_and_ply() {
    let ring = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2]];
    let vertices = |prefix: &str| {
        let line = |[x, y]: [i32; 2]| format!("{prefix}{x} {y} 0\n");
        ring.map(line).concat()
    };
    let read = |first: usize| {
        let order = |base: usize| -> Vec<String> {
            (0..6)
                .map(|k| ((first + k) % 6 + base).to_string())
                .collect()
        };
        let obj = format!("{}f {}\n", vertices("v "), order(1).join(" "));
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n\
             property float z\n\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n{}6 {}\n",
            vertices(""),
            order(0).join(" ")
        );
        let obj = parse(MeshFormat::Obj, obj.as_bytes()).expect("an OBJ");
        assert_eq!(parse(MeshFormat::Ply, ply.as_bytes()).as_ref(), Ok(&obj));
        (0..4).map(|t| obj.corners(t)).collect::<Vec<_>>()
    };
    let whole = read(0);
    let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).z;
    assert!(whole.iter().all(|t| area(t) > 0.0));
    assert_eq!(whole.iter().map(area).sum::<f64>(), 4.0);
    for first in 1..6 {
        assert_eq!(read(first), whole, "from corner {first}");
    }
}

#[test]
fn polygons_that_cross_themselves_are_told_of() {
    let read = |face: &str| {
        let text = format!("v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 3 2\n{face}");
        Loaded::from_bytes(text.as_bytes(), MeshFormat::Obj, Path::new("m")).expect("a mesh")
    };
    let said = read("f 1 2 3 4\n").crossing.expect("words");
    assert!(
        said.starts_with(
            "1 polygon crosses itself, the first is face 2 (counted from 1) with \
             a corner at (0, 0, 0);"
        ),
        "{said}"
    );
    let said = read("f 1 2 3 4\nf 2 3 4 1\n").crossing.expect("words");
    assert!(said.starts_with("2 polygons cross themselves"), "{said}");
    assert_eq!(read("f 1 3 2 4\n").crossing, None);
}

#[test]
fn a_nameless_text_stl_is_text() {
    let text = String::from_utf8(stl_of(&cube(), true)).expect("text");
    let nameless = text.replacen("solid cube", "solid", 1);
    assert!(parse(MeshFormat::Stl, nameless.as_bytes()).is_ok());
}

/// A sliver is dropped; a closed mesh exported inside out is reversed; an open one is left as
/// it is.
#[test]
fn slivers_go_and_inside_out_is_turned() {
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let outward = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    let inward = "f 1 2 3\nf 1 4 2\nf 2 4 3\nf 1 3 4\n";
    let obj = |faces: &str| parse(MeshFormat::Obj, format!("{corners}{faces}").as_bytes()).unwrap();
    let volume = obj(outward).signed_volume();
    assert!(volume > 0.1);
    assert_eq!(obj(inward).signed_volume(), volume);
    assert_eq!(obj(&format!("{outward}f 1 2 1\n")).triangles.len(), 4);
    assert_eq!(obj("f 1 2 3\n").triangles, [[0, 1, 2]]);
}

#[test]
fn every_fault_is_named() {
    let obj = |text: &str| parse(MeshFormat::Obj, text.as_bytes());
    let ply = |text: &str| parse(MeshFormat::Ply, text.as_bytes());
    let cases = [
        (obj("v 0 0 0\n"), "no triangles"),
        (obj("v 0 0\n"), "line 1: a vertex needs three numbers"),
        (
            obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
            "line 4: the face refers to vertex 4",
        ),
        (
            obj("v 0 0 0\nf 1 2 0\n"),
            "line 2: \"0\" is not a valid vertex index",
        ),
        (
            obj("v 0 0 0\nf 1 1\n"),
            "line 2: a face needs three corners",
        ),
        (
            obj("v 0 0 0\nf -9223372036854775808 1 1\n"),
            "is not a valid vertex index",
        ),
        (
            obj("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            "vertex 0 is (NaN, 0, 0)",
        ),
        (
            obj("v 1e30 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            "allowed are numbers up to 1e9",
        ),
        (
            obj("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
            "no triangle has an area",
        ),
        (
            ply(&SQUARE_PLY.replace("vertex 4", "vertex 4000000000000")),
            "declares 4000000000000",
        ),
        (
            ply(&SQUARE_PLY.replace("4 0 1 2 3", "4 0 1 2 9")),
            "refers to vertex 9",
        ),
        (
            ply(&SQUARE_PLY.replace("4 0 1 2 3", "2 0 1")),
            "fewer than three corners",
        ),
        (
            ply(&SQUARE_PLY.replace("float x", "float w")),
            "vertex 0 lacks one of x, y, z",
        ),
        (
            ply("not a ply"),
            "not a PLY: it begins with \"not a ply\", not with \"ply\"",
        ),
        (parse(MeshFormat::Stl, b"junk"), "not an STL: too short"),
        (
            parse(MeshFormat::Stl, &[0xff; 200]),
            "4294967295 triangles need",
        ),
    ];
    for (result, expected) in cases {
        let message = result.expect_err(expected);
        assert!(message.contains(expected), "{message} lacks {expected}");
        assert!(message.starts_with("mesh m: "), "{message}");
    }
    assert!(matches!(
        TriangleMesh::load(Path::new("a.fbx")),
        Err(MeshError::UnknownFormat { .. })
    ));
    assert!(matches!(
        TriangleMesh::load(Path::new("/nowhere/a.obj")),
        Err(MeshError::Read { .. })
    ));
}

#[test]
fn an_endless_promise_of_nothing_is_refused() {
    let bytes = b"ply\nformat binary_little_endian 1.0\nelement none 1152921504606846976\n\
        end_header\n";
    let message = parse(MeshFormat::Ply, bytes).expect_err("a false promise");
    assert!(message.contains("declares"), "{message}");
}

fn moved(mesh: &TriangleMesh, by: f64) -> TriangleMesh {
    mesh.transformed(&glam::DAffine3::from_translation(DVec3::X * by))
}

/// Checks for two cubes, one of them displaced.
#[track_caller]
fn assert_two_cubes(found: Result<TriangleMesh, String>) {
    let mesh = found.expect("two cubes");
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (16, 24));
    // 24 terms of at most 7/6, each rounded.
    assert!((mesh.signed_volume() - 2.0).abs() < 24.0 * 7.0 / 6.0 * f64::EPSILON);
}

#[test]
fn every_solid_of_a_text_is_read() {
    let mut text = stl_of(&cube(), true);
    text.extend(b"\n");
    text.extend(stl_of(&moved(&cube(), 6.0), true));
    assert_two_cubes(parse(MeshFormat::Stl, &text));
    // Variants that some exporters write: capitals, tabs, line ends of Windows and old Macs, a byte
    // order mark, a trailing control character, NaN normals.
    let text = String::from_utf8(text).expect("text");
    for changed in [
        text.to_uppercase(),
        text.replace("facet", "Facet").replace("solid", "Solid"),
        text.replace("vertex ", "\t\tvertex\t"),
        text.replace('\n', " \r\n"),
        text.replace('\n', "\r"),
        format!("\u{feff}{text}"),
        format!("\n{text}\n\u{1a}"),
        text.replace("normal 0 0 0", "normal nan nan -nan(ind)"),
        text.replace("vertex 1 ", "vertex 1.0E+00 "),
    ] {
        assert_two_cubes(parse(MeshFormat::Stl, changed.as_bytes()));
    }
    // A binary file may begin with the word.
    let mut binary = stl_of(&cube(), false);
    assert!(binary.starts_with(b"solid "));
    assert!(parse(MeshFormat::Stl, &binary).is_ok());
    binary.pop();
    let message = parse(MeshFormat::Stl, &binary).expect_err("a byte less");
    assert!(
        message.ends_with(
            "begins with \"solid\", but is not text, and 12 triangles need 684 bytes of 683"
        ),
        "{message}"
    );
}

#[test]
fn every_group_of_an_obj_is_read_with_comments_marks_and_joined_lines() {
    let lines = |mesh: &TriangleMesh, name: &str, base: u32| {
        let mut text = format!("g {name}\n");
        for v in &mesh.vertices {
            text += &format!("v {} {} {}\n", v.x, v.y, v.z);
        }
        text += &format!("o {name}\n");
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| v + base);
            text += &format!("f {a} {b} {c}\n");
        }
        text
    };
    let text = lines(&cube(), "a", 1) + &lines(&moved(&cube(), 6.0), "b", 9);
    for changed in [
        text.clone(),
        format!("\u{feff}{text}"),
        text.replace('\n', " # a comment\n"),
        text.replace('\n', "# C:\\meshes\\\n"),
        text.replace('\n', "\r\n"),
        text.replace('\n', "\r"),
        text.replace("f ", "f \\\n\t"),
        text.replace("f ", "f \\ \r\n "),
    ] {
        assert_two_cubes(parse(MeshFormat::Obj, changed.as_bytes()));
    }
    // Line numbers are those of the file, even after joined lines.
    let message = parse(MeshFormat::Obj, b"v 0 \\\n0 0\n# \\\nf 1 2 x").expect_err("no x");
    assert_eq!(message, "mesh m: line 4: \"x\" is not a valid vertex index");
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let message = parse(MeshFormat::Obj, &[&b"\xff\xfe"[..], &wide].concat()).expect_err("UTF-16");
    assert!(message.contains("UTF-16"), "{message}");
}

#[test]
fn a_ply_is_read_with_any_line_ends_marks_and_numbers() {
    let square = parse(MeshFormat::Ply, SQUARE_PLY.as_bytes()).expect("valid PLY");
    for changed in [
        format!("\u{feff}{SQUARE_PLY}"),
        SQUARE_PLY.replace('\n', "\r\n"),
        SQUARE_PLY.replace('\n', " \t\n"),
        SQUARE_PLY.replace('\n', "\r"),
        SQUARE_PLY.replace("\n2 0 0", "\n2.e0 -.0 0"),
        SQUARE_PLY.replace("element vertex", "comment caf\u{e9}\nelement vertex"),
    ] {
        let mesh = parse(MeshFormat::Ply, changed.as_bytes());
        assert_eq!(mesh.as_ref(), Ok(&square), "{changed:?}");
    }
    // A comment in Latin-1, before a binary body.
    let binary = ply_of(&cube(), true);
    let at = binary
        .windows(7)
        .position(|w| w == b"element")
        .expect("an element");
    let latin = [&binary[..at], b"comment caf\xe9\r\n", &binary[at..]].concat();
    assert_eq!(
        parse(MeshFormat::Ply, &latin),
        parse(MeshFormat::Ply, &binary)
    );
}

#[test]
fn faults_of_text_files_are_told_in_one_line_with_their_place() {
    let ply = |from: &str, to: &str| {
        assert!(SQUARE_PLY.contains(from), "{from}");
        parse(MeshFormat::Ply, SQUARE_PLY.replacen(from, to, 1).as_bytes())
    };
    let cube = String::from_utf8(stl_of(&cube(), true)).expect("text");
    let stl = |from: &str, to: &str| {
        assert!(cube.contains(from), "{from}");
        parse(MeshFormat::Stl, cube.replacen(from, to, 1).as_bytes())
    };
    let cases = [
        (
            ply("property float x", "propety float x"),
            "line 4: \"propety float x\": Couldn't parse line",
        ),
        (ply("format ascii 1.0\n", ""), "No format line found."),
        (
            ply("end_header\n", ""),
            "the header has no line \"end_header\"",
        ),
        (
            ply("2 2 0 255", "2 two 0 255"),
            "line 13, element \"vertex\": \"2 two 0 255\": \"two\" is not a number",
        ),
        (
            ply("2 2 0 255", "2 nan 0 255"),
            "line 13, element \"vertex\": \"2 nan 0 255\": \"nan\" is not a number",
        ),
        (
            ply("2 2 0 255", "2 2 0"),
            "line 13, element \"vertex\": \"2 2 0\": it has fewer values than the header declares",
        ),
        (
            ply("2 2 0 255", "2 2 0 256"),
            "line 13, element \"vertex\": \"2 2 0 256\": 256 does not fit into its property's type",
        ),
        (
            ply("4 0 1 2 3", "5 0 1 2 3"),
            "line 15, element \"face\": \"5 0 1 2 3\": it has fewer values than the header \
             declares",
        ),
        (
            ply("4 0 1 2 3\n", ""),
            "declares 1 of element \"face\", which need 2 bytes, but 0 are left",
        ),
        (
            ply("element face 1", "element face 2"),
            "the file ends within element \"face\", of which the header declares 2",
        ),
        (
            ply("element face 1", "element face 1\nelement face 1"),
            "line 9: \"element face 1\" is declared a second time",
        ),
        (
            ply("property double y", "property double x"),
            "line 5: \"property double x\" is declared a second time",
        ),
        (
            ply("element face", "element tristrips"),
            "no element \"face\" among \"vertex\", \"tristrips\"",
        ),
        (
            stl("vertex 0 0 0", "vertex 0 0 x"),
            "the facet that begins in line 2: invalid float literal",
        ),
        (
            stl("endfacet\n", "endfacet\nfast\n"),
            "the facet that begins in line 9: invalid facet header: [\"fast\"]",
        ),
        (
            stl("endsolid", "solid"),
            "line 86: a solid begins within another: no line \"endsolid\"",
        ),
        (
            stl("endsolid cube\n", ""),
            "the last solid has no line \"endsolid\"",
        ),
        (
            stl("endsolid cube\n", "endsolid\nthe end\n"),
            "line 87: \"the end\" outside a solid",
        ),
    ];
    for (result, expected) in cases {
        let message = result.expect_err(expected);
        assert!(
            message.ends_with(expected),
            "{message}\n  wanted {expected}"
        );
        assert!(
            !message.contains('\n') && message.starts_with("mesh m: "),
            "{message}"
        );
    }
}
