//! What FLIP's sparse grid offers to effects: face velocities, and dispatches over its cells.

use swell_gpu::{
    buffer::{Buf, Workgroups},
    recording::{Bind, Command, Groups},
};

/// Planes: face velocity, m/s; a closed face holds the velocity of the solid. With the density
/// correction, [`face_displacement`](crate::flip::buffers::face_displacement) follows.
pub const FACE_VELOCITY: Buf<f32> = Buf::new("face_velocity");
/// Indirect dispatch sizes: over cells with water, over cells within reach too, and over each
/// further layer.
pub const GROUPS: Buf<Workgroups> = Buf::new("groups");

/// Index in [`GROUPS`] of dispatches over cells with water.
pub(super) const WET: usize = 0;

/// Index in [`GROUPS`] of dispatches over cells with water or within reach.
pub(super) const ACTIVE: usize = 1;

/// Returns a dispatch over the cells that an entry of [`GROUPS`] counts.
pub(super) fn over_listed(pass: &'static str, size: usize, binds: Vec<Bind>) -> Command {
    Command::Dispatch {
        pass,
        binds,
        groups: Groups::at(&GROUPS, size),
    }
}

/// Returns a dispatch over cells with water or within reach.
pub(super) fn over_cells(pass: &'static str, binds: Vec<Bind>) -> Command {
    over_listed(pass, ACTIVE, binds)
}
