//! Buffers of the projection. Its inputs, which the caller fills, are buffers of FLIP.
//!
//! "Cells" and "planes" are as for FLIP; "blocked" arrays order cells by block of 2³ cells
//! ([`super::blocked`]). A [`Real`] has the precision of the solve,
//! `solver.flip.pressure.precision`.

use crate::trace::Traced;
use swell_gpu::{
    buffer::{Buf, Windows, Workgroups},
    program::Program,
};

use super::{
    PocketPart, Precision, PressureBrick, PressureControl, PressureControl64, PressurePhase,
    PressureStats, SolveError,
};

/// Placeholder type for an f32 or f64 on the device, depending on the precision of the solve.
#[derive(Debug)]
pub enum Real {}

/// Cells: pressure, Pa; 0 without water.
pub const PRESSURE: Buf<f32> = Buf::new("pressure");
/// Planes, blocked: coefficient of the lower face; 0 if nothing flows through it.
pub const COEFFICIENT: Buf<f32> = Buf::new("pressure_coefficient");
/// Cells, blocked: sum of the coefficients to air cells.
pub const DIRICHLET: Buf<Real> = Buf::new("pressure_dirichlet");
/// Blocks: bit field of the kinds of a block's cells.
pub const BLOCK: Buf<u32> = Buf::new("pressure_block");
/// Cells, blocked: right-hand side b.
pub const RHS: Buf<Real> = Buf::new("pressure_rhs");
/// Cells, blocked: residual r.
pub const RESIDUAL: Buf<Real> = Buf::new("pressure_residual");
/// Cells, blocked, two arrays: preconditioned residual M⁻¹ r; and A p, whose place the
/// preconditioner uses for what it computes first.
pub const CORRECTION: Buf<Real> = Buf::new("pressure_correction");
/// Cells, blocked: search direction p.
pub const DIRECTION: Buf<Real> = Buf::new("pressure_direction");
/// Cells, blocked, one array per term of the precision: the sum of the terms is q, m/s.
pub const SOLUTION: Buf<Real> = Buf::new("pressure_solution");
/// Cells, blocked: reciprocal of the diagonal. Exists only with a preconditioner that needs it.
pub const INVERSE_DIAGONAL: Buf<Real> = Buf::new("pressure_inverse_diagonal");
/// Cells, blocked: smallest index in the connected body of water; 0 if air touches the body or the
/// cell has no row.
pub const LABEL: Buf<u32> = Buf::new("pressure_label");
/// Blocked indices of the pockets' cells, pocket by pocket.
pub const POCKET_CELLS: Buf<u32> = Buf::new("pressure_pocket_cells");
/// Parts of the pockets, as ranges in [`POCKET_CELLS`].
pub const POCKET_PARTS: Buf<PocketPart> = Buf::new("pressure_pocket_parts");
/// The sum over each part, of the array that is being centred.
pub const POCKET_SUMS: Buf<Real> = Buf::new("pressure_pocket_sums");
/// Topology of the bricks, one record per slot.
pub const BRICKS: Buf<PressureBrick> = Buf::new("pressure_bricks");
/// Four partial sums per workgroup (shared/pressure_sum.wgsl).
pub const SUMS: Buf<Real> = Buf::new("pressure_sums");
/// Scalars of the iteration, in f32.
pub const CONTROL: Buf<PressureControl> = Buf::new("pressure_control");
/// Scalars of the iteration, in f64.
pub const CONTROL_F64: Buf<PressureControl64> = Buf::new("pressure_control");
/// Statistics of a projection.
pub const STATS: Buf<PressureStats> = Buf::new("pressure_stats");
/// Workgroups of every dispatch when it runs, indexed by `Size`.
pub const SIZES: Buf<Workgroups> = Buf::new("pressure_sizes");
/// Four copies of [`SIZES`]: for iterations, the verification, what follows it, and the step of an
/// iteration. Copies that are not due are zero.
pub const GROUPS: Buf<Workgroups> = Buf::new("pressure_groups");
/// Parameters of each dispatch, indexed by `Phase`.
pub const PHASES: Windows<PressurePhase> = Windows::new("phase", "pressure_phases");

/// Reads the first `count` values of an array in the solve's precision.
///
/// # Errors Returns an error if the device fails.
pub fn read_reals(
    program: &Program,
    buffer: &Buf<Real>,
    precision: Precision,
    count: usize,
) -> Result<Vec<f64>, SolveError> {
    Ok(match precision {
        Precision::F32 | Precision::F32Refined => {
            let narrow = program.read(buffer.retyped::<f32>(), count)?;
            narrow.into_iter().map(f64::from).collect()
        }
        Precision::F64 => program.read(buffer.retyped::<f64>(), count)?,
    })
}

/// Writes numbers in the precision of a solve, from index `first` on.
pub(super) fn upload_reals(
    program: &Program,
    buffer: &Buf<Real>,
    precision: Precision,
    first: usize,
    values: &[f64],
) {
    match precision {
        Precision::F32 | Precision::F32Refined => {
            let narrow: Vec<f32> = values.iter().map(|&value| value as f32).collect();
            program.upload(buffer.retyped::<f32>(), first, &narrow);
        }
        Precision::F64 => program.upload(buffer.retyped::<f64>(), first, values),
    }
}

/// Reads the scalars of a solve and the statistics of its projection.
///
/// # Errors Returns an error if the device fails.
pub fn read_control(
    program: &Program,
    precision: Precision,
) -> Result<(PressureControl64, PressureStats), SolveError> {
    let (control, stats) = match precision {
        Precision::F32 | Precision::F32Refined => {
            let (control, stats) = program.download((CONTROL.first(1), STATS.first(1)))?;
            (control[0].into(), stats)
        }
        Precision::F64 => {
            let (control, stats) = program.download((CONTROL_F64.first(1), STATS.first(1)))?;
            (control[0], stats)
        }
    };
    Ok((control, stats[0]))
}

impl Traced<'_> {
    /// Reads the scalars of a projection in `precision`, which determines their layout.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn pressure_control(&self, precision: Precision) -> Result<PressureControl64, SolveError> {
        match precision {
            Precision::F32 | Precision::F32Refined => Ok(self.one(CONTROL)?.into()),
            Precision::F64 => self.one(CONTROL_F64),
        }
    }

    /// Reads the statistics of a projection.
    ///
    /// # Errors Returns an error if the device fails.
    pub fn pressure_stats(&self) -> Result<PressureStats, SolveError> {
        self.one(STATS)
    }
}
