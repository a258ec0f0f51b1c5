//! Particles that exceed a single binding are drawn in several dispatches, which does not change
//! the picture.

use swell::files::parse_look;
use swell::{
    gpu::adapter::{Context, Needs},
    render::{Image, Renderer},
};

use super::pictures::{OBLIQUE, harbour};

/// Bytes of the largest binding: 1536 particles, whose paths take 64 bytes each, and the picture's
/// depths.
const BINDING: u64 = 98_304;

fn picture(context: &Context) -> Image {
    let look = parse_look(OBLIQUE, std::path::Path::new("paged.toml")).unwrap();
    let (scene, water) = harbour();
    assert!(water.len() > 1536, "{}", water.len());
    let mut renderer = Renderer::new(context, &look, &scene).unwrap();
    renderer.render(3, &water).unwrap()
}

fn lowered() -> Context {
    Context::open_lowered(None, Needs::default(), |limits| {
        limits.max_storage_buffer_binding_size = BINDING;
    })
    .unwrap()
}

#[test]
fn a_frame_of_particles_in_pages_is_the_frame_drawn_whole() {
    let whole = picture(&crate::support::context());
    assert!(picture(&lowered()) == whole);
    // Controls: without the later pages each pass draws less.
    for (pass, from, to) in [
        (
            "ssfr/splat_thickness",
            "index >= page.count",
            "index >= page.count || page.first > 0u",
        ),
        (
            "ssfr/splat_depth",
            "index >= page.count",
            "index >= page.count || page.first > 0u",
        ),
        ("ssfr/splat_spray", "- page.first;", "- 0u * page.first;"),
    ] {
        let mut context = lowered();
        context.spoil = Some(swell::gpu::adapter::InjectedFault { pass, from, to });
        assert!(picture(&context) != whole, "{pass}");
    }
}
