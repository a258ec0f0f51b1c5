//! Recordings of a substep's passes.

use crate::{
    SolveError,
    effects::Addition,
    grid::{ACTIVE, WET, over_listed},
    params::FlipParams,
    plan::{Plan, PlannedBuffer},
    pressure::bodies,
    trace::Run,
};
use swell_domain::{bricks::CELLS, flip::layers};
use swell_gpu::{
    buffer::Workgroups,
    program::Program,
    recording::{Bind, Command, Groups, Recording, spread},
    sort,
};
use swell_scene::FlipScene;

use super::{buffers::*, plan::pushes};

/// Index in [`GROUPS`] of the dispatch over the first extrapolated layer; further layers follow.
pub(super) const FIRST_LAYER: usize = 2;

/// Particles per thread of `flip/survey`; its `RUN`.
const SURVEY_RUN: usize = 16;

/// Values per thread of `flip/find_not_finite`; four times its `RUN`.
const WATCH_RUN: u64 = 16;

/// Threads per workgroup of passes over cells.
const WORKGROUP: u32 = 64;

/// The pass that slows water along no-slip walls.
pub(super) const WALL_FRICTION: &str = "flip/wall_friction";

/// Recordings of the parts of a substep.
pub(super) struct Recordings {
    /// Runs before the bricks are known.
    pub(super) survey: Recording,
    /// Transfers to the grid and everything else before the projection.
    pub(super) to_grid: Recording,
    /// After each projection, where it moves bodies.
    pub(super) carry: Option<Recording>,
    /// Between two projections: the first iteration, and a further one.
    between: [Recording; 2],
    /// Transfers from the projected grid to particles.
    pub(super) to_particles: Recording,
    /// Checks and sums that the host reads after the substep.
    pub(super) watch: Recording,
}

impl Recordings {
    pub(super) fn new(program: &Program, commands: &Commands) -> Self {
        Self {
            survey: Recording::new(program, &commands.survey),
            to_grid: Recording::new(program, &commands.to_grid),
            carry: (!commands.carry.is_empty()).then(|| Recording::new(program, &commands.carry)),
            between: [&commands.begin, &commands.again].map(|part| Recording::new(program, part)),
            to_particles: Recording::new(program, &commands.to_particles),
            watch: Recording::new(program, &commands.watch),
        }
    }

    /// Returns the names of the passes between two projections.
    pub(super) fn between(&self) -> impl Iterator<Item = &'static str> {
        let all = self.carry.iter().chain(&self.between);
        all.flat_map(Recording::passes)
    }

    /// Runs the passes between two projections, with `again` iterations after the first.
    pub(super) fn run_between(
        &self,
        program: &Program,
        again: u32,
        run: &mut Run<'_>,
    ) -> Result<(), SolveError> {
        let [begin, turn] = &self.between;
        run(program, &[begin])?;
        // Batches of 64 keep the device busy and bound the size of a submission.
        let turns = vec![turn; again as usize];
        turns.chunks(64).try_for_each(|turns| run(program, turns))
    }
}

/// Commands of the same parts.
pub(super) struct Commands {
    survey: Vec<Command>,
    to_grid: Vec<Command>,
    carry: Vec<Command>,
    begin: Vec<Command>,
    again: Vec<Command>,
    to_particles: Vec<Command>,
    watch: Vec<Command>,
}

