//! Numbers of the FLIP model that the GPU solver and its reference share.

/// Particles keep this part of their spacing from walls and solids; at rest the lattice stands at 0.5.
pub const CONTACT: f64 = 0.1;

/// Displacement cap of a substep over the CFL displacement: what the projection speeds up beyond this is slowed
/// and counted.
pub const CAP: f64 = 2.0;
