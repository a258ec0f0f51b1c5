use super::*;

/// Request for a shipped scene.
fn request(scene: &str, limits: &[&str]) -> TuneRequest {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    TuneRequest {
        scene: folder.join(scene),
        solver: None,
        limits: limits
            .iter()
            .map(|text| text.parse().expect("a limit"))
            .collect(),
        per_frame: None,
        seconds: None,
        frames: None,
        reference: 0.8,
        repeats: 1,
        target: folder.join("tuned.toml"),
        reach: Reach::Folder,
    }
}

#[test]
fn twins_differ_from_the_scene_in_what_they_are_called_for() {
    let tune = Tune::load(request("dam-break.toml", &["crest=2%"])).expect("a shot");
    let spacings: Vec<f64> = tune.ladder.iter().map(Variant::spacing).collect();
    // 0.064 does not divide 2 m.
    assert_eq!(spacings[..2], [0.1, 0.08]);
    assert!(
        (0.06..0.07).contains(&spacings[2]) && spacings[3] == 0.05,
        "{spacings:?}"
    );
    assert_eq!(
        physics_hash(&tune.ladder[3].scene),
        physics_hash(&tune.scene),
        "the last is the scene itself"
    );
    let pbf = tune.reference.scene.solver.pbf().expect("PBF");
    assert_eq!((pbf.particle_spacing, pbf.cfl), (0.04, 0.5));
    assert_eq!(
        (pbf.stop, pbf.max_substeps),
        (Stop::Iterations(8), 64),
        "as many substeps as half the step asks for"
    );
    assert_eq!(tune.fine.spacing(), 0.1);
    assert_ne!(
        physics_hash(&tune.noise_floor.scene),
        physics_hash(&tune.ladder[0].scene)
    );
    let keys: Vec<_> = tune.knobs.iter().map(|knob| knob.key).collect();
    assert_eq!(
        keys,
        [
            "solver.pbf.cfl",
            "solver.pbf.iterations",
            "solver.pbf.iteration"
        ]
    );
    let names: Vec<_> = tune.variants().map(|(_, variant)| variant.name()).collect();
    assert!(
        names.contains(
            &"solver.pbf.particle_spacing = 0.1, solver.pbf.iteration = \"chebyshev\"".into()
        ),
        "{names:?}"
    );
    assert_eq!(names.len(), 4 + 2 + 6 + 1);
}

/// Sides of 1.6, 3.2 and 2 m hold 25, 50 and 31.25 spacings of 0.064. The last, from wall to wall,
/// has 31 layers, and the others' are narrower by √(31 / 31.25).
#[test]
fn spacings_fit_the_water() {
    let tune = Tune::load(request("dam-break.toml", &["crest=2%"])).expect("a shot");
    assert!(misfit(&tune.scene, 0.05) < 1e-12);
    let off = misfit(&tune.scene, 0.064);
    assert!(
        (off - (1.0 - (31.0_f64 / 31.25).sqrt())).abs() < 1e-12,
        "{off}"
    );
    let near = fitting(&tune.scene, 0.064);
    assert!(misfit(&tune.scene, near) < off && (near / 0.064 - 1.0).abs() <= NEAR);
    let all = tune.spacings([0.05, 0.1]);
    assert!(all.len() > 20 && all.contains(&0.05) && all.contains(&0.1));
    // Control: these sides are not whole numbers of every spacing.
    let is_fit = |d: &f64| misfit(&tune.scene, *d) <= FITS.max(misfit(&tune.scene, near));
    assert!(all.iter().all(is_fit) && !is_fit(&0.066) && misfit(&tune.scene, 1.5) > 0.06);
}

#[test]
fn the_other_solver_has_settings_of_its_own() {
    let tune = Tune::load(TuneRequest {
        solver: Some(Method::Flip),
        seconds: Some(60.0),
        per_frame: Some(0.6),
        ..request("dam-break.toml", &["front=0.1m", "energy=3%"])
    });
    let tune = tune.expect("a shot");
    assert_eq!(tune.most_seconds(), Some(0.5), "60 s over 120 frames");
    let flip = tune.reference.scene.solver.flip().expect("FLIP");
    assert_eq!(
        (flip.cell_size, flip.cfl, flip.pressure.tolerance),
        (0.08, 1.5, 1e-6)
    );
    let keys: Vec<_> = tune.knobs.iter().map(|knob| knob.key).collect();
    assert_eq!(
        keys,
        [
            "solver.flip.cfl",
            "solver.flip.pressure.tolerance",
            "solver.flip.pressure.preconditioner"
        ]
    );
    let values = tune.knobs[1].others.iter();
    let values: Vec<_> = values.map(|(set, _)| set[0].value.as_str()).collect();
    assert_eq!(values, ["0.001", "0.0001"]);
}

#[test]
fn what_does_not_fit_the_scene_is_named_by_its_option() {
    let said = |request: TuneRequest| match Tune::load(request) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("taken"),
    };
    let sound = || request("dam-break.toml", &["crest=2%"]);
    for (request, expected) in [
        (
            request("dam-break.toml", &["crest=2%", "crest=0.1m"]),
            "errors: crest is listed twice",
        ),
        (
            request("dam-break.toml", &["pressure=2%"]),
            "errors: pressure: the scene has no [[probe]]",
        ),
        (
            TuneRequest {
                frames: Some(121),
                ..sound()
            },
            "frames: the shot has frames 1 to 120",
        ),
        (
            TuneRequest {
                reference: 0.0,
                ..sound()
            },
            "reference: 0 is not a factor",
        ),
        (
            TuneRequest {
                seconds: Some(-1.0),
                ..sound()
            },
            "seconds: allowed is",
        ),
        (
            TuneRequest {
                repeats: 0,
                ..sound()
            },
            "repeats: allowed is",
        ),
        (
            TuneRequest {
                target: PathBuf::from("/elsewhere/a.toml"),
                ..sound()
            },
            "target: allowed is a file beside the scene",
        ),
        (request("no.toml", &["crest=2%"]), "cannot read"),
    ] {
        let said = said(request);
        assert!(said.starts_with(expected), "{said}");
    }
}