impl Commands {
    pub(super) fn new(
        plan: &Plan,
        scene: &FlipScene,
        effects: &[(&'static str, Addition)],
    ) -> Self {
        let n = plan.counts.particles;
        let between = || {
            effects
                .iter()
                .filter_map(|(_, addition)| addition.between.as_ref())
        };
        let mut end: Vec<Command> = between().flat_map(|between| between.end.clone()).collect();
        end.extend(to_particles(plan, scene, effects));
        Self {
            survey: vec![
                Command::clear(&SURVEY),
                Command::over("flip/survey", n.div_ceil(SURVEY_RUN)),
            ],
            to_grid: to_grid(plan, scene, effects),
            carry: carry(plan, scene),
            begin: between()
                .flat_map(|between| between.begin.clone())
                .collect(),
            again: between()
                .flat_map(|between| between.again.clone())
                .collect(),
            to_particles: end,
            watch: watch(plan, scene),
        }
    }

    pub(super) fn before_projection(&self) -> impl Iterator<Item = &Command> {
        self.survey.iter().chain(&self.to_grid)
    }

    pub(super) fn between_projections(&self) -> impl Iterator<Item = &Command> {
        self.carry.iter().chain(&self.begin).chain(&self.again)
    }

    pub(super) fn after_projection(&self) -> impl Iterator<Item = &Command> {
        self.to_particles.iter().chain(&self.watch)
    }
}

/// Returns the contents of `groups`. Layers beyond those that the substep needs get empty
/// dispatches.
pub(super) fn groups(
    program: &Program,
    scene: &FlipScene,
    params: &FlipParams,
    needed: usize,
) -> Vec<Workgroups> {
    let of = |cells: u32| spread(&program.context, WORKGROUP, u64::from(cells)).into();
    let mut all = vec![of(params.wet_cells), of(params.active_cells)];
    // The projection itself provides layer 1.
    all.resize(
        FIRST_LAYER + needed.saturating_sub(1),
        of(params.active_cells),
    );
    let planned = FIRST_LAYER + layers(scene.settings().cfl);
    all.resize(all.len().max(planned), Workgroups::default());
    all
}

/// Returns `count` windows that contain consecutive numbers from `first` on.
pub(super) fn numbers(first: u32, count: usize) -> Vec<[u32; 4]> {
    (first..).take(count).map(|k| [k, 0, 0, 0]).collect()
}

fn over(pass: &'static str, size: usize) -> Command {
    over_listed(pass, size, Vec::new())
}

fn along(pass: &'static str, size: usize, axis: usize) -> Command {
    over_listed(pass, size, vec![AXES.bind(axis)])
}

/// Returns whether the wall-friction model slows water along no-slip walls; not if an effect
/// resolves the friction on the grid.
fn slows_along_walls(scene: &FlipScene) -> bool {
    !scene.no_slip.is_empty() && !scene.effects.act_between_projections()
}

fn to_grid(plan: &Plan, scene: &FlipScene, effects: &[(&'static str, Addition)]) -> Vec<Command> {
    let n = plan.counts.particles;
    let cells = plan.counts.bricks.wet * CELLS as usize;
    let mut commands = vec![
        Command::clear(&CELL_START),
        Command::over("flip/assign_cells", n),
    ];
    commands.extend(sort::scan(&CELL_START, cells));
    commands.extend(sort::SORT_PASSES.map(|pass| Command::over(pass, n)));
    commands.push(Command::over("flip/reorder", n));
    commands.push(over("flip/cut_cells", ACTIVE));
    for pass in effects
        .iter()
        .flat_map(|(_, addition)| &addition.on_particles)
    {
        commands.push(over(pass.name, WET));
    }
    for axis in 0..3 {
        commands.push(along("flip/spread_faces", WET, axis));
        commands.push(along("flip/gather_faces", ACTIVE, axis));
    }
    if scene.settings().band.is_some() {
        commands.push(over("flip/place_deep", ACTIVE));
    }
    commands.push(along("flip/spread_centers", WET, 0));
    commands.push(over("flip/gather_centers", ACTIVE));
    commands.push(over("flip/find_water", ACTIVE));
    commands.push(over("flip/close_gaps", WET));
    if contracts(plan, scene) {
        commands.push(Command::clear(&STRAIN_BEND));
        commands.push(over("flip/find_strain", ACTIVE));
        commands.push(over("flip/find_contraction", ACTIVE));
    }
    if scene.settings().density_correction {
        commands.push(over("flip/find_excess", ACTIVE));
    }
    if scene.has_inlets() {
        commands.push(over("flip/let_in", ACTIVE));
    }
    if slows_along_walls(scene) {
        commands.push(over(WALL_FRICTION, ACTIVE));
    }
    for pass in effects.iter().flat_map(|(_, addition)| &addition.passes) {
        commands.push(over(pass.name, ACTIVE));
    }
    if scene.has_bodies() {
        commands.push(over_pairs("flip/couple_bodies", plan, scene));
    }
    commands
}

/// Returns a dispatch of one workgroup for each brick that each body may touch.
fn over_pairs(pass: &'static str, plan: &Plan, scene: &FlipScene) -> Command {
    let pairs = bodies::most_pairs(scene, plan.grid_dims);
    Command::over(pass, WORKGROUP as usize * pairs)
}

fn carry(plan: &Plan, scene: &FlipScene) -> Vec<Command> {
    let pass = || over_pairs("flip/carry_bodies", plan, scene);
    scene.has_bodies().then(pass).into_iter().collect()
}

/// Returns whether the projection makes up for the contraction of straight paths: those of FLIP's
/// particles, in a domain that does not turn. (There Coriolis's acceleration would turn what flows
/// in.)
pub(super) fn contracts(plan: &Plan, scene: &FlipScene) -> bool {
    plan.moves && !scene.turns_velocities()
}

fn watch(plan: &Plan, scene: &FlipScene) -> Vec<Command> {
    let look = |PlannedBuffer { spec, .. }: &PlannedBuffer| Command::Dispatch {
        pass: "flip/find_not_finite",
        binds: vec![Bind {
            variable: "values",
            buffer: spec.name.clone(),
            window: None,
        }],
        groups: Groups::Threads(spec.bytes.div_ceil(4 * WATCH_RUN)),
    };
    let watched = plan.buffers.iter().filter(|buffer| buffer.is_watched);
    let mut commands: Vec<Command> = watched.map(look).collect();
    if scene.is_worked_on() {
        commands.push(over("flip/boundary_work", WET));
    }
    commands
}

fn to_particles(
    plan: &Plan,
    scene: &FlipScene,
    effects: &[(&'static str, Addition)],
) -> Vec<Command> {
    let flip = scene.settings();
    let bends = contracts(plan, scene).then(|| over("flip/bend_paths", ACTIVE));
    let mut commands: Vec<Command> = bends.into_iter().collect();
    commands.push(over("flip/find_change", ACTIVE));
    for k in 0..layers(flip.cfl).saturating_sub(1) {
        let binds = vec![LAYERS.bind(k)];
        commands.push(over_listed("flip/extrapolate", FIRST_LAYER + k, binds));
    }
    if flip.band.is_some() {
        commands.push(over("flip/carry_deep", WET));
    }
    commands.push(over("flip/grid_to_particle", WET));
    for pass in effects
        .iter()
        .flat_map(|(_, addition)| &addition.after_transfer)
    {
        commands.push(over(pass.name, WET));
    }
    if pushes(plan, scene) {
        commands.push(Command::over("flip/push_apart", plan.counts.particles));
    }
    let last = if plan.moves {
        "flip/advect"
    } else {
        "flip/aim"
    };
    commands.push(Command::over(last, plan.counts.particles));
    commands
}
