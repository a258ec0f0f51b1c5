//! Faults that only FLIP reports.

use super::Fault;

/// Faults in the good scene with the override `solver.method=flip`.
pub const FLIP_FAULTS: &[Fault] = &[
    // Periodic axes.
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nperiodic = [\"z\"]",
        9,
        &[
            "domain.periodic: the period along z is 15 m: 75.000 cells of 0.2 m, \
             and FLIP asks for a multiple of 8",
        ],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 16.0]\nperiodic = [\"z\"]",
        9,
        &[],
    ),
    (
        "max = [25.0, 12.6, 15.0]\n\n[water]\nrest_density = 1000.0\ngravity = [0.0, -9.81, 0.0]\n\
         [[water.block]]\nmin = [0.0, 0.0, 0.0]\nmax = [13.4, 1.0, 15.0]\n\n[[solid]]\n\
         mesh = \"cube.obj\"\ntranslate = [18.0, 0.0, 7.0]\nscale = 2.0",
        "max = [25.0, 12.6, 16.0]\nperiodic = [\"z\"]\n\n[water]\nrest_density = 1000.0\n\
         gravity = [0.0, -9.81, 0.0]\n[[water.block]]\nmin = [0.0, 0.0, 0.0]\n\
         max = [13.4, 1.0, 15.0]\n\n[[solid]]\nmesh = \"cube.obj\"\ntranslate = [18.0, 0.0, 7.0]\n\
         scale = 2.0\ndirection = [1.0, 0.0, 0.5]\nmotion = { kind = \"sine\", stroke = 0.5, \
         period = 3.0 }",
        22,
        &["solid[0].direction: the solid moves along z, which domain.periodic names"],
    ),
    (
        "max = [25.0, 12.6, 15.0]\n\n[water]\nrest_density = 1000.0\ngravity = [0.0, -9.81, 0.0]\n\
         [[water.block]]\nmin = [0.0, 0.0, 0.0]\nmax = [13.4, 1.0, 15.0]\n\n[[solid]]\n\
         mesh = \"cube.obj\"\ntranslate = [18.0, 0.0, 7.0]\nscale = 2.0",
        "max = [25.0, 12.6, 16.0]\nperiodic = [\"z\"]\n\n[water]\nrest_density = 1000.0\n\
         gravity = [0.0, -9.81, 0.0]\n[[water.block]]\nmin = [0.0, 0.0, 0.0]\n\
         max = [13.4, 1.0, 15.0]\n\n[[solid]]\nmesh = \"cube.obj\"\ntranslate = [18.0, 0.0, 7.0]\n\
         scale = 2.0\ndirection = [1.0, 0.0, 0.0]\nmotion = { kind = \"sine\", stroke = 0.5, \
         period = 3.0 }",
        22,
        &[],
    ),
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
        &["\"pic\" is not a value of transfer; the nearest is \"apic\""],
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
        &["solver.flip.cfl: 5.5 is out of range", "from 1e-5 to 5"],
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
        &["density_correction: invalid type: integer `1`, expected true or false"],
    ),
    (
        "surface = \"voxel\"",
        "surface = \"ghost\"",
        38,
        &["\"ghost\" is not a value of surface", "ghost_fluid"],
    ),
    (
        "\"ipp\"",
        "\"multigird\"",
        39,
        &[
            "solver.flip.pressure.preconditioner: \"multigird\" is not a value of preconditioner; \
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
            "from 1e-14 to 0.99",
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
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nwalls = \"noslip\"",
        9,
        &["domain.walls: \"noslip\" is not a value of walls; the nearest is \"no_slip\""],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nno_slip = [\"-y\", \"floor\"]",
        9,
        &["domain.no_slip: \"floor\" is not a value of no_slip"],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nno_slip = [\"-y\", \"+x\", \"-y\"]",
        9,
        &["domain.no_slip: a wall is listed twice", "each once"],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 16.0]\nperiodic = [\"z\"]\nno_slip = [\"-y\", \"+z\"]",
        10,
        &["domain.no_slip: there is no wall +z: domain.periodic joins both ends"],
    ),
    (
        "max = [25.0, 12.6, 15.0]",
        "max = [25.0, 12.6, 15.0]\nwalls = \"free_slip\"\nno_slip = [\"-y\"]",
        10,
        &["domain.no_slip: given together with walls"],
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
