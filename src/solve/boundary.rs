//! Uploads of the solids' signed distances and poses to the device. The signed distance stops
//! particles that would tunnel.

use glam::{DQuat, DVec3};

use swell_domain::{
    body::BodyState, boundary::Boundary, pose::Passage, signed_distance::SignedDistance,
};
use swell_gpu::program::Program;
use swell_scene::{Scene, moving_solid::MovingSolid};

use super::{
    buffers::{POSED_SOLIDS, SOLID_DISTANCE, SOLID_GRID},
    params::{PosedSolid, SolidGrid},
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
            solids: boundary.grids().count(),
            ..Self::default()
        }
    }

    /// Number of nodes of all solids' signed-distance grids.
    pub(super) fn solid_nodes(&self) -> usize {
        self.solid_grid.iter().product::<usize>() + self.moving_nodes
    }
}

/// Uploads the signed distances of all solids.
pub(super) fn upload_distance(boundary: &Boundary, program: &Program, scene: &Scene) {
    let mut first = 0;
    for grid in boundary.grids() {
        program.upload(SOLID_DISTANCE, first, &grid.values);
        first += grid.values.len();
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
}

impl Movers {
    pub(super) fn of(boundary: &Boundary, scene: &Scene) -> Option<Self> {
        if boundary.moving.is_empty() {
            return None;
        }
        let identity = DQuat::IDENTITY.as_quat().to_array();
        let mut first = 0;
        let resting = |grid: &SignedDistance| {
            let posed = PosedSolid {
                grid: solid_grid(grid, grid.origin, first),
                centre: three(grid.origin - scene.domain.min),
                reach: grid.reach(grid.origin) as f32,
                back: identity,
                end_back: identity,
                ..PosedSolid::default()
            };
            first += grid.values.len() as u32;
            posed
        };
        let resting = boundary.grids().map(resting).collect();
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
            statics: boundary.grids().count() - boundary.moving.len(),
        })
    }

    /// Returns the number of the first body's grid among the solids'.
    pub(super) fn first_body(&self, scene: &Scene) -> u32 {
        let prescribed = scene.moving_solids.iter().filter(|it| it.is_prescribed());
        (self.statics + prescribed.count()) as u32
    }

    /// Uploads the poses at `start`, with the velocities that take them to their poses `length`
    /// seconds later.
    pub(super) fn upload(
        &self,
        program: &Program,
        scene: &Scene,
        bodies: &[BodyState],
        (start, length): (f64, f64),
    ) {
        let mut posed = self.resting.clone();
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
        for solid in &mut posed {
            (solid.fastest, solid.length) = (fastest as f32, length as f32);
        }
        program.upload(POSED_SOLIDS, 0, &posed);
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
