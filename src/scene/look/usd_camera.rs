//! A camera from a USD layer as text: UsdGeomCamera, where its prims and their transforms put it (UsdGeomXformable).
//!
//! A transform is a list of operations, of which the last is next to the camera. Numbers at time codes are joined by lines, quaternions
//! by arcs, as OpenUSD joins them; beyond the first and the last they stay.

use glam::{DMat4, DQuat, DVec3, DVec4};

use super::{
    camera_file::CameraFileError,
    usda::{Layer, Prim, Value},
};

/// What a binary file begins with, and a package of files.
const BINARY: &[u8] = b"PXR-USDC";
const PACKAGE: &[u8] = b"PK\x03\x04";

/// Millimetres, where a camera leaves them out (UsdGeomCamera): focal length and height of the film, both in the same tenths.
const FOCAL_LENGTH: f64 = 50.0;
const APERTURE: [f64; 2] = [20.955, 15.2908];

/// Prims from the root to the camera.
#[derive(Clone, Debug)]
pub(super) struct UsdCamera {
    /// From the camera up to the root, each with its operations in the order that a point meets them.
    steps: Vec<Vec<Operation>>,
    focal_length: Curve,
    aperture: [Curve; 2],
    codes_per_second: f64,
    /// From the layer's units and up axis to metres with y up.
    world: DMat4,
}

/// One operation of a transform.
#[derive(Clone, Debug)]
struct Operation {
    kind: Kind,
    is_inverse: bool,
    curve: Curve,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Translate,
    Scale,
    /// About axes in this order.
    Rotate(&'static [usize]),
    Orient,
    Transform,
}

impl Kind {
    const NAMED: [(&'static str, Self, usize); 13] = [
        ("translate", Self::Translate, 3),
        ("scale", Self::Scale, 3),
        ("rotateX", Self::Rotate(&[0]), 1),
        ("rotateY", Self::Rotate(&[1]), 1),
        ("rotateZ", Self::Rotate(&[2]), 1),
        ("rotateXYZ", Self::Rotate(&[0, 1, 2]), 3),
        ("rotateXZY", Self::Rotate(&[0, 2, 1]), 3),
        ("rotateYXZ", Self::Rotate(&[1, 0, 2]), 3),
        ("rotateYZX", Self::Rotate(&[1, 2, 0]), 3),
        ("rotateZXY", Self::Rotate(&[2, 0, 1]), 3),
        ("rotateZYX", Self::Rotate(&[2, 1, 0]), 3),
        ("orient", Self::Orient, 4),
        ("transform", Self::Transform, 16),
    ];

    fn matrix(self, of: &[f64]) -> DMat4 {
        match self {
            Self::Translate => DMat4::from_translation(DVec3::new(of[0], of[1], of[2])),
            Self::Scale => DMat4::from_scale(DVec3::new(of[0], of[1], of[2])),
            Self::Rotate(axes) => axes.iter().fold(DMat4::IDENTITY, |before, &axis| {
                // One angle alone, or one of each axis.
                let angle = if axes.len() == 1 { of[0] } else { of[axis] };
                DMat4::from_axis_angle(DVec3::AXES[axis], angle.to_radians()) * before
            }),
            Self::Orient => {
                let turn = DQuat::from_xyzw(of[1], of[2], of[3], of[0]);
                DMat4::from_quat(turn.normalize())
            }
            // Rows are what a row vector is multiplied with.
            Self::Transform => DMat4::from_cols_slice(of),
        }
    }
}

/// Numbers over time.
#[derive(Clone, Debug)]
struct Curve {
    /// Ascending time codes; one of what stays.
    samples: Vec<(f64, Vec<f64>)>,
    is_turn: bool,
}

impl Curve {
    fn at(&self, code: f64) -> Vec<f64> {
        let next = self.samples.partition_point(|(time, _)| *time <= code);
        let (before, after) = match (next.checked_sub(1), self.samples.get(next)) {
            (None, _) => return self.samples[0].1.clone(),
            (Some(last), None) => return self.samples[last].1.clone(),
            (Some(before), Some(after)) => (&self.samples[before], after),
        };
        let part = (code - before.0) / (after.0 - before.0);
        if self.is_turn {
            let turn = |of: &[f64]| DQuat::from_vec4(DVec4::new(of[1], of[2], of[3], of[0]));
            let turn = turn(&before.1)
                .normalize()
                .slerp(turn(&after.1).normalize(), part);
            return vec![turn.w, turn.x, turn.y, turn.z];
        }
        let pairs = before.1.iter().zip(&after.1);
        pairs.map(|(a, b)| a + part * (b - a)).collect()
    }

