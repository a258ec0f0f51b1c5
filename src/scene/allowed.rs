//! What each key of a scene allows, in words: one table for every message.

/// What the value at a dotted path may be; indices do not matter.
pub(super) fn of(path: &str) -> Option<&'static str> {
    let mut plain = String::with_capacity(path.len());
    let mut depth = 0;
    for c in path.chars() {
        match c {
            '[' => depth += 1,
            ']' => depth -= 1,
            _ if depth == 0 => plain.push(c),
            _ => {}
        }
    }
    TABLE
        .iter()
        .find(|(key, _)| *key == plain)
        .map(|(_, allowed)| *allowed)
}

/// Every key of a scene, tables included, without indices: all but those of studies and tolerances.
#[cfg(test)]
pub(super) fn scene_keys() -> impl Iterator<Item = &'static str> {
    const OTHERS: [&str; 23] = [
        "case",
        "limit",
        "coarser",
        "kind",
        "scene",
        "about",
        "set",
        "key",
        "values",
        "steps",
        "seconds",
        "repeats",
        "errors",
        "convergence_point",
        "method",
        "look",
        "solvers",
        "frames",
        "pictures",
        "position",
        "velocity",
        "attributes",
        "aggregates",
    ];
    let keys = TABLE.iter().map(|(key, _)| *key);
    keys.filter(|key| !OTHERS.contains(&key.split('.').next().unwrap_or(key)))
}

const TRANSLATE: &str = "three numbers from -1e9 to 1e9, metres";
const ROTATE: &str = "three numbers from -1e6 to 1e6, degrees about x, then y, then z";
const SCALE: &str = "a number from 1e-6 to 1e6, or three of them; negative ones mirror";
const BLAKE3: &str = "the BLAKE3 of the file in hex, or nothing";

const SET: &str = "an array of overrides of the scene, such as [\"solver.pbf.iterations=8\"]";
const KEY: &str =
    "a key of the scene, such as \"solver.pbf.iterations\", or \"device\", here or for all methods";
const COARSER: &str = "an array of overrides of the scene that make the last value's run coarser, with errors against a \
     finest run or of a projection";
const VALUES: &str = "two or more values of the key, from coarse to fine, here or for all methods";

const BOUND: &str = "a number from -1e12 to 1e12; one of at_most and at_least";
const AFTER: &str = "a number from 0 to 1e8, seconds";
const SHIFT: &str = "three numbers from -1e9 to 1e9, metres";
const REGION: &str = "two corners, each three numbers from -1e9 to 1e9, metres";
const SOLVERS: &str = "an array of \"pbf\" and \"flip\"; both if left out";
const DEVICES: &str = "an array of \"gpu\" and \"cpu\"; both if left out";
const MARK: &str = "an array of tables [[mark]] of of and at_most or at_least";
const MEASURED: &str =
    "a name of swell::scene::study::stability::Quantity, such as \"least_spacing\"";

