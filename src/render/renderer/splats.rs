//! What splats particles into the frame.

use crate::{
    gpu::{
        buffer::Buf,
        recording::{Bind, Command, Groups},
    },
    render::{
        buffers::{
            DEPTHS, OWNER, PARTICLE_GROUPS, PARTICLES, SPRAY, THICKNESS, THICKNESS_PARAMS,
            WHITEWATER, WHITEWATER_GROUPS, WHITEWATER_PARAMS,
        },
        frame::FAR,
        plan::Plan,
        uniform::Thickness,
    },
    scene::look::{AovSpec, Look},
};

/// Commands that go over particles.
pub(super) struct Splats {
    /// Depth and thickness.
    pub(super) body: Vec<Command>,
    /// Whose sphere is the nearest, while the depth is still that of the spheres; nothing where no one asks.
    pub(super) owner: Vec<Command>,
    /// Aerated water and whitewater before the surface; nothing where the look has none.
    pub(super) spray: Vec<Command>,
}

/// Plans the splats that the look calls for, of `particles` particles of a spacing and a splat radius, metres; `surface`
/// is where the smoothed depth stands.
pub(super) fn plan_splats(
    plan: &mut Plan,
    look: &Look,
    particles: usize,
    spacing: f64,
    radius: f64,
    surface: &Buf<f32>,
) -> Splats {
    let pixels = plan.extent.pixels();
    let over_particles =
        |pass, binds| Command::in_groups(pass, Groups::at(&PARTICLE_GROUPS, 0), binds);
    let params = || Bind::whole("params", &THICKNESS_PARAMS);
    let volume = spacing.powi(3) / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3));
    let scale = Thickness {
        scale: volume as f32,
        ..Thickness::default()
    };
    plan.buffer(&PARTICLES, particles);
    plan.buffer(&PARTICLE_GROUPS, 1);
    plan.values(&THICKNESS_PARAMS, &[scale]);
    plan.buffer(&THICKNESS, pixels / 4);
    let body = vec![
        plan.fill(&DEPTHS[0], FAR.to_bits(), pixels),
        Command::clear(&THICKNESS),
        over_particles("ssfr/splat_depth", Vec::new()),
        over_particles("ssfr/splat_thickness", vec![params()]),
    ];
    let owner = match look.wants(AovSpec::Forward) {
        true => {
            plan.buffer(&OWNER, pixels);
            vec![
                plan.fill(&OWNER, u32::MAX, pixels),
                over_particles("ssfr/splat_owner", Vec::new()),
            ]
        }
        false => Vec::new(),
    };
    let mut spray = Vec::new();
    let (drawn, white) = (&look.spec().water.spray, &look.spec().whitewater);
    if drawn.is_some() || white.is_some() {
        plan.buffer(&SPRAY, pixels / 4);
        spray.push(Command::clear(&SPRAY));
    }
    let before = || Bind::whole("surface", surface);
    if drawn.is_some() {
        let binds = vec![params(), before()];
        spray.push(over_particles("ssfr/splat_spray", binds));
    }
    if white.is_some() {
        plan.buffer(&WHITEWATER, 1);
        plan.buffer(&WHITEWATER_PARAMS, 1);
        plan.buffer(&WHITEWATER_GROUPS, 1);
        let groups = Groups::at(&WHITEWATER_GROUPS, 0);
        let binds = vec![before()];
        spray.push(Command::in_groups("ssfr/splat_whitewater", groups, binds));
    }
    Splats { body, owner, spray }
}
