//! A camera from a file: of glTF 2.0 (Khronos 2021), where its node stands in the file's hierarchy, and how its animations move it;
//! or of USD as text.
//!
//! glTF is in metres, y up, and a camera looks along its own −z, as a look's world is. What is sampled is translation, rotation and
//! scale of the camera's node and of every node above it; a camera's own scale turns nothing and is left out.

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

/// Metres from the origin, at most: farther out, f32 positions are coarser than a millimetre.
const FARTHEST: f64 = 1e5;

/// Why a file gives no camera.
#[derive(Debug, thiserror::Error)]
pub enum CameraFileError {
    /// USD that gives none.
    #[error("{0}")]
    Usd(String),
    /// It is no glTF file.
    #[error("neither USD as text, which begins with #usda, nor glTF that can be read: {0}")]
    Gltf(#[from] gltf::Error),
    /// It is text in another encoding.
    #[error(transparent)]
    Text(#[from] NoText),
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
    /// What moves it.
    #[error(transparent)]
    Node(#[from] NodeError),
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
    body: Body,
    hash: blake3::Hash,
}

#[derive(Clone, Debug)]
enum Body {
    Gltf {
        /// Vertical, radians.
        yfov: f64,
        aspect_ratio: Option<f64>,
        nodes: Nodes,
    },
    Usd(Box<UsdCamera>),
}

impl CameraFile {
    /// Reads the camera called `name`, or the only one, from the bytes of a file; `beside` reads a file that it names.
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

    /// BLAKE3 over the file, and over the buffers that its camera is animated by.
    pub(super) fn hash(&self) -> blake3::Hash {
        self.hash
    }

    /// Width over height, where the file says it.
    pub fn aspect_ratio(&self) -> Option<f64> {
        match &self.body {
            Body::Gltf { aspect_ratio, .. } => *aspect_ratio,
            Body::Usd(camera) => Some(camera.aspect_ratio()),
        }
    }

    /// Where the picture is so many millimetres high: that over the picture's height in focal lengths, which `framing` decides.
    pub fn focal_length_mm(&self, framing: &Framing, picture_height_mm: f64, seconds: f64) -> f64 {
        picture_height_mm / framing.shown(self.film(framing, seconds))[1]
    }

    /// How far the picture's middle stands off the optical axis, to its right and to its top, in heights of the picture.
    pub fn shift(&self, framing: &Framing, seconds: f64) -> [f64; 2] {
        match &self.body {
            // glTF's perspective cameras have none.
            Body::Gltf { .. } => [0.0; 2],
            Body::Usd(camera) => {
                let film = self.film(framing, seconds);
                let heights = film[1] / framing.shown(film)[1];
                camera.shift(seconds).map(|of_film| of_film * heights)
            }
        }
    }

    /// Width and height of the film, in focal lengths; of the image's shape where the file has no width.
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

    /// The f-number and the distance that is sharp, metres; `None` of a pinhole, which all of glTF's are.
    pub fn lens(&self, seconds: f64) -> Option<[f64; 2]> {
        match &self.body {
            Body::Gltf { .. } => None,
            Body::Usd(camera) => camera.lens(seconds),
        }
    }

    /// The longest of the shot, mm.
    pub fn longest_focal_length_mm(&self, framing: &Framing, picture_height_mm: f64) -> f64 {
        let at = |seconds| self.focal_length_mm(framing, picture_height_mm, seconds);
        self.times().map(at).fold(at(0.0), f64::max)
    }

    /// Time codes a second of the file's own count; `None` where it counts seconds alone.
    pub(super) fn rate(&self) -> Option<Rate> {
        match &self.body {
            Body::Gltf { .. } => None,
            Body::Usd(camera) => Some(camera.rate()),
        }
    }

    /// When the first and the last key of what moves are, seconds; `None` where nothing does.
    pub(super) fn moves(&self) -> Option<[f64; 2]> {
        let times: Box<dyn Iterator<Item = f64> + '_> = match &self.body {
            Body::Gltf { nodes, .. } => Box::new(nodes.times_moved()),
            Body::Usd(camera) => Box::new(camera.times_moved()),
        };
        let ends = times.map(|seconds| [seconds; 2]);
        ends.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// When something has a key, seconds.
    pub(super) fn times(&self) -> Box<dyn Iterator<Item = f64> + '_> {
        match &self.body {
            Body::Gltf { nodes, .. } => Box::new(nodes.times()),
            Body::Usd(camera) => Box::new(camera.times()),
        }
    }

    /// Where it stands.
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

    /// At each of its keys, and before and after them.
    fn check(&self) -> Result<()> {
        for seconds in self.times().chain([0.0]) {
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

#[cfg(test)]
pub(crate) mod tests;
