//! `[[emitter]]` and `[[drain]]`: where water enters and leaves during the shot.

use glam::DVec3;

use super::{
    document::Document,
    fit::fits,
    keys::{BoxSpec, DrainSpec, EmitterSpec, MeshSpec},
};
use swell_domain::{
    bounds::Bounds,
    bvh::Bvh,
    mesh::TriangleMesh,
    sources::{Drain, Emitter, Window, is_long_enough},
};
use swell_scene::{
    PlacedMesh, SceneError, Shot,
    sources::{MAX_INLETS, Region},
    words::{extent, shown},
};

type Result<T> = std::result::Result<T, SceneError>;

/// Parts of the scene that sources are checked against.
pub(super) struct Around<'a> {
    pub(super) domain: &'a Bounds,
    pub(super) shot: &'a Shot,
    /// Gravitational acceleration, m/s².
    pub(super) gravity: DVec3,
    /// Particle spacing, metres.
    pub(super) spacing: f64,
    /// Static solids.
    pub(super) solids: &'a [PlacedMesh],
    /// Reads the mesh of a table, given the table's path and values.
    pub(super) mesh: &'a dyn Fn(&str, &MeshSpec) -> Result<PlacedMesh>,
    /// Reads a box of a table.
    pub(super) block: &'a dyn Fn(&str, &BoxSpec) -> Result<Bounds>,
}

/// Minimum, maximum and mesh of a volume, as written.
pub(super) type Room<'a> = (
    &'a Option<[f64; 3]>,
    &'a Option<[f64; 3]>,
    &'a Option<MeshSpec>,
);

pub(super) fn emitters(
    doc: &Document<'_>,
    specs: &[EmitterSpec],
    around: &Around<'_>,
) -> Result<Vec<Emitter<Region>>> {
    let flows = specs.iter().enumerate();
    let mut flows = flows.filter(|(_, spec)| spec.level.is_none());
    if let Some((index, _)) = flows.nth(MAX_INLETS) {
        let problem = format!("at most {MAX_INLETS} emitters go without a level");
        return Err(doc.fault_of_plain(&format!("emitter[{index}].velocity"), problem));
    }
    let all = specs.iter().enumerate();
    all.map(|(index, spec)| {
        let path = format!("emitter[{index}]");
        let emitter = Emitter {
            shape: region(doc, &path, (&spec.min, &spec.max, &spec.mesh), around)?,
            velocity: DVec3::from_array(spec.velocity),
            level: spec.level,
            window: window(doc, &path, spec.from, spec.until)?,
        };
        check_level(doc, &path, &emitter.shape, emitter.level, around)?;
        check_velocity(doc, &path, &emitter, around)?;
        check_solids(doc, &path, &emitter.shape, around)?;
        Ok(emitter)
    })
    .collect()
}

pub(super) fn drains(
    doc: &Document<'_>,
    specs: &[DrainSpec],
    around: &Around<'_>,
) -> Result<Vec<Drain<Region>>> {
    let all = specs.iter().enumerate();
    all.map(|(index, spec)| {
        let path = format!("drain[{index}]");
        let drain = Drain {
            shape: region(doc, &path, (&spec.min, &spec.max, &spec.mesh), around)?,
            level: spec.level,
            rate: spec.rate,
            window: window(doc, &path, spec.from, spec.until)?,
        };
        check_level(doc, &path, &drain.shape, drain.level, around)?;
        Ok(drain)
    })
    .collect()
}

/// Reads a volume; also returns its key for messages. `None` if the table names none.
pub(super) fn room(
    doc: &Document<'_>,
    path: &str,
    (min, max, mesh): Room<'_>,
    around: &Around<'_>,
) -> Result<Option<(Region, String)>> {
    Ok(Some(match (min, max, mesh) {
        (_, _, Some(mesh)) => {
            let path = format!("{path}.mesh");
            let key = format!("{path}.file");
            (Region::Mesh((around.mesh)(&path, mesh)?), key)
        }
        (&Some(min), &Some(max), None) => {
            let block = (around.block)(path, &BoxSpec { min, max })?;
            (Region::Block(block), format!("{path}.max"))
        }
        (None, None, None) => return Ok(None),
        (Some(_), ..) => return Err(doc.fault_of(&format!("{path}.max"), "missing")),
        (None, Some(_), _) => return Err(doc.fault_of(&format!("{path}.min"), "missing")),
    }))
}