const TABLE: &[(&str, &str)] = &[
    ("shot", "a table with name, frames, frames_per_second"),
    (
        "shot.name",
        "1 to 100 letters, digits, \"_\", \"-\" and \".\", the first a letter or digit",
    ),
    ("shot.frames", "a whole number from 1 to 1000000"),
    (
        "shot.frames_per_second",
        "a number from 0.01 to 100000, per second",
    ),
    ("domain", "a table with min and max"),
    (
        "domain.min",
        "three numbers from -1e6 to 1e6, metres, each below max by 1e-8 at least",
    ),
    (
        "domain.max",
        "three numbers from -1e6 to 1e6, metres, each above min by 1e-8 at least",
    ),
    (
        "water",
        "a table with rest_density, gravity, block, mesh and particles",
    ),
    ("water.rest_density", "a number from 0.01 to 100000, kg/m³"),
    ("water.gravity", "three numbers from -10000 to 10000, m/s²"),
    ("water.block", "an array of tables [[water.block]]"),
    (
        "water.block.min",
        "three numbers, metres, in the domain and below max",
    ),
    (
        "water.block.max",
        "three numbers, metres, in the domain and above min",
    ),
    ("water.mesh", "an array of tables [[water.mesh]]"),
    (
        "water.mesh.file",
        "a closed .obj, .ply or .stl within the domain, relative to the scene file",
    ),
    ("water.mesh.blake3", BLAKE3),
    ("water.mesh.translate", TRANSLATE),
    ("water.mesh.rotate_degrees", ROTATE),
    ("water.mesh.scale", SCALE),
    ("water.particles", "an array of tables [[water.particles]]"),
    (
        "water.particles.at",
        "an array of [x, y, z], metres, in the domain",
    ),
    (
        "water.particles.velocity",
        "three numbers from -10000 to 10000, m/s, of all of them; 0 if left out",
    ),
    ("solid", "an array of tables [[solid]]"),
    (
        "solid.mesh",
        "a closed .obj, .ply or .stl that reaches into the domain, relative to the scene file",
    ),
    ("solid.blake3", BLAKE3),
    ("solid.translate", TRANSLATE),
    ("solid.rotate_degrees", ROTATE),
    ("solid.scale", SCALE),
    (
        "solid.direction",
        "three numbers from -1e6 to 1e6, not all 0, with motion; their length does not count",
    ),
    (
        "solid.motion",
        "a motion, with direction, that brings the solid into the domain and not ten domains away",
    ),
    (
        "solid.motion.kind",
        "\"constant_velocity\", \"sine\" or \"table\"",
    ),
    (
        "solid.motion.velocity",
        "a number from 1e-9 to 100000, m/s along direction",
    ),
    ("solid.motion.until", "a number from 1e-6 to 1e9, seconds"),
    ("solid.motion.stroke", "a number from 1e-9 to 1e6, metres"),
    ("solid.motion.period", "a number from 1e-4 to 1e6, seconds"),
    (
        "solid.motion.ramp",
        "0 or a number from 1e-4 to 1e6, seconds; one period if left out",
    ),
    (
        "solid.motion.file",
        "a CSV of time,displacement (seconds, metres), relative to the scene file",
    ),
    (
        "solid.motion.points",
        "at least two [seconds, metres], times rising from 0 on, displacements from 0, the first 0, all up to 1e9, no faster \
         than 100000 m/s",
    ),
    ("wave_maker", "an array of tables [[wave_maker]]"),
    (
        "wave_maker.wall",
        "\"-x\", \"+x\", \"-y\", \"+y\", \"-z\" or \"+z\", each once",
    ),
    (
        "wave_maker.motion",
        "a motion that leaves at least two particle spacings (PBF) or three cells (FLIP) between the \
         walls",
    ),
    (
        "wave_maker.motion.kind",
        "\"constant_velocity\", \"sine\", \"solitary\" or \"table\"",
    ),
    (
        "wave_maker.motion.velocity",
        "a number from 1e-9 to 100000, m/s inward",
    ),
    (
        "wave_maker.motion.until",
        "a number from 1e-6 to 1e9, seconds",
    ),
    (
        "wave_maker.motion.stroke",
        "a number from 1e-9 to 1e6, metres",
    ),
    (
        "wave_maker.motion.period",
        "a number from 1e-4 to 1e6, seconds",
    ),
    (
        "wave_maker.motion.ramp",
        "0 or a number from 1e-4 to 1e6, seconds; one period if left out",
    ),
    (
        "wave_maker.motion.height",
        "a number from 1e-9 to 1e6, at most the depth, metres",
    ),
    (
        "wave_maker.motion.depth",
        "a number from 1e-9 to 1e6, metres",
    ),
    (
        "wave_maker.motion.file",
        "a CSV of time,displacement (seconds, metres), relative to the scene file",
    ),
    (
        "wave_maker.motion.points",
        "at least two [seconds, metres], times rising from 0 on, displacements from 0, the first 0, all up to 1e9, no faster \
         than 100000 m/s",
    ),
    ("solver", "a table with method, pbf and flip"),
    (
        "solver.method",
        "\"pbf\" with a table [solver.pbf] of at least particle_spacing, or \"flip\" with a table \
         [solver.flip] of at least cell_size",
    ),
    ("solver.pbf", "a table with at least particle_spacing"),
    (
        "solver.pbf.particle_spacing",
        "a number from 1e-8 to 100000, metres, with at most 65536 cells along an axis, 2147483647 cells and \
         134217728 particles",
    ),
    ("solver.pbf.support_ratio", "a number from 1.5 to 4"),
    (
        "solver.pbf.iteration",
        "\"red_black\", \"jacobi\" or \"chebyshev\"",
    ),
    (
        "solver.pbf.iterations",
        "a whole number from 1 to 10000; not together with density_error",
    ),
    (
        "solver.pbf.density_error",
        "a number from 1e-7 to 0.99, with max_iterations",
    ),
    (
        "solver.pbf.max_iterations",
        "a whole number from 1 to 10000, with density_error",
    ),
    ("solver.pbf.cfl", "a number from 1e-5 to 5"),
    (
        "solver.pbf.spectral_radius",
        "a number from 0.01 to 0.9999, with iteration = \"chebyshev\"",
    ),
    ("solver.pbf.relaxation", "a number from 0.01 to 1.5"),
    ("solver.pbf.artificial_pressure", "a number from 0 to 10"),
    ("solver.pbf.max_substeps", "a whole number from 1 to 10000"),
    ("solver.flip", "a table with at least cell_size"),
    (
        "solver.flip.cell_size",
        "a number from 1e-8 to 100000, metres, with at least 3 and at most 65536 cells along each axis, 68719476736 \
         cells and 134217728 particles",
    ),
    (
        "solver.flip.particles_per_cell",
        "a whole number from 4 to 64",
    ),
    ("solver.flip.transfer", "\"flip\" or \"apic\""),
    ("solver.flip.pic_blend", "a number from 0 to 1"),
    ("solver.flip.cfl", "a number from 1e-5 to 5"),
    ("solver.flip.max_substeps", "a whole number from 1 to 10000"),
    ("solver.flip.surface", "\"voxel\" or \"ghost_fluid\""),
    ("solver.flip.density_correction", "true or false"),
    (
        "solver.flip.pressure",
        "a table of preconditioner, precision, tolerance, max_iterations",
    ),
    (
        "solver.flip.pressure.preconditioner",
        "\"none\", \"jacobi\", \"ipp\" or \"multigrid\"",
    ),
    (
        "solver.flip.pressure.precision",
        "\"f32\", \"f32_refined\", or \"f64\" where the adapter has it",
    ),
    (
        "solver.flip.pressure.tolerance",
        "a number from 1e-14 to 0.99, of the right-hand side's norm",
    ),
    (
        "solver.flip.pressure.max_iterations",
        "a whole number from 1 to 10000",
    ),
    (
        "grids",
        "a table with surface = true, velocity = true or both, voxel_size, precision",
    ),
    (
        "grids.surface",
        "true or false; one of surface and velocity true",
    ),
    ("grids.velocity", "true or false"),
    (
        "grids.voxel_size",
        "a number from a quarter of the particle spacing to 8 of them, metres, with at most \
         268435456 leaves of 8³ voxels in the domain",
    ),
    ("grids.precision", "\"half\" or \"float\""),
    ("budget", "a table of limits, each a number or false"),
    ("budget.speed", "a number from 1e-12 to 1e12, m/s, or false"),
    (
        "budget.density_error_mean",
        "a number from 1e-12 to 1e12, of the rest density, or false",
    ),
    (
        "budget.density_error_p99",
        "a number from 1e-12 to 1e12, of the rest density, or false",
    ),
    (
        "budget.capped",
        "a number from 1e-12 to 1e12, of all particles in all substeps, or false",
    ),
    (
        "budget.residual",
        "a number from 1e-12 to 1e12, at least solver.flip.pressure.tolerance, of the right-hand side's norm, or false",
    ),
    (
        "budget.divergence",
        "a number from 1e-12 to 1e12, of a cell's volume in a substep, or false",
    ),
    (
        "budget.volume",
        "a number from 1e-12 to 1e12, of the volume at the start, or false",
    ),
    (
        "budget.energy",
        "a number from 1e-12 to 1e12, of the total energy in a frame, or false",
    ),
    ("probe", "an array of tables [[probe]]"),
    (
        "probe.kind",
        "\"elevation\" or \"pressure\" with at, \"energy\" or \"volume\"; with the solver pbf a pressure asks for \
         iteration = \"red_black\" or \"jacobi\" and artificial_pressure = 0",
    ),
    (
        "probe.name",
        "1 to 100 letters, digits, \"_\", \"-\" and \".\", the first a letter or digit, each name once, upper and lower \
         case taken alike; the kind with a number if left out",
    ),
    (
        "probe.at",
        "[x, z] of an elevation or [x, y, z] of a pressure, metres, in the domain",
    ),
    // Of a study file.
    ("kind", "\"solver_comparison\", \"sweep\" or \"stability\""),
    ("scene", "a scene file, relative to the study file"),
    ("about", "an array of paragraphs for the page"),
    ("set", SET),
    ("key", KEY),
    ("values", VALUES),
    ("coarser", COARSER),
    (
        "steps",
        "a whole number of output frames from 1 to 1000000; or seconds",
    ),
    (
        "seconds",
        "seconds of the shot, a whole number of frames at every frame rate; or steps",
    ),
    ("repeats", "a whole number from 1 to 100"),
    (
        "errors",
        "of \"density_error_mean\", \"density_error_p99\", \"density_error_max\", or of \"crest_error\", \
         \"front_error\", \"energy_error\", \"profile_error\", or of \"pressure_error\", \"velocity_error\", \
         \"divergence\", or \"distance_to_converged\"",
    ),
    ("convergence_point", "true or false"),
    ("method", "an array of tables [[method]], each with a name"),
    ("method.name", "what the line of the curves is called"),
    ("method.set", SET),
    ("method.key", KEY),
    ("method.values", VALUES),
    ("method.coarser", COARSER),
    (
        "method.device",
        "\"gpu\", or \"cpu\" for the f64 reference, which runs whole frames and no single projections",
    ),
    (
        "method.against",
        "another method of the same key and values, with errors that are else against the finest run",
    ),
    (
        "look",
        "a look file that writes PNG, relative to the study file",
    ),
    ("solvers", "two of \"pbf\" and \"flip\", each once"),
    (
        "frames",
        "frames to measure, such as \"1-240\" or \"1-240x2\", within the shot; all of it if left out",
    ),
    (
        "pictures",
        "frames to render, such as \"60-240x60\", within the shot",
    ),
    ("case", "an array of tables [[case]]"),
    (
        "case.number",
        "a whole number; name and number together each once",
    ),
    (
        "case.name",
        "words, other than those of a case of the same number",
    ),
    (
        "case.scene",
        "a scene file, relative to the study file; or test",
    ),
    (
        "case.test",
        "the command that runs a test that holds the case, in place of scene",
    ),
    ("case.set", SET),
    ("case.solvers", SOLVERS),
    ("case.devices", DEVICES),
    ("case.frames", "a whole number of frames within the shot"),
    (
        "case.refused",
        "an array of words that stand in the message of a refusal",
    ),
    ("case.against.set", SET),
    ("case.against.device", "\"gpu\" or \"cpu\""),
    (
        "case.against.scale",
        "a number from 1e-6 to 1e6: the lengths of the other run over those of the case",
    ),
    ("case.mark", MARK),
    ("case.mark.of", MEASURED),
    ("case.against.shift", SHIFT),
    ("case.mark.at_most", BOUND),
    ("case.mark.at_least", BOUND),
    ("case.mark.after", AFTER),
    ("case.mark.since", AFTER),
    ("case.mark.region", REGION),
    ("case.mark.solvers", SOLVERS),
    ("case.mark.devices", DEVICES),
    ("limit", "an array of tables [[limit]]"),
    ("limit.set", SET),
    ("limit.solvers", SOLVERS),
    ("limit.passes", "a number from 1e-12 to 1e12"),
    ("limit.fails", "a number from 1e-12 to 1e12"),
    ("limit.ratio", "a number from 1.001 to 1e12"),
    ("limit.seconds", "a number from 1e-6 to 1e8"),
    ("limit.mark", MARK),
    ("limit.mark.of", MEASURED),
    ("limit.mark.at_most", BOUND),
    ("limit.mark.at_least", BOUND),
    ("limit.mark.after", AFTER),
    ("limit.mark.since", AFTER),
    ("limit.mark.region", REGION),
    ("limit.mark.solvers", SOLVERS),
    ("limit.mark.devices", DEVICES),
    // Of a tolerance file.
    ("position", "a table of max, rms, p99"),
    ("velocity", "a table of max, rms, p99"),
    ("attributes", "a table of max, rms, p99 for each attribute"),
    ("aggregates", "a table of { absolute, relative } by name"),
    ("pictures", "a table of mean, p99, max, perceptual"),
    // The effects say for themselves what their keys allow.
    (
        "effects",
        "a table of effects; those not named do not exist",
    ),
];
