//! Keys of all kinds of studies.

use super::super::{
    key::{Interval, Key, words},
    measure::Measure,
};

pub(in super::super) const KEYS: &[Key] = &[
    Key::choice(
        "kind",
        &[
            "solver_comparison",
            "sweep",
            "surface",
            "stability",
            "validation",
        ],
    )
    .about("what is compared"),
    Key::text("scene", "a scene file, relative to the study file")
        .only("kind", &["solver_comparison", "sweep", "surface"])
        .about("what is simulated"),
    Key::other("about", "an array of paragraphs for the page")
        .absent()
        .only("kind", &["sweep", "surface", "stability", "validation"])
        .about("in the reader's words"),
    // `kind = "solver_comparison"`.
    Key::text(
        "look",
        "a look file, relative to the study file; of two solvers one that writes PNG",
    )
    .only("kind", &["solver_comparison", "surface"])
    .about("how it is seen"),
    Key::other("solvers", "two of \"pbf\" and \"flip\", each once")
        .only("kind", COMPARISON)
        .about("left and right"),
    Key::other(
        "frames",
        "frames to measure, such as \"1-240\" or \"1-240x2\", within the shot; of two \
         solvers all of it if left out",
    )
    .absent()
    .only("kind", &["solver_comparison", "surface"])
    .about("what the curves are drawn from"),
    Key::other(
        "pictures",
        "frames to render, such as \"60-240x60\", within the shot",
    )
    .only("kind", COMPARISON)
    .about("pairs of pictures"),
    // `kind = "sweep"`.
    SET.only("kind", &["solver_comparison", "sweep", "surface"]),
    KEY.only("kind", SWEEP),
    VALUES.only("kind", SWEEP),
    COARSER.only("kind", SWEEP),
    Key::whole("steps", 1..=1_000_000)
        .absent()
        .without(&["seconds"])
        .only("kind", SWEEP)
        .also("; or seconds")
        .about("output frames of a run"),
    Key::other(
        "seconds",
        "seconds of the shot, a whole number of frames at every frame rate; or steps",
    )
    .absent()
    .only("kind", SWEEP)
    .about("how long a run is"),
    Key::whole("repeats", 1..=100)
        .default("1")
        .only("kind", &["sweep", "surface"])
        .about("times are medians over so many runs"),
    Key::other(
        "errors",
        "of \"density_error_mean\", \"density_error_p99\", \"density_error_max\", \"top_speed\", \
         \"weight_error\", or of \"crest_error\", \"front_error\", \"energy_error\", \
         \"profile_error\", or of \"pressure_error\", \"velocity_error\", \"divergence\", or \
         \"distance_to_converged\"; of a surface of \"depth_off\", \"normal_off\", \"silhouette\", \
         \"silhouette_offset\", \"colour\"",
    )
    .only("kind", &["sweep", "surface"])
    .about("what is measured"),
    Key::flag("convergence_point")
        .default("false")
        .only("kind", SWEEP)
        .about("whether that of the paper's Table 1 is looked for"),
    Key::tables("method", METHOD)
        .only("kind", SWEEP)
        .about("A line of the curves each"),
    // `kind = "surface"`.
    Key::tables("line", LINE)
        .only("kind", SURFACE)
        .about("A line of the curves each"),
    // `kind = "stability"`.
    Key::tables("case", CASE)
        .only("kind", STABILITY)
        .about("A small scene that is hard on a solver"),
    Key::tables("limit", LIMIT)
        .only("kind", STABILITY)
        .about("How far a setting goes before a mark is missed"),
    // `kind = "validation"`.
    Key::tables("benchmark", BENCHMARK)
        .only("kind", VALIDATION)
        .about("Something whose answer is known"),
];

const COMPARISON: &[&str] = &["solver_comparison"];
const SWEEP: &[&str] = &["sweep"];
const SURFACE: &[&str] = &["surface"];
const STABILITY: &[&str] = &["stability"];
const VALIDATION: &[&str] = &["validation"];

const SET: Key = Key::other(
    "set",
    "an array of overrides of the scene, such as [\"solver.pbf.iterations=8\"]",
)
.absent()
.about("laid over the scene, as `--set` does");

const KEY: Key = Key::other(
    "key",
    "a key of the scene, such as \"solver.pbf.iterations\", or \"device\", here or for all methods",
)
.absent()
.about("what changes from run to run");

const VALUES: Key = Key::other(
    "values",
    "two or more values of the key, from coarse to fine, here or for all methods",
)
.absent()
.about("of the key");

