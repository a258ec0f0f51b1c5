//! Faults in PBF's passes.

use super::{Control, control};

/// Passes that look for neighbours in cells that do not contain them, and so do not find them.
const UNSORTED: [&str; 6] = [
    "sort/place",
    "sort/stabilize",
    "pbf/build_neighbors",
    "pbf/compute_delta",
    "pbf/measure_density",
    "pbf/assign_cells",
];

/// Faults in a scene with moving walls.
pub const PBF_WALLS: &[Control] = &[
    control(
        "pbf/predict",
        "= work_of_pushes();",
        "= 1.001 * work_of_pushes();",
        "pbf/predict",
        &["work of walls"],
    ),
    control(
        "pbf/compute_delta",
        "of_high * params.wall_velocity_max - of_low",
        "of_high * params.wall_velocity_max + of_low",
        "pbf/compute_delta",
        &["work of walls"],
    ),
    control(
        "pbf/boundary_work",
        "for (var k = 0u;",
        "for (var k = 1u;",
        "pbf/boundary_work",
        &["shares of the work"],
    ),
];

pub const PBF: &[Control] = &[
    control(
        "pbf/predict",
        "params.time_step * v;",
        "params.time_step * v * 1.0001;",
        "pbf/predict",
        &["predicted position"],
    ),
    control(
        "pbf/predict",
        "(x - free) * params.inverse_time_step",
        "(free - x) * params.inverse_time_step",
        "pbf/predict",
        &["velocity"],
    ),
    control(
        "pbf/assign_cells",
        "cell_of[thread] = cell;",
        "cell_of[thread] = cell ^ 1u;",
        "pbf/assign_cells",
        &["cell"],
    )
    .and(&UNSORTED),
    control(
        "effects/absorb_particles",
        "(1.0 - part) *",
        "(1.0001 - part) *",
        "effects/absorb_particles",
        &["velocity"],
    ),
    control(
        "effects/absorb_particles",
        "part * current()",
        "1.001 * part * current()",
        "effects/absorb_particles",
        &["velocity"],
    ),
    control(
        "effects/generate_particles",
        "+ current()",
        "+ 2.0 * current()",
        "effects/generate_particles",
        &["velocity"],
    ),
    control(
        "effects/drag_by_density",
        "- fall, fall, share",
        "- fall, 0.99 * fall, share",
        "effects/drag_by_density",
        &["velocity"],
    ),
    control(
        "effects/generate_particles",
        "v + part * (wave",
        "v + 1.1 * part * (wave",
        "effects/generate_particles",
        &["velocity"],
    ),
    control(
        "pbf/assign_cells",
        "atomicAdd(&cell_start[cell], 1u)",
        "atomicAdd(&cell_start[cell], 1u) * 2u",
        "pbf/assign_cells",
        &["slots in cells"],
    )
    .and(&UNSORTED),
    control(
        "sort/scan_blocks",
        "values[first + k] = base + own[k];",
        "values[first + k] = base + own[k] + u32(first == 64u);",
        "sort/scan_blocks",
        &["sums within a block"],
    ),
    control(
        "sort/add_block_sums",
        "+= block_sums[i / 1024u]",
        "+= block_sums[i / 1024u] * 0u",
        "sort/add_block_sums",
        &["sums"],
    ),
    control(
        "sort/place",
        "slot_in_cell[i]] = i",
        "slot_in_cell[i]] = i ^ 1u",
        "sort/place",
        &["elements by cell"],
    )
    .and(&UNSORTED),
    control(
        "sort/stabilize",
        "id[placed[k]] < own",
        "id[placed[k]] > own",
        "sort/stabilize",
        &["elements by cell and id"],
    ),
    control(
        "pbf/reorder",
        "vec4f(three(x), 0.0)",
        "vec4f(three(x) * 1.000001, 0.0)",
        "pbf/reorder",
        &["position"],
    ),
    control(
        "pbf/reorder",
        "= velocity[source]",
        "= packed(-three(velocity[source]))",
        "pbf/reorder",
        &["velocity"],
    ),
    control(
        "pbf/reorder",
        "= id[source]",
        "= id[source] ^ 1u",
        "pbf/reorder",
        &["id"],
    ),
    control(
        "pbf/build_neighbors",
        "square_between(own, place[j]) < REACH",
        "square_between(own, place[j]) < 0.97 * REACH",
        "pbf/build_neighbors",
        &["wrong members of a list"],
    ),
    control(
        "pbf/build_neighbors",
        "square_between(own, place[j]) < REACH",
        "square_between(own, place[j]) < 1.03 * REACH",
        "pbf/build_neighbors",
        &["wrong members of a list"],
    ),
    control(
        "pbf/reorder",
        "place_word(three(x) *",
        "place_word((three(x) + 0.01 * params.support_radius * f32(thread & 1u)) *",
        "pbf/reorder",
        &["place in a word"],
    )
    .and(&["pbf/build_neighbors"]),
    control(
        "pbf/build_neighbors",
        "const UNSURE = 2.0;",
        "const UNSURE = 0.0;",
        "pbf/build_neighbors",
        &["wrong members of a list"],
    ),
    control(
        "pbf/build_neighbors",
        "(a >> 20u) - (b >> 20u)",
        "(a >> 21u) - (b >> 21u)",
        "pbf/build_neighbors",
        &["wrong members of a list"],
    ),
    control(
        "pbf/compute_lambda",
        "kernel_sum += mass * p * p * p;",
        "kernel_sum += mass * p * p * p * 1.0001;",
        "pbf/compute_lambda",
        &["lambda"],
    ),
    control(
        "pbf/compute_lambda",
        "own = wall.gradient - ",
        "own = -wall.gradient - ",
        "pbf/compute_lambda",
        &["lambda"],
    ),
    control(
        "pbf/compute_delta",
        "delta = -params.gradient_scale * delta",
        "delta = params.gradient_scale * delta",
        "pbf/compute_delta",
        &["corrected position"],
    ),
    control(
        "pbf/exchange",
        "three(corrected[i]), before.w",
        "three(corrected[i ^ 1u]), before.w",
        "pbf/exchange",
        &["position"],
    ),
    control(
        "pbf/exchange",
        "three(corrected[i]), before.w",
        "three(corrected[i]), 0.5 * before.w",
        "pbf/exchange",
        &["lambda carried along"],
    ),
    control(
        "pbf/update_velocity",
        "vec4f(x, 0.0)",
        "vec4f(1.000001 * x, 0.0)",
        "pbf/update_velocity",
        &["position for neighbours"],
    )
    // It reads neighbours' positions there, and its own particle's from the cache.
    .and(&["effects/viscosity_gather"]),
    control(
        "pbf/update_velocity",
        "* params.inverse_time_step;",
        "* params.inverse_time_step * 1.001;",
        "pbf/update_velocity",
        &["velocity"],
    ),
    control(
        "pbf/update_velocity",
        "x -= excess * params.time_step",
        "x += excess * params.time_step",
        "pbf/update_velocity",
        &["position"],
    ),
    control(
        "pbf/update_velocity",
        "atomicAdd(&counters.capped, 1u)",
        "atomicAdd(&counters.capped, 3u)",
        "pbf/update_velocity",
        &["particles slowed"],
    ),
    control(
        "pbf/update_velocity",
        "id[thread] = id[params.particle_count + thread]",
        "id[thread] = id[params.particle_count + thread] ^ 1u",
        "pbf/update_velocity",
        &["id"],
    ),
    control(
        "pbf/measure_density",
        "+ wall_term(xi).density",
        "+ 0.999 * wall_term(xi).density",
        "pbf/measure_density",
        &["relative density"],
    ),
    control(
        "effects/viscosity_gather",
        "(p * p * p)",
        "(p * p)",
        "effects/viscosity_gather",
        &["change of velocity"],
    ),
    control(
        "effects/viscosity_apply",
        "+ three(viscosity_change[i])",
        "- three(viscosity_change[i])",
        "effects/viscosity_apply",
        &["velocity"],
    ),
    control(
        "effects/vorticity_curl",
        "curl += cross",
        "curl -= cross",
        "effects/vorticity_curl",
        &["vorticity"],
    ),
    control(
        "effects/vorticity_curl",
        "length(curl)",
        "length(curl) * 1.001",
        "effects/vorticity_curl",
        &["its length"],
    ),
    control(
        "effects/vorticity_force",
        "cross(slope / steepness, three(vorticity[i]))",
        "cross(three(vorticity[i]), slope / steepness)",
        "effects/vorticity_force",
        &["velocity"],
    ),
    control(
        "pbf/assign_cells",
        "atomicAdd(&cell_start[cell], 1u)",
        "atomicAdd(&cell_start[cell ^ 1u], 1u)",
        "pbf/assign_cells",
        &["particles in cells"],
    )
    .and(&UNSORTED),
    control(
        "pbf/update_velocity",
        "* params.inverse_time_step;",
        "* params.inverse_time_step * 0.5;",
        "pbf/update_velocity",
        &["velocity"],
    ),
    control(
        "pbf/build_neighbors",
        "square_between(own, place[j]) < REACH",
        "square_between(own, place[j]) < 0.85 * REACH",
        "whole solve",
        &[
            "corrections, RMS error",
            "relative density, RMS error",
            "lambda, RMS error",
        ],
    )
    .and(&["pbf/build_neighbors"]),
];

