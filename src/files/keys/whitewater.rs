//! Keys of whitewater settings.

use super::{
    super::{declare::keys, key::Interval},
    scene::{COORDINATE, MeshSpec},
};

/// Radius of whitewater particles, metres, from mist to a bucket.
const RADIUS: Interval = 1e-6..=10.0;
const RATE: Interval = 0.0..=1e7;
const POTENTIAL: Interval = 0.0..=1e9;
const SECONDS: Interval = 1e-4..=1e6;

/// Default range of radii, particle spacings.
pub(crate) const RADII: [f64; 2] = [0.025, 0.08];

keys! { struct WhitewaterSpec {
    seed: u32 = whole(0..=u32::MAX)
        .default("0")
        .about("of all random numbers"),
    max_particles: u32 = whole(1..=200_000_000)
        .default("4000000")
        .about("a frame with more ends the job, its last good frame kept"),
    radius: Option<[f64; 2]> = vector(2, RADIUS)
        .unit("metres")
        .computed(|| format!("{} and {} particle spacings", RADII[0], RADII[1]))
        .also(", rising")
        .about("least and greatest radius of a whitewater particle, as it is drawn"),
    emission: EmissionSpec = table()
        .default("{}")
        .about("Where whitewater is born, and how much (Ihmsen et al. 2012)"),
    spray: SpraySpec = table()
        .default("{}")
        .about("Drops in the air"),
    foam: FoamSpec = table()
        .default("{}")
        .about("What floats on the surface"),
    bubbles: BubblesSpec = table()
        .default("{}")
        .about("Air under the surface"),
    #[serde(default)]
    kill: Vec<KillSpec> = tables().about("A region in which whitewater ends, of whatever kind"),
} }

keys! { struct EmissionSpec {
    trapped_air_rate: f64 = number(RATE)
        .unit("1/s")
        .default("250.0")
        .about("born a second of one water particle where water meets water hardest; 0: none"),
    wave_crest_rate: f64 = number(RATE)
        .unit("1/s")
        .default("250.0")
        .about("the same at the sharpest crests"),
    trapped_air: Option<[f64; 2]> = vector(2, POTENTIAL)
        .unit("m/s")
        .computed(|| "what the shot gives".to_owned())
        .also(", rising")
        .about("from where to where the potential of trapped air grows from 0 to 1"),
    wave_crest: Option<[f64; 2]> = vector(2, POTENTIAL)
        .computed(|| "what the shot gives".to_owned())
        .also(", rising")
        .about("the same of wave crests"),
    energy: Option<[f64; 2]> = vector(2, POTENTIAL)
        .unit("J/kg")
        .computed(|| "what the shot gives".to_owned())
        .also(", rising")
        .about("the same of v²/2, which the other two are multiplied by"),
} }

keys! { struct SpraySpec {
    drop_radius: f64 = number(RADIUS)
        .unit("metres")
        .default("0.001")
        .about("of the drops that a particle of spray stands for; the air slows small ones more"),
    wind: [f64; 3] = vector(3, -1e3..=1e3)
        .unit("m/s")
        .default("[0.0, 0.0, 0.0]")
        .about("velocity of the air"),
} }

keys! { struct FoamSpec {
    lifetime: [f64; 2] = vector(2, SECONDS)
        .unit("seconds")
        .default("[0.5, 4.0]")
        .also(", rising")
        .about("least and greatest; a stronger cause leaves foam that lives longer"),
    crowd: u32 = whole(1..=1_000_000)
        .default("64")
        .about("foam in a cube of one spacing from which on it dies faster"),
} }

keys! { struct BubblesSpec {
    rise_speed: f64 = number(0.0..=10.0)
        .unit("m/s")
        .default("0.25")
        .about(
            "through still water; bubbles of 1 to 10 mm rise at 0.2 to 0.3 m/s \
             (Clift, Grace and Weber 1978)",
        ),
    response: f64 = number(SECONDS)
        .unit("seconds")
        .default("0.1")
        .about("how fast a bubble takes on what the water about it does"),
} }

keys! { struct KillSpec {
    min: Option<[f64; 3]> = vector(3, COORDINATE)
        .unit("metres")
        .absent()
        .with("max")
        .without(&["mesh", "sides"])
        .also(", below max")
        .about("least corner of the region"),
    max: Option<[f64; 3]> = vector(3, COORDINATE)
        .unit("metres")
        .absent()
        .with("min")
        .without(&["mesh", "sides"])
        .also(", above min")
        .about("greatest corner"),
    mesh: Option<MeshSpec> = inline()
        .absent()
        .without(&["min", "max", "sides"])
        .about("A mesh that is the region, where that is no box; relative to this file"),
    sides: Option<f64> = number(1e-6..=1e6)
        .unit("metres")
        .absent()
        .without(&["min", "max", "mesh"])
        .about(
            "instead of a box: it is as wide along all walls of the domain that face x or z",
        ),
    from: f64 = number(0.0..=1e9)
        .unit("s")
        .default("0.0")
        .about("it acts at the ends of frames after this time"),
    until: Option<f64> = number(0.0..=1e9)
        .unit("s")
        .absent()
        .also(", after from")
        .about("and not at the ends of frames after this one"),
} }
