//! The density iteration as commands: Jacobi, red/black or Chebyshev, with a fixed count or until a
//! density error.
//!
//! Red/black (Ribas and Pedrini) corrects one colour from the latest positions of all particles,
//! then the other colour, which sees the first one corrected. λ of a colour is computed just before
//! the colour moves, so an iteration does the work of one Jacobi iteration in four dispatches of
//! half the size, plus two that take over the corrections. Mean and maximum density error in %
//! after 4, 16 and 64 iterations, measured on a column of 16 × 20 × 16 particles compressed by 3 %
//! (h = 2d, llvmpipe; test `red_black_leaves_less_error_than_jacobi`; the rejected schedules are
//! not in the code):
//!
//! | schedule | 4 | 16 | 64 |
//! |---|---|---|---|
//! | Jacobi | 1.51 / 5.7 | 0.93 / 5.4 | 0.40 / 2.8 |
//! | red/black, λ of all once per iteration (rejected) | 1.51 / 5.5 | 0.92 / 5.5 | 0.40 / 3.3 |
//! | red/black, λ of each colour before it moves (used) | 1.45 / 3.9 | 0.88 / 4.8 | 0.36 / 2.4 |
//! | red/black, λ of all before each colour, 50 % more work (rejected) | 1.46 / 3.8 | 0.87 / 4.6 |
//! 0.36 / 1.9 |
//!
//! The Chebyshev semi-iteration (Wang 2015) extrapolates a Jacobi iteration, under-relaxed by 0.7,
//! in the direction of the last step: 1.01 / 4.3 after 4 and 0.59 / 2.8 after 16 iterations on the
//! same column, with three dispatches per iteration instead of six (test
//! `chebyshev_leaves_less_error_than_red_black`). A particle whose correction opposes its last step
//! restarts. Without the restart the column converges faster (0.65 / 3.4 and 0.31 / 1.2), but in
//! moving water particles are ejected from the surface: 60 m/s in wave-city after 10 frames.
//!
//! Over-relaxation by 1.3 overshoots in deep columns (maximum error 36 % at 40 layers after 16
//! iterations).

use std::mem::offset_of;

use crate::{
    params::{IterationControl, Phase},
    plan::{Chunk, Plan},
};
use swell_domain::pbf::chebyshev_factors;
use swell_gpu::recording::{Bind, Command, Groups};
use swell_scene::{Iteration, Pbf, Stop};

use super::buffers::{CONTROL, PHASES, list_of};

/// The pass that takes over corrected positions.
const EXCHANGE: &str = "pbf/exchange";

/// Particles that a dispatch handles.
#[derive(Clone, Copy)]
enum Who {
    All,
    Red,
    Black,
}

/// Builds commands and the phase windows that they refer to.
pub(super) struct Builder<'a> {
    plan: &'a Plan,
    phases: Vec<Phase>,
    /// Chebyshev factor of the corrections that are added next.
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

    /// Returns the phases that commands refer to, in the order of their windows.
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

    /// Adds passes that compute corrections from the current positions and then take them over.
    fn correct(&mut self, who: Who, out: &mut Vec<Command>, indirect: bool) {
        self.pass("pbf/compute_delta", who, out, indirect);
        self.pass(EXCHANGE, who, out, indirect);
    }

    /// Adds a pass over all particles, for example one of an effect.
    pub(super) fn over_all(&mut self, pass: &'static str, out: &mut Vec<Command>) {
        self.pass(pass, Who::All, out, false);
    }

    /// Adds the density measurement by a full search over all particles in sorted order.
    pub(super) fn measure(&mut self, out: &mut Vec<Command>) {
        let count = self.plan.counts.particles;
        let phase = self.phase(Chunk { first: 0, count }, Who::All);
        let bind = self.bind_phase(phase);
        out.push(Command::with("pbf/measure_density", count, vec![bind]));
    }

    /// Adds all iterations.
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
            // λ of black particles from the previous iteration is still valid for red's correction:
            // only the first iteration has to compute all.
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
