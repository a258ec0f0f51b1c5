//! Solids that move: a mesh along a direction.

use glam::DVec3;

use super::{
    Method, PlacedMesh, Scene, Shot,
    document::Document,
    error::SceneError,
    motion_spec::MotionSpec,
    wave_maker,
    words::{extent, shown},
};
use crate::domain::{bounds::Bounds, motion::Motion};

/// Most of them in a scene: what a pass looks at, one after the other.
pub const MAX_MOVING_SOLIDS: usize = 7;

/// Least length of a direction, whose length does not count.
const LEAST_DIRECTION: f64 = 1e-6;

type Result<T> = std::result::Result<T, SceneError>;

/// A solid that is carried along a line, without turning.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingSolid {
    /// Where it stands at the start.
    pub placed: PlacedMesh,
    /// As the scene says it; its length does not count.
    pub direction: DVec3,
    /// How far along `direction` it has come, metres.
    pub motion: Motion,
}

impl MovingSolid {
    /// From where it stood at the start to where it stands at time `t`, seconds; metres.
    pub fn displacement(&self, t: f64) -> DVec3 {
        self.motion.displacement(t) * self.direction.normalize()
    }
}

impl Scene {
    /// An upper bound on the speed of walls and solids within `[t0, t1]`, m/s.
    pub fn peak_boundary_speed(&self, t0: f64, t1: f64) -> f64 {
        let makers = self.wave_makers.iter().map(|maker| &maker.motion);
        let motions = makers.chain(self.moving_solids.iter().map(|solid| &solid.motion));
        motions
            .map(|motion| motion.peak_speed(t0, t1))
            .fold(0.0, f64::max)
    }
}

/// Refuses the moving solid whose motion stands at `place` where the chosen solver has none.
pub(super) fn check_method(doc: &Document<'_>, place: &str, method: Method) -> Result<()> {
    match method {
        Method::Flip => Ok(()),
        Method::Pbf => {
            let problem = "solver pbf has no moving solids yet; choose solver.method = \"flip\"";
            Err(doc.fault_of_plain(place, problem))
        }
    }
}

/// Builds the one at `path` from its mesh and its keys.
pub(super) fn build(
    doc: &Document<'_>,
    path: &str,
    placed: PlacedMesh,
    direction: DVec3,
    motion: &MotionSpec,
    around: &wave_maker::Surroundings<'_>,
) -> Result<MovingSolid> {
    let place = format!("{path}.motion");
    let solid = MovingSolid {
        placed,
        direction,
        motion: wave_maker::motion(doc, &place, around.base_dir, motion, around.gravity)?,
    };
    if solid.direction.length() < LEAST_DIRECTION {
        return Err(doc.fault_of(&format!("{path}.direction"), "no direction"));
    }
    check_way(doc, &solid, &place, around.domain, around.shot)?;
    Ok(solid)
}

/// It must come into the domain at some time, and stay within reason: a motion that carries it away for
/// ten domains is a slip of the keyboard.
fn check_way(
    doc: &Document<'_>,
    solid: &MovingSolid,
    place: &str,
    domain: &Bounds,
    shot: &Shot,
) -> Result<()> {
    const FAR: f64 = 10.0;
    let farthest = solid.motion.peak_displacement(shot.duration());
    let size = domain.size().max_element();
    if farthest > FAR * size {
        let problem = format!(
            "within the {} s of the shot the solid moves {} m, and the domain is {} m long",
            shown(shot.duration()),
            shown(farthest),
            shown(size)
        );
        return Err(doc.fault_of(place, problem));
    }
    let way = farthest * solid.direction.normalize();
    let swept = solid.placed.mesh.bounds().map(|b| Bounds {
        min: b.min.min(b.min + way),
        max: b.max.max(b.max + way),
    });
    if swept.is_some_and(|b| b.min.cmplt(domain.max).all() && b.max.cmpgt(domain.min).all()) {
        return Ok(());
    }
    let problem = format!(
        "the solid never comes into the domain: on its way it reaches over {}, the domain over {}",
        extent(swept),
        extent(Some(*domain))
    );
    Err(doc.fault_of(place, problem))
}
