//! Viscosity on the grid (Batty and Bridson 2008). XSPH increases the PIC fraction, which
//! [`FlipScene::substep_pic_blend`] takes into account; on the grid itself it does nothing.
//!
//! [`FlipScene::substep_pic_blend`]: swell_scene::SceneWith::substep_pic_blend

use glam::{DVec2, DVec3};

use super::{
    super::grid::{along, corner, per_cell},
    Acts, FaceInputs,
};
use crate::Timings;
use swell_domain::{
    bricks::{Bricks, CELLS},
    poisson::FLUID,
};
use swell_scene::effects::viscosity::Settings;

/// A face this far behind a wall still counts as in its plane, cells.
const BESIDE: f64 = 0.01;

/// Role of a face in the solve.
#[derive(Clone, Copy, PartialEq)]
enum Face {
    InAir,
    Moves,
    Closed,
}

/// Data of a cell for the solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViscousCell {
    /// Whether the cell is water.
    pub is_water: bool,
    /// Which of its lower faces move.
    pub moves: [bool; 3],
    /// Which of its lower faces have water in both cells.
    pub is_whole: [bool; 3],
    /// The edges through its minimum corner, by the axis of the edge.
    pub edges: [Edge; 3],
}

/// Weights of the stress at an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Edge {
    /// Number of the four cells around the edge that are water; 0 if there is no stress.
    pub water: u32,
    /// Weights in the strain of two velocity differences: of the component along the axis after the
    /// edge's own, and of that along the axis after that.
    pub weight: [u32; 2],
}

impl ViscousCell {
    /// Unpacks the word of shaders/shared/viscous_word.wgsl.
    pub fn of_word(word: u32) -> Self {
        let bit = |place: usize| word >> place & 1 == 1;
        let edge = |axis: usize| {
            let bits = word >> (7 + 7 * axis);
            Edge {
                water: bits & 7,
                weight: [bits >> 3 & 3, bits >> 5 & 3],
            }
        };
        Self {
            is_water: bit(0),
            moves: std::array::from_fn(|axis| bit(1 + axis)),
            is_whole: std::array::from_fn(|axis| bit(4 + axis)),
            edges: std::array::from_fn(edge),
        }
    }

    /// Packs the cell into the word of shaders/shared/viscous_word.wgsl.
    pub fn word(&self) -> u32 {
        let bit = |is: bool, place: usize| u32::from(is) << place;
        let faces =
            (0..3).map(|axis| bit(self.moves[axis], 1 + axis) | bit(self.is_whole[axis], 4 + axis));
        let edge = |(axis, edge): (usize, &Edge)| {
            let [a, b] = edge.weight;
            (edge.water | a << 3 | b << 5) << (7 + 7 * axis)
        };
        let edges = self.edges.iter().enumerate().map(edge);
        faces
            .chain(edges)
            .fold(bit(self.is_water, 0), |word, bits| word | bits)
    }
}

/// Returns `offset` plus a step along an axis.
fn beside(offset: [i32; 3], axis: usize, step: i32) -> [i32; 3] {
    let step = along(axis, step);
    std::array::from_fn(|k| offset[k] + step[k])
}

/// A cell and its surroundings, from which its [`ViscousCell`] is derived.
struct CellSurroundings<'a> {
    water: FaceInputs<'a>,
    element: u32,
    corner: DVec3,
}

