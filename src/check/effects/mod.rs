//! Compares effects' passes with their reference passes: one file per effect, for both solvers.

use swell_scene::effects::with_effects;

use super::{comparison::Comparison, flip::FlipState, pbf::PbfState};

mod zone;

macro_rules! checks {
    ($($name:ident),+ $(,)?) => {
        $(mod $name;)+

        /// Returns the comparisons of passes on PBF's particles.
        pub(super) fn pbf() -> Vec<&'static [Comparison<PbfState>]> {
            vec![$($name::PBF),+]
        }

        /// Returns the comparisons of passes on FLIP's grid and particles.
        pub(super) fn flip() -> Vec<&'static [Comparison<FlipState>]> {
            vec![$($name::FLIP),+]
        }
    };
}

with_effects!(checks);