fn region(
    doc: &Document<'_>,
    path: &str,
    (min, max, mesh): Room<'_>,
    around: &Around<'_>,
) -> Result<Region> {
    let Some((region, key)) = room(doc, path, (min, max, mesh), around)? else {
        return Err(doc.fault_of(&format!("{path}.min"), "missing"));
    };
    let (bounds, domain) = (region.bounds(), around.domain);
    let size = bounds.size();
    let most = size + 2.0 * region.rounding();
    if most.min_element() < 0.5 * around.spacing {
        let problem = format!(
            "its volume of {} × {} × {} m is too thin for one layer of particles {} m apart",
            shown(size.x),
            shown(size.y),
            shown(size.z),
            shown(around.spacing)
        );
        return Err(doc.fault_of(&key, problem));
    }
    if fits(&bounds, domain, region.rounding()) {
        return Ok(region);
    }
    let problem = format!(
        "it does not fit: it spans {}, the domain spans {}",
        extent(Some(bounds)),
        extent(Some(*domain))
    );
    Err(doc.fault_of(&key, problem))
}

pub(super) fn window(
    doc: &Document<'_>,
    path: &str,
    from: f64,
    until: Option<f64>,
) -> Result<Window> {
    match until {
        Some(until) if until <= from => {
            let problem = format!("{} s is not after from, {} s", shown(until), shown(from));
            Err(doc.fault_of(&format!("{path}.until"), problem))
        }
        _ => Ok(Window { from, until }),
    }
}

fn check_level(
    doc: &Document<'_>,
    path: &str,
    region: &Region,
    level: Option<f64>,
    around: &Around<'_>,
) -> Result<()> {
    let Some(level) = level else {
        return Ok(());
    };
    let refuse = |problem: String| Err(doc.fault_of(&format!("{path}.level"), problem));
    let gravity = around.gravity;
    if gravity.x != 0.0 || gravity.z != 0.0 || gravity.y >= 0.0 {
        return refuse("a level is a height, and gravity does not act along -y".to_owned());
    }
    let Bounds { min, max } = region.bounds();
    let rounding = region.rounding().y;
    if min.y < level && level <= max.y + rounding {
        return Ok(());
    }
    refuse(format!(
        "{} m is not within its volume, which reaches from {} to {} m",
        shown(level),
        shown(min.y),
        shown(max.y)
    ))
}

fn check_velocity(
    doc: &Document<'_>,
    path: &str,
    emitter: &Emitter<Region>,
    around: &Around<'_>,
) -> Result<()> {
    let refuse = |problem: String| Err(doc.fault_of(&format!("{path}.velocity"), problem));
    if emitter.level.is_some() {
        return Ok(());
    }
    let (size, velocity) = (emitter.shape.bounds().size(), emitter.velocity);
    if velocity == DVec3::ZERO {
        return refuse("water at rest does not enter without a level".to_owned());
    }
    let frame = around.shot.frame_seconds();
    if is_long_enough(size, velocity, frame) {
        return Ok(());
    }
    let way = velocity.abs() * frame;
    refuse(format!(
        "in a frame its water moves {} × {} × {} m, and its volume is {} × {} × {} m: make it \
         longer",
        shown(way.x),
        shown(way.y),
        shown(way.z),
        shown(size.x),
        shown(size.y),
        shown(size.z)
    ))
}

/// Points per axis at which a volume is tested against solids.
const LOOKS: u32 = 5;

/// Rejects an emitter that lies entirely within solids.
fn check_solids(
    doc: &Document<'_>,
    path: &str,
    region: &Region,
    around: &Around<'_>,
) -> Result<()> {
    let Bounds { min, max } = region.bounds();
    let reaches = |mesh: &TriangleMesh| {
        let bounds = mesh.bounds();
        bounds.is_some_and(|b| b.min.cmplt(max).all() && b.max.cmpgt(min).all())
    };
    let meshes = around.solids.iter().map(|placed| &placed.mesh);
    let trees: Vec<Bvh> = meshes.filter(|mesh| reaches(mesh)).map(Bvh::new).collect();
    let looks = (0..LOOKS.pow(3)).map(|n| {
        let cell = [n % LOOKS, n / LOOKS % LOOKS, n / LOOKS.pow(2)];
        let part = cell.map(|i| (f64::from(i) + 0.5) / f64::from(LOOKS));
        min + (max - min) * DVec3::from_array(part)
    });
    let is_covered = |p: DVec3| trees.iter().any(|tree| tree.winding_number(p).abs() > 0.5);
    if trees.is_empty() || !looks.into_iter().all(is_covered) {
        return Ok(());
    }
    let key = match region {
        Region::Block(_) => format!("{path}.min"),
        Region::Mesh(_) => format!("{path}.mesh.file"),
    };
    Err(doc.fault_of(&key, "the emitter lies within a solid"))
}
