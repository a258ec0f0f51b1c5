//! Uploads of the solids' signed distances and poses to the device. The signed distance stops
//! particles that would tunnel.

use glam::{DQuat, DVec3};

use swell_domain::{
    body::BodyState, boundary::Boundary, pose::Passage, signed_distance::SignedDistance,
};
use swell_gpu::program::Program;
use swell_scene::Scene;

use super::{
    buffers::{SOLID_DISTANCE, SOLID_GRID, SOLID_GRIDS},
    params::{SolidGrid, SolidGrids},
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
    /// Grids without their poses.
    resting: SolidGrids,
    /// First nodes of the grids in the initial pose, metres, in scene coordinates.
    origins: Vec<DVec3>,
    /// Distance from a solid's reference point to its grid's farthest corner, metres.
    reaches: Vec<f64>,
    /// Index of the first moving solid's grid: 1 if there are static solids, else 0.
    statics: usize,
}

impl Movers {
    pub(super) fn of(boundary: &Boundary, scene: &Scene) -> Option<Self> {
        let mut resting = SolidGrids::default();
        let mut first = 0;
        for (slot, grid) in resting.grids.iter_mut().zip(boundary.grids()) {
            *slot = solid_grid(grid, grid.origin, first);
            first += grid.values.len() as u32;
            resting.count += 1;
        }
        resting.nodes = first;
        let statics = boundary.grids().count() - boundary.moving.len();
        let solids = scene.moving_solids.iter().zip(&boundary.moving);
        (!boundary.moving.is_empty()).then(|| Self {
            resting,
            origins: boundary.grids().map(|grid| grid.origin).collect(),
            reaches: solids
                .map(|(solid, grid)| grid.reach(solid.pose(&[], 0.0).rest))
                .collect(),
            statics,
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
        let mut grids = self.resting;
        grids.length = length as f32;
        let identity = DQuat::IDENTITY.as_quat().to_array();
        for (k, origin) in self.origins.iter().enumerate() {
            grids.centres[k] = four(*origin - scene.domain.min);
            (grids.backs[k], grids.end_backs[k]) = (identity, identity);
        }
        let solids = scene.moving_solids.iter().zip(&self.reaches);
        for ((solid, reach), k) in solids.zip(self.statics..) {
            let Passage {
                start: pose,
                end_turn,
                velocity,
                spin,
                ..
            } = solid.passage(bodies, start, length);
            // A solid that does not rotate may have any reference point: its first node gives the
            // least rounding.
            let rest = match solid.turns() {
                true => pose.rest,
                false => self.origins[k],
            };
            grids.grids[k].origin = (self.origins[k] - rest).as_vec3().to_array();
            grids.centres[k] = four(pose.place(rest) - scene.domain.min);
            grids.velocities[k] = four(velocity);
            grids.spins[k] = four(spin);
            grids.backs[k] = pose.turn.conjugate().as_quat().to_array();
            grids.end_backs[k] = end_turn.conjugate().as_quat().to_array();
            let speed = velocity.length() + spin.length() * reach;
            grids.fastest = grids.fastest.max(speed as f32);
        }
        program.upload(SOLID_GRIDS, 0, &[grids]);
    }
}

fn four(v: DVec3) -> [f32; 4] {
    v.as_vec3().extend(0.0).to_array()
}

fn solid_grid(grid: &SignedDistance, origin: DVec3, first: u32) -> SolidGrid {
    SolidGrid {
        origin: (grid.origin - origin).as_vec3().to_array(),
        spacing: grid.spacing as f32,
        dims: grid.dims.map(|n| n as u32),
        first,
    }
}
