//! Studies: what baked frames measure, and the page that shows it.
//!
//! Pure functions from particles to numbers, and from numbers to text; the crate `experiment` runs
//! the studies and writes the files. [`comparison`] sets two solvers side by side, [`stability`]
//! measures hard cases, and [`waves`] measures benchmarks whose answer is known from theory or
//! experiment; [`ship_waves`] fits those behind a body in a current. A sweep finds the [`knee`]
//! and, for the paper's Table 1, the [`convergence_point`]; [`tune`] finds the cheapest settings
//! that keep an error below its limit. [`measure`], [`chart`] and [`page`] serve every kind of
//! study, and [`folder`] names the files that a study leaves.

pub mod chart;
pub mod comparison;
pub mod convergence_point;
pub mod folder;
pub mod knee;
mod least_squares;
pub mod measure;
pub mod page;
pub mod picture;
pub mod raster;
pub mod rgb;
pub mod ship_waves;
pub mod stability;
pub mod tune;
pub mod waves;

pub use swell_domain::statistics::{median, percentile};
