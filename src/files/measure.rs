//! Benchmark measures: the numbers and curves that they produce and the inputs that they need.

/// Measure that a benchmark applies to its runs, and the setup that its scene must have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Waves of a piston, at the scene's elevation probes.
    RegularWaves,
    /// Waves with a theoretical elevation, from a wave maker or a generation zone, at the scene's
    /// elevation probes.
    WavesByTheory,
    /// One solitary wave, at the scene's elevation probes.
    SolitaryWave,
    /// One solitary wave on a plane beach: the scene's run-up probe, and profiles.
    SolitaryBeach,
    /// A column that collapses along x: position of the front, and height at the wall.
    DamBreak,
    /// A long reservoir that empties over a dry bed along x: profile about the dam.
    DryBed,
    /// A dam break that hits a block: the scene's elevation and pressure probes.
    BlockImpact,
    /// A jet along x deflected by a wall: the scene's probe of the force on it.
    JetImpact,
    /// A standing wave between two walls along x, released from rest at its maximum.
    StandingWave,
    /// Water at rest: the scene's pressure probes.
    Hydrostatic,
    /// A vortex in the x-y plane of a closed box full of water, without gravity.
    TaylorGreen,
    /// Water that slides down a slope towards +x without friction.
    Slide,
    /// A body in water: the first of the scene, with the elevation probes where it floats.
    Body,
    /// Waves behind a body in a current along x, whose path is the domain's least z.
    ShipWaves,
}

/// Number of solitary waves.
const RUN_UP: (&str, &str) = (
    "run_up",
    "highest water connected to the body, above still water over the depth, R/d",
);

/// Label of the axis of a beach's profiles.
const SEAWARD: &str = "distance from the shoreline of still water towards the sea / d";

impl Measure {
    /// All measures with the names used in studies.
    pub(super) const NAMED: [(&'static str, Self); 14] = [
        ("regular_waves", Self::RegularWaves),
        ("waves_by_theory", Self::WavesByTheory),
        ("solitary_wave", Self::SolitaryWave),
        ("solitary_beach", Self::SolitaryBeach),
        ("dam_break", Self::DamBreak),
        ("dry_bed", Self::DryBed),
        ("block_impact", Self::BlockImpact),
        ("jet_impact", Self::JetImpact),
        ("standing_wave", Self::StandingWave),
        ("hydrostatic", Self::Hydrostatic),
        ("taylor_green", Self::TaylorGreen),
        ("slide", Self::Slide),
        ("body", Self::Body),
        ("ship_waves", Self::ShipWaves),
    ];

    /// Returns the names of the inputs that it needs.
    pub(super) fn needs(self) -> &'static [&'static str] {
        match self {
            Self::RegularWaves => &["stroke", "period", "after"],
            Self::WavesByTheory => &["after"],
            Self::SolitaryWave => &["depth", "height"],
            Self::SolitaryBeach => &["depth", "height", "length"],
            Self::DamBreak => &["length"],
            Self::DryBed => &["depth", "length"],
            Self::BlockImpact => &[],
            Self::JetImpact => &["length", "speed", "after"],
            Self::StandingWave => &["depth", "length", "height"],
            Self::Hydrostatic => &["depth", "after"],
            Self::TaylorGreen => &["length", "speed"],
            Self::Slide => &["length", "height"],
            Self::Body => &["after"],
            Self::ShipWaves => &["depth", "length", "speed", "after"],
        }
    }

