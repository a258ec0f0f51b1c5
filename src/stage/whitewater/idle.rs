//! Kill volumes in which no whitewater can end.

use glam::DVec3;

use swell_domain::whitewater::{Kill, KillRoom};
use swell_scene::Scene;

/// Warnings about kill volumes outside the domain, and those that begin after the shot.
pub(super) fn idle_kills(kills: &[Kill], scene: &Scene) -> Vec<String> {
    let domain = scene.domain.moved(scene.origin);
    let mut warnings = Vec::new();
    for (index, kill) in kills.iter().enumerate() {
        let room = match &kill.room {
            KillRoom::Block(block) => Some(*block),
            KillRoom::Mesh(mesh) => mesh.mesh.bounds(),
            KillRoom::Sides(_) => Some(domain),
        };
        let common = room.map_or(DVec3::ZERO, |room| room.intersection(&domain).size());
        if common.min_element() <= 0.0 {
            warnings.push(format!("kill[{index}]: its room is outside the domain"));
        }
        let end = scene.shot.duration();
        let Kill { window, .. } = kill;
        if window.from >= end {
            warnings.push(format!(
                "kill[{index}].from: it begins after {} s, and the shot ends after {end} s",
                window.from
            ));
        }
    }
    warnings
}
