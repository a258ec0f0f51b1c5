//! Tolerances of the scene's forces, which the passes of both solvers share.

use std::borrow::Cow;

use glam::DVec3;

use swell_compare::{rounding::U, tolerance::bounds};
use swell_domain::forces::{Force, ForceField, ForceKind};
use swell_scene::Scene;

bounds! {
    pub(super) PLACE = [reach: "|x|, and the largest coordinate of what it is compared with"]
        24.0 * U * reach,
        "differences, a cross product, and an interpolation between nodes whose values differ by \
         no more than their distance";
    pub(super) PUSH = [places: "Σ strength (1 + falloff) / core, and over fade, times " PLACE,
        strength: "Σ strength"]
        places + 24.0 * U * strength,
        "a law of the distance changes by at most (1 + falloff) strength / core a metre";
    pub(super) EDGE = [place: "" PLACE] place, "the depth in a room with a sharp edge";
}

/// A force that acts in a step, as its rounding bounds need it.
struct Term<'a> {
    force: &'a Force,
    strength: f64,
    /// Largest change of the law by the distance, 1/s², and largest coordinate of its axis or
    /// point, metres.
    law: [f64; 2],
    /// Largest change at the edge of the room, 1/s², and largest coordinate of the room, metres.
    edge: [f64; 2],
}

/// Forces of a step with the rounding bounds of their sum.
pub(super) struct Bounded<'a> {
    field: ForceField<'a>,
    terms: Vec<Term<'a>>,
    /// Position of the domain's minimum corner, metres.
    corner: DVec3,
}

impl<'a> Bounded<'a> {
    pub(super) fn of(scene: &Scene, field: ForceField<'a>) -> Self {
        let corner = scene.domain.min;
        let term = |(force, kind, share): &(&'a Force, Cow<'_, ForceKind>, f64)| {
            let strength = share * kind.most();
            let fades = force.room.is_some() && force.fade > 0.0;
            let at_edge = if fades { strength / force.fade } else { 0.0 };
            Term {
                force,
                strength,
                law: law(kind, corner).map_or([0.0; 2], |[slope, at]| [share * slope, at]),
                edge: [at_edge, reach(force, corner)],
            }
        };
        Self {
            terms: field.acting().map(term).collect(),
            field,
            corner,
        }
    }

    /// Returns the acceleration at a position relative to the domain's minimum corner, m/s².
    pub(super) fn at(&self, place: DVec3) -> DVec3 {
        self.field.at(self.corner + place)
    }

    /// Returns Σ strength, m/s².
    pub(super) fn most(&self) -> f64 {
        self.terms.iter().map(|term| term.strength).sum()
    }

    /// Returns [`PUSH`] at a position; `None` where rounding decides whether it is in a room.
    pub(super) fn error(&self, place: DVec3) -> Option<f64> {
        self.error_about(place, 0.0, 0.0)
    }

    /// Returns [`PUSH`] of positions that err by `off`, no farther than `reach` from `place`,
    /// metres; `None` if a sharp edge of a room may be among them.
    pub(super) fn error_about(&self, place: DVec3, off: f64, reach: f64) -> Option<f64> {
        let size = place.abs().max_element() + reach;
        let mut places = 0.0;
        for term in &self.terms {
            let [law, edge] = [term.law, term.edge];
            let error = |to: f64| off + PLACE.of([size + to]);
            if let (Some(room), 0.0) = (&term.force.room, term.force.fade)
                && room.depth(self.corner + place).abs() <= EDGE.of([error(edge[1])]) + reach
            {
                return None;
            }
            places += law[0] * error(law[1]) + edge[0] * error(edge[1]);
        }
        Some(PUSH.of([places, self.most()]))
    }
}

/// Returns the largest change of an acceleration by the distance, 1/s², and the largest coordinate
/// of its axis or point, metres; `None` if it is the same everywhere.
fn law(kind: &ForceKind, corner: DVec3) -> Option<[f64; 2]> {
    match kind {
        ForceKind::Acceleration(_) => None,
        ForceKind::Vortex { at, law, .. } | ForceKind::Attract { at, law } => {
            let slope = law.strength.abs() * f64::from(1 + law.falloff) / law.core;
            Some([slope, (*at - corner).abs().max_element()])
        }
        ForceKind::Frame(_, inertia) => {
            let at = (inertia.pivot - corner).abs().max_element();
            Some([inertia.slope(), at])
        }
    }
}

/// Returns the largest coordinate that the room of a force has on the device, metres.
fn reach(force: &Force, corner: DVec3) -> f64 {
    force.room.as_ref().map_or(0.0, |room| {
        let bounds = room.bounds().moved(-corner);
        let ends = bounds.min.abs().max(bounds.max.abs()).max_element();
        let grid = room.mesh().map_or(0.0, |mesh| {
            let nodes = mesh.dims.into_iter().max().unwrap_or(0) as f64;
            (mesh.origin - corner).abs().max_element() + mesh.spacing * nodes
        });
        ends.max(grid)
    })
}
