//! Tests of scenes' methods that need a scene from a file.

mod absorption;
mod band;
mod body;
mod budget;
mod current;
mod generation_zone;
mod lint;
mod lint_solids;
mod lint_water;
mod origin;
mod simulated_depth;
mod start_waves;
mod step;
