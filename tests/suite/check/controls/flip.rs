//! Faults in FLIP's passes.

use super::{Control, control, own};

/// Passes that are given another system than the reference's.
pub const SYSTEM: &[&str] = &[
    "pressure/multiply",
    "pressure/divergence",
    "pressure/measure_divergence",
    "pressure/density_source",
    "pressure/project",
    "pressure/verify",
    "pressure/count_pockets",
    "pressure/center",
    "pressure/reduce",
    "pressure/coarsen",
    "pressure/sum_pockets",
    "pressure/smooth_first",
    "pressure/solve_coarse",
    "pressure/prolong",
    "pressure/advance",
];

/// Passes whose inputs follow the order of the particles.
const SORTED: &[&str] = &[
    "sort/place",
    "sort/stabilize",
    "flip/gather_faces",
    "flip/gather_centers",
    "flip/find_water",
    "flip/find_excess",
    "flip/grid_to_particle",
    "flip/push_apart",
    "flip/advect",
];

/// The field of both passes that find it.
const STRAIN: &[&str] = &["weight of the midpoint rule"];

const fn of_contraction(from: &'static str, to: &'static str) -> Control {
    let fields = &["flux that makes up for contraction"];
    control(
        "flip/find_contraction",
        from,
        to,
        "flip/find_contraction",
        fields,
    )
}

