//! Mirrors of the room's WGSL structs.

use swell_gpu::buffer::mirror;

mirror!(
    /// `PressurePhase` of shared/pressure_phase.wgsl.
    PressurePhase {
        /// Which of `levels`.
        level: u32,
        /// The coarsest one.
        last_level: u32,
        /// Of 2³ blocks.
        colour: u32,
        /// What `pressure/reduce` decides; whether `pressure/center` notes the mean.
        step: u32,
        /// Sums that `pressure/reduce` adds up.
        sum_count: u32,
        /// Of a plane.
        stride: u32,
        /// Of a solve.
        max_iterations: u32,
        /// Whether the pockets are known.
        has_pockets: u32,
        /// Of the relative residual.
        tolerance_square: f32,
        /// Δx.
        cell_size: f32,
        /// ρ Δx / Δt.
        pressure_scale: f32,
        /// 0.
        opaque_zero: u32,
        /// First slot, bricks, active bricks (of the finest level), 0.
        levels: [[u32; 4]; super::LEVELS],
    }
);

macro_rules! control {
    ($(#[$meta:meta])* $name:ident, $real:ty) => {
        mirror!(
            $(#[$meta])*
            $name as "PressureControl" {
                /// 0 iterating, 1 verifying, 2 done, 3 wants pockets.
                state: u32,
                /// So far.
                iterations: u32,
                /// Whether the next direction starts afresh.
                is_first: u32,
                /// Verifications.
                restarts: u32,
                /// ‖b‖².
                rhs_square: $real,
                /// ‖r‖².
                residual_square: $real,
                /// Residual · correction.
                product: $real,
                /// Length of the step.
                alpha: $real,
                /// Part of the last direction.
                beta: $real,
            }
        );
    };
}

control!(
    /// `PressureControl` of shared/pressure_control.wgsl.
    PressureControl,
    f32
);

control!(
    /// The same where the solve is in f64.
    PressureControl64,
    f64
);

impl From<PressureControl> for PressureControl64 {
    fn from(narrow: PressureControl) -> Self {
        Self {
            state: narrow.state,
            iterations: narrow.iterations,
            is_first: narrow.is_first,
            restarts: narrow.restarts,
            rhs_square: narrow.rhs_square.into(),
            residual_square: narrow.residual_square.into(),
            product: narrow.product.into(),
            alpha: narrow.alpha.into(),
            beta: narrow.beta.into(),
        }
    }
}

impl PressureControl64 {
    /// ‖r‖ / ‖b‖; 0 where b = 0.
    pub fn residual(&self) -> f64 {
        match self.rhs_square {
            0.0 => 0.0,
            square => (self.residual_square / square).sqrt(),
        }
    }
}

mirror!(
    /// `PressureStats` of shared/pressure_stats.wgsl: f32 whatever the solve is in.
    PressureStats {
        /// Largest |∇·u| in a cell of water before the projection, 1/s.
        divergence_before: f32,
        /// The same after it.
        divergence_after: f32,
        /// Largest |mean of ∇·u| over a pocket, 1/s.
        incompatible: f32,
        /// Cells of water without an open face.
        dropped: u32,
        /// Bodies of water that no air touches.
        pockets: u32,
        /// Unused.
        padding: [u32; 3],
    }
);

mirror!(
    /// `PressureBrick` of shared/pressure_site.wgsl.
    PressureBrick {
        /// Slots at the lower, then the upper faces.
        faces: [u32; 6],
        /// Element of the cell above block 0.
        above: u32,
        /// Unused.
        padding: u32,
    }
);

/// What `pressure/reduce` decides, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReduceStep {
    /// Starts a solve.
    Begin,
    /// β.
    Direction,
    /// α.
    Length,
    /// Whether the residual is small enough.
    Check,
    /// Whether the true one is.
    Verified,
}
