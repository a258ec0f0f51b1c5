use std::{collections::BTreeSet, fmt::Debug};

use serde::de::DeserializeOwned;

use swell_scene::open_waves::{Packet, Regular, Sea, Waves};

use crate::{declare::Keyed, parse_scene};

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

/// The names of a struct's fields.
pub(super) fn fields<T: DeserializeOwned + Debug>() -> BTreeSet<String> {
    let unknown = toml::from_str::<T>("none = 1").expect_err("no field has this name");
    let names = unknown.message().split('`').skip(3).step_by(2);
    names.map(str::to_owned).collect()
}

/// The keys of a table whose `kind` is this.
pub(super) fn keys_of<T: Keyed>(kind: &str) -> BTreeSet<String> {
    let of_kind = T::KEYS.iter().filter(|key| {
        let is_of = |(_, among): (_, &[&str])| among.contains(&kind);
        key.name != "kind" && key.only.is_none_or(is_of)
    });
    of_kind.map(|key| key.name.to_owned()).collect()
}

/// Each kind of waves is a struct of its own, whose fields are its keys.
#[test]
fn keys_of_waves_are_the_fields_of_their_kind() {
    let keys = keys_of::<Waves>;
    assert_eq!(keys("stokes"), fields::<Regular>());
    assert_eq!(keys("sea"), fields::<Sea>());
    assert_eq!(keys("focused"), fields::<Packet>());
    // Control: kinds differ.
    assert_ne!(keys("sea"), fields::<Packet>());
}
