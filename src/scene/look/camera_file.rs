//! A camera from a glTF 2.0 file (Khronos 2021): where its node stands in the file's hierarchy, and how its animations move it.
//!
//! glTF is in metres, y up, and a camera looks along its own −z, as a look's world is. What is sampled is translation, rotation and
//! scale of the camera's node and of every node above it; a camera's own scale turns nothing and is left out.

mod track;

use std::borrow::Cow;

use glam::{DMat3, DMat4, DQuat, DVec3};
use gltf::{
    Document, Gltf, Node,
    animation::{Property, util::ReadOutputs},
    camera::Projection,
};

use track::{Track, rotations, track};

/// Keys of an animation, at most: hours of them.
const MOST_KEYS: usize = 10_000_000;
/// Nodes from the root to the camera, at most.
const MOST_NODES: usize = 1000;
/// Metres from the origin, at most: farther out, f32 positions are coarser than a millimetre.
const FARTHEST: f64 = 1e5;

/// Why a file gives no camera.
#[derive(Debug, thiserror::Error)]
pub enum CameraFileError {
    /// It is no glTF file.
    #[error("no glTF file that can be read: {0}")]
    Gltf(#[from] gltf::Error),
    /// It has none.
    #[error("no node of it has a camera")]
    None,
    /// It has several, and none is named.
    #[error("it has {} cameras: {}; name one in camera.name", .0.len(), .0.join(", "))]
    Several(Vec<String>),
    /// It has none of that name.
    #[error("no camera is called {name:?}; there are {}", names.join(", "))]
    Unknown {
        /// As asked for.
        name: String,
        /// As they are called.
        names: Vec<String>,
    },
    /// It has several of that name.
    #[error("{count} cameras are called {name:?}; give each a name of its own")]
    Ambiguous {
        /// As asked for.
        name: String,
        /// So many.
        count: usize,
    },
    /// It has no perspective.
    #[error("camera {0} is orthographic; only perspective cameras are drawn")]
    Orthographic(String),
    /// A field of view that no lens has.
    #[error(
        "camera {name} has a vertical field of view of {yfov} radians; allowed is more than 0 and less than π"
    )]
    FieldOfView {
        /// Of the camera.
        name: String,
        /// As the file has it.
        yfov: f32,
    },
    /// Data that its accessors name and its buffers lack, or of another type.
    #[error("its animation of {node}: {what}")]
    Animation {
        /// The node that is moved.
        node: String,
        /// What is wrong.
        what: String,
    },
    /// A buffer that cannot be had.
    #[error("buffer {index}: {what}")]
    Buffer {
        /// Which, from 0.
        index: usize,
        /// What is wrong.
        what: String,
    },
    /// Nodes that are their own parents, or too many.
    #[error("the node of camera {0} hangs under more than {MOST_NODES} nodes, or under itself")]
    Hierarchy(String),
    /// A pose that is none.
    #[error("at {seconds} s camera {name} has no place or no direction: {what}")]
    Pose {
        /// Of the camera.
        name: String,
        /// When.
        seconds: f64,
        /// What is wrong.
        what: &'static str,
    },
}

impl CameraFileError {
    /// Whether another `camera.name` is the remedy.
    pub(super) fn is_of_name(&self) -> bool {
        matches!(self, Self::Unknown { .. } | Self::Ambiguous { .. })
    }
}

type Result<T> = std::result::Result<T, CameraFileError>;

/// Where a camera stands and looks, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Metres.
    pub position: DVec3,
    /// Unit vector into the picture.
    pub forward: DVec3,
    /// Unit vector to its top, at right angles to `forward`.
    pub up: DVec3,
}

/// A perspective camera, with what moves it.
#[derive(Clone, Debug)]
pub struct CameraFile {
    name: String,
    /// Vertical, radians.
    yfov: f64,
    aspect_ratio: Option<f64>,
    /// From the camera's node up to the root.
    nodes: Vec<Hung>,
    hash: blake3::Hash,
}

