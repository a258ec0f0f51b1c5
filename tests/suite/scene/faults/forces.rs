//! Forces that say too little, too much, or what does not fit.

use super::Fault;

/// The text before which the tables are inserted.
const BEFORE: &str = "[solver]\nmethod";

pub const FORCE_FAULTS: &[Fault] = &[
    (
        BEFORE,
        "[[force]]\nkind = \"wind\"\n[solver]\nmethod",
        27,
        &[
            "force[0].kind: ",
            "; allowed: \"acceleration\", \"vortex\" or \"attract\"",
        ],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\n[solver]\nmethod",
        26,
        &["force[0].acceleration: missing; allowed: three numbers"],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\nstrength = 1.0\n\
         [solver]\nmethod",
        29,
        &["force[0].strength: does not go with kind = \"acceleration\""],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"attract\"\nat = [1.0, 0.0, 0.0]\nstrength = -1.0\n[solver]\nmethod",
        26,
        &["force[0].core: missing; allowed: a number from 1e-6"],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"vortex\"\nat = [1.0, 0.0, 0.0]\nstrength = 1.0\ncore = 0.1\n\
         axis = [0.0, 0.0, 0.0]\n[solver]\nmethod",
        31,
        &["force[0].axis: it has no direction; allowed: "],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"vortex\"\nat = [1.0, 0.0, 0.0]\nstrength = 1.0\ncore = 0.1\n\
         falloff = 3\n[solver]\nmethod",
        31,
        &["force[0].falloff: 3 is out of range; allowed: a whole number from 0 to 2"],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\n\
         min = [1.0, 2.0, 1.0]\n[solver]\nmethod",
        29,
        &["force[0].min: given without max"],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\n\
         min = [1.0, 2.0, 1.0]\nmax = [2.0, 1.5, 2.0]\n[solver]\nmethod",
        30,
        &["force[0].max: the box is inverted: y ends at 1.5 but starts at 2"],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\n\
         min = [1.0, -3.0, 1.0]\nmax = [2.0, -1.0, 2.0]\n[solver]\nmethod",
        30,
        &["force[0].max: it lies outside of the domain: it spans [1, -3, 1] to [2, -1, 2]"],
    ),
    // A room may reach beyond the domain.
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\n\
         min = [1.0, -3.0, 1.0]\nmax = [2.0, 1.0, 2.0]\n[solver]\nmethod",
        0,
        &[],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\nfade = 0.2\n\
         [solver]\nmethod",
        29,
        &["force[0].fade: it has no room that it could fade in from"],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\non = []\n\
         [solver]\nmethod",
        29,
        &["force[0].on: names nothing"],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\non = [\"mist\"]\n\
         [solver]\nmethod",
        29,
        &[
            "force[0].on",
            "; allowed: an array of \"water\" and \"whitewater\", at least one",
        ],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\nfrom = 2.0\n\
         until = 2.0\n[solver]\nmethod",
        30,
        &["force[0].until: 2 s is not after from, 2 s; allowed: "],
    ),
    (
        BEFORE,
        "[[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0.0, 0.0]\n\
         mesh = { file = \"sheet.obj\" }\n[solver]\nmethod",
        29,
        &["force[0].mesh.file: "],
    ),
];
