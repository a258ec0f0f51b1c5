//! A camera (UsdGeomCamera) of a USD text layer, placed by its prims and their transforms.
//!
//! Film size, focal length and film offset are in the same tenths of a unit, so only their ratios
//! matter. The offset shifts the centre of the film from the optical axis, as in the window of
//! `GfCamera::GetFrustum`.

use glam::DMat4;

use super::{
    super::{
        usd_nodes::{Curve, UsdNodes, chains, elsewhere, layer, path_of},
        usda::{Layer, Prim, Value},
    },
    camera_file::CameraFileError,
};
use swell_scene::{look::camera_file::CameraTrack, rate::Rate};

/// Defaults of UsdGeomCamera: focal length, and width and height of the film.
const FOCAL_LENGTH: f64 = 50.0;
const APERTURE: [f64; 2] = [20.955, 15.2908];

/// A camera with the prims from the root to it.
#[derive(Clone, Debug)]
pub(super) struct UsdCamera {
    nodes: UsdNodes,
    focal_length: Curve,
    aperture: [Curve; 2],
    /// Offset of the film's centre from the optical axis, to the right and upward in the picture.
    offset: [Curve; 2],
    /// The f-number and the focus distance in units of the layer; `None` for a pinhole.
    lens: Option<[Curve; 2]>,
}

type Result<T> = std::result::Result<T, CameraFileError>;

fn fault(what: impl Into<String>) -> CameraFileError {
    CameraFileError::Usd(what.into())
}

impl UsdCamera {
    /// Reads the camera called `name`, or the only one, and returns it with its path.
    pub(super) fn read(bytes: &[u8], name: Option<&str>) -> Result<(String, Self)> {
        let layer = layer(bytes).map_err(fault)?;
        let chains = chains(&layer, &|prim| prim.kind == "Camera");
        let chain = choose(&layer, &chains, name)?;
        let camera = chain[chain.len() - 1];
        let called = path_of(chain);
        let projection = camera.attributes.get("projection");
        if projection == Some(&Value::Words(vec!["orthographic".to_owned()])) {
            return Err(CameraFileError::Orthographic(called));
        }
        let nodes = UsdNodes::read(&layer, chain).map_err(fault)?;
        let number = |key: &str, left_out: f64| match camera.attributes.get(key) {
            None => Ok(Curve::still(left_out)),
            Some(value) => Curve::of(value, 1, false)
                .ok_or_else(|| fault(format!("{key} of {called} is not a number"))),
        };
        let length = |key: &str, left_out: f64| {
            let found = number(key, left_out)?;
            match found.is_above_zero() {
                true => Ok(found),
                false => Err(fault(format!("{key} of {called} is not a positive number"))),
            }
        };
        // 0, the default of UsdGeomCamera, is a pinhole.
        let f_stop = number("fStop", 0.0)?;
        let is_pinhole = f_stop.samples.iter().all(|(_, it)| it[0] == 0.0);
        let lens = match is_pinhole {
            true => None,
            false => Some([length("fStop", 0.0)?, length("focusDistance", 0.0)?]),
        };
        let found = Self {
            focal_length: length("focalLength", FOCAL_LENGTH)?,
            aperture: [
                length("horizontalAperture", APERTURE[0])?,
                length("verticalAperture", APERTURE[1])?,
            ],
            offset: [
                number("horizontalApertureOffset", 0.0)?,
                number("verticalApertureOffset", 0.0)?,
            ],
            lens,
            nodes,
        };
        Ok((called, found))
    }

    fn optics(&self) -> impl Iterator<Item = &Curve> {
        let lens = self.lens.iter().flatten();
        let film = self.aperture.iter().chain(&self.offset);
        [&self.focal_length].into_iter().chain(film).chain(lens)
    }
}

impl CameraTrack for UsdCamera {
    fn at(&self, seconds: f64) -> DMat4 {
        self.nodes.at(seconds)
    }

    fn rate(&self) -> Option<Rate> {
        Some(self.nodes.rate())
    }

    fn times(&self) -> Vec<f64> {
        self.nodes.times(self.optics()).collect()
    }

    fn times_moved(&self) -> Vec<f64> {
        self.nodes.times_moved(self.optics()).collect()
    }

    fn film(&self, seconds: f64, _shape: f64) -> [f64; 2] {
        let code = self.nodes.code(seconds);
        [0, 1].map(|axis| self.aperture[axis].at(code)[0] / self.focal_length.at(code)[0])
    }

    fn shift(&self, seconds: f64) -> [f64; 2] {
        let code = self.nodes.code(seconds);
        let height = self.aperture[1].at(code)[0];
        [0, 1].map(|axis| self.offset[axis].at(code)[0] / height)
    }

    fn lens(&self, seconds: f64) -> Option<[f64; 2]> {
        let code = self.nodes.code(seconds);
        let [f_stop, focus] = self.lens.as_ref()?;
        let metres = self.nodes.metres_per_unit();
        Some([f_stop.at(code)[0], metres * focus.at(code)[0]])
    }

    /// Returns the aspect ratio of the film at time code 0.
    fn aspect_ratio(&self) -> Option<f64> {
        let [width, height] = [0, 1].map(|axis| self.aperture[axis].at(0.0)[0]);
        Some(width / height)
    }
}

/// Finds a camera by its path, its own name, or that of its parent, which Blender names
/// after the object.
fn choose<'a, 'b>(
    layer: &Layer,
    chains: &'b [Vec<&'a Prim>],
    name: Option<&str>,
) -> Result<&'b Vec<&'a Prim>> {
    let names = || chains.iter().map(|chain| path_of(chain)).collect();
    let elsewhere = || elsewhere(layer).map(fault);
    let Some(name) = name else {
        return match chains {
            [] => Err(elsewhere().unwrap_or_else(|| fault("none of its prims is a Camera"))),
            [only] => Ok(only),
            _ => Err(CameraFileError::Several(names())),
        };
    };
    let is_called = |chain: &[&Prim]| {
        let own = chain[chain.len() - 1];
        let above = chain.len().checked_sub(2).map(|k| &chain[k].name);
        path_of(chain) == name || own.name == name || above.is_some_and(|it| it == name)
    };
    let mut found = chains.iter().filter(|chain| is_called(chain));
    match (found.next(), found.count()) {
        (Some(chain), 0) => Ok(chain),
        (Some(_), more) => Err(CameraFileError::Ambiguous {
            name: name.to_owned(),
            count: more + 1,
        }),
        (None, _) => Err(elsewhere().unwrap_or_else(|| CameraFileError::Unknown {
            name: name.to_owned(),
            names: names(),
        })),
    }
}

#[cfg(test)]
mod tests;
