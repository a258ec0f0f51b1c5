//! What shades the picture, and the channels beside it.

use crate::{
    gpu::recording::{Bind, Command, Groups},
    render::{
        frame::{AOV_BYTES, COLOUR_BYTES},
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

/// Name of the buffer that holds a band of the picture.
pub(super) fn picture_band(index: usize) -> String {
    format!("picture.{index}")
}

/// Name of the buffer that holds a band of the channels beside it.
pub(super) fn aov_band(index: usize) -> String {
    format!("aovs.{index}")
}

/// Plans the shading of the plan's bands; `surface` is where the smoothed depth stands.
pub(super) fn plan_shade(plan: &mut Plan, look: &Look, surface: &'static str) -> Shade {
    let has_aovs = !look.spec().output.aovs.is_empty();
    if look.spec().water.spray.is_some() {
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
    plan.windows("bands", &bands);
    let width = plan.extent.picture[0];
    let mut shade = |pass, pixel_bytes, name: fn(usize) -> String, more: &[Bind]| {
        let commands = bands.iter().enumerate().map(|(index, band)| {
            let output = name(index);
            plan.storage(
                &output,
                pixel_bytes * u64::from(width) * u64::from(band.rows),
            );
            let mut binds = vec![
                Bind::window::<Band>("band", "bands", index),
                Bind::to("surface", surface),
                Bind::to("output", output),
            ];
            binds.extend_from_slice(more);
            Command::in_groups(pass, Groups::Pixels([width, band.rows]), binds)
        });
        commands.collect()
    };
    // Without `forward` no one is asked for, and any buffer of words stands in.
    let owner = match look.wants(AovSpec::Forward) {
        true => "owner",
        false => "thickness",
    };
    Shade {
        picture: shade("ssfr/shade", COLOUR_BYTES, picture_band, &[]),
        aovs: match has_aovs {
            true => shade(
                "ssfr/shade_aovs",
                AOV_BYTES,
                aov_band,
                &[Bind::to("owner", owner)],
            ),
            false => Vec::new(),
        },
    }
}
