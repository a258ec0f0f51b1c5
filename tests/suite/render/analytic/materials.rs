//! Colours and textures on solids: texel by texel, with both methods.

use std::path::Path;

use glam::{DVec2, DVec3};
use swell::{
    domain::mesh::TriangleMesh,
    domain::mesh_file::{MeshFormat, parts::MeshParts},
    domain::{particles::Particles, pose::Pose},
    files::parse_look,
    gpu::adapter::Context,
    render::{FrameInputs, Image, RenderError, RenderScene, Renderer, SolidParts, WaterParticles},
    scene::look::Look,
};

use super::support::{Eye, Setup, context, scene, spoiled, uniform_sky, write_sky};

const METHODS: [(&str, &str); 2] = [("ssfr", "ssfr/shade"), ("ray", "rays/cast")];

/// Centre of the faces, their width, and the distance of the eye from them, m.
const MIDDLE: DVec3 = DVec3::splat(5.0);
const WIDTH: f64 = 4.0;

/// Relative error of a texel's half-precision float; and error of positions and weights in single
/// precision, for texels of 1 m whose values differ by up to 1.
const HALF: f64 = 1.0 / 2048.0;
const PLACES: f64 = 1e-4;

/// A face that fills the picture: its right and up directions as seen from the eye.
struct Face {
    right: DVec3,
    up: DVec3,
}

const FACES: [Face; 3] = [
    Face::new(DVec3::X, DVec3::Y),
    Face::new(DVec3::NEG_Z, DVec3::Y),
    Face::new(DVec3::X, DVec3::NEG_Z),
];

impl Face {
    const fn new(right: DVec3, up: DVec3) -> Self {
        Self { right, up }
    }

    fn normal(&self) -> DVec3 {
        self.right.cross(self.up)
    }

    fn eye(&self) -> Eye {
        let position = MIDDLE + WIDTH * self.normal();
        Eye {
            up: self.up,
            ..Eye::new(position.to_array(), MIDDLE.to_array(), 64.0)
        }
    }

    /// OBJ text of two halves, left and right of the middle, with texture coordinates.
    fn text(&self) -> String {
        let half = 0.5 * WIDTH;
        let mut text = String::from("o face\n");
        for y in [0.0, 1.0] {
            for x in [0.0, 0.5, 1.0] {
                let p =
                    MIDDLE + self.right * (2.0 * x - 1.0) * half + self.up * (2.0 * y - 1.0) * half;
                text += &format!("v {} {} {}\nvt {x} {y}\n", p.x, p.y, p.z);
            }
        }
        text + "g left\nusemtl one\nf 1/1 2/2 5/5 4/4\ng right\nusemtl two\nf 2/2 3/3 6/6 5/5\n"
    }

    /// Points on the face at the centres of the pixels, m.
    fn places(&self) -> impl Iterator<Item = DVec3> {
        let eye = self.eye();
        (0..64 * 64).map(move |i| {
            let direction = eye.direction(i);
            eye.position + direction * (WIDTH / -direction.dot(self.normal()))
        })
    }
}

fn of_text(text: &str) -> RenderScene {
    let (bytes, file) = (text.as_bytes(), Path::new("face.obj"));
    RenderScene {
        solids: vec![TriangleMesh::from_bytes(bytes, MeshFormat::Obj, file).unwrap()],
        parts: vec![SolidParts {
            name: "face".to_owned(),
            parts: MeshParts::from_bytes(bytes, MeshFormat::Obj, file).unwrap(),
            pose: Pose::START,
        }],
        ..scene(1.0, 1.0)
    }
}

/// A PNG with these texels, rows from the top.
fn png(side: u32, texel: impl Fn(u32, u32) -> [u8; 3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side, side);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let texels: Vec<u8> = (0..side * side)
        .flat_map(|k| texel(k % side, k / side))
        .collect();
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&texels).unwrap();
    writer.finish().unwrap();
    bytes
}

