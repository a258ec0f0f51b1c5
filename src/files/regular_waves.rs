//! Regular waves of finite height: validity of the theory, and resolution by particles.

use super::{
    document::Document,
    seas::{check_spacings, check_steepness},
    speed::check_speed,
};
use swell_domain::motion::{
    Cnoidal, LEAST_CNOIDAL_LENGTH, MADSEN_LIMIT, Motion, NoCnoidal, RegularWaves, Stokes,
};
use swell_scene::{SceneError, waves::HIGHEST, words::shown};

type Result<T> = std::result::Result<T, SceneError>;

/// Builds the second-order motion of the table at `path`.
pub(super) fn stokes(doc: &Document<'_>, path: &str, waves: RegularWaves) -> Result<Motion> {
    check_stokes(doc, path, &waves)?;
    finished(doc, path, Motion::Stokes(Stokes::new(waves)), &waves)
}

/// Checks that second-order theory is valid for the waves.
pub(super) fn check_stokes(doc: &Document<'_>, path: &str, waves: &RegularWaves) -> Result<()> {
    check_height(doc, path, waves)?;
    if waves.ursell() >= MADSEN_LIMIT {
        let problem = format!(
            "waves of {} m and {} s on {} m of water: H L² / h³ is {:.1}, and the second order \
             holds below {MADSEN_LIMIT:.1} (Madsen 1971); kind = \"cnoidal\" makes waves that are \
             longer than {LEAST_CNOIDAL_LENGTH} depths",
            shown(waves.height),
            shown(waves.period),
            shown(waves.depth),
            waves.ursell()
        );
        return Err(doc.fault_of(&format!("{path}.height"), problem));
    }
    Ok(())
}

/// Builds the cnoidal motion of the table at `path`.
pub(super) fn cnoidal(doc: &Document<'_>, path: &str, waves: RegularWaves) -> Result<Motion> {
    check_height(doc, path, &waves)?;
    let motion = Cnoidal::new(waves).map_err(|reason| {
        let (period, depth) = (shown(waves.period), shown(waves.depth));
        let problem = match reason {
            NoCnoidal::Short { least_period } => format!(
                "waves of {period} s on {depth} m of water are shorter than \
                 {LEAST_CNOIDAL_LENGTH} depths, and cnoidal ones have {least_period:.3} s or \
                 more; kind = \"stokes\" makes shorter ones"
            ),
            NoCnoidal::Long { most_period } => format!(
                "no elliptic parameter below 1 fits: at {period} s each crest is a solitary wave; \
                 cnoidal ones have up to {most_period:.3} s"
            ),
        };
        doc.fault_of(&format!("{path}.period"), problem)
    })?;
    finished(doc, path, Motion::Cnoidal(motion), &waves)
}

/// Checks that waves of this height do not break.
fn check_height(doc: &Document<'_>, path: &str, waves: &RegularWaves) -> Result<()> {
    let refuse = |key: &str, problem: String| Err(doc.fault_of(&format!("{path}.{key}"), problem));
    if waves.gravity == 0.0 {
        return refuse("kind", "waves need gravity".to_owned());
    }
    if waves.height > HIGHEST * waves.depth {
        let problem = format!(
            "waves of {} m on {} m of water break: the highest are {HIGHEST} \
             depths high (McCowan 1894)",
            shown(waves.height),
            shown(waves.depth)
        );
        return refuse("height", problem);
    }
    check_steepness(waves.height, waves.period, [waves.depth, waves.gravity])
        .or_else(|problem| refuse("height", problem))
}

/// Checks the speed of the wall and returns the motion.
fn finished(
    doc: &Document<'_>,
    path: &str,
    motion: Motion,
    waves: &RegularWaves,
) -> Result<Motion> {
    check_speed(motion.peak_speed(0.0, waves.ramp + waves.period))
        .map_err(|problem| doc.fault_of_plain(path, problem))?;
    Ok(motion)
}

/// Checks that particles `spacing` metres apart resolve the wavelength.
pub(super) fn check_length(
    doc: &Document<'_>,
    path: &str,
    motion: &Motion,
    spacing: f64,
) -> Result<()> {
    let (waves, length) = match motion {
        Motion::Stokes(stokes) => (stokes.waves(), stokes.wave_length()),
        Motion::Cnoidal(cnoidal) => (cnoidal.waves(), cnoidal.wave_length()),
        _ => return Ok(()),
    };
    check_spacings(
        doc,
        &format!("{path}.period"),
        [waves.period, length, spacing],
    )
}
