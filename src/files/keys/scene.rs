//! Keys of a scene, in the order in which a cache's `scene.toml` has them.
//!
//! Each range is wider than any shot needs, yet narrow enough that no product or quotient of
//! allowed values overflows or underflows in the solvers.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{
    super::{
        axis::Axis,
        declare::{Keyed, keys},
        key::{Interval, Key, words},
    },
    body::BodySpec,
    budget::BudgetSpec,
    motion::{SolidMotionSpec, TrackSpec, TurnSpec, WallMotionSpec},
    outputs::{GridsSpec, KeepSpec, ProbeSpec},
    solver::SolverSpec,
};
use swell_domain::forces::{ForceKind, MAX_FALLOFF, Medium};
use swell_scene::{Effects, Shot, Wall, start_waves::StartWave};

keys! { struct SceneSpec {
    shot: Shot = table()
        .about("What the shot is called, how long it runs, how fine its clock is"),
    domain: DomainSpec = table().about("The box of the whole scene; its walls are solid"),
    water: WaterSpec = table()
        .default("{}")
        .about("The water and where it is at the start"),
    #[serde(default)]
    solid: Vec<SolidSpec> = tables().about("What the water meets: meshes, at rest or in motion"),
    #[serde(default)]
    body: Vec<BodySpec> = tables().about("What floats: meshes that the water moves"),
    #[serde(default)]
    wave_maker: Vec<WaveMakerSpec> = tables().about("Walls of the domain that move inward"),
    #[serde(default)]
    emitter: Vec<EmitterSpec> = tables().about("Where water enters while the shot runs"),
    #[serde(default)]
    drain: Vec<DrainSpec> = tables()
        .about("Where water leaves while the shot runs; before any enters"),
    #[serde(default)]
    force: Vec<ForceSpec> = tables()
        .about("Accelerations in a room, for a time, which add to gravity's"),
    solver: SolverSpec = table()
        .about("Which solver, and the settings of each; both tables may stand"),
    grids: Option<GridsSpec> = table()
        .absent()
        .not_physics()
        .about("Each frame's water as OpenVDB grids beside its particles"),
    keep: Option<KeepSpec> = table()
        .absent()
        .not_physics()
        .about("What of a bake stays on the disk; without this table, all"),
    #[serde(default)]
    probe: Vec<ProbeSpec> = tables()
        .not_physics()
        .about("What is measured, a CSV each"),
    budget: BudgetSpec = table()
        .default("{}")
        .not_physics()
        .about("What ends the bake where it is passed; `false` switches a limit off"),
    effects: Effects = table()
        .default("{}")
        .about("Effects; what is not named here does not exist"),
} }

/// World coordinates along an axis, metres.
pub(super) const COORDINATE: Interval = -1e6..=1e6;

/// Gravity, m/s², and velocities of individual particles, m/s.
pub(super) const VECTOR: Interval = -1e4..=1e4;

keys! { fields of Shot {
    name: String = file_stem()
        .not_physics()
        .about("names the files"),
    frames: u32 = whole(1..=1_000_000)
        .not_physics()
        .about("output frames; frame 1 is the first after the start"),
    // From one frame in 100 s, with which a tide takes a thousand frames, to the rate of a
    // high-speed camera.
    frames_per_second: f64 = number(0.01..=1e5)
        .unit("per second")
        .about("output frames a second"),
} }

/// Values of `domain.walls`, which applies to all six walls.
pub(crate) const WALLS: [&str; 2] = ["free_slip", "no_slip"];

keys! { struct DomainSpec {
    min: [f64; 3] = vector(3, COORDINATE)
        .unit("metres")
        .also(", each below max by 1e-8 at least")
        .about("least corner"),
    max: [f64; 3] = vector(3, COORDINATE)
        .unit("metres")
        .also(", each above min by 1e-8 at least")
        .about("greatest corner"),
    walls: Option<String> = choice(&WALLS)
        .computed(|| "free_slip, but for those of no_slip".to_owned())
        .also(", the last of the solver flip, or where an effect resolves them")
        .about(
            "how water meets all six walls: free-slip ones it slides along, no-slip ones \
             slow what is within a cell",
        ),
    no_slip: Option<Vec<Wall>> = choices(&words(&Wall::NAMED))
        .absent()
        .without(&["walls"])
        .also(", each once; of the solver flip, or where an effect resolves them")
        .about("the no-slip walls, where not all six are"),
    direction: Option<[f64; 3]> = vector(3, -1e6..=1e6)
        .absent()
        .with("motion")
        .also(", not all 0; their length does not count")
        .about("where the domain moves"),
    motion: Option<SolidMotionSpec> = inline()
        .absent()
        .with("direction")
        .also(", without bodies, a band and domain.periodic")
        .about(
            "How far along `direction` the domain has come; the points of a table may be negative. \
             Water, walls and solids are described in the domain, whose water feels the motion as \
             a force",
        ),
    pivot: Option<[f64; 3]> = vector(3, COORDINATE)
        .unit("metres")
        .absent()
        .with("axis")
        .about("a point on the axis; a motion along `direction` carries it along"),
    axis: Option<[f64; 3]> = vector(3, -1e6..=1e6)
        .absent()
        .with("turn")
        .also(", not all 0; their length does not count")
        .about("what the domain turns about, counter-clockwise as seen against it"),
    turn: Option<TurnSpec> = inline()
        .absent()
        .with("pivot")
        .also(", without bodies, a band and domain.periodic")
        .about("How far about `axis` the domain has turned"),
    periodic: Option<Vec<Axis>> = choices(&words(&Axis::NAMED))
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
} }