/// Four by four texels, all different, so that mirroring or rotation is detected.
fn code(x: u32, y: u32) -> [u8; 3] {
    let k = 4 * y + x;
    [(17 * k) as u8, (255 - 13 * k) as u8, (97 * k % 256) as u8]
}

/// Linear value of an sRGB code (IEC 61966-2-1).
fn linear(code: u8) -> f64 {
    let code = f64::from(code) / 255.0;
    match code <= 0.04045 {
        true => code / 12.92,
        false => ((code + 0.055) / 1.055).powf(2.4),
    }
}

/// The texture of [`code`] at texture coordinates, rows from the bottom, bilinear and repeated.
fn expected(place: DVec2) -> [f64; 3] {
    let p = DVec2::new(place.x, 1.0 - place.y) * 4.0 - 0.5;
    let (low, part) = (p.floor(), p - p.floor());
    let texel = |x: f64, y: f64| {
        let wrapped = |k: f64| k.rem_euclid(4.0) as u32;
        code(wrapped(x), wrapped(y)).map(linear)
    };
    [0, 1, 2].map(|c: usize| {
        let row = |y: f64| {
            let (a, b) = (texel(low.x, y)[c], texel(low.x + 1.0, y)[c]);
            a + (b - a) * part.x
        };
        row(low.y) + (row(low.y + 1.0) - row(low.y)) * part.y
    })
}

struct Shown<'a> {
    eye: Eye,
    method: &'static str,
    /// Lines and tables of `[solids]`.
    solids: &'a str,
    files: &'a [(&'a str, Vec<u8>)],
    scene: &'a RenderScene,
    samples: u32,
}

impl Shown<'_> {
    fn look(&self, folder: &Path) -> Look {
        let setup = Setup {
            method: self.method,
            samples: self.samples,
            ..Setup::new(self.eye)
        };
        write_sky(&folder.join("sky.exr"), &uniform_sky);
        for (name, bytes) in self.files {
            std::fs::write(folder.join(name), bytes).unwrap();
        }
        let text = setup.text();
        let text = text.replacen("[output]\n", &format!("{}\n[output]\n", self.solids), 1);
        parse_look(&text, &folder.join("look.toml")).unwrap()
    }

    fn image(&self, context: &Context) -> Result<Image, Box<(RenderError, Look)>> {
        let folder = tempfile::tempdir().unwrap();
        let look = self.look(folder.path());
        let mut renderer = Renderer::new(context, &look, self.scene)
            .map_err(|error| Box::new((error, look.clone())))?;
        let water = WaterParticles::new(Particles::default());
        Ok(renderer
            .render_inputs(1, &FrameInputs::alone(&water, &Particles::default()))
            .unwrap())
    }

    /// Reflectance of each pixel: the picture divided by one of the same faces in white.
    fn reflectance(&self, context: &Context) -> Vec<[f64; 3]> {
        let white = Shown {
            solids: "",
            ..*self
        };
        let picture = |shown: &Shown<'_>, context: &Context| shown.image(context).unwrap().beauty;
        let (own, white) = (picture(self, context), picture(&white, &super::context()));
        let pairs = own.iter().zip(&white);
        pairs
            .map(|(a, b)| [0, 1, 2].map(|c: usize| f64::from(a[c]) / f64::from(b[c])))
            .collect()
    }
}

fn worst(found: &[[f64; 3]], expected: impl Iterator<Item = [f64; 3]>) -> f64 {
    let pairs = found.iter().zip(expected);
    pairs
        .flat_map(|(a, b)| [0, 1, 2].map(|c: usize| (a[c] - b[c]).abs()))
        .fold(0.0, f64::max)
}

const MIRRORED: (&str, &str) = (
    "let p = fract(at) * vec2f(size) - 0.5;",
    "let p = fract(vec2f(at.x, 1.0 - at.y)) * vec2f(size) - 0.5;",
);

