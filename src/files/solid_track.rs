//! Poses of a solid over time: a glTF node's animation, an animated prim of a USD text layer, or
//! poses written in a scene.

use std::path::Path;

use glam::{DMat3, DMat4, DQuat, DVec3};
use gltf::Gltf;

use super::{
    document::Document,
    gltf_nodes::{Beside, Nodes, named},
    keys::TrackSpec,
    usd_nodes::{self, UsdNodes},
    usda::Prim,
};
use swell_domain::{mesh::TriangleMesh, text};
use swell_scene::{
    SceneError, Shot,
    rate::Rate,
    solid_track::{Missed, Track},
    words::shown,
};

/// Relative change of lengths above which a solid counts as deforming.
const RIGID: f64 = 1e-3;

/// Largest number of names listed in an error.
const MOST_NAMES: usize = 12;

/// Times closer than this are the same, seconds.
const APART: f64 = 1e-6;

/// Largest number of poses; enough for hours.
const MOST_POSES: usize = 1_000_000;

type Result<T> = std::result::Result<T, SceneError>;

/// Builds the track at `path` of a solid whose initial placement is `mesh`.
pub(super) fn build(
    doc: &Document<'_>,
    path: &str,
    (base_dir, shot): (&Path, &Shot),
    spec: &TrackSpec,
    mesh: &TriangleMesh,
) -> Result<Track> {
    let at = |key: &str| format!("{path}.{key}");
    let Some(file) = &spec.file else {
        let rows = spec.poses.as_deref().unwrap_or_default();
        let pose = |[t, x, y, z, a, b, c, d]: &[f64; 8]| {
            (*t, DVec3::new(*x, *y, *z), DQuat::from_xyzw(*a, *b, *c, *d))
        };
        let poses = rows.iter().map(pose).collect();
        return Track::new(poses, mesh).map_err(|problem| doc.fault_of(&at("poses"), problem));
    };
    let file_key = at("file");
    let found = doc.find(base_dir, &file_key, file)?;
    let fault = |key: &str, problem: String| {
        doc.fault_of_plain(key, format!("{}: {problem}", found.display()))
    };
    let bytes = std::fs::read(&found).map_err(|error| fault(&file_key, error.to_string()))?;
    let beside = found.parent().unwrap_or(Path::new("."));
    let read = |name: &str| {
        let path = doc.reach().find(beside, Path::new(name))?;
        std::fs::read(&path).map_err(|error| format!("cannot read {}: {error}", path.display()))
    };
    let (called, moves) = Moves::read(&bytes, spec.node.as_deref(), &read).map_err(|problem| {
        let (key, problem) = match problem {
            Problem::Node(problem) if spec.node.is_some() => (at("node"), problem),
            Problem::Node(problem) | Problem::File(problem) => (file_key.clone(), problem),
        };
        fault(&key, problem)
    })?;
    let per_second = shot.frames_per_second;
    let rate = moves.rate().map_or(per_second, |it| it.codes_per_second);
    let begin = spec.start.map_or(0.0, |start| start / rate - shot.time(1));
    let poses = sampled(&moves, begin, shot)
        .map_err(|problem| fault(&file_key, format!("{called}: {problem}")))?;
    let track = Track::new(poses, mesh).map_err(|problem| fault(&file_key, problem))?;
    let moved = moves.times_moved();
    let other_rate = (moves.rate().filter(|_| !moved.is_empty()))
        .and_then(|rate| rate.lint("solid.track.file", per_second));
    let missed = missed(&moved, [begin, begin + shot.duration()], rate);
    Ok(track.with_warnings(missed, other_rate))
}

/// Returns the first and last key and the range of the shot, in frames of the file, if the shot has
/// no key and does not lie between two. Arguments are in seconds of the file.
fn missed(moved: &[f64], shot: [f64; 2], rate: f64) -> Option<Missed> {
    let first = moved.iter().copied().reduce(f64::min)?;
    let last = moved.iter().copied().reduce(f64::max)?;
    let is_beside = first > shot[1] - APART || last < shot[0] + APART;
    let frame = |seconds: f64| (1e3 * seconds * rate).round() / 1e3;
    is_beside.then(|| Missed {
        moves: [first, last].map(frame),
        shot: shot.map(frame),
    })
}

/// Animated object of a file.
enum Moves {
    Gltf(Nodes),
    Usd(UsdNodes),
}

/// Fault in a file.
enum Problem {
    /// The name of a node.
    Node(String),
    File(String),
}

