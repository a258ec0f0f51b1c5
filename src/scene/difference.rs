//! Whether two scenes have the same physics.

use std::{collections::BTreeMap, iter};

use toml::{Table, Value};

use super::{Method, Scene, error::SceneError};

/// Keys that change which frames there are or where they go, not what happens in them; `max_substeps`,
/// as `[budget]`, only says when to give up.
const NOT_PHYSICS: [&str; 4] = [
    "shot.name",
    "shot.frames",
    "solver.pbf.max_substeps",
    "solver.flip.max_substeps",
];

/// Comes before every other difference: with it most of the others follow.
const METHOD: &str = "solver.method";

/// Changes whenever the canonical form does, so that hashes of two versions never meet.
const CANONICAL_FORM: &str = "swell scene physics 2";

/// The first key (the method, then in alphabetical order) whose value differs between two scenes as
/// [`Scene::to_toml`] wrote them, with both values; `None` where the physics is the same.
///
/// `[grids]`, `[[probe]]`, `[budget]`, `shot.name`, `shot.frames` and a solver's `max_substeps` may differ, and so may the
/// settings of a solver that is not chosen and the path of a mesh whose hash stands beside it in both.
///
/// # Errors
/// [`SceneError::NotToml`].
pub fn physics_difference(old_toml: &str, new_toml: &str) -> Result<Option<String>, SceneError> {
    let (mut old, mut new) = (flatten(old_toml)?, flatten(new_toml)?);
    let paths: Vec<_> = old.keys().filter_map(|key| hashed_path(key)).collect();
    for (path, hash) in paths {
        if old.contains_key(&hash) && new.contains_key(&hash) {
            old.remove(&path);
            new.remove(&path);
        }
    }
    let keys: std::collections::BTreeSet<_> = old.keys().chain(new.keys()).collect();
    let show = |value: Option<&String>| value.map_or("absent".to_owned(), Clone::clone);
    let method = METHOD.to_owned();
    let mut keys = iter::once(&method).chain(keys);
    let difference = keys.find(|key| old.get(*key) != new.get(*key));
    Ok(difference.map(|key| {
        format!(
            "{key} was {}, is now {}",
            show(old.get(key)),
            show(new.get(key))
        )
    }))
}

/// BLAKE3 in hex over the physics of a scene, the hashes of its mesh files included; the same for
/// two scenes between which [`physics_difference`] finds none.
pub fn physics_hash(scene: &Scene) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(CANONICAL_FORM.as_bytes());
    let written = scene.to_toml(&|_, hash| hash.to_owned());
    // What we wrote is TOML (a test loads it back); hashing its text keeps this infallible.
    match flatten(&written) {
        Ok(values) => {
            for (key, value) in values {
                hasher.update(format!("\n{key} = {value}").as_bytes());
            }
        }
        Err(_) => {
            debug_assert!(false, "to_toml wrote no TOML");
            hasher.update(written.as_bytes());
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// For the key of a mesh's path the key of its hash.
fn hashed_path(hash_key: &str) -> Option<(String, String)> {
    let table = hash_key.strip_suffix(".blake3")?;
    let name = if table.starts_with("water.") {
        "file"
    } else {
        "mesh"
    };
    Some((format!("{table}.{name}"), hash_key.to_owned()))
}

/// Dotted keys and values of the physics, numbers written alike whether whole or not.
fn flatten(text: &str) -> Result<BTreeMap<String, String>, SceneError> {
    let table: Table = toml::from_str(text).map_err(|e| SceneError::NotToml {
        reason: e.message().to_owned(),
    })?;
    let mut values = BTreeMap::new();
    for (key, value) in &table {
        flatten_value(key.clone(), value, &mut values);
    }
    let solver = table.get("solver").and_then(Value::as_table);
    let method = solver.and_then(|solver| solver.get("method")?.as_str());
    let is_idle = |key: &str| {
        let mut others = Method::NAMED
            .iter()
            .filter(|(name, _)| method != Some(name));
        others.any(|(name, _)| key.starts_with(&format!("solver.{name}.")))
    };
    // Grids follow from the particles; probes and budgets only look at them.
    let is_output = |key: &str| {
        NOT_PHYSICS.contains(&key)
            || ["grids.", "probe[", "budget."]
                .iter()
                .any(|table| key.starts_with(table))
    };
    values.retain(|key, _| !is_output(key) && !is_idle(key));
    Ok(values)
}

fn flatten_value(path: String, value: &Value, values: &mut BTreeMap<String, String>) {
    match value {
        Value::Table(table) => {
            for (key, value) in table {
                flatten_value(format!("{path}.{key}"), value, values);
            }
        }
        Value::Array(array) => {
            for (i, value) in array.iter().enumerate() {
                flatten_value(format!("{path}[{i}]"), value, values);
            }
        }
        Value::Integer(whole) => {
            values.insert(path, format!("{:?}", *whole as f64));
        }
        Value::Float(number) => {
            values.insert(path, format!("{number:?}"));
        }
        other => {
            values.insert(path, other.to_string());
        }
    }
}
