//! Reads the no-slip walls.

use swell_scene::{Method, SceneError, Wall};

use super::{
    document::Document,
    keys::{DomainSpec, WALLS},
};

/// Returns the walls of `domain.walls` or `domain.no_slip` in the order of [`Wall::NAMED`], without
/// those of periodic axes. `has_own` says whether an effect enforces no-slip with either solver.
pub(super) fn build(
    doc: &Document<'_>,
    spec: &DomainSpec,
    (method, has_own): (Method, bool),
    periodic: [bool; 3],
) -> Result<Vec<Wall>, SceneError> {
    let listed = spec.no_slip.as_deref().unwrap_or_default();
    let is_all = spec.walls.as_deref() == Some(WALLS[1]);
    let all = Wall::NAMED.iter().map(|&(_, wall)| wall);
    let walls: Vec<Wall> = all.filter(|wall| is_all || listed.contains(wall)).collect();
    let key = if is_all {
        "domain.walls"
    } else {
        "domain.no_slip"
    };
    if !is_all && walls.len() < listed.len() {
        return Err(doc.fault_of(key, "a wall is listed twice"));
    }
    let is_none = |wall: &Wall| periodic[wall.axis];
    if let Some(wall) = walls.iter().find(|wall| !is_all && is_none(wall)) {
        let problem = format!(
            "there is no wall {}: domain.periodic joins both ends",
            wall.name()
        );
        return Err(doc.fault_of_plain(key, problem));
    }
    let walls: Vec<Wall> = walls.into_iter().filter(|wall| !is_none(wall)).collect();
    if method == Method::Pbf && !has_own && !walls.is_empty() {
        let problem = "solver pbf has only free-slip walls unless an effect resolves them; choose \
            solver.method = \"flip\"";
        return Err(doc.fault_of_plain(key, problem));
    }
    Ok(walls)
}
