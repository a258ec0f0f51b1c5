//! Viscosity: a further part of the velocity that is taken from the grid, which [`Scene::substep_pic_blend`] counts in.
//! On the grid itself nothing is left to do.
//!
//! [`Scene::substep_pic_blend`]: crate::scene::Scene::substep_pic_blend

use super::Acts;
use crate::scene::effects::viscosity::Settings;

impl Acts for Settings {}
