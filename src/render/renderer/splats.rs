//! What splats particles into the frame.

use crate::{
    gpu::{
        buffer::Buf,
        recording::{Bind, Command, Groups},
    },
    render::{
        buffers::{
            DEPTHS, OWNER, PARTICLE_GROUPS, PARTICLES, SHAPES, SPRAY, THICKNESS, THICKNESS_PARAMS,
            WHITEWATER, WHITEWATER_GROUPS, WHITEWATER_PARAMS,
        },
        frame::FAR,
        plan::Plan,
        uniform::Thickness,
    },
    scene::look::Look,
};

/// A pass over particles.
fn over_particles(pass: &'static str, binds: Vec<Bind>) -> Command {
    Command::in_groups(pass, Groups::at(&PARTICLE_GROUPS, 0), binds)
}

/// Plans `particles` particles of a spacing and a splat radius, metres.
pub(super) fn plan_particles(plan: &mut Plan, particles: usize, spacing: f64, radius: f64) {
    let volume = spacing.powi(3) / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3));
    let scale = Thickness {
        scale: volume as f32,
        ..Thickness::default()
    };
    plan.buffer(&PARTICLES, particles);
    plan.buffer(&PARTICLE_GROUPS, 1);
    plan.values(&THICKNESS_PARAMS, &[scale]);
}

/// Plans a shape of its own for each of `particles` particles.
pub(super) fn plan_shapes(plan: &mut Plan, particles: usize) {
    plan.buffer(&SHAPES, particles);
    for pass in ["ssfr/splat_depth", "ssfr/splat_owner"] {
        plan.define(pass, "ELLIPSOIDS");
    }
}

/// Plans depth and thickness.
pub(super) fn plan_body(plan: &mut Plan) -> Vec<Command> {
    let pixels = plan.extent.pixels();
    plan.buffer(&THICKNESS, pixels / 4);
    let params = Bind::whole("params", &THICKNESS_PARAMS);
    vec![
        plan.fill(&DEPTHS[0], FAR.to_bits(), pixels),
        Command::clear(&THICKNESS),
        over_particles("ssfr/splat_depth", Vec::new()),
        over_particles("ssfr/splat_thickness", vec![params]),
    ]
}

/// Plans whose sphere is the nearest, while the depth is still that of the spheres.
pub(super) fn plan_owner(plan: &mut Plan) -> Vec<Command> {
    let pixels = plan.extent.pixels();
    plan.buffer(&OWNER, pixels);
    vec![
        plan.fill(&OWNER, u32::MAX, pixels),
        over_particles("ssfr/splat_owner", Vec::new()),
    ]
}

/// Plans the nearest spheres before the opaque depths of rays, and whose they are.
pub(super) fn plan_owner_before_rays(plan: &mut Plan) -> Vec<Command> {
    let pixels = plan.extent.pixels();
    let opaque = Bind::whole("solid_depth", &DEPTHS[1]);
    let depth = vec![
        plan.fill(&DEPTHS[0], FAR.to_bits(), pixels),
        over_particles("ssfr/splat_depth", vec![opaque]),
    ];
    [depth, plan_owner(plan)].concat()
}

/// Plans aerated water and whitewater before the surface, whose depth stands in `surface`, and before what is opaque; nothing
/// where the look has none.
pub(super) fn plan_spray(
    plan: &mut Plan,
    look: &Look,
    surface: &Buf<f32>,
    opaque: &Buf<f32>,
) -> Vec<Command> {
    let pixels = plan.extent.pixels();
    let mut spray = Vec::new();
    let (drawn, white) = (&look.spec().water.spray, &look.spec().whitewater);
    if drawn.is_some() || white.is_some() {
        plan.buffer(&SPRAY, pixels / 4);
        spray.push(Command::clear(&SPRAY));
    }
    let before = || {
        let surface = Bind::whole("surface", surface);
        vec![surface, Bind::whole("solid_depth", opaque)]
    };
    if drawn.is_some() {
        let params = Bind::whole("params", &THICKNESS_PARAMS);
        let binds = [before(), vec![params]].concat();
        spray.push(over_particles("ssfr/splat_spray", binds));
    }
    if white.is_some() {
        plan.buffer(&WHITEWATER, 1);
        plan.buffer(&WHITEWATER_PARAMS, 1);
        plan.buffer(&WHITEWATER_GROUPS, 1);
        let groups = Groups::at(&WHITEWATER_GROUPS, 0);
        spray.push(Command::in_groups(
            "ssfr/splat_whitewater",
            groups,
            before(),
        ));
    }
    spray
}
