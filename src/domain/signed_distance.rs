//! Signed distance.
use glam::DVec3;
/// Grid.
#[derive(Clone, Debug, PartialEq)]
pub struct SignedDistance {
    /// m
    pub origin: DVec3,
    /// m
    pub spacing: f64,
    /// nodes
    pub dims: [usize; 3],
    /// m
    pub values: Vec<f32>,
}
