//! Every number of a scene has a range, and its error message states it.

use super::*;
use swell::files::parse_scene;

/// Every fractional number of a scene: key, override with `{}` in place of the number, and whether
/// the range is the only constraint on it.
const NUMBERS: &[(&str, &str, bool)] = &[
    ("shot.frames_per_second", "{}", true),
    ("domain.min", "[{}, 0, 0]", false),
    ("domain.max", "[25, {}, 15]", false),
    ("water.rest_density", "{}", true),
    ("water.gravity", "[0, {}, 0]", true),
    ("water.particles[0].velocity", "[{}, 0, 0]", true),
    ("solid[0].translate", "[{}, 0, 7]", false),
    ("solid[0].rotate_degrees", "[0, {}, 0]", true),
    ("solid[0].scale", "{}", false),
    ("solid[1].direction", "[1, {}, 0]", true),
    ("solid[1].motion.velocity", "{}", false),
    ("solid[1].pivot", "[{}, 3, 3]", false),
    ("solid[1].axis", "[0, {}, 1]", true),
    ("solid[1].turn.swing_degrees", "{}", false),
    ("wave_maker[0].motion.stroke", "{}", false),
    ("wave_maker[0].motion.period", "{}", false),
    ("wave_maker[0].motion.ramp", "{}", true),
    ("wave_maker[1].motion.velocity", "{}", false),
    ("wave_maker[1].motion.until", "{}", false),
    ("wave_maker[2].motion.height", "{}", false),
    ("wave_maker[2].motion.depth", "{}", false),
    ("solver.pbf.particle_spacing", "{}", false),
    ("solver.pbf.support_ratio", "{}", true),
    ("solver.pbf.spectral_radius", "{}", true),
    ("solver.pbf.density_error", "{}", true),
    ("solver.pbf.cfl", "{}", true),
    ("solver.pbf.relaxation", "{}", true),
    ("solver.pbf.artificial_pressure", "{}", true),
    ("solver.flip.cell_size", "{}", false),
    ("solver.flip.pic_blend", "{}", true),
    ("solver.flip.cfl", "{}", true),
    ("solver.flip.pressure.tolerance", "{}", true),
    ("budget.speed", "{}", true),
    ("budget.speed_jump", "{}", true),
    ("budget.density_error_mean", "{}", true),
    ("budget.density_error_p99", "{}", true),
    ("budget.density_error_max", "{}", true),
    ("budget.capped", "{}", true),
    ("budget.residual", "{}", false),
    ("budget.divergence", "{}", true),
    ("budget.volume", "{}", true),
    ("budget.energy", "{}", true),
    ("budget.particles", "{}", true),
    ("effects.viscosity.xsph", "{}", true),
    ("effects.vorticity_confinement.strength", "{}", true),
    ("wave_maker[3].motion.significant_height", "{}", false),
    ("wave_maker[3].motion.peak_period", "{}", false),
    ("wave_maker[3].motion.peak_enhancement", "{}", true),
    ("wave_maker[3].motion.shortest_period", "{}", false),
    ("wave_maker[3].motion.depth", "{}", false),
    ("wave_maker[4].motion.height", "{}", false),
    ("wave_maker[4].motion.period", "{}", false),
    ("wave_maker[4].motion.depth", "{}", false),
    ("wave_maker[4].motion.ramp", "{}", false),
    ("effects.drag.drop_radius", "{}", true),
    ("effects.drag.wind", "[{}, 0, 0]", true),
    ("effects.surface_tension.coefficient", "{}", true),
    ("effects.absorbing_zone.length", "{}", false),
    ("effects.absorbing_zone.period", "{}", true),
    ("emitter[0].velocity", "[{}, 0, 0]", false),
    ("emitter[0].from", "{}", false),
    ("emitter[0].until", "{}", false),
    ("drain[0].rate", "{}", true),
    ("drain[0].from", "{}", false),
    ("drain[0].until", "{}", false),
    ("force[0].acceleration", "[{}, 0, 0]", true),
    ("force[0].min", "[{}, 2, 1]", false),
    ("force[0].max", "[{}, 3, 2]", false),
    ("force[0].fade", "{}", true),
    ("force[0].from", "{}", false),
    ("force[0].until", "{}", false),
    ("force[1].at", "[{}, 0, 0]", true),
    ("force[1].axis", "[{}, 1, 0]", true),
    ("force[1].strength", "{}", true),
    ("force[1].core", "{}", true),
];

