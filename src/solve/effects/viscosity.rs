//! Viscosity on the GPU: an implicit solve on FLIP's grid for a viscosity in Pa s, or XSPH on PBF's
//! particles.

use crate::grid::{FACE_VELOCITY, over_cells};
use swell_domain::relaxation::Relaxation;
use swell_gpu::{
    buffer::{Buf, Windows},
    program::Program,
    recording::{Bind, Command},
};
use swell_scene::{Scene, effects::viscosity::Settings};

use super::{Addition, Between, OnDevice, Turns, pass};

/// Velocity change of each particle by XSPH, in sorted order, m/s.
pub const CHANGE: Buf<[f32; 3]> = Buf::new("viscosity_change");

/// Cells: bit field that the solve reads, laid out as in shared/viscous_word.wgsl.
pub const WORD: Buf<u32> = Buf::new("viscous_word");
/// Planes: initial velocities of the solve, m/s.
pub const START: Buf<f32> = Buf::new("viscous_start");
/// Planes: velocities after every other iteration, m/s.
pub const OTHER: Buf<f32> = Buf::new("viscous_other");
/// Planes: velocity change in the last iteration, m/s.
pub const STEP: Buf<f32> = Buf::new("viscous_change");
/// Cells: pressure of the projection before the solve, Pa.
pub const EARLIER: Buf<f32> = Buf::new("viscous_pressure");
/// [`Relaxation::of_iteration`] for the first iteration and for the others.
pub const GAINS: Windows<[f32; 4]> = Windows::new("viscous_gain", "viscous_gains");

/// Shader variable of the velocities that an iteration reads, m/s.
pub const FROM: Buf<f32> = Buf::new("viscous_from");
/// Shader variable of the velocities that an iteration writes, m/s.
pub const TO: Buf<f32> = Buf::new("viscous_to");

const WEIGH: &str = "effects/viscosity_weigh";
const RELAX: &str = "effects/viscosity_relax";
const ADD_PRESSURE: &str = "effects/viscosity_pressure";

pub(super) fn pbf(settings: &Settings, _: &Scene, particles: usize) -> Addition {
    let Some(xsph) = settings.xsph else {
        return Addition::default();
    };
    Addition {
        passes: vec![
            pass("effects/viscosity_gather", &[("XSPH", xsph)]),
            pass("effects/viscosity_apply", &[]),
        ],
        buffers: vec![CHANGE.sized(particles)],
        ..Addition::default()
    }
}

/// XSPH adds no passes: the grid already averages velocities of neighbours, and the PIC fraction
/// takes more of that average.
pub(super) fn flip(settings: &Settings, scene: &Scene, cells: usize) -> Addition {
    if settings.coefficient.is_none() {
        return Addition::default();
    }
    let no_slip = f64::from(scene.no_slip_bits());
    Addition {
        between: Some(Between {
            passes: vec![
                pass(WEIGH, &[("NO_SLIP", no_slip)]),
                pass(RELAX, &[]),
                pass(ADD_PRESSURE, &[]),
            ],
            begin: vec![over_cells(WEIGH, Vec::new()), there(0), back()],
            again: vec![there(1), back()],
            end: vec![over_cells(ADD_PRESSURE, Vec::new())],
        }),
        buffers: vec![
            WORD.sized(cells),
            START.sized(3 * cells),
            OTHER.sized(3 * cells),
            STEP.sized(3 * cells),
            EARLIER.sized(cells),
            GAINS.sized(2),
        ],
        ..Addition::default()
    }
}

/// Returns an iteration from one array of velocities to another.
fn relax(from: &Buf<f32>, to: &Buf<f32>, gains: usize) -> Command {
    let binds = vec![
        Bind::whole("viscous_from", from),
        Bind::whole("viscous_to", to),
        GAINS.bind(gains),
    ];
    over_cells(RELAX, binds)
}

fn there(gains: usize) -> Command {
    relax(&FACE_VELOCITY, &OTHER, gains)
}

fn back() -> Command {
    relax(&OTHER, &FACE_VELOCITY, 1)
}

/// Returns the relaxation of the implicit solve on a FLIP scene's grid.
fn relaxation(settings: &Settings, scene: &Scene, length: f64) -> Option<Relaxation> {
    // PBF's own scene has no grid; the scene of its projection does.
    let flip = scene.solver.flip()?;
    settings.relaxation(length, flip.cell_size, scene.water.rest_density)
}

impl OnDevice for Settings {
    fn upload(&self, program: &Program, scene: &Scene, (_, length): (f64, f64)) {
        if let Some(relaxation) = relaxation(self, scene, length) {
            let gains = [true, false].map(|is_first| relaxation.of_iteration(is_first));
            program.upload_windows(&GAINS, &gains.map(|gains| gains.map(|value| value as f32)));
        }
    }

    fn turns(&self, scene: &Scene, length: f64) -> Option<Turns> {
        let relaxation = relaxation(self, scene, length)?;
        Some(Turns {
            again: relaxation.iterations / 2 - 1,
            is_short: relaxation.is_short,
        })
    }
}
