//! Buffers, passes and dispatch sizes of the room.

use crate::{
    domain::bricks::CELLS,
    gpu::{
        program::{BufferSpec, PassSpec},
        recording::{Bind, Command, Groups},
        sort::storage,
    },
    scene::flip::{Precision, Preconditioner, Pressure, Surface},
};

use super::{
    LEVELS,
    params::{PressureBrick, PressureControl, PressureControl64, PressurePhase, PressureStats},
};

/// Bytes between two phases in `pressure_phases`.
pub(super) const PHASE_STRIDE: u64 = 256;

/// What `pressure/reduce` decides.
#[derive(Clone, Copy)]
pub(super) enum Step {
    /// Starts a solve.
    Begin,
    /// β.
    Direction,
    /// α.
    Length,
    /// Whether the residual is small enough.
    Check,
    /// Whether the true one is.
    Verified,
}

/// Places in `pressure_phases`.
#[derive(Clone, Copy)]
pub(super) enum Phase {
    /// Of a level's blocks of one colour; other passes over that level take colour 0's.
    Level(usize, usize),
    /// Of `pressure/reduce`.
    Reduce(Step),
    /// Of `pressure/center`, noting the means or not.
    Center(bool),
}

/// Phases in all.
pub(super) const PHASES: usize = 2 * LEVELS + 7;

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
            let is_half = half_sums && phase.step == Step::Direction as u32;
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
pub(super) const SIZES: usize = 2 * LEVELS + 3;

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
    values: Option<&str>,
) -> Command {
    let mut binds = vec![Bind {
        variable: "phase",
        buffer: "pressure_phases".into(),
        window: Some((
            PHASE_STRIDE * phase.index() as u64,
            size_of::<PressurePhase>() as u64,
        )),
    }];
    binds.extend(values.map(|buffer| Bind {
        variable: "values",
        buffer: buffer.into(),
        window: None,
    }));
    let offset = |section: usize| 16 * (section * SIZES + size.index()) as u64;
    let groups = match when {
        When::Always => Groups::Indirect("pressure_sizes", offset(0)),
        When::InTurn => Groups::Threads(1),
        When::Iterating => Groups::Indirect("pressure_groups", offset(0)),
        When::Verifying => Groups::Indirect("pressure_groups", offset(1)),
        When::Done => Groups::Indirect("pressure_groups", offset(2)),
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

/// Words of 32 bits of `pressure_control`.
pub fn control_words(precision: Precision) -> usize {
    match precision {
        Precision::F32 | Precision::F32Refined => size_of::<PressureControl>() / 4,
        Precision::F64 => size_of::<PressureControl64>() / 4,
    }
}

/// Buffers that the room adds to its inputs (module docs); `capacity` is in slots.
pub fn buffers(settings: &Pressure, has_correction: bool, capacity: usize) -> Vec<BufferSpec> {
    let cells = 4 * capacity as u64 * u64::from(CELLS);
    let precision = settings.precision;
    // Of what the iterations compute with.
    let real = precision.words() as u64;
    let reals = real * cells;
    let mut specs = vec![
        storage("pressure", cells),
        storage("pressure_coefficient", 3 * cells),
        storage("pressure_dirichlet", reals),
        storage("pressure_block", cells / 8),
        storage("pressure_rhs", reals),
        storage("pressure_residual", reals),
        storage("pressure_correction", reals),
        storage("pressure_direction", reals),
        storage("pressure_product", reals),
        storage("pressure_solution", precision.terms() as u64 * reals),
        storage("pressure_label", cells),
        storage("pressure_pocket_cells", cells),
        storage("pressure_pocket_ranges", cells),
        storage(
            "pressure_bricks",
            (capacity * size_of::<PressureBrick>()) as u64,
        ),
        // A sum a workgroup, and room for those that a dispatch in two dimensions adds.
        storage("pressure_sums", 4 * real * (capacity as u64 + 1024)),
        storage("pressure_control", 4 * control_words(precision) as u64),
        storage("pressure_stats", size_of::<PressureStats>() as u64),
        storage("pressure_sizes", 16 * SIZES as u64),
        storage("pressure_groups", 3 * 16 * SIZES as u64),
        BufferSpec {
            name: "pressure_phases".into(),
            bytes: PHASE_STRIDE * PHASES as u64,
            is_uniform: true,
        },
    ];
    if has_diagonal(settings) {
        specs.push(storage("pressure_inverse_diagonal", reals));
    }
    if has_correction {
        specs.push(storage("face_displacement", 3 * cells));
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
