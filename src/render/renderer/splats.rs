//! Plans the passes that splat particles into the frame.

use super::{
    build::capacity_for,
    shade::{draws_spray, tells_foam, wants_spray_aovs},
};
use crate::{
    buffers::{
        AIRED, AIRED_GROUPS, BLOCK_GROUPS, BLOCKS, DEPTHS, OWNER, PAGES, PARTICLE_GROUPS,
        PARTICLES, PATHS, SHAPES, SPRAY, SPRAY_PARAMS, THICKNESS, THICKNESS_PARAMS, WHITEWATER,
        WHITEWATER_GROUPS, WHITEWATER_PARAMS,
    },
    frame::FAR,
    plan::{Limits, Plan},
    uniform::{Page, Particle, Path, Shape, Thickness},
};
use swell_gpu::{
    buffer::{Buf, Workgroups},
    recording::{Bind, Command, Groups},
};
use swell_scene::look::Look;

/// Number of particles at whose multiples every per-particle array is aligned to 256 bytes.
const STEP: usize = 8;

/// Particles per workgroup: `ROWS` of shared/ssfr_lanes.wgsl.
pub(super) const ROWS: u32 = 8;

/// Passes that divide a particle's pixels among threads.
const OVER_PARTICLES: [&str; 5] = [
    "ssfr/splat_depth",
    "ssfr/splat_owner",
    "ssfr/splat_thickness",
    "ssfr/splat_spray",
    "ssfr/splat_spray_aovs",
];

/// Pass that divides a block's pixels among threads in the same manner.
const OVER_BLOCKS: &str = "ssfr/splat_bulk";

/// Configures these passes for the number of threads per particle or block.
pub(super) fn plan_threads(plan: &mut Plan, limits: &Limits) {
    if limits.is_narrow {
        for pass in OVER_PARTICLES.into_iter().chain([OVER_BLOCKS]) {
            plan.define(pass, "NARROW");
        }
    }
}

/// Dispatch over the first page of particles; [`Pages::spread`] extends it to all pages.
fn over_page(pass: &'static str, groups: &Buf<Workgroups>, mut binds: Vec<Bind>) -> Command {
    binds.push(PAGES.bind(0));
    Command::in_groups(pass, Groups::at(groups, 0), binds)
}

/// Dispatch over all particles of a page.
fn over_particles(pass: &'static str, binds: Vec<Bind>) -> Command {
    over_page(pass, &PARTICLE_GROUPS, binds)
}

/// Dispatch over the particles of a page that hold air.
fn over_aired(pass: &'static str, binds: Vec<Bind>) -> Command {
    over_page(pass, &AIRED_GROUPS, binds)
}

/// Division of particles into dispatches, each with as many as a binding holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pages {
    /// Particles per page.
    pub(super) page: usize,
    /// Particles that the buffers hold.
    pub(super) capacity: usize,
}

impl Pages {
    /// Pages of buffers of `capacity` particles, with bindings of at most `storage` bytes.
    pub(super) fn new(capacity: usize, storage: u64) -> Self {
        let most = usize::try_from(storage).unwrap_or(usize::MAX) / size_of::<Path>();
        // A power of two, so that windows meet the adapter's alignment.
        let page = 1 << most.max(STEP).ilog2();
        Self { page, capacity }
    }

    /// Number of pages.
    pub(super) fn count(self) -> usize {
        self.capacity.div_ceil(self.page).max(1)
    }

    /// Number of the first `particles` particles in each page.
    pub(super) fn shares(self, particles: usize) -> impl Iterator<Item = usize> {
        (0..self.count()).map(move |k| particles.saturating_sub(k * self.page).min(self.page))
    }

