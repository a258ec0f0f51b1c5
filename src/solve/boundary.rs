//! Uploads of the solids' signed distances and poses to the device. The signed distance stops
//! particles that would tunnel.

use glam::{DQuat, DVec3};

use swell_domain::{
    body::BodyState,
    boundary::{Boundary, Shape},
    pose::Passage,
    shape::ShapeField,
    shores::Surface,
    signed_distance::SignedDistance,
};
use swell_gpu::program::Program;
use swell_scene::{Scene, moving_solid::MovingSolid, step::Substep};

use super::{
    buffers::{POSED_SOLIDS, SOLID_DISTANCE, SOLID_GRID, velocities_behind},
    params::{PosedSolid, PosedSolids, SolidGrid},
    plan::Counts,
};

impl Counts {
    /// Counts samples and grid nodes of solids; `particles` and `bricks` stay 0.
    pub fn of_solids(boundary: &Boundary) -> Self {
        Self {
            particles: 0,
            boundary_samples: boundary.sample_count(),
            solid_grid: boundary.distance.as_ref().map_or([0; 3], |grid| grid.dims),
            moving_nodes: boundary.moving.iter().map(|grid| grid.values.len()).sum(),
            shape_nodes: boundary.shape_nodes(),
            ..Self::default()
        }
    }

    /// Number of floats in [`SOLID_DISTANCE`] for all solids' signed-distance grids.
    pub(super) fn solid_floats(&self) -> usize {
        let rigid = self.solid_grid.iter().product::<usize>() + self.moving_nodes;
        rigid + (FLOATS_OF_SHAPE - 1) * self.shape_nodes
    }
}

/// Floats a node of a solid whose shape changes: the distance at the substep's start and that at
/// its end, and a velocity.
pub const FLOATS_OF_SHAPE: usize = 5;

/// Marks a solid whose shape changes, in [`SolidGrid::first`].
const SHAPE: u32 = 1 << 31;

/// Iterates over the grids of all solids, each with its shape if that changes and with the index of
/// its first float in [`SOLID_DISTANCE`].
fn placed(boundary: &Boundary) -> impl Iterator<Item = (&SignedDistance, Option<&Shape>, usize)> {
    let still = boundary.distance.iter().map(|grid| (grid, None));
    let moving = boundary.moving.iter().enumerate();
    let moving = moving.map(|(index, grid)| (grid, boundary.shape(index)));
    let mut next = 0;
    still.chain(moving).map(move |(grid, shape)| {
        let first = next;
        let floats = if shape.is_some() { FLOATS_OF_SHAPE } else { 1 };
        next += floats * grid.values.len();
        (grid, shape, first)
    })
}

/// Uploads the signed distances of all solids.
pub(super) fn upload_distance(boundary: &Boundary, program: &Program, scene: &Scene) {
    for (grid, _, first) in placed(boundary) {
        program.upload(SOLID_DISTANCE, first, &grid.values);
    }
    if let (Some(grid), []) = (&boundary.distance, &boundary.moving[..]) {
        program.upload(SOLID_GRID, 0, &[solid_grid(grid, scene.domain.min, 0)]);
    }
}

/// Poses of solids that move; `None` in a scene without them.
pub(super) struct Movers {
    /// Solids in their initial pose, relative to the domain's minimum corner.
    resting: Vec<PosedSolid>,
    /// First nodes of the grids in the initial pose, metres, in scene coordinates.
    origins: Vec<DVec3>,
    /// Distance from a moving solid's reference point to its grid's farthest corner, metres.
    reaches: Vec<f64>,
    /// Index of the first moving solid's grid: 1 if there are static solids, else 0.
    statics: usize,
    /// Solids whose shape changes, by the index of the moving solid, each with the index of its
    /// first float.
    shapes: Vec<(usize, usize, ShapeField)>,
}

