//! Sampling.
use glam::DVec3;
/// A sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundarySample {
    /// m
    pub position: DVec3,
    /// unit
    pub normal: DVec3,
    /// m2
    pub area: f64,
}
