//! Studies: what baked frames measure, and the page that shows it.
//!
//! Pure functions from particles to numbers, and from numbers to text; `experiment` runs what is measured and writes the
//! files. [`comparison`] sets two solvers side by side; [`stability`] measures what is hard on a solver, [`waves`] what theory and
//! experiments know the answer to; a sweep finds the [`knee`] and, for the paper's Table 1, the [`convergence_point`]; [`tune`] finds
//! the cheapest settings that hold an error. [`measure`], [`chart`] and [`page`] serve every kind. What is looked at frame by
//! frame has a [`player`], a [`sheet`] and an [`apng`]. [`folder`] names what a study leaves.

pub mod apng;
pub mod chart;
pub mod comparison;
pub mod convergence_point;
pub mod folder;
pub mod knee;
pub mod measure;
pub mod page;
pub mod picture;
pub mod player;
pub mod points;
pub mod raster;
pub mod rgb;
pub mod sheet;
pub mod stability;
pub mod tune;
pub mod waves;

pub use swell_domain::statistics::{median, percentile};
