//! Layers of other programs, compared with the matrices of usd-core 26.11
//! (ComputeLocalToWorldTransform).

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use glam::DVec3;

use super::super::camera_file::{CameraFileError, read};
use swell_scene::look::{FitSpec, Framing, camera_file::CameraFile};

/// A camera under an empty as written by Blender 4.5.15, without its own metadata.
const BLENDER: &str = include_str!("blender.usda");

/// A camera with focus and a shifted film, both animated, as written by Blender 4.5.15.
const LENS: &str = include_str!("blender_lens.usda");

/// By usd-core 26.11: operations of every kind that other programs write, centimetres, y up.
const OPERATIONS: &str = r#"#usda 1.0
(
    defaultPrim = "a"
    metersPerUnit = 0.01
    timeCodesPerSecond = 25
    upAxis = "Y"
)

def Xform "a"
{
    quatf xformOp:orient = (0.9238795, 0, 0.3826834, 0)
    float xformOp:rotateY = 30
    float3 xformOp:scale = (1.5, 1.5, 1.5)
    double3 xformOp:translate = (100, 20, -30)
    double3 xformOp:translate:pivot = (5, 6, 7)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY", "xformOp:translate:pivot", "xformOp:orient", "!invert!xformOp:translate:pivot", "xformOp:scale"]

    def Xform "b"
    {
        float xformOp:rotateX = 5
        float3 xformOp:rotateZYX = (10, 20, 30)
        uniform token[] xformOpOrder = ["xformOp:rotateZYX", "xformOp:rotateX"]

        def Camera "cam"
        {
            float focalLength = 50
            float horizontalAperture = 36
            float verticalAperture = 20.25
            matrix4d xformOp:transform.timeSamples = {
                0: ( (1, 0, 0, 0), (0, 0.984807753012208, -0.17364817766693033, 0), (0, 0.17364817766693033, 0.984807753012208, 0), (0, 0, 50, 1) ),
                10: ( (1, 0, 0, 0), (0, 0.9396926207859084, -0.34202014332566877, 0), (0, 0.34202014332566877, 0.9396926207859084, 0), (10, 20, 50, 1) ),
            }
            uniform token[] xformOpOrder = ["xformOp:transform"]
        }
    }
}
"#;

/// Framing of an image as high as the film.
fn framing() -> Framing {
    Framing::new(FitSpec::Height, [16, 9])
}

fn camera(text: &str, name: Option<&str>) -> Result<CameraFile, CameraFileError> {
    read(text.as_bytes(), name, &|_| {
        unreachable!("USD names no files here")
    })
}

/// Second, third and last row of the matrix at a time code: up, back and position.
type Row = (f64, [f64; 3], [f64; 3], [f64; 3]);

fn assert_stands(
    camera: &CameraFile,
    per_second: f64,
    rows: &[Row],
    to_world: impl Fn(DVec3) -> DVec3,
) {
    for (code, up, back, place) in rows {
        let [up, back, place] = [up, back, place].map(|row| to_world(DVec3::from(*row)));
        let stand = camera.at(code / per_second);
        // OpenUSD stores most numbers in 32 bits.
        assert!(
            (stand.position - place).length() < 1e-6,
            "{code}: {}",
            stand.position
        );
        assert!(
            (stand.forward + back.normalize()).length() < 1e-6,
            "{code}: {}",
            stand.forward
        );
        let upright = up - up.project_onto(back);
        assert!(
            (stand.up - upright.normalize()).length() < 1e-6,
            "{code}: {}",
            stand.up
        );
    }
}

#[test]
fn a_camera_of_blender_stands_where_usd_says() {
    let camera = camera(BLENDER, None).unwrap();
    let rows: [Row; 4] = [
        (
            0.0,
            [0.058024062, 0.536472493, 1.92583255],
            [1.175150032, -1.567788006, 0.401326691],
            [3.912067407, -5.682172509, 4.517927504],
        ),
        (
            2.5,
            [0.113200129, 0.54350218, 1.921403561],
            [1.188694991, -1.564672961, 0.37256233],
            [4.272478226, -5.625546798, 4.977741366],
        ),
        (
            5.0,
            [0.226199657, 0.55843811, 1.907087077],
            [1.212170606, -1.559714245, 0.312943843],
            [5.010462718, -5.509599309, 5.919264969],
        ),
        (
            7.0,
            [0.226199657, 0.55843811, 1.907087077],
            [1.212170606, -1.559714245, 0.312943843],
            [5.010462718, -5.509599309, 5.919264969],
        ),
    ];
    // Blender's z axis is up.
    assert_stands(&camera, 24.0, &rows, |v| DVec3::new(v.x, v.z, -v.y));
    // A zoom from 36 to 40 mm on a film 20.25 mm high, compared with usd-core's fields of view:
    // 31.4173° at first, 30.3640° at 2.5.
    for (code, focal, yfov) in [
        (1.0, 36.0, 31.417_274_5),
        (2.5, 37.3125, 30.364_011_8),
        (5.0, 40.0, 28.409_271_2f64),
    ] {
        let found = camera.focal_length_mm(&framing(), 20.25, code / 24.0);
        assert!((found - focal).abs() < 1e-4, "{code}: {found}");
        assert!((found - 10.125 / (0.5 * yfov.to_radians()).tan()).abs() < 1e-4);
    }
    assert!((camera.longest_focal_length_mm(&framing(), 20.25) - 40.0).abs() < 1e-4);
    assert!((camera.aspect_ratio().unwrap() - 16.0 / 9.0).abs() < 1e-6);
    // Control: with y up the pose differs.
    let other = read(
        BLENDER
            .replace("upAxis = \"Z\"", "upAxis = \"Y\"")
            .as_bytes(),
        None,
        &|_| unreachable!(),
    );
    assert!((other.unwrap().at(0.0).position - camera.at(0.0).position).length() > 1.0);
}

