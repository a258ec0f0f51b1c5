//! Keys of a scene, in the order in which a cache's `scene.toml` has them.
//!
//! Each range is wider than any shot needs, yet narrow enough that no product or quotient of
//! allowed values overflows or underflows in the solvers.

use super::super::{
    axis::Axis,
    build::{CHEBYSHEV_RELAXATION, RELAXATION},
    effects, keep,
    key::{Interval, Key, words},
    no_slip, probe, start_waves,
};
use super::{
    budget::BUDGET,
    motion::{SOLID_MOTION, SOLID_TRACK, SOLID_TURN, WALL_MOTION},
};
use swell_domain::sparse_grid;
use swell_scene::{
    Iteration, Method, Wall,
    flip::{self, Preconditioner, Surface, Transfer},
    probe::ProbeKind,
};

pub(in super::super) const KEYS: &[Key] = &[
    Key::table("shot", SHOT)
        .about("What the shot is called, how long it runs, how fine its clock is"),
    Key::table("domain", DOMAIN).about("The box of the whole scene; its walls are solid"),
    Key::table("water", WATER)
        .default("{}")
        .about("The water and where it is at the start"),
    Key::tables("solid", SOLID).about("What the water meets: meshes, at rest or in motion"),
    Key::tables("wave_maker", WAVE_MAKER).about("Walls of the domain that move inward"),
    Key::tables("emitter", EMITTER).about("Where water enters while the shot runs"),
    Key::tables("drain", DRAIN).about("Where water leaves while the shot runs; before any enters"),
    Key::table("solver", SOLVER)
        .about("Which solver, and the settings of each; both tables may stand"),
    Key::table("grids", GRIDS)
        .absent()
        .not_physics()
        .about("Each frame's water as OpenVDB grids beside its particles"),
    Key::table("keep", KEEP)
        .absent()
        .not_physics()
        .about("What of a bake stays on the disk; without this table, all"),
    Key::tables("probe", PROBE)
        .not_physics()
        .about("What is measured, a CSV each"),
    Key::table("budget", BUDGET)
        .default("{}")
        .not_physics()
        .about("What ends the bake where it is passed; `false` switches a limit off"),
    Key::table("effects", effects::KEYS)
        .default("{}")
        .about("Effects; what is not named here does not exist"),
];

/// World coordinates along an axis, metres.
const COORDINATE: Interval = -1e6..=1e6;

/// Metres. Below 10 nm matter is no continuum; 100 km is a tenth of the largest domain.
const SPACING: Interval = 1e-8..=1e5;

/// Largest displacement per substep. With 10 000 substeps per frame, the largest number allowed,
/// 1e-5 amounts to a tenth per frame.
const CFL: Interval = 1e-5..=5.0;

/// Gravity, m/s², and velocities of individual particles, m/s.
const VECTOR: Interval = -1e4..=1e4;

/// Iterations, or substeps per frame.
const MANY: std::ops::RangeInclusive<u32> = 1..=10_000;

const SHOT: &[Key] = &[
    Key::file_stem("name")
        .not_physics()
        .about("names the files"),
    Key::whole("frames", 1..=1_000_000)
        .not_physics()
        .about("output frames; frame 1 is the first after the start"),
    // From one frame in 100 s, with which a tide takes a thousand frames, to the rate of a
    // high-speed camera.
    Key::number("frames_per_second", 0.01..=1e5)
        .unit("per second")
        .about("output frames a second"),
];

const DOMAIN: &[Key] = &[
    Key::vector("min", 3, COORDINATE)
        .unit("metres")
        .also(", each below max by 1e-8 at least")
        .about("least corner"),
    Key::vector("max", 3, COORDINATE)
        .unit("metres")
        .also(", each above min by 1e-8 at least")
        .about("greatest corner"),
    Key::choice("walls", &no_slip::WALLS)
        .computed(|| "free_slip, but for those of no_slip".to_owned())
        .also(", the last of the solver flip, or where an effect resolves them")
        .about(
            "how water meets all six walls: free-slip ones it slides along, no-slip ones \
             slow what is within a cell",
        ),
    Key::choices("no_slip", &WALLS)
        .absent()
        .without(&["walls"])
        .also(", each once; of the solver flip, or where an effect resolves them")
        .about("the no-slip walls, where not all six are"),
    Key::choices("periodic", &AXES)
        .absent()
        .also(
            ", each once, none along which gravity acts, a wave maker stands or a solid moves; \
             along each the domain is a multiple of eight cells (FLIP), of 16 particle spacings \
             (PBF), or without grid_projection of one and at least three support radii",
        )
        .about(
            "axes along which the domain has no walls: water that leaves at one \
             end comes in at the other",
        ),
];

