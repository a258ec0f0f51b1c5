//! A substep's passes, recorded.

use crate::{
    domain::bricks::CELLS,
    gpu::{
        program::{BufferSpec, Program},
        recording::{Bind, Command, Groups, Recording, spread},
        sort,
    },
    scene::{
        Scene,
        plan::{Plan, WINDOW_BYTES, layers},
    },
};

/// Where in `groups` the workgroups over cells of water stand.
const WET: u64 = 0;

/// Those over cells within reach too.
const ACTIVE: u64 = 16;

/// Those of the first extrapolated layer, one after the other.
const LAYERS: u64 = 32;

/// Particles of a thread of `flip/survey`, its `RUN`.
const SURVEY_RUN: usize = 16;

/// Values of a thread of `flip/find_not_finite`, four times its `RUN`.
const WATCH_RUN: u64 = 16;

/// Threads of a workgroup of passes over cells.
const WORKGROUP: u32 = 64;

/// A substep in its parts.
pub(super) struct Recordings {
    /// Before the bricks are known.
    pub(super) survey: Recording,
    /// Up to what the projection reads.
    pub(super) to_grid: Recording,
    /// From what it wrote.
    pub(super) to_particles: Recording,
    /// What the host is told of the substep.
    pub(super) watch: Recording,
}

impl Recordings {
    pub(super) fn new(program: &Program, plan: &Plan, scene: &Scene) -> Self {
        let layers = layers(scene.solver.flip().cfl);
        let n = plan.counts.particles;
        let survey = [
            Command::Clear("survey"),
            Command::over("flip/survey", n.div_ceil(SURVEY_RUN)),
        ];
        Self {
            survey: Recording::new(program, &survey),
            to_grid: Recording::new(program, &to_grid(plan)),
            to_particles: Recording::new(program, &to_particles(plan, layers)),
            watch: Recording::new(program, &watch(plan, scene)),
        }
    }
}

/// Contents of `groups`: empty from the layer on that the substep does not need.
pub(super) fn groups(
    program: &Program,
    wet_cells: u32,
    active_cells: u32,
    layers: usize,
) -> Vec<[u32; 4]> {
    let of = |cells: u32| {
        let [x, y, z] = spread(&program.context, WORKGROUP, u64::from(cells));
        [x, y, z, 0]
    };
    let mut all = vec![of(wet_cells), of(active_cells)];
    // Layer 1 is what the projection found.
    all.resize(2 + layers.saturating_sub(1), of(active_cells));
    all
}

/// Contents of a uniform whose windows each hold their own number, from `first` on.
pub(super) fn windows(first: u32, count: usize) -> Vec<[u32; WINDOW_BYTES as usize / 4]> {
    (0..count as u32)
        .map(|k| {
            let mut window = [0; WINDOW_BYTES as usize / 4];
            window[0] = first + k;
            window
        })
        .collect()
}

fn over(pass: &'static str, offset: u64) -> Command {
    Command::Dispatch {
        pass,
        binds: Vec::new(),
        groups: Groups::Indirect("groups", offset),
    }
}

fn window(
    pass: &'static str,
    offset: u64,
    variable: &'static str,
    buffer: &str,
    k: usize,
) -> Command {
    Command::Dispatch {
        pass,
        binds: vec![Bind {
            variable,
            buffer: buffer.to_owned(),
            window: Some((WINDOW_BYTES * k as u64, 16)),
        }],
        groups: Groups::Indirect("groups", offset),
    }
}

fn along(pass: &'static str, offset: u64, axis: usize) -> Command {
    window(pass, offset, "axis", "axes", axis)
}

fn to_grid(plan: &Plan) -> Vec<Command> {
    let n = plan.counts.particles;
    let cells = plan.counts.bricks.wet * CELLS as usize;
    let mut commands = vec![
        Command::Clear("cell_start"),
        Command::over("flip/assign_cells", n),
    ];
    commands.extend(sort::scan("cell_start", cells));
    commands.extend(sort::SORT_PASSES.map(|pass| Command::over(pass, n)));
    commands.push(Command::over("flip/reorder", n));
    commands.push(over("flip/cut_cells", ACTIVE));
    for axis in 0..3 {
        commands.push(along("flip/spread_faces", WET, axis));
        commands.push(along("flip/gather_faces", ACTIVE, axis));
    }
    commands.push(along("flip/spread_centers", WET, 0));
    commands.push(over("flip/gather_centers", ACTIVE));
    for effect in plan.effect_passes() {
        commands.push(over(effect, ACTIVE));
    }
    commands
}

fn watch(plan: &Plan, scene: &Scene) -> Vec<Command> {
    let look = |spec: &BufferSpec| Command::Dispatch {
        pass: "flip/find_not_finite",
        binds: vec![Bind {
            variable: "values",
            buffer: spec.name.clone(),
            window: None,
        }],
        groups: Groups::Threads(spec.bytes.div_ceil(4 * WATCH_RUN)),
    };
    let mut commands: Vec<Command> = plan.watched().map(look).collect();
    if scene.has_movers() {
        commands.push(over("flip/boundary_work", WET));
    }
    commands
}

fn to_particles(plan: &Plan, layers: usize) -> Vec<Command> {
    let mut commands = vec![over("flip/find_change", ACTIVE)];
    for k in 0..layers.saturating_sub(1) {
        let offset = LAYERS + 16 * k as u64;
        commands.push(window("flip/extrapolate", offset, "layer", "layers", k));
    }
    commands.push(over("flip/grid_to_particle", WET));
    commands.push(Command::over("flip/advect", plan.counts.particles));
    commands
}