/// The numbers of a wave generation zone with an irregular sea, and of one with regular waves.
const OF_SEA: &[(&str, &str, bool)] = &[
    ("effects.generation_zone.length", "{}", false),
    (
        "effects.generation_zone.waves.significant_height",
        "{}",
        false,
    ),
    ("effects.generation_zone.waves.peak_period", "{}", false),
    ("effects.generation_zone.waves.peak_enhancement", "{}", true),
    ("effects.generation_zone.waves.shortest_period", "{}", false),
    ("effects.generation_zone.waves.spreading", "{}", true),
    (
        "effects.generation_zone.waves.direction_degrees",
        "{}",
        false,
    ),
    ("effects.generation_zone.waves.depth", "{}", false),
    ("effects.generation_zone.waves.ramp", "{}", true),
];
const OF_STOKES: &[(&str, &str, bool)] = &[
    ("effects.generation_zone.waves.height", "{}", false),
    ("effects.generation_zone.waves.period", "{}", false),
];

const OF_PACKET: &[(&str, &str, bool)] = &[
    ("effects.generation_zone.waves.height", "{}", false),
    ("effects.generation_zone.waves.at", "[{}, 1.0]", false),
    ("effects.generation_zone.waves.time", "{}", false),
];

/// The numbers of an implicit viscosity.
const OF_VISCOSITY: &[(&str, &str, bool)] = &[
    ("effects.viscosity.coefficient", "{}", true),
    ("effects.viscosity.tolerance", "{}", true),
];

/// The numbers of emitters and drains that keep a level, which need gravity.
const OF_LEVELS: &[(&str, &str, bool)] = &[
    ("emitter[0].level", "{}", false),
    ("drain[0].level", "{}", false),
];

/// The numbers of an absorbing wall.
const OF_ABSORPTION: &[(&str, &str, bool)] = &[
    ("wave_maker[1].absorption.depth", "{}", false),
    ("wave_maker[1].absorption.period", "{}", false),
    ("wave_maker[1].absorption.room", "{}", false),
];

/// The good scene with every table that [`NUMBERS`] changes.
fn numbered() -> String {
    let makers = "[[wave_maker]]\nwall = \"+x\"\nmotion = { kind = \"constant_velocity\", \
        velocity = 0.1, until = 1.0 }\n\
        [[wave_maker]]\nwall = \"+z\"\nmotion = { kind = \"solitary\", height = 0.1, \
        depth = 1.0 }\n\
        [[wave_maker]]\nwall = \"+y\"\nmotion = { kind = \"sea\", significant_height = 0.1, \
        peak_period = 3.0, shortest_period = 2.0, depth = 1.0 }\n\
        [[wave_maker]]\nwall = \"-z\"\nmotion = { kind = \"stokes\", height = 0.0005, \
        period = 2.0, depth = 1.0 }\n";
    let more = "[[water.particles]]\nat = [[20.0, 3.0, 3.0]]\nvelocity = [1.0, 0.0, 0.0]\n\
        [[solid]]\nmesh = \"cube.obj\"\n\
        translate = [15.0, 3.0, 3.0]\ndirection = [1.0, 0.0, 0.0]\n\
        motion = { kind = \"constant_velocity\", velocity = 0.1, until = 1.0 }\n\
        pivot = [15.0, 3.0, 3.0]\naxis = [0.0, 1.0, 0.0]\nturn = { kind = \"sine\", \
        swing_degrees = 9.0, period = 2.0 }\n\
        [[emitter]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 3.0, 2.0]\nvelocity = [0.001, 0.0, 0.0]\n\
        from = 1.0\nuntil = 2.0\n\
        [[drain]]\nmin = [1.0, 2.0, 1.0]\nmax = [2.0, 3.0, 2.0]\nrate = 1.0\nfrom = 1.0\n\
        until = 2.0\n\
        [[force]]\nkind = \"acceleration\"\nacceleration = [1.0, 0, 0]\nmin = [1.0, 2.0, 1.0]\n\
        max = [2.0, 3.0, 2.0]\nfade = 0.1\nfrom = 1.0\nuntil = 2.0\n\
        [[force]]\nkind = \"vortex\"\nat = [1.0, 0, 0]\nstrength = 1.0\ncore = 1.0\n";
    let zone = "drag = { drop_radius = 0.001, wind = [1.0, 0, 0] }\n\
        surface_tension = { coefficient = 0.07 }\nabsorbing_zone = { walls = [\"-y\"], \
        length = 1.0, period = 1.0 }\n";
    SCENE
        .replace("[effects]\n", &format!("[effects]\n{zone}"))
        .replace("[solver]\n", &format!("{makers}{more}[solver]\n"))
        .replace(
            "particle_spacing = 0.1\niterations = 4\n",
            "particle_spacing = 0.1\niteration = \"chebyshev\"\ndensity_error = 0.01\n\
             max_iterations = 9\n",
        )
}