#[test]
fn operations_are_those_of_usd() {
    let found = camera(OPERATIONS, Some("/a/b/cam")).unwrap();
    let rows: [Row; 3] = [
        (
            0.0,
            [0.149995052, 1.251393361, 0.813336425],
            [1.492359438, -0.136216092, -0.065639036],
            [171.956590338, 2.427557978, -33.713736131],
        ),
        (
            5.0,
            [0.019282923, 1.253714461, 0.81285727],
            [1.494046476, -0.02653029, 0.00547676],
            [176.120705732, 18.593626127, -32.111118397],
        ),
        (
            10.0,
            [-0.111429206, 1.25603556, 0.812378116],
            [1.495733513, 0.083155513, 0.076592557],
            [180.284821126, 34.759694275, -30.508500663],
        ),
    ];
    assert_stands(&found, 25.0, &rows, |v| 0.01 * v);
    // Control: without the inverse pivot the pose differs.
    let other = camera(&OPERATIONS.replace("!invert!", ""), None).unwrap();
    assert!((other.at(0.0).position - found.at(0.0).position).length() > 1e-2);
}

/// Compared with the positions of three points in the camera's picture in Blender
/// (`world_to_camera_view`), and with its lens settings.
#[test]
fn a_lens_and_a_shift_of_blender_are_read() {
    let camera = camera(LENS, None).unwrap();
    let place = |point: [f64; 3], code: f64| {
        let stand = camera.at(code / 24.0);
        // Blender's z axis is up.
        let away = DVec3::new(point[0], point[2], -point[1]) - stand.position;
        let right = stand.forward.cross(stand.up);
        // In heights of the picture.
        let focal = camera.focal_length_mm(&framing(), 1.0, code / 24.0);
        let [x, y] = camera.shift(&framing(), code / 24.0);
        let part = |axis: DVec3| focal * away.dot(axis) / away.dot(stand.forward);
        let [across, up] = [part(right) - x, part(stand.up) - y];
        [0.5 + across * 9.0 / 16.0, 0.5 + up]
    };
    for (code, point, at) in [
        (1.0, [1.0, 0.0, 2.0], [0.574_073_553, 0.893_651_664]),
        (1.0, [0.3, 0.0, 1.2], [0.434_046_894, 0.618_771_851]),
        (1.0, [2.0, 1.0, 3.0], [0.759_928_524, 1.214_242_247]),
        (5.0, [1.0, 0.0, 2.0], [0.474_073_589, 0.893_651_664]),
        (5.0, [2.0, 1.0, 3.0], [0.659_928_501, 1.214_242_247]),
    ] {
        let found = place(point, code);
        let off = [0, 1].map(|axis| (found[axis] - at[axis]).abs());
        assert!(off[0] < 1e-5 && off[1] < 1e-5, "{code}: {found:?} {at:?}");
    }
    for (code, focus) in [(1.0, 6.5), (3.0, 7.5), (5.0, 8.5)] {
        let [f_stop, found] = camera.lens(code / 24.0).unwrap();
        assert!(f_stop == 4.0 && (found - focus).abs() < 1e-6, "{found}");
    }
    // The focus distance is a length of the layer; the f-number is not.
    let small = LENS.replace("metersPerUnit = 1", "metersPerUnit = 0.01");
    let small = self::camera(&small, None).unwrap();
    let [f_stop, focus] = small.lens(1.0 / 24.0).unwrap();
    assert!(f_stop == 4.0 && (focus - 0.065).abs() < 1e-9, "{focus}");
    let shift = |camera: &CameraFile| camera.shift(&framing(), 0.0);
    assert_eq!(shift(&small), shift(&camera));
    // A camera without these attributes is a pinhole, centred on its film.
    let plain = self::camera(BLENDER, None).unwrap();
    assert!(plain.lens(0.0).is_none() && shift(&plain) == [0.0; 2]);
}

