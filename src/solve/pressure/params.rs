//! Host-side mirrors of the projection's WGSL structs.

use swell_gpu::buffer::mirror;

mirror!(
    /// `PressurePhase` of shared/pressure_phase.wgsl: parameters of a dispatch.
    PressurePhase {
        /// Index into `levels`.
        level: u32,
        /// Index of the coarsest level.
        last_level: u32,
        /// Decision of `pressure/reduce`, or whether `pressure/center` records the mean.
        step: u32,
        /// Number of workgroups whose partial sums `pressure/reduce` adds up.
        sum_count: u32,
        /// Distance between planes of an array, in elements: 512 times its slots.
        stride: u32,
        /// Most iterations of a solve.
        max_iterations: u32,
        /// Parts of pockets; 0 until the pockets have been listed.
        pocket_parts: u32,
        /// Square of the tolerance for the relative residual.
        tolerance_square: f32,
        /// Cell size Δx, metres.
        cell_size: f32,
        /// ρ Δx over the time for which the pressure acts: turns q into pascals.
        pressure_scale: f32,
        /// Always 0, but unknown to the shader compiler.
        opaque_zero: u32,
        /// Bricks with water in which bodies move with the pressure; 0 in the density correction.
        body_bricks: u32,
        /// For each level: first slot, bricks, active bricks (finest level only), 0.
        levels: [[u32; 4]; super::LEVELS],
    }
);

macro_rules! control {
    ($(#[$meta:meta])* $name:ident, $real:ty) => {
        mirror!(
            $(#[$meta])*
            $name as "PressureControl" {
                /// 0 iterating, 1 verifying, 2 done, 3 waiting for the list of pockets.
                state: u32,
                /// Iterations so far.
                iterations: u32,
                /// 1 if the next direction restarts from the preconditioned residual.
                is_first: u32,
                /// Number of verifications.
                restarts: u32,
                /// ‖b‖².
                rhs_square: $real,
                /// ‖r‖².
                residual_square: $real,
                /// Residual · correction.
                product: $real,
                /// Step length α.
                alpha: $real,
                /// Factor β of the previous direction.
                beta: $real,
            }
        );
    };
}

control!(
    /// `PressureControl` of shared/pressure_control.wgsl, in f32.
    PressureControl,
    f32
);

control!(
    /// `PressureControl` of shared/pressure_control.wgsl, in f64.
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
    /// Returns ‖r‖ / ‖b‖; 0 if b = 0.
    pub fn residual(&self) -> f64 {
        match self.rhs_square {
            0.0 => 0.0,
            square => (self.residual_square / square).sqrt(),
        }
    }
}

mirror!(
    /// `PressureStats` of shared/pressure_stats.wgsl: statistics of a projection, in f32 for every
    /// precision of the solve.
    PressureStats {
        /// Largest |∇·u| in a cell of water before the projection, 1/s.
        divergence_before: f32,
        /// Largest |∇·u| in a cell of water after the projection, 1/s.
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
    /// `PressureBrick` of shared/pressure_site.wgsl: topology of a brick.
    PressureBrick {
        /// Slots of the neighbours at the lower faces x, y, z, then at the upper faces; 0 if
        /// absent.
        faces: [u32; 6],
        /// Element on the next coarser level that contains block 0; 0 if absent.
        above: u32,
        /// Unused.
        padding: u32,
    }
);

mirror!(
    /// `PocketPart` of shared/pressure_pockets.wgsl: cells of a pocket that one workgroup sums.
    PocketPart {
        /// First index in `pressure_pocket_cells`.
        first: u32,
        /// Index after the last.
        end: u32,
        /// First part of the same pocket.
        first_part: u32,
        /// Part after its last.
        end_part: u32,
    }
);

/// Decisions of `pressure/reduce`, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReduceStep {
    /// Starts a solve.
    Begin,
    /// Computes β.
    Direction,
    /// Computes α, and tests the residual after that step.
    Length,
    /// Tests the true residual.
    Verified,
}
