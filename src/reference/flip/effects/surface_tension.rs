//! Surface tension: the pressure jump at the surface, applied to the faces that it crosses.

use glam::{DMat3, DVec2, DVec3};

use super::{
    super::{
        Model, OpenSpace,
        grid::{along, neighborhood, per_cell},
    },
    Acts, FaceInputs,
};
use crate::Timings;
use swell_domain::{
    bricks::{Bricks, CELLS},
    poisson::{AIR, Cells, FLUID, SOLID},
};
use swell_scene::effects::surface_tension::Settings;

/// Gradients of the water fraction, per cell, below which there is no reliable direction.
pub const LEAST_SLOPE: f64 = 1e-3;

/// Largest distance over which κ is extrapolated along the normal, cells.
pub const FARTHEST: f64 = 2.0;

/// Half the variance along an axis of three binomial filters, 1/2 each, and of the hat function,
/// 1/6; in cells².
pub const SHIFT: f64 = (3.0 / 2.0 + 1.0 / 6.0) / 2.0;

/// κ Δx of a drop with a radius of two cells: the grid does not resolve smaller ones.
pub const MOST: f64 = 1.0;

/// If the water fraction is flatter than this on both sides of a face, κ is unknown.
pub const LEAST_WEIGHT: f64 = 1e-6;

/// Returns the elements of the 27 cells around one, x fastest; walls and solids mirror the cells in
/// front of them.
pub fn mirrored(model: &Model, bricks: &Bricks, kind: &[u32], element: u32) -> [u32; 27] {
    let cell = bricks.cell(element);
    let is_solid = |other: u32| other >= CELLS && kind[other as usize] == SOLID;
    let is_closed = |axis: usize, step: i32| {
        let there = i64::from(cell[axis]) + i64::from(step);
        let is_inside =
            model.scene.periodic[axis] || (0..i64::from(model.cells[axis])).contains(&there);
        // Beyond the upper faces along the other axes everything is closed as well.
        let is_behind = |k: usize| !model.scene.periodic[k] && cell[k] >= model.cells[k];
        let is_beyond = (0..3).any(|k| k != axis && is_behind(k));
        !is_inside || is_beyond || is_solid(bricks.near(element, along(axis, step)))
    };
    let closed = [0, 1, 2].map(|axis| [is_closed(axis, -1), is_closed(axis, 1)]);
    let mut elements = [element; 27];
    for (place, offset) in elements.iter_mut().zip(neighborhood()) {
        let kept = [0, 1, 2].map(|axis| match offset[axis] {
            -1 if closed[axis][0] => 0,
            1 if closed[axis][1] => 0,
            step => step,
        });
        let found = bricks.near(element, kept);
        *place = if is_solid(found) { element } else { found };
    }
    elements
}

/// Applies the binomial filter (1 2 1)³ / 64 once. Shapes (elements).
pub fn smooth(model: &Model, bricks: &Bricks, kind: &[u32], share: &[f64]) -> Vec<f64> {
    per_cell(bricks, |element| {
        let weight = |step: i32| if step == 0 { 0.5 } else { 0.25 };
        let about = mirrored(model, bricks, kind, element).into_iter();
        let terms = about.zip(neighborhood()).map(|(other, offset)| {
            let part: f64 = offset.into_iter().map(weight).product();
            part * share[other as usize]
        });
        terms.sum()
    })
}

/// Returns the water fraction around cell centres, smoothed for the first time
/// (effects/tension_share).
pub fn first_share(model: &Model, bricks: &Bricks, kind: &[u32], density: &[f64]) -> Vec<f64> {
    let share: Vec<f64> = density.iter().map(|rho| rho.clamp(0.0, 1.0)).collect();
    smooth(model, bricks, kind, &share)
}

/// Derivatives of the smoothed water fraction around a cell; lengths in cells.
#[derive(Clone, Copy, Debug)]
pub struct Curvature {
    /// Gradients at the eight corners.
    pub corners: [DVec3; 8],
    /// −∇·n of the level set through the cell's centre.
    pub bend: f64,
    /// |∇n|².
    pub squares: f64,
    /// |∇s| at the centre.
    pub steep: f64,
    /// Signed distance of the centre from the level 1/2, positive outside the water.
    pub off: f64,
}

impl Curvature {
    /// Computes the derivatives from the water fractions of 27 cells, x fastest.
    pub fn of(shares: &[f64; 27]) -> Self {
        let places = [0, 1, 2, 3, 4, 5, 6, 7].map(|c: usize| [c & 1, c >> 1 & 1, c >> 2]);
        let corners = places.map(|at| {
            let mut slope = DVec3::ZERO;
            for near in places {
                let k = (at[0] + near[0]) + 3 * (at[1] + near[1]) + 9 * (at[2] + near[2]);
                let side = near.map(|up| if up == 1 { 0.25 } else { -0.25 });
                slope += shares[k] * DVec3::from_array(side);
            }
            slope
        });
        let mut turns = DMat3::ZERO;
        for (at, slope) in places.into_iter().zip(corners) {
            let normal = slope / slope.length().max(LEAST_SLOPE);
            let side = at.map(|up| if up == 1 { 0.25 } else { -0.25 });
            turns += DMat3::from_cols(side[0] * normal, side[1] * normal, side[2] * normal);
        }
        let steep = (corners.into_iter().sum::<DVec3>() / 8.0).length();
        Self {
            corners,
            bend: -(turns.x_axis.x + turns.y_axis.y + turns.z_axis.z),
            squares: turns.to_cols_array().map(|turn| turn * turn).iter().sum(),
            steep,
            off: ((0.5 - shares[13]) / steep.max(LEAST_SLOPE)).clamp(-FARTHEST, FARTHEST),
        }
    }

