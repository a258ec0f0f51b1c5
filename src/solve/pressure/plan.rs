//! Buffers, passes and dispatch sizes of the projection.

use crate::plan::{BufferTable, in_order};
use swell_domain::bricks::CELLS;
use swell_gpu::{
    adapter::{Context, GpuError},
    buffer::Buf,
    program::PassSpec,
    recording::{Bind, Command, Groups},
};
use swell_scene::flip::{Precision, Preconditioner, Pressure, Surface};

use super::{
    DONE, ITERATING, LEVELS, VERIFYING,
    buffers::*,
    params::{PressurePhase, ReduceStep},
    stages::{Extent, all_commands},
};

/// Indices into `pressure_phases`.
#[derive(Clone, Copy)]
pub(super) enum Phase {
    /// Blocks of a level.
    Level(usize),
    /// Parameters of `pressure/reduce`.
    Reduce(ReduceStep),
    /// Parameters of `pressure/sum_pockets` and `pressure/center`; `true` if it records the means.
    Center(bool),
    /// Parameters of the passes over bodies: of the solution, or of a direction.
    Bodies(bool),
    /// Parameters of those before the solve.
    BodyWeight,
}

/// Returns the number of phases.
pub(super) const fn phase_count(extent: Extent) -> usize {
    let last = match extent.has_bodies {
        true => Phase::BodyWeight,
        false => Phase::Center(true),
    };
    last.index() + 1
}

impl Phase {
    pub(super) const fn index(self) -> usize {
        match self {
            Self::Level(level) => level,
            Self::Reduce(step) => LEVELS + step as usize,
            Self::Center(is_noted) => LEVELS + 4 + is_noted as usize,
            Self::Bodies(is_solution) => LEVELS + 6 + is_solution as usize,
            Self::BodyWeight => LEVELS + 8,
        }
    }

    /// Returns `base` with the fields of this phase.
    pub(super) fn fill(index: usize, base: PressurePhase) -> PressurePhase {
        let mut phase = base;
        phase.sum_count = base.levels[0][1];
        if index < LEVELS {
            phase.level = index as u32;
        } else if index < LEVELS + 4 {
            phase.step = (index - LEVELS) as u32;
        } else if index < LEVELS + 8 {
            phase.step = (index - LEVELS) as u32 % 2;
        } else {
            // `base` says whether it is the first projection of its substep.
            phase.step = if base.step == 0 { 2 } else { 3 };
        }
        phase
    }
}

/// Indices into `pressure_sizes`, and into each section of `pressure_groups`.
#[derive(Clone, Copy)]
pub(super) enum Size {
    /// One thread per block of a level.
    Full(usize),
    /// One workgroup.
    Single,
    /// One workgroup per part of a pocket.
    Pockets,
    /// One thread per block of the active bricks.
    Active,
    /// One workgroup per brick that bodies may touch.
    BodyBricks,
    /// One workgroup per body.
    Bodies,
}

/// Number of sizes.
pub(super) const SIZE_COUNT: usize = Size::Bodies.index() + 1;

/// Section of `pressure_groups` for the step of an iteration; the others are numbered by state.
const STEP: u32 = 3;

/// Index in `pressure_groups` of a dispatch over the finest level that takes the step of an
/// iteration.
pub const STEP_OF_FINEST: usize = STEP as usize * SIZE_COUNT + Size::Full(0).index();

impl Size {
    pub(super) const fn index(self) -> usize {
        match self {
            Self::Full(level) => level,
            Self::Single => LEVELS,
            Self::Pockets => LEVELS + 1,
            Self::Active => LEVELS + 2,
            Self::BodyBricks => LEVELS + 3,
            Self::Bodies => LEVELS + 4,
        }
    }
}

/// State of the solve in which a dispatch runs.
#[derive(Clone, Copy)]
pub(super) enum When {
    /// In any state.
    Always,
    /// In any state, as one workgroup that decides itself whether to do anything.
    InTurn,
    /// While the solve iterates.
    Iterating,
    /// When an iteration has found the length of its step.
    Stepping,
    /// When the solve has converged by its updated residual.
    Verifying,
    /// When the solve has ended.
    Done,
}

/// Returns a dispatch of the projection.
pub(super) fn run(pass: &'static str, phase: Phase, when: When, size: Size) -> Command {
    run_on(pass, phase, when, size, None)
}

