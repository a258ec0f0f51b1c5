//! Zones that do not fit into the scene, and waves outside the range of any theory.

use super::Fault;

pub const ZONE_FAULTS: &[Fault] = &[
    (
        "iterations = 4\n\n[effects]\nviscosity = { xsph = 0.01 }",
        "iterations = 4\ngrid_projection = false\n[effects]\nviscosity = { xsph = 0.01 }\n\
         surface_tension = { coefficient = 0.07 }",
        34,
        &[
            "effects.surface_tension: is part of the projection",
            "set it to true",
        ],
    ),
    (
        "iterations = 4\n\n[effects]\nviscosity = { xsph = 0.01 }",
        "iterations = 4\n\n[effects]\nviscosity = { xsph = 0.01 }\n\
         surface_tension = { coefficient = 0.07 }",
        0,
        &[],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\nabsorbing_zone = { walls = [], length = 3.0, period = 2.0 }",
        34,
        &["effects.absorbing_zone.walls: names no wall; allowed: "],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\nabsorbing_zone = { walls = [\"-x\"], length = 3.0, \
         period = 2.0 }",
        34,
        &["effects.absorbing_zone.walls: the wall -x is a wave maker's; allowed: "],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\nabsorbing_zone = { walls = [\"+x\", \"+x\"], length = 3.0, \
         period = 2.0 }",
        34,
        &["effects.absorbing_zone.walls: \"+x\" is listed twice; allowed: "],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\nabsorbing_zone = { walls = [\"+x\"], length = 0.001, \
         period = 2.0 }",
        34,
        &["effects.absorbing_zone.length: a zone of 0.001 m is shorter than two particle spacings"],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\nabsorbing_zone = { walls = [\"+x\"], length = 26.0, \
         period = 2.0 }",
        34,
        &[
            "effects.absorbing_zone.length: the domain reaches 25 m from the wall +x, but the zone \
             is 26 m long",
        ],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\nabsorbing_zone = { walls = [\"right\"], length = 3.0, \
         period = 2.0 }",
        34,
        &["effects.absorbing_zone.walls: \"right\" is not a value of wall; the nearest is \"-x\""],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+y\"], length = 3.0, \
         waves = { kind = \"stokes\", height = 0.1, period = 2.0, depth = 1.0 } }",
        34,
        &["effects.generation_zone.walls: the wall +y is not upright; allowed: "],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"-x\"], length = 3.0, \
         waves = { kind = \"stokes\", height = 0.1, period = 2.0, depth = 1.0 } }",
        34,
        &["effects.generation_zone.walls: the wall -x is a wave maker's; allowed: "],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+x\"], length = 3.0, \
         waves = { kind = \"stokes\", height = 0.1, period = 2.0, depth = 1.0 } }",
        34,
        &[
            "effects.generation_zone.waves.direction_degrees: waves that go towards 0 degrees come \
             from none of the walls; allowed: ",
        ],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+x\", \"-z\"], length = 26.0, \
         waves = { kind = \"stokes\", height = 0.1, period = 2.0, depth = 1.0 } }",
        34,
        &[
            "effects.generation_zone.length: the domain reaches 25 m from the wall +x, but the \
             zone is 26 m long",
        ],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+z\"], length = 3.0, \
         waves = { kind = \"stokes\", height = 0.1, period = 2.0, depth = 13.0, \
         direction_degrees = -90.0 } }",
        34,
        &[
            "effects.generation_zone.waves.depth: 13 m of water in a domain that is 12.6 m high; \
             allowed: ",
        ],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+z\"], length = 3.0, \
         waves = { kind = \"stokes\", height = 0.9, period = 2.0, depth = 1.0 } }",
        34,
        &["effects.generation_zone.waves.height: waves of 0.9 m on 1 m of water break"],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+z\"], length = 3.0, \
         waves = { kind = \"stokes\", height = 0.1, period = 0.7, depth = 1.0 } }",
        34,
        &[
            "effects.generation_zone.waves.period: waves of 0.7 s are 0.765 m long, 7.7 particle \
             spacings; at least 10 are needed; allowed: ",
        ],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+z\"], length = 3.0, \
         waves = { kind = \"sea\", significant_height = 0.1, peak_period = 2.0, \
         shortest_period = 3.0, depth = 1.0 } }",
        34,
        &["effects.generation_zone.waves.shortest_period: 3 s is 1.5 of the peak's 2 s; allowed: "],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+z\"], length = 3.0, \
         waves = { kind = \"sea\", significant_height = 0.1, peak_period = 2.0, \
         shortest_period = 0.6, depth = 1.0 } }",
        34,
        &["effects.generation_zone.waves.shortest_period: waves of 0.6 s are 0.562 m long"],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+z\"], length = 3.0, \
         waves = { kind = \"sea\", significant_height = 1.5, peak_period = 2.0, depth = 1.0 } }",
        34,
        &[
            "effects.generation_zone.waves.significant_height: waves of 1.5 m on 1 m of water; \
             allowed: ",
        ],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+z\"], length = 3.0, \
         waves = { kind = \"sea\", significant_height = 0.1, peak_period = 2.0, \
         spectrum = \"pierson_moskowitz\", peak_enhancement = 2.0, depth = 1.0 } }",
        34,
        &[
            "effects.generation_zone.waves.peak_enhancement: Pierson and Moskowitz's peak is not \
             raised",
        ],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"+z\"], length = 3.0, \
         waves = { kind = \"solitary\", significant_height = 0.1, peak_period = 2.0, \
         depth = 1.0 } }",
        34,
        &["effects.generation_zone.waves.kind: \"solitary\""],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"-z\"], length = 3.0, \
         waves = { kind = \"focused\", height = 0.1, at = [5.0, 16.0], time = 30.0, \
         peak_period = 2.0, shortest_period = 1.0, depth = 1.0, direction_degrees = 90.0 } }",
        34,
        &[
            "effects.generation_zone.waves.at: 16 m along z from the domain's least corner, \
             and the domain is 15 m long; allowed: ",
        ],
    ),
    (
        "viscosity = { xsph = 0.01 }",
        "viscosity = { xsph = 0.01 }\ngeneration_zone = { walls = [\"-z\"], length = 3.0, \
         waves = { kind = \"focused\", height = 0.1, at = [5.0, 12.0], time = 9.0, \
         peak_period = 2.0, shortest_period = 1.0, depth = 1.0, direction_degrees = 90.0 } }",
        34,
        &["effects.generation_zone.waves.time: its slowest waves, of 0.815 m/s, arrive after 15."],
    ),
];