#[test]
fn a_picture_lies_as_its_coordinates_say() {
    let face = &FACES[0];
    let scene = of_text(&face.text());
    let files = [("a.png", png(4, code))];
    let place = |p: DVec3| DVec2::new(p.x - 3.0, p.y - 3.0) / WIDTH;
    for (method, pass) in METHODS {
        let shown = Shown {
            eye: face.eye(),
            method,
            solids: "[[solids.material]]\nname = \"face\"\ntexture = { file = \"a.png\" }",
            files: &files,
            scene: &scene,
            samples: 1,
        };
        let error = |context: &Context| {
            let all = face.places().map(|p| expected(place(p)));
            worst(&shown.reflectance(context), all)
        };
        let off = error(&context());
        assert!(off < HALF + PLACES, "{method}: {off}");
        let off = error(&spoiled(pass, MIRRORED.0, MIRRORED.1));
        assert!(off > 0.5, "{method}, the control: {off}");
    }
}

#[test]
fn a_library_scales_and_colours_its_picture() {
    let face = &FACES[0];
    let scene = of_text(&face.text());
    let library =
        "newmtl one\nKd 0.5 0.25 1\nmap_Kd -s 2 1 1 -o 0.25 a.png\nnewmtl two\nKd 0.125 0.5 0.75\n";
    let files = [("a.png", png(4, code)), ("a.mtl", library.into())];
    let wanted = |p: DVec3| {
        if p.x > MIDDLE.x {
            return [0.125, 0.5, 0.75];
        }
        let place = DVec2::new((p.x - 3.0) / WIDTH * 2.0 + 0.25, (p.y - 3.0) / WIDTH);
        let [r, g, b] = expected(place);
        [0.5 * r, 0.25 * g, b]
    };
    for (method, _) in METHODS {
        let shown = Shown {
            eye: face.eye(),
            method,
            solids: "materials = \"a.mtl\"",
            files: &files,
            scene: &scene,
            samples: 1,
        };
        let off = worst(&shown.reflectance(&context()), face.places().map(wanted));
        // A texel is half a metre wide along u.
        assert!(off < HALF + 2.0 * PLACES, "{method}: {off}");
        let swapped = library.replace("one", "three").replace("two", "one");
        let files = [("a.png", png(4, code)), ("a.mtl", swapped.into())];
        let control = Shown {
            files: &files,
            ..shown
        };
        let off = worst(&control.reflectance(&context()), face.places().map(wanted));
        assert!(off > 0.2, "{method}, the control: {off}");
    }
}

#[test]
fn the_narrowest_name_counts_and_the_looks_own_comes_first() {
    let face = &FACES[0];
    let scene = of_text(&face.text());
    let files = [(
        "a.mtl",
        b"newmtl one\nKd 0.5\nnewmtl left\nKd 0.9\n".to_vec(),
    )];
    let shown = Shown {
        eye: face.eye(),
        method: "ray",
        solids: "materials = \"a.mtl\"\n\
            [[solids.material]]\nname = \"face\"\ncolour = [0.25, 0.25, 0.25]\n\
            [[solids.material]]\nname = \"right\"\ncolour = [0.75, 0.75, 0.75]",
        files: &files,
        scene: &scene,
        samples: 1,
    };
    let wanted = |p: DVec3| [if p.x < MIDDLE.x { 0.5 } else { 0.75 }; 3];
    let found = shown.reflectance(&context());
    let off = worst(&found, face.places().map(wanted));
    assert!(off < 1e-5, "{off}");
}