/// Faults that show only in chunks after the first.
pub const CHUNKED: &[Control] = &[
    control(
        "pbf/build_neighbors",
        "i - phase.first",
        "i - phase.first / 2u",
        "pbf/build_neighbors",
        &["wrong members of a list"],
    )
    .and(&["pbf/compute_lambda", "pbf/compute_delta"]),
    control(
        "pbf/compute_lambda",
        "i - phase.first",
        "i - phase.first / 2u",
        "pbf/compute_lambda",
        &["lambda"],
    ),
    control(
        "pbf/compute_delta",
        "i - phase.first",
        "i - phase.first / 2u",
        "pbf/compute_delta",
        &["corrected position"],
    ),
];

/// Faults of the search that replaces the lists.
pub const SEARCHED: &[Control] = &[
    control(
        "pbf/compute_lambda",
        "if j != i {",
        "if j != i + 1u {",
        "pbf/compute_lambda",
        &["lambda"],
    ),
    control(
        "pbf/compute_delta",
        "let low = max(centre - 1, vec3i(0));",
        "let low = max(centre, vec3i(0));",
        "pbf/compute_delta",
        &["corrected position"],
    ),
    // With positions in two bindings.
    control(
        "pbf/compute_lambda",
        "predicted_high[j - PAGE]",
        "predicted_high[j + 1u - PAGE]",
        "pbf/compute_lambda",
        &["lambda"],
    ),
    control(
        "pbf/compute_lambda",
        "predicted_high[i - PAGE].w = lambda",
        "predicted_high[i - PAGE].w = 0.99 * lambda",
        "pbf/compute_lambda",
        &["lambda"],
    ),
];
