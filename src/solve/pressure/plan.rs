//! Buffers, passes and dispatch sizes of the room.

use crate::{
    domain::bricks::CELLS,
    gpu::{
        buffer::Buf,
        program::{BufferSpec, PassSpec},
        recording::{Bind, Command, Groups},
    },
    scene::flip::{Precision, Preconditioner, Pressure, Surface},
};

use super::{
    DONE, ITERATING, LEVELS, VERIFYING,
    buffers::*,
    params::{PressurePhase, ReduceStep},
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
pub(super) const PHASE_COUNT: usize = 2 * LEVELS + 7;

impl Phase {
    pub(super) fn index(self) -> usize {
        match self {
            Self::Level(level, colour) => 2 * level + colour,
            Self::Reduce(step) => 2 * LEVELS + step as usize,
            Self::Center(is_noted) => 2 * LEVELS + 5 + usize::from(is_noted),
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
pub(super) const SIZE_COUNT: usize = 2 * LEVELS + 3;

impl Size {
    pub(super) fn index(self) -> usize {
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
pub fn planned(settings: &Pressure, has_correction: bool, capacity: usize) -> Vec<BufferSpec> {
    let cells = capacity * CELLS as usize;
    let precision = settings.precision;
    let reals = |buffer: Buf<Real>, count: usize| match precision {
        Precision::F32 | Precision::F32Refined => buffer.retyped::<f32>().sized(count),
        Precision::F64 => buffer.retyped::<f64>().sized(count),
    };
    let mut specs = vec![
        PRESSURE.sized(cells),
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
        reals(SUMS, 4 * (capacity + 1024)),
        match precision {
            Precision::F32 | Precision::F32Refined => CONTROL.sized(1),
            Precision::F64 => CONTROL_F64.sized(1),
        },
        STATS.sized(1),
        SIZES.sized(SIZE_COUNT),
        GROUPS.sized(3 * SIZE_COUNT),
        PHASES.sized(PHASE_COUNT),
    ];
    if has_diagonal(settings) {
        specs.push(reals(INVERSE_DIAGONAL, cells));
    }
    if has_correction {
        specs.push(FACE_DISPLACEMENT.sized(3 * cells));
    }
    specs
}

/// Its passes.
pub fn passes(settings: &Pressure, surface: Surface, has_correction: bool) -> Vec<PassSpec> {
    let mut names = vec![
        "pressure/build_system",
        "pressure/label_cells",
        "pressure/merge_labels",
        "pressure/count_pockets",
        "pressure/center",
        "pressure/divergence",
        "pressure/direction",
        "pressure/multiply",
        "pressure/advance",
        "pressure/reduce",
        "pressure/verify",
        "pressure/project",
        "pressure/measure_divergence",
    ];
    names.extend_from_slice(match settings.preconditioner {
        Preconditioner::None | Preconditioner::Jacobi => &["pressure/precondition"],
        Preconditioner::Ipp => &["pressure/ipp_lower", "pressure/ipp_upper"],
        Preconditioner::Multigrid => &[
            "pressure/coarsen",
            "pressure/smooth_first",
            "pressure/smooth",
            "pressure/smooth_corrected",
            "pressure/restrict",
            "pressure/solve_coarse",
        ],
    });
    if has_correction {
        names.extend(["pressure/density_source", "pressure/displace"]);
    }
    let mut defines = Vec::new();
    if surface == Surface::GhostFluid {
        defines.push("GHOST_FLUID");
    }
    if has_diagonal(settings) {
        defines.push("DIAGONAL");
    }
    match settings.precision {
        Precision::F32 => {}
        Precision::F32Refined => defines.push("TWO_WORDS"),
        Precision::F64 => defines.push("F64"),
    }
    names
        .into_iter()
        .map(|name| PassSpec {
            name,
            defines: defines.clone(),
            constants: Vec::new(),
        })
        .collect()
}
