//! A frame that is rendered in parts reports its progress, and is the same picture.

use std::ops::ControlFlow;

use swell::files::parse_look;
use swell::render::{FrameInputs, Part, Renderer, WaterParticles};

use super::pictures::{ALL_AOVS, OBLIQUE, harbour};
use crate::support::context;

/// Rays in bands of 16 rows, and splats whole: each part of each sample and of the AOVs is reported
/// once, in order.
#[test]
fn each_part_of_a_frame_is_told_once() {
    let (scene, water) = harbour();
    let (water, white) = (WaterParticles::new(water), Default::default());
    let inputs = FrameInputs::alone(&water, &white);
    let context = context();
    for method in ["ray", "ssfr"] {
        let text = format!("{OBLIQUE}[renderer]\nmethod = \"{method}\"\n{ALL_AOVS}");
        let look = parse_look(&text, std::path::Path::new("parts.toml")).unwrap();
        let image = &look.spec().image;
        let bands = match method {
            "ray" => image.height.div_ceil(16),
            _ => 1,
        };
        let aovs = u32::from(!look.spec().output.aovs.is_empty());
        let count = bands * (image.samples + aovs);
        let mut renderer = Renderer::with_tile_limit(&context, &look, &scene, 16).unwrap();
        let mut told = Vec::new();
        let drawn = renderer.render_parts(3, &inputs, &mut |part| {
            told.push(part);
            ControlFlow::Continue(())
        });
        let drawn = drawn.unwrap();
        // A quick sample, such as those after the first here, is reported as one.
        let done: Vec<u32> = told.iter().map(|part| part.done).collect();
        assert!(done.is_sorted() && done[0] == 0, "{method}: {done:?}");
        assert_eq!(done[..=bands as usize], (0..=bands).collect::<Vec<_>>());
        assert_eq!(
            told[told.len() - 1],
            Part { done: count, count },
            "{method}"
        );
        assert!(told.iter().all(|part| part.count == count));
        let whole = Renderer::new(&context, &look, &scene)
            .unwrap()
            .render_inputs(3, &inputs);
        assert!(drawn == whole.unwrap(), "{method}");
    }
}
