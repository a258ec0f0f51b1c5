//! Keys of whitewater settings.

use super::{
    super::{declare::keys, key::Interval},
    scene::{COORDINATE, MeshSpec},
};

/// Radius of whitewater particles, metres, from mist to a bucket.
const RADIUS: Interval = 1e-6..=10.0;
const RATE: Interval = 0.0..=1e12;
const POTENTIAL: Interval = 0.0..=1e9;
const SECONDS: Interval = 1e-4..=1e6;

keys! { struct WhitewaterSpec {
    seed: u32 = whole(0..=u32::MAX)
        .default("0")
        .about("of all random numbers"),
    max_particles: u32 = whole(1..=200_000_000)
        .default("4000000")
        .about("a frame with more ends the job, its last good frame kept"),
    radius: Option<[f64; 2]> = vector(2, RADIUS)
        .unit("metres")
        .computed(|| "what the shot gives".to_owned())
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
    trapped_air_rate: Option<f64> = number(RATE)
        .unit("1/m³")
        .computed(|| "what the shot gives".to_owned())
        .about("born of a cubic metre that water closes at its surface where it meets water; \
                0: none"),
    wave_crest_rate: Option<f64> = number(RATE)
        .unit("1/(m³ s)")
        .computed(|| "what the shot gives".to_owned())
        .about("born a second of a cubic metre of water in crests; 0: none"),
    trapped_air: [f64; 2] = vector(2, POTENTIAL)
        .default("[0.1, 0.2]")
        .also(", rising")
        .about("from where to where the steepness at which water traps air grows from 0 to 1: \
                the convective acceleration of what meets, over gravity"),
    wave_crest: [f64; 2] = vector(2, POTENTIAL)
        .default("[0.561, 4.19]")
        .also(", rising")
        .about("the same of wave crests: 0.561 at 120°, 4.19 on the edge of a sheet"),
    energy: [f64; 2] = vector(2, POTENTIAL)
        .unit("J/kg")
        .default("[0.5, 2.0]")
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
    crowd: Option<f64> = number(1e-6..=1e12)
        .unit("1/m²")
        .computed(|| "what the shot gives".to_owned())
        .about("foam on a square metre from which on it dies faster"),
} }

keys! { struct BubblesSpec {
    rise_speed: Option<f64> = number(0.0..=10.0)
        .unit("m/s")
        .absent()
        .about(
            "of all bubbles through still water; where left out each rises as its size does, \
             of 0.1 to 5 mm (Deane and Stokes 2002; Clift, Grace and Weber 1978)",
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
