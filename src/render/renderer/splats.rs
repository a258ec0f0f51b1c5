//! What splats particles into the frame.

use super::{
    build::room,
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

/// Particles of which every per-particle array begins at a multiple of 256 bytes.
const STEP: usize = 8;

/// Particles of a workgroup: `ROWS` of shared/ssfr_lanes.wgsl.
pub(super) const ROWS: u32 = 8;

/// Passes that share a particle's pixels among threads.
const OVER_PARTICLES: [&str; 5] = [
    "ssfr/splat_depth",
    "ssfr/splat_owner",
    "ssfr/splat_thickness",
    "ssfr/splat_spray",
    "ssfr/splat_spray_aovs",
];

/// Shares a block's pixels among threads alike.
const OVER_BLOCKS: &str = "ssfr/splat_bulk";

/// Tells them how many threads share a particle or block.
pub(super) fn plan_threads(plan: &mut Plan, limits: &Limits) {
    if limits.is_narrow {
        for pass in OVER_PARTICLES.into_iter().chain([OVER_BLOCKS]) {
            plan.define(pass, "NARROW");
        }
    }
}

/// A pass over the first page of particles; [`Pages::spread`] makes it one over all.
fn over_page(pass: &'static str, groups: &Buf<Workgroups>, mut binds: Vec<Bind>) -> Command {
    binds.push(PAGES.bind(0));
    Command::in_groups(pass, Groups::at(groups, 0), binds)
}

/// A pass over particles.
fn over_particles(pass: &'static str, binds: Vec<Bind>) -> Command {
    over_page(pass, &PARTICLE_GROUPS, binds)
}

/// A pass over those that hold air.
fn over_aired(pass: &'static str, binds: Vec<Bind>) -> Command {
    over_page(pass, &AIRED_GROUPS, binds)
}

/// How particles are shared out among dispatches: as many to each as a binding holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pages {
    /// Particles of a page.
    pub(super) page: usize,
    /// Particles that buffers hold.
    pub(super) capacity: usize,
}

impl Pages {
    /// For buffers of `capacity` particles, of which one binding holds `storage` bytes.
    pub(super) fn new(capacity: usize, storage: u64) -> Self {
        let most = usize::try_from(storage).unwrap_or(usize::MAX) / size_of::<Path>();
        // A power of two: windows begin at multiples of what adapters ask for.
        let page = 1 << most.max(STEP).ilog2();
        Self { page, capacity }
    }

    /// How many there are.
    pub(super) fn count(self) -> usize {
        self.capacity.div_ceil(self.page).max(1)
    }

    /// How many of the first `particles` are in each.
    pub(super) fn shares(self, particles: usize) -> impl Iterator<Item = usize> {
        (0..self.count()).map(move |k| particles.saturating_sub(k * self.page).min(self.page))
    }

    /// The same commands with a dispatch for each page in place of one for the first.
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

    /// What a dispatch over page `k` binds.
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

/// Plans particles. Where the shutter is open `moving` passes, which draw samples, take them along their paths.
pub(super) fn plan_particles(plan: &mut Plan, look: &Look, moving: &[&'static str]) {
    let particles = room(0);
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

/// Plans a shape of its own for each particle.
pub(super) fn plan_shapes(plan: &mut Plan, look: &Look) {
    plan.per_particle(&SHAPES, room(0), look);
    for pass in ["ssfr/splat_depth", "ssfr/splat_owner"] {
        plan.define(pass, "ELLIPSOIDS");
    }
}

/// The volume that a particle of a spacing stands for over that of its sphere.
pub(super) fn filled(spacing: f64, radius: f64) -> f64 {
    spacing.powi(3) / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3))
}

/// Plans depth and thickness of particles of a spacing, metres.
pub(super) fn plan_body(plan: &mut Plan, spacing: f64) -> Vec<Command> {
    let pixels = plan.extent.pixels();
    let scale = Thickness {
        scale: filled(spacing, plan.radius) as f32,
        ..Thickness::default()
    };
    plan.values(&THICKNESS_PARAMS, &[scale]);
    plan.buffer(&THICKNESS, pixels / 4);
    plan.buffer(&PARTICLE_GROUPS, 1);
    plan.buffer(&BLOCKS, room(0));
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

/// Plans whose sphere is the nearest, while the depth is still that of the spheres.
pub(super) fn plan_owner(plan: &mut Plan) -> Vec<Command> {
    let owner = over_particles("ssfr/splat_owner", Vec::new());
    vec![plan_owners(plan), owner]
}

/// Plans the nearest spheres before the opaque depths of rays, and whose they are.
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

/// Plans the owner of each pixel, and gives what says that there is none.
fn plan_owners(plan: &mut Plan) -> Command {
    let pixels = plan.extent.pixels();
    plan.buffer(&OWNER, pixels);
    plan.fill(&OWNER, u32::MAX, pixels)
}

/// Words of a half-resolution cell of spray: length and depth; length of foam, where that is told; and for the channels beside the
/// picture velocity.
const PLANES: usize = 2;
const PLANES_WITH_FOAM: usize = 3;
const PLANES_WITH_MOTION: usize = 5;

/// What splats spray, for a sample and for the channels beside the picture.
#[derive(Default)]
pub(super) struct Spray {
    pub(super) sample: Vec<Command>,
    /// Nothing where these show none.
    pub(super) aovs: Vec<Command>,
}

/// Plans aerated water and whitewater before the surface, whose depth stands in `surface`, and before what is opaque; nothing
/// where the look has none.
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

    /// What is dispatched is what the shaders take a workgroup for.
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
