//! Viscosity: a further part of the velocity that is taken from the grid; it has no pass on it.

use super::Checker;
use crate::{
    scene::effects::viscosity::Settings,
    solve::{SolveError, trace::Traced},
};

pub(super) fn compare(
    _: &Settings,
    _: &mut Checker<'_>,
    _: Traced<'_>,
) -> Result<(), SolveError> {
    Ok(())
}
