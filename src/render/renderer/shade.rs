//! What shades the picture, and the channels beside it.

use crate::{
    gpu::{
        buffer::Buf,
        recording::{Bind, Command, Groups},
    },
    render::{
        buffers::{BANDS, OWNER, THICKNESS, aovs, picture},
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

/// Plans the shading of the plan's bands; `surface` is where the smoothed depth stands.
pub(super) fn plan_shade(plan: &mut Plan, look: &Look, surface: &Buf<f32>) -> Shade {
    let has_aovs = !look.spec().output.aovs.is_empty();
    if look.spec().water.spray.is_some() || look.spec().whitewater.is_some() {
        plan.define("ssfr/shade", "SPRAY");
    }
    if has_aovs {
        plan.define("ssfr/shade_aovs", "AOVS");
    }
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
    // Without `forward` no one is asked for, and any buffer of words stands in.
    let owner = match look.wants(AovSpec::Forward) {
        true => OWNER,
        false => THICKNESS,
    };
    let mut shade = Shade {
        picture: Vec::new(),
        aovs: Vec::new(),
    };
    for (index, band) in bands.iter().enumerate() {
        let pixels = width as usize * band.rows as usize;
        let binds = |output| {
            vec![
                BANDS.bind(index),
                Bind::whole("surface", surface),
                output,
                Bind::whole("owner", &owner),
            ]
        };
        let groups = Groups::Pixels([width, band.rows]);
        plan.buffer(&picture(index), pixels);
        let output = Bind::whole("output", &picture(index));
        let command = Command::in_groups("ssfr/shade", groups.clone(), binds(output));
        shade.picture.push(command);
        if has_aovs {
            plan.buffer(&aovs(index), pixels);
            let output = Bind::whole("output", &aovs(index));
            let command = Command::in_groups("ssfr/shade_aovs", groups, binds(output));
            shade.aovs.push(command);
        }
    }
    shade
}
