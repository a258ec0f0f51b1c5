//! Frames are refused before rendering and while rendering for the same reason.

use glam::DVec3;
use swell::files::parse_look;
use swell::{
    gpu::adapter::{Context, GpuError, Needs},
    render::{FrameInputs, Limits, Plan, Renderer, WaterParticles},
};

use super::pictures::{TOP_DOWN, tank};
use super::scenes::slab;

const SPACING: f64 = 0.16;

fn lowered(storage: u64) -> Context {
    Context::open_lowered(None, Needs::default(), |limits| {
        limits.max_storage_buffer_binding_size = storage;
    })
    .unwrap()
}

/// Deep water, whose surface is in few bricks: a binding that just holds the level set of its frame
/// suffices to plan and to render it, and with four bytes less both are refused with the same
/// message. The same holds for particles, which AOVs bind as a whole.
#[test]
fn what_is_planned_for_a_frame_is_refused_where_drawing_it_is() {
    let scene = tank(SPACING);
    let particles = slab(scene.domain.min, DVec3::new(8.0, 3.2, 6.0), SPACING);
    let (water, white) = (WaterParticles::new(particles), Default::default());
    let inputs = FrameInputs::alone(&water, &white);
    for (more, names) in [
        ("[renderer]\nmethod = \"ray\"\n", &["level_values"][..]),
        (
            "[output]\nformats = [\"exr\"]\naovs = [\"forward\"]\n",
            &["particles", "shapes", "paths"],
        ),
    ] {
        let look = parse_look(
            &format!("{TOP_DOWN}{more}"),
            std::path::Path::new("look.toml"),
        )
        .unwrap();
        let plan = |context: &Context| {
            Plan::of_frame(&look, &scene, 1, &inputs, &Limits::of(context)).unwrap()
        };
        let whole = plan(&crate::support::context());
        let stored = whole.buffers.iter().filter(|buffer| !buffer.is_uniform);
        let largest = stored.max_by_key(|buffer| buffer.bytes).unwrap();
        assert!(names.contains(&&*largest.name), "{}", largest.name);
        let refused = |storage: u64| {
            let context = lowered(storage);
            let planned = plan(&context).check(&context).err();
            let renderer = Renderer::new(&context, &look, &scene);
            let drawn = renderer.and_then(|mut it| it.render_inputs(1, &inputs));
            (
                planned.map(|error| error.to_string()),
                drawn.err().map(|error| error.to_string()),
            )
        };
        assert_eq!(refused(largest.bytes), (None, None), "{more}");
        let (planned, drawn) = refused(largest.bytes - 4);
        let said = drawn.as_deref().unwrap_or_default();
        // Any of several equally large buffers.
        assert!(names.iter().any(|name| said.contains(name)), "{drawn:?}");
        assert_eq!(planned, drawn);
        // Control: the plan of a look without a frame does not know how much this frame takes.
        let empty = Plan::new(&look, &scene, &Limits::of(&crate::support::context())).unwrap();
        let mut all = empty.buffers.iter();
        let before = all.find(|it| it.name == largest.name).unwrap().bytes;
        assert!(before < largest.bytes, "{before}");
    }
}

/// As many storage buffers in a pass as the plan needs suffice to render, and with one less plan
/// and renderer are refused with the same message.
#[test]
fn a_pass_that_binds_too_many_buffers_is_refused_in_the_plan_and_in_drawing() {
    let scene = tank(SPACING);
    let particles = slab(scene.domain.min, DVec3::new(8.0, 3.2, 6.0), SPACING);
    let (water, white) = (WaterParticles::new(particles), Default::default());
    let inputs = FrameInputs::alone(&water, &white);
    let opened = |most: u32| {
        Context::open_lowered(None, Needs::default(), |limits| {
            limits.max_storage_buffers_per_shader_stage = most;
        })
        .unwrap()
    };
    for method in ["ssfr", "ray"] {
        let look = format!("{TOP_DOWN}[renderer]\nmethod = \"{method}\"\n");
        let look = parse_look(&look, std::path::Path::new("look.toml")).unwrap();
        let planned = |context: &Context| {
            let limits = Limits::of(context);
            let plan = Plan::of_frame(&look, &scene, 1, &inputs, &limits).unwrap();
            plan.check(context).err()
        };
        let drawn = |context: &Context| {
            let renderer = Renderer::new(context, &look, &scene);
            let drawn = renderer.and_then(|mut it| it.render_inputs(1, &inputs));
            drawn.err().map(|error| error.to_string())
        };
        let mut most = 1;
        while let Some(error) = planned(&opened(most)) {
            let GpuError::TooManyBuffers { needed, .. } = error else {
                panic!("{error}")
            };
            assert!(needed > most, "{needed}");
            most = needed;
        }
        let few = opened(most - 1);
        let refused = planned(&few).expect("a pass needs one more").to_string();
        assert!(refused.contains(&format!("binds {most} storage buffers")));
        assert_eq!(drawn(&few), Some(refused));
        // Negative control.
        assert_eq!(drawn(&opened(most)), None);
    }
}