impl CellSurroundings<'_> {
    fn near(&self, offset: [i32; 3]) -> u32 {
        self.water.bricks.near(self.element, offset)
    }

    fn is_water(&self, offset: [i32; 3]) -> bool {
        self.water.space.kind[self.near(offset) as usize] == FLUID
    }

    /// Returns the walls that the centre of a lower face lies behind: the minimum and the maximum
    /// walls, by axis.
    fn behind(&self, offset: [i32; 3], axis: usize) -> [glam::BVec3; 2] {
        let offset = DVec3::from_array(offset.map(f64::from));
        let middle = self.corner + offset + 0.5 - 0.5 * DVec3::AXES[axis];
        let cut = &self.water.step.cut;
        [
            middle.cmplt(cut.min - BESIDE),
            middle.cmpgt(cut.max + BESIDE),
        ]
    }

    fn face(&self, offset: [i32; 3], axis: usize) -> Face {
        let element = self.near(offset);
        if element < CELLS {
            // Behind a wall, or far from water.
            let [low, high] = self.behind(offset, axis);
            return if low.any() || high.any() {
                Face::Closed
            } else {
                Face::InAir
            };
        }
        let is_wet = self.is_water(offset) || self.is_water(beside(offset, axis, -1));
        match (self.water.space.open[element as usize][axis] > 0.0, is_wet) {
            (false, _) => Face::Closed,
            (true, true) => Face::Moves,
            (true, false) => Face::InAir,
        }
    }

    /// Returns the weight of the difference of velocities along `axis` over a cell along `across`;
    /// `None` at a free-slip wall.
    fn weight(&self, axis: usize, across: usize) -> Option<u32> {
        let offsets = [[0; 3], beside([0; 3], across, -1)];
        let is_closed = offsets.map(|offset| self.face(offset, axis) == Face::Closed);
        match is_closed {
            [false, false] => Some(1),
            [true, true] => Some(0),
            [_, is_lower] => {
                let [low, high] = self.behind(offsets[usize::from(is_lower)], axis);
                let no_slip = &self.water.model.scene.no_slip;
                let walls = [(low.test(across), false), (high.test(across), true)];
                let is_any = walls.iter().any(|&(is_behind, _)| is_behind);
                let holds = no_slip
                    .iter()
                    .any(|wall| wall.axis == across && walls.contains(&(true, wall.is_max)));
                (!is_any || holds).then_some(2)
            }
        }
    }

    fn edge(&self, axis: usize) -> Edge {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        let (to_a, to_b) = (beside([0; 3], a, -1), beside([0; 3], b, -1));
        let faces = [([0; 3], a), (to_b, a), ([0; 3], b), (to_a, b)];
        let is_free = faces
            .iter()
            .any(|&(offset, axis)| self.face(offset, axis) == Face::InAir);
        match (is_free, self.weight(a, b), self.weight(b, a)) {
            (false, Some(of_a), Some(of_b)) => {
                let cells = [[0; 3], to_a, to_b, beside(to_a, b, -1)];
                Edge {
                    water: cells.iter().filter(|&&cell| self.is_water(cell)).count() as u32,
                    weight: [of_a, of_b],
                }
            }
            _ => Edge::default(),
        }
    }

    fn cell(&self) -> ViscousCell {
        let moves = std::array::from_fn(|axis| self.face([0; 3], axis) == Face::Moves);
        let whole =
            |axis: usize| moves[axis] && self.is_water([0; 3]) && self.is_water(along(axis, -1));
        ViscousCell {
            is_water: self.is_water([0; 3]),
            moves,
            is_whole: std::array::from_fn(whole),
            edges: std::array::from_fn(|axis| self.edge(axis)),
        }
    }
}

/// Determines which faces a viscous solve moves, and the water fraction that weights each stress
/// (effects/viscosity_weigh). Shape (elements).
pub fn viscosity_weigh(water: FaceInputs<'_>) -> Vec<ViscousCell> {
    per_cell(water.bricks, |element| {
        let corner = corner(water.bricks, element);
        CellSurroundings {
            water,
            element,
            corner,
        }
        .cell()
    })
}