#[test]
fn a_picture_is_laid_on_along_axes() {
    let files = [("a.png", png(4, code))];
    for face in &FACES {
        let scene = of_text(&face.text());
        let place = |p: DVec3| DVec2::new(p.dot(face.right), p.dot(face.up)) / WIDTH;
        let named =
            "[[solids.material]]\nname = \"face\"\ntexture = { file = \"a.png\", metres = 4.0 }";
        // Applied to everything without a material.
        let on_all = "texture = { file = \"a.png\", metres = 4.0 }";
        for ((method, pass), solids) in METHODS
            .into_iter()
            .flat_map(|it| [(it, named), (it, on_all)])
        {
            let shown = Shown {
                eye: face.eye(),
                method,
                solids,
                files: &files,
                scene: &scene,
                samples: 1,
            };
            let error = |context: &Context| {
                let all = face.places().map(|p| expected(place(p)));
                worst(&shown.reflectance(context), all)
            };
            let off = error(&context());
            assert!(off < HALF + PLACES, "{method} {}: {off}", face.normal());
            let off = error(&spoiled(pass, MIRRORED.0, MIRRORED.1));
            assert!(off > 0.5, "{method}, the control: {off}");
        }
    }
}

/// A wall of the basin has a texture as a solid has, multiplied by its colour.
#[test]
fn a_picture_is_laid_on_walls() {
    let files = [("a.png", png(4, code))];
    let scene = scene(1.0, 1.0);
    let eye = Eye::new([5.0, 5.0, 4.0], [5.0, 5.0, 0.0], 64.0);
    // The wall is slightly outside the domain's side.
    let far = 4.0 + 0.006 * scene.particle_spacing;
    let all = |half: f64| {
        let places = (0..64 * 64).map(|i| {
            let direction = eye.direction(i);
            eye.position + direction * (far / -direction.z)
        });
        let colours: Vec<_> = places
            .map(|p| expected(DVec2::new(p.x, p.y) / 4.0).map(|c| half * c))
            .collect();
        colours.into_iter()
    };
    for (method, pass) in METHODS {
        let picture = |lines: &str, context: &Context| {
            let solids = format!("[basin]\nheight_m = 10.0\nsides = [\"-z\"]\n{lines}");
            let shown = Shown {
                eye,
                method,
                solids: &solids,
                files: &files,
                scene: &scene,
                samples: 1,
            };
            shown.image(context).unwrap().beauty
        };
        let white = picture("colour = [1.0, 1.0, 1.0]", &context());
        let found = |context: &Context| {
            let lines = "colour = [0.5, 0.5, 0.5]\ntexture = { file = \"a.png\", metres = 4.0 }";
            let own = picture(lines, context);
            let pairs = own.iter().zip(&white);
            let part = |(a, b): (&[f32; 4], &[f32; 4])| {
                [0, 1, 2].map(|c: usize| f64::from(a[c]) / f64::from(b[c]))
            };
            pairs.map(part).collect::<Vec<_>>()
        };
        let off = worst(&found(&context()), all(0.5));
        assert!(off < HALF + PLACES, "{method}: {off}");
        let off = worst(&found(&spoiled(pass, MIRRORED.0, MIRRORED.1)), all(0.5));
        assert!(off > 0.2, "{method}, the control: {off}");
    }
}

/// Texels of 1/128 m, alternating between black and white: a pixel covers eight along each side,
/// and many more at a slant.
#[test]
fn a_far_checker_is_its_mean() {
    let files = [(
        "a.png",
        png(64, |x, y| [if (x + y) % 2 == 0 { 255 } else { 0 }; 3]),
    )];
    let face = &FACES[0];
    let scene = of_text(&face.text());
    let slanted = Eye::new([2.0, 5.0, 5.6], MIDDLE.to_array(), 64.0);
    for eye in [face.eye(), slanted] {
        for (method, pass) in METHODS {
            let shown = Shown {
                eye,
                method,
                solids: "[[solids.material]]\nname = \"face\"\n\
                         texture = { file = \"a.png\", metres = 0.5 }",
                files: &files,
                scene: &scene,
                samples: 1,
            };
            let error = |context: &Context| {
                let found = shown.reflectance(context);
                // Outside the face both pictures are the same.
                let on_face = found.into_iter().filter(|it| it[0] < 0.9999);
                let off: Vec<f64> = on_face.map(|it| (it[0] - 0.5).abs()).collect();
                assert!(off.len() > 100, "{}", off.len());
                off.into_iter().fold(0.0, f64::max)
            };
            let off = error(&context());
            assert!(off < HALF, "{method}: {off}");
            let whole = "let level = clamp(log2(max(width, 1.0)), 0.0, f32(material.levels - 1u));";
            let off = error(&spoiled(pass, whole, "let level = 0.0 * width;"));
            assert!(off > 0.2, "{method}, the control: {off}");
        }
    }
}

