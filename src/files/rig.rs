//! Cameras and animated objects of a USD or glTF file that a look or a scene can use.

use gltf::{Gltf, animation::Property};

use super::{
    gltf_nodes::named,
    usd_nodes::{chains, elsewhere, is_usd, layer, path_of},
    usda::{Prim, Value},
};
use swell_domain::text;

/// Contents of a file, by the names that `camera.name` and `track.node` accept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rig {
    /// `usd` or `gltf`.
    pub format: &'static str,
    /// Cameras in the order of the file; in USD, prims come after those nested in them.
    pub cameras: Vec<String>,
    /// Nodes or prims (including cameras) with an animated transform of their own.
    pub moving: Vec<String>,
    /// Warning that a prim takes parts from elsewhere, which are not read.
    pub elsewhere: Option<String>,
}

impl Rig {
    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// If the file cannot be parsed; the text describes the fault.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let bytes = text::without_mark(bytes).map_err(|error| error.to_string())?;
        if is_usd(bytes) {
            let layer = layer(bytes)?;
            let paths = |is_wanted: &dyn Fn(&Prim) -> bool| {
                let found = chains(&layer, is_wanted);
                found.iter().map(|chain| path_of(chain)).collect()
            };
            return Ok(Self {
                format: "usd",
                cameras: paths(&|prim| prim.kind == "Camera"),
                moving: paths(&moves),
                elsewhere: elsewhere(&layer),
            });
        }
        let Gltf { document, .. } = Gltf::from_slice(bytes).map_err(|error| error.to_string())?;
        let is_target = |index: usize| {
            let mut channels = document.animations().flat_map(|it| it.channels());
            channels.any(|channel| {
                let target = channel.target();
                target.node().index() == index && target.property() != Property::MorphTargetWeights
            })
        };
        let nodes = || document.nodes();
        let cameras = nodes().filter(|node| node.camera().is_some());
        let moving = nodes().filter(|node| is_target(node.index()));
        Ok(Self {
            format: "gltf",
            cameras: cameras.map(|node| named(&node)).collect(),
            moving: moving.map(|node| named(&node)).collect(),
            elsewhere: None,
        })
    }
}

/// Whether one of the prim's transform operations has several time samples.
fn moves(prim: &Prim) -> bool {
    let Some(Value::Words(order)) = prim.attributes.get("xformOpOrder") else {
        return false;
    };
    order.iter().any(|listed| {
        let name = listed.strip_prefix("!invert!").unwrap_or(listed);
        let value = prim.attributes.get(name);
        matches!(value, Some(Value::Samples(samples)) if samples.len() > 1)
    })
}
