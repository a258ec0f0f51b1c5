//! Values that a key does not allow, and parts of a scene that do not fit together.

use super::Fault;

/// Faulty values in the good scene as it is, with PBF.
pub const VALUE_FAULTS: &[Fault] = &[
    // No-slip walls belong to FLIP.
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nwalls = \"no_slip\"",
        9,
        &[
            "domain.walls: solver pbf has only free-slip walls",
            "solver.method = \"flip\"",
        ],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nno_slip = [\"-y\"]",
        9,
        &["domain.no_slip: solver pbf has only free-slip walls"],
    ),
    // Periodic axes.
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 16.0]\nperiodic = [\"z\"]",
        9,
        &[],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nperiodic = []",
        9,
        &[],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nperiodic = [\"w\"]",
        9,
        &["domain.periodic: \"w\" is not a value of periodic"],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nperiodic = \"z\"",
        9,
        &["domain.periodic: invalid type: string \"z\", expected an array of strings"],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nperiodic = [\"z\", \"x\", \"z\"]",
        9,
        &["domain.periodic: \"z\" is listed twice"],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.8, 15.0]\nperiodic = [\"y\"]",
        9,
        &["domain.periodic: gravity is [0, -9.81, 0] m/s², and along y nothing holds the water up"],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.6, 12.6, 15.0]\nperiodic = [\"x\"]",
        24,
        &["wave_maker[0].wall: there is no wall -x: domain.periodic joins"],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.05]\nperiodic = [\"z\"]",
        9,
        &["domain.periodic: the period along z is 15.05 m: 150.500 particle spacings of 0.1 m"],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 0.5]\nperiodic = [\"z\"]",
        9,
        &[
            "domain.periodic: the period along z is 0.5 m: 2.500 support radii of 0.2 m",
            "at least 3",
        ],
    ),
    // Ranges.
    (
        "= 0.1\n",
        "= -0.1\n",
        29,
        &[
            "solver.pbf.particle_spacing: -0.1 is out of range",
            "a number from 1e-8 to 100000, metres",
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
        &["shot.name: \"../up\" is not a safe file name", "letters"],
    ),
    ("\"base\"", "\"\"", 2, &["shot.name: \"\" is not a safe"]),
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
        &["\"gauss\" is not a value of iteration", "red_black"],
    ),
    (
        "\"pbf\"",
        "\"sph\"",
        27,
        &[
            "solver.method: \"sph\" is not a value of method; the nearest is \"pbf\"",
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
    (
        "[shot]",
        "[shot]\n[shot]",
        2,
        &["shot: this table is defined twice"],
    ),
    (
        "stroke = 1.5",
        "stroke = 1.5, stroke = 2",
        24,
        &["wave_maker[0].motion.stroke: this key is defined twice in wave_maker[0].motion"],
    ),
    (
        "frames = 240",
        "frames = \"many\"",
        3,
        &["shot.frames: invalid type: string \"many\", expected a whole number;"],
    ),
    (
        "[shot]\nname = \"base\"\nframes = 240\nframes_per_second = 60\n",
        "shot = 3\n",
        1,
        &["shot: invalid type: integer `3`, expected a table;"],
    ),
    // Boxes and sizes.
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 1e-9, 15.0]",
        8,
        &[
            "domain.max: its edges are [25, 1e-9, 15] m",
            "above min by 1e-8",
        ],
    ),
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
    ("= 0.1\n", "= 1e-7\n", 29, &["the grid would overflow"]),
    (
        "= 0.1\n",
        "= 1e-9\n",
        29,
        &["particle_spacing: 1e-9 is out of range", "from 1e-8"],
    ),
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
        // In the scene's coordinates: scaled by 2 and moved.
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
        &["solid[0].mesh: the mesh lies outside the domain"],
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
        &[
            "wave_maker[0].wall: \"left\" is not a value of wall; the nearest is",
            "\"+z\"",
        ],
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
    // Two particle spacings must remain: at most 24.8 m.
    ("stroke = 1.5", "stroke = 24.79", 24, &[]),
    (
        "stroke = 1.5",
        "stroke = 24.81",
        24,
        &["the wall -x crosses the whole domain"],
    ),
    // At 1 and 6 m/s the walls have used up 24.8 m after 3.543 s.
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0 }",
        "kind = \"constant_velocity\", velocity = 1.0 }\n[[wave_maker]]\nwall = \"+x\"\n\
         motion = { kind = \"constant_velocity\", velocity = 6.0 }",
        27,
        &["wave_maker[1].motion: the walls -x and +x collide 3.54"],
    ),
    (
        "stroke = 1.5, period = 3.0",
        "stroke = 10.0, period = 3e-4",
        24,
        &[
            "wave_maker[0].motion: it moves at 104719.",
            "up to 100000 m/s",
        ],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"table\", points = [[0, 0], [1e-6, 0.2]]",
        24,
        &[
            "motion.points: up to point 1, it moves at ",
            "up to 100000 m/s",
        ],
    ),
    (
        "stroke = 1.5",
        "stroke = -1.5",
        24,
        &["motion.stroke: -1.5 is out of range"],
    ),
    (
        "ramp = 1.0 }",
        "ramp = 1.0 }\n[[wave_maker]]\nwall = \"-x\"\nmotion = { kind = \"constant_velocity\", \
         velocity = 1.0 }",
        26,
        &["wave_maker[1].wall: a second wave maker on the wall -x"],
    ),
    (
        "ramp = 1.0 }",
        "ramp = 1.0 }\n[[wave_maker]]\nwall = \"+x\"\nmotion = { kind = \"constant_velocity\", \
         velocity = 6.0 }",
        27,
        &["wave_maker[1].motion: the walls -x and +x collide 3."],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"wobble\"",
        24,
        &[
            "motion.kind: \"wobble\" is not a value of kind; the nearest is",
            "solitary",
        ],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"sea\", significant_height = 1.5, peak_period = 3.0, depth = 1.0",
        24,
        &["motion.significant_height: waves of 1.5 m on 1 m of water; allowed: "],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"sea\", significant_height = 0.5, peak_period = 1.4, depth = 1.0",
        24,
        &[
            "motion.significant_height: waves of 1.4 s on 1 m of water break before they are 0.5 m \
             high (Miche 1944)",
        ],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"sea\", significant_height = 0.1, peak_period = 3.0, depth = 1.0, \
         shortest_period = 2.9",
        24,
        &["motion.shortest_period: 2.9 s is 0.966"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"sea\", significant_height = 0.1, peak_period = 3.0, depth = 1.0, \
         shortest_period = 0.5",
        24,
        &[
            "motion.shortest_period: waves of 0.5 s are 0.390 m long, 3.9 particle spacings; at \
             least 10 are needed; allowed: ",
        ],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"sea\", significant_height = 0.1, peak_period = 3.0, depth = 1.0, ramp = 0",
        24,
        &["motion.ramp: "],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"sea\", significant_height = 0.1, peak_period = 3.0, depth = 1.0, \
         spectrum = \"pierson_moskowitz\", peak_enhancement = 2.0",
        24,
        &["motion.peak_enhancement: Pierson and Moskowitz's peak is not raised; allowed: "],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"sea\", significant_height = 0.1, peak_period = 3.0, depth = 1.0, \
         spectrum = \"jonswop\"",
        24,
        &["motion.spectrum: \"jonswop\" is not a value of spectrum; the nearest is \"jonswap\""],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"sea\", significant_height = 0.1, peak_period = 6.0, depth = 1.0, \
         second_order = true",
        24,
        &[
            "motion.second_order: H L² / h³ is 34.",
            "with significant_height and the peak's 6 s on 1 m of water, \
             and the second order holds below 26.3 (Madsen 1971); allowed: ",
        ],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"focused\", height = 0.1, at = 3.0, time = 60.0, peak_period = 2.0, \
         shortest_period = 0.35, depth = 1.0, second_order = true",
        24,
        &[
            "motion.second_order: waves of 0.35 s on 1 m of water have kh = 32.9, \
             and it is known up to 25",
        ],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"stokes\", height = 0.1, period = 3.0, depth = 1.0, second_order = true",
        24,
        &["motion.second_order: "],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"focused\", height = 0.1, at = 30.0, time = 60.0, peak_period = 3.0, depth = 1.0",
        24,
        &["motion.at: 30 m from a face that is 25 m from the other"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"focused\", height = 0.1, at = 8.0, time = 9.0, peak_period = 3.0, depth = 1.0",
        24,
        &["motion.time: its slowest waves, of 0.784 m/s"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"stokes\", height = 0.3, period = 8.0, depth = 1.0",
        24,
        &["motion.height: waves of 0.3 m and 8 s on 1 m of water: H L² / h³ is 1"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"stokes\", height = 0.5, period = 1.4, depth = 1.0",
        24,
        &[
            "motion.height: waves of 1.4 s on 1 m of water break before they are 0.5 m high (Miche \
             1944)",
        ],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"cnoidal\", height = 0.9, period = 8.0, depth = 1.0",
        24,
        &["motion.height: waves of 0.9 m on 1 m of water break: the highest are 0.78 depths"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"cnoidal\", height = 0.2, period = 2.0, depth = 1.0",
        24,
        &["motion.period: waves of 2 s on 1 m of water are shorter than 8 depths"],
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
        &[
            "motion.file",
            "line 2: \"1,one\" is not time and displacement",
        ],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"table\", file = \"back.csv\"",
        24,
        &["the time of line 3, 0.5 s"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"table\", points = [[0, 0], [1, 0.5], [2, -0.5], [3, 0]]",
        24,
        &["point 2, [2, -0.5], lies outward", "from 0 on, inward"],
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
    (
        "iterations = 4",
        "max_iterations = 9",
        30,
        &["max_iterations: given without density_error"],
    ),
    (
        "iterations = 4",
        "spectral_radius = 0.9",
        30,
        &[
            "spectral_radius: does not go with iteration = \"red_black\"; allowed with it: \
             particle_spacing, ",
        ],
    ),
    (
        "scale = 2.0",
        "direction = [1.0, 0.0, 0.0]",
        20,
        &["solid[0].direction: given without motion"],
    ),
    (
        "kind = \"sine\", stroke = 1.5, period = 3.0, ramp = 1.0",
        "kind = \"table\", points = [[0, 0], [1, 2]], file = \"push.csv\"",
        24,
        &["motion.points: given together with file"],
    ),
    // Effects.
    (
        "xsph = 0.01",
        "xsph = -1",
        33,
        &["effects.viscosity.xsph: -1 is out of range; allowed: a number from 1e-6 to 1"],
    ),
];