const COARSER: Key = Key::other(
    "coarser",
    "an array of overrides of the scene that make the last value's run coarser, with errors \
     against a finest run or of a projection",
)
.absent()
.about("what that run is off by is the discretisation error");

const METHOD: &[Key] = &[
    Key::other("name", "what the line of the curves is called").about("for the legend"),
    SET,
    KEY,
    VALUES,
    COARSER,
    Key::other(
        "device",
        "\"gpu\", or \"cpu\" for the f64 reference, which runs whole frames \
         and no single projections",
    )
    .absent()
    .about("what it runs on; the GPU if left out"),
    Key::other(
        "against",
        "another method of the same key and values, with errors that are else \
         against the finest run",
    )
    .absent()
    .about("value by value against that method"),
];

const LINE: &[Key] = &[
    Key::other("name", "what the line of the curves is called").about("for the legend"),
    Key::other(
        "set",
        "an array of overrides of the look, such as [\"surface.filter=narrow_range\"]",
    )
    .absent()
    .about("laid over the look"),
    Key::other(
        "key",
        "\"surface.filter\", \"surface.splat\", \"surface.radius_m\", \
         \"surface.smoothing_width_m\", \"surface.voxels_per_spacing\", \
         \"renderer.method\" or \"image.samples\"",
    )
    .about("what changes from point to point"),
    Key::other("values", "one or more values of the key").about("of the key"),
];

const SOLVERS: Key = Key::other(
    "solvers",
    "an array of \"pbf\" and \"flip\"; both if left out",
)
.absent()
.about("which solvers");

const DEVICES: Key = Key::other(
    "devices",
    "an array of \"gpu\" and \"cpu\"; both if left out",
)
.absent()
.about("which devices");

const NOTE: Key = Key::other("note", "words")
    .absent()
    .about("further words, for the page");

const CASE: &[Key] = &[
    Key::other(
        "number",
        "a whole number; name and number together each once",
    )
    .about("several cases may have one"),
    Key::other(
        "name",
        "words, other than those of a case of the same number",
    )
    .about("for the page"),
    NOTE,
    Key::other("scene", "a scene file, relative to the study file; or test")
        .absent()
        .about("what is simulated"),
    Key::other(
        "test",
        "the command that runs a test that holds the case, in place of scene",
    )
    .absent()
    .about("for what no scene can show"),
    SET,
    SOLVERS,
    DEVICES,
    Key::other("frames", "a whole number of frames within the shot")
        .absent()
        .about("to run; the whole shot if left out"),
    Key::other(
        "refused",
        "an array of words that stand in the message of a refusal",
    )
    .absent()
    .about("for a scene that has to be refused"),
    Key::tables("against", AGAINST).about("Another run beside it, frame by frame"),
    Key::tables("mark", MARKS).about(MARK),
];

const MARK: &str = "What is measured, and what it has to be";

const AGAINST: &[Key] = &[
    SET,
    Key::other("device", "\"gpu\" or \"cpu\"")
        .absent()
        .about("the case's own if left out"),
    Key::number("scale", 1e-6..=1e6)
        .absent()
        .also(": the lengths of the other run over those of the case")
        .about("1 if left out"),
    Key::vector("shift", 3, FAR)
        .unit("metres")
        .absent()
        .about("its origin"),
];

/// Coordinates of a region or a shift, metres.
const FAR: Interval = -1e9..=1e9;

/// Bound on a quantity, in its unit.
const BOUND: Interval = -1e12..=1e12;

/// Seconds of a shot that are ignored.
const SKIPPED: Interval = 0.0..=1e8;

const MARKS: &[Key] = &[
    Key::other(
        "of",
        "a name of swell::files::study::stability::Quantity, such as \"least_spacing\"",
    )
    .about("what is measured"),
    Key::number("at_most", BOUND)
        .absent()
        .also("; one of at_most and at_least")
        .about("what it has to be"),
    Key::number("at_least", BOUND)
        .absent()
        .also("; one of at_most and at_least")
        .about("what it has to be"),
    Key::number("after", SKIPPED)
        .unit("seconds")
        .absent()
        .about("time that does not count"),
    Key::number("since", SKIPPED)
        .unit("seconds")
        .absent()
        .about("against the state then, not that of the start"),
    Key::corners("region", FAR)
        .unit("metres")
        .absent()
        .about("only what starts in this box"),
    SOLVERS,
    DEVICES,
    Key::other("known_failure", "words")
        .absent()
        .about("why it is missed; a known failure that passes is told as well"),
];

/// Bracket of a search, in the unit of the setting.
const SEARCHED: Interval = 1e-12..=1e12;