/// With four samples or more, each sample reads one of the two mip levels and a part of the taps;
/// their mean equals what each would compute by itself.
#[test]
fn samples_share_what_one_would_look_up() {
    const SAMPLES: u32 = 16;
    let files = [("ramp.png", png(64, |_, y| [(4 * y) as u8; 3]))];
    let face = &FACES[0];
    let scene = of_text(&face.text());
    let slanted = Eye::new([2.0, 5.0, 5.6], MIDDLE.to_array(), 64.0);
    for (method, pass) in METHODS {
        let picture = |eye, metres: f64, samples, context: &Context| {
            let texture = format!("texture = {{ file = \"ramp.png\", metres = {metres:?} }}");
            let shown = Shown {
                eye,
                method,
                solids: &format!("[[solids.material]]\nname = \"face\"\n{texture}"),
                files: &files,
                scene: &scene,
                samples,
            };
            let found = shown.reflectance(context).into_iter();
            found.map(|it| it[0]).collect::<Vec<f64>>()
        };
        // The base level is black, and the next one white.
        let (from, to) = ("mix(above, below, part.y)", "vec3f(f32(size.x == 32u))");
        let levels = spoiled(pass, from, to);
        for part in [0.25, 0.5, 0.8f64] {
            // A pixel in the middle is a sixteenth of a metre, and a texel 2^-part of that.
            let metres = 64.0 / 16.0 / part.exp2();
            let seen = |samples| picture(face.eye(), metres, samples, &levels)[32 * 64 + 32];
            assert!((seen(1) - part).abs() < 1e-3, "{method}: {}", seen(1));
            let found = seen(SAMPLES);
            assert!(
                (found - part).abs() < 1.0 / f64::from(SAMPLES),
                "{method}: {found}, not {part}"
            );
        }
        // Along a slant the mean of a ramp is its middle value.
        let ramp = |context: &Context| picture(slanted, 4.0, SAMPLES, context);
        let each = ramp(&spoiled(pass, "ceil(taps / samples)", "taps"));
        let off = |found: &[f64]| {
            let sum: f64 = found.iter().zip(&each).map(|(a, b)| a - b).sum();
            (sum / found.len() as f64).abs()
        };
        let found = off(&ramp(&context()));
        assert!(found < 2e-4, "{method}: {found}");
        let (from, to) = ("(k + part) / own - 0.5", "(k + part) / own");
        let found = off(&ramp(&spoiled(pass, from, to)));
        assert!(found > 1e-3, "{method}, the control: {found}");
    }
}

#[test]
fn materials_that_nothing_has_are_refused_with_their_key() {
    let face = &FACES[0];
    let scene = of_text(&face.text());
    let files = [
        ("a.png", png(4, code)),
        ("a.mtl", b"newmtl elsewhere\nKd 0.5\n".to_vec()),
        ("b.mtl", b"newmtl two\nmap_Kd a.png\n".to_vec()),
    ];
    let fault = |solids: &str, scene: &RenderScene| {
        let shown = Shown {
            eye: face.eye(),
            method: "ssfr",
            solids,
            files: &files,
            scene,
            samples: 1,
        };
        let (error, look) = *shown.image(&context()).err()?;
        let RenderError::Material { index, problem } = error else {
            panic!("{error}");
        };
        Some(look.material_fault(index, &problem).unwrap().to_string())
    };
    let named = |name: &str| format!("[[solids.material]]\nname = \"{name}\"\n");
    let error = fault(&(named("one") + &named("onne")), &scene).unwrap();
    for words in [
        "solids.material[1].name",
        "no part of the scene's solids is called \"onne\"; there are: face, left, one, right, two",
    ] {
        assert!(error.contains(words), "{error}");
    }
    let error = fault("materials = \"a.mtl\"", &scene).unwrap();
    assert!(
        error.contains("solids.materials") && error.contains("face, left"),
        "{error}"
    );
    let bare = of_text(&face.text().replace("2/2 3/3 6/6 5/5", "2 3 6 5"));
    let error = fault("materials = \"b.mtl\"", &bare).unwrap();
    assert!(
        error.contains("b.mtl line 1") && error.contains("(vt)"),
        "{error}"
    );
    // Control.
    assert_eq!(fault("materials = \"b.mtl\"", &scene), None);
    assert_eq!(fault(&named("one"), &scene), None);
}

