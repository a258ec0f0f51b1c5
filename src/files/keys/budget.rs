//! Keys of a scene's `[budget]`.

use super::super::{
    budget,
    key::{Interval, Key},
};

/// Range of a limit in its unit, wider than any value that `f32` resolves or that a
/// simulation reaches.
const LIMIT: Interval = 1e-12..=1e12;

/// Defaults are a few times the values of the shipped scenes; docs/scene.md lists the
/// largest of these.
pub(super) const BUDGET: &[Key] = &[
    Key::number_or_false("speed", LIMIT)
        .unit("m/s")
        .computed(budget::speed_words)
        .about("of a particle at a frame's end"),
    Key::number_or_false("speed_jump", LIMIT)
        .unit("times")
        .computed(budget::speed_jump_words)
        .about(
            "of a frame's fastest particle over the fastest before it with what gravity, \
             walls and moving solids add",
        ),
    Key::number_or_false("density_error_mean", LIMIT)
        .unit("of the rest density")
        .default("0.5")
        .about("mean of max(0, ρ/ρ0 − 1) at a frame's end"),
    Key::number_or_false("density_error_p99", LIMIT)
        .unit("of the rest density")
        .default("5.0")
        .about("its 99th percentile"),
    Key::number_or_false("density_error_max", LIMIT)
        .unit("of the rest density")
        .computed(budget::density_error_max_words)
        .about("its largest"),
    Key::number_or_false("capped", LIMIT)
        .unit("of all particles in all substeps")
        .default("0.01")
        .about("times that a particle was slowed to the displacement cap"),
    Key::number_or_false("residual", LIMIT)
        .unit("of the right-hand side's norm")
        .also(", at least solver.flip.pressure.tolerance")
        .computed(budget::residual_words)
        .about("true residual of a projection"),
    Key::number_or_false("divergence", LIMIT)
        .unit("of a cell's volume in a substep")
        .default("0.1")
        .about("largest |∇·u| Δt after a projection"),
    Key::number_or_false("volume", LIMIT)
        .unit("of the volume at the start")
        .default("false")
        .about("how far the volume may be off; measured only where it is set"),
    Key::number_or_false("energy", LIMIT)
        .unit("of the total energy in a frame")
        .computed(budget::energy_words)
        .about("rise of kinetic and potential energy beyond the work of walls and solids"),
    Key::number_or_false("particles", 1.0..=134_217_728.0)
        .default("false")
        .about(
            "how many there may be, with what emitters bring; a bake that is known to have more is \
             refused before it begins",
        ),
];
