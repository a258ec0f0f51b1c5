//! Pictures as they are delivered: windows, colour spaces, layers and mattes.

mod colour;
mod holdout;
mod lights;
mod mattes;
mod windows;

use std::path::Path;
use swell::files::parse_look;

use swell::{
    domain::{
        particles::Particles,
        whitewater::{AGE, KIND, LIFE, RADIUS, WhitewaterKind},
    },
    gpu::adapter::Context,
    render::{Image, RenderScene, Renderer},
    scene::look::Look,
};

use super::pictures::{OBLIQUE, harbour};

/// Both methods of rendering water.
const METHODS: [&str; 2] = ["ssfr", "ray"];

/// A look at the harbour with sun, spray, walls and solids; lines of `[image]`, `[surface]` and
/// `[output]`.
struct Setup<'a> {
    method: &'a str,
    image: &'a str,
    surface: &'a str,
    output: &'a str,
}

impl Setup<'_> {
    fn look(&self) -> Look {
        let Self {
            method,
            image,
            surface,
            output,
        } = self;
        let text = OBLIQUE
            .replace("[image]\n", &format!("[image]\n{image}\n"))
            .replace("[surface]\n", &format!("[surface]\n{surface}\n"))
            .replace(
                "[water]\n",
                "[water]\nscattering_per_metre = [0.1, 0.3, 0.3]\n",
            );
        let text = match *method {
            "ray" => text.replace("[water]\n", "[water]\ncaustics = { resolution = 64 }\n"),
            _ => text,
        };
        let text = format!(
            "{text}[renderer]\nmethod = \"{method}\"\n[output]\nformats = [\"exr\"]\n{output}\n"
        );
        parse_look(&text, Path::new("test.toml")).unwrap()
    }

    fn draw(&self, context: &Context) -> Image {
        let (scene, water) = harbour();
        draw(context, &self.look(), &scene, &water)
    }
}

fn draw(context: &Context, look: &Look, scene: &RenderScene, water: &Particles) -> Image {
    let mut renderer = Renderer::new(context, look, scene).unwrap();
    renderer.name_solids(&["tower".to_owned(), "shed".to_owned()]);
    renderer.render_with(3, water, &white()).unwrap()
}

/// Whitewater of each kind: drops over the water, foam on it and bubbles under it. A look without
/// whitewater does not render it.
fn white() -> Particles {
    let mut white = Particles::default();
    let mut kinds = Vec::new();
    for (kind, y) in [
        (WhitewaterKind::Spray, 1.1),
        (WhitewaterKind::Foam, 0.62),
        (WhitewaterKind::Bubble, 0.55),
    ] {
        for i in 0..40u16 {
            let (x, z) = (f32::from(i % 8), f32::from(i / 8));
            white.position.push([1.0 + 0.2 * x, y, 1.0 + 0.3 * z]);
            white.velocity.push([1.0, 0.0, 0.0]);
            white.id.push(white.id.len() as u32);
            kinds.push(kind.number());
        }
    }
    for (name, value) in [(AGE, 1.0), (LIFE, 1.0), (RADIUS, 0.06)] {
        let values = vec![value; kinds.len()];
        white.attributes.insert(name.to_owned(), values);
    }
    white.attributes.insert(KIND.to_owned(), kinds);
    white
}
