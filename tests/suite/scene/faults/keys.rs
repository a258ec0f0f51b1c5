//! Unknown and missing keys, names and types.

use super::Fault;

/// Faulty keys, names and types in the good scene as it is, with PBF.
pub const KEY_FAULTS: &[Fault] = &[
    // Keys.
    (
        "frames = 240",
        "frame = 240",
        3,
        &[
            "shot.frame: unknown key in [shot]; the nearest is \"frames\"",
            "name, frames, frames_per_second",
        ],
    ),
    (
        "iterations = 4",
        "iteratoins = 4",
        30,
        &[
            "solver.pbf.iteratoins: unknown key",
            "nearest is \"iterations\"",
        ],
    ),
    (
        "[effects]",
        "[efects]",
        32,
        &["efects: unknown key", "nearest is \"effects\""],
    ),
    (
        "[effects]",
        "[budget]\nspede = 3.0\n[effects]",
        33,
        &["budget.spede: unknown key", "nearest is \"speed\""],
    ),
    (
        "[effects]",
        "[budget]\nspeed = -3.0\n[effects]",
        33,
        &[
            "budget.speed: -3 is out of range",
            "from 1e-12 to 1e12, m/s, or false",
        ],
    ),
    (
        "[effects]",
        "[budget]\nenergy = true\n[effects]",
        33,
        &["budget.energy: true is not a limit", "or false"],
    ),
    (
        "[effects]",
        "[budget]\nvolume = \"much\"\n[effects]",
        33,
        &[
            "budget.volume: invalid type: string \"much\", expected a number or false;",
            "or false",
        ],
    ),
    (
        "[effects]",
        "[budget]\nresidual = 1e-5\n[effects]",
        33,
        &[
            "budget.residual: 1e-5 is out of range",
            "at least solver.flip.pressure.tolerance",
        ],
    ),
    (
        "xsph = 0.01",
        "xspf = 0.01",
        33,
        &["effects.viscosity.xspf: unknown key", "\"xsph\""],
    ),
    (
        "[solver.pbf]",
        "[solver.pfb]",
        28,
        &["solver.pfb: unknown key", "nearest is \"pbf\""],
    ),
    (
        "[solver.pbf]\nparticle_spacing = 0.1\niterations = 4\n",
        "",
        27,
        &["solver.method: the scene has no table [solver.pbf]"],
    ),
    (
        "cell_size = 0.2",
        "cell_sise = 0.2",
        36,
        &[
            "solver.flip.cell_sise: unknown key",
            "nearest is \"cell_size\"",
        ],
    ),
    (
        "cell_size = 0.2\n",
        "",
        35,
        &["solver.flip.cell_size: missing", "at least 3"],
    ),
    (
        "tolerance = 1e-4",
        "tolerence = 1e-4",
        39,
        &[
            "solver.flip.pressure.tolerence: unknown key",
            "nearest is \"tolerance\"",
        ],
    ),
    // Probes.
    (
        "[effects]",
        "[[probe]]\nkind = \"elevaton\"\n\n[effects]",
        33,
        &[
            "probe[0].kind: \"elevaton\" is not a value of kind; the nearest is \"elevation\"",
            "\"elevation\", \"pressure\", \"energy\", \"volume\", \"front\", \"run_up\", \
             \"flux\" or \"force\"",
        ],
    ),
    (
        "[effects]",
        "[[probe]]\nkind = \"elevation\"\n\n[effects]",
        32,
        &["probe[0].at: missing", "[x, z] of an elevation"],
    ),
    (
        "[effects]",
        "[[probe]]\nkind = \"pressure\"\nat = [26.0, 1.0, 1.0]\n\n[effects]",
        34,
        &["probe[0].at: [26.0, 1.0, 1.0] is outside the domain"],
    ),
    (
        "[effects]",
        "[[probe]]\nkind = \"energy\"\nname = \"A\"\n[[probe]]\nkind = \"volume\"\nname = \"a\"\n\n\
         [effects]",
        37,
        &[
            "probe[1].name: a second probe is named \"a\": \"A\" is the same file where upper and \
             lower case",
            "upper and lower case taken alike",
        ],
    ),
    (
        "[effects]",
        "[[probe]]\nkind = \"energy\"\nname = \"a\"\n[[probe]]\nkind = \"volume\"\nname = \"a\"\n\n\
         [effects]",
        37,
        &["probe[1].name: a second probe is named \"a\""],
    ),
    (
        "[effects]",
        "[[probe]]\nkind = \"energy\"\nname = \"a/b\"\n\n[effects]",
        34,
        &["probe[0].name: \"a/b\" is not a safe file name"],
    ),
    (
        "stroke = 1.5",
        "strok = 1.5",
        24,
        &[
            "wave_maker[0].motion.strok: unknown key in wave_maker[0].motion; \
             the nearest is \"stroke\"",
        ],
    ),
    (
        "stroke = 1.5",
        "stroke = 1.5, velocity = 1",
        24,
        &[
            "motion.velocity: does not go with kind = \"sine\"; allowed with it: kind, stroke, \
             period, ramp",
        ],
    ),
    (
        "frames = 240\n",
        "",
        1,
        &["shot.frames: missing", "a whole number from 1"],
    ),
    (
        "particle_spacing = 0.1\n",
        "",
        28,
        &["solver.pbf.particle_spacing: missing"],
    ),
    (
        "period = 3.0, ",
        "",
        24,
        &["wave_maker[0].motion.period: missing"],
    ),
    (
        "[domain]",
        "[shot.domain]",
        6,
        &["shot.domain: unknown key"],
    ),
    (
        "frames = 240",
        "frames = 240\nframes = 3",
        4,
        &["shot.frames: this key is defined twice in [shot]"],
    ),
    ("frames = 240", "frames = = 3", 3, &["bad.toml:3"]),
    (
        "[solver]\nmethod = \"pbf\"\n",
        "",
        26,
        &["solver.method: missing", "\"pbf\""],
    ),
    (
        "xsph = 0.01",
        "",
        33,
        &["neither coefficient (Pa s) nor xsph is given"],
    ),
    (
        "xsph = 0.01",
        "xsph = 0.01, coefficient = 1.0",
        33,
        &["effects.viscosity.coefficient: given together with xsph"],
    ),
    (
        "xsph = 0.01",
        "xsph = 0.01, tolerance = 0.1",
        33,
        &["effects.viscosity.tolerance", "coefficient"],
    ),
    (
        "xsph = 0.01",
        "coefficient = 0.0",
        33,
        &[
            "effects.viscosity.coefficient: 0 is out of range; allowed: a number from 1e-6 to 1e9, \
             Pa s",
        ],
    ),
    (
        "iterations = 4\n\n[effects]\nviscosity = { xsph = 0.01 }",
        "iterations = 4\ngrid_projection = false\n\n[effects]\nviscosity = { coefficient = 1.0 }",
        34,
        &["effects.viscosity.coefficient: it is solved on the grid of PBF's projection"],
    ),
    (
        "xsph = 0.01",
        "xsph = true",
        33,
        &["effects.viscosity.xsph: invalid type: boolean `true`"],
    ),
    // Types.
    (
        "frames = 240",
        "frames = 1.5",
        3,
        &[
            "shot.frames: invalid type: number `1.5`, expected a whole number;",
            "a whole number from 1",
        ],
    ),
    (
        "= 0.1\n",
        "= \"fine\"\n",
        29,
        &[
            "particle_spacing: invalid type: string \"fine\", expected a number;",
            "a number from 1e-8",
        ],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6]",
        8,
        &[
            "domain.max: invalid type: an array of 2, expected an array of 3 numbers;",
            "three numbers from",
        ],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, \"high\", 15.0]",
        8,
        &[
            "domain.max[1]: invalid type: string \"high\", expected a number;",
            "three numbers from",
        ],
    ),
    (
        "[[water.block]]",
        "[water.block]",
        13,
        &[
            "water.block: invalid type: a table, expected an array of tables;",
            "an array of tables [[water.block]]",
        ],
    ),
    (
        "scale = 2.0",
        "scale = \"big\"",
        20,
        &[
            "solid[0].scale: invalid type: string \"big\", expected a number or an array of 3;",
            "a number from 1e-6 to 1e6, or three",
        ],
    ),
];
