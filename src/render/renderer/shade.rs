//! What shades the picture, and the channels beside it.

use crate::{
    gpu::{
        buffer::Buf,
        recording::{Bind, Command, Groups},
    },
    render::{
        buffers::{BANDS, DEPTHS, OWNER, THICKNESS, aovs, picture},
        plan::Plan,
        uniform::Band,
    },
    scene::look::{AovSpec, Look},
};

/// Shading, band by band.
pub(super) struct Shade {
    pub(super) picture: Vec<Command>,
    /// Nothing where the look asks for no channel.
    pub(super) aovs: Vec<Command>,
}

/// Plans the shading of the plan's bands by two passes; `surface` is where the depth of the water stands.
fn plan_bands(
    plan: &mut Plan,
    look: &Look,
    passes: [&'static str; 2],
    binds: [&dyn Fn() -> Vec<Bind>; 2],
) -> Shade {
    let has_aovs = !look.spec().output.aovs.is_empty();
    let bands: Vec<Band> = plan
        .bands
        .iter()
        .scan(0, |next, &rows| {
            let row = *next;
            *next += rows;
            Some(Band {
                row,
                rows,
                ..Band::default()
            })
        })
        .collect();
    plan.windows(&BANDS, &bands);
    let width = plan.extent.picture[0];
    let mut shade = Shade {
        picture: Vec::new(),
        aovs: Vec::new(),
    };
    for (index, band) in bands.iter().enumerate() {
        let pixels = width as usize * band.rows as usize;
        let groups = Groups::Pixels([width, band.rows]);
        let into = |output, binds: &dyn Fn() -> Vec<Bind>| {
            [binds(), vec![BANDS.bind(index), output]].concat()
        };
        plan.buffer(&picture(index), pixels);
        let output = Bind::whole("output", &picture(index));
        let command = Command::in_groups(passes[0], groups.clone(), into(output, binds[0]));
        shade.picture.push(command);
        if has_aovs {
            plan.buffer(&aovs(index), pixels);
            let output = Bind::whole("output", &aovs(index));
            let command = Command::in_groups(passes[1], groups, into(output, binds[1]));
            shade.aovs.push(command);
        }
    }
    shade
}

pub(super) fn draws_spray(look: &Look) -> bool {
    look.spec().water.spray.is_some() || look.spec().whitewater.is_some()
}

/// Whether a channel beside the picture is that of spray, where it hides what is behind.
pub(super) fn wants_spray_aovs(look: &Look) -> bool {
    let mut shown = [AovSpec::Z, AovSpec::P, AovSpec::Forward].into_iter();
    draws_spray(look) && shown.any(|aov| look.wants(aov))
}

/// Plans the shading of what was splatted; `surface` is where the smoothed depth stands.
pub(super) fn plan_shade(plan: &mut Plan, look: &Look, surface: &Buf<f32>) -> Shade {
    if draws_spray(look) {
        plan.define("ssfr/shade", "SPRAY");
    }
    plan.define("ssfr/shade_aovs", "AOVS");
    if wants_spray_aovs(look) {
        plan.define("ssfr/shade_aovs", "SPRAY");
    }
    // Without `forward` no one is asked for, and any buffer of words stands in.
    let owner = match look.wants(AovSpec::Forward) {
        true => OWNER,
        false => THICKNESS,
    };
    let binds = || {
        let surface = Bind::whole("surface", surface);
        vec![surface, Bind::whole("owner", &owner)]
    };
    let passes = ["ssfr/shade", "ssfr/shade_aovs"];
    plan_bands(plan, look, passes, [&binds, &binds])
}

/// Plans the casting of rays.
pub(super) fn plan_cast(plan: &mut Plan, look: &Look) -> Shade {
    if draws_spray(look) {
        plan.define("rays/cast", "SPRAY");
    }
    if look.wants(AovSpec::Forward) {
        plan.define("rays/aovs", "FORWARD");
    }
    if wants_spray_aovs(look) {
        plan.define("rays/aovs", "SPRAY");
    }
    let picture = || {
        let surface = Bind::whole("surface", &DEPTHS[0]);
        vec![surface, Bind::whole("solid_depth", &DEPTHS[1])]
    };
    plan_bands(
        plan,
        look,
        ["rays/cast", "rays/aovs"],
        [&picture, &Vec::new],
    )
}
