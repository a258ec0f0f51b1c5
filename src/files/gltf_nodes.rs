//! Nodes of a glTF 2.0 file (Khronos 2021): transforms in the file's hierarchy and
//! their animations.
//!
//! Sampled are translation, rotation and scale of a node and of all its ancestors.

mod track;

use std::borrow::Cow;

use glam::{DMat4, DQuat, DVec3};
use gltf::{
    Document, Node,
    animation::{Property, util::ReadOutputs},
};

use track::{Track, rotations, track};

/// Largest number of keys per animation; enough for hours.
const MOST_KEYS: usize = 10_000_000;
/// Largest depth of a node in the hierarchy.
const MOST_NODES: usize = 1000;

/// Reads a file referenced by a glTF file; the error is a description.
pub(crate) type Beside<'a> = &'a dyn Fn(&str) -> std::result::Result<Vec<u8>, String>;

/// Why a node's motion cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// Animation data are missing from the buffers or have the wrong type.
    #[error("its animation of {node}: {what}")]
    Animation {
        /// Name of the animated node.
        node: String,
        /// Description of the fault.
        what: String,
    },
    /// A buffer cannot be read.
    #[error("buffer {index}: {what}")]
    Buffer {
        /// Index of the buffer.
        index: usize,
        /// Description of the fault.
        what: String,
    },
    /// Nodes that are their own ancestors, or nested too deeply.
    #[error("node {0} has more than {MOST_NODES} ancestors, or is under itself")]
    Hierarchy(String),
}

type Result<T> = std::result::Result<T, NodeError>;

/// A node with the transforms and animations of its ancestors.
#[derive(Clone, Debug)]
pub(crate) struct Nodes {
    /// From the node up to the root.
    nodes: Vec<Hung>,
    hash: blake3::Hash,
}

impl Nodes {
    /// Reads the chain of a node from the file with these bytes. `beside` reads files
    /// that it references.
    pub(crate) fn read(
        bytes: &[u8],
        (document, blob): (&Document, Option<Vec<u8>>),
        node: &Node<'_>,
        beside: Beside<'_>,
    ) -> Result<Self> {
        let mut hasher = blake3::Hasher::new();
        hasher.update(blake3::hash(bytes).as_bytes());
        let chain = chain(document, node)?;
        let buffers = buffers(document, blob, &chain, beside)?;
        for buffer in buffers.iter().flatten() {
            hasher.update(blake3::hash(buffer).as_bytes());
        }
        let nodes = chain.iter().map(|node| hung(document, node, &buffers));
        Ok(Self {
            nodes: nodes.collect::<Result<_>>()?,
            hash: hasher.finalize(),
        })
    }

    /// Returns the BLAKE3 hash of the file and of the buffers that animate the node.
    pub(crate) fn hash(&self) -> blake3::Hash {
        self.hash
    }

    /// Returns the transform from the node to the world at a time, seconds.
    pub(crate) fn at(&self, seconds: f64) -> DMat4 {
        let up = self.nodes.iter();
        up.fold(DMat4::IDENTITY, |below, node| node.at(seconds) * below)
    }

    /// Returns the times of all keys, seconds, unordered.
    pub(crate) fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.nodes.iter().flat_map(Hung::times)
    }

    /// Returns the key times of values that change, seconds, unordered.
    pub(crate) fn times_moved(&self) -> impl Iterator<Item = f64> + '_ {
        self.nodes.iter().flat_map(Hung::times_moved)
    }

    /// Whether a value changes in steps.
    pub(crate) fn jumps(&self) -> bool {
        self.nodes.iter().any(Hung::jumps)
    }
}

/// Local transform of a node.
#[derive(Clone, Debug)]
enum Hung {
    /// A static matrix.
    Still(DMat4),
    Moved {
        translation: Track<DVec3>,
        rotation: Track<DQuat>,
        scale: Track<DVec3>,
    },
}

impl Hung {
    fn at(&self, seconds: f64) -> DMat4 {
        match self {
            Self::Still(matrix) => *matrix,
            Self::Moved {
                translation,
                rotation,
                scale,
            } => DMat4::from_scale_rotation_translation(
                scale.at(seconds),
                rotation.at(seconds),
                translation.at(seconds),
            ),
        }
    }

    fn jumps(&self) -> bool {
        match self {
            Self::Still(_) => false,
            Self::Moved {
                translation,
                rotation,
                scale,
            } => translation.jumps() || rotation.jumps() || scale.jumps(),
        }
    }