    /// Returns the numbers that it produces, as gates name them, each with its title and unit.
    pub fn numbers(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::RegularWaves => &[
                ("height_ratio", "wave height over stroke, H/S"),
                ("wave_length", "wave length, m"),
                (
                    "reflection",
                    "part of the wave's height that runs back past the gauges",
                ),
                (
                    "speed_ratio",
                    "largest speed up to the last gauge over the paddle's",
                ),
                (
                    "speed_anywhere",
                    "largest speed in the flume over the paddle's; waves double where \
                     the far wall turns them",
                ),
            ],
            Self::WavesByTheory => &[
                (
                    "variance_ratio",
                    "root of the elevation's variance over theory's of the same \
                     waves in the same time",
                ),
                (
                    "elevation_error",
                    "elevation, root mean square of what it is off theory's over that \
                     of theory's, worst gauge",
                ),
                ("crest", "highest crest at the last gauge over theory's"),
                ("crest_time", "how far off in time it is, s"),
                (
                    "second_harmonic",
                    "of regular waves: amplitude at twice the frequency over \
                     theory's, mean of the gauges",
                ),
                (
                    "second_harmonic_spread",
                    "its largest less its least over theory's: what free waves \
                     of that frequency make",
                ),
            ],
            Self::SolitaryWave => &[
                ("height", "height of the crest over the depth, H/d"),
                ("celerity", "celerity, m/s"),
                ("crests", "part of the gauges that saw a whole crest"),
                RUN_UP,
            ],
            Self::SolitaryBeach => &[
                RUN_UP,
                (
                    "profile_error_15",
                    "profile at t = 15 √(d/g), root mean square of what it is off the points, over \
                     the highest of them",
                ),
                ("profile_error_20", "the same at t = 20 √(d/g)"),
                ("profile_error_25", "the same at t = 25 √(d/g)"),
                ("profile_error_30", "the same at t = 30 √(d/g)"),
            ],
            Self::DamBreak => &[
                ("front_error", "front against the points, mean"),
                (
                    "front_error_shifted",
                    "front against the points with one shift of T fitted, mean",
                ),
                ("front_shift", "that shift, of T"),
                ("front_time", "T at which the front has come to 3 a"),
                (
                    "column_error",
                    "column at the wall against the points, mean",
                ),
            ],
            Self::DryBed => &[
                (
                    "depth_at_dam",
                    "depth at the dam over h0, mean of T from 4 to 8",
                ),
                (
                    "flow_at_dam",
                    "flow at the dam over h0 √(g h0), mean of T from 4 to 8",
                ),
                (
                    "profile_error",
                    "profile, mean |h − Ritter's| over h0 from the still water to h = 0.1 \
                     h0, mean of T from 4 to 8",
                ),
                (
                    "profile_worst",
                    "the largest of it, beside the kink where the still water begins",
                ),
                (
                    "profile_worst_falls",
                    "that of T from 7 to 8 over that of T from 4 to 5",
                ),
            ],
            Self::BlockImpact => &[
                ("arrival", "water reaches H2, s"),
                ("height_2", "H2, largest mean of 50 ms, m"),
                ("height_4_1s", "H4 at 1 s, m"),
                ("height_4_2s", "H4 at 2 s, m"),
                ("height_4_4s", "H4 at 4 s, m"),
                ("peak_1", "P1, largest mean of 10 ms, Pa"),
                ("peak_2", "P2, largest mean of 10 ms, Pa"),
                ("peak_3", "P3, largest mean of 10 ms, Pa"),
                ("peak_4", "P4, largest mean of 10 ms, Pa"),
                ("onset", "the block feels the water, s"),
                (
                    "apart_1",
                    "P1 on the face and half a cell off it, apart by a part of it",
                ),
                (
                    "apart_2",
                    "P2 on the face and half a cell off it, apart by a part of it",
                ),
                (
                    "apart_3",
                    "P3 on the face and half a cell off it, apart by a part of it",
                ),
                (
                    "volume_error",
                    "volume, most that it is off that of the start",
                ),
            ],
            Self::JetImpact => &[("force_ratio", "force on the wall over ρ A v², mean of time")],
            Self::StandingWave => &[
                ("period", "period, s"),
                (
                    "amplitude_left",
                    "part of the amplitude that is left after three periods",
                ),
            ],
            Self::Hydrostatic => &[
                (
                    "pressure",
                    "p / (ρ g depth), mean of time and probes but the lowest",
                ),
                (
                    "pressure_at_floor",
                    "p / (ρ g depth) at the lowest probe, mean of time",
                ),
                ("speed", "largest speed, m/s"),
            ],
            Self::TaylorGreen => &[(
                "dissipation_ratio",
                "decay of the energy over that of PIC, by a viscosity of α Δx² / (6 Δt)",
            )],
            Self::Slide => &[(
                "slide_ratio",
                "mean speed along the slope over g t sin θ, at the end",
            )],
            Self::Body => &[
                (
                    "draft",
                    "its lowest point below the water at the probes, mean of time, m",
                ),
                ("heave_period", "period of its centre's height, s"),
                (
                    "heave_left",
                    "its first maximum after the start over its height there, from the mean of \
                     time",
                ),
                ("roll_period", "period of its roll about z, s"),
                (
                    "acceleration",
                    "acceleration upward in the first frame, m/s²",
                ),
                (
                    "speed_left",
                    "speed along x after the first frame over that of the start",
                ),
                (
                    "momentum_error",
                    "momentum of water and bodies, most that it is off that of the start, of it",
                ),
            ],
            Self::ShipWaves => &[
                (
                    "length_ratio",
                    "length of the waves in deep water over 2πU²/g",
                ),
                ("half_angle", "half-angle of their wedge, degrees"),
                (
                    "misfit",
                    "elevation that is no stationary wave, root mean square over that of all",
                ),
            ],
        }
    }

    /// Returns the curves that it produces, as reference points name them, each with its title and
    /// the labels of its axes.
    pub fn curves(self) -> &'static [(&'static str, [&'static str; 3])] {
        match self {
            Self::RegularWaves => &[(
                "elevation",
                [
                    "elevation at the first gauge",
                    "time from a crest, periods",
                    "η / S",
                ],
            )],
            Self::WavesByTheory => &[(
                "elevation",
                ["elevation at the last gauge", "time, s", "η, m"],
            )],
            Self::SolitaryWave => &[(
                "elevation",
                [
                    "elevation at the last gauge",
                    "time from the crest, √(d/g)",
                    "η / d",
                ],
            )],
            Self::SolitaryBeach => &[
                ("profile_15", ["profile at t = 15 √(d/g)", SEAWARD, "η / d"]),
                ("profile_20", ["profile at t = 20 √(d/g)", SEAWARD, "η / d"]),
                ("profile_25", ["profile at t = 25 √(d/g)", SEAWARD, "η / d"]),
                ("profile_30", ["profile at t = 30 √(d/g)", SEAWARD, "η / d"]),
            ],
            Self::DamBreak => &[
                ("front", ["front", "T = t √(2g/a)", "Z = x / a"]),
                (
                    "column",
                    ["column at the wall", "τ = t √(g/a)", "H = h / 2a"],
                ),
            ],
            Self::DryBed => &[("profile", ["profile at T = 6", "x / (t √(g h0))", "h / h0"])],
            Self::BlockImpact => &[
                ("height_2", ["H2", "time, s", "height, m"]),
                ("height_4", ["H4", "time, s", "height, m"]),
                ("pressure_1", ["P1", "time, s", "Pa"]),
            ],
            Self::JetImpact => &[("force", ["force", "time, s", "F / (ρ A v²)"])],
            Self::StandingWave => &[(
                "amplitude",
                ["amplitude of the first mode", "time, s", "of the start's"],
            )],
            Self::Hydrostatic => &[("pressure", ["pressure", "depth, m", "p / (ρ g depth)"])],
            Self::TaylorGreen => &[("energy", ["energy", "time, turns", "of the start's"])],
            Self::Slide => &[(
                "speed",
                ["mean speed along the slope", "time, s", "of g t sin θ"],
            )],
            Self::Body => &[
                (
                    "heave",
                    ["height of the centre", "time, s", "m, from the mean"],
                ),
                ("roll", ["roll about z", "time, s", "rad, from the mean"]),
            ],
            Self::ShipWaves => &[(
                "elevation",
                [
                    "elevation half a wave length beside the body's path",
                    "distance behind the body, wave lengths",
                    "η, m",
                ],
            )],
        }
    }
}