/// Parses the range "from A to B" of an error message. Its ends are valid, values just
/// beyond them are not.
fn range_of(message: &str) -> Option<[f64; 2]> {
    let mut words = message.rsplit_once(" from ")?.1.split_whitespace();
    let least = words.next()?.parse().ok()?;
    let most = words.nth(1)?.trim_end_matches([',', ';', ':']);
    Some([least, most.parse().ok()?])
}

/// Values that are not finite, or that would overflow or underflow in the first product, are
/// refused with key, value and range, and the stated range is the effective one.
#[test]
fn every_number_has_a_range_and_says_it() {
    each_number_of_a_scene_has_a_range(&numbered(), NUMBERS);
    let room = "min = [1.0, 2.0, 1.0]\nmax = [2.0, 3.0, 2.0]\nlevel = 2.5\n";
    let levels = format!("[[emitter]]\n{room}[[drain]]\n{room}[solver]\n");
    each_number_of_a_scene_has_a_range(&SCENE.replace("[solver]\n", &levels), OF_LEVELS);
    let viscous = SCENE.replace("xsph = 0.01", "coefficient = 1.0, tolerance = 0.1");
    each_number_of_a_scene_has_a_range(&viscous, OF_VISCOSITY);
    let wall = "[[wave_maker]]\nwall = \"+x\"\nmotion = { kind = \"still\" }\n\
        absorption = { depth = 3.0, period = 3.0, room = 0.01 }\n[solver]\n";
    each_number_of_a_scene_has_a_range(&SCENE.replace("[solver]\n", wall), OF_ABSORPTION);
    let zone = |waves: &str| {
        let zone = format!(
            "[effects]\ngeneration_zone = {{ walls = [\"-z\"], length = 3.0, waves = {{ {waves}, \
             direction_degrees = 90.0 }} }}\n"
        );
        SCENE.replace("[effects]\n", &zone)
    };
    let sea = zone("kind = \"sea\", significant_height = 0.1, peak_period = 3.0, depth = 1.0");
    each_number_of_a_scene_has_a_range(&sea, OF_SEA);
    let stokes = zone("kind = \"stokes\", height = 0.1, period = 3.0, depth = 1.0");
    each_number_of_a_scene_has_a_range(&stokes, OF_STOKES);
    let packet = zone(
        "kind = \"focused\", height = 0.1, at = [2.0, 8.0], time = 40.0, peak_period = 3.0, \
         depth = 1.0",
    );
    each_number_of_a_scene_has_a_range(&packet, OF_PACKET);
}

fn each_number_of_a_scene_has_a_range(text: &str, numbers: &[(&str, &str, bool)]) {
    let dir = assets();
    let load = |set: &str| {
        let set = [set.to_owned(), Method::Flip.as_override()];
        parse_scene(text, Path::new("s.toml"), dir.path(), &set).map(|_| ())
    };
    load("shot.frames=240").expect("the scene is good");
    each_number_has_a_range(load, numbers);
}

/// `load` parses a valid text with one key overridden.
pub(super) fn each_number_has_a_range(
    load: impl Fn(&str) -> Result<(), SceneError>,
    numbers: &[(&str, &str, bool)],
) {
    for (key, value, is_free) in numbers {
        let set = |number: &str| format!("{key}={}", value.replace("{}", number));
        let refused = |number: &str| {
            let set = set(number);
            let said = load(&set).expect_err(&set).to_string();
            let words = said.rsplit_once(&format!(": {key}: "));
            let (_, words) = words.unwrap_or_else(|| panic!("{set}: {said}"));
            assert!(words.contains("; allowed: "), "{set}: {said}");
            assert!(words.len() < 300, "{set}: {said}");
            words.to_owned()
        };
        let said = refused("1e308");
        assert!(said.contains("1e308"), "{said}");
        let Some([least, most]) = range_of(&said) else {
            panic!("{key} says no range: {said}");
        };
        for number in ["-1e308", "inf", "-inf", "nan"] {
            refused(number);
        }
        if least > 0.0 {
            assert!(refused("1e-300").contains("1e-300"), "{key}");
        }
        refused(&format!("{:?}", most * (1.0 + 1e-9)));
        refused(&match least {
            0.0 => "-1e-9".to_owned(),
            least => format!("{:?}", least - 1e-9 * least.abs()),
        });
        if *is_free {
            for end in [least, most] {
                let set = set(&format!("{end:?}"));
                load(&set).unwrap_or_else(|error| panic!("{set}: {error}"));
            }
        }
    }
}

/// The ramp accepts 0 in addition to its range, as the depth at which a force fades in does.
#[test]
fn wave_maker_accepts_a_ramp_of_zero() {
    let dir = assets();
    let set = ["wave_maker[0].motion.ramp=0".to_owned()];
    parse_scene(SCENE, Path::new("s.toml"), dir.path(), &set).expect("0 is none");
}