    fn times_moved(&self) -> impl Iterator<Item = f64> + '_ {
        let tracks = match self {
            Self::Still(_) => [&[][..]; 3],
            Self::Moved {
                translation,
                rotation,
                scale,
            } => [
                translation.times_moved(),
                rotation.times_moved(),
                scale.times_moved(),
            ],
        };
        tracks.into_iter().flatten().copied()
    }

    fn times(&self) -> impl Iterator<Item = f64> + '_ {
        let (still, tracks) = match self {
            Self::Still(_) => (true, [&[][..]; 3]),
            Self::Moved {
                translation,
                rotation,
                scale,
            } => (
                false,
                [&translation.times[..], &rotation.times, &scale.times],
            ),
        };
        let times = tracks.into_iter().flatten().copied();
        times.filter(move |_| !still)
    }
}

/// Returns the name of a node, or one made from its index.
pub(crate) fn named(node: &Node<'_>) -> String {
    let name = node.name();
    name.map_or_else(|| format!("node {}", node.index()), str::to_owned)
}

/// Returns a node and its ancestors up to the root.
fn chain<'a>(document: &'a Document, node: &Node<'a>) -> Result<Vec<Node<'a>>> {
    let mut parents = vec![None; document.nodes().len()];
    for parent in document.nodes() {
        for child in parent.children() {
            parents[child.index()] = Some(parent.clone());
        }
    }
    let mut chain = vec![node.clone()];
    while let Some(parent) = &parents[chain[chain.len() - 1].index()] {
        if chain.len() == MOST_NODES {
            return Err(NodeError::Hierarchy(named(node)));
        }
        chain.push(parent.clone());
    }
    Ok(chain)
}

/// Reads the buffers that animate nodes of `chain`, by index; others are `None` and not read.
fn buffers<'a>(
    document: &Document,
    blob: Option<Vec<u8>>,
    chain: &[Node<'_>],
    beside: Beside<'_>,
) -> Result<Vec<Option<Cow<'a, [u8]>>>> {
    let mut wanted = vec![false; document.buffers().len()];
    for channel in document.animations().flat_map(|it| it.channels()) {
        let target = channel.target().node().index();
        if !chain.iter().any(|node| node.index() == target) {
            continue;
        }
        let sampler = channel.sampler();
        for accessor in [sampler.input(), sampler.output()] {
            let sparse = accessor.sparse();
            let views = [
                accessor.view(),
                sparse.as_ref().map(|it| it.indices().view()),
                sparse.as_ref().map(|it| it.values().view()),
            ];
            for view in views.into_iter().flatten() {
                wanted[view.buffer().index()] = true;
            }
        }
    }
    let mut blob = blob;
    let read = document.buffers().zip(wanted).map(|(buffer, is_wanted)| {
        if !is_wanted {
            return Ok(None);
        }
        let fault = |what: String| NodeError::Buffer {
            index: buffer.index(),
            what,
        };
        let bytes = match buffer.source() {
            gltf::buffer::Source::Bin => blob
                .take()
                .ok_or_else(|| fault("it has no binary chunk".into()))?,
            gltf::buffer::Source::Uri(uri) => data(uri, beside).map_err(fault)?,
        };
        if bytes.len() < buffer.length() {
            let what = format!("has {} bytes of {}", bytes.len(), buffer.length());
            return Err(fault(what));
        }
        Ok(Some(Cow::Owned(bytes)))
    });
    read.collect()
}

/// Returns the data embedded in a URI, or the content of the file that it names.
fn data(uri: &str, beside: Beside<'_>) -> std::result::Result<Vec<u8>, String> {
    use base64::Engine as _;
    let Some(rest) = uri.strip_prefix("data:") else {
        return beside(&percent_decoded(uri)?);
    };
    let (_, text) = rest
        .split_once(";base64,")
        .ok_or("its data are not base64")?;
    let engine = base64::engine::general_purpose::STANDARD;
    engine
        .decode(text)
        .map_err(|error| format!("its data are not valid base64: {error}"))
}

