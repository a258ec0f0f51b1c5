//! `swell export --usd --look` as a user runs it: materials, textures and light of the shot.

use std::fs;

use swell::render::image::{read_png, write_rgb_png};

use crate::support::job::{Job, LOOK};

const SCENE: &str = r#"
[shot]
name = "pier"
frames = 1
frames_per_second = 24
[domain]
min = [0.0, 0.0, 0.0]
max = [2.0, 1.0, 1.0]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.5, 0.5, 1.0]
[[solid]]
mesh = "pier.obj"
[[wave_maker]]
wall = "-x"
motion = { kind = "sine", stroke = 0.1, period = 1.0 }
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
"#;

/// A box with its top as a group of its own.
const PIER: &str = "\
v 1.3 0.0 0.3\nv 1.7 0.0 0.3\nv 1.7 0.8 0.3\nv 1.3 0.8 0.3
v 1.3 0.0 0.7\nv 1.7 0.0 0.7\nv 1.7 0.8 0.7\nv 1.3 0.8 0.7
g wall\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 1 5 8 4\nf 2 3 7 6
g deck\nf 4 8 7 3
";

const MATERIALS: &str = r#"
[[solids.material]]
name = "deck"
texture = { file = "planks.png", metres = 0.8 }
[[solids.material]]
name = "wall"
colour = [0.5, 0.25, 0.125]
"#;

fn baked() -> Job {
    let job = Job::of(&[("pier.toml", SCENE), ("pier.obj", PIER)]);
    let pixels: Vec<[u8; 3]> = (0..8).map(|k| [30 * k, 255 - k, 7]).collect();
    write_rgb_png(&job.path("planks.png"), [4, 2], &pixels, "").unwrap();
    job.write("look.toml", &format!("{LOOK}{MATERIALS}"));
    job.expect(0, "bake pier.toml -o cache");
    job
}

#[test]
fn a_shot_has_the_materials_and_the_light_of_its_look() {
    let job = baked();
    let words = "export cache --usd out/s.usda --look look.toml";
    job.expect(0, words);
    let root = fs::read_to_string(job.path("out/s.usda")).unwrap();
    let picture = |file: &str| read_png(&job.path(file)).unwrap();
    assert_eq!(picture("out/s.planks.png"), picture("planks.png"));
    assert!(job.path("out/s.sky.exr").is_file());
    // The deck's two triangles come last.
    for part in [
        "int[] indices = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]",
        "int[] indices = [10, 11]",
        "asset inputs:file = @./s.planks.png@",
        "color3f inputs:diffuseColor = (0.5, 0.25, 0.125)",
        "def DistantLight \"sun\"",
        "asset inputs:texture:file = @./s.sky.exr@",
        "visibility = \"invisible\"",
    ] {
        assert!(root.contains(part), "{part}: {root}");
    }
    // Again: everything is there. A texture that is damaged is made again.
    assert!(job.expect(0, words).contains("0 files made"));
    fs::write(job.path("out/s.planks.png"), "mine").unwrap();
    assert!(job.expect(0, words).contains("1 file made"));
    assert_eq!(picture("out/s.planks.png"), picture("planks.png"));
    // Wave makers that the look draws are seen, and have its colour.
    let makers = "[wave_makers]\nheight_m = 0.5\ncolour = [0.75, 0.5, 0.25]\n";
    job.write("makers.toml", &format!("{LOOK}{MATERIALS}{makers}"));
    job.expect(0, "export cache --usd made/s.usda --look makers.toml");
    let root = fs::read_to_string(job.path("made/s.usda")).unwrap();
    assert!(root.contains("diffuseColor = (0.75, 0.5, 0.25)") && !root.contains("invisible"));
    // Without a look there is none of it.
    job.expect(0, "export cache --usd plain/s.usda");
    let plain = fs::read_to_string(job.path("plain/s.usda")).unwrap();
    for part in ["Material", "Light", "invisible", "primvars:st"] {
        assert!(!plain.contains(part), "{part}: {plain}");
    }
    assert_eq!(fs::read_dir(job.path("plain")).unwrap().count(), 4);
}

/// The wet surface of a solid is refined, and each part has the material of its triangle.
#[test]
fn the_parts_of_a_wet_solid_have_its_materials() {
    let job = baked();
    job.expect(0, "wet cache --within 0.2");
    job.expect(
        0,
        "export cache --usd s.usda --look look.toml --wet default",
    );
    let root = fs::read_to_string(job.path("s.usda")).unwrap();
    let counts = root
        .lines()
        .filter(|line| line.contains("int[] indices = "));
    let counts: Vec<usize> = counts.map(|line| line.split(',').count()).collect();
    let of = |attribute: &str| {
        let mut lines = root.lines();
        let line = lines
            .find(|line| line.contains(attribute) && line.contains("= ["))
            .unwrap();
        line.matches(',').count() + 1
    };
    let triangles = of("faceVertexCounts");
    assert!(
        counts.len() == 2 && triangles > 100,
        "{counts:?} {triangles}"
    );
    assert_eq!(counts.iter().sum::<usize>(), triangles);
    // Two numbers for each of three corners.
    assert_eq!(of("primvars:st ="), 6 * triangles);
    // The deck is 0.4 × 0.4 m of 1.6 m² in all.
    let part = counts.iter().min().unwrap();
    assert!(
        (*part as f64 / triangles as f64 - 0.1).abs() < 0.05,
        "{counts:?}"
    );
}

#[test]
fn a_material_without_a_part_is_refused_with_its_line() {
    let job = baked();
    let wrong = MATERIALS.replace("\"deck\"", "\"decks\"");
    job.write("wrong.toml", &format!("{LOOK}{wrong}"));
    let words = "export cache --usd wrong/s.usda --look wrong.toml";
    job.expect_clear(2, words, "is called \"decks\"; there are: deck, pier, wall");
    assert!(!job.path("wrong").exists(), "nothing was written");
}
