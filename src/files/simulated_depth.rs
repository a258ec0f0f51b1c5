//! The floor that moves with waves, where a part of their water's depth is simulated.

use std::path::PathBuf;

use glam::DVec3;

use swell_domain::{
    bounds::Bounds, holes::Holes, initial_waves::InitialWave, open_waves::OpenWaves,
    shape::WaveFloor,
};
use swell_scene::{
    PlacedMesh, Placement, SceneError,
    moving_solid::MovingSolid,
    open_waves::Waves,
    start_waves::{KEY, StartWave},
    words::shown,
};

use super::document::Document;

/// Part of the simulated depth that the floor and its motion may take.
const MOST: f64 = 0.5;

/// What the floor has to fit.
pub(super) struct Surroundings<'a> {
    pub(super) domain: &'a Bounds,
    pub(super) gravity: DVec3,
    /// Velocity of the undisturbed water, m/s.
    pub(super) current: DVec3,
    pub(super) spacing: f64,
    /// Waves at the start.
    pub(super) start: &'a [StartWave],
    /// Waves of a generation zone, with their key.
    pub(super) incoming: Option<(&'a str, &'a Waves)>,
}

/// Lays the floor; `None` where all of the water is simulated.
pub(super) fn floor(
    doc: &Document<'_>,
    around: &Surroundings<'_>,
) -> Result<Option<MovingSolid>, SceneError> {
    let gravity = around.gravity.length();
    let key = |path: &str| format!("{path}.simulated_depth");
    let depths = |wave: &StartWave| [wave.depth(), wave.level()];
    let (path, waves): (String, Vec<OpenWaves>) = match (around.start, around.incoming) {
        ([], None) => return Ok(None),
        ([], Some((_, waves))) if waves.simulated_depth().is_none() => return Ok(None),
        ([], Some((zone, waves @ Waves::Focused(_)))) => (key(zone), vec![waves.by(gravity)]),
        ([], Some((zone, _))) => {
            let problem = format!(
                "the floor moves with waves that are on the water from the start: the same waves \
                 in [[{KEY}]] put them there"
            );
            return Err(doc.fault_of(&key(zone), problem));
        }
        ([first, ..], incoming) => {
            let [depth, level] = depths(first);
            let is_cut = level < depth;
            if let Some((zone, incoming)) = incoming
                && (is_cut || incoming.simulated_depth().is_some())
                && [incoming.common()[1], incoming.level()] != [depth, level]
            {
                let problem = format!(
                    "{} m of {} m, and {} m of {} m at {KEY}[0]: one floor is below both",
                    shown(incoming.level()),
                    shown(incoming.common()[1]),
                    shown(level),
                    shown(depth)
                );
                return Err(doc.fault_of(&key(zone), problem));
            }
            if !is_cut {
                return Ok(None);
            }
            let open = around
                .start
                .iter()
                .filter_map(|wave| match wave.at_start(gravity) {
                    InitialWave::Open(waves) => Some(waves),
                    InitialWave::Solitary { .. } => None,
                });
            (key(&format!("{KEY}[0]")), open.collect())
        }
    };
    if around.current != DVec3::ZERO {
        let problem = format!("{path} does not support a current");
        return Err(doc.fault_of("water.current", problem));
    }
    let floor = WaveFloor::new(&waves, around.domain, around.spacing);
    let ([mean, most], level) = (floor.heights(), waves[0].level());
    if mean + most > MOST * level {
        let problem = format!(
            "the water there moves up to {most:.3} m, so that its floor is up to {:.3} m above the \
             domain's, and of {} m half at least must be water",
            mean + most,
            shown(level)
        );
        return Err(doc.fault_of(&path, problem));
    }
    Ok(Some(MovingSolid {
        placed: PlacedMesh {
            file: PathBuf::from("the floor"),
            file_hash: String::new(),
            placement: Placement::default(),
            mesh: floor.mesh(0.0, around.spacing),
            holes: Holes::default(),
            rounding: DVec3::ZERO,
            faults: Vec::new(),
        },
        slide: None,
        turn: None,
        track: None,
        sequence: None,
        body: None,
        floor: Some(floor),
    }))
}