const AXES: [&str; 3] = words(&Axis::NAMED);

const WATER: &[Key] = &[
    // Hydrogen gas has a density of 0.09 kg/m³, osmium 22 590 kg/m³.
    Key::number("rest_density", 0.01..=1e5)
        .unit("kg/m³")
        .default("1000.0")
        .about("density at rest"),
    Key::vector("gravity", 3, VECTOR)
        .unit("m/s²")
        .default("[0.0, -9.81, 0.0]")
        .about("acceleration of all water"),
    Key::tables("block", BLOCK).about("A box full of water"),
    Key::tables("mesh", WATER_MESH).about("A mesh full of water"),
    Key::tables("wave", start_waves::KEYS)
        .about("Waves that are on the water at the start, which fills the domain below them"),
    Key::tables("particles", PARTICLES).about("Single particles, one by one"),
];

const BLOCK: &[Key] = &[
    Key::vector("min", 3, COORDINATE)
        .unit("metres")
        .also(", in the domain and below max")
        .about("least corner"),
    Key::vector("max", 3, COORDINATE)
        .unit("metres")
        .also(", in the domain and above min")
        .about("greatest corner"),
];

const BLAKE3: Key = Key::text("blake3", "the BLAKE3 of the file in hex, or nothing")
    .absent()
    .about("the mesh is refused where its file has another; a cache's scene has it");
const TRANSLATE: Key = Key::vector("translate", 3, -1e9..=1e9)
    .unit("metres")
    .default("[0.0, 0.0, 0.0]")
    .about("where the file's origin goes, after scale and rotation");
const ROTATE: Key = Key::vector("rotate_degrees", 3, -1e6..=1e6)
    .unit("degrees about x, then y, then z")
    .default("[0.0, 0.0, 0.0]")
    .about("rotation, as \"XYZ Euler\" means in Blender and Houdini");
const SCALE: Key = Key::scale("scale", 1e-6..=1e6)
    .default("1.0")
    .about("metres per unit of the file, for all axes or each");

const WATER_MESH: &[Key] = &[
    Key::text(
        "file",
        "a closed .obj, .ply or .stl, or a level set in a .vdb, within the domain, \
         relative to the scene file",
    )
    .by_hash()
    .about("the mesh; open ones are taken with a warning where an inside can be told"),
    BLAKE3,
    TRANSLATE,
    ROTATE,
    SCALE,
];

const PARTICLES: &[Key] = &[
    Key::points("at", 3, "an array of [x, y, z], metres, in the domain")
        .about("positions, taken as they are"),
    Key::vector("velocity", 3, VECTOR)
        .unit("m/s")
        .default("[0.0, 0.0, 0.0]")
        .about("of all of them"),
];

const SOLID: &[Key] = &[
    Key::text(
        "mesh",
        "a closed .obj, .ply or .stl, or a level set in a .vdb, that reaches into the domain, \
         relative to the scene file",
    )
    .by_hash()
    .about("the mesh; open ones are taken with a warning where an inside can be told"),
    BLAKE3,
    TRANSLATE,
    ROTATE,
    SCALE,
    Key::vector("direction", 3, -1e6..=1e6)
        .absent()
        .with("motion")
        .also(", not all 0; their length does not count")
        .about("where a solid moves"),
    Key::inline("motion", SOLID_MOTION)
        .absent()
        .with("direction")
        .also(", that brings the solid into the domain and not ten domains away")
        .about("How far along `direction` the solid has come"),
    Key::vector("pivot", 3, -1e9..=1e9)
        .unit("metres")
        .absent()
        .with("axis")
        .about("a point on the axis at the start; a motion along `direction` carries it along"),
    Key::vector("axis", 3, -1e6..=1e6)
        .absent()
        .with("turn")
        .also(", not all 0; their length does not count")
        .about("what a solid turns about, counter-clockwise as seen against it"),
    Key::inline("turn", SOLID_TURN)
        .absent()
        .with("pivot")
        .also(", that brings the solid into the domain, no point of it faster than 100000 m/s")
        .about("How far about `axis` the solid has turned"),
    Key::inline("track", SOLID_TRACK)
        .absent()
        .without(&["motion", "turn"])
        .also(
            ", that brings the solid into the domain, no point of it faster than 100000 m/s; \
             not with domain.periodic",
        )
        .about("Where the solid stands over time, from where it stands at the start on"),
];