impl Movers {
    pub(super) fn of(boundary: &Boundary, scene: &Scene) -> Option<Self> {
        if boundary.moving.is_empty() {
            return None;
        }
        let identity = DQuat::IDENTITY.as_quat().to_array();
        let resting = |(grid, shape, first): (&SignedDistance, Option<&Shape>, usize)| {
            let mark = if shape.is_some() { SHAPE } else { 0 };
            PosedSolid {
                grid: solid_grid(grid, grid.origin, first as u32 | mark),
                centre: three(grid.origin - scene.domain.min),
                reach: grid.reach(grid.origin) as f32,
                back: identity,
                end_back: identity,
                ..PosedSolid::default()
            }
        };
        let mut resting: Vec<_> = placed(boundary).map(resting).collect();
        let statics = boundary.grids().count() - boundary.moving.len();
        for (solid, &offset) in resting[statics..].iter_mut().zip(&boundary.offsets) {
            solid.offset = offset as f32;
        }
        let shapes = placed(boundary)
            .enumerate()
            .filter_map(|(k, (_, shape, first))| {
                let field = shape?.field.clone();
                Some((k - statics, first, field))
            });
        // A solid that does not rotate may have any reference point: its first node gives the
        // least rounding.
        let solids = scene.moving_solids.iter().zip(&boundary.moving);
        let reach = |(solid, grid): (&MovingSolid, &SignedDistance)| {
            grid.reach(match solid.turns() {
                true => solid.pose(&[], 0.0).rest,
                false => grid.origin,
            })
        };
        Some(Self {
            resting,
            origins: boundary.grids().map(|grid| grid.origin).collect(),
            reaches: solids.map(reach).collect(),
            statics,
            shapes: shapes.collect(),
        })
    }

    /// Returns the number of the first body's grid among the solids'.
    pub(super) fn first_body(&self, scene: &Scene) -> u32 {
        let prescribed = scene.moving_solids.iter().filter(|it| it.is_prescribed());
        (self.statics + prescribed.count()) as u32
    }

    /// Returns where a moving solid is at the start of a substep, if its shape changes; `least` is
    /// the domain's least corner, metres.
    pub(super) fn surface(
        &self,
        index: usize,
        substep: &Substep,
        (least, cell_size): (DVec3, f64),
    ) -> Option<Surface> {
        let (_, _, field) = self.shapes.iter().find(|(of, ..)| *of == index)?;
        let step = field.step(substep.start, substep.length);
        Some(Surface::of(&step.before, least, cell_size))
    }

    /// Uploads the poses at `start`, with the velocities that take them to their poses `length`
    /// seconds later, and the shapes that change within this time.
    pub(super) fn upload(
        &self,
        program: &Program,
        scene: &Scene,
        bodies: &[BodyState],
        (start, length): (f64, f64),
    ) {
        let mut all = PosedSolids {
            count: self.resting.len() as u32,
            length: length as f32,
            ..PosedSolids::default()
        };
        let posed = &mut all.solids[..self.resting.len()];
        posed.copy_from_slice(&self.resting);
        let mut fastest = 0.0f64;
        let solids = scene.moving_solids.iter().zip(&self.reaches);
        for ((solid, reach), k) in solids.zip(self.statics..) {
            let Passage {
                start: pose,
                end_turn,
                velocity,
                spin,
                ..
            } = solid.passage(bodies, start, length);
            let rest = match solid.turns() {
                true => pose.rest,
                false => self.origins[k],
            };
            posed[k] = PosedSolid {
                grid: SolidGrid {
                    origin: three(self.origins[k] - rest),
                    ..posed[k].grid
                },
                centre: three(pose.place(rest) - scene.domain.min),
                reach: *reach as f32,
                velocity: three(velocity),
                spin: three(spin),
                back: pose.turn.conjugate().as_quat().to_array(),
                end_back: end_turn.conjugate().as_quat().to_array(),
                ..posed[k]
            };
            fastest = fastest.max(velocity.length() + spin.length() * reach);
        }
        for (_, first, field) in &self.shapes {
            let step = field.step(start, length);
            let nodes = step.velocity.len();
            program.upload(SOLID_DISTANCE, *first, &step.before.values);
            program.upload(SOLID_DISTANCE, first + nodes, &step.after.values);
            program.upload(velocities_behind(first + 2 * nodes), 0, &step.velocity);
            fastest = fastest.max(step.fastest);
        }
        all.fastest = fastest as f32;
        program.upload(POSED_SOLIDS, 0, &[all]);
    }
}

fn three(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

fn solid_grid(grid: &SignedDistance, origin: DVec3, first: u32) -> SolidGrid {
    SolidGrid {
        origin: (grid.origin - origin).as_vec3().to_array(),
        spacing: grid.spacing as f32,
        dims: grid.dims.map(|n| n as u32),
        first,
    }
}
