//! Checks of the zones in front of walls, which absorbing and generating zones share.

use swell_scene::{SceneError, effects::zone::Zone, words::shown};

use super::Surroundings;
use crate::document::Document;

/// Largest part of a disturbance that a current may carry through a zone: what a zone of one and a
/// half wave lengths may reflect of a wave's height.
const MOST_LEFT: f64 = 0.05;

/// Rejects a zone whose walls or length do not fit the scene; `effect` is its key.
pub(super) fn check(
    zone: &Zone<'_>,
    doc: &Document<'_>,
    effect: &str,
    around: &Surroundings<'_>,
) -> Result<(), SceneError> {
    let refuse = |problem: String| Err(doc.fault_of(&format!("{effect}.walls"), problem));
    let length = |problem: String| Err(doc.fault_of(&format!("{effect}.length"), problem));
    if zone.walls.is_empty() {
        return refuse("names no wall".to_owned());
    }
    if zone.length < around.least_length {
        let problem = format!(
            "a zone of {} m is shorter than two particle spacings, {} m",
            shown(zone.length),
            shown(around.least_length)
        );
        return length(problem);
    }
    for (index, wall) in zone.walls.iter().enumerate() {
        let name = wall.name();
        if zone.walls[..index].contains(wall) {
            return refuse(format!("{name:?} is listed twice"));
        }
        let through = around.current[wall.axis].abs();
        if around.periodic[wall.axis] && through == 0.0 {
            let problem = "domain.periodic joins both ends, and no current runs through them";
            return refuse(format!("there is no wall {name}: {problem}"));
        }
        if around.wave_makers.iter().any(|maker| maker.wall == *wall) {
            return refuse(format!("the wall {name} is a wave maker's"));
        }
        let room = around.domain.size()[wall.axis];
        if zone.length > room {
            let problem = format!(
                "the domain reaches {} m from the wall {name}, but the zone is {} m long",
                shown(room),
                shown(zone.length)
            );
            return length(problem);
        }
        let left = zone.left(through);
        if left > MOST_LEFT {
            let problem = format!(
                "a current of {} m/s carries {:.0} % of a disturbance through a zone of {} m, and \
                 at most {:.0} % may pass; make the zone longer or the period shorter",
                shown(through),
                100.0 * left,
                shown(zone.length),
                100.0 * MOST_LEFT
            );
            return length(problem);
        }
    }
    Ok(())
}
