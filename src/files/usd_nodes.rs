//! Prims of a USD text layer: transforms in the hierarchy and their time samples
//! (UsdGeomXformable).
//!
//! A transform is a list of operations, the last of which applies to the prim first. Numbers are
//! interpolated linearly between time codes and quaternions along arcs, as in OpenUSD; before the
//! first and after the last sample they are constant.

use glam::{DMat4, DQuat, DVec3, DVec4};

use super::usda::{Layer, Prim, Value};
use swell_domain::text;
use swell_scene::rate::Rate;

/// First bytes of a binary layer and of a package.
const BINARY: &[u8] = b"PXR-USDC";
const PACKAGE: &[u8] = b"PK\x03\x04";

/// Metadata by which a prim takes content from elsewhere.
const ARCS: [&str; 5] = [
    "references",
    "payload",
    "inherits",
    "specializes",
    "variantSets",
];

/// The error is a description.
type Result<T> = std::result::Result<T, String>;

/// Transforms of a prim and its ancestors.
#[derive(Clone, Debug)]
pub(super) struct UsdNodes {
    /// From the prim up to the root, each with its operations in the order in which they
    /// apply to a point.
    steps: Vec<Vec<Operation>>,
    rate: Rate,
    /// From the layer's units and up axis to metres with y up.
    world: DMat4,
    metres_per_unit: f64,
}

impl UsdNodes {
    /// Reads the transforms of the last prim of `chain`, which begins at the root of `layer`.
    pub(super) fn read(layer: &Layer, chain: &[&Prim]) -> Result<Self> {
        check_written(chain)?;
        let mut steps = Vec::new();
        for prim in chain.iter().rev() {
            let (operations, resets) = operations(prim)?;
            steps.push(operations);
            if resets {
                break;
            }
        }
        // A layer's default unit is the centimetre (UsdGeom).
        let metres_per_unit = number(layer, "metersPerUnit", 0.01)?;
        Ok(Self {
            steps,
            rate: rate(layer)?,
            world: up(layer)? * DMat4::from_scale(DVec3::splat(metres_per_unit)),
            metres_per_unit,
        })
    }

    /// Returns the time code at a time, seconds.
    pub(super) fn code(&self, seconds: f64) -> f64 {
        seconds * self.rate.codes_per_second
    }

    /// Returns the layer's time codes per second.
    pub(super) fn rate(&self) -> Rate {
        self.rate
    }

    /// Returns the layer's unit of length, metres.
    pub(super) fn metres_per_unit(&self) -> f64 {
        self.metres_per_unit
    }

    /// Returns the transform from the prim to the world, which is in metres with y up.
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

    /// Whether a matrix has samples at several times.
    pub(super) fn has_moving_matrix(&self) -> bool {
        let mut operations = self.steps.iter().flatten();
        operations.any(|it| it.kind == Kind::Transform && it.curve.samples.len() > 1)
    }

    /// Returns the sample times of transforms and of `beside`, seconds.
    pub(super) fn times<'a>(
        &'a self,
        beside: impl Iterator<Item = &'a Curve> + 'a,
    ) -> impl Iterator<Item = f64> + 'a {
        let codes = self.curves(beside).flat_map(Curve::codes);
        codes.map(|code| code / self.rate.codes_per_second)
    }

    /// Returns the sample times of values that change, seconds.
    pub(super) fn times_moved<'a>(
        &'a self,
        beside: impl Iterator<Item = &'a Curve> + 'a,
    ) -> impl Iterator<Item = f64> + 'a {
        let moved = self.curves(beside).filter(|curve| curve.moves());
        let codes = moved.flat_map(Curve::codes);
        codes.map(|code| code / self.rate.codes_per_second)
    }

    fn curves<'a>(
        &'a self,
        beside: impl Iterator<Item = &'a Curve> + 'a,
    ) -> impl Iterator<Item = &'a Curve> + 'a {
        let operations = self.steps.iter().flatten().map(|it| &it.curve);
        operations.chain(beside)
    }
}

