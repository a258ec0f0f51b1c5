//! The density iteration as commands: Jacobi and red/black, fixed or until an error.
//!
//! Red/black (Ribas and Pedrini) corrects one colour from everyone's latest positions, then the other, which
//! sees the corrected first. λ of a colour is computed just before it moves, so an iteration does the work of
//! one Jacobi iteration in four dispatches of half the size, and two that take the corrections over. Measured on a column of 16 × 20 × 16 particles
//! compressed by 3 % (h = 2d, llvmpipe), mean and max density error in % after 4, 16 and 64 iterations
//! (test `red_black_leaves_less_error_than_jacobi`; the schedules that lost are not in the tree):
//!
//! | schedule | 4 | 16 | 64 |
//! |---|---|---|---|
//! | Jacobi | 1.51 / 5.7 | 0.93 / 5.4 | 0.40 / 2.8 |
//! | red/black, λ of all once an iteration (lost) | 1.51 / 5.5 | 0.92 / 5.5 | 0.40 / 3.3 |
//! | red/black, λ of each colour before it moves (this) | 1.45 / 3.9 | 0.88 / 4.8 | 0.36 / 2.4 |
//! | red/black, λ of all before each colour, half as dear again (lost) | 1.46 / 3.8 | 0.87 / 4.6 | 0.36 / 1.9 |
//!
//! The Chebyshev semi-iteration (Wang 2015) goes on from a Jacobi iteration, under-relaxed by 0.7, in the direction of the
//! last step: 1.01 / 4.3 after 4 and 0.59 / 2.8 after 16 on the same column, three dispatches an iteration to red/black's six
//! (test `chebyshev_leaves_less_error_than_red_black`). A particle whose correction opposes its last step starts afresh.
//! Without that it does still better on the column (0.65 / 3.4 and 0.31 / 1.2), but in moving water it flings particles off
//! the surface: 60 m/s in wave-city after 10 frames.
//!
//! Over-relaxation by 1.3 overshoots in deep columns (max error 36 % at 40 layers after 16 iterations).

use std::mem::offset_of;

use crate::{
    params::{IterationControl, Phase},
    plan::{Chunk, Plan},
};
use swell_domain::pbf::chebyshev_factors;
use swell_gpu::recording::{Bind, Command, Groups};
use swell_scene::{Iteration, Pbf, Stop};

use super::buffers::{CONTROL, PHASES, list_of};

/// Takes over what was corrected.
const EXCHANGE: &str = "pbf/exchange";

/// Which particles a dispatch handles.
#[derive(Clone, Copy)]
enum Who {
    All,
    Red,
    Black,
}

/// Builds commands and the phase slots that they refer to.
pub(super) struct Builder<'a> {
    plan: &'a Plan,
    phases: Vec<Phase>,
    /// Of the corrections that are added next.
    acceleration: f32,
}

impl<'a> Builder<'a> {
    pub(super) fn new(plan: &'a Plan) -> Self {
        Self {
            plan,
            phases: Vec::new(),
            acceleration: 1.0,
        }
    }

    /// The phases that commands refer to, by window.
    pub(super) fn into_phases(self) -> Vec<Phase> {
        self.phases
    }

    fn bind_phase(&mut self, phase: Phase) -> Bind {
        let slot = self
            .phases
            .iter()
            .position(|known| *known == phase)
            .unwrap_or_else(|| {
                self.phases.push(phase);
                self.phases.len() - 1
            });
        PHASES.bind(slot)
    }

    fn phase(&self, chunk: Chunk, who: Who) -> Phase {
        let (stride, colour) = match who {
            Who::All => (1, 0),
            Who::Red => (2, 0),
            Who::Black => (2, 1),
        };
        Phase {
            first: chunk.first as u32,
            count: ((chunk.count - colour).div_ceil(stride)) as u32,
            stride: stride as u32,
            colour: colour as u32,
            acceleration: self.acceleration,
        }
    }

    fn pass(&mut self, pass: &'static str, who: Who, out: &mut Vec<Command>, indirect: bool) {
        for (index, &chunk) in self.plan.chunks.iter().enumerate() {
            let phase = self.phase(chunk, who);
            let mut binds = vec![self.bind_phase(phase)];
            if self.plan.has_lists && pass != EXCHANGE {
                binds.push(Bind::whole("neighbor_list", &list_of(index)));
            }
            let groups = match (indirect, who) {
                (false, _) => Groups::Threads(u64::from(phase.count)),
                (true, Who::All) => Groups::within(&CONTROL, offset_of!(IterationControl, all)),
                (true, _) => Groups::within(&CONTROL, offset_of!(IterationControl, colour)),
            };
            out.push(Command::Dispatch {
                pass,
                binds,
                groups,
            });
        }
    }

    /// Corrections of particles from the places of all, taken over once all are known.
    fn correct(&mut self, who: Who, out: &mut Vec<Command>, indirect: bool) {
        self.pass("pbf/compute_delta", who, out, indirect);
        self.pass(EXCHANGE, who, out, indirect);
    }

    /// A pass over all particles, such as one of an effect.
    pub(super) fn over_all(&mut self, pass: &'static str, out: &mut Vec<Command>) {
        self.pass(pass, Who::All, out, false);
    }

    /// Density by a full search over all particles, as they were sorted.
    pub(super) fn measure(&mut self, out: &mut Vec<Command>) {
        let count = self.plan.counts.particles;
        let phase = self.phase(Chunk { first: 0, count }, Who::All);
        let bind = self.bind_phase(phase);
        out.push(Command::with("pbf/measure_density", count, vec![bind]));
    }

    /// All iterations.
    pub(super) fn iterations(&mut self, pbf: &Pbf, out: &mut Vec<Command>) {
        let count = pbf.stop.most_iterations();
        let adaptive = matches!(pbf.stop, Stop::DensityError { .. });
        let factors: Vec<f64> = match pbf.iteration {
            Iteration::Chebyshev => chebyshev_factors(pbf.spectral_radius)
                .take(count as usize)
                .collect(),
            Iteration::Jacobi | Iteration::RedBlack => Vec::new(),
        };
        for k in 0..count {
            let is_first = k == 0;
            // Black λ of the iteration before still hold for red's correction: only the first needs all.
            let lambda = match pbf.iteration {
                Iteration::RedBlack if !is_first => Who::Red,
                _ => Who::All,
            };
            self.pass("pbf/compute_lambda", lambda, out, adaptive);
            if adaptive {
                out.push(Command::over("pbf/sum_error", self.plan.counts.particles));
                out.push(Command::over("pbf/decide", 256));
            }
            match pbf.iteration {
                Iteration::Jacobi => self.correct(Who::All, out, adaptive),
                Iteration::Chebyshev => {
                    self.acceleration = factors[k as usize] as f32;
                    self.correct(Who::All, out, adaptive);
                    self.acceleration = 1.0;
                }
                Iteration::RedBlack => {
                    self.correct(Who::Red, out, adaptive);
                    self.pass("pbf/compute_lambda", Who::Black, out, adaptive);
                    self.correct(Who::Black, out, adaptive);
                }
            }
        }
    }
}
