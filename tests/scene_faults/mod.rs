//! A good scene, and what each change to it is told.
#![allow(missing_docs, unreachable_pub, reason = "tests")]

pub const SCENE: &str = r#"[shot]
name = "base"
frames = 240
frames_per_second = 60

[domain]
min = [0.0, 0.0, 0.0]
max = [25.0, 12.6, 15.0]

[water]
rest_density = 1000.0
gravity = [0.0, -9.81, 0.0]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [13.4, 1.0, 15.0]

[[solid]]
mesh = "cube.obj"
translate = [18.0, 0.0, 7.0]
scale = 2.0

[[wave_maker]]
wall = "-x"
motion = { kind = "sine", stroke = 1.5, period = 3.0, ramp = 1.0 }

[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
iterations = 4

[effects]
viscosity = { xsph = 0.01 }

[solver.flip]
cell_size = 0.2
transfer = "flip"
surface = "voxel"
pressure = { preconditioner = "ipp", tolerance = 1e-4 }
"#;

/// (what to replace in the good scene, by what, line of the fault, what the message says)
pub type Fault = (&'static str, &'static str, usize, &'static [&'static str]);

/// With the scene as it stands: PBF.
pub const FAULTS: &[Fault] = &[
    // Keys.
    (
        "frames = 240",
        "frame = 240",
        3,
        &["shot.frame: unknown key", "nearest is \"frames\""],
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
        &["budget.speed: -3 is out of range", "above 0, m/s, or false"],
    ),
    (
        "[effects]",
        "[budget]\nenergy = true\n[effects]",
        33,
        &["budget.energy: true is no limit", "or false"],
    ),
    (
        "[effects]",
        "[budget]\nvolume = \"much\"\n[effects]",
        33,
        &["budget.volume: wrong type", "or false"],
    ),
    (
        "[effects]",
        "[budget]\nresidual = 1e-5\n[effects]",
        33,
        &[
            "budget.residual: 0.00001 is out of range",
            "from solver.flip.pressure.tolerance on",
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
            "probe[0].kind: \"elevaton\" is no probe",
            "\"elevation\" or \"pressure\" with at",
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
        &["probe[0].at: [26.0, 1.0, 1.0] is outside of the domain"],
    ),
    (
        "[effects]",
        "[[probe]]\nkind = \"energy\"\nname = \"a/b\"\n\n[effects]",
        34,
        &["probe[0].name: \"a/b\" is no safe file name"],
    ),
    (
        "stroke = 1.5",
        "strok = 1.5",
        24,
        &["wave_maker[0].motion.strok: unknown key", "\"stroke\""],
    ),
    (
        "stroke = 1.5",
        "stroke = 1.5, velocity = 1",
        24,
        &["motion.velocity: unknown key", "kind \"sine\""],
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
        &["duplicate key"],
    ),
    ("frames = 240", "frames = = 3", 3, &["bad.toml:3"]),
    (
        "[solver]\nmethod = \"pbf\"\n",
        "",
        26,
        &["solver.method: missing", "\"pbf\""],
    ),
    ("xsph = 0.01", "", 33, &["effects.viscosity.xsph: missing"]),
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
            "shot.frames: invalid type: floating point `1.5`",
            "a whole number from 1",
        ],
    ),
    (
        "= 0.1\n",
        "= \"fine\"\n",
        29,
        &[
            "particle_spacing: invalid type: string \"fine\"",
            "a number above 0",
        ],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6]",
        8,
        &["domain.max: invalid length 2", "three finite numbers"],
    ),
    (
        "scale = 2.0",
        "scale = \"big\"",
        20,
        &["solid[0].scale: wrong type", "a number other than 0"],
    ),
    // Ranges.
    (
        "= 0.1\n",
        "= -0.1\n",
        29,
        &[
            "solver.pbf.particle_spacing: -0.1 is out of range",
            "a number above 0, metres",
        ],
    ),
    (
        "= 0.1\n",
        "= 0\n",
        29,
        &["particle_spacing: 0 is out of range"],
    ),
    (
        "= 0.1\n",
        "= nan\n",
        29,
        &["particle_spacing: NaN is out of range"],
    ),
    (
        "= 0.1\n",
        "= inf\n",
        29,
        &["particle_spacing: inf is out of range"],
    ),
    (
        "frames = 240",
        "frames = 0",
        3,
        &["shot.frames: 0 is out of range"],
    ),
    (
        "frames = 240",
        "frames = -5",
        3,
        &["shot.frames: -5 is out of range"],
    ),
    (
        "second = 60",
        "second = 0",
        4,
        &["frames_per_second: 0 is out of range"],
    ),
    (
        "\"base\"",
        "\"../up\"",
        2,
        &["shot.name: \"../up\" is no safe file name", "letters"],
    ),
    ("\"base\"", "\"\"", 2, &["shot.name: \"\" is no safe"]),
    (
        "iterations = 4",
        "iterations = 0",
        30,
        &["iterations: 0 is out of range"],
    ),
    (
        "iterations = 4",
        "iterations = 4\ndensity_error = 0.01",
        30,
        &["given together with density_error"],
    ),
    (
        "iterations = 4",
        "density_error = 0.01",
        30,
        &["given without max_iterations"],
    ),
    (
        "iterations = 4",
        "support_ratio = 1",
        30,
        &["support_ratio: 1 is out of range", "from 1.5 to 4"],
    ),
    (
        "iterations = 4",
        "relaxation = 2",
        30,
        &["relaxation: 2 is out of range"],
    ),
    (
        "iterations = 4",
        "iteration = \"gauss\"",
        30,
        &["\"gauss\" is no iteration", "red_black"],
    ),
    (
        "\"pbf\"",
        "\"sph\"",
        27,
        &[
            "solver.method: \"sph\" is no method; the nearest is \"pbf\"",
            "[solver.flip]",
        ],
    ),
    (
        "gravity = [0.0, -9.81, 0.0]",
        "gravity = [0.0, nan, 0.0]",
        12,
        &["water.gravity", "out of range"],
    ),
    (
        "scale = 2.0",
        "scale = 0",
        20,
        &["solid[0].scale", "out of range"],
    ),
    // Boxes.
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, -1.0, 15.0]",
        8,
        &["domain.max: the box is inverted: y ends at -1 but starts at 0"],
    ),
    (
        "max = [13.4, 1.0, 15.0]",
        "max = [13.4, 0.0, 15.0]",
        15,
        &["water.block[0].max: the box is inverted"],
    ),
    (
        "max = [13.4, 1.0, 15.0]",
        "max = [13.4, 1.0, 15.1]",
        15,
        &[
            "water.block[0].max: the water does not fit",
            "[25, 12.6, 15]",
        ],
    ),
    (
        "min = [0.0, 0.0, 0.0]\nmax = [13.4",
        "min = [0.0, -0.5, 0.0]\nmax = [13.4",
        14,
        &["water.block[0].min: the water does not fit"],
    ),
    (
        "max = [13.4, 1.0, 15.0]",
        "max = [13.4, 0.01, 15.0]",
        15,
        &["too thin for one layer"],
    ),
    // Size.
    (
        "= 0.1\n",
        "= 0.001\n",
        29,
        &[
            "the grid would overflow",
            "25 × 12.6 × 15 m",
            "at most 65536 cells",
        ],
    ),
    ("= 0.1\n", "= 1e-9\n", 29, &["the grid would overflow"]),
    (
        "= 0.1\n",
        "= 0.0105\n",
        29,
        &["particles 0.0105 m apart", "134217728"],
    ),
    // Meshes.
    (
        "cube.obj",
        "missing.obj",
        18,
        &[
            "solid[0].mesh: cannot read mesh",
            "missing.obj",
            "No such file",
        ],
    ),
    (
        "cube.obj",
        "broken.obj",
        18,
        &[
            "solid[0].mesh: mesh",
            "line 2: a vertex needs three numbers",
        ],
    ),
    ("cube.obj", "empty.stl", 18, &["not an STL: too short"]),
    ("cube.obj", "cube.fbx", 18, &["unknown extension"]),
    (
        "cube.obj",
        "sheet.obj",
        18,
        // Where the scene puts it: scaled by 2 and moved.
        &[
            "solid[0].mesh",
            "1 hole: 3 open edges about (18.6667, 0.6667, 7.0000), 2.8284 m across",
            "close the mesh",
        ],
    ),
    (
        "[18.0, 0.0, 7.0]",
        "[80.0, 0.0, 7.0]",
        18,
        &["solid[0].mesh: the mesh lies outside of the domain"],
    ),
    (
        "scale = 2.0",
        "blake3 = \"00\"",
        20,
        &["solid[0].blake3", "has BLAKE3"],
    ),
    ("[[solid]]\nmesh = ", "[[water.mesh]]\nfile = ", 18, &[]),
    // Wave makers.
    (
        "\"-x\"",
        "\"left\"",
        23,
        &["wave_maker[0].wall: \"left\" is no wall", "\"+z\""],
    ),
    (
        "stroke = 1.5",
        "stroke = 24.9",
        24,
        &[
            "wave_maker[0].motion: the wall -x crosses the whole domain",
            "of 25 m",
        ],
    ),
    ("stroke = 1.5", "stroke = 24.5", 24, &[]),
    (
        "stroke = 1.5",
        "stroke = -1.5",
        24,
        &["motion.stroke: -1.5 is out of range"],
    ),
    (
        "ramp = 1.0 }",
        "ramp = 1.0 }\n[[wave_maker]]\nwall = \"-x\"\nmotion = { kind = \"constant_velocity\", velocity = 1.0 }",
        26,
        &["wave_maker[1].wall: a second wave maker on the wall -x"],
    ),
    (
        "ramp = 1.0 }",
        "ramp = 1.0 }\n[[wave_maker]]\nwall = \"+x\"\nmotion = { kind = \"constant_velocity\", velocity = 6.0 }",
        27,
        &["wave_maker[1].motion: the walls -x and +x collide 3."],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"wobble\"",
        24,
        &["motion.kind: \"wobble\" is no kind of motion", "solitary"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"solitary\", height = 2, depth = 1",
        24,
        &["motion.height: a wave of 2 m on 1 m"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"table\", file = \"push.csv\"",
        24,
        &["motion.file", "line 2: \"1,one\" is not time,displacement"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"table\", file = \"back.csv\"",
        24,
        &["the time of point 2, 0.5 s"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"table\", points = [[0, 1], [1, 2]]",
        24,
        &["the first displacement is 1"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"table\"",
        24,
        &["motion.points: missing"],
    ),
    // Effects.
    (
        "xsph = 0.01",
        "xsph = -1",
        33,
        &["effects.viscosity.xsph: out of range; allowed: a number above 0"],
    ),
];

/// The same with `solver.method=flip` laid over.
pub const FLIP_FAULTS: &[Fault] = &[
    (
        "cell_size = 0.2",
        "cell_size = 0",
        36,
        &["solver.flip.cell_size: 0 is out of range"],
    ),
    (
        "cell_size = 0.2",
        "cell_size = 4.3",
        36,
        &[
            "solver.flip.cell_size: no interior cell",
            "5.814 × 2.930 × 3.488 cells of 4.3 m",
            "at least 3",
        ],
    ),
    (
        "cell_size = 0.2",
        "cell_size = 4.2\nparticles_per_cell = 64",
        36,
        &[],
    ),
    (
        "cell_size = 0.2",
        "cell_size = 4.2\nparticles_per_cell = 4",
        15,
        &["water.block[0].max", "too thin for one layer"],
    ),
    (
        "cell_size = 0.2",
        "cell_size = 0.021",
        36,
        &["particles 0.0105 m apart", "134217728"],
    ),
    (
        "cell_size = 0.2",
        "cell_size = 0.001",
        36,
        &["the grid would overflow", "cells of 0.001 m"],
    ),
    (
        "transfer = \"flip\"",
        "transfer = \"pic\"",
        37,
        &["\"pic\" is no transfer; the nearest is \"apic\""],
    ),
    (
        "transfer = \"flip\"",
        "pic_blend = 1.1",
        37,
        &["solver.flip.pic_blend: 1.1 is out of range", "from 0 to 1"],
    ),
    (
        "transfer = \"flip\"",
        "cfl = 5.5",
        37,
        &["solver.flip.cfl: 5.5 is out of range", "up to 5"],
    ),
    (
        "transfer = \"flip\"",
        "particles_per_cell = 0",
        37,
        &["particles_per_cell: 0 is out of range"],
    ),
    (
        "transfer = \"flip\"",
        "density_correction = 1",
        37,
        &["density_correction: invalid type: integer `1`"],
    ),
    (
        "surface = \"voxel\"",
        "surface = \"ghost\"",
        38,
        &["\"ghost\" is no surface", "ghost_fluid"],
    ),
    (
        "\"ipp\"",
        "\"multigird\"",
        39,
        &[
            "solver.flip.pressure.preconditioner: \"multigird\" is no preconditioner; \
             the nearest is \"multigrid\"",
            "\"none\"",
        ],
    ),
    (
        "tolerance = 1e-4",
        "tolerance = 0",
        39,
        &[
            "pressure.tolerance: 0 is out of range",
            "above 0 and below 1",
        ],
    ),
    (
        "tolerance = 1e-4",
        "tolerance = -1e-4",
        39,
        &["pressure.tolerance: -0.0001 is out of range"],
    ),
    (
        "tolerance = 1e-4",
        "tolerance = 1.0",
        39,
        &["pressure.tolerance: 1 is out of range"],
    ),
    (
        "tolerance = 1e-4",
        "tolerance = 1e-4, residual_limit = 0.05",
        39,
        &["pressure.residual_limit: unknown key"],
    ),
    (
        "tolerance = 1e-4",
        "max_iterations = 0",
        39,
        &["pressure.max_iterations: 0 is out of range"],
    ),
    // 0.5 m are left: five particle spacings, but fewer than three cells.
    (
        "stroke = 1.5",
        "stroke = 24.5",
        24,
        &[
            "wave_maker[0].motion: the wall -x crosses",
            "three cells (FLIP)",
        ],
    ),
];
