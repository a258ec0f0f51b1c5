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

/// Symmetric sweeps if there is only one level.
const SWEEPS: usize = 8;

/// Parameters that determine the command lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Shape {
    /// Number of levels.
    pub levels: usize,
    /// Number of levels with dispatches of their own; one workgroup processes the others.
    pub dispatched: usize,
    /// Whether means are removed over pockets.
    pub has_pockets: bool,
}

/// The stages of a solve for one shape: as commands, or bound to a program's buffers.
pub(super) struct Stages<T> {
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
    pub(super) fn new(preconditioner: Preconditioner, has_correction: bool, shape: Shape) -> Self {
        let finest = |pass, when| run(pass, Phase::Level(0, 0), when, Size::Full(0));
        let finish = |pass| run(pass, Phase::Level(0, 0), When::Done, Size::Active);
        Self {
            project: build(preconditioner, shape),
            correct: has_correction.then(|| vec![finest("pressure/density_source", When::Always)]),
            begin: begin(shape),
            iterate: iteration(preconditioner, shape),
            verify: verification(shape),
            finish_project: vec![
                finish("pressure/project"),
                finest("pressure/measure_divergence", When::Done),
            ],
            finish_correct: has_correction.then(|| vec![finish("pressure/displace")]),
        }
    }

    pub(super) fn bind(&self, program: &Program) -> Stages<Recording> {
        let record = |commands: &Vec<Command>| Recording::new(program, commands);
        Stages {
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
        let all = project.into_iter().chain([self.finish_project]);
        all.chain(correct).flatten()
    }
}

/// Returns the commands of solves of every shape.
pub(crate) fn all_commands(preconditioner: Preconditioner, has_correction: bool) -> Vec<Command> {
    let mut all = Vec::new();
    for levels in (1..=LEVELS).rev() {
        for dispatched in 1..levels.max(2) {
            for has_pockets in [false, true] {
                let shape = Shape {
                    levels,
                    dispatched,
                    has_pockets,
                };
                all.extend(Stages::new(preconditioner, has_correction, shape).into_commands());
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

fn center(values: &Buf<Real>, is_noted: bool, when: When) -> Command {
    run_on(
        "pressure/center",
        Phase::Center(is_noted),
        when,
        Size::Pockets,
        Some(values),
    )
}

fn build(preconditioner: Preconditioner, shape: Shape) -> Vec<Command> {
    let finest = |pass| run(pass, Phase::Level(0, 0), When::Always, Size::Full(0));
    let mut commands = vec![Command::clear(&STATS), finest("pressure/build_system")];
    if preconditioner == Preconditioner::Multigrid {
        commands.extend((1..shape.levels).map(|level| {
            run(
                "pressure/coarsen",
                Phase::Level(level, 0),
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

fn begin(shape: Shape) -> Vec<Command> {
    let mut commands = Vec::new();
    if shape.has_pockets {
        commands.push(center(&RHS, true, When::Always));
        // With a solution of 0, the true residual is the right-hand side.
        commands.push(run(
            "pressure/verify",
            Phase::Level(0, 0),
            When::Always,
            Size::Full(0),
        ));
    }
    commands.push(reduce(ReduceStep::Begin));
    commands
}

fn iteration(preconditioner: Preconditioner, shape: Shape) -> Vec<Command> {
    let finest = |pass| run(pass, Phase::Level(0, 0), When::Iterating, Size::Full(0));
    let mut commands = match preconditioner {
        Preconditioner::None | Preconditioner::Jacobi => vec![finest("pressure/precondition")],
        Preconditioner::Ipp => vec![finest("pressure/ipp_lower"), finest("pressure/ipp_upper")],
        Preconditioner::Multigrid => cycle(shape),
    };
    if shape.has_pockets {
        commands.push(center(&CORRECTION, false, When::Iterating));
    }
    commands.extend([
        reduce(ReduceStep::Direction),
        finest("pressure/direction"),
        finest("pressure/multiply"),
        reduce(ReduceStep::Length),
        finest("pressure/advance"),
    ]);
    if shape.has_pockets {
        commands.push(center(&RESIDUAL, false, When::Iterating));
    }
    commands.push(reduce(ReduceStep::Check));
    commands
}

/// One symmetric V-cycle: down with the first colour, then the second; up with the second colour,
/// then the first.
fn cycle(shape: Shape) -> Vec<Command> {
    let half = |pass, level, colour| {
        run(
            pass,
            Phase::Level(level, colour),
            When::Iterating,
            Size::Half(level),
        )
    };
    let mut commands = Vec::new();
    if shape.levels == 1 {
        commands.push(half("pressure/smooth_first", 0, 0));
        for _ in 0..SWEEPS {
            commands.extend([1, 0].map(|colour| half("pressure/smooth", 0, colour)));
        }
        return commands;
    }
    for level in 0..shape.dispatched {
        commands.extend([
            half("pressure/smooth_first", level, 0),
            half("pressure/smooth", level, 1),
            half("pressure/restrict", level, 0),
        ]);
    }
    commands.push(run(
        "pressure/solve_coarse",
        Phase::Level(shape.dispatched, 0),
        When::Iterating,
        Size::Single,
    ));
    for level in (0..shape.dispatched).rev() {
        commands.extend([
            half("pressure/smooth_corrected", level, 1),
            half("pressure/smooth", level, 0),
        ]);
    }
    commands
}

fn verification(shape: Shape) -> Vec<Command> {
    let mut commands = vec![run(
        "pressure/verify",
        Phase::Level(0, 0),
        When::Verifying,
        Size::Full(0),
    )];
    if shape.has_pockets {
        commands.push(center(&RESIDUAL, false, When::Verifying));
    }
    commands.push(reduce(ReduceStep::Verified));
    commands
}
