//! Viscosity: a further part of the velocity that is taken from the grid, which [`Scene::substep_pic_blend`] counts in.
//! On the grid itself nothing is left to do.
//!
//! [`Scene::substep_pic_blend`]: crate::scene::Scene::substep_pic_blend

use glam::DVec3;

use super::Water;
use crate::{reference::Timings, scene::effects::viscosity::Settings};

pub(super) fn apply(_: &Settings, _: Water<'_>, _: &mut Vec<DVec3>, _: &mut Timings) {}
