//! The room's command lists: starting a solve, one iteration, its verification, and what follows.

use crate::{
    gpu::{
        buffer::Buf,
        program::Program,
        recording::{Command, Recording},
    },
    scene::flip::Preconditioner,
};

use super::buffers::{CORRECTION, RESIDUAL, RHS, Real, STATS};
use super::params::ReduceStep;
use super::plan::{Phase, Size, When, run, run_on};

/// Bricks of a level that one workgroup can take on together with all coarser ones.
pub(super) const SINGLE: u32 = 4;

/// Symmetric sweeps where there is but one level.
const SWEEPS: usize = 8;

/// What the command lists depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Shape {
    /// Levels in all.
    pub levels: usize,
    /// Those with dispatches of their own; one workgroup has the others.
    pub dispatched: usize,
    /// Whether pockets have their means removed.
    pub has_pockets: bool,
}

/// Bound command lists for one shape.
pub(super) struct Stages {
    /// System, bodies of water, right-hand side.
    pub project: Recording,
    /// The right-hand side alone.
    pub correct: Option<Recording>,
    /// Means removed from the right-hand side, and the start.
    pub begin: Recording,
    pub iterate: Recording,
    pub verify: Recording,
    pub finish_project: Recording,
    pub finish_correct: Option<Recording>,
}

impl Stages {
    pub(super) fn new(
        program: &Program,
        preconditioner: Preconditioner,
        has_correction: bool,
        shape: Shape,
    ) -> Self {
        let record = |commands: &[Command]| Recording::new(program, commands);
        let finest = |pass, when| run(pass, Phase::Level(0, 0), when, Size::Full(0));
        let finish = |pass| run(pass, Phase::Level(0, 0), When::Done, Size::Active);
        Self {
            project: record(&build(preconditioner, shape)),
            correct: has_correction
                .then(|| record(&[finest("pressure/density_source", When::Always)])),
            begin: record(&begin(shape)),
            iterate: record(&iteration(preconditioner, shape)),
            verify: record(&verification(shape)),
            finish_project: record(&[
                finish("pressure/project"),
                finest("pressure/measure_divergence", When::Done),
            ]),
            finish_correct: has_correction.then(|| record(&[finish("pressure/displace")])),
        }
    }
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
        // From 0, the true residual is the right-hand side.
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

/// One symmetric V-cycle: first colour, second colour, down; up, second colour, first colour.
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