    /// Replaces each dispatch over the first page by one dispatch per page.
    pub(super) fn spread(self, commands: &[Command]) -> Vec<Command> {
        let of_page = |command: &Command, k: usize| match command {
            Command::Dispatch {
                pass,
                binds,
                groups: Groups::Indirect { buffer, offset },
            } if OVER_PARTICLES.contains(pass) => {
                let own = binds
                    .iter()
                    .filter(|bind| bind.variable != PAGES.variable());
                let mut binds: Vec<Bind> = own.cloned().collect();
                binds.extend(self.windows(k));
                let offset = offset + (k * size_of::<Workgroups>()) as u64;
                let buffer = buffer.clone();
                Some(Command::in_groups(
                    pass,
                    Groups::Indirect { buffer, offset },
                    binds,
                ))
            }
            _ => (k == 0).then(|| command.clone()),
        };
        let pages = 0..self.count();
        commands
            .iter()
            .flat_map(|command| pages.clone().filter_map(move |k| of_page(command, k)))
            .collect()
    }

    /// Bindings of a dispatch over page `k`.
    fn windows(self, k: usize) -> [Bind; 4] {
        let first = k * self.page;
        let count = self.page.min(self.capacity - first);
        let window = |name: &'static str, bytes: usize| Bind {
            variable: name,
            buffer: name.to_owned(),
            window: (self.count() > 1).then_some(((first * bytes) as u64, (count * bytes) as u64)),
        };
        [
            PAGES.bind(k),
            window("particles", size_of::<Particle>()),
            window("shapes", size_of::<Shape>()),
            window("paths", size_of::<Path>()),
        ]
    }
}

/// Plans the particle buffers. With an open shutter, the passes in `moving`, which draw samples,
/// move particles along their paths.
pub(super) fn plan_particles(plan: &mut Plan, look: &Look, moving: &[&'static str]) {
    let particles = capacity_for(0);
    plan.per_particle(&PARTICLES, particles, look);
    plan.windows(&PAGES, &[Page::default()]);
    if look.spec().water.spray.is_some() {
        plan.buffer(&AIRED, particles);
        plan.buffer(&AIRED_GROUPS, 1);
    }
    if look.spec().image.shutter > 0.0 && !moving.is_empty() {
        plan.per_particle(&PATHS, particles, look);
        for pass in moving {
            plan.define(pass, "PATHS");
        }
    }
}

/// Plans an ellipsoid for each particle.
pub(super) fn plan_shapes(plan: &mut Plan, look: &Look) {
    plan.per_particle(&SHAPES, capacity_for(0), look);
    for pass in ["ssfr/splat_depth", "ssfr/splat_owner"] {
        plan.define(pass, "ELLIPSOIDS");
    }
}

/// Volume of a particle, spacing³, over that of its sphere.
pub(super) fn filled(spacing: f64, radius: f64) -> f64 {
    spacing.powi(3) / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3))
}

/// Plans depth and thickness of particles; `spacing` is in metres.
pub(super) fn plan_body(plan: &mut Plan, spacing: f64) -> Vec<Command> {
    let pixels = plan.extent.pixels();
    let scale = Thickness {
        scale: filled(spacing, plan.radius) as f32,
        ..Thickness::default()
    };
    plan.values(&THICKNESS_PARAMS, &[scale]);
    plan.buffer(&THICKNESS, pixels / 4);
    plan.buffer(&PARTICLE_GROUPS, 1);
    plan.buffer(&BLOCKS, capacity_for(0));
    plan.buffer(&BLOCK_GROUPS, 1);
    let params = Bind::whole("params", &THICKNESS_PARAMS);
    vec![
        plan.fill(&DEPTHS[0], FAR.to_bits(), pixels),
        Command::clear(&THICKNESS),
        over_particles("ssfr/splat_depth", Vec::new()),
        over_particles("ssfr/splat_thickness", vec![params]),
        Command::in_groups(OVER_BLOCKS, Groups::at(&BLOCK_GROUPS, 0), Vec::new()),
    ]
}

/// Plans the owner of each pixel, the particle with the nearest sphere, while the depth is still
/// that of the spheres.
pub(super) fn plan_owner(plan: &mut Plan) -> Vec<Command> {
    let owner = over_particles("ssfr/splat_owner", Vec::new());
    vec![plan_owners(plan), owner]
}