    /// Returns κ Δx of the surface: that of the level set, extrapolated along the normal.
    pub fn curvature(&self) -> f64 {
        (self.bend + (self.off - SHIFT * self.bend) * self.squares).clamp(-MOST, MOST)
    }
}

/// Returns the derivatives at a cell; `None` where the water fraction is 0.
pub fn bent(
    model: &Model,
    bricks: &Bricks,
    kind: &[u32],
    share: &[f64],
    element: u32,
) -> Option<Curvature> {
    let about = || mirrored(model, bricks, kind, element).map(|other| share[other as usize]);
    (share[element as usize] > 0.0).then(|| Curvature::of(&about()))
}

/// Returns κ Δx of the surface near each cell, and the gradient of the water fraction there, per
/// cell (effects/tension_curvature). Shapes (elements).
pub fn curvature(model: &Model, bricks: &Bricks, kind: &[u32], share: &[f64]) -> Vec<DVec2> {
    per_cell(bricks, |element| {
        let bent = bent(model, bricks, kind, share, element);
        bent.map_or(DVec2::ZERO, |bent| DVec2::new(bent.curvature(), bent.steep))
    })
}

/// Returns κ Δx at the surface between a cell of water and one of air, and the total weight of its
/// two parts.
pub fn between(curvature: &[DVec2], theta: f64, water: u32, air: u32) -> (f64, f64) {
    let (inside, outside) = (curvature[water as usize], curvature[air as usize]);
    let part = theta.min(1.0);
    let weights = [(1.0 - part) * inside.y, part * outside.y];
    let sum = weights[0] * inside.x + weights[1] * outside.x;
    let weight = weights[0] + weights[1];
    (sum / weight.max(LEAST_WEIGHT), weight)
}

/// Returns the cells of water and of air on both sides of a lower face, in this order, if the
/// surface crosses it.
pub fn sides(bricks: &Bricks, space: &OpenSpace, element: u32, axis: usize) -> Option<[u32; 2]> {
    let before = bricks.near(element, along(axis, -1));
    let is_open = space.open[element as usize][axis] > 0.0;
    match [element, before].map(|e| space.kind[e as usize]) {
        [FLUID, AIR] if is_open => Some([element, before]),
        [AIR, FLUID] if is_open => Some([before, element]),
        _ => None,
    }
}

/// Returns the face velocities, m/s, after the pressure jump σ κ has acted against the air for a
/// step of `seconds` (effects/tension_push): Δt σ κ / (ρ θ Δx). The projection then finds a
/// pressure that includes the jump (Kang, Fedkiw and Liu 2000). `tension` is σ / ρ, m³/s².
pub fn push(
    (model, tension, seconds): (&Model, f64, f64),
    bricks: &Bricks,
    space: &OpenSpace,
    distance: Option<&[f64]>,
    curvature: &[DVec2],
    velocity: &[DVec3],
) -> Vec<DVec3> {
    let scale = seconds * tension / model.cell_size().powi(2);
    let cells = Cells {
        bricks,
        kind: &space.kind,
        open: &[],
        distance,
    };
    per_cell(bricks, |element| {
        let mut pushed = velocity[element as usize];
        for axis in 0..3 {
            let Some([water, air]) = sides(bricks, space, element, axis) else {
                continue;
            };
            let theta = cells.theta(water, air);
            let jump = scale * between(curvature, theta, water, air).0 / theta;
            pushed[axis] += if water == element { jump } else { -jump };
        }
        pushed
    })
}

impl Acts for Settings {
    fn on_faces(&self, water: FaceInputs<'_>, velocity: &mut Vec<DVec3>, timings: &mut Timings) {
        let FaceInputs {
            model,
            step,
            bricks,
            space,
            centers,
            ..
        } = water;
        let kind = &space.kind;
        let smooth = |share: &[f64]| smooth(model, bricks, kind, share);
        let share = timings.time("effects/tension_share", || {
            first_share(model, bricks, kind, &centers.density)
        });
        let share = timings.time("effects/tension_smooth", || smooth(&share));
        let share = timings.time("effects/tension_smooth_again", || smooth(&share));
        let curvature = timings.time("effects/tension_curvature", || {
            curvature(model, bricks, kind, &share)
        });
        *velocity = timings.time("effects/tension_push", || {
            let tension = self.coefficient / model.scene.water.rest_density;
            let distance = model.has_ghost_fluid().then_some(&centers.distance[..]);
            let step = (model, tension, step.kick);
            push(step, bricks, space, distance, &curvature, velocity)
        });
    }
}
