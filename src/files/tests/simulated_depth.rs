use swell_scene::{Scene, SceneError};

use crate::parse_scene;

const STOKES: &str = "kind = \"stokes\", height = 0.1, period = 1.41851, depth = 5.0";

/// Loads a tank, 16 m long and 2 m high, with these waves at the start and in a zone.
fn load(start: &[String], zone: Option<String>, more: &str) -> Result<Scene, SceneError> {
    let start = start.join(", ");
    let zone = zone.map_or(String::new(), |waves| {
        format!(
            "[effects]\ngeneration_zone = {{ walls = [\"-x\"], length = 4.0, waves = {{ {waves} \
             }} }}\n"
        )
    });
    let text = format!(
        "[shot]\nname = \"a\"\nframes = 9\nframes_per_second = 30\n[domain]\nmin = [-2, 5, 0]\n\
         max = [14, 7, 0.3]\n[water]\nwave = [{start}]\n[solver]\nmethod = \"flip\"\n\
         [solver.flip]\ncell_size = 0.1\n{more}\n{zone}"
    );
    parse_scene(&text, "s.toml".as_ref(), "".as_ref(), &[])
}

fn at_start(waves: &str) -> Vec<String> {
    vec![format!("{{ {waves} }}")]
}

fn refusal(start: &[String], zone: Option<String>) -> String {
    load(start, zone, "").expect_err("refused").to_string()
}

/// The floor is there where a part of the depth is simulated, and nowhere else.
#[test]
fn a_part_of_the_depth_has_a_floor_and_all_of_it_none() {
    let cut = format!("{STOKES}, simulated_depth = 1.2");
    let scene = load(&at_start(&cut), Some(format!("{cut}, ramp = 0.0")), "").expect("loads");
    let floor = scene.wave_floor().expect("a floor");
    let [mean, most] = floor.heights();
    assert!(
        (0.2..0.22).contains(&mean) && (0.006..0.008).contains(&most),
        "{mean} {most}"
    );
    assert_eq!(scene.moving_solids.len(), 1);
    assert_eq!(scene.drawn_movers().count(), 0);
    assert!(scene.mesh_files().is_empty());
    assert!(scene.lints().is_empty(), "{:?}", scene.lints());
    let whole = "kind = \"stokes\", height = 0.1, period = 1.6, depth = 1.0";
    let scene = load(&at_start(whole), Some(whole.to_owned()), "").expect("loads");
    assert!(scene.wave_floor().is_none() && scene.moving_solids.is_empty());
}

#[test]
fn a_floor_that_does_not_fit_its_waves_is_refused_by_key() {
    let cut = format!("{STOKES}, simulated_depth = 1.2");
    let cases = [
        (
            refusal(
                &at_start(
                    "kind = \"stokes\", height = 0.1, period = 1.6, depth = 1.2, \
                     simulated_depth = 1.2",
                ),
                None,
            ),
            "water.wave[0].simulated_depth: 1.2 m of water that is 1.2 m deep",
        ),
        (
            refusal(&at_start(&format!("{STOKES}, simulated_depth = 2.5")), None),
            "water.wave[0].simulated_depth: 2.5 m of water in a domain that is 2 m high",
        ),
        (
            refusal(&[], Some(cut.clone())),
            "effects.generation_zone.waves.simulated_depth: the floor moves with waves that are on \
             the water from the start",
        ),
        (
            refusal(
                &at_start(&cut),
                Some(format!("{STOKES}, simulated_depth = 1.3")),
            ),
            "effects.generation_zone.waves.simulated_depth: 1.3 m of 5 m, and 1.2 m of 5 m at \
             water.wave[0]",
        ),
        (
            refusal(
                &at_start("kind = \"stokes\", height = 0.1, period = 1.6, depth = 1.2"),
                Some(cut.clone()),
            ),
            "effects.generation_zone.waves.simulated_depth: 1.2 m of 5 m, and 1.2 m of 1.2 m",
        ),
        (
            refusal(
                &at_start(&format!("{STOKES}, simulated_depth = 0.35")),
                None,
            ),
            "water.wave[0].simulated_depth: the water there moves up to 0.0",
        ),
        (
            refusal(
                &[
                    at_start(&cut),
                    at_start(&format!("{STOKES}, simulated_depth = 1.3")),
                ]
                .concat(),
                None,
            ),
            "water.wave[1].simulated_depth: 1.3 m are simulated, and 1.2 m of water.wave[0]",
        ),
    ];
    for (said, expected) in cases {
        assert!(said.contains(expected), "{said}\nnot: {expected}");
    }
    let said = load(&at_start(&cut), None, "band = 6")
        .expect_err("refused")
        .to_string();
    assert!(
        said.contains("band: it does not support simulated_depth"),
        "{said}"
    );
}

/// Walls reflect waves, and a body or a probe needs water around it.
#[test]
fn what_the_floor_does_not_fit_is_said() {
    let lints = |zone: Option<String>, more: &str| {
        let cut = format!("{STOKES}, simulated_depth = 1.2");
        load(&at_start(&cut), zone, more)
            .expect("loads")
            .lints()
            .join("; ")
    };
    let cut = format!("{STOKES}, simulated_depth = 1.2, ramp = 0.0");
    let said = lints(None, "");
    assert!(
        said.contains("water.wave[0].simulated_depth: walls reflect the waves"),
        "{said}"
    );
    assert_eq!(lints(Some(cut.clone()), ""), "");
    // The floor of the water lies between 0.2 and 0.22 m above the domain's, at y = 5.
    let probe = |probe: &str| lints(Some(cut.clone()), &format!("[[probe]]\n{probe}"));
    let pressure = |y: f64| probe(&format!("kind = \"pressure\"\nat = [6.0, {y}, 0.15]"));
    assert!(
        pressure(5.15).contains("probe[0]: it measures nothing below 5.2"),
        "{}",
        pressure(5.15)
    );
    assert_eq!(pressure(5.5), "");
    let force = probe("kind = \"force\"\nsolid = \"-y\"");
    assert!(
        force.contains("probe[0]: it measures nothing below 5.2"),
        "{force}"
    );
    // What is emitted below the floor, or where it moves, would never be water.
    let emitter = |y: f64| {
        let text = format!(
            "[[emitter]]\nmin = [6.0, {y}, 0.0]\nmax = [7.0, {}, 0.3]\nvelocity = [1.0, 0.0, 0.0]",
            y + 0.3
        );
        let cut = format!("{STOKES}, simulated_depth = 1.2");
        load(&at_start(&cut), None, &text).map_err(|error| error.to_string())
    };
    let said = emitter(5.05).expect_err("refused");
    assert!(
        said.contains("meets the box around the floor, whose shape changes"),
        "{said}"
    );
    assert!(emitter(5.6).is_ok(), "{:?}", emitter(5.6).err());
    // On 5 m of water waves of 1.41851 s are 3.14 m long, and on 1.2 m 3.1 m.
    let short = lints(Some(cut.replace("period = 1.41851", "period = 2.9")), "");
    assert!(short.contains("on 5 m of water"), "{short}");
}

/// The crests of a packet are not there at the start, so that its floor needs no waves there.
#[test]
fn a_packet_brings_its_floor() {
    let packet = "kind = \"focused\", height = 0.05, at = [8.0, 0.15], time = 20.0, \
                  peak_period = 1.4, shortest_period = 1.0, depth = 5.0, simulated_depth = 1.2";
    let text = load(&[], Some(packet.to_owned()), "");
    let scene = text.expect("loads");
    assert!(
        scene
            .wave_floor()
            .is_some_and(|floor| floor.peak_speed() > 0.0)
    );
}