keys! { struct WaterSpec {
    // Hydrogen gas has a density of 0.09 kg/m³, osmium 22 590 kg/m³.
    rest_density: f64 = number(0.01..=1e5)
        .unit("kg/m³")
        .default("1000.0")
        .about("density at rest"),
    gravity: [f64; 3] = vector(3, VECTOR)
        .unit("m/s²")
        .default("[0.0, -9.81, 0.0]")
        .about("acceleration of all water"),
    current: Option<[f64; 3]> = vector(3, VECTOR)
        .unit("m/s")
        .absent()
        .also(", y 0, and x and z only where domain.periodic names them")
        .about(
            "velocity of the undisturbed water: blocks, meshes and waves start with it, and zones \
             relax the water towards it, as seen from a ship under way",
        ),
    #[serde(default)]
    block: Vec<BoxSpec> = tables().about("A box full of water"),
    #[serde(default)]
    mesh: Vec<MeshSpec> = tables().about("A mesh full of water"),
    #[serde(default)]
    wave: Vec<StartWave> = tables()
        .about("Waves that are on the water at the start, which fills the domain below them"),
    #[serde(default)]
    particles: Vec<SwarmSpec> = tables().about("Single particles, one by one"),
} }

keys! { struct BoxSpec {
    min: [f64; 3] = vector(3, COORDINATE)
        .unit("metres")
        .also(", in the domain and below max")
        .about("least corner"),
    max: [f64; 3] = vector(3, COORDINATE)
        .unit("metres")
        .also(", in the domain and above min")
        .about("greatest corner"),
} }

pub(super) const fn blake3(name: &'static str) -> Key {
    Key::text(name, "the BLAKE3 of the file in hex, or nothing")
        .absent()
        .about("the mesh is refused where its file has another; a cache's scene has it")
}

pub(super) const fn translate(name: &'static str) -> Key {
    Key::vector(name, 3, -1e9..=1e9)
        .unit("metres")
        .default("[0.0, 0.0, 0.0]")
        .about("where the file's origin goes, after scale and rotation")
}

pub(super) const fn rotate(name: &'static str) -> Key {
    Key::vector(name, 3, -1e6..=1e6)
        .unit("degrees about x, then y, then z")
        .default("[0.0, 0.0, 0.0]")
        .about("rotation, as \"XYZ Euler\" means in Blender and Houdini")
}

pub(super) const fn scale(name: &'static str) -> Key {
    Key::scale(name, 1e-6..=1e6)
        .default("1.0")
        .about("metres per unit of the file, for all axes or each")
}

keys! { struct MeshSpec {
    file: String = text(
        "a closed .obj, .ply or .stl, or a level set in a .vdb, within the domain, \
         relative to the scene file",
    )
    .by_hash()
    .about("the mesh; open ones are taken with a warning where an inside can be told"),
    blake3: Option<String> = blake3,
    translate: [f64; 3] = translate,
    rotate_degrees: [f64; 3] = rotate,
    scale: ScaleSpec = scale,
} }

/// A scale for all axes, or for each.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(untagged)]
pub(crate) enum ScaleSpec {
    Uniform(f64),
    PerAxis([f64; 3]),
}

impl From<ScaleSpec> for DVec3 {
    fn from(scale: ScaleSpec) -> Self {
        match scale {
            ScaleSpec::Uniform(scale) => Self::splat(scale),
            ScaleSpec::PerAxis(scale) => Self::from_array(scale),
        }
    }
}

keys! { struct SwarmSpec {
    at: Vec<[f64; 3]> = points(3, "an array of [x, y, z], metres, in the domain")
        .about("positions, taken as they are"),
    velocity: [f64; 3] = vector(3, VECTOR)
        .unit("m/s")
        .default("[0.0, 0.0, 0.0]")
        .about("of all of them"),
} }