/// Follows `SdfLayer::GetTimeCodesPerSecond`: `timeCodesPerSecond`, else `framesPerSecond`, else
/// 24.
fn rate(layer: &Layer) -> Result<Rate> {
    let keys = ["timeCodesPerSecond", "framesPerSecond"];
    let said = (keys.into_iter()).find(|key| layer.metadata.contains_key(*key));
    Ok(Rate {
        codes_per_second: said.map_or(Ok(24.0), |key| number(layer, key, 24.0))?,
        said,
    })
}

/// Whether a file is USD, judged by its first bytes.
pub(super) fn is_usd(bytes: &[u8]) -> bool {
    [b"#usda", BINARY, PACKAGE]
        .iter()
        .any(|begin| bytes.starts_with(begin))
}

/// Reads a text layer. A layer composed of others is rejected with the command that flattens it.
pub(super) fn layer(bytes: &[u8]) -> Result<Layer> {
    if bytes.starts_with(BINARY) {
        return Err(
            "binary USD; write it as text: usdcat shot.usdc -o shot.usda (of OpenUSD; usd-core of \
             Python has it as Usd.Stage.Open(\"shot.usdc\").GetRootLayer().Export(\"shot.usda\"))"
                .to_owned(),
        );
    }
    if bytes.starts_with(PACKAGE) {
        return Err(format!("a USD package; {}", flatten("shot.usdz")));
    }
    let text = text::of(bytes).map_err(|error| error.to_string())?;
    let layer = Layer::read(text)?;
    match layer.metadata.get("subLayers") {
        Some(Value::Words(names)) => Err(format!(
            "it has layers below it, which are not read (subLayers: {}); {}",
            names.join(", "),
            flatten("shot.usda")
        )),
        _ => Ok(layer),
    }
}

/// Describes how to flatten a file into one layer.
fn flatten(file: &str) -> String {
    format!(
        "write all as one layer: usdcat --flatten {file} -o flat.usda (of OpenUSD; usd-core of \
         Python has it as Usd.Stage.Open(\"{file}\").Export(\"flat.usda\"))"
    )
}

/// Returns the metadata key by which a prim takes content from elsewhere.
fn arc(prim: &Prim) -> Option<&'static str> {
    let is_there = |key: &&&str| prim.metadata.contains(**key);
    ARCS.iter().find(is_there).copied()
}

/// Checks that the prims of a chain are fully defined in the layer's own text.
fn check_written(chain: &[&Prim]) -> Result<()> {
    for (depth, prim) in chain.iter().enumerate() {
        if let Some(arc) = arc(prim) {
            let path = path_of(&chain[..=depth]);
            return Err(taken(&path, arc));
        }
    }
    Ok(())
}

fn taken(path: &str, arc: &str) -> String {
    format!(
        "prim {path} takes parts from elsewhere, which are not read ({arc}); {}",
        flatten("shot.usda")
    )
}

/// For a layer in which something was not found, says that it may be where the layer takes prims
/// from; `None` if it takes none.
pub(super) fn elsewhere(layer: &Layer) -> Option<String> {
    let mut all = chains(layer, &|prim| arc(prim).is_some()).into_iter();
    let chain = all.next()?;
    let arc = arc(chain[chain.len() - 1])?;
    Some(taken(&path_of(&chain), arc))
}

/// Returns all wanted prims, each with its ancestors from the root. Descendants come
/// before the prim.
pub(super) fn chains<'a>(
    layer: &'a Layer,
    is_wanted: &dyn Fn(&Prim) -> bool,
) -> Vec<Vec<&'a Prim>> {
    fn look<'a>(
        prim: &'a Prim,
        above: &[&'a Prim],
        is_wanted: &dyn Fn(&Prim) -> bool,
        found: &mut Vec<Vec<&'a Prim>>,
    ) {
        let chain = [above, &[prim]].concat();
        for child in &prim.children {
            look(child, &chain, is_wanted, found);
        }
        if is_wanted(prim) {
            found.push(chain);
        }
    }
    let mut found = Vec::new();
    for prim in &layer.prims {
        look(prim, &[], is_wanted, &mut found);
    }
    found
}

