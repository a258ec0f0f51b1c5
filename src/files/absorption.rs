//! Reads the settings of absorbing wave makers.

use glam::DVec3;

use swell_domain::{
    absorption::{AbsorberParameters, Absorption, MOST_GAIN},
    motion::Motion,
};
use swell_scene::{SceneError, words::shown};

use super::{document::Document, keys::AbsorptionSpec};

/// Reads and checks the table at `path` for a wall normal to `axis`, with frames of `seconds`.
pub(super) fn build(
    doc: &Document<'_>,
    path: &str,
    (spec, axis): (&AbsorptionSpec, usize),
    (gravity, seconds): (DVec3, f64),
) -> Result<Absorption, SceneError> {
    if axis == 1 || gravity.x != 0.0 || gravity.z != 0.0 || gravity.y >= 0.0 {
        let problem = "a wall absorbs by the water's level, so it has to face x or z, and gravity \
            has to point straight down";
        return Err(doc.fault_of_plain(path, problem));
    }
    let absorption = Absorption::new(AbsorberParameters {
        room: spec.room,
        depth: spec.depth,
        period: spec.period,
        gravity: gravity.length(),
    });
    let gain = absorption.gain();
    if gain * seconds > MOST_GAIN {
        let problem = format!(
            "the wall reacts once a frame, and on {} m of water that has to be at least {:.1} \
             times a second; raise shot.frames_per_second",
            shown(spec.depth),
            gain / MOST_GAIN
        );
        return Err(doc.fault_of_plain(path, problem));
    }
    Ok(absorption)
}

/// Rejects a wall that neither moves nor absorbs.
pub(super) fn check_still(
    doc: &Document<'_>,
    path: &str,
    motion: &Motion,
    absorption: Option<&Absorption>,
) -> Result<(), SceneError> {
    match (motion, absorption) {
        (Motion::Still, None) => {
            let problem =
                "a wall that neither makes nor absorbs waves; give it wave_maker.absorption";
            Err(doc.fault_of(&format!("{path}.kind"), problem))
        }
        _ => Ok(()),
    }
}
