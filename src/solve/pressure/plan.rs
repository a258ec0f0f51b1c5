//! Buffers, passes and dispatch sizes of the room.

use crate::plan::{Table, in_order};
use swell_domain::bricks::CELLS;
use swell_gpu::{
    buffer::Buf,
    program::PassSpec,
    recording::{Bind, Command, Groups},
};
use swell_scene::flip::{Precision, Preconditioner, Pressure, Surface};

use super::{
    DONE, ITERATING, LEVELS, VERIFYING,
    buffers::*,
    params::{PressurePhase, ReduceStep},
    stages::all_commands,
};

/// Places in `pressure_phases`.
#[derive(Clone, Copy)]
pub(super) enum Phase {
    /// Of a level's blocks of one colour; other passes over that level take colour 0's.
    Level(usize, usize),
    /// Of `pressure/reduce`.
    Reduce(ReduceStep),
    /// Of `pressure/center`, noting the means or not.
    Center(bool),
}

/// Phases in all.
pub(super) const PHASE_COUNT: usize = Phase::Center(true).index() + 1;

impl Phase {
    pub(super) const fn index(self) -> usize {
        match self {
            Self::Level(level, colour) => 2 * level + colour,
            Self::Reduce(step) => 2 * LEVELS + step as usize,
            Self::Center(is_noted) => 2 * LEVELS + 5 + is_noted as usize,
        }
    }

    /// `base` with what is this phase's own.
    pub(super) fn fill(index: usize, base: PressurePhase, half_sums: bool) -> PressurePhase {
        let wet = base.levels[0][1];
        let mut phase = base;
        if index < 2 * LEVELS {
            (phase.level, phase.colour) = (index as u32 / 2, index as u32 % 2);
        } else if index < 2 * LEVELS + 5 {
            phase.step = (index - 2 * LEVELS) as u32;
            // The preconditioner's last two passes run over one colour each.
            let is_half = half_sums && phase.step == ReduceStep::Direction as u32;
            phase.sum_count = if is_half { 2 * wet.div_ceil(2) } else { wet };
        } else {
            phase.step = (index - 2 * LEVELS - 5) as u32;
        }
        phase
    }
}

/// Places in `pressure_sizes`, and in each section of `pressure_groups`.
#[derive(Clone, Copy)]
pub(super) enum Size {
    /// A thread a block of a level.
    Full(usize),
    /// A thread a block of one colour.
    Half(usize),
    /// One workgroup.
    Single,
    /// One a pocket.
    Pockets,
    /// A thread a block of the active bricks.
    Active,
}

/// Sizes in all.
pub(super) const SIZE_COUNT: usize = Size::Active.index() + 1;

impl Size {
    pub(super) const fn index(self) -> usize {
        match self {
            Self::Full(level) => level,
            Self::Half(level) => LEVELS + level,
            Self::Single => 2 * LEVELS,
            Self::Pockets => 2 * LEVELS + 1,
            Self::Active => 2 * LEVELS + 2,
        }
    }
}

/// When a dispatch runs.
#[derive(Clone, Copy)]
pub(super) enum When {
    /// In any case.
    Always,
    /// As one workgroup that itself knows when it is its turn.
    InTurn,
    /// While the solve goes on.
    Iterating,
    /// Once it believes to be done.
    Verifying,
    /// Once it is.
    Done,
}

/// A dispatch of the room.
pub(super) fn run(pass: &'static str, phase: Phase, when: When, size: Size) -> Command {
    run_on(pass, phase, when, size, None)
}

/// The same with variable `values` bound to a buffer.
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

/// Buffers that the room adds to its inputs (module docs); `capacity` is in slots.
pub fn planned(settings: &Pressure, has_correction: bool, capacity: usize) -> Table {
    let cells = capacity * CELLS as usize;
    let precision = settings.precision;
    let reals = |buffer: Buf<Real>, count: usize| match precision {
        Precision::F32 | Precision::F32Refined => buffer.retyped::<f32>().sized(count),
        Precision::F64 => buffer.retyped::<f64>().sized(count),
    };
    let owner = "pressure";
    let mut table = Table::default();
    table.watch(owner, PRESSURE.sized(cells));
    table.extend(
        owner,
        [
            COEFFICIENT.sized(3 * cells),
            reals(DIRICHLET, cells),
            BLOCK.sized(cells / 8),
            reals(RHS, cells),
            reals(RESIDUAL, cells),
            reals(CORRECTION, cells),
            reals(DIRECTION, cells),
            reals(PRODUCT, cells),
            reals(SOLUTION, precision.terms() * cells),
            LABEL.sized(cells),
            POCKET_CELLS.sized(cells),
            POCKET_RANGES.sized(cells / 2),
            BRICKS.sized(capacity),
            // A sum a workgroup, and room for those that a dispatch in two dimensions adds.
            reals(SUMS, capacity + 1024),
            match precision {
                Precision::F32 | Precision::F32Refined => CONTROL.sized(1),
                Precision::F64 => CONTROL_F64.sized(1),
            },
            STATS.sized(1),
            SIZES.sized(SIZE_COUNT),
            GROUPS.sized(3 * SIZE_COUNT),
            PHASES.sized(PHASE_COUNT),
        ],
    );
    if has_diagonal(settings) {
        table.add(owner, reals(INVERSE_DIAGONAL, cells));
    }
    if has_correction {
        table.watch(owner, FACE_DISPLACEMENT.sized(3 * cells));
    }
    table
}

/// The passes that any solve runs by these settings, in the order in which they first run.
pub fn passes(
    settings: &Pressure,
    surface: Surface,
    has_correction: bool,
    is_periodic: bool,
) -> Vec<PassSpec> {
    let commands = all_commands(settings.preconditioner, has_correction);
    let names = in_order(&commands);
    names
        .map(|name| pass(name, settings, surface, is_periodic))
        .collect()
}

/// A pass under the conditions that hold for the whole room; one that does not ask ignores them.
fn pass(name: &'static str, settings: &Pressure, surface: Surface, is_periodic: bool) -> PassSpec {
    let conditions = [
        ("GHOST_FLUID", surface == Surface::GhostFluid),
        ("DIAGONAL", has_diagonal(settings)),
        ("TWO_WORDS", settings.precision == Precision::F32Refined),
        ("F64", settings.precision == Precision::F64),
        ("PERIODIC", is_periodic),
    ];
    let holding = conditions.into_iter().filter(|(_, holds)| *holds);
    PassSpec {
        name,
        defines: holding.map(|(define, _)| define).collect(),
        constants: Vec::new(),
    }
}