/// A node as it hangs under its parent.
#[derive(Clone, Debug)]
enum Hung {
    /// By a matrix, which nothing moves.
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

impl CameraFile {
    /// Reads the camera called `name`, or the only one, from the bytes of a file; `beside` reads a file that it names.
    ///
    /// # Errors
    /// [`CameraFileError`].
    pub fn read(
        bytes: &[u8],
        name: Option<&str>,
        beside: &dyn Fn(&str) -> std::result::Result<Vec<u8>, String>,
    ) -> Result<Self> {
        let Gltf { document, blob } = Gltf::from_slice(bytes)?;
        let node = choose(&document, name)?;
        let camera = node.camera().ok_or(CameraFileError::None)?;
        let called = called(&node);
        let Projection::Perspective(lens) = camera.projection() else {
            return Err(CameraFileError::Orthographic(called));
        };
        let yfov = lens.yfov();
        if !(yfov > 0.0 && yfov < std::f32::consts::PI) {
            return Err(CameraFileError::FieldOfView { name: called, yfov });
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(blake3::hash(bytes).as_bytes());
        let chain = chain(&document, &node)?;
        let buffers = buffers(&document, blob, &chain, beside)?;
        for buffer in buffers.iter().flatten() {
            hasher.update(blake3::hash(buffer).as_bytes());
        }
        let nodes = chain.iter().map(|node| hung(&document, node, &buffers));
        let found = Self {
            name: called,
            yfov: yfov.into(),
            aspect_ratio: lens.aspect_ratio().map(f64::from),
            nodes: nodes.collect::<Result<_>>()?,
            hash: hasher.finalize(),
        };
        found.check()?;
        Ok(found)
    }

    /// BLAKE3 over the file, and over the buffers that its camera is animated by.
    pub(super) fn hash(&self) -> blake3::Hash {
        self.hash
    }

    /// Width over height, where the file says it.
    pub fn aspect_ratio(&self) -> Option<f64> {
        self.aspect_ratio
    }

    /// Of a film of this height: its half over the tangent of half the field of view.
    pub fn focal_length_mm(&self, film_height_mm: f64) -> f64 {
        0.5 * film_height_mm / (0.5 * self.yfov).tan()
    }

    /// Where it stands.
    pub fn at(&self, seconds: f64) -> Stand {
        let world = self
            .nodes
            .iter()
            .fold(DMat4::IDENTITY, |below, node| node.at(seconds) * below);
        let axes = DMat3::from_mat4(world);
        let forward = (-axes.z_axis).normalize();
        let up = axes.y_axis;
        Stand {
            position: world.w_axis.truncate(),
            forward,
            up: (up - forward * up.dot(forward)).normalize(),
        }
    }

    /// At each of its keys, and before and after them.
    fn check(&self) -> Result<()> {
        let times = self.nodes.iter().flat_map(Hung::times);
        for seconds in times.chain([0.0]) {
            let stand = self.at(seconds);
            let is_near = stand.position.abs().max_element() <= FARTHEST;
            let what = if !(stand.forward.is_finite() && stand.up.is_finite()) {
                "its matrix has no inverse"
            } else if !is_near {
                "it stands more than 100 km from the origin"
            } else {
                continue;
            };
            return Err(CameraFileError::Pose {
                name: self.name.clone(),
                seconds,
                what,
            });
        }
        Ok(())
    }
}

/// What a node is called, or else its camera.
fn called(node: &Node<'_>) -> String {
    let camera = node.camera();
    let name = (node.name()).or_else(|| camera.as_ref().and_then(gltf::Camera::name));
    name.map_or_else(|| format!("node {}", node.index()), str::to_owned)
}

fn choose<'a>(document: &'a Document, name: Option<&str>) -> Result<Node<'a>> {
    let mut all: Vec<Node<'_>> = (document.nodes())
        .filter(|node| node.camera().is_some())
        .collect();
    let names: Vec<String> = all.iter().map(called).collect();
    let Some(name) = name else {
        return match all.len() {
            0 => Err(CameraFileError::None),
            1 => Ok(all.remove(0)),
            _ => Err(CameraFileError::Several(names)),
        };
    };
    if all.is_empty() {
        return Err(CameraFileError::None);
    }
    // A node's name comes first: two nodes may share a camera.
    for is_called in [
        |node: &Node<'_>, name: &str| node.name() == Some(name),
        |node: &Node<'_>, name: &str| node.camera().is_some_and(|it| it.name() == Some(name)),
    ] {
        let mut found = all.iter().filter(|node| is_called(node, name));
        match (found.next(), found.count()) {
            (None, _) => {}
            (Some(node), 0) => return Ok(node.clone()),
            (Some(_), more) => {
                return Err(CameraFileError::Ambiguous {
                    name: name.to_owned(),
                    count: more + 1,
                });
            }
        }
    }
    Err(CameraFileError::Unknown {
        name: name.to_owned(),
        names,
    })
}

/// A node and those above it, up to the root.
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
            return Err(CameraFileError::Hierarchy(called(node)));
        }
        chain.push(parent.clone());
    }
    Ok(chain)
}

/// Buffers that move nodes of `chain`, by index; `None` of others, which are not read.
fn buffers<'a>(
    document: &Document,
    blob: Option<Vec<u8>>,
    chain: &[Node<'_>],
    beside: &dyn Fn(&str) -> std::result::Result<Vec<u8>, String>,
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
        let fault = |what: String| CameraFileError::Buffer {
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

/// What a URI holds in itself, or the file that it names.
fn data(
    uri: &str,
    beside: &dyn Fn(&str) -> std::result::Result<Vec<u8>, String>,
) -> std::result::Result<Vec<u8>, String> {
    use base64::Engine as _;
    let Some(rest) = uri.strip_prefix("data:") else {
        return beside(&percent_decoded(uri)?);
    };
    let (_, text) = rest
        .split_once(";base64,")
        .ok_or("its data are not in base 64")?;
    let engine = base64::engine::general_purpose::STANDARD;
    engine
        .decode(text)
        .map_err(|error| format!("its data are no base 64: {error}"))
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
        bytes.push(byte.ok_or_else(|| format!("{uri} is no URI"))?);
        rest = &rest[2..];
    }
    String::from_utf8(bytes).map_err(|_| format!("{uri} is no text"))
}

/// A node with what its animations do to it.
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
        let fault = |what: String| CameraFileError::Animation {
            node: called(node),
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
        let times: Vec<f64> = (inputs.ok_or_else(|| fault("its times are not there".into()))?)
            .map(f64::from)
            .collect();
        let outputs = reader.read_outputs();
        match outputs.ok_or_else(|| fault("its values are not there".into()))? {
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

/// What an accessor reads lies in its buffers. The crate takes that for granted where it counts bytes.
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

#[cfg(test)]
pub(super) mod tests;