impl Moves {
    /// Reads the node or prim of this name, or the only one. The string is its name for messages.
    fn read(
        bytes: &[u8],
        name: Option<&str>,
        beside: Beside<'_>,
    ) -> std::result::Result<(String, Self), Problem> {
        let bytes = text::without_mark(bytes).map_err(|error| Problem::File(error.to_string()))?;
        if usd_nodes::is_usd(bytes) {
            let layer = usd_nodes::layer(bytes).map_err(Problem::File)?;
            let all = usd_nodes::chains(&layer, &|_| true);
            let chain = choose_prim(&all, name).map_err(|problem| {
                // It may be where the layer takes prims from.
                usd_nodes::elsewhere(&layer).map_or(Problem::Node(problem), Problem::File)
            })?;
            let nodes = UsdNodes::read(&layer, chain).map_err(Problem::File)?;
            return Ok((
                format!("prim {}", usd_nodes::path_of(chain)),
                Self::Usd(nodes),
            ));
        }
        let Gltf { document, blob } =
            Gltf::from_slice(bytes).map_err(|error| Problem::File(error.to_string()))?;
        let node = choose(&document, name).map_err(Problem::Node)?;
        let nodes = Nodes::read(bytes, (&document, blob), &node, beside)
            .map_err(|error| Problem::File(error.to_string()))?;
        Ok((format!("node {}", named(&node)), Self::Gltf(nodes)))
    }

    /// Returns the transform to the world, which is in metres with y up.
    fn at(&self, seconds: f64) -> DMat4 {
        match self {
            Self::Gltf(nodes) => nodes.at(seconds),
            Self::Usd(nodes) => nodes.at(seconds),
        }
    }

    /// Returns the times of all keys, seconds, unordered.
    fn times(&self) -> Vec<f64> {
        match self {
            Self::Gltf(nodes) => nodes.times().collect(),
            Self::Usd(nodes) => nodes.times([].into_iter()).collect(),
        }
    }

    /// Returns the key times of values that change, seconds, unordered.
    fn times_moved(&self) -> Vec<f64> {
        match self {
            Self::Gltf(nodes) => nodes.times_moved().collect(),
            Self::Usd(nodes) => nodes.times_moved([].into_iter()).collect(),
        }
    }

    /// Returns the file's time codes per second; `None` for a format in seconds.
    fn rate(&self) -> Option<Rate> {
        match self {
            Self::Gltf(_) => None,
            Self::Usd(nodes) => Some(nodes.rate()),
        }
    }

    /// Whether a value changes in steps. USD interpolates numbers linearly.
    fn jumps(&self) -> bool {
        match self {
            Self::Gltf(nodes) => nodes.jumps(),
            Self::Usd(_) => false,
        }
    }

    /// Whether poses are rigid only at the keys: linear interpolation of matrices does
    /// not rotate rigidly.
    fn is_of_keys(&self) -> bool {
        match self {
            Self::Gltf(_) => false,
            Self::Usd(nodes) => nodes.has_moving_matrix(),
        }
    }
}

/// Finds the prim of this name or path, or the only one with a transform. Of nested prims of one
/// name it takes the outermost, because Blender may give a mesh the name of its object.
fn choose_prim<'a, 'b>(
    all: &'b [Vec<&'a Prim>],
    name: Option<&str>,
) -> std::result::Result<&'b Vec<&'a Prim>, String> {
    let moving: Vec<_> = all
        .iter()
        .filter(|chain| {
            let prim = chain[chain.len() - 1];
            prim.attributes.contains_key("xformOpOrder")
        })
        .collect();
    let paths = |of: &[&Vec<&Prim>]| {
        let mut paths: Vec<_> = (of.iter().take(MOST_NAMES))
            .map(|chain| usd_nodes::path_of(chain))
            .collect();
        if of.len() > MOST_NAMES {
            paths.push("…".to_owned());
        }
        paths.join(", ")
    };
    let Some(name) = name else {
        return match &moving[..] {
            [only] => Ok(only),
            [] => Err("none of its prims has a transform".to_owned()),
            several => Err(format!(
                "it has {} prims with a transform: {}; name one as node",
                several.len(),
                paths(several)
            )),
        };
    };
    let is_called =
        |chain: &[&Prim]| chain[chain.len() - 1].name == name || usd_nodes::path_of(chain) == name;
    let is_within = |chain: &[&Prim]| (1..chain.len()).any(|depth| is_called(&chain[..depth]));
    let called: Vec<_> = all
        .iter()
        .filter(|chain| is_called(chain) && !is_within(chain))
        .collect();
    match called[..] {
        [only] => Ok(only),
        [] => Err(format!(
            "no prim is called {name:?}; with a transform there are {}",
            paths(&moving)
        )),
        _ => Err(format!(
            "{} prims are called {name:?}: {}; name one by its path",
            called.len(),
            paths(&called)
        )),
    }
}