    /// Of so many numbers, all finite.
    fn of(value: &Value, width: usize, is_turn: bool) -> Option<Self> {
        let samples = match value {
            Value::Numbers(numbers) => vec![(0.0, numbers.clone())],
            Value::Samples(samples) => samples.clone(),
            Value::Words(_) => return None,
        };
        let fits = |(time, numbers): &(f64, Vec<f64>)| {
            let is_finite = time.is_finite() && numbers.iter().all(|it| it.is_finite());
            is_finite && numbers.len() == width
        };
        let is_whole = !samples.is_empty() && samples.iter().all(fits);
        is_whole.then_some(Self { samples, is_turn })
    }

    fn still(number: f64) -> Self {
        Self {
            samples: vec![(0.0, vec![number])],
            is_turn: false,
        }
    }
}

/// Whether a file is USD, by its first bytes.
pub(super) fn is_usd(bytes: &[u8]) -> bool {
    [b"#usda", BINARY, PACKAGE]
        .iter()
        .any(|begin| bytes.starts_with(begin))
}

type Result<T> = std::result::Result<T, CameraFileError>;

fn fault(what: impl Into<String>) -> CameraFileError {
    CameraFileError::Usd(what.into())
}

impl UsdCamera {
    /// The camera called `name`, or the only one, and what it is called.
    pub(super) fn read(bytes: &[u8], name: Option<&str>) -> Result<(String, Self)> {
        if bytes.starts_with(BINARY) {
            return Err(fault(
                "binary USD; write it as text: usdcat camera.usdc -o camera.usda (of OpenUSD; usd-core of Python has it as \
                 Usd.Stage.Open(\"camera.usdc\").GetRootLayer().Export(\"camera.usda\"))",
            ));
        }
        if bytes.starts_with(PACKAGE) {
            return Err(fault(
                "a USD package; write its layer as text: usdcat --flatten camera.usdz -o camera.usda (of OpenUSD)",
            ));
        }
        let text = std::str::from_utf8(bytes).map_err(|_| fault("USD text that is not UTF-8"))?;
        let layer = Layer::read(text).map_err(fault)?;
        let chains = cameras(&layer);
        let chain = choose(&chains, name)?;
        let camera = chain[chain.len() - 1];
        let called = path_of(chain);
        let projection = camera.attributes.get("projection");
        if projection == Some(&Value::Words(vec!["orthographic".to_owned()])) {
            return Err(CameraFileError::Orthographic(called));
        }
        let length = |key: &str, left_out: f64| match camera.attributes.get(key) {
            None => Ok(Curve::still(left_out)),
            Some(value) => Curve::of(value, 1, false)
                .filter(|curve| curve.samples.iter().all(|(_, it)| it[0] > 0.0))
                .ok_or_else(|| fault(format!("{key} of {called} is no positive number"))),
        };
        let mut steps = Vec::new();
        for prim in chain.iter().rev() {
            let (operations, resets) = operations(prim)?;
            steps.push(operations);
            if resets {
                break;
            }
        }
        let found = Self {
            steps,
            focal_length: length("focalLength", FOCAL_LENGTH)?,
            aperture: [
                length("horizontalAperture", APERTURE[0])?,
                length("verticalAperture", APERTURE[1])?,
            ],
            codes_per_second: number(&layer, "timeCodesPerSecond", 24.0)?,
            world: world(&layer)?,
        };
        Ok((called, found))
    }

    fn code(&self, seconds: f64) -> f64 {
        seconds * self.codes_per_second
    }

    /// From the camera to the world, which is in metres with y up.
    pub(super) fn at(&self, seconds: f64) -> DMat4 {
        let code = self.code(seconds);
        let steps = self.steps.iter().flatten();
        let local = steps.fold(DMat4::IDENTITY, |below, operation| {
            let matrix = operation.kind.matrix(&operation.curve.at(code));
            match operation.is_inverse {
                true => matrix.inverse() * below,
                false => matrix * below,
            }
        });
        self.world * local
    }

    /// When something has a sample, seconds.
    pub(super) fn times(&self) -> impl Iterator<Item = f64> + '_ {
        let operations = self.steps.iter().flatten().map(|it| &it.curve);
        let curves = operations.chain([&self.focal_length]).chain(&self.aperture);
        let codes = curves.flat_map(|curve| curve.samples.iter().map(|(code, _)| *code));
        codes.map(|code| code / self.codes_per_second)
    }

