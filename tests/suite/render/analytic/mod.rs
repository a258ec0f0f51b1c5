//! Pictures of scenes whose light, motion and shape are known in closed form.
//!
//! The expected numbers are computed here in f64 from the laws themselves (Snell, Fresnel,
//! Beer–Lambert, the dispersion of deep water), never by a helper of the renderer. In most scenes
//! the water is a single ball, so large or so near to the camera that its surface, its normal and
//! its thickness are those of a sphere.

mod caustics;
mod devices;
mod filtered;
mod fit;
mod foam;
mod geometry;
mod hidden;
mod lens;
mod light;
mod materials;
mod motion;
mod moving;
mod passing;
mod rays;
mod ripples;
mod sea;
mod sheets;
mod splash;
mod spray;
mod streaks;
pub(super) mod support;
mod surface;
mod volume;
mod water;
mod wet;

pub(crate) use support::{context, spoiled};
