//! Random seas and focused wave packets: reading their motion, and checking that the
//! water can carry them.

use std::f64::consts::TAU;

use super::{document::Document, speed::check_speed};
use swell_domain::motion::{
    DEEPEST, MADSEN_LIMIT, Motion, Phases, Sea, SeaParameters, Spectrum, wave_number,
};
use swell_scene::{
    SceneError,
    waves::{self, RAMP, SHORTEST, STEEPEST},
    words::shown,
};

/// Allowed range of that ratio.
const SHORTEST_RANGE: std::ops::RangeInclusive<f64> = 0.1..=0.9;

/// Least wavelength, particle spacings: five cells of FLIP. Of shorter waves little is left
/// after one wavelength.
const LEAST_WAVE: f64 = 10.0;

type Result<T> = std::result::Result<T, SceneError>;

/// Builds the motion of the table at `path`, for a sea or a packet.
pub(super) fn build(doc: &Document<'_>, path: &str, asked: SeaParameters) -> Result<Motion> {
    let refuse = |key: &str, problem: String| Err(doc.fault_of(&format!("{path}.{key}"), problem));
    check_periods(
        doc,
        path,
        [asked.peak_period, asked.shortest_period],
        asked.gravity,
    )?;
    if asked.ramp == 0.0 {
        let problem = "a spectrum's motion is never at rest, so it needs a ramp";
        return Err(doc.fault_of(&format!("{path}.ramp"), problem.to_owned()));
    }
    let (key, height) = match asked.phases {
        Phases::Random {
            significant_height, ..
        } => ("significant_height", significant_height),
        Phases::Focused { height, .. } => ("height", height),
    };
    let water = [asked.depth, asked.gravity];
    match key {
        "significant_height" => check_height(height, asked.peak_period, water),
        _ => check_depth(height, asked.depth),
    }
    .or_else(|problem| refuse(key, problem))?;
    if asked.second_order {
        check_second_order(&asked).or_else(|problem| refuse("second_order", problem))?;
    }
    let sea = Sea::new(asked);
    let whole = sea.asked().ramp + sea.asked().peak_period;
    let motion = Motion::Sea(sea);
    check_speed(motion.peak_speed(0.0, whole))
        .map_err(|problem| doc.fault_of_plain(path, problem))?;
    Ok(motion)
}

/// Checks that second-order theory is valid for the waves and known for the shortest of them.
fn check_second_order(asked: &SeaParameters) -> std::result::Result<(), String> {
    let (depth, gravity) = (asked.depth, asked.gravity);
    let shortest = wave_number(TAU / asked.shortest_period, depth, gravity) * depth;
    if shortest > DEEPEST {
        return Err(format!(
            "waves of {} s on {} m of water have kh = {shortest:.1}, and it is known up to \
             {DEEPEST}; a longer shortest_period has less",
            shown(asked.shortest_period),
            shown(depth)
        ));
    }
    // A packet's trough is no deeper than its crest is high.
    let (height, of) = match asked.phases {
        Phases::Random {
            significant_height, ..
        } => (significant_height, "significant_height"),
        Phases::Focused { height, .. } => (2.0 * height, "twice the height"),
    };
    let length = TAU / wave_number(TAU / asked.peak_period, depth, gravity);
    let ursell = height * length.powi(2) / depth.powi(3);
    if ursell >= MADSEN_LIMIT {
        return Err(format!(
            "H L² / h³ is {ursell:.1} with {of} and the peak's {} s on {} m of water, and the \
             second order holds below {MADSEN_LIMIT:.1} (Madsen 1971)",
            shown(asked.peak_period),
            shown(depth)
        ));
    }
    Ok(())
}

/// Checks the peak period, shortest period and ramp of a spectrum, seconds.
pub(super) fn check_periods(
    doc: &Document<'_>,
    path: &str,
    [peak, shortest]: [f64; 2],
    gravity: f64,
) -> Result<()> {
    let refuse = |key: &str, problem: String| Err(doc.fault_of(&format!("{path}.{key}"), problem));
    if gravity == 0.0 {
        return refuse("kind", "waves need gravity".to_owned());
    }
    // Rounded, because 0.3 s of 3 s is not exactly a tenth.
    let ratio = (shortest / peak * 1e12).round() / 1e12;
    if !SHORTEST_RANGE.contains(&ratio) {
        let problem = format!(
            "{} s is {} of the peak's {} s",
            shown(shortest),
            shown(ratio),
            shown(peak)
        );
        return refuse("shortest_period", problem);
    }
    Ok(())
}