const LIMIT: &[Key] = &[
    Key::other("name", "words").about("for the page"),
    NOTE,
    Key::other("unit", "words").absent().about("of the setting"),
    Key::other("scene", "a scene file, relative to the study file").about("what is simulated"),
    Key::other(
        "set",
        "an array of overrides of the scene, such as [\"solver.pbf.iterations={}\"]",
    )
    .about("`{}` is the value, `{2*}` twice it, `{2/}` two over it"),
    SOLVERS,
    Key::number("passes", SEARCHED).about("from a value that passes"),
    Key::number("fails", SEARCHED).about("to one that fails"),
    // Each step halves the logarithm of the bracket: at most 24 steps from 1e24 to 1.001.
    Key::number("ratio", 1.001..=1e12).about("until the two are that near"),
    // Some shots have 1e6 frames of 100 s.
    Key::number("seconds", 1e-6..=1e8).about("of the shot"),
    Key::tables("mark", MARKS).about(MARK),
];

/// Inputs of a measure: metres, seconds or m/s.
const TOLD: Interval = 1e-6..=1e6;

const fn told(name: &'static str, unit: &'static str) -> Key {
    Key::number(name, TOLD)
        .unit(unit)
        .absent()
        .also(", with the measures that take it")
}

const BENCHMARK: &[Key] = &[
    Key::other("name", "words, other than those of another benchmark").about("for the page"),
    NOTE,
    Key::choice("measure", &words(&Measure::NAMED)).about("what is measured"),
    Key::other("scene", "a scene file, relative to the study file").about("what is simulated"),
    SET,
    told("depth", "metres").about("of still water, or of a reservoir"),
    told("length", "metres").about("of a column, a wave or a box, or where the dam is"),
    told("height", "metres").about("of a crest above still water"),
    told("stroke", "metres").about("of a piston, from end to end"),
    told("period", "seconds").about("of a piston"),
    told("speed", "m/s").about("of a vortex"),
    Key::number("after", SKIPPED)
        .unit("seconds")
        .absent()
        .also(", with the measures that take it")
        .about("time that does not count"),
    Key::tables("run", BENCHMARK_RUN).about("A run of it"),
    Key::tables("gate", GATE).about("What a number has to be"),
    Key::tables("points", POINTS).about("Data that a curve is held against"),
];

const BENCHMARK_RUN: &[Key] = &[
    Key::other("solver", "\"pbf\" or \"flip\"").about("which solver"),
    Key::number("resolution", SEARCHED)
        .about("cells, or spacings with PBF, of a length that the benchmark names"),
    SET,
    Key::other("device", "\"gpu\" or \"cpu\"")
        .absent()
        .about("the GPU if left out"),
];

const ONE_OF: &str = "; one of within, off_by, at_most, at_least, order_at_least and agree_within";

const GATE: &[Key] = &[
    Key::other(
        "of",
        "a number of swell::files::study::validation::Measure, such as \"height_ratio\"",
    )
    .about("what is judged"),
    Key::number("published", BOUND)
        .absent()
        .about("what theory or an experiment has"),
    Key::other("source", "words").about("whose word that is"),
    Key::number("within", BOUND)
        .absent()
        .also(ONE_OF)
        .about("of |measured / published − 1|"),
    Key::number("off_by", BOUND)
        .absent()
        .also(ONE_OF)
        .about("of |measured − published|"),
    Key::number("at_most", BOUND)
        .absent()
        .also(ONE_OF)
        .about("of the number"),
    Key::number("at_least", BOUND)
        .absent()
        .also(ONE_OF)
        .about("of the number"),
    Key::number("order_at_least", BOUND)
        .absent()
        .also(ONE_OF)
        .about(
            "the power of the resolution with which the error falls; without published, of three \
             runs in a row of one ratio, with which their changes do",
        ),
    Key::number("agree_within", BOUND)
        .absent()
        .also(ONE_OF)
        .about("largest less least of all resolutions, over their mean"),
    Key::other("solver", "\"pbf\" or \"flip\"")
        .absent()
        .about("the only solver that is judged"),
    Key::number("resolution", SEARCHED)
        .absent()
        .about("the only resolution that is judged"),
    Key::other("known_failure", "words")
        .absent()
        .about("why it is missed; a known failure that passes is told as well"),
];

const POINTS: &[Key] = &[
    Key::other(
        "of",
        "a curve of swell::files::study::validation::Measure, such as \"front\"",
    )
    .about("what they stand beside"),
    Key::other("source", "words").about("whose they are"),
    Key::other("at", "an array of [x, y] in the curve's units").about("x rising"),
];
