//! Reads a camera from a file: glTF 2.0 (Khronos 2021), with its node's place in the hierarchy and
//! its animations, or USD as text.
//!
//! glTF is in metres with y up, and a camera looks along its own −z, as in a look's world. Sampled
//! are translation, rotation and scale of the camera's node and of all its ancestors; a camera's
//! own scale does not affect its direction and is ignored.

use glam::DMat4;
use gltf::{Document, Gltf, Node, camera::Projection};

use swell_domain::text::{self, NoText};
use swell_scene::look::camera_file::{CameraFile, CameraTrack};

use super::usd_camera::UsdCamera;
use crate::{
    gltf_nodes::{Beside, NodeError, Nodes},
    usd_nodes::is_usd,
};

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

/// Reads the camera called `name`, or the only one, from the bytes of a file. `beside` reads files
/// that it references.
///
/// # Errors
/// [`CameraFileError`].
pub fn read(bytes: &[u8], name: Option<&str>, beside: Beside<'_>) -> Result<CameraFile> {
    let bytes = text::without_mark(bytes)?;
    if is_usd(bytes) {
        let (name, camera) = UsdCamera::read(bytes, name)?;
        return checked(&name, CameraFile::new(camera, blake3::hash(bytes)));
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
    let hash = nodes.hash();
    let camera = GltfCamera {
        yfov: yfov.into(),
        aspect_ratio: lens.aspect_ratio().map(f64::from),
        nodes,
    };
    checked(&called, CameraFile::new(camera, hash))
}

/// Returns the camera if its pose is valid at each key and at time 0.
fn checked(name: &str, camera: CameraFile) -> Result<CameraFile> {
    for seconds in camera.times().into_iter().chain([0.0]) {
        let stand = camera.at(seconds);
        let is_near = stand.position.abs().max_element() <= FARTHEST;
        let what = if !(stand.forward.is_finite() && stand.up.is_finite()) {
            "its matrix has no inverse"
        } else if !is_near {
            "it is more than 100 km from the origin"
        } else {
            continue;
        };
        return Err(CameraFileError::Pose {
            name: name.to_owned(),
            seconds,
            what,
        });
    }
    Ok(camera)
}

/// A camera of glTF with the animation of its node. It is a pinhole without an offset.
#[derive(Debug)]
struct GltfCamera {
    /// Vertical field of view, radians.
    yfov: f64,
    aspect_ratio: Option<f64>,
    nodes: Nodes,
}

impl CameraTrack for GltfCamera {
    fn at(&self, seconds: f64) -> DMat4 {
        self.nodes.at(seconds)
    }

    fn times(&self) -> Vec<f64> {
        self.nodes.times().collect()
    }

    fn times_moved(&self) -> Vec<f64> {
        self.nodes.times_moved().collect()
    }

    fn film(&self, _seconds: f64, shape: f64) -> [f64; 2] {
        let height = 2.0 * (0.5 * self.yfov).tan();
        [self.aspect_ratio.unwrap_or(shape) * height, height]
    }

    fn aspect_ratio(&self) -> Option<f64> {
        self.aspect_ratio
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