/// Returns an edge's contribution to K u and to K's diagonal at the face along `axis` on its upper
/// side along `other`; the edge passes through the minimum corner of the cell at `offset`.
fn stress(
    (bricks, cells): (&Bricks, &[ViscousCell]),
    velocity: &[DVec3],
    element: u32,
    offset: [i32; 3],
    [axis, other]: [usize; 2],
) -> DVec2 {
    let at = |offset| bricks.near(element, offset) as usize;
    let lies = 3 - axis - other;
    let edge = cells[at(offset)].edges[lies];
    let [first, second] = edge.weight.map(f64::from);
    let (own, across) = match axis == (lies + 1) % 3 {
        true => (first, second),
        false => (second, first),
    };
    let difference = |along: usize, over: usize| {
        velocity[at(offset)][along] - velocity[at(beside(offset, over, -1))][along]
    };
    let share = 0.25 * f64::from(edge.water) * own;
    let strain = own * difference(axis, other) + across * difference(other, axis);
    DVec2::new(share * strain, share * own)
}

/// Returns K u and K's diagonal at the lower face along `axis` of a cell.
pub fn stresses(
    (bricks, cells): (&Bricks, &[ViscousCell]),
    velocity: &[DVec3],
    element: u32,
    axis: usize,
) -> DVec2 {
    let at = |offset| bricks.near(element, offset) as usize;
    let of = |offset| velocity[at(offset)][axis];
    let (before, after) = (along(axis, -1), along(axis, 1));
    let water =
        [before, [0; 3]].map(|offset| 2.0 * f64::from(u8::from(cells[at(offset)].is_water)));
    let own = of([0; 3]);
    let mut sum = DVec2::new(
        water[0] * (own - of(before)) + water[1] * (own - of(after)),
        water[0] + water[1],
    );
    for other in [(axis + 1) % 3, (axis + 2) % 3] {
        let both = [[0; 3], along(other, 1)];
        let [lower, upper] =
            both.map(|offset| stress((bricks, cells), velocity, element, offset, [axis, other]));
        sum += DVec2::new(lower.x - upper.x, lower.y + upper.y);
    }
    sum
}

/// Runs an iteration of (M + κ K) u = M u* with the given κ, gain and momentum: returns the
/// velocities and their changes, m/s (effects/viscosity_relax). Shapes (elements).
pub fn viscosity_relax(
    (bricks, cells): (&Bricks, &[ViscousCell]),
    [reach, gain, momentum]: [f64; 3],
    start: &[DVec3],
    (velocity, change): (&[DVec3], &[DVec3]),
) -> (Vec<DVec3>, Vec<DVec3>) {
    let changes = per_cell(bricks, |element| {
        let e = element as usize;
        let of = |axis: usize| {
            if !cells[e].moves[axis] {
                return 0.0;
            }
            let sum = stresses((bricks, cells), velocity, element, axis);
            let mass = if cells[e].is_whole[axis] { 1.0 } else { 0.5 };
            let force = mass * (start[e][axis] - velocity[e][axis]) - reach * sum.x;
            let kept = if momentum == 0.0 {
                0.0
            } else {
                momentum * change[e][axis]
            };
            kept + gain * force / (mass + reach * sum.y)
        };
        DVec3::new(of(0), of(1), of(2))
    });
    let sums = velocity.iter().zip(&changes).map(|(v, change)| v + change);
    (sums.collect(), changes)
}

impl Acts for Settings {
    fn between_projections(
        &self,
        water: FaceInputs<'_>,
        velocity: &mut Vec<DVec3>,
        timings: &mut Timings,
    ) -> bool {
        let model = water.model;
        let density = model.scene.water.rest_density;
        let Some(relaxation) = self.relaxation(water.step.length, model.cell_size(), density)
        else {
            return false;
        };
        let cells = timings.time("effects/viscosity_weigh", || viscosity_weigh(water));
        let start = velocity.clone();
        let mut change = vec![DVec3::ZERO; start.len()];
        timings.time("effects/viscosity_relax", || {
            for n in 0..relaxation.iterations {
                let [reach, gain, momentum, _] = relaxation.of_iteration(n == 0);
                let (grid, by) = ((water.bricks, &cells[..]), [reach, gain, momentum]);
                let last = (&velocity[..], &change[..]);
                (*velocity, change) = viscosity_relax(grid, by, &start, last);
            }
        });
        relaxation.is_short
    }
}