/// Checks that a sea with this significant height and peak period does not break on water of a
/// depth and gravity.
pub(super) fn check_height(
    height: f64,
    peak_period: f64,
    water: [f64; 2],
) -> std::result::Result<(), String> {
    check_depth(height, water[0])?;
    check_steepness(height, peak_period, water)
}

/// Checks that waves are no higher than the water is deep.
pub(super) fn check_depth(height: f64, depth: f64) -> std::result::Result<(), String> {
    if height <= depth {
        return Ok(());
    }
    let (height, depth) = (shown(height), shown(depth));
    Err(format!("waves of {height} m on {depth} m of water"))
}

/// Checks that waves of this height and period do not break on water of a depth and gravity.
pub(super) fn check_steepness(
    height: f64,
    period: f64,
    [depth, gravity]: [f64; 2],
) -> std::result::Result<(), String> {
    let number = wave_number(TAU / period, depth, gravity);
    if height <= STEEPEST * TAU / number * (number * depth).tanh() {
        return Ok(());
    }
    Err(format!(
        "waves of {} s on {} m of water break before they are {} m high (Miche 1944)",
        shown(period),
        shown(depth),
        shown(height)
    ))
}

/// Checks a spectrum's γ, which the Pierson-Moskowitz form does not have.
pub(super) fn shape(
    doc: &Document<'_>,
    path: &str,
    spectrum: Spectrum,
    peak_enhancement: Option<f64>,
) -> Result<(Spectrum, f64)> {
    match (spectrum, peak_enhancement) {
        (Spectrum::PiersonMoskowitz, Some(_)) => {
            let problem = "Pierson and Moskowitz's peak is not raised";
            Err(doc.fault_of(&format!("{path}.peak_enhancement"), problem))
        }
        _ => Ok((
            spectrum,
            waves::peak_enhancement(spectrum, peak_enhancement),
        )),
    }
}

/// Returns the waves of a table with defaults filled in.
pub(super) fn asked(
    (spectrum, peak_enhancement): (Spectrum, f64),
    [peak_period, depth, gravity]: [f64; 3],
    [shortest_period, ramp]: [Option<f64>; 2],
    phases: Phases,
) -> SeaParameters {
    SeaParameters {
        spectrum,
        peak_enhancement,
        peak_period,
        shortest_period: shortest_period.unwrap_or(SHORTEST * peak_period),
        depth,
        gravity,
        ramp: ramp.unwrap_or(RAMP * peak_period),
        phases,
        second_order: false,
    }
}

/// Checks that particles `spacing` metres apart resolve the shortest waves, and that a packet meets
/// within the domain (its far face is `size` metres away) and has enough time to do so.
pub(super) fn check(
    doc: &Document<'_>,
    path: &str,
    sea: &Sea,
    (size, spacing): (f64, f64),
) -> Result<()> {
    let refuse = |key: &str, problem: String| Err(doc.fault_of(&format!("{path}.{key}"), problem));
    let shortest = [
        sea.asked().shortest_period,
        sea.least_wave_length(),
        spacing,
    ];
    check_spacings(doc, &format!("{path}.shortest_period"), shortest)?;
    let Phases::Focused { at, time, .. } = sea.asked().phases else {
        return Ok(());
    };
    if at >= size {
        let problem = format!(
            "{} m from a face that is {} m from the other",
            shown(at),
            shown(size)
        );
        return refuse("at", problem);
    }
    let least = sea.asked().ramp + at / sea.least_group_speed();
    if time < least {
        let problem = format!(
            "its slowest waves, of {:.3} m/s, arrive after {least:.3} s if they leave when the \
             ramp ends",
            sea.least_group_speed()
        );
        return refuse("time", problem);
    }
    Ok(())
}

/// Checks that particles `spacing` metres apart resolve waves of a length; `key` names the waves.
pub(super) fn check_spacings(
    doc: &Document<'_>,
    key: &str,
    [period, length, spacing]: [f64; 3],
) -> Result<()> {
    if length >= LEAST_WAVE * spacing {
        return Ok(());
    }
    let problem = format!(
        "waves of {} s are {length:.3} m long, {:.1} particle spacings; at least {LEAST_WAVE} are \
         needed",
        shown(period),
        length / spacing
    );
    Err(doc.fault_of(key, problem))
}
