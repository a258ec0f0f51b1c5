//! Tolerances of the scene's forces, which the passes of both solvers share.

use glam::DVec3;

use swell_compare::{rounding::U, tolerance::bounds};
use swell_domain::forces::{Force, ForceField, ForceKind};
use swell_scene::Scene;

bounds! {
    pub(super) PLACE = [reach: "|x|, and the largest coordinate of a room or its mesh's grid, an \
        axis or a point"]
        32.0 * U * reach,
        "differences, a cross product, and an interpolation between nodes whose values differ by \
         no more than their distance";
    pub(super) PUSH = [place: "" PLACE, slope: "Σ strength (3 / core + 1 / fade)",
        strength: "Σ strength"]
        place * slope + 24.0 * U * strength,
        "a law of the distance changes by at most (1 + falloff) strength / core a metre";
    pub(super) EDGE = [place: "" PLACE] place, "the depth in a room with a sharp edge";
}

/// Forces of a step with the rounding bounds of their sum.
pub(super) struct Bounded<'a> {
    field: ForceField<'a>,
    /// Position of the domain's minimum corner, metres.
    corner: DVec3,
    /// Largest coordinate of the forces, metres.
    reach: f64,
    /// See [`PUSH`], 1/s².
    slope: f64,
    /// See [`PUSH`], m/s².
    strength: f64,
}

impl<'a> Bounded<'a> {
    pub(super) fn of(scene: &Scene, field: ForceField<'a>) -> Self {
        let corner = scene.domain.min;
        let (mut reach, mut slope, mut strength) = (0.0f64, 0.0, 0.0);
        for (force, share) in field.acting() {
            let most = share * force.kind.most();
            strength += most;
            slope += most * slope_of(force);
            reach = reach.max(reach_of(force, corner));
        }
        Self {
            field,
            corner,
            reach,
            slope,
            strength,
        }
    }

    /// Returns the acceleration at a position relative to the domain's minimum corner, m/s².
    pub(super) fn at(&self, place: DVec3) -> DVec3 {
        self.field.at(self.corner + place)
    }

    /// Returns Σ strength, m/s².
    pub(super) fn most(&self) -> f64 {
        self.strength
    }

    /// Returns [`PUSH`] at a position; `None` where rounding decides whether it is in a room.
    pub(super) fn error(&self, place: DVec3) -> Option<f64> {
        self.error_about(place, 0.0, 0.0)
    }

    /// Returns [`PUSH`] of positions that err by `off`, no farther than `reach` from `place`,
    /// metres; `None` if a sharp edge of a room may be among them.
    pub(super) fn error_about(&self, place: DVec3, off: f64, reach: f64) -> Option<f64> {
        let off = off + PLACE.of([place.abs().max_element() + reach + self.reach]);
        let is_tie = |force: &Force| match &force.room {
            Some(room) if force.fade == 0.0 => {
                room.depth(self.corner + place).abs() <= EDGE.of([off]) + reach
            }
            _ => false,
        };
        let is_decided = !self.field.acting().any(|(force, _)| is_tie(force));
        is_decided.then(|| PUSH.of([off, self.slope, self.strength]))
    }
}

/// Returns by how much of its strength a force may change a metre, 1/m.
fn slope_of(force: &Force) -> f64 {
    let of_law = match force.kind {
        ForceKind::Acceleration(_) => 0.0,
        ForceKind::Vortex { law, .. } | ForceKind::Attract { law, .. } => 3.0 / law.core,
    };
    match (&force.room, force.fade) {
        (Some(_), fade) if fade > 0.0 => of_law + 1.0 / fade,
        _ => of_law,
    }
}

/// Returns the largest coordinate that a force has on the device, metres.
fn reach_of(force: &Force, corner: DVec3) -> f64 {
    let at = match force.kind {
        ForceKind::Acceleration(_) => 0.0,
        ForceKind::Vortex { at, .. } | ForceKind::Attract { at, .. } => {
            (at - corner).abs().max_element()
        }
    };
    let of_room = force.room.as_ref().map_or(0.0, |room| {
        let bounds = room.bounds().moved(-corner);
        let ends = bounds.min.abs().max(bounds.max.abs()).max_element();
        let grid = room.mesh().map_or(0.0, |mesh| {
            let nodes = mesh.dims.into_iter().max().unwrap_or(0) as f64;
            (mesh.origin - corner).abs().max_element() + mesh.spacing * nodes
        });
        ends.max(grid)
    });
    at.max(of_room)
}
