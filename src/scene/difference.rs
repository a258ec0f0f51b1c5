//! Whether two scenes have the same physics.

use std::{collections::BTreeMap, iter};

use toml::{Table, Value};

use super::{
    Method, Scene,
    error::SceneError,
    key::{self, Physics},
    keys,
};

/// Comes before every other difference: with it most of the others follow.
const METHOD: &str = "solver.method";

/// Changes whenever the canonical form does, so that hashes of two versions never meet.
const CANONICAL_FORM: &str = "swell scene physics 2";

/// The first key (the method, then in alphabetical order) whose value differs between two scenes as
/// [`Scene::to_toml`] wrote them, with both values; `None` where the physics is the same.
///
/// Keys that the table of keys calls no physics may differ, and so may the settings of a solver that is not chosen and the
/// path of a mesh whose hash stands beside it in both.
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

/// BLAKE3 in hex over the physics of a scene, the hashes of its mesh files included; the same for
/// two scenes between which [`physics_difference`] finds none.
pub fn physics_hash(scene: &Scene) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(CANONICAL_FORM.as_bytes());
    for (key, value) in flatten(&scene.written(&|_, hash| hash.to_owned())) {
        hasher.update(format!("\n{key} = {value}").as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

/// For the key of a file whose content counts the key itself, and that of its hash.
fn hash_beside(path: &str) -> Option<(String, String)> {
    let is_by_hash = key::find(keys::SCENE, path)?.physics == Physics::ByHash;
    let (table, _) = path.rsplit_once('.')?;
    is_by_hash.then(|| (path.to_owned(), format!("{table}.blake3")))
}

fn read(text: &str) -> Result<Table, SceneError> {
    toml::from_str(text).map_err(|e| SceneError::NotToml {
        reason: e.message().to_owned(),
    })
}

/// Keys that caches may be older than, each with the value by which nothing differs from before there was one.
const YOUNGER: [(&str, &str); 2] = [
    ("solver.pbf.grid_projection", "false"),
    ("wave_maker.motion.second_order", "false"),
];

/// What a key of a scene is in [`YOUNGER`]: there without the places in arrays.
fn as_before(key: &str) -> Option<&'static str> {
    let parts = key
        .split('.')
        .map(|part| part.split('[').next().unwrap_or(part));
    let plain: Vec<&str> = parts.collect();
    let plain = plain.join(".");
    let found = YOUNGER.iter().find(|(younger, _)| *younger == plain);
    found.map(|(_, value)| *value)
}

/// What a scene of a cache has to be given that is older than some keys, as overrides.
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

/// Dotted keys and values of the physics, numbers written alike whether whole or not.
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