/// Content from other layers is not read, so a file that relies on it yields no camera.
#[test]
fn a_camera_that_is_written_elsewhere_too_is_refused() {
    let with = |metadata: &str| {
        let from = "def Xform \"b\"\n    {";
        assert!(OPERATIONS.contains(from));
        OPERATIONS.replace(
            from,
            &format!("def Xform \"b\" (\n{metadata}\n    )\n    {{"),
        )
    };
    let sub = OPERATIONS.replace(
        "upAxis",
        "subLayers = [\n        @anim.usda@,\n        @set.usda@\n    ]\n    upAxis",
    );
    let within = OPERATIONS.replace(
        "def Camera \"cam\"\n        {",
        "variantSet \"lens\" = {\n \"wide\" {\n float focalLength = 20\n }\n }\n \
         def Camera \"cam\"\n        {",
    );
    let other = OPERATIONS.replace(
        "def Xform \"a\"",
        "def Xform \"set\" (\n    prepend references = @set.usda@</set>\n)\n{\n}\n\n\
         def Xform \"a\"",
    );
    for (text, name, words) in [
        (&sub, None, "subLayers: anim.usda, set.usda"),
        (
            &with("prepend references = @rig.usda@</rig>"),
            None,
            "prim /a/b takes parts from elsewhere, which are not read (references)",
        ),
        (&with("payload = @rig.usda@"), None, "(payload)"),
        (&with("prepend inherits = </_class>"), None, "(inherits)"),
        (&with("specializes = </_class>"), None, "(specializes)"),
        (
            &with("prepend variantSets = \"lens\""),
            None,
            "(variantSets)",
        ),
        (&within, None, "(variantSets)"),
        // A camera that is not in the text may be where a prim takes parts from.
        (
            &other,
            Some("other"),
            "prim /set takes parts from elsewhere",
        ),
    ] {
        let error = camera(text, name).unwrap_err().to_string();
        assert!(
            error.contains(words) && error.contains("usdcat --flatten"),
            "{words}: {error}"
        );
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    // Arcs of other prims do not affect the camera, and a class is no camera.
    let class = OPERATIONS.replace(
        "def Xform \"a\"",
        "class Camera \"_lens\"\n{\n}\n\ndef Xform \"a\"",
    );
    for text in [&other, &class, &with("kind = \"group\"")] {
        let found = camera(text, None).unwrap();
        assert_eq!(found.at(0.0), camera(OPERATIONS, None).unwrap().at(0.0));
    }
}

#[test]
fn what_gives_no_camera_says_why() {
    let two = BLENDER.replace(
        "def Xform \"plan\"\n    {",
        "def Xform \"plan\"\n    {\n        def Camera \"second\"\n        {\n        }\n",
    );
    assert!(camera(&two, Some("shot_010")).is_ok() && camera(&two, Some("second")).is_ok());
    let without = OPERATIONS.replace("def Camera", "def Xform");
    let deep = format!("#usda 1.0\n{}", "def Xform \"a\" {\n".repeat(400));
    for (text, name, words) in [
        ("PXR-USDC\0\0", None, "usdcat shot.usdc -o shot.usda"),
        ("PK\x03\x04", None, "a USD package"),
        (
            two.as_str(),
            None,
            "2 cameras: /root/plan/second, /root/rig/shot_010/lens",
        ),
        (BLENDER, Some("gate"), "no camera is called \"gate\""),
        (&without, None, "none of its prims is a Camera"),
        (
            &OPERATIONS.replace("rotateZYX = (10, 20, 30)", "rotateZYX = (10, 20)"),
            None,
            "not 3 numbers",
        ),
        (
            &OPERATIONS.replace("xformOp:rotateX\"", "xformOp:shear\""),
            None,
            "not a known transform",
        ),
        (
            &OPERATIONS.replace("float focalLength = 50", "float focalLength = 0"),
            None,
            "focalLength",
        ),
        (
            &OPERATIONS.replace("float focalLength", "float fStop = 2.8\nfloat focalLength"),
            None,
            "focusDistance of /a/b/cam is not a positive number",
        ),
        (
            &OPERATIONS.replace(
                "float focalLength",
                "float fStop.timeSamples = { 0: 0, 5: 2.8 }\nfloat focalLength",
            ),
            None,
            "fStop of /a/b/cam is not a positive number",
        ),
        (
            &OPERATIONS.replace("upAxis = \"Y\"", "upAxis = \"X\""),
            None,
            "neither Y nor Z",
        ),
        (
            &OPERATIONS.replace(
                "float focalLength",
                "token projection = \"orthographic\"\nfloat focalLength",
            ),
            None,
            "orthographic",
        ),
        (&OPERATIONS[..OPERATIONS.len() - 3], None, "ends too early"),
        (&deep, None, "prims within prims"),
        (
            &OPERATIONS.replace("float focalLength = 50", "float focalLength = 5.0.0"),
            None,
            "line 26: \"5.0.0\" is not a number",
        ),
    ] {
        let error = camera(text, name).err().map(|error| error.to_string());
        let error = error.unwrap_or_else(|| panic!("{words}"));
        assert!(error.contains(words), "{words}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
