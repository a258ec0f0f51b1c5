//! Which keys of a scene changed, so that a refused resume names them.

use toml::{Table, Value};

/// A key that differs between two scenes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneDifference {
    /// Dotted path, with indices in tables of tables: `water.block[0].max`.
    pub key: String,
    /// As it stands in the cache; `None` where it is not there.
    pub cached: Option<String>,
    /// As given now.
    pub given: Option<String>,
}

/// All keys in which two scenes (TOML text, defaults written out) differ, sorted by path. Which of
/// them are physics is the caller's to know.
///
/// # Errors
/// The TOML parser's words.
pub fn scene_differences(
    cached: &str,
    given: &str,
) -> Result<Vec<SceneDifference>, toml::de::Error> {
    let cached = Value::Table(toml::from_str::<Table>(cached)?);
    let given = Value::Table(toml::from_str::<Table>(given)?);
    let mut found = Vec::new();
    compare("", Some(&cached), Some(&given), &mut found);
    found.sort_by(|a, b| a.key.cmp(&b.key));
    Ok(found)
}

fn compare(
    key: &str,
    cached: Option<&Value>,
    given: Option<&Value>,
    found: &mut Vec<SceneDifference>,
) {
    match (cached, given) {
        (Some(Value::Table(a)), Some(Value::Table(b))) => {
            let added = b.keys().filter(|name| !a.contains_key(*name));
            for name in a.keys().chain(added) {
                let path = if key.is_empty() {
                    name.clone()
                } else {
                    format!("{key}.{name}")
                };
                compare(&path, a.get(name), b.get(name), found);
            }
        }
        (Some(Value::Array(a)), Some(Value::Array(b)))
            if a.iter().chain(b).any(Value::is_table) =>
        {
            for i in 0..a.len().max(b.len()) {
                compare(&format!("{key}[{i}]"), a.get(i), b.get(i), found);
            }
        }
        (a, b) if a == b => {}
        (a, b) => found.push(SceneDifference {
            key: key.to_owned(),
            cached: a.map(Value::to_string),
            given: b.map(Value::to_string),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_each_changed_key_and_no_other() {
        let cached = "[shot]\nname = 'a'\n[solver.pbf]\niterations = 4\nk = 0.1\n[[water.block]]\nmax = [1.0, 2.0]\n";
        assert_eq!(scene_differences(cached, cached), Ok(vec![]));
        let given = "[shot]\nname = 'a'\n[solver.pbf]\niterations = 8\n[[water.block]]\nmax = [1.0, 3.0]\n[[water.block]]\nmax = [1.0]\n";
        let found = scene_differences(cached, given).unwrap();
        let keys: Vec<_> = found.iter().map(|d| d.key.as_str()).collect();
        assert_eq!(
            keys,
            [
                "solver.pbf.iterations",
                "solver.pbf.k",
                "water.block[0].max",
                "water.block[1]"
            ]
        );
        assert_eq!(found[0].cached.as_deref(), Some("4"));
        assert_eq!(found[0].given.as_deref(), Some("8"));
        assert_eq!(found[1].given, None);
    }

    #[test]
    fn broken_toml_is_an_error() {
        assert!(scene_differences("a = ", "").is_err());
    }
}