/// Returns a path such as `/root/rig/camera`.
pub(super) fn path_of(chain: &[&Prim]) -> String {
    chain
        .iter()
        .fold(String::new(), |path, prim| path + "/" + &prim.name)
}

/// An operation of a transform.
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
    /// Rotation about these axes in order.
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
                // A single angle, or one per axis.
                let angle = if axes.len() == 1 { of[0] } else { of[axis] };
                DMat4::from_axis_angle(DVec3::AXES[axis], angle.to_radians()) * before
            }),
            Self::Orient => {
                let turn = DQuat::from_xyzw(of[1], of[2], of[3], of[0]);
                DMat4::from_quat(turn.normalize())
            }
            // USD's rows multiply row vectors, so they are columns here.
            Self::Transform => DMat4::from_cols_slice(of),
        }
    }
}

/// Numbers over time.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    /// Samples in ascending order of time codes; a single one for a constant.
    pub(super) samples: Vec<(f64, Vec<f64>)>,
    is_turn: bool,
}

impl Curve {
    fn codes(&self) -> impl Iterator<Item = f64> + '_ {
        self.samples.iter().map(|(code, _)| *code)
    }

    /// Whether its samples differ.
    fn moves(&self) -> bool {
        self.samples.iter().any(|(_, it)| *it != self.samples[0].1)
    }

    /// Returns the value at a time code.
    pub(super) fn at(&self, code: f64) -> Vec<f64> {
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

    /// Reads samples of `width` finite numbers each; `None` for anything else.
    pub(super) fn of(value: &Value, width: usize, is_turn: bool) -> Option<Self> {
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

    /// Whether all its numbers are positive; then so are interpolated ones.
    pub(super) fn is_above_zero(&self) -> bool {
        let numbers = self.samples.iter().flat_map(|(_, numbers)| numbers);
        numbers.into_iter().all(|number| *number > 0.0)
    }

    /// Creates a constant.
    pub(super) fn still(number: f64) -> Self {
        Self {
            samples: vec![(0.0, vec![number])],
            is_turn: false,
        }
    }
}

/// Returns a prim's operations in the order in which they apply to a point, and whether it ignores
/// the transforms of its ancestors.
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
        let of = |what: &str| format!("{listed} of prim {}: {what}", prim.name);
        let kind = name.strip_prefix("xformOp:").unwrap_or_default();
        let kind = kind.split(':').next().unwrap_or_default();
        let mut named = Kind::NAMED.iter();
        let &(_, kind, width) = named
            .find(|(known, ..)| *known == kind)
            .ok_or_else(|| of("not a known transform"))?;
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

/// Returns a positive number of the layer's metadata.
fn number(layer: &Layer, key: &str, left_out: f64) -> Result<f64> {
    match layer.metadata.get(key) {
        None => Ok(left_out),
        Some(Value::Numbers(numbers)) => match numbers[..] {
            [number] if number > 0.0 && number.is_finite() => Ok(number),
            _ => Err(format!("{key} is not a positive number")),
        },
        Some(_) => Err(format!("{key} is not a positive number")),
    }
}

/// Returns the rotation from the layer's up axis to y.
fn up(layer: &Layer) -> Result<DMat4> {
    let up = match layer.metadata.get("upAxis") {
        None => "Y",
        Some(Value::Words(words)) if words.len() == 1 => words[0].as_str(),
        Some(_) => "",
    };
    match up {
        "Y" => Ok(DMat4::IDENTITY),
        "Z" => Ok(DMat4::from_rotation_x(-std::f64::consts::FRAC_PI_2)),
        other => Err(format!("upAxis {other:?} is neither Y nor Z")),
    }
}