/// Returns a dispatch whose variable `values` is bound to a buffer.
pub(super) fn run_on(
    pass: &'static str,
    phase: Phase,
    when: When,
    size: Size,
    values: Option<&Buf<Real>>,
) -> Command {
    let mut binds = vec![PHASES.bind(phase.index())];
    binds.extend(values.map(|buffer| Bind::whole("values", buffer)));
    let section = |state: u32| Groups::at(&GROUPS, state as usize * SIZE_COUNT + size.index());
    let groups = match when {
        When::Always => Groups::at(&SIZES, size.index()),
        When::InTurn => Groups::Threads(1),
        When::Iterating => section(ITERATING),
        When::Stepping => section(STEP),
        When::Verifying => section(VERIFYING),
        When::Done => section(DONE),
    };
    Command::Dispatch {
        pass,
        binds,
        groups,
    }
}

fn has_diagonal(settings: &Pressure) -> bool {
    matches!(
        settings.preconditioner,
        Preconditioner::Jacobi | Preconditioner::Ipp
    )
}

/// Returns the buffers that the projection adds to its inputs (see the module documentation);
/// `capacity` is in slots.
pub fn planned(settings: &Pressure, extent: Extent, capacity: usize) -> BufferTable {
    let cells = capacity * CELLS as usize;
    let precision = settings.precision;
    let reals = |buffer: Buf<Real>, count: usize| match precision {
        Precision::F32 | Precision::F32Refined => buffer.retyped::<f32>().sized(count),
        Precision::F64 => buffer.retyped::<f64>().sized(count),
    };
    let owner = "pressure";
    let mut table = BufferTable::default();
    table.watch(owner, PRESSURE.sized(cells));
    table.extend(
        owner,
        [
            COEFFICIENT.sized(3 * cells),
            reals(DIRICHLET, cells),
            BLOCK.sized(cells / 8),
            reals(RHS, cells),
            reals(RESIDUAL, cells),
            reals(CORRECTION, 2 * cells),
            reals(DIRECTION, cells),
            reals(SOLUTION, precision.terms() * cells),
            LABEL.sized(cells),
            POCKET_CELLS.sized(cells),
            // The water of a pocket has two cells at least.
            POCKET_PARTS.sized(cells / 2),
            reals(POCKET_SUMS, cells / 2),
            BRICKS.sized(capacity),
            // Sums of each workgroup, and space for the excess workgroups of a two-dimensional
            // dispatch.
            reals(SUMS, 4 * (capacity + 1024)),
            match precision {
                Precision::F32 | Precision::F32Refined => CONTROL.sized(1),
                Precision::F64 => CONTROL_F64.sized(1),
            },
            STATS.sized(1),
            SIZES.sized(SIZE_COUNT),
            GROUPS.sized(4 * SIZE_COUNT),
            PHASES.sized(phase_count(extent)),
        ],
    );
    if has_diagonal(settings) {
        table.add(owner, reals(INVERSE_DIAGONAL, cells));
    }
    table
}

/// Returns the passes of any solve with these settings, in the order in which they first run.
pub fn passes(
    settings: &Pressure,
    surface: Surface,
    extent: Extent,
    is_periodic: bool,
) -> Vec<PassSpec> {
    let commands = all_commands(settings.preconditioner, extent);
    let names = in_order(&commands);
    names
        .map(|name| pass(name, settings, surface, (extent, is_periodic)))
        .collect()
}

/// Checks that the device keeps what two words of a number have to.
///
/// # Errors
/// [`GpuError::NoErrorTerms`] if it does not, and errors of measuring it.
pub(crate) fn require(context: &Context, settings: &Pressure) -> Result<(), GpuError> {
    match settings.precision {
        Precision::F32Refined => context.rounding()?.require_two_words(context),
        Precision::F32 | Precision::F64 => Ok(()),
    }
}

/// Returns a pass with all defines of the projection; a pass ignores those that it does not use.
fn pass(
    name: &'static str,
    settings: &Pressure,
    surface: Surface,
    (extent, is_periodic): (Extent, bool),
) -> PassSpec {
    let conditions = [
        ("GHOST_FLUID", surface == Surface::GhostFluid),
        ("DIAGONAL", has_diagonal(settings)),
        (
            "MULTIGRID",
            settings.preconditioner == Preconditioner::Multigrid,
        ),
        ("TWO_WORDS", settings.precision == Precision::F32Refined),
        ("F64", settings.precision == Precision::F64),
        ("PERIODIC", is_periodic),
        ("BODIES", extent.has_bodies),
        ("CONTRACTS", extent.has_contraction),
    ];
    let holding = conditions.into_iter().filter(|(_, holds)| *holds);
    PassSpec {
        name,
        defines: holding.map(|(define, _)| define).collect(),
        constants: Vec::new(),
    }
}
