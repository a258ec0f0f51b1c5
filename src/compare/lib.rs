//! Comparison of results: pure functions from values to figures. `stage` reads the files and
//! selects what to compare.
//!
//! In every comparison of two results, b is the reference.

pub mod baseline;
pub mod caches;
pub mod deviation;
pub mod frames;
pub mod limits;
#[cfg(feature = "perceptual")]
pub mod perceptual;
#[cfg(not(feature = "perceptual"))]
#[path = "no_perceptual.rs"]
pub mod perceptual;
pub mod pictures;
pub mod rounding;
pub mod spread;
pub mod streams;
pub mod tolerance;

pub use deviation::{ComparedValue, Deviation};