    /// Height of the film over the focal length: twice the tangent of half the vertical field of view.
    pub(super) fn height_ratio(&self, seconds: f64) -> f64 {
        let code = self.code(seconds);
        self.aperture[1].at(code)[0] / self.focal_length.at(code)[0]
    }

    /// Of the film at the start.
    pub(super) fn aspect_ratio(&self) -> f64 {
        let [width, height] = [0, 1].map(|axis| self.aperture[axis].at(0.0)[0]);
        width / height
    }
}

/// Each camera with the prims above it, from the root on.
fn cameras(layer: &Layer) -> Vec<Vec<&Prim>> {
    fn look<'a>(prim: &'a Prim, above: &[&'a Prim], found: &mut Vec<Vec<&'a Prim>>) {
        let chain = [above, &[prim]].concat();
        for child in &prim.children {
            look(child, &chain, found);
        }
        if prim.kind == "Camera" {
            found.push(chain);
        }
    }
    let mut found = Vec::new();
    for prim in &layer.prims {
        look(prim, &[], &mut found);
    }
    found
}

/// Such as `/root/rig/camera`.
fn path_of(chain: &[&Prim]) -> String {
    chain
        .iter()
        .fold(String::new(), |path, prim| path + "/" + &prim.name)
}

/// By its path, its own name, or that of the prim above it, which Blender calls as its object.
fn choose<'a, 'b>(chains: &'b [Vec<&'a Prim>], name: Option<&str>) -> Result<&'b Vec<&'a Prim>> {
    let names = || chains.iter().map(|chain| path_of(chain)).collect();
    let Some(name) = name else {
        return match chains {
            [] => Err(fault("no prim of it is a Camera")),
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
        (None, _) => Err(CameraFileError::Unknown {
            name: name.to_owned(),
            names: names(),
        }),
    }
}

/// A prim's operations as a point meets them, and whether it takes nothing of the prims above it.
fn operations(prim: &Prim) -> Result<(Vec<Operation>, bool)> {
    let Some(Value::Words(order)) = prim.attributes.get("xformOpOrder") else {
        return Ok((Vec::new(), false));
    };
    let (mut operations, mut resets) = (Vec::new(), false);
    for listed in order {
        if listed == "!resetXformStack!" {
            resets = true;
            operations.clear();
            continue;
        }
        let (name, is_inverse) = match listed.strip_prefix("!invert!") {
            Some(name) => (name, true),
            None => (listed.as_str(), false),
        };
        let of = |what: &str| fault(format!("{listed} of prim {}: {what}", prim.name));
        let kind = name.strip_prefix("xformOp:").unwrap_or_default();
        let kind = kind.split(':').next().unwrap_or_default();
        let mut named = Kind::NAMED.iter();
        let &(_, kind, width) = named
            .find(|(known, ..)| *known == kind)
            .ok_or_else(|| of("not a transform that is known"))?;
        let Some(value) = prim.attributes.get(name) else {
            return Err(of("it has no value"));
        };
        let curve = Curve::of(value, width, kind == Kind::Orient);
        let curve = curve.ok_or_else(|| of(&format!("its values are not {width} numbers each")))?;
        operations.push(Operation {
            kind,
            is_inverse,
            curve,
        });
    }
    operations.reverse();
    Ok((operations, resets))
}

/// A positive number of the layer's metadata.
fn number(layer: &Layer, key: &str, left_out: f64) -> Result<f64> {
    match layer.metadata.get(key) {
        None => Ok(left_out),
        Some(Value::Numbers(numbers)) if numbers.len() == 1 && numbers[0] > 0.0 => Ok(numbers[0]),
        Some(_) => Err(fault(format!("{key} is no positive number"))),
    }
}

fn world(layer: &Layer) -> Result<DMat4> {
    // Centimetres, where a layer says nothing (UsdGeom).
    let metres = number(layer, "metersPerUnit", 0.01)?;
    let up = match layer.metadata.get("upAxis") {
        None => "Y",
        Some(Value::Words(words)) if words.len() == 1 => words[0].as_str(),
        Some(_) => "",
    };
    let turn = match up {
        "Y" => DMat4::IDENTITY,
        "Z" => DMat4::from_rotation_x(-std::f64::consts::FRAC_PI_2),
        other => return Err(fault(format!("upAxis {other:?} is neither Y nor Z"))),
    };
    Ok(turn * DMat4::from_scale(DVec3::splat(metres)))
}

#[cfg(test)]
mod tests;
