use std::path::Path;

use swell_domain::absorber::AbsorberStates;
use swell_scene::Scene;

use crate::parse_scene;

/// Warnings of a channel with a box in it, 16 m long, with these settings, or why it is refused.
fn load(periodic: &str, current: &str, more: &str) -> Result<Vec<String>, String> {
    let lints = scene(periodic, current, more)?.lints().into_iter();
    Ok(lints.filter(|lint| lint.contains("current")).collect())
}

fn scene(periodic: &str, current: &str, more: &str) -> Result<Scene, String> {
    let text = format!(
        "[shot]\nname = \"a\"\nframes = 9\nframes_per_second = 30\n[domain]\nmin = [0, 0, 0]\n\
         max = [16, 4, 1.6]\nperiodic = {periodic}\n[water]\ncurrent = {current}\n\
         [[solid]]\nmesh = \"box.obj\"\ntranslate = [7.0, 0.8, 0.8]\n[solver]\nmethod = \"flip\"\n\
         [solver.flip]\ncell_size = 0.1\n{more}"
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/hard_cases");
    parse_scene(&text, "s.toml".as_ref(), &folder, &[]).map_err(|error| error.to_string())
}

const BLOCK: &str = "[[water.block]]\nmin = [0, 0, 0]\nmax = [16, 1, 1.6]\n";

fn zone(walls: &str, length: f64) -> String {
    format!(
        "{BLOCK}[effects]\nabsorbing_zone = {{ walls = [\"{walls}\"], length = {length}, \
         period = 1.3 }}\n"
    )
}

/// A current runs along periodic axes, and an absorbing zone ends what a solid does to it.
#[test]
fn a_current_runs_through_the_ends_of_the_domain() {
    assert_eq!(
        load("[\"x\"]", "[2.0, 0.0, 0.0]", &zone("-x", 4.0)),
        Ok(Vec::new())
    );
    let found = load("[\"x\", \"z\"]", "[2.0, 0.0, 0.5]", &zone("-x", 4.0)).expect("loads");
    let [only] = &found[..] else {
        panic!("{found:?}")
    };
    let expected = "water.current: the wakes of solids re-enter the domain along z";
    assert!(only.starts_with(expected), "{only}");
    // Without a current a periodic axis has no ends.
    assert_eq!(load("[\"x\"]", "[0.0, 0.0, 0.0]", BLOCK), Ok(Vec::new()));
}

/// A zone may accelerate water to the current; without one nothing does.
#[test]
fn a_current_bounds_speeds_where_a_zone_leads_to_it() {
    let speed = |more: &str| {
        let scene = scene("[\"x\"]", "[2.0, 0.0, 0.0]", more).expect("loads");
        scene.peak_boundary_speed(&AbsorberStates::default(), &[], 0.0, 0.1)
    };
    assert_eq!([speed(&zone("-x", 4.0)), speed(BLOCK)], [2.0, 0.0]);
}

#[test]
fn a_current_that_does_not_fit_is_refused() {
    let wave = "wave = [{ kind = \"stokes\", height = 0.1, period = 1.431629, depth = 5.0, \
                simulated_depth = 1.2 }]";
    let cases = [
        (
            load("[\"z\"]", "[2.0, 0.0, 0.0]", BLOCK),
            "water.current: walls bound the domain along x: domain.periodic has to name x",
        ),
        (
            load("[\"x\"]", "[2.0, 0.1, 0.0]", BLOCK),
            "water.current: it has to be level, and along y it is not 0",
        ),
        (
            load("[\"x\", \"z\"]", "[2.0, 0.0, 0.0]", &zone("-z", 0.8)),
            "effects.absorbing_zone.walls: there is no wall -z: domain.periodic joins both ends, \
             and no current runs through them",
        ),
        // exp(−5π/1.3 · 0.4 / (3 · 2)) of it is left.
        (
            load("[\"x\"]", "[2.0, 0.0, 0.0]", &zone("+x", 0.4)),
            "effects.absorbing_zone.length: a current of 2 m/s carries 45 % of a disturbance \
             through a zone of 0.4 m, and at most 5 % may pass",
        ),
        (
            load("[\"x\"]", &format!("[2.0, 0.0, 0.0]\n{wave}"), ""),
            "water.current: water.wave[0].simulated_depth does not support a current",
        ),
    ];
    for (said, expected) in cases {
        let said = said.expect_err(expected);
        assert!(said.contains(expected), "{said}\nnot: {expected}");
    }
}