const WAVE_MAKER: &[Key] = &[
    Key::choice("wall", &WALLS)
        .also(", each once")
        .about("which wall of the domain"),
    Key::inline("motion", WALL_MOTION)
        .also(
            ", that leaves at least two particle spacings (PBF) or three cells \
             (FLIP) between the walls",
        )
        .about("How far inward the wall has come"),
    Key::inline("absorption", ABSORPTION)
        .absent()
        .also(
            ", of a wall along x or z under gravity straight down, with frames short enough for it",
        )
        .about(
            "Whether the wall also takes in waves that come to it (active absorption, Schäffer \
             and Klopman 2000): once a frame it answers by how much the water beside it stands \
             over the wall's own waves",
        ),
];

/// Keys of an absorbing wall.
const ABSORPTION: &[Key] = &[
    Key::number("depth", 1e-3..=1e6)
        .unit("metres")
        .about("of the water at rest"),
    Key::number("period", 1e-3..=1e6)
        .unit("seconds")
        .about("of the waves that it absorbs best, as linear theory has it"),
    Key::number("room", 1e-6..=1e6)
        .unit("metres")
        .also(", twice of it inside of the domain")
        .about(
            "how far the wall may come off its own way; it rests as far inside of the domain's \
             face, and all distances of its motion are from there",
        ),
];

const ROOM_MIN: Key = Key::vector("min", 3, COORDINATE)
    .unit("metres")
    .without(&["mesh"])
    .also(", in the domain and below max")
    .about("least corner of its room, where that is a box");
const ROOM_MAX: Key = Key::vector("max", 3, COORDINATE)
    .unit("metres")
    .without(&["mesh"])
    .also(", in the domain and above min")
    .about("greatest corner");
const ROOM_MESH: Key = Key::inline("mesh", WATER_MESH)
    .absent()
    .without(&["min", "max"])
    .about("A mesh that is its room, where that is no box");
const FROM: Key = Key::number("from", 0.0..=1e9)
    .unit("s")
    .default("0.0")
    .about("it acts from this time on; drains and levels at the ends of frames after it");
const UNTIL: Key = Key::number("until", 0.0..=1e9)
    .unit("s")
    .absent()
    .also(", after from")
    .about("and until this one; drains and levels not at the ends of frames after it");

const EMITTER: &[Key] = &[
    ROOM_MIN,
    ROOM_MAX,
    ROOM_MESH,
    Key::vector("velocity", 3, VECTOR)
        .unit("m/s")
        .default("[0.0, 0.0, 0.0]")
        .also(
            ", by which water goes no farther in a frame than the room is \
             long; not 0 without a level",
        )
        .about(
            "of the water that enters, and without a level how much does: velocity × \
             the room's cross-section",
        ),
    Key::number("level", COORDINATE)
        .unit("metres")
        .absent()
        .also(", within the room; only with gravity along -y")
        .about("height up to which the room is kept full, whatever the velocity is"),
    FROM,
    UNTIL,
];

const DRAIN: &[Key] = &[
    ROOM_MIN,
    ROOM_MAX,
    ROOM_MESH,
    Key::number("level", COORDINATE)
        .unit("metres")
        .absent()
        .also(", within the room; only with gravity along -y")
        .about("height below which water stays"),
    Key::number("rate", 1e-18..=1e12)
        .unit("m³/s")
        .absent()
        .about("the most that leaves; without it, all that is in the room at a frame's end"),
    FROM,
    UNTIL,
];

const WALLS: [&str; 6] = words(&Wall::NAMED);

const METHODS: [&str; 2] = words(&Method::NAMED);

const SOLVER: &[Key] = &[
    Key::choice("method", &METHODS)
        .also(
            ", with a table [solver.pbf] of at least particle_spacing or \
             [solver.flip] of at least cell_size",
        )
        .about("the solver; `--solver` picks as well"),
    Key::table("pbf", PBF)
        .absent()
        .about("Position-based fluids (Macklin and Müller 2013)"),
    Key::table("flip", FLIP)
        .absent()
        .about("PIC/FLIP (Zhu and Bridson 2005)"),
];

const ITERATIONS: [&str; 3] = words(&Iteration::NAMED);

