//! Effects' passes against their twins: a file an effect, for both solvers.

use swell_scene::effects::with_effects;

use super::{engine::Twin, flip::FlipState, pbf::PbfState};

mod zone;

macro_rules! checks {
    ($($name:ident),+ $(,)?) => {
        $(mod $name;)+

        /// Twins of the passes on PBF's particles.
        pub(super) fn pbf() -> Vec<&'static [Twin<PbfState>]> {
            vec![$($name::PBF),+]
        }

        /// Twins of the passes on FLIP's grid.
        pub(super) fn flip() -> Vec<&'static [Twin<FlipState>]> {
            vec![$($name::FLIP),+]
        }
    };
}

with_effects!(checks);
