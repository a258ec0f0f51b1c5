//! Compares the physics of two scenes.

use std::{collections::BTreeMap, iter};

use toml::{Table, Value};

use super::{
    key::{self, Physics},
    keys,
    write::written,
};
use swell_scene::{Method, Scene, SceneError};

/// Compared first, because most other differences follow from it.
const METHOD: &str = "solver.method";

/// Version of the canonical form; it changes with the form so that hashes of different
/// versions never match.
const CANONICAL_FORM: &str = "swell scene physics 2";

/// Returns the first key whose value differs between two scenes written by
/// [`scene_to_toml`](crate::scene_to_toml), with both values: the method first, then the other keys
/// in alphabetical order. Returns `None` if the physics is the same.
///
/// Ignored are keys that the table of keys declares as not physical, settings of the solver that is
/// not chosen, and paths of meshes whose hashes are given in both.
///
/// # Errors
/// [`SceneError::NotToml`].
pub fn physics_difference(old_toml: &str, new_toml: &str) -> Result<Option<String>, SceneError> {
    let (mut old, mut new) = (flatten(&read(old_toml)?), flatten(&read(new_toml)?));
    let paths: Vec<_> = old.keys().filter_map(|key| hash_beside(key)).collect();
    for (path, hash) in paths {
        if old.contains_key(&hash) && new.contains_key(&hash) {
            old.remove(&path);
            new.remove(&path);
        }
    }
    let keys: std::collections::BTreeSet<_> = old.keys().chain(new.keys()).collect();
    let show = |key: &str, value: Option<&String>| {
        let absent = as_before(key).unwrap_or("absent");
        value.map_or(absent.to_owned(), Clone::clone)
    };
    let method = METHOD.to_owned();
    let mut keys = iter::once(&method).chain(keys);
    let difference = keys.find(|key| old.get(*key) != new.get(*key));
    Ok(difference.map(|key| {
        format!(
            "{key} was {}, is now {}",
            show(key, old.get(key)),
            show(key, new.get(key))
        )
    }))
}

/// Returns the BLAKE3 hash of a scene's physics, hexadecimal, including the hashes of its mesh
/// files. Scenes for which [`physics_difference`] finds no difference have equal hashes.
pub fn physics_hash(scene: &Scene) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(CANONICAL_FORM.as_bytes());
    for (key, value) in flatten(&written(scene, &|_, hash| hash.to_owned())) {
        hasher.update(format!("\n{key} = {value}").as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

/// For the key of a file compared by content, returns the key itself and the key of its hash.
fn hash_beside(path: &str) -> Option<(String, String)> {
    let is_by_hash = key::find(keys::SCENE, path)?.physics == Physics::ByHash;
    let (table, name) = path.rsplit_once('.')?;
    // Of an array of files, each has its hash in the same place.
    let place = name.find('[').map_or("", |at| &name[at..]);
    is_by_hash.then(|| (path.to_owned(), format!("{table}.blake3{place}")))
}

fn read(text: &str) -> Result<Table, SceneError> {
    toml::from_str(text).map_err(|e| SceneError::NotToml {
        reason: e.message().to_owned(),
    })
}

/// Keys that older caches lack, each with the value that reproduces the behaviour
/// before it existed.
const YOUNGER: [(&str, &str); 2] = [
    ("solver.pbf.grid_projection", "false"),
    ("wave_maker.motion.second_order", "false"),
];

/// Returns the value in [`YOUNGER`] for a key of a scene; array indices are ignored.
fn as_before(key: &str) -> Option<&'static str> {
    let parts = key
        .split('.')
        .map(|part| part.split('[').next().unwrap_or(part));
    let plain: Vec<&str> = parts.collect();
    let plain = plain.join(".");
    let found = YOUNGER.iter().find(|(younger, _)| *younger == plain);
    found.map(|(_, value)| *value)
}

/// Returns the overrides that complete a cached scene which lacks newer keys.
pub(super) fn younger(text: &str) -> Result<Vec<String>, SceneError> {
    let root = read(text)?;
    let is_absent = |key: &str| {
        let (tables, name) = key.rsplit_once('.').unwrap_or(("", key));
        let mut tables = tables.split('.');
        let table = tables.try_fold(&root, |table, name| table.get(name)?.as_table());
        table.is_some_and(|table| !table.contains_key(name))
    };
    let absent = YOUNGER.iter().filter(|(key, _)| is_absent(key));
    Ok(absent
        .map(|(key, value)| format!("{key}={value}"))
        .collect())
}

/// Returns the dotted keys and values of the physics. Integers and floats of equal value
/// are written alike.
fn flatten(table: &Table) -> BTreeMap<String, String> {
    let mut values = BTreeMap::new();
    for (key, value) in table {
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
    let is_physics = |path: &str| {
        let along = key::along(keys::SCENE, path);
        along.iter().all(|key| key.physics != Physics::No)
    };
    let is_as_before = |key: &str, value: &str| as_before(key) == Some(value);
    values.retain(|key, value| is_physics(key) && !is_idle(key) && !is_as_before(key, value));
    values
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