keys! { struct SolidSpec {
    mesh: Option<String> = text(
        "a closed .obj, .ply or .stl, or a level set in a .vdb, that reaches into the domain, \
         relative to the scene file; or sequence",
    )
    .absent()
    .by_hash()
    .about("the mesh; open ones are taken with a warning where an inside can be told"),
    blake3: Option<String> = blake3,
    sequence: Option<SequenceSpec> = inline()
        .absent()
        .without(&["mesh", "motion", "turn", "track"])
        .also(
            ", of which one reaches into the domain, no point faster than 100000 m/s; not with \
             domain.periodic",
        )
        .about("Mesh files over time, for a solid whose shape changes"),
    translate: [f64; 3] = translate,
    rotate_degrees: [f64; 3] = rotate,
    scale: ScaleSpec = scale,
    direction: Option<[f64; 3]> = vector(3, -1e6..=1e6)
        .absent()
        .with("motion")
        .also(", not all 0; their length does not count")
        .about("where a solid moves"),
    motion: Option<SolidMotionSpec> = inline()
        .absent()
        .with("direction")
        .also(", that brings the solid into the domain and not ten domains away")
        .about("How far along `direction` the solid has come"),
    pivot: Option<[f64; 3]> = vector(3, -1e9..=1e9)
        .unit("metres")
        .absent()
        .with("axis")
        .about("a point on the axis at the start; a motion along `direction` carries it along"),
    axis: Option<[f64; 3]> = vector(3, -1e6..=1e6)
        .absent()
        .with("turn")
        .also(", not all 0; their length does not count")
        .about("what a solid turns about, counter-clockwise as seen against it"),
    turn: Option<TurnSpec> = inline()
        .absent()
        .with("pivot")
        .also(", that brings the solid into the domain, no point of it faster than 100000 m/s")
        .about("How far about `axis` the solid has turned"),
    track: Option<TrackSpec> = inline()
        .absent()
        .without(&["motion", "turn"])
        .also(
            ", that brings the solid into the domain, no point of it faster than 100000 m/s; \
             not with domain.periodic",
        )
        .about("Where the solid stands over time, from where it stands at the start on"),
} }

/// Largest number in the name of a file of a sequence.
const LAST_NUMBER: u32 = 999_999_999;

keys! { struct SequenceSpec {
    files: FilesSpec = other(
        "a name with one place for a number, such as \"whale.%04d.obj\" or \"whale.####.obj\", \
         relative to the scene file, or an array of at least two names",
    )
    .by_hash()
    .about(
        "the meshes, all that there are, without a gap in their numbers; placed by translate, \
         rotate_degrees and scale; the written-out scene lists them",
    ),
    blake3: Option<Vec<String>> = other("an array of BLAKE3 hashes, one for each file")
        .absent()
        .about("hashes that the files must have; the written-out scene has them"),
    first: Option<u32> = whole(0..=LAST_NUMBER)
        .absent()
        .about("number of the first file of an array; left out: 0"),
    start: Option<u32> = whole(0..=LAST_NUMBER)
        .absent()
        .about(
            "number of the file that is at frame 1 of the shot, such as 1001; left out: file 0 \
             would be at its start",
        ),
    frames_per_second: Option<f64> = number(0.01..=1e5)
        .unit("per second")
        .computed(|| "the shot's".to_owned())
        .about("files a second"),
} }

/// Files of a sequence, as a scene names them.
#[derive(Clone, Debug, serde::Deserialize, serde::Serialize)]
#[serde(untagged)]
pub(crate) enum FilesSpec {
    /// A name with a place for a number.
    Pattern(String),
    /// Names in order.
    List(Vec<String>),
}

keys! { struct WaveMakerSpec {
    wall: Wall = choice(&words(&Wall::NAMED))
        .also(", each once")
        .about("which wall of the domain"),
    motion: WallMotionSpec = inline()
        .also(
            ", that leaves at least two particle spacings (PBF) or three cells \
             (FLIP) between the walls",
        )
        .about("How far inward the wall has come"),
    absorption: Option<AbsorptionSpec> = inline()
        .absent()
        .also(
            ", of a wall along x or z under gravity straight down, with frames short enough for it",
        )
        .about(
            "Whether the wall also takes in waves that come to it (active absorption, Schäffer \
             and Klopman 2000): once a frame it answers by how much the water beside it stands \
             over the wall's own waves",
        ),
} }

keys! { struct AbsorptionSpec {
    depth: f64 = number(1e-3..=1e6)
        .unit("metres")
        .about("of the water at rest"),
    period: f64 = number(1e-3..=1e6)
        .unit("seconds")
        .about("of the waves that it absorbs best, as linear theory has it"),
    room: f64 = number(1e-6..=1e6)
        .unit("metres")
        .also(", twice of it inside of the domain")
        .about(
            "how far the wall may come off its own way; it rests as far inside of the domain's \
             face, and all distances of its motion are from there",
        ),
} }