#[test]
fn files_that_cannot_be_used_are_refused_with_their_key() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("in")).unwrap();
    let inside = |name: &str| folder.path().join("in").join(name);
    std::fs::write(inside("a.png"), png(4, code)).unwrap();
    std::fs::write(folder.path().join("out.png"), png(4, code)).unwrap();
    std::fs::write(inside("no.png"), b"no picture").unwrap();
    std::fs::write(inside("cut.png"), &png(4, code)[..60]).unwrap();
    for (name, text) in [
        ("good.mtl", "newmtl a\nmap_Kd a.png\n"),
        ("bad.mtl", "newmtl a\nKd red\n"),
        ("no.mtl", "newmtl a\n\nmap_Kd no.png\n"),
        ("out.mtl", "newmtl a\nmap_Kd ../out.png\n"),
    ] {
        std::fs::write(inside(name), text).unwrap();
    }
    let look = |solids: &str| {
        let setup = Setup {
            sky: "model = \"hosek_wilkie\"\n".to_owned(),
            ..Setup::new(FACES[0].eye())
        };
        let text = setup.text();
        let text = text.replacen("[output]\n", &format!("{solids}\n[output]\n"), 1);
        parse_look(&text, &inside("look.toml"))
    };
    let texture = |file: &str| {
        format!(
            "[[solids.material]]\nname = \"a\"\ntexture = {{ file = \"{file}\", metres = 1.0 }}"
        )
    };
    for (solids, words) in [
        (
            "materials = \"none.mtl\"".to_owned(),
            ["solids.materials", "cannot read"],
        ),
        (
            "materials = \"bad.mtl\"".to_owned(),
            ["solids.materials", "line 2: Kd \"red\""],
        ),
        (
            "materials = \"a.png\"".to_owned(),
            ["solids.materials", "line 1"],
        ),
        (
            "materials = \"no.mtl\"".to_owned(),
            ["no.mtl line 3", "readable PNG"],
        ),
        (
            "materials = \"out.mtl\"".to_owned(),
            ["solids.materials", "leads out of the folder"],
        ),
        (
            texture("none.png"),
            ["solids.material[0].texture.file", "cannot read"],
        ),
        (
            texture("no.png"),
            ["solids.material[0].texture.file", "readable PNG"],
        ),
        (
            texture("cut.png"),
            ["solids.material[0].texture.file", "readable PNG"],
        ),
        (
            format!("{0}\n{0}", texture("a.png")),
            ["solids.material[1].name", "is defined twice"],
        ),
        (
            texture("a.png").replace("metres = 1.0", "metres = 0.0"),
            ["solids.material[0].texture.metres", "allowed"],
        ),
    ] {
        let error = look(&solids).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "{solids}: {error}");
        }
    }
    // Control. The hash depends on the files' contents, not on their names.
    let good = look("materials = \"good.mtl\"").unwrap().hash();
    std::fs::copy(inside("good.mtl"), inside("other.mtl")).unwrap();
    assert_eq!(good, look("materials = \"other.mtl\"").unwrap().hash());
    std::fs::write(inside("a.png"), png(4, |x, y| code(y, x))).unwrap();
    assert_ne!(good, look("materials = \"good.mtl\"").unwrap().hash());
    assert_ne!(good, look("").unwrap().hash());
}
