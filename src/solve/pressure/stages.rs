//! Command lists of the projection: the start of a solve, one iteration, its verification, and the
//! steps after it.

use swell_gpu::{
    buffer::Buf,
    program::Program,
    recording::{Command, Recording},
};
use swell_scene::flip::Preconditioner;

use super::{
    LEVELS,
    buffers::{CORRECTION, RESIDUAL, RHS, Real, STATS},
    params::ReduceStep,
    plan::{Phase, Size, When, run, run_on},
};

/// Most bricks of a level that one workgroup can process together with all coarser levels.
pub(super) const SINGLE: u32 = 4;

/// Parameters that determine the command lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Shape {
    /// Number of levels.
    pub levels: usize,
    /// Number of levels with dispatches of their own; one workgroup processes the others, at least
    /// the last.
    pub dispatched: usize,
    /// Whether means are removed over pockets.
    pub has_pockets: bool,
}

/// What a projection does beside making velocities divergence-free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Whether it also solves for displacements that correct the density.
    pub has_correction: bool,
    /// Whether its pressure moves bodies.
    pub has_bodies: bool,
    /// Whether it makes up for water that contracts on straight paths.
    pub has_contraction: bool,
}

/// The stages of a solve for one shape: as commands, or bound to a program's buffers.
pub(super) struct Stages<T> {
    /// Lets bodies have the weight of the water between cells' centres and their surfaces.
    pub weigh: Option<T>,
    /// Lets the water know of what contacts did to the bodies.
    pub touch: Option<T>,
    /// Builds the system, labels bodies of water, and computes the right-hand side.
    pub project: T,
    /// Computes the right-hand side of the density correction.
    pub correct: Option<T>,
    /// Removes means from the right-hand side, and starts the iteration.
    pub begin: T,
    pub iterate: T,
    pub verify: T,
    pub finish_project: T,
    pub finish_correct: Option<T>,
}

impl Stages<Vec<Command>> {
    pub(super) fn new(preconditioner: Preconditioner, extent: Extent, shape: Shape) -> Self {
        let Extent {
            has_correction,
            has_bodies,
            ..
        } = extent;
        let finest = |pass, when| run(pass, Phase::Level(0), when, Size::Full(0));
        let finish = |pass| run(pass, Phase::Level(0), When::Done, Size::Active);
        Self {
            weigh: has_bodies.then(weigh),
            touch: has_bodies.then(|| vec![carry_before()]),
            project: build(preconditioner, shape),
            correct: has_correction.then(|| vec![finest("pressure/density_source", When::Always)]),
            begin: begin(preconditioner, shape),
            iterate: iteration(preconditioner, has_bodies, shape),
            verify: verification(preconditioner, has_bodies, shape),
            finish_project: finish_project(has_bodies),
            finish_correct: has_correction.then(|| vec![finish("pressure/displace")]),
        }
    }

    pub(super) fn bind(&self, program: &Program) -> Stages<Recording> {
        let record = |commands: &Vec<Command>| Recording::new(program, commands);
        Stages {
            weigh: self.weigh.as_ref().map(record),
            touch: self.touch.as_ref().map(record),
            project: record(&self.project),
            correct: self.correct.as_ref().map(record),
            begin: record(&self.begin),
            iterate: record(&self.iterate),
            verify: record(&self.verify),
            finish_project: record(&self.finish_project),
            finish_correct: self.finish_correct.as_ref().map(record),
        }
    }

    /// Iterates over all commands in the order in which they run.
    fn into_commands(self) -> impl Iterator<Item = Command> {
        let project = [self.project, self.begin, self.iterate, self.verify];
        let correct = [self.correct, self.finish_correct].into_iter().flatten();
        let all = self
            .weigh
            .into_iter()
            .chain(self.touch)
            .chain(project)
            .chain([self.finish_project]);
        all.chain(correct).flatten()
    }
}

/// Returns the commands of solves of every shape.
pub(crate) fn all_commands(preconditioner: Preconditioner, extent: Extent) -> Vec<Command> {
    let mut all = Vec::new();
    for levels in (1..=LEVELS).rev() {
        for dispatched in usize::from(levels > 1)..levels {
            for has_pockets in [false, true] {
                let shape = Shape {
                    levels,
                    dispatched,
                    has_pockets,
                };
                all.extend(Stages::new(preconditioner, extent, shape).into_commands());
            }
        }
    }
    all
}

fn reduce(step: ReduceStep) -> Command {
    run(
        "pressure/reduce",
        Phase::Reduce(step),
        When::InTurn,
        Size::Single,
    )
}

/// Removes the mean of `values` over each pocket.
fn center(values: &Buf<Real>, is_noted: bool, when: When) -> [Command; 2] {
    ["pressure/sum_pockets", "pressure/center"].map(|pass| {
        run_on(
            pass,
            Phase::Center(is_noted),
            when,
            Size::Pockets,
            Some(values),
        )
    })
}

/// Returns the start of a V-cycle that does not follow `pressure/advance`.
fn smooth_first(preconditioner: Preconditioner) -> Option<Command> {
    (preconditioner == Preconditioner::Multigrid).then(|| {
        run(
            "pressure/smooth_first",
            Phase::Level(0),
            When::Iterating,
            Size::Full(0),
        )
    })
}

fn weigh() -> Vec<Command> {
    let pass = "pressure/move_bodies";
    let moves = run(pass, Phase::BodyWeight, When::Always, Size::Bodies);
    vec![moves, carry_before()]
}