fn percent_decoded(uri: &str) -> std::result::Result<String, String> {
    let mut bytes = Vec::new();
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        rest = after;
        if first != b'%' {
            bytes.push(first);
            continue;
        }
        let digits = rest.get(..2).and_then(|two| std::str::from_utf8(two).ok());
        let byte = digits.and_then(|two| u8::from_str_radix(two, 16).ok());
        bytes.push(byte.ok_or_else(|| format!("{uri} is not a URI"))?);
        rest = &rest[2..];
    }
    String::from_utf8(bytes).map_err(|_| format!("{uri} is not UTF-8 text"))
}

/// Reads the local transform of a node with its animations.
fn hung(document: &Document, node: &Node<'_>, buffers: &[Option<Cow<'_, [u8]>>]) -> Result<Hung> {
    let channels: Vec<_> = (document.animations())
        .flat_map(|animation| animation.channels().collect::<Vec<_>>())
        .filter(|channel| {
            channel.target().node().index() == node.index()
                && channel.target().property() != Property::MorphTargetWeights
        })
        .collect();
    let transform = node.transform();
    if let (gltf::scene::Transform::Matrix { matrix }, true) = (&transform, channels.is_empty()) {
        return Ok(Hung::Still(DMat4::from_cols_array_2d(
            &matrix.map(|column| column.map(f64::from)),
        )));
    }
    let (translation, rotation, scale) = transform.decomposed();
    let (mut translation, mut rotation, mut scale) = (
        Track::still(vector(translation)),
        Track::still(turn(rotation)),
        Track::still(vector(scale)),
    );
    let mut seen = Vec::new();
    for channel in channels {
        let property = channel.target().property();
        let fault = |what: String| NodeError::Animation {
            node: named(node),
            what,
        };
        if seen.contains(&property) {
            return Err(fault(format!(
                "{property:?} is animated twice; keep one of the animations"
            )));
        }
        seen.push(property);
        let sampler = channel.sampler();
        for accessor in [sampler.input(), sampler.output()] {
            check_accessor(&accessor, buffers).map_err(fault)?;
        }
        let reader = channel.reader(|buffer| buffers[buffer.index()].as_deref());
        let inputs = reader.read_inputs();
        let times: Vec<f64> = (inputs.ok_or_else(|| fault("its times are missing".into()))?)
            .map(f64::from)
            .collect();
        let outputs = reader.read_outputs();
        match outputs.ok_or_else(|| fault("its values are missing".into()))? {
            ReadOutputs::Translations(values) => {
                translation =
                    track(times, values.map(vector).collect(), &sampler).map_err(fault)?;
            }
            ReadOutputs::Rotations(values) => {
                rotation = rotations(times, values, &sampler).map_err(fault)?;
            }
            ReadOutputs::Scales(values) => {
                scale = track(times, values.map(vector).collect(), &sampler).map_err(fault)?;
            }
            ReadOutputs::MorphTargetWeights(_) => {}
        }
    }
    Ok(Hung::Moved {
        translation,
        rotation,
        scale,
    })
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

fn turn(q: [f32; 4]) -> DQuat {
    DQuat::from_array(q.map(f64::from)).normalize()
}

/// Checks that an accessor stays within its buffers; the crate's byte arithmetic assumes that.
fn check_accessor(
    accessor: &gltf::Accessor<'_>,
    buffers: &[Option<Cow<'_, [u8]>>],
) -> std::result::Result<(), String> {
    let count = accessor.count();
    if count == 0 || count > MOST_KEYS {
        return Err(format!("{count} keys; allowed are 1 to {MOST_KEYS}"));
    }
    let sparse = accessor.sparse();
    if sparse
        .as_ref()
        .is_some_and(|it| it.count() == 0 || it.count() > count)
    {
        return Err("a sparse accessor without values, or with more than there are".to_owned());
    }
    let views = [
        accessor.view(),
        sparse.as_ref().map(|it| it.indices().view()),
        sparse.as_ref().map(|it| it.values().view()),
    ];
    for view in views.into_iter().flatten() {
        let buffer = buffers[view.buffer().index()]
            .as_deref()
            .unwrap_or_default();
        let end = view.offset().checked_add(view.length());
        if end.is_none_or(|end| end > buffer.len()) {
            return Err("it reads beyond its buffer".to_owned());
        }
        if view.stride().is_some_and(|stride| stride > 252) {
            return Err("it has a stride of more than 252 bytes".to_owned());
        }
    }
    if accessor.offset() > u32::MAX as usize {
        return Err("it reads beyond its buffer".to_owned());
    }
    Ok(())
}
