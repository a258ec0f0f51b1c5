//! `[[emitter]]` and `[[drain]]`: where water enters and leaves during the shot.

use glam::DVec3;
use toml::{Table, Value};

use super::{
    PlacedMesh, Scene, Shot,
    document::Document,
    error::SceneError,
    fit::fits,
    spec::{BoxSpec, DrainSpec, EmitterSpec, MeshSpec},
    words::{extent, shown},
};
use swell_domain::{
    bounds::Bounds,
    bvh::Bvh,
    mesh::TriangleMesh,
    signed_distance::SignedDistanceError,
    sources::{Drain, Emitter, Shape, Sources, Window, flow, is_long_enough},
};

type Result<T> = std::result::Result<T, SceneError>;

/// Volume of an emitter or a drain.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// A box, metres.
    Block(Bounds),
    /// A closed mesh.
    Mesh(PlacedMesh),
}

impl Region {
    /// Returns the bounding box, metres.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Block(block) => *block,
            Self::Mesh(placed) => placed.mesh.bounds().unwrap_or_default(),
        }
    }

    /// Returns the largest rounding error of the file's coordinates along each axis, metres.
    fn rounding(&self) -> DVec3 {
        match self {
            Self::Block(_) => DVec3::ZERO,
            Self::Mesh(placed) => placed.rounding,
        }
    }

    fn shape(&self, spacing: f64) -> std::result::Result<Shape, SignedDistanceError> {
        match self {
            Self::Block(block) => Ok(Shape::from(*block)),
            Self::Mesh(placed) => Shape::of_mesh(&placed.mesh, spacing),
        }
    }
}

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
type Room<'a> = (
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