const fn room_min(name: &'static str) -> Key {
    Key::vector(name, 3, COORDINATE)
        .unit("metres")
        .without(&["mesh"])
        .also(", in the domain and below max")
        .about("least corner of its room, where that is a box")
}

const fn room_max(name: &'static str) -> Key {
    Key::vector(name, 3, COORDINATE)
        .unit("metres")
        .without(&["mesh"])
        .also(", in the domain and above min")
        .about("greatest corner")
}

const fn room_mesh(name: &'static str) -> Key {
    Key::inline(name, MeshSpec::KEYS)
        .absent()
        .without(&["min", "max"])
        .about("A mesh that is its room, where that is no box")
}

const fn from(name: &'static str) -> Key {
    Key::number(name, 0.0..=1e9)
        .unit("s")
        .default("0.0")
        .about("from this time on; drains, levels and kill volumes at the ends of frames after it")
}

const fn until(name: &'static str) -> Key {
    Key::number(name, 0.0..=1e9)
        .unit("s")
        .absent()
        .also(", after from")
        .about("until this one; drains, levels and kill volumes not at the ends of frames after it")
}

keys! { struct EmitterSpec {
    min: Option<[f64; 3]> = room_min,
    max: Option<[f64; 3]> = room_max,
    mesh: Option<MeshSpec> = room_mesh,
    velocity: [f64; 3] = vector(3, VECTOR)
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
    level: Option<f64> = number(COORDINATE)
        .unit("metres")
        .absent()
        .also(", within the room; only with gravity along -y")
        .about("height up to which the room is kept full, whatever the velocity is"),
    from: f64 = from,
    until: Option<f64> = until,
} }

keys! { struct DrainSpec {
    min: Option<[f64; 3]> = room_min,
    max: Option<[f64; 3]> = room_max,
    mesh: Option<MeshSpec> = room_mesh,
    level: Option<f64> = number(COORDINATE)
        .unit("metres")
        .absent()
        .also(", within the room; only with gravity along -y")
        .about("height below which water stays"),
    rate: Option<f64> = number(1e-18..=1e12)
        .unit("m³/s")
        .absent()
        .about("the most that leaves; without it, all that is in the room at a frame's end"),
    from: f64 = from,
    until: Option<f64> = until,
} }

/// Kinds of forces with a law of the distance.
const BY_DISTANCE: &[&str] = &["vortex", "attract"];

keys! { struct ForceSpec {
    kind: String = choice(&ForceKind::NAMES)
        .about(
            "the same acceleration everywhere; one around an axis; one towards a point, or away \
             from it with a strength below 0",
        ),
    min: Option<[f64; 3]> = vector(3, COORDINATE)
        .unit("metres")
        .absent()
        .with("max")
        .without(&["mesh"])
        .also(", below max")
        .about("least corner of its room, where that is a box; left out with mesh: everywhere"),
    max: Option<[f64; 3]> = vector(3, COORDINATE)
        .unit("metres")
        .absent()
        .with("min")
        .without(&["mesh"])
        .also(", above min")
        .about("greatest corner"),
    mesh: Option<MeshSpec> = room_mesh,
    fade: f64 = number_or_zero(1e-6..=1e6)
        .unit("metres")
        .default("0.0")
        .also("; only with a room")
        .about("depth in the room at which it is at its full strength; 0: a sharp edge"),
    acceleration: Option<[f64; 3]> = vector(3, VECTOR)
        .unit("m/s²")
        .only("kind", &["acceleration"])
        .about("what it adds to gravity's"),
    at: Option<[f64; 3]> = vector(3, COORDINATE)
        .unit("metres")
        .only("kind", BY_DISTANCE)
        .about("a point of the vortex's axis; the point that attracts"),
    axis: Option<[f64; 3]> = vector(3, VECTOR)
        .default("[0.0, 1.0, 0.0]")
        .only("kind", &["vortex"])
        .also(", not all 0")
        .about("direction of the axis; it pushes counter-clockwise as seen from its tip"),
    strength: Option<f64> = number(VECTOR)
        .unit("m/s²")
        .only("kind", BY_DISTANCE)
        .about("acceleration at the distance core from the axis or point, the largest there is"),
    core: Option<f64> = number(1e-6..=1e6)
        .unit("metres")
        .only("kind", BY_DISTANCE)
        .about("distance up to which the acceleration grows, from 0, linearly"),
    falloff: Option<u32> = whole(0..=MAX_FALLOFF)
        .default("0")
        .only("kind", BY_DISTANCE)
        .about(
            "how it falls beyond: strength × (core / distance)^falloff; 0 is the same everywhere \
             beyond",
        ),
    on: Vec<Medium> = choices(&words(&Medium::NAMED))
        .default("[\"water\", \"whitewater\"]")
        .also(", at least one")
        .about("what it accelerates: the water; drops of whitewater in the air"),
    from: f64 = from,
    until: Option<f64> = until,
} }
