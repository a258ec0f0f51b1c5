//! What splats particles into the frame.

use crate::{
    gpu::recording::{Bind, Command, Groups},
    render::{
        frame::FAR,
        plan::Plan,
        surface::DEPTHS,
        uniform::{Particle, Thickness},
    },
    scene::look::{AovSpec, Look},
};

/// Particles of a frame.
pub(super) const PARTICLES: &str = "particles";

/// Workgroups of a dispatch of one a particle: three words, and one unused.
pub(super) const PARTICLE_GROUPS: &str = "particle_groups";

/// Commands that go over particles.
pub(super) struct Splats {
    /// Depth and thickness.
    pub(super) body: Vec<Command>,
    /// Whose sphere is the nearest, while the depth is still that of the spheres; nothing where no one asks.
    pub(super) owner: Vec<Command>,
    /// Aerated water before the surface; nothing where the look has none.
    pub(super) spray: Vec<Command>,
}

/// Bytes of so many particles.
pub(super) fn particle_bytes(particles: usize) -> u64 {
    particles as u64 * size_of::<Particle>() as u64
}

/// Plans the splats that the look calls for, of `particles` particles of a spacing and a splat radius, metres; `surface`
/// is where the smoothed depth stands.
pub(super) fn plan_splats(
    plan: &mut Plan,
    look: &Look,
    particles: usize,
    spacing: f64,
    radius: f64,
    surface: &'static str,
) -> Splats {
    let pixels = plan.extent.pixels();
    let over_particles =
        |pass, binds| Command::in_groups(pass, Groups::Indirect(PARTICLE_GROUPS, 0), binds);
    let params = || Bind::to("params", "thickness_params");
    let volume = spacing.powi(3) / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3));
    let scale = Thickness {
        scale: volume as f32,
        ..Thickness::default()
    };
    plan.storage(PARTICLES, particle_bytes(particles));
    plan.storage(PARTICLE_GROUPS, 16);
    plan.uniform("thickness_params", &scale);
    // Half the resolution on both sides, four bytes a cell.
    plan.storage("thickness", pixels);
    let body = vec![
        plan.fill(DEPTHS[0], FAR.to_bits(), pixels),
        Command::Clear("thickness"),
        over_particles("ssfr/splat_depth", Vec::new()),
        over_particles("ssfr/splat_thickness", vec![params()]),
    ];
    let owner = match look.wants(AovSpec::Forward) {
        true => {
            plan.storage("owner", 4 * pixels);
            vec![
                plan.fill("owner", u32::MAX, pixels),
                over_particles("ssfr/splat_owner", Vec::new()),
            ]
        }
        false => Vec::new(),
    };
    let spray = match look.spec().water.spray {
        Some(_) => {
            plan.storage("spray", pixels);
            let binds = vec![params(), Bind::to("surface", surface)];
            vec![
                Command::Clear("spray"),
                over_particles("ssfr/splat_spray", binds),
            ]
        }
        None => Vec::new(),
    };
    Splats { body, owner, spray }
}
