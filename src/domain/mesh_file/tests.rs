use super::super::mesh::tests::cube;
use super::*;

const SQUARE_OBJ: &str = "# a square\nmtllib missing.mtl\nv 0 0 0\nv 2 0 0 0.5 0.5 0.5\n\
    v 2 2 0\nv 0 2 0\nvn 0 0 1\no part\nf 1/1/1 2//1 3 -1\n";
const SQUARE_PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n\
    property double y\nproperty int z\nproperty uchar red\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n0 0 0 255\n2 0 0 255\n2 2 0 255\n\
    0 2 0 255\n4 0 1 2 3\n";

fn parse(format: MeshFormat, bytes: &[u8]) -> Result<TriangleMesh, String> {
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

#[test]
fn a_nameless_text_stl_is_text() {
    let text = String::from_utf8(stl_of(&cube(), true)).expect("text");
    let nameless = text.replacen("solid cube", "solid", 1);
    assert!(parse(MeshFormat::Stl, nameless.as_bytes()).is_ok());
}

/// A sliver is dropped; a closed mesh that was exported inside out is turned; an open one is left as it is.
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
        (obj("v 0 0 0\nf 1 2 0\n"), "line 2: \"0\" names no vertex"),
        (
            obj("v 0 0 0\nf 1 1\n"),
            "line 2: a face needs three corners",
        ),
        (
            obj("v 0 0 0\nf -9223372036854775808 1 1\n"),
            "names no vertex",
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
            "promises 4000000000000",
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
        (ply("not a ply"), "Expected magic number"),
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
    assert!(message.contains("promises"), "{message}");
}
