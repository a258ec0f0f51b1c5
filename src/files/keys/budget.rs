//! Keys of a scene's `[budget]`.

use super::super::{
    budget::{self, Limit},
    declare::keys,
    key::Interval,
};

/// Range of a limit in its unit, wider than any value that `f32` resolves or that a
/// simulation reaches.
const LIMIT: Interval = 1e-12..=1e12;

// Defaults are a few times the values of the shipped scenes; docs/scene.md lists the largest of
// these.
keys! { struct BudgetSpec {
    speed: Option<Limit> = number_or_false(LIMIT)
        .unit("m/s")
        .computed(budget::speed_words)
        .about("of a particle at a frame's end"),
    speed_jump: Option<Limit> = number_or_false(LIMIT)
        .unit("times")
        .computed(budget::speed_jump_words)
        .about(
            "of a frame's fastest particle over the fastest before it with what gravity, \
             walls and moving solids add",
        ),
    density_error_mean: Limit = number_or_false(LIMIT)
        .unit("of the rest density")
        .default("0.5")
        .about("mean of max(0, ρ/ρ0 − 1) at a frame's end"),
    density_error_p99: Limit = number_or_false(LIMIT)
        .unit("of the rest density")
        .default("5.0")
        .about("its 99th percentile"),
    density_error_max: Option<Limit> = number_or_false(LIMIT)
        .unit("of the rest density")
        .computed(budget::density_error_max_words)
        .about("its largest"),
    capped: Limit = number_or_false(LIMIT)
        .unit("of all particles in all substeps")
        .default("0.01")
        .about("times that a particle was slowed to the displacement cap"),
    residual: Option<Limit> = number_or_false(LIMIT)
        .unit("of the right-hand side's norm")
        .also(", at least solver.flip.pressure.tolerance")
        .computed(budget::residual_words)
        .about("true residual of a projection"),
    divergence: Limit = number_or_false(LIMIT)
        .unit("of a cell's volume in a substep")
        .default("0.1")
        .about("largest |∇·u| Δt after a projection"),
    volume: Limit = number_or_false(LIMIT)
        .unit("of the volume at the start")
        .default("false")
        .about("how far the volume may be off; measured only where it is set"),
    energy: Option<Limit> = number_or_false(LIMIT)
        .unit("of the total energy in a frame")
        .computed(budget::energy_words)
        .about("rise of kinetic and potential energy beyond the work of walls and solids"),
    particles: Limit = number_or_false(1.0..=134_217_728.0)
        .default("false")
        .about(
            "how many there may be, with what emitters bring; a bake that is known to have more is \
             refused before it begins",
        ),
} }