/// Adds to the solids' flux what changed the bodies' velocities before the solve.
fn carry_before() -> Command {
    let pass = "pressure/carry_flux";
    run(pass, Phase::BodyWeight, When::Always, Size::BodyBricks)
}

fn build(preconditioner: Preconditioner, shape: Shape) -> Vec<Command> {
    let finest = |pass| run(pass, Phase::Level(0), When::Always, Size::Full(0));
    let mut commands = vec![Command::clear(&STATS), finest("pressure/build_system")];
    if preconditioner == Preconditioner::Multigrid {
        commands.extend((1..shape.levels).map(|level| {
            run(
                "pressure/coarsen",
                Phase::Level(level),
                When::Always,
                Size::Full(level),
            )
        }));
    }
    commands.extend([
        finest("pressure/label_cells"),
        finest("pressure/merge_labels"),
        finest("pressure/count_pockets"),
        finest("pressure/divergence"),
    ]);
    commands
}

fn begin(preconditioner: Preconditioner, shape: Shape) -> Vec<Command> {
    let mut commands = Vec::new();
    if shape.has_pockets {
        commands.extend(center(&RHS, true, When::Always));
        // With a solution of 0, the true residual is the right-hand side.
        commands.push(run(
            "pressure/verify",
            Phase::Level(0),
            When::Always,
            Size::Full(0),
        ));
    }
    commands.push(reduce(ReduceStep::Begin));
    commands.extend(smooth_first(preconditioner));
    commands
}

/// Sums the pressures of a direction or of the solution over the bodies, and what velocities they
/// get of it.
fn move_bodies(of_solution: bool, when: When) -> [Command; 2] {
    let phase = Phase::Bodies(of_solution);
    [
        run("pressure/push_bodies", phase, when, Size::BodyBricks),
        run("pressure/move_bodies", phase, when, Size::Bodies),
    ]
}

fn couple(of_solution: bool, when: When) -> Command {
    run(
        "pressure/couple",
        Phase::Bodies(of_solution),
        when,
        Size::BodyBricks,
    )
}

fn finish_project(has_bodies: bool) -> Vec<Command> {
    let mut commands = Vec::new();
    if has_bodies {
        commands.extend(move_bodies(true, When::Done));
        commands.push(run(
            "pressure/carry_flux",
            Phase::Bodies(true),
            When::Done,
            Size::BodyBricks,
        ));
    }
    let finest = Phase::Level(0);
    commands.extend([
        run("pressure/project", finest, When::Done, Size::Active),
        run(
            "pressure/measure_divergence",
            finest,
            When::Done,
            Size::Full(0),
        ),
    ]);
    commands
}

fn iteration(preconditioner: Preconditioner, has_bodies: bool, shape: Shape) -> Vec<Command> {
    let finest = |pass| run(pass, Phase::Level(0), When::Iterating, Size::Full(0));
    let mut commands = match preconditioner {
        Preconditioner::None | Preconditioner::Jacobi => vec![finest("pressure/precondition")],
        Preconditioner::Ipp => vec![finest("pressure/ipp_lower"), finest("pressure/ipp_upper")],
        Preconditioner::Multigrid => cycle(shape),
    };
    if shape.has_pockets {
        commands.extend(center(&CORRECTION, false, When::Iterating));
    }
    commands.push(reduce(ReduceStep::Direction));
    if has_bodies {
        commands.extend(move_bodies(false, When::Iterating));
    }
    commands.push(finest("pressure/multiply"));
    commands.extend(has_bodies.then(|| couple(false, When::Iterating)));
    commands.extend([
        reduce(ReduceStep::Length),
        run(
            "pressure/advance",
            Phase::Level(0),
            When::Stepping,
            Size::Full(0),
        ),
    ]);
    if shape.has_pockets {
        commands.extend(center(&RESIDUAL, false, When::Iterating));
        commands.extend(smooth_first(preconditioner));
    }
    commands
}

/// One symmetric V-cycle after the first smoothing of the finest level.
fn cycle(shape: Shape) -> Vec<Command> {
    let on = |pass, level, size| run(pass, Phase::Level(level), When::Iterating, size);
    let down = (1..shape.dispatched).map(|level| on("pressure/restrict", level, Size::Full(level)));
    let coarse = on("pressure/solve_coarse", shape.dispatched, Size::Single);
    let up = (0..shape.dispatched).rev();
    let up = up.map(|level| on("pressure/prolong", level, Size::Full(level)));
    down.chain([coarse]).chain(up).collect()
}

fn verification(preconditioner: Preconditioner, has_bodies: bool, shape: Shape) -> Vec<Command> {
    let mut commands = vec![run(
        "pressure/verify",
        Phase::Level(0),
        When::Verifying,
        Size::Full(0),
    )];
    if has_bodies {
        commands.extend(move_bodies(true, When::Verifying));
        commands.push(couple(true, When::Verifying));
    }
    if shape.has_pockets {
        commands.extend(center(&RESIDUAL, false, When::Verifying));
    }
    commands.push(reduce(ReduceStep::Verified));
    commands.extend(smooth_first(preconditioner));
    commands
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_iteration_has_two_dispatches_a_level_and_four_more() {
        let dispatches = |levels, dispatched| {
            let shape = Shape {
                levels,
                dispatched,
                has_pockets: false,
            };
            iteration(Preconditioner::Multigrid, false, shape).len()
        };
        for (levels, dispatched) in [(2, 1), (3, 2), (4, 3), (8, 7)] {
            assert_eq!(dispatches(levels, dispatched), 4 + 2 * dispatched);
        }
        // One workgroup also solves a single brick.
        assert_eq!(dispatches(1, 0), 5);
    }
}
