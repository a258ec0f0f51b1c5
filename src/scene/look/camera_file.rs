//! A camera from a file: glTF 2.0 (Khronos 2021), with its node's place in the hierarchy and its
//! animations, or USD as text.
//!
//! glTF is in metres with y up, and a camera looks along its own −z, as in a look's world. Sampled
//! are translation, rotation and scale of the camera's node and of all its ancestors; a camera's
//! own scale does not affect its direction and is ignored.

use glam::{DMat3, DVec3};
use gltf::{Document, Gltf, Node, camera::Projection};

use super::{
    super::{
        gltf_nodes::{Beside, NodeError, Nodes},
        usd_nodes::{Rate, is_usd},
    },
    Framing,
    usd_camera::UsdCamera,
};
use swell_domain::text::{self, NoText};

/// Largest distance from the origin, metres: beyond it, `f32` positions are coarser
/// than a millimetre.
const FARTHEST: f64 = 1e5;

/// Why a file provides no camera.
#[derive(Debug, thiserror::Error)]
pub enum CameraFileError {
    /// A fault in a USD file.
    #[error("{0}")]
    Usd(String),
    /// The file is neither USD nor valid glTF.
    #[error("it is neither USD as text, which begins with #usda, nor readable glTF: {0}")]
    Gltf(#[from] gltf::Error),
    /// The text has another encoding.
    #[error(transparent)]
    Text(#[from] NoText),
    /// The file has no camera.
    #[error("none of its nodes has a camera")]
    None,
    /// The file has several cameras, and none is named.
    #[error("it has {} cameras: {}; name one in camera.name", .0.len(), .0.join(", "))]
    Several(Vec<String>),
    /// The file has no camera of this name.
    #[error("no camera is called {name:?}; there are {}", names.join(", "))]
    Unknown {
        /// The requested name.
        name: String,
        /// Names of its cameras.
        names: Vec<String>,
    },
    /// The file has several cameras of this name.
    #[error("{count} cameras are called {name:?}; give each a name of its own")]
    Ambiguous {
        /// The requested name.
        name: String,
        /// Number of such cameras.
        count: usize,
    },
    /// The camera is orthographic.
    #[error("camera {0} is orthographic; only perspective cameras are drawn")]
    Orthographic(String),
    /// The field of view is out of range.
    #[error(
        "camera {name} has a vertical field of view of {yfov} radians; allowed is more \
         than 0 and less than π"
    )]
    FieldOfView {
        /// Name of the camera.
        name: String,
        /// Vertical field of view in the file, radians.
        yfov: f32,
    },
    /// A fault in the animation of its node.
    #[error(transparent)]
    Node(#[from] NodeError),
    /// The camera has no valid pose at some time.
    #[error("at {seconds} s camera {name} has no valid position or direction: {what}")]
    Pose {
        /// Name of the camera.
        name: String,
        /// Time, seconds.
        seconds: f64,
        /// Description of the fault.
        what: &'static str,
    },
}

impl CameraFileError {
    /// Whether another `camera.name` could resolve the error.
    pub(super) fn is_of_name(&self) -> bool {
        matches!(self, Self::Unknown { .. } | Self::Ambiguous { .. })
    }
}

type Result<T> = std::result::Result<T, CameraFileError>;

/// Pose of a camera in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Position, metres.
    pub position: DVec3,
    /// Unit vector of the viewing direction.
    pub forward: DVec3,
    /// Unit vector towards the top of the picture, perpendicular to `forward`.
    pub up: DVec3,
}

/// A perspective camera with its animation.
#[derive(Clone, Debug)]
pub struct CameraFile {
    name: String,
    body: Body,
    hash: blake3::Hash,
}

#[derive(Clone, Debug)]
enum Body {
    Gltf {
        /// Vertical field of view, radians.
        yfov: f64,
        aspect_ratio: Option<f64>,
        nodes: Nodes,
    },
    Usd(Box<UsdCamera>),
}

impl CameraFile {
    /// Reads the camera called `name`, or the only one, from the bytes of a file. `beside` reads
    /// files that it references.
    ///
    /// # Errors
    /// [`CameraFileError`].
    pub fn read(bytes: &[u8], name: Option<&str>, beside: Beside<'_>) -> Result<Self> {
        let bytes = text::without_mark(bytes)?;
        if is_usd(bytes) {
            let (name, camera) = UsdCamera::read(bytes, name)?;
            let found = Self {
                name,
                body: Body::Usd(Box::new(camera)),
                hash: blake3::hash(bytes),
            };
            found.check()?;
            return Ok(found);
        }
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
        let nodes = Nodes::read(bytes, (&document, blob), &node, beside)?;
        let found = Self {
            name: called,
            hash: nodes.hash(),
            body: Body::Gltf {
                yfov: yfov.into(),
                aspect_ratio: lens.aspect_ratio().map(f64::from),
                nodes,
            },
        };
        found.check()?;
        Ok(found)
    }

