//! Emitters and drains that do not fit into the scene.

use super::Fault;

/// The text before which the tables are inserted.
const BEFORE: &str = "[solver]\nmethod";

pub const SOURCE_FAULTS: &[Fault] = &[
    (
        BEFORE,
        "[[emitter]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 1.5, 2.0]\nvelocity = [1.0, 0.0, 0.0]\n\
         [solver]\nmethod",
        28,
        &["emitter[0].max: the box is inverted: y ends at 1.5 but starts at 2; allowed: "],
    ),
    (
        BEFORE,
        "[[emitter]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 13.0, 2.0]\nvelocity = [1.0, 0.0, 0.0]\n\
         [solver]\nmethod",
        28,
        &["emitter[0].max: it does not fit: it spans [1, 2, 1] to [2, 13, 2]"],
    ),
    (
        BEFORE,
        "[[emitter]]\nmin = [1.0, 0.0, 1.0]\nmax = [2.0, 0.04, 2.0]\nvelocity = [1.0, 0.0, 0.0]\n\
         [solver]\nmethod",
        28,
        &[
            "emitter[0].max: its volume of 1 × 0.04 × 1 m is too thin for one layer of particles \
             0.1 m apart",
        ],
    ),
    (
        BEFORE,
        "[[emitter]]\nmin = [18.2, 0.2, 7.2]\nmax = [19.8, 1.8, 8.8]\nvelocity = [1.0, 0.0, 0.0]\n\
         [solver]\nmethod",
        27,
        &["emitter[0].min: the emitter lies within a solid"],
    ),
    (
        BEFORE,
        "[[emitter]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 3.0, 2.0]\n[solver]\nmethod",
        26,
        &["emitter[0].velocity: water at rest does not enter without a level; allowed: "],
    ),
    (
        BEFORE,
        "[[emitter]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 3.0, 2.0]\nvelocity = [0.0, 90.0, 0.0]\n\
         [solver]\nmethod",
        29,
        &[
            "emitter[0].velocity: in a frame its water moves 0 × 1.5 × 0 m, and its volume is 1 × \
             1 × 1 m: make it longer",
        ],
    ),
    (
        BEFORE,
        "[[emitter]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 3.0, 2.0]\nlevel = 1.5\n[solver]\nmethod",
        29,
        &[
            "emitter[0].level: 1.5 m is not within its volume, which reaches from 2 to 3 m; \
             allowed: ",
        ],
    ),
    (
        BEFORE,
        "[[emitter]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 3.0, 2.0]\nlevel = 2.5\nfrom = 2.0\n\
         until = 1.0\n[solver]\nmethod",
        31,
        &["emitter[0].until: 1 s is not after from, 2 s; allowed: "],
    ),
    (
        BEFORE,
        "[[emitter]]\nvelocity = [1.0, 0.0, 0.0]\n[solver]\nmethod",
        26,
        &["emitter[0].min: missing; allowed: "],
    ),
    (
        BEFORE,
        "[[emitter]]\nmin = [1.0, 2.0, 1.0]\nmesh = { file = \"cube.obj\" }\nlevel = 0.5\n\
         [solver]\nmethod",
        27,
        &["emitter[0].min: given together with mesh"],
    ),
    (
        BEFORE,
        "[[emitter]]\nmesh = { file = \"cube.obj\", translate = [30.0, 0.0, 0.0] }\nlevel = 0.5\n\
         [solver]\nmethod",
        27,
        &["emitter[0].mesh.file: it does not fit: "],
    ),
    (
        BEFORE,
        "[[drain]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 3.0, 2.0]\nrate = 0.0\n[solver]\nmethod",
        29,
        &["drain[0].rate: 0 is out of range"],
    ),
    (
        BEFORE,
        "[[drain]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 3.0, 2.0]\nvelocity = [1.0, 0.0, 0.0]\n\
         [solver]\nmethod",
        29,
        &["drain[0].velocity: unknown key"],
    ),
    (
        BEFORE,
        "[[emitter]]\nmin = [1.0, 2.0, 1.0]\nmax = [9.0, 12.0, 14.0]\n\
         velocity = [300.0, 0.0, 0.0]\n[solver]\nmethod",
        33,
        &["solver.pbf.particle_spacing: the water would take about"],
    ),
];