pub const FLIP: &[Control] = &[
    own(
        "flip/boundary_work",
        "for (var k = 0u;",
        "for (var k = 16u;",
        &["shares of the work"],
    ),
    own(
        "flip/survey",
        "dot(v, v)",
        "dot(v, v) * 1.001",
        &["largest speed squared"],
    ),
    own(
        "flip/reorder",
        "sorted_position[i] = x",
        "sorted_position[i] = packed(1.000001 * three(x))",
        &["position"],
    ),
    own(
        "flip/reorder",
        "= velocity[source]",
        "= packed(-three(velocity[source]))",
        &["velocity"],
    ),
    own("flip/reorder", "= id[source]", "= id[source] ^ 1u", &["id"]),
    own(
        "flip/cut_cells",
        "face_open[element] = lower.x",
        "face_open[element] = lower.x * 0.9999",
        &["open fraction"],
    ),
    own(
        "flip/cut_cells",
        "open_volume[element] = volume;\n    open_hats[element] = hats;\n    let weight = ",
        "open_volume[element] = volume * 0.999;\n    open_hats[element] = hats * 0.999;\n    \
         let weight = 0.999 * ",
        &[
            "open volume",
            "open part of the hat",
            "weight of faces for particles",
        ],
    ),
    own(
        "flip/cut_cells",
        "pack2x16unorm(hat.layers.xy)",
        "pack2x16unorm(0.999 * hat.layers.xy)",
        &["open part of the hat's layers"],
    ),
    control(
        "flip/spread_faces",
        "lower_momentum += both",
        "lower_momentum -= both",
        "flip/gather_faces",
        &["velocity at faces"],
    ),
    own(
        "flip/gather_faces",
        "velocity + params.velocity_step",
        "velocity - params.velocity_step",
        &["velocity with gravity"],
    ),
    own(
        "flip/gather_faces",
        "u32(is_known)",
        "u32(!is_known)",
        &["whether particles are near"],
    ),
    control(
        "flip/spread_centers",
        "own += layer * z.y",
        "own += layer * z.y * 0.99",
        "flip/gather_centers",
        &["relative density"],
    ),
    own(
        "flip/find_water",
        "share >= 0.5",
        "share >= 0.6",
        &["kind of cell"],
    ),
    own(
        "flip/find_water",
        "-depth * params.cell_size",
        "depth * params.cell_size",
        &["distance of the surface"],
    ),
    own(
        "flip/find_water",
        "LEAST_DEPTH = 0.02",
        "LEAST_DEPTH = 0.5",
        &["distance of the surface"],
    ),
    own(
        "flip/find_strain",
        "atomicStore(&most_of_group, 0u)",
        "atomicStore(&most_of_group, 0x3f800000u)",
        STRAIN,
    )
    .and(&["flip/find_contraction", "flip/bend_paths"]),
    of_contraction("-rate * rate * minors", "-1.001 * rate * rate * minors"),
    control(
        "flip/find_strain",
        "is_far_a == is_far_b",
        "is_far_a != is_far_b",
        "flip/find_contraction",
        &["flux that makes up for contraction"],
    )
    .and(&["flip/find_strain"]),
    of_contraction("-(along.yzx + ", "-(1.01 * along.yzx + "),
    of_contraction("own * slopes[component]", "1.01 * own * slopes[component]"),
    of_contraction("any(to > vec3i(0))", "any(to < vec3i(0))"),
    of_contraction("face_open[face_at(axis, at)] * straight", "straight"),
    own("flip/bend_paths", "MOST = 0.05", "MOST = 0.000001", STRAIN),
    own(
        "pressure/divergence",
        "return flux - vec4r",
        "return flux + vec4r",
        &["right-hand side"],
    ),
    own(
        "flip/find_excess",
        "= select(0.0, excess * volume, is_water)",
        "= select(0.0, -excess * volume, is_water)",
        &["density excess"],
    ),
    own(
        "flip/let_in",
        "solid_flux[element] -= over",
        "solid_flux[element] -= 0.999 * over",
        &["flux with what enters"],
    ),
    own(
        "flip/let_in",
        "min(density_excess[element], 0.0)",
        "density_excess[element]",
        &["density excess"],
    ),
    own(
        "effects/grid_curl",
        "by_y.z - by_z.y",
        "by_y.z + by_z.y",
        &["vorticity"],
    ),
    own(
        "effects/grid_confinement",
        "omega = 0.5",
        "omega = -0.5",
        &["velocity at faces"],
    ),
    own(
        "effects/drag_by_cells",
        "params.velocity_step, share",
        "0.99 * params.velocity_step, share",
        &["velocity"],
    ),
    own(
        "effects/absorb_faces",
        "part * excess",
        "1.001 * part * excess",
        &["velocity at faces"],
    ),
    own(
        "effects/absorb_faces",
        "- current()",
        "- 1.001 * current()",
        &["velocity at faces"],
    ),
    own(
        "effects/generate_faces",
        "+ current()",
        "+ 1.1 * current()",
        &["velocity at faces"],
    ),
    own(
        "effects/generate_faces",
        "(speed.x * along,",
        "(1.02 * speed.x * along,",
        &["velocity at faces"],
    ),
    own(
        "effects/generate_faces",
        "exp(wave.w * below)",
        "exp(wave.w * 1.05 * below)",
        &["velocity at faces"],
    ),
    own(
        "pressure/divergence",
        "pressure_rhs[own + 64u * c] = -b.lo[c]",
        "pressure_rhs[own + 64u * c] = b.lo[c]",
        &["right-hand side"],
    ),
    own(
        "pressure/multiply",
        "pressure_correction[phase.stride + e] = product.lo[c]",
        "pressure_correction[phase.stride + e] = product.lo[c] * 1.001",
        &["system times direction"],
    )
    .and(&["pressure/reduce"]),
    own(
        "pressure/project",
        "- change)",
        "+ change)",
        &["velocity at faces"],
    ),
    own(
        "pressure/project",
        "+ phase.pressure_scale",
        "- phase.pressure_scale",
        &["pressure"],
    ),
    own(
        "pressure/density_source",
        "real(excess)",
        "real(excess) * 1.001",
        &["right-hand side"],
    ),
    own(
        "pressure/displace",
        "-face.difference",
        "face.difference",
        &["displacement at faces"],
    ),
    own(
        "flip/find_change",
        "face_velocity[face] - face_change[face]",
        "face_velocity[face] + face_change[face]",
        &["change at faces"],
    ),
    own(
        "flip/extrapolate",
        "face_velocity[face] = sum /",
        "face_velocity[face] = 1.001 * sum /",
        &["velocity at faces"],
    ),
    own(
        "flip/grid_to_particle",
        "params.pic_blend * (u - advanced)",
        "params.pic_blend * (advanced - u)",
        &["velocity"],
    ),
    own(
        "flip/push_apart",
        "max(apart - distance, 0.0) * direction",
        "max(apart - distance, 0.0) * 1.01 * direction",
        &["displacement"],
    ),
    own(
        "flip/push_apart",
        "max(apart - distance, 0.0) * direction",
        "(apart - distance) * direction",
        &["displacement"],
    ),
    control(
        "flip/reorder",
        "place_word(three(x) *",
        "place_word((three(x) + 0.1 * params.cell_size * f32(i & 1u)) *",
        "flip/push_apart",
        &["displacement"],
    ),
    own(
        "flip/push_apart",
        "* STEPS + UNSURE",
        "* 0.8 * STEPS",
        &["displacement"],
    ),
    own(
        "flip/advect",
        "params.time_step * between",
        "1.001 * params.time_step * between",
        &["position"],
    ),
    own(
        "flip/assign_cells",
        "cell_of[i] = element;",
        "cell_of[i] = element ^ 1u;",
        &["cell", "particles in cells"],
    )
    .and(SORTED),
    own(
        "flip/assign_cells",
        "atomicAdd(&cell_start[element], 1u)",
        "atomicAdd(&cell_start[element], 1u) * 2u",
        &["slots in cells"],
    )
    .and(SORTED),
    own(
        "flip/survey",
        "atomicMax(&survey.head.speed_square, bitcast<u32>(fastest));",
        "atomicMax(&survey.head.speed_square, bitcast<u32>(fastest)); \
         atomicStore(&survey.is_wet[12u], 1u);",
        &["bricks with water"],
    ),
    own(
        "flip/cut_cells",
        "select(SOLID, AIR, is_open)",
        "select(AIR, AIR, is_open)",
        &["kind of cell"],
    ),
    own(
        "flip/cut_cells",
        "= pushed.x + pushed.y + pushed.z",
        "= pushed.x + pushed.y - pushed.z + 0.01",
        &["flux of solids"],
    ),
    own(
        "effects/grid_curl",
        "= length(curl)",
        "= 1.001 * length(curl)",
        &["its length"],
    )
    .and(&["effects/grid_confinement"]),
    own(
        "pressure/build_system",
        "row.dirichlet += air",
        "row.dirichlet += air * 1.001",
        &["what air adds to the diagonal"],
    )
    .and(SYSTEM),
    own(
        "pressure/build_system",
        "row.coefficient[k] = coefficient",
        "row.coefficient[k] = coefficient * 0.999",
        &["coefficients"],
    )
    .and(SYSTEM),
    own(
        "pressure/build_system",
        "(rows << 8u)",
        "((rows ^ 1u) << 8u)",
        &["rows"],
    )
    .and(SYSTEM),
    own(
        "pressure/divergence",
        "worst / phase.cell_size",
        "worst",
        &["largest divergence"],
    ),
    own(
        "pressure/measure_divergence",
        "worst / phase.cell_size",
        "1.0 + worst / phase.cell_size",
        &["largest divergence"],
    ),
    control(
        "pressure/reduce",
        "let target_square = real",
        "let target_square = 1e6 * real",
        "whole projection",
        &[
            "‖b − A x‖ / ‖b‖",
            "‖p − p64‖ / ‖p64‖",
            "‖u − u64‖",
            "‖∇·u‖ after / before",
        ],
    )
    .and(&["pressure/reduce"]),
    control(
        "pressure/reduce",
        "let target_square = real",
        "let target_square = 1e6 * real",
        "whole correction",
        &["‖b − A x‖ / ‖b‖"],
    )
    .and(&["pressure/reduce"]),
    own(
        "flip/find_change",
        "1u, is_beside)",
        "2u, is_beside)",
        &["layers"],
    ),
    own(
        "flip/extrapolate",
        "face_change[face] = change;",
        "face_change[face] = -change;",
        &["change at faces"],
    ),
    own(
        "flip/extrapolate",
        "own_layer << (8u * component)",
        "(own_layer + 1u) << (8u * component)",
        &["layers"],
    ),
    own(
        "flip/grid_to_particle",
        "carried[k] = u;",
        "carried[k] = 1.001 * u;",
        &["velocity of the grid"],
    ),
    own(
        "flip/grid_to_particle",
        "= per_whole * value_at(faces.shift, a, b, c)",
        "= -per_whole * value_at(faces.shift, a, b, c)",
        &["displacement"],
    ),
    own(
        "flip/advect",
        "velocity[i] = packed(v)",
        "velocity[i] = packed(v * 1.00001)",
        &["velocity"],
    ),
    own(
        "flip/advect",
        "atomicAdd(&counters.capped, 1u)",
        "atomicAdd(&counters.capped, 3u)",
        &["particles slowed"],
    ),
    own(
        "flip/advect",
        "id[i] = id[params.particle_count + i]",
        "id[i] = id[params.particle_count + i] ^ 1u",
        &["id"],
    ),
    own(
        "pressure/coarsen",
        "0.25 * sum",
        "0.2501 * sum",
        &["coefficients"],
    ),
    own(
        "pressure/coarsen",
        "0.5 * air",
        "0.501 * air",
        &["what air adds to the diagonal"],
    ),
    own(
        "pressure/coarsen",
        "select(2u, 1u, is_full), 0u, is_empty",
        "select(2u, 2u, is_full), 2u, is_empty",
        &["kind of block"],
    ),
    own(
        "pressure/smooth_first",
        "wr + w * (",
        "wr - w * (",
        &["correction"],
    )
    .and(&["pressure/reduce"]),
    own(
        "pressure/prolong",
        "about.zu + above.upper.z",
        "about.zu + 1.01 * above.upper.z",
        &["correction"],
    ),
    // Further controls, with something to restrict and to sweep, are in the variant of a channel.
    own(
        "pressure/solve_coarse",
        "wr + w * (",
        "wr - w * (",
        &["correction"],
    ),
    own(
        "pressure/solve_coarse",
        "= 0.5 * sum_pair(flow);",
        "= 0.5 * sum_pair(flow) + 1e-3;",
        &["residuals of the coarser levels"],
    ),
    own(
        "pressure/advance",
        "correction + kept",
        "correction - kept",
        &["direction"],
    ),
    own(
        "pressure/advance",
        "wr + w * (",
        "wr - w * (",
        &["next correction"],
    )
    .and(&["pressure/reduce"]),
    own(
        "pressure/advance",
        "+ alpha_small * p",
        "- alpha_small * p",
        &["solution, both words"],
    ),
    own(
        "pressure/advance",
        "- alpha * pressure_correction[phase.stride + e]",
        "- 1.001 * alpha * pressure_correction[phase.stride + e]",
        &["residual"],
    ),
    own(
        "pressure/verify",
        "= pressure_rhs[own + 64u * c] - main_part",
        "= 1.001 * pressure_rhs[own + 64u * c] - main_part",
        &["residual"],
    ),
    own(
        "pressure/reduce",
        "pressure_control.alpha = alpha",
        "pressure_control.alpha = 1.001 * alpha",
        &["sums and what follows"],
    ),
    // A sum that does not match the values that the pass wrote.
    control(
        "pressure/multiply",
        "vec3r(dot_pair(p, product)",
        "vec3r(1.001 * dot_pair(p, product)",
        "pressure/reduce",
        &["sums and what follows"],
    ),
    own(
        "pressure/reduce",
        "pressure_control.iterations += 1u",
        "pressure_control.iterations += 2u",
        &["state, iterations, restarts"],
    ),
    control(
        "pressure/label_cells",
        "&& air == 0.0",
        "&& air >= 0.0",
        "pressure/count_pockets",
        &["labels of water that no air touches", "pockets"],
    )
    .and(&[
        "pressure/sum_pockets",
        "pressure/center",
        "pressure/reduce",
        "pressure/verify",
    ]),
];