    /// Returns the BLAKE3 hash of the file and of the buffers that animate its camera.
    pub(super) fn hash(&self) -> blake3::Hash {
        self.hash
    }

    /// Returns width over height, if the file specifies it.
    pub fn aspect_ratio(&self) -> Option<f64> {
        match &self.body {
            Body::Gltf { aspect_ratio, .. } => *aspect_ratio,
            Body::Usd(camera) => Some(camera.aspect_ratio()),
        }
    }

    /// Returns the focal length for a picture `picture_height_mm` high, mm. `framing` decides which
    /// part of the film the picture shows.
    pub fn focal_length_mm(&self, framing: &Framing, picture_height_mm: f64, seconds: f64) -> f64 {
        picture_height_mm / framing.shown(self.film(framing, seconds))[1]
    }

    /// Returns the offset of the picture's centre from the optical axis, to the right and upward,
    /// in heights of the picture.
    pub fn shift(&self, framing: &Framing, seconds: f64) -> [f64; 2] {
        match &self.body {
            // glTF's perspective cameras have no offset.
            Body::Gltf { .. } => [0.0; 2],
            Body::Usd(camera) => {
                let film = self.film(framing, seconds);
                let heights = film[1] / framing.shown(film)[1];
                camera.shift(seconds).map(|of_film| of_film * heights)
            }
        }
    }

    /// Returns width and height of the film in focal lengths. Without an aspect ratio in the file,
    /// the film has that of the image.
    fn film(&self, framing: &Framing, seconds: f64) -> [f64; 2] {
        match &self.body {
            Body::Gltf {
                yfov, aspect_ratio, ..
            } => {
                let height = 2.0 * (0.5 * yfov).tan();
                let shape = aspect_ratio.unwrap_or_else(|| framing.shape());
                [shape * height, height]
            }
            Body::Usd(camera) => camera.film(seconds),
        }
    }

    /// Returns the f-number and the focus distance, metres; `None` for a pinhole, as all
    /// glTF cameras are.
    pub fn lens(&self, seconds: f64) -> Option<[f64; 2]> {
        match &self.body {
            Body::Gltf { .. } => None,
            Body::Usd(camera) => camera.lens(seconds),
        }
    }

    /// Returns the longest focal length of the shot, mm.
    pub fn longest_focal_length_mm(&self, framing: &Framing, picture_height_mm: f64) -> f64 {
        let at = |seconds| self.focal_length_mm(framing, picture_height_mm, seconds);
        self.times().map(at).fold(at(0.0), f64::max)
    }

    /// Returns the file's time codes per second; `None` for a format in seconds.
    pub(super) fn rate(&self) -> Option<Rate> {
        match &self.body {
            Body::Gltf { .. } => None,
            Body::Usd(camera) => Some(camera.rate()),
        }
    }

    /// Returns the first and last key of values that change, seconds; `None` if nothing moves.
    pub(super) fn moves(&self) -> Option<[f64; 2]> {
        let times: Box<dyn Iterator<Item = f64> + '_> = match &self.body {
            Body::Gltf { nodes, .. } => Box::new(nodes.times_moved()),
            Body::Usd(camera) => Box::new(camera.times_moved()),
        };
        let ends = times.map(|seconds| [seconds; 2]);
        ends.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// Returns the times of all keys, seconds.
    pub(super) fn times(&self) -> Box<dyn Iterator<Item = f64> + '_> {
        match &self.body {
            Body::Gltf { nodes, .. } => Box::new(nodes.times()),
            Body::Usd(camera) => Box::new(camera.times()),
        }
    }

    /// Returns the camera's pose at a time, seconds.
    pub fn at(&self, seconds: f64) -> Stand {
        let world = match &self.body {
            Body::Gltf { nodes, .. } => nodes.at(seconds),
            Body::Usd(camera) => camera.at(seconds),
        };
        let axes = DMat3::from_mat4(world);
        let forward = (-axes.z_axis).normalize();
        let up = axes.y_axis;
        Stand {
            position: world.w_axis.truncate(),
            forward,
            up: (up - forward * up.dot(forward)).normalize(),
        }
    }

    /// Checks the pose at each key and at time 0.
    fn check(&self) -> Result<()> {
        for seconds in self.times().chain([0.0]) {
            let stand = self.at(seconds);
            let is_near = stand.position.abs().max_element() <= FARTHEST;
            let what = if !(stand.forward.is_finite() && stand.up.is_finite()) {
                "its matrix has no inverse"
            } else if !is_near {
                "it is more than 100 km from the origin"
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

/// Returns the name of a node, or else that of its camera.
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
    // Node names take precedence: two nodes may share a camera.
    for is_called in [
        |node: &Node<'_>, name: &str| node.name() == Some(name),
        |node: &Node<'_>, name: &str| node.camera().is_some_and(|it| it.name() == Some(name)),
        // As the list of names has it.
        |node: &Node<'_>, name: &str| called(node) == name,
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

#[cfg(test)]
pub(crate) mod tests;
