use crate::parse_scene;

/// Waves oblique to a period, or spread over directions, have different phases at its two ends.
#[test]
fn waves_fit_into_a_period_or_are_refused() {
    let load = |waves: &str| {
        let text = format!(
            "[shot]\nname = \"a\"\nframes = 9\nframes_per_second = 30\n[domain]\nmin = [0, 0, 0]\n\
             max = [16, 3, 1.6]\n\
             periodic = [\"z\"]\n[solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = 0.1\n\
             [effects]\n\
             generation_zone = {{ walls = [\"-x\"], length = 5.0, waves = {{ {waves}, depth = 1.0 \
             }} }}\n"
        );
        let said = parse_scene(&text, "s.toml".as_ref(), "".as_ref(), &[]);
        said.map(|_| ()).map_err(|error| error.to_string())
    };
    let stokes = "kind = \"stokes\", height = 0.1, period = 2.0";
    assert_eq!(load(stokes), Ok(()));
    let askew = load(&format!("{stokes}, direction_degrees = 30.0")).expect_err("refused");
    assert!(
        askew.contains(
            "waves.direction_degrees: waves that go towards 30 degrees do not \
                            fit the period along z"
        ),
        "{askew}"
    );
    let sea = "kind = \"sea\", significant_height = 0.1, peak_period = 2.0, shortest_period = 1.0";
    assert_eq!(load(sea), Ok(()));
    let spread = load(&format!("{sea}, spreading = 10.0")).expect_err("refused");
    assert!(
        spread.contains("waves.spreading: spread waves do not fit the period along z"),
        "{spread}"
    );
}
