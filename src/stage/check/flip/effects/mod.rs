//! Effects' passes on the grid against their twins: a file an effect.

use crate::{
    scene::effects::with_effects,
    solve::{SolveError, trace::Traced},
};

use super::Checker;

macro_rules! checks {
    ($($name:ident),+ $(,)?) => {
        $(mod $name;)+

        /// Compares a pass of an effect that the scene names.
        pub(super) fn compare(checker: &mut Checker<'_>, traced: Traced<'_>) -> Result<(), SolveError> {
            let named = &checker.scene.effects;
            $(
                if let Some(settings) = &named.$name {
                    $name::compare(settings, checker, traced)?;
                }
            )+
            Ok(())
        }
    };
}

with_effects!(checks);
