//! Keys of what a bake writes beside the particles, and of which particles stay.

use serde::{Deserialize, Serialize};

use super::{
    super::{declare::keys, key::words},
    scene::COORDINATE,
};
use swell_domain::{probe::Rate, sparse_grid::Precision};
use swell_scene::{Wall, probe::ProbeKind};

keys! { struct GridsSpec {
    surface: bool = flag()
        .default("false")
        .also("; one of surface and velocity true")
        .about("level set \"surface\", metres, a band of three voxels to each side"),
    velocity: bool = flag()
        .default("false")
        .about("staggered \"vel\", m/s, carried three voxels beyond the water"),
    voxel_size: Option<f64> = other(
        "a number from a quarter of the particle spacing to 8 of them, metres, with at most \
         268435456 leaves of 8³ voxels in the domain",
    )
    .computed(|| "flip's cell_size, or two particle spacings of pbf".to_owned())
    .about("edge of a voxel"),
    precision: Precision = choice(&words(&Precision::NAMED))
        .default("\"half\"")
        .about("how values are kept"),
} }

/// Values of `compression`.
pub(crate) const COMPRESSIONS: [&str; 2] = ["none", "zstd"];

keys! { struct KeepSpec {
    particles: String = text("\"all\", \"every N\" with N from 1 to 1000000, or \"none\"")
        .default("\"all\"")
        .about(
            "frames whose particles stay; the first and the newest are always there, \
             so that a bake can go on",
        ),
    compression: String = choice(&COMPRESSIONS)
        .default("\"none\"")
        .about(
            "of frames, without loss: zstd makes .ply.zst, which swell and its Python package \
             read, and nothing else",
        ),
} }

/// Default for a front: spray ahead of a breaking wave is less than the remainder.
pub(crate) const FRONT_QUANTILE: f64 = 0.995;
/// Default for a run-up, which already ignores water detached from the body.
pub(crate) const RUN_UP_QUANTILE: f64 = 1.0;

/// Describes both defaults.
fn quantile_words() -> String {
    format!("{FRONT_QUANTILE} of a front, {RUN_UP_QUANTILE} of a run_up")
}

keys! { struct ProbeSpec {
    name: Option<String> = file_stem()
        .also(", each name once, upper and lower case taken alike")
        .computed(|| "the kind with a number".to_owned())
        .about("of its CSV in the cache"),
    kind: String = choice(&ProbeKind::NAMES)
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
    at: Option<Vec<f64>> = other(
        "[x, z] of an elevation, [x, y, z] of a pressure or [c] of a flux's plane along its \
         axis, metres, in the domain",
    )
    .only("kind", &["elevation", "pressure", "flux"])
    .about("where"),
    axis: Option<Wall> = choice(&words(&Wall::NAMED))
        .only("kind", &["front", "flux"])
        .about("which way a front is ahead, and a flux positive"),
    quantile: Option<f64> = number(1e-6..=1.0)
        .only("kind", &["front", "run_up"])
        .computed(quantile_words)
        .about("part of the water, with run_up of the body of water, that lies behind or below"),
    solid: Option<BearerSpec> = other(
        "the number of a [[solid]], from 0, or a wall of the domain: \"-x\", \"+x\", \"-y\", \
         \"+y\", \"-z\" or \"+z\"",
    )
    .only("kind", &["force"])
    .about("who bears the force"),
    about: Option<[f64; 3]> = vector(3, COORDINATE)
        .unit("m")
        .only("kind", &["force"])
        .computed(|| "the middle of the solid's or wall's box at the start".to_owned())
        .about("where the moment is taken about"),
    #[serde(default)]
    rate_hz: Rate = other(
        "\"substep\" or a number from 0.001 to shot.frames_per_second × the \
         solver's max_substeps, Hz",
    )
    .computed(|| "each frame".to_owned())
    .about(
        "how often it looks: at the end of each substep, or of each in which \
         a time k / rate_hz lies",
    ),
    window: Option<f64> = number(1e-9..=1e6)
        .unit("s")
        .absent()
        .about("time up to each look over which mean, least and greatest value are given as well"),
} }

/// A body that bears a force: the index of a `[[solid]]`, or a wall.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(untagged)]
pub(crate) enum BearerSpec {
    Number(usize),
    Wall(Wall),
}