const PBF: &[Key] = &[
    Key::number("particle_spacing", SPACING)
        .unit("metres")
        .also(", with at most 65536 cells along an axis, 2147483647 cells and 134217728 particles")
        .about("d, between neighbours at the start"),
    Key::number("support_ratio", 1.5..=4.0)
        .default("2.0")
        .about("support radius over d"),
    Key::choice("iteration", &ITERATIONS)
        .default("\"red_black\"")
        .about("how corrections see each other"),
    // Above this, Chebyshev's factors hardly change within 10 000 iterations.
    Key::number("spectral_radius", 0.01..=0.9999)
        .only("iteration", &["chebyshev"])
        .default("0.98")
        .about("ρ of the plain iteration; nearer to 1 reaches deeper"),
    Key::whole("iterations", MANY)
        .without(&["density_error", "max_iterations"])
        .default("4")
        .about("of each substep"),
    // `f32` resolves relative differences of 6e-8.
    Key::number("density_error", 1e-7..=0.99)
        .absent()
        .with("max_iterations")
        .about("iterate until the mean of max(0, ρ/ρ0 − 1) is below it"),
    Key::whole("max_iterations", MANY)
        .absent()
        .with("density_error")
        .about("and at most so often"),
    Key::number("cfl", CFL)
        .default("1.0")
        .about("largest displacement in a substep, in d; as many substeps as that asks"),
    // A relaxation of a hundredth takes a hundred iterations for one.
    Key::number("relaxation", 0.01..=1.5)
        .computed(|| {
            format!("{RELAXATION:?}, {CHEBYSHEV_RELAXATION:?} with iteration = \"chebyshev\"")
        })
        .about("ω, factor on each correction"),
    Key::number("artificial_pressure", 0.0..=10.0)
        .default("0.0")
        .about("k of s_corr, with λ's natural scale as unit"),
    Key::flag("grid_projection").default("true").about(
        "velocities are made free of divergence on a grid of cells of 2 d before particles move \
         (Raveendran 2011), so that iterations correct what is left; a period is then a multiple \
         of 16 d. `false`: the iterations alone, as in the paper by Macklin and Müller (2013)",
    ),
    Key::whole("max_substeps", MANY)
        .not_physics()
        .default("32")
        .about("more in a frame are an error (exit 5), never silently fewer"),
];

const TRANSFERS: [&str; 2] = words(&Transfer::NAMED);
const SURFACES: [&str; 2] = words(&Surface::NAMED);

const FLIP: &[Key] = &[
    Key::number("cell_size", SPACING)
        .unit("metres")
        .also(
            ", with at least 3 and at most 65536 cells along each axis, 68719476736 cells \
             and 134217728 particles",
        )
        .about("Δx"),
    // Fewer than four particles do not define the density of a cell.
    Key::whole("particles_per_cell", 4..=64)
        .default("8")
        .about("in a full cell at rest, n on a lattice of spacing Δx / ∛n"),
    Key::choice("transfer", &TRANSFERS)
        .default("\"flip\"")
        .about("`apic` (Jiang 2015) has affine rows as attributes of the frames"),
    Key::number("pic_blend", 0.0..=1.0).default("0.05").about(
        "α, the part of the velocity taken from the grid; a viscosity of α Δx² / \
         (6 Δt); unused by apic",
    ),
    Key::number("cfl", CFL).default("3.0").about(
        "largest displacement in a substep, in cells; a frame has as many substeps as that and \
             Δt ≤ √(Δx / g) ask",
    ),
    Key::whole("max_substeps", MANY)
        .not_physics()
        .default("32")
        .about("more in a frame are an error (exit 5), never silently fewer"),
    Key::choice("surface", &SURFACES)
        .default("\"ghost_fluid\"")
        .about(
            "where the pressure is zero: at the surface (Enright 2003), or in the middle \
             of the first cell of air",
        ),
    Key::flag("density_correction")
        .default("true")
        .about("moves particles so that the volume stays (Kugelstadt 2019)"),
    Key::table("pressure", PRESSURE)
        .default("{}")
        .about("The linear solve of the projection"),
];

const PRECONDITIONERS: [&str; 4] = words(&Preconditioner::NAMED);
const PRECISIONS: [&str; 3] = words(&flip::Precision::NAMED);

