use glam::DQuat;

use super::*;
use swell_domain::{mesh::TriangleMesh, particles::Particles, pose::Pose};

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
    let text = String::from_utf8(frame(&shot(), &layers, &way, &[])).unwrap();
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
        is_wet: false,
        paint: None,
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
                material: None,
            },
            WaterPrim {
                name: "whitewater",
                kind: WaterRepresentation::Points { width: None },
                attributes: Vec::new(),
                material: None,
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
        look: None,
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

/// Solids have their wetness in the frames' layers, under the names that the root gives them.
#[test]
fn a_frame_has_the_wetness_of_the_solids_of_its_root() {
    let solid = |is_wet| Solid {
        name: "box".to_owned(),
        mesh: TriangleMesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]],
        },
        way: Vec::new(),
        shapes: Vec::new(),
        is_wet,
        paint: None,
    };
    let of = |solids| Root {
        shot: shot(),
        waters: Vec::new(),
        layers: vec![(7, "s.0007.usda".to_owned())],
        manifest: "s.manifest.usda".to_owned(),
        solids,
        wave_makers: Vec::new(),
        camera: Vec::new(),
        look: None,
    };
    let text = |bytes| String::from_utf8(bytes).unwrap();
    let wet = of(vec![solid(true), solid(true)]);
    for said in [text(root(&wet)), text(manifest(&wet))] {
        assert_eq!(
            said.matches("float[] primvars:wetness").count(),
            2,
            "{said}"
        );
        assert!(
            said.contains("\"box\"") && said.contains("\"box_2\""),
            "{said}"
        );
    }
    let names = solid_names(["box", "box"].into_iter());
    let values = [[0.0, 0.5, 1.0], [0.25; 3]];
    let named: Vec<(String, &[f32])> = (names.into_iter().zip(&values))
        .map(|(name, values)| (name, &values[..]))
        .collect();
    let particles = Particles::default();
    let layer = |wetness: &[(String, &[f32])]| {
        let water = WaterLayer {
            name: "water",
            kind: WaterRepresentation::Points { width: Some(0.2) },
            content: WaterFrame::Points(&particles),
        };
        text(frame(&shot(), &[water], &[], wetness))
    };
    let said = layer(&named);
    let second = said.find("over \"box_2\"").unwrap();
    assert!(said[..second].contains("7: [0, 0.5, 1]"), "{said}");
    assert!(said[second..].contains("7: [0.25, 0.25, 0.25]"), "{said}");
    // Without wetness, nothing is said of it.
    let dry = of(vec![solid(false)]);
    for said in [text(root(&dry)), text(manifest(&dry)), layer(&[])] {
        assert!(
            !said.contains("wetness") && !said.contains("over \"solids\""),
            "{said}"
        );
    }
}

/// Names of prims differ, also from one that a scene gives and that a number would make.
#[test]
fn names_of_solids_differ() {
    let wanted = ["crate", "crate_2", "crate", "crate"];
    let names = solid_names(wanted.into_iter());
    assert_eq!(names, ["crate", "crate_2", "crate_3", "crate_4"]);
}

/// Prims are bound to materials: a mesh to its only one, or subsets of its faces; what the look
/// does not draw is invisible.
#[test]
fn a_root_binds_the_materials_of_its_look() {
    let material = |name: &str, texture: Option<&str>| Material {
        name: name.to_owned(),
        colour: [0.5, 0.25, 1.0],
        texture: texture.map(str::to_owned),
        gloss: None,
    };
    let solid = |of: Vec<usize>, places| Solid {
        name: "box".to_owned(),
        mesh: TriangleMesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]; of.len()],
        },
        way: Vec::new(),
        shapes: Vec::new(),
        is_wet: false,
        paint: Some(Paint { of, places }),
    };
    let of = |wave_makers| Root {
        shot: shot(),
        waters: vec![WaterPrim {
            name: "water",
            kind: WaterRepresentation::Mesh,
            attributes: Vec::new(),
            material: Some(0),
        }],
        layers: vec![(7, "s.0007.usda".to_owned())],
        manifest: "s.manifest.usda".to_owned(),
        solids: vec![
            solid(vec![1, 1], vec![[0.25, 0.5]; 6]),
            solid(vec![2, 1, 2], Vec::new()),
        ],
        wave_makers: vec![WaveMaker {
            name: "wall_minus_x".to_owned(),
            corners: [DVec3::ZERO, DVec3::Y, DVec3::ONE, DVec3::Z],
        }],
        camera: Vec::new(),
        look: Some(LookPrims {
            materials: vec![
                Material {
                    gloss: Some(Gloss {
                        index: 1.333,
                        slope: 0.08,
                    }),
                    ..material("water", None)
                },
                material("stone", Some("s.rock.png")),
                material("stone", None),
            ],
            water: 0,
            whitewater: None,
            wave_makers,
            sun: Sun {
                towards: DVec3::new(0.6, 0.8, 0.0),
                irradiance: [4.0, 2.0, 1.0],
                degrees: 0.5,
            },
            sky: "s.sky.exr".to_owned(),
        }),
    };
    let text = String::from_utf8(root(&of(None))).unwrap();
    for (part, count) in [
        ("rel material:binding = </a_b/materials/water>\n", 1),
        // The first solid, and a subset of the second.
        ("rel material:binding = </a_b/materials/stone>\n", 2),
        ("rel material:binding = </a_b/materials/stone_2>\n", 1),
        ("prepend apiSchemas = [\"MaterialBindingAPI\"]\n", 4),
        ("def GeomSubset \"stone_2\" (\n", 1),
        ("int[] indices = [0, 2]\n", 1),
        ("int[] indices = [1]\n", 1),
        ("subsetFamily:materialBind:familyType = \"partition\"\n", 1),
        (
            "(0.25, 0.5), (0.25, 0.5)] (interpolation = \"faceVarying\")\n",
            1,
        ),
        ("asset inputs:file = @./s.rock.png@\n", 1),
        ("float4 inputs:scale = (0.5, 0.25, 1, 1)\n", 1),
        ("color3f inputs:diffuseColor = (0.5, 0.25, 1)\n", 2),
        ("float inputs:ior = 1.333\n", 1),
        ("float inputs:intensity = 4\n", 1),
        ("color3f inputs:color = (1, 0.5, 0.25)\n", 1),
        // The sun's own +z is towards it.
        ("(0.6, 0.8, 0.0, 0), (0.0, 0.0, 0.0, 1) )\n", 1),
        ("asset inputs:texture:file = @./s.sky.exr@\n", 1),
        // As the test of the light in swell-render has it.
        ("float xformOp:rotateY = 90\n", 1),
        ("token visibility = \"invisible\"\n", 1),
    ] {
        assert_eq!(text.matches(part).count(), count, "{part}: {text}");
    }
    assert_eq!(text.matches('{').count(), text.matches('}').count());
    // α² = 2 · 0.08², and the roughness is √α.
    let roughness = (2f64.sqrt() * 0.08).sqrt() as f32;
    assert!(text.contains(&format!("float inputs:roughness = {roughness}\n")));
    let drawn = String::from_utf8(root(&of(Some(2)))).unwrap();
    assert!(!drawn.contains("invisible"));
    assert_eq!(drawn.matches("materials/stone_2>\n").count(), 2, "{drawn}");
}