/// Finds the node of this name, or the only one.
fn choose<'a>(
    document: &'a gltf::Document,
    name: Option<&str>,
) -> std::result::Result<gltf::Node<'a>, String> {
    let all: Vec<_> = document.nodes().collect();
    let names = || {
        let mut names: Vec<_> = all.iter().take(MOST_NAMES).map(named).collect();
        if all.len() > MOST_NAMES {
            names.push("…".to_owned());
        }
        names.join(", ")
    };
    let Some(name) = name else {
        return match &all[..] {
            [only] => Ok(only.clone()),
            [] => Err("it has no nodes".to_owned()),
            several => Err(format!(
                "it has {} nodes: {}; name one as node",
                several.len(),
                names()
            )),
        };
    };
    // A node without a name has the one that it is listed by, unless another node is named so.
    let has_name = |node: &gltf::Node<'_>| node.name() == Some(name);
    let is_listed_as = |node: &gltf::Node<'_>| named(node) == name;
    let mut found: Vec<_> = all.iter().filter(|node| has_name(node)).collect();
    if found.is_empty() {
        found = all.iter().filter(|node| is_listed_as(node)).collect();
    }
    match found[..] {
        [only] => Ok(only.clone()),
        [] => Err(format!("no node is called {name:?}; there are {}", names())),
        _ => Err(format!(
            "{} nodes are called {name:?}; give each a name of its own",
            found.len()
        )),
    }
}

/// Returns the transform at the start of the shot. Between two keys that are rigid only at the keys
/// it interpolates rigidly.
fn at_start(moves: &Moves, begin: f64) -> DMat4 {
    let times = moves.times();
    let before = times.iter().copied().filter(|time| *time <= begin);
    let after = times.iter().copied().filter(|time| *time > begin);
    let around = (before.reduce(f64::max), after.reduce(f64::min));
    let (true, (Some(before), Some(after))) = (moves.is_of_keys(), around) else {
        return moves.at(begin);
    };
    let [from, to] = [before, after].map(|time| moves.at(time));
    let part = (begin - before) / (after - before);
    let turn = DMat3::from_mat4(to) * DMat3::from_mat4(from).inverse();
    let turn = DQuat::IDENTITY.slerp(DQuat::from_mat3(&turn).normalize(), part);
    let shape = DMat3::from_quat(turn) * DMat3::from_mat4(from);
    let mut found = DMat4::from_mat3(shape);
    found.w_axis = from.w_axis.lerp(to.w_axis, part);
    found
}

/// Returns poses at the keys and at each frame, starting at the shot's start, which is at `begin`
/// in the file, seconds.
fn sampled(
    moves: &Moves,
    begin: f64,
    shot: &Shot,
) -> std::result::Result<Vec<(f64, DVec3, DQuat)>, String> {
    if moves.jumps() {
        return Err(
            "its keys are interpolated in steps, and a solid cannot jump; make them linear"
                .to_owned(),
        );
    }
    let end = shot.duration();
    let frames = (0..=shot.frames).map(|frame| shot.time(frame));
    let is_of_keys = moves.is_of_keys();
    let keys: Vec<f64> = moves.times().iter().map(|time| time - begin).collect();
    // With keys only, the first key after the end is included: the last frame
    // interpolates towards it.
    let last = keys.iter().copied().filter(|time| *time >= end);
    let last = last.fold(f64::INFINITY, f64::min);
    let most = if is_of_keys { last } else { end };
    let keys = keys.into_iter().filter(|time| (0.0..=most).contains(time));
    let frames = frames.filter(|time| !is_of_keys || *time == 0.0);
    let mut times: Vec<f64> = frames.chain(keys).collect();
    times.sort_unstable_by(f64::total_cmp);
    times.dedup_by(|after, before| *after - *before < APART);
    if times.len() > MOST_POSES {
        return Err(format!("{} poses; allowed: {MOST_POSES}", times.len()));
    }
    let start = at_start(moves, begin);
    let back = DMat3::from_mat4(start).inverse();
    let mut before = DQuat::IDENTITY;
    let mut poses = Vec::new();
    for time in times {
        let now: DMat4 = match time == 0.0 {
            true => start,
            false => moves.at(begin + time),
        };
        let from_start = DMat3::from_mat4(now) * back;
        let strain = from_start.transpose() * from_start - DMat3::IDENTITY;
        let most = strain.to_cols_array().map(f64::abs);
        // Written so that NaN counts as deformed.
        if !most.iter().all(|part| *part < RIGID) || from_start.determinant() < 0.0 {
            return Err(format!(
                "at {} s its size or shape differs from that at the start; a solid has to keep \
                 both",
                shown(time)
            ));
        }
        let turn = DQuat::from_mat3(&from_start).normalize();
        // Of the two quaternions of a rotation, the one closer to the previous one.
        let turn = if turn.dot(before) < 0.0 { -turn } else { turn };
        before = turn;
        poses.push((time, now.w_axis.truncate(), turn));
    }
    poses[0].2 = DQuat::IDENTITY;
    Ok(poses)
}

#[cfg(test)]
mod tests;