fn region(
    doc: &Document<'_>,
    path: &str,
    (min, max, mesh): Room<'_>,
    around: &Around<'_>,
) -> Result<Region> {
    let (region, key) = match (min, max, mesh) {
        (_, _, Some(mesh)) => {
            let path = format!("{path}.mesh");
            let key = format!("{path}.file");
            (Region::Mesh((around.mesh)(&path, mesh)?), key)
        }
        (&Some(min), &Some(max), None) => {
            let block = (around.block)(path, &BoxSpec { min, max })?;
            (Region::Block(block), format!("{path}.max"))
        }
        _ => return Err(doc.fault_of(&format!("{path}.min"), "missing")),
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

fn window(doc: &Document<'_>, path: &str, from: f64, until: Option<f64>) -> Result<Window> {
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

/// Volume of an inflow on FLIP's cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inlet {
    /// First cell whose centre lies in the inflow's bounding box; greater than `high`
    /// if there is none.
    pub low: [u32; 3],
    /// Last such cell.
    pub high: [u32; 3],
    /// Rate at which cells lose excess water, 1/s: by the end of the frame, when the
    /// next water enters.
    pub rate: f64,
}

impl Inlet {
    /// Whether a cell lies in the volume.
    pub fn contains(&self, cell: [u32; 3]) -> bool {
        (0..3).all(|axis| (self.low[axis]..=self.high[axis]).contains(&cell[axis]))
    }
}

/// Largest number of emitters without a level; a shader pass loops over all of them.
pub const MAX_INLETS: usize = 8;

impl Scene {
    /// Returns the emitters without a level, whose water enters at their velocity.
    fn flows(&self) -> impl Iterator<Item = &Emitter<Region>> {
        self.emitters.iter().filter(|it| it.level.is_none())
    }

    /// Whether there are emitters without a level.
    pub fn has_inlets(&self) -> bool {
        self.flows().next().is_some()
    }

    /// Returns the inflow volumes on FLIP's cells in a substep of `length` seconds from `start`.
    pub fn inlets(&self, start: f64, length: f64) -> Vec<Inlet> {
        let (corner, size) = (self.domain.min, self.solver.flip().cell_size);
        let left = self.seconds_left(start, length);
        let inlet = |it: &Emitter<Region>| {
            let bounds = self.entered(it);
            // A cell centre on a face counts as inside.
            let low = ((bounds.min - corner) / size - 0.5 - 1e-6).ceil();
            let high = ((bounds.max - corner) / size - 0.5 + 1e-6).floor();
            let [low, high] = match low.cmple(high).all() {
                true => [low, high].map(|cell| cell.to_array().map(|c| c as u32)),
                false => [[1; 3], [0; 3]],
            };
            Inlet {
                low,
                high,
                rate: 1.0 / left,
            }
        };
        self.flows().map(inlet).collect()
    }

    /// Returns the box that a frame's water occupies when it enters. For a velocity oblique to the
    /// axes it extends beyond the emitter.
    fn entered(&self, flow: &Emitter<Region>) -> Bounds {
        let (bounds, velocity) = (flow.shape.bounds(), flow.velocity);
        let moving = velocity
            .to_array()
            .into_iter()
            .filter(|speed| *speed != 0.0);
        if moving.count() == 1 {
            return bounds;
        }
        let way = velocity * self.shot.frame_seconds();
        Bounds {
            min: (bounds.min + way.min(DVec3::ZERO)).max(self.domain.min),
            max: (bounds.max + way.max(DVec3::ZERO)).min(self.domain.max),
        }
    }

    /// Whether the scene has emitters or drains.
    pub fn has_sources(&self) -> bool {
        !self.emitters.is_empty() || !self.drains.is_empty()
    }

    /// Returns the emitters and drains, which act at the ends of frames.
    ///
    /// # Errors
    /// If the signed distance of a mesh cannot be computed.
    pub fn sources(&self) -> std::result::Result<Sources, SignedDistanceError> {
        let spacing = self.particle_spacing();
        let mut sources = Sources {
            emitters: Vec::new(),
            drains: Vec::new(),
            spacing,
            frames_per_second: self.shot.frames_per_second,
            domain: self.domain,
        };
        for it in &self.emitters {
            let shape = it.shape.shape(spacing)?;
            sources.emitters.push(it.clone().with_shape(shape));
        }
        for it in &self.drains {
            let shape = it.shape.shape(spacing)?;
            sources.drains.push(it.clone().with_shape(shape));
        }
        Ok(sources)
    }

    /// Moves emitters and drains by `way`, metres.
    pub(super) fn carry_sources(&mut self, way: DVec3, carry: &dyn Fn(&mut PlacedMesh, DVec3)) {
        let emitters = self
            .emitters
            .iter_mut()
            .map(|it| (&mut it.shape, &mut it.level));
        let drains = self
            .drains
            .iter_mut()
            .map(|it| (&mut it.shape, &mut it.level));
        for (shape, level) in emitters.chain(drains) {
            match shape {
                Region::Block(block) => *block = block.moved(way),
                Region::Mesh(placed) => carry(placed, way),
            }
            if let Some(level) = level {
                *level += way.y;
            }
        }
    }

    /// Returns the meshes of emitters and drains.
    pub(super) fn source_meshes(&self) -> impl Iterator<Item = &PlacedMesh> {
        let emitters = self.emitters.iter().map(|it| &it.shape);
        let shapes = emitters.chain(self.drains.iter().map(|it| &it.shape));
        shapes.filter_map(|shape| match shape {
            Region::Block(_) => None,
            Region::Mesh(placed) => Some(placed),
        })
    }
}

/// Estimates the number of particles that emitters without a level add during the shot. The number
/// from emitters with a level depends on the water.
pub(super) fn most_entering(emitters: &[Emitter<Region>], spacing: f64, shot: &Shot) -> f64 {
    let flows = emitters.iter().filter(|it| it.level.is_none());
    let volumes = flows.map(|it| {
        let flow = flow(it.shape.bounds().size(), it.velocity, spacing);
        flow * it.window.length(shot.duration())
    });
    volumes.sum::<f64>() / spacing.powi(3)
}

/// Writers for the parts of a source's table.
pub(super) struct Written<'a> {
    pub(super) corners: &'a dyn Fn(&Bounds) -> Table,
    pub(super) mesh: &'a dyn Fn(&PlacedMesh) -> Table,
    pub(super) origin: DVec3,
}

impl Written<'_> {
    pub(super) fn emitter(&self, emitter: &Emitter<Region>) -> Table {
        let velocity = emitter.velocity.to_array();
        let mut rows = self.room(&emitter.shape, emitter.level, emitter.window);
        rows.insert("velocity".to_owned(), numbers(&velocity));
        rows
    }

    pub(super) fn drain(&self, drain: &Drain<Region>) -> Table {
        let mut rows = self.room(&drain.shape, drain.level, drain.window);
        rows.extend(drain.rate.map(|rate| ("rate".to_owned(), rate.into())));
        rows
    }

    fn room(&self, region: &Region, level: Option<f64>, window: Window) -> Table {
        let mut rows = match region {
            Region::Block(block) => (self.corners)(&block.moved(self.origin)),
            Region::Mesh(placed) => {
                Table::from_iter([("mesh".to_owned(), Value::Table((self.mesh)(placed)))])
            }
        };
        rows.insert("from".to_owned(), window.from.into());
        let level = level.map(|level| level + self.origin.y);
        for (name, value) in [("level", level), ("until", window.until)] {
            rows.extend(value.map(|value| (name.to_owned(), value.into())));
        }
        rows
    }
}

fn numbers(of: &[f64]) -> Value {
    Value::Array(of.iter().map(|&x| x.into()).collect())
}