/// Plans the nearest spheres in front of the opaque depths of rays, and the owner of each pixel.
pub(super) fn plan_owner_before_rays(plan: &mut Plan) -> Vec<Command> {
    plan.buffer(&PARTICLE_GROUPS, 1);
    let opaque = Bind::whole("solid_depth", &DEPTHS[1]);
    vec![
        plan.fill(&DEPTHS[0], FAR.to_bits(), plan.extent.pixels()),
        over_particles("ssfr/splat_depth", vec![opaque]),
        plan_owners(plan),
        over_particles("ssfr/splat_owner", Vec::new()),
    ]
}

/// Plans the buffer of owners and returns the command that clears it to "none".
fn plan_owners(plan: &mut Plan) -> Command {
    let pixels = plan.extent.pixels();
    plan.buffer(&OWNER, pixels);
    plan.fill(&OWNER, u32::MAX, pixels)
}

/// Planes of the spray buffer at half resolution, one word per cell: optical length, and length
/// times depth; then length of foam where it is separated, or for additional channels length times
/// the three components of velocity.
const PLANES: usize = 2;
const PLANES_WITH_FOAM: usize = 3;
const PLANES_WITH_MOTION: usize = 5;

/// Commands that splat spray, for a sample and for the additional channels.
#[derive(Default)]
pub(super) struct Spray {
    pub(super) sample: Vec<Command>,
    /// Empty where the channels do not show spray.
    pub(super) aovs: Vec<Command>,
}

/// Plans aerated water and whitewater in front of the surface, whose depth is in `surface`, and of
/// opaque geometry; nothing where the look has neither.
pub(super) fn plan_spray(
    plan: &mut Plan,
    look: &Look,
    surface: &Buf<f32>,
    opaque: &Buf<f32>,
) -> Spray {
    if !draws_spray(look) {
        return Spray::default();
    }
    let has_aovs = wants_spray_aovs(look);
    let planes = match (has_aovs, tells_foam(look)) {
        (true, _) => PLANES_WITH_MOTION,
        (false, true) => PLANES_WITH_FOAM,
        (false, false) => PLANES,
    };
    if tells_foam(look) {
        plan.define("ssfr/splat_whitewater", "FOAM");
    }
    plan.buffer(&SPRAY, planes * plan.extent.pixels() / 4);
    plan.buffer(&SPRAY_PARAMS, 1);
    let spec = look.spec();
    let (has_drops, has_white) = (spec.water.spray.is_some(), spec.whitewater.is_some());
    if has_white {
        plan.buffer(&WHITEWATER, 1);
        plan.buffer(&WHITEWATER_PARAMS, 1);
        plan.buffer(&WHITEWATER_GROUPS, 1);
    }
    let commands = |drops: &'static str, white: &'static str| {
        let before = || {
            let surface = Bind::whole("surface", surface);
            vec![surface, Bind::whole("solid_depth", opaque)]
        };
        let mut commands = vec![Command::clear(&SPRAY)];
        if has_drops {
            commands.push(over_aired(drops, before()));
        }
        if has_white {
            let groups = Groups::at(&WHITEWATER_GROUPS, 0);
            commands.push(Command::in_groups(white, groups, before()));
        }
        commands
    };
    let sample = commands("ssfr/splat_spray", "ssfr/splat_whitewater");
    let mut aovs = Vec::new();
    if has_aovs {
        let passes = ["ssfr/splat_spray_aovs", "ssfr/splat_whitewater_aovs"];
        aovs = commands(passes[0], passes[1]);
        for pass in passes {
            plan.define(pass, "MOTION");
        }
    }
    Spray { sample, aovs }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use super::*;
    use swell_gpu::{reflect::reflect, shader::compose};

    /// The workgroup sizes of the shaders match the dispatches.
    #[test]
    fn workgroups_hold_as_many_as_the_shaders_say() {
        for pass in OVER_PARTICLES.into_iter().chain([OVER_BLOCKS]) {
            for (lanes, defines) in [(32, &[][..]), (8, &["NARROW"])] {
                let size = reflect(pass, &compose(pass, defines).unwrap()).unwrap();
                assert_eq!(size.workgroup_size, [lanes, ROWS, 1], "{pass}");
            }
        }
    }
}
