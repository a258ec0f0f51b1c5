//! Commands of a substep, and of a frame's final measurement.

use crate::{effects::Addition, params::Phase, plan::Plan};
use swell_gpu::{program::PassSpec, recording::Command, sort};
use swell_scene::PbfScene;

use super::{buffers::*, iteration::Builder, plan::cell_count};

/// Commands of PBF, and the phases that they refer to.
pub(super) struct Commands {
    /// Commands of a substep.
    pub(super) substep: Vec<Command>,
    /// Commands that sort particles at their final positions and measure the density there.
    pub(super) measure: Vec<Command>,
    /// Contents of [`PHASES`].
    pub(super) phases: Vec<Phase>,
}

impl Commands {
    pub(super) fn new(plan: &Plan, scene: &PbfScene, effects: &[(&'static str, Addition)]) -> Self {
        let mut builder = Builder::new(plan);
        Self {
            substep: substep(plan, scene, effects, &mut builder),
            measure: measure(plan, &mut builder),
            phases: builder.into_phases(),
        }
    }
}

/// Returns commands that sort particles by cell, and by id within a cell.
pub(crate) fn sorting(plan: &Plan) -> Vec<Command> {
    let n = plan.counts.particles;
    let mut commands = vec![
        Command::clear(&CELL_START),
        Command::over("pbf/assign_cells", n),
    ];
    commands.extend(sort::scan(&CELL_START, cell_count(plan)));
    commands.extend(sort::SORT_PASSES.map(|pass| Command::over(pass, n)));
    commands.push(Command::over("pbf/reorder", n));
    commands
}

fn substep(
    plan: &Plan,
    scene: &PbfScene,
    effects: &[(&'static str, Addition)],
    builder: &mut Builder<'_>,
) -> Vec<Command> {
    let pbf = scene.settings();
    let additions = || effects.iter().map(|(_, addition)| addition);
    let over = |pass: &PassSpec| Command::over(pass.name, plan.counts.particles);
    let before = additions().flat_map(|addition| &addition.before_prediction);
    let mut commands: Vec<Command> = before.map(over).collect();
    commands.push(Command::over("pbf/predict", plan.counts.particles));
    if scene.has_movers() {
        commands.insert(0, Command::clear(&WALL_WORK));
    } else if scene.reads_multipliers() {
        commands.push(Command::clear(&LAMBDA_SUM));
    }
    commands.extend(sorting(plan));
    if plan.has_lists {
        builder.over_all("pbf/build_neighbors", &mut commands);
    }
    builder.iterations(pbf, &mut commands);
    commands.push(Command::over("pbf/update_velocity", plan.counts.particles));
    if scene.has_movers() {
        commands.push(Command::over("pbf/boundary_work", plan.counts.particles));
    }
    commands.extend(
        additions()
            .flat_map(|addition| &addition.after_update)
            .map(over),
    );
    for pass in additions().flat_map(|addition| &addition.passes) {
        builder.over_all(pass.name, &mut commands);
    }
    commands
}

fn measure(plan: &Plan, builder: &mut Builder<'_>) -> Vec<Command> {
    let mut commands = vec![Command::over("pbf/predict", plan.counts.particles)];
    commands.extend(sorting(plan));
    builder.measure(&mut commands);
    commands
}
