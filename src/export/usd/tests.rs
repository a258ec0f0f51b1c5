use super::*;
use swell_domain::particles::Particles;

fn shot() -> Shot<'static> {
    Shot {
        source: FileOrigin {
            software: "swell 0",
            shot: "a-b",
            frame: 7,
        },
        frames_per_second: 24.0,
        frames: [7, 9],
        origin: DVec3::ZERO,
    }
}

#[test]
fn names_are_what_usd_takes() {
    assert_eq!(name("wave-city"), "wave_city");
    assert_eq!(name("2nd.try"), "_2nd_try");
    assert_eq!(name(""), "_");
    assert_eq!(quoted("a \"b\""), "\"a \\\"b\\\"\"");
}

#[test]
fn a_frame_says_its_units_and_its_points() {
    let particles = Particles {
        position: vec![[1.0, 2.0, 3.5]],
        velocity: vec![[0.1, 0.0, -1.0]],
        id: vec![5],
        attributes: [("age".to_owned(), vec![0.5])].into(),
        ..Particles::default()
    };
    let kind = WaterRepresentation::Points { width: Some(0.2) };
    let way = [("wall_minus_x".to_owned(), DVec3::X)];
    let layer = |name| WaterLayer {
        name,
        kind,
        content: WaterFrame::Points(&particles),
    };
    let layers = [layer("water"), layer("whitewater")];
    let text = String::from_utf8(frame(&shot(), &layers, &way)).unwrap();
    for part in [
        "metersPerUnit = 1\n",
        "upAxis = \"Y\"",
        "timeCodesPerSecond = 24\n",
        "def Points \"water\"",
        "def Points \"whitewater\"",
        "7: [(1, 2, 3.5)]",
        "7: [(0.1, 0, -1)]",
        "7: [5]",
        "primvars:age.timeSamples",
        "7: (1, 0, 0),",
        "widths = [0.2]",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert_eq!(text.matches('{').count(), text.matches('}').count());
}

#[test]
fn a_root_plays_the_frames_that_it_is_given() {
    let solid = |way| Solid {
        name: "box".to_owned(),
        mesh: TriangleMesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]],
        },
        way,
        shapes: Vec::new(),
    };
    let slid = |way| Pose {
        centre: way,
        ..Pose::START
    };
    // Half a turn about z, about a fixed point.
    let turned = Pose {
        rest: DVec3::X,
        centre: DVec3::X,
        turn: DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0),
    };
    let root_of = Root {
        shot: shot(),
        waters: vec![
            WaterPrim {
                name: "water",
                kind: WaterRepresentation::Mesh,
                attributes: vec!["foam".to_owned()],
            },
            WaterPrim {
                name: "whitewater",
                kind: WaterRepresentation::Points { width: None },
                attributes: Vec::new(),
            },
        ],
        layers: vec![(7, "s.0007.usda".to_owned()), (9, "s.0009.usda".to_owned())],
        manifest: "s.manifest.usda".to_owned(),
        solids: vec![
            solid(Vec::new()),
            solid(vec![(7, slid(DVec3::X)), (9, slid(DVec3::Y))]),
            solid(vec![(7, turned), (9, turned)]),
        ],
        wave_makers: Vec::new(),
        camera: Vec::new(),
    };
    let text = String::from_utf8(root(&root_of)).unwrap();
    for part in [
        "active = [(7, 0), (9, 1)]",
        "assetPaths = [@./s.0007.usda@, @./s.0009.usda@]",
        "times = [(7, 7), (9, 9)]",
        "primPath = \"/a_b\"",
        "def Mesh \"water\"",
        "float[] primvars:foam (interpolation = \"vertex\")",
        "def Points \"whitewater\"",
        "float[] widths (interpolation = \"vertex\")",
        "def Mesh \"box\"",
        "def Mesh \"box_2\"",
        "9: (0, 1, 0),",
        "9: (0, 0, 0, 1),",
        "double3 xformOp:translate:rest = (-1, 0, 0)",
        "[\"xformOp:translate\", \"xformOp:orient\", \"xformOp:translate:rest\"]",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("Camera") && !text.contains("wave_makers"));
    // USD's grammar: a name with an @ is enclosed in three, and @@@ within it is escaped by
    // a backslash.
    let told = |file: &str| {
        let named = Root {
            layers: vec![(7, file.to_owned())],
            manifest: file.to_owned(),
            ..root_of.clone()
        };
        String::from_utf8(root(&named)).unwrap()
    };
    for (file, wanted) in [
        ("s@1.0007.usd", "@@@./s@1.0007.usd@@@"),
        ("s@@@@.0007.usda", "@@@./s\\@@@@.0007.usda@@@"),
    ] {
        let text = told(file);
        for part in [
            format!("assetPaths = [{wanted}]\n"),
            format!("manifestAssetPath = {wanted}\n"),
        ] {
            assert!(text.contains(&part), "{part}: {text}");
        }
    }
    let text = String::from_utf8(manifest(&root_of)).unwrap();
    assert_eq!(text.matches("point3f[] points\n").count(), 2, "{text}");
}
