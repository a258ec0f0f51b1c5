//! Reads and writes floating bodies.

use glam::{DMat3, DVec3};

use swell_domain::{
    body::{Body, Freedom, MassProperties, Mooring},
    bounds::Bounds,
    bvh::Bvh,
    mesh::TriangleMesh,
};
use swell_scene::{
    PlacedMesh, SceneError,
    moving_solid::{FreeBody, GivenMass, MovingSolid},
    words::{extent, shown_all},
};

use super::{
    axis::Axis,
    document::Document,
    fit::fits,
    keys::{BodySpec, DEGREES, HingeSpec, MeshSpec, MooringSpec},
};

/// Least length of an axis; only its direction matters.
const LEAST_DIRECTION: f64 = 1e-6;

/// Part of a moment of inertia that may exceed the sum of the others by rounding.
const ROUNDING: f64 = 1e-9;

/// Depth to which bodies may overlap at the start, as a part of their size.
const TOUCH: f64 = 1e-6;

type Result<T> = std::result::Result<T, SceneError>;

impl BodySpec {
    /// Returns its mesh at the start.
    pub(super) fn placed(&self) -> MeshSpec {
        MeshSpec {
            file: self.mesh.clone(),
            blake3: self.blake3.clone(),
            translate: self.translate,
            rotate_degrees: self.rotate_degrees,
            scale: self.scale,
        }
    }
}

/// What a body has to fit into.
pub(super) struct Surroundings<'a> {
    pub(super) domain: &'a Bounds,
    pub(super) periodic: [bool; 3],
    pub(super) has_projection: bool,
}

/// Builds the body of number `index`.
pub(super) fn build(
    doc: &Document<'_>,
    index: usize,
    placed: PlacedMesh,
    spec: &BodySpec,
    around: &Surroundings<'_>,
) -> Result<MovingSolid> {
    let path = format!("body[{index}]");
    let at = |key: &str| format!("{path}.{key}");
    if !around.has_projection {
        let problem = "PBF moves bodies with its projection: solver.pbf.grid_projection = true";
        return Err(doc.fault_of_plain(&at("mesh"), problem));
    }
    check_mesh(doc, &at("mesh"), &placed, around.domain)?;
    let body = Body {
        mass: mass(doc, &path, &placed, spec)?,
        velocity: velocity(spec),
        freedom: freedom(doc, &path, spec)?,
        moorings: spec.mooring.iter().map(mooring).collect(),
    };
    check_periodic(doc, &path, &body.freedom, around.periodic)?;
    let away = (placed.mesh.vertices.iter()).map(|x| x.distance(body.mass.centre));
    let free = FreeBody {
        index,
        reach: away.fold(0.0, f64::max),
        body,
        collides: spec.collides,
        given: GivenMass {
            density: spec.density,
            mass: spec.mass,
            centre: spec.centre,
            inertia: spec.inertia,
            spin: spec.spin,
        },
    };
    Ok(MovingSolid {
        placed,
        slide: None,
        turn: None,
        track: None,
        sequence: None,
        body: Some(free),
        floor: None,
    })
}

/// Rejects meshes that have no inside or are not within the domain.
fn check_mesh(doc: &Document<'_>, key: &str, placed: &PlacedMesh, domain: &Bounds) -> Result<()> {
    if !placed.holes.0.is_empty() {
        let problem = format!(
            "the mesh is open, so that its volume is not known: {}",
            placed.holes
        );
        return Err(doc.fault_of(key, problem));
    }
    if placed.mesh.signed_volume() <= 0.0 {
        let problem = "the mesh encloses no volume, or its triangles face inward";
        return Err(doc.fault_of(key, problem));
    }
    let bounds = placed.mesh.bounds();
    if bounds.is_some_and(|b| fits(&b, domain, placed.rounding)) {
        return Ok(());
    }
    let problem = format!(
        "the body does not fit: it spans {}, the domain spans {}",
        extent(bounds),
        extent(Some(*domain))
    );
    Err(doc.fault_of(key, problem))
}

fn mass(
    doc: &Document<'_>,
    path: &str,
    placed: &PlacedMesh,
    spec: &BodySpec,
) -> Result<MassProperties> {
    let unit = MassProperties::of_mesh(&placed.mesh, 1.0);
    let density = match (spec.density, spec.mass) {
        (Some(density), _) => density,
        (None, Some(mass)) => mass / unit.mass,
        (None, None) => {
            let problem = "a body needs its density or its mass";
            return Err(doc.fault_of_plain(&format!("{path}.density"), problem));
        }
    };
    let inertia = match spec.inertia {
        None => unit.inertia * density,
        Some(moments) => {
            let sum: f64 = moments.iter().sum();
            let most = moments.iter().copied().fold(0.0, f64::max);
            if 2.0 * most > sum * (1.0 + ROUNDING) {
                let problem = format!("no body has {}", shown_all(&moments));
                return Err(doc.fault_of(&format!("{path}.inertia"), problem));
            }
            DMat3::from_diagonal(DVec3::from_array(moments))
        }
    };
    Ok(MassProperties {
        mass: spec.mass.unwrap_or(unit.mass * density),
        centre: spec.centre.map_or(unit.centre, DVec3::from_array),
        inertia,
    })
}

fn velocity(spec: &BodySpec) -> [f64; 6] {
    let [x, y, z] = spec.velocity;
    let [a, b, c] = spec.spin.map(f64::to_radians);
    [x, y, z, a, b, c]
}

