use std::path::Path;

use crate::load_scene;

/// The wall of hard case 16, and the same wall with the required thickness.
#[test]
fn a_thin_wall_is_told_with_its_place_and_the_thickness_it_needs() {
    let file =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/hard_cases/16-thin-wall.toml");
    let lints = |set: &[&str]| {
        let set: Vec<String> = set.iter().map(|&it| it.to_owned()).collect();
        load_scene(&file, &set).expect("valid").lints()
    };
    let found = lints(&[]);
    assert_eq!(found.len(), 1, "{found:?}");
    for part in [
        "solid.mesh of box: it is 0.0500 m thick at (0.825, ",
        "must be 0.2000 m thick, and up to 0.3464 m at an angle",
    ] {
        assert!(found[0].contains(part), "{part} of {found:?}");
    }
    assert_eq!(lints(&["solid[0].scale=[0.201,1.6,1.0]"]), [] as [&str; 0]);
    // With a moving wall before it in the file, and everything a kilometre away.
    let moving = "motion={kind=\"constant_velocity\",velocity=0.1,until=0.1},direction=[1,0,0]";
    let wall = "mesh=\"box.obj\",scale=[0.05,1.6,1.0]";
    let far = lints(&[
        "domain.min=[1000,0,0]",
        "domain.max=[1001.6,1.2,0.6]",
        "water.block=[{min=[1000,0,0],max=[1000.4,1.0,0.6]}]",
        &format!(
            "solid=[{{{wall},translate=[1000.825,0.6,0.3],{moving}}},{{{wall},\
             translate=[1001.2,0.6,0.3]}}]"
        ),
    ]);
    let places = [
        "box: it is 0.0500 m thick at (1001.2",
        "box: it is 0.0500 m thick at (1000.8",
    ];
    assert_eq!(far.len(), 2, "{far:?}");
    for (found, place) in far.iter().zip(places) {
        assert!(found.contains(place), "{place} of {far:?}");
    }
}