const PRESSURE: &[Key] = &[
    Key::choice("preconditioner", &PRECONDITIONERS)
        .default("\"multigrid\"")
        .about("of the conjugate gradients; `ipp` is Ament 2010"),
    Key::choice("precision", &PRECISIONS)
        .default("\"f32_refined\"")
        .also(", the last where the adapter has it")
        .about("one word, iterative refinement, or 64-bit shader floats"),
    // In `f64`, a residual has a rounding error of 2e-16 per term, and a row has seven terms.
    Key::number("tolerance", 1e-14..=0.99)
        .unit("of the right-hand side's norm")
        .default("1e-5")
        .about("true residual at which a solve stops"),
    Key::whole("max_iterations", MANY)
        .default("400")
        .about("a solve that ends there is reported"),
];

const GRID_PRECISIONS: [&str; 2] = words(&sparse_grid::Precision::NAMED);

const GRIDS: &[Key] = &[
    Key::flag("surface")
        .default("false")
        .also("; one of surface and velocity true")
        .about("level set \"surface\", metres, a band of three voxels to each side"),
    Key::flag("velocity")
        .default("false")
        .about("staggered \"vel\", m/s, carried three voxels beyond the water"),
    Key::other(
        "voxel_size",
        "a number from a quarter of the particle spacing to 8 of them, metres, with at most \
         268435456 leaves of 8³ voxels in the domain",
    )
    .computed(|| "flip's cell_size, or two particle spacings of pbf".to_owned())
    .about("edge of a voxel"),
    Key::choice("precision", &GRID_PRECISIONS)
        .default("\"half\"")
        .about("how values are kept"),
];

const KEEP: &[Key] = &[
    Key::text(
        "particles",
        "\"all\", \"every N\" with N from 1 to 1000000, or \"none\"",
    )
    .default("\"all\"")
    .about(
        "frames whose particles stay; the first and the newest are always there, \
         so that a bake can go on",
    ),
    Key::choice("compression", &keep::COMPRESSIONS)
        .default("\"none\"")
        .about(
            "of frames, without loss: zstd makes .ply.zst, which swell and its Python package \
             read, and nothing else",
        ),
];

const PROBES: [&str; 8] = ProbeKind::NAMES;

const PROBE: &[Key] = &[
    Key::file_stem("name")
        .also(", each name once, upper and lower case taken alike")
        .computed(|| "the kind with a number".to_owned())
        .about("of its CSV in the cache"),
    Key::choice("kind", &PROBES)
        .also(
            "; with the solver pbf a pressure asks for grid_projection, or for iteration = \
             \"red_black\" or \"jacobi\" and artificial_pressure = 0",
        )
        .about(
            "elevation of the surface, m; pressure, Pa; energy of all water, J; its volume, m³; \
             front along an axis, m; run_up, the highest water that hangs together with the body, \
             m; flux through a plane, m³/s; force of the pressure on a solid or a wall, N, and its \
             moment, N m, with the solver flip",
        ),
    Key::other(
        "at",
        "[x, z] of an elevation, [x, y, z] of a pressure or [c] of a flux's plane along its \
         axis, metres, in the domain",
    )
    .only("kind", &["elevation", "pressure", "flux"])
    .about("where"),
    Key::choice("axis", &WALLS)
        .only("kind", &["front", "flux"])
        .about("which way a front is ahead, and a flux positive"),
    Key::number("quantile", 1e-6..=1.0)
        .only("kind", &["front", "run_up"])
        .computed(probe::quantile_words)
        .about("part of the water, with run_up of the body of water, that lies behind or below"),
    Key::other(
        "solid",
        "the number of a [[solid]], from 0, or a wall of the domain: \"-x\", \"+x\", \"-y\", \
         \"+y\", \"-z\" or \"+z\"",
    )
    .only("kind", &["force"])
    .about("who bears the force"),
    Key::vector("about", 3, COORDINATE)
        .unit("m")
        .only("kind", &["force"])
        .computed(|| "the middle of the solid's or wall's box at the start".to_owned())
        .about("where the moment is taken about"),
    Key::other(
        "rate_hz",
        "\"substep\" or a number from 0.001 to shot.frames_per_second × the \
         solver's max_substeps, Hz",
    )
    .computed(|| "each frame".to_owned())
    .about(
        "how often it looks: at the end of each substep, or of each in which \
         a time k / rate_hz lies",
    ),
    Key::number("window", 1e-9..=1e6)
        .unit("s")
        .absent()
        .about("time up to each look over which mean, least and greatest value are given as well"),
];