fn freedom(doc: &Document<'_>, path: &str, spec: &BodySpec) -> Result<Freedom> {
    if let Some(HingeSpec { at, axis }) = spec.hinge {
        let axis = DVec3::from_array(axis);
        if axis.length() < LEAST_DIRECTION {
            return Err(doc.fault_of(&format!("{path}.hinge.axis"), "no direction"));
        }
        return Ok(Freedom::Hinge {
            at: DVec3::from_array(at),
            axis: axis.normalize(),
        });
    }
    let Some(names) = &spec.free else {
        return Ok(Freedom::ALL);
    };
    let key = format!("{path}.free");
    let mut is_free = [false; 6];
    for name in names {
        let place = DEGREES.iter().position(|degree| degree == name);
        let place = place.ok_or_else(|| doc.fault_of(&key, format!("{name:?}")))?;
        if std::mem::replace(&mut is_free[place], true) {
            return Err(doc.fault_of(&key, format!("{name:?} is listed twice")));
        }
    }
    if names.is_empty() {
        let problem = "a body that is free along no axis is a [[solid]]";
        return Err(doc.fault_of(&key, problem));
    }
    let [x, y, z, a, b, c] = is_free;
    Ok(Freedom::Axes {
        along: [x, y, z],
        about: [a, b, c],
    })
}

fn mooring(spec: &MooringSpec) -> Mooring {
    Mooring {
        anchor: DVec3::from_array(spec.anchor),
        at: DVec3::from_array(spec.at),
        length: spec.length,
        stiffness: spec.stiffness,
        damping: spec.damping,
    }
}

/// Rejects bodies that may move along a periodic axis, where they would have to enter again at the
/// other end, or turn about another one, which would part them from their images.
fn check_periodic(
    doc: &Document<'_>,
    path: &str,
    freedom: &Freedom,
    periodic: [bool; 3],
) -> Result<()> {
    for axis in Axis::of(periodic) {
        let k = axis as usize;
        let stays = match *freedom {
            Freedom::Axes { along, about } => {
                !along[k] && (0..3).all(|other| other == k || !about[other])
            }
            Freedom::Hinge { axis, .. } => axis[k].abs() > 1.0 - LEAST_DIRECTION,
        };
        if !stays {
            let problem = format!(
                "the body may move along {0} or turn about another axis, and domain.periodic \
                 names {0}: bodies do not enter again at the other end",
                axis.name()
            );
            return Err(doc.fault_of_plain(&format!("{path}.free"), problem));
        }
    }
    Ok(())
}

/// Rejects bodies that overlap at the start.
pub(super) fn check_apart(doc: &Document<'_>, bodies: &[MovingSolid]) -> Result<()> {
    for (second, body) in bodies.iter().enumerate() {
        for (first, other) in bodies[..second].iter().enumerate() {
            let [a, b] = [body, other].map(|it| &it.placed.mesh);
            let Some(point) = common(a, b).or_else(|| common(b, a)) else {
                continue;
            };
            let problem = format!(
                "overlaps body[{first}] at the start, for example at {}",
                shown_all(&point.to_array().map(|x| (1e6 * x).round() / 1e6))
            );
            return Err(doc.fault_of_plain(&format!("body[{second}].mesh"), problem));
        }
    }
    Ok(())
}

/// Returns a vertex, or the middle of a triangle, of `a` that lies inside `b`, if any does.
fn common(a: &TriangleMesh, b: &TriangleMesh) -> Option<DVec3> {
    let room = b.bounds()?;
    let tree = Bvh::new(b);
    let middles = (0..a.triangles.len()).map(|k| a.corners(k).iter().sum::<DVec3>() / 3.0);
    let mut points = a.vertices.iter().copied().chain(middles);
    // Bodies may touch.
    let depth = TOUCH * room.size().max_element();
    points.find(|&x| {
        let is_inside = room.contains(x) && tree.winding_number(x).abs() > 0.5;
        is_inside && tree.nearest(x, depth).is_none()
    })
}

/// Turns a body back into its keys; `origin` is the scene's.
pub(super) fn written(it: &FreeBody, mesh: MeshSpec, origin: DVec3) -> BodySpec {
    let body = &it.body;
    let [vx, vy, vz, ..] = body.velocity;
    let (free, hinge) = match body.freedom {
        Freedom::Hinge { at, axis } => {
            let (at, axis) = ((at + origin).to_array(), axis.to_array());
            (None, Some(HingeSpec { at, axis }))
        }
        Freedom::Axes { along, about } => {
            let free = along.into_iter().chain(about).zip(DEGREES);
            let names = free.filter(|(is_free, _)| *is_free);
            (Some(names.map(|(_, name)| name.to_owned()).collect()), None)
        }
    };
    let moorings = body.moorings.iter().map(|mooring| MooringSpec {
        anchor: (mooring.anchor + origin).to_array(),
        at: (mooring.at + origin).to_array(),
        length: mooring.length,
        stiffness: mooring.stiffness,
        damping: mooring.damping,
    });
    BodySpec {
        mesh: mesh.file,
        blake3: mesh.blake3,
        translate: mesh.translate,
        rotate_degrees: mesh.rotate_degrees,
        scale: mesh.scale,
        density: it.given.density,
        mass: it.given.mass,
        centre: it.given.centre,
        inertia: it.given.inertia,
        velocity: [vx, vy, vz],
        spin: it.given.spin,
        free,
        hinge,
        mooring: moorings.collect(),
        collides: it.collides,
    }
}
