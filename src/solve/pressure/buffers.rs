//! Buffers of the projection's own. Inputs, which its caller fills, are FLIP's.
//!
//! "Cells" and "planes" as in FLIP's; "blocked" cells stand by block of 2³ ([`super::blocked`]). A [`Real`] is what
//! `solver.flip.pressure.precision` says that the solve computes in.

use swell_gpu::{
    buffer::{Buf, Windows, Workgroups},
    program::Program,
};

use super::{
    Precision, PressureBrick, PressureControl, PressureControl64, PressurePhase, PressureStats,
    SolveError,
};

/// An f32 or an f64 of the device, by the precision of the solve.
#[derive(Debug)]
pub enum Real {}

/// Cells: pascal; 0 without water.
pub const PRESSURE: Buf<f32> = Buf::new("pressure");
/// Planes: metres by which the density correction moves water; 0 on faces that touch none or are closed.
pub const FACE_DISPLACEMENT: Buf<f32> = Buf::new("face_displacement");
/// Planes, blocked: coefficient of the lower face, 0 where nothing passes.
pub const COEFFICIENT: Buf<f32> = Buf::new("pressure_coefficient");
/// Cells, blocked: sum of the coefficients to air.
pub const DIRICHLET: Buf<Real> = Buf::new("pressure_dirichlet");
/// Blocks: which of its cells are what, a bit each.
pub const BLOCK: Buf<u32> = Buf::new("pressure_block");
/// Cells, blocked: b.
pub const RHS: Buf<Real> = Buf::new("pressure_rhs");
/// Cells, blocked: r.
pub const RESIDUAL: Buf<Real> = Buf::new("pressure_residual");
/// Cells, blocked: M⁻¹ r.
pub const CORRECTION: Buf<Real> = Buf::new("pressure_correction");
/// Cells, blocked: p.
pub const DIRECTION: Buf<Real> = Buf::new("pressure_direction");
/// Cells, blocked: A p.
pub const PRODUCT: Buf<Real> = Buf::new("pressure_product");
/// Cells, blocked, as many arrays as the precision has terms: q is their sum, m/s.
pub const SOLUTION: Buf<Real> = Buf::new("pressure_solution");
/// Cells, blocked: one over the diagonal; with a preconditioner that asks for it.
pub const INVERSE_DIAGONAL: Buf<Real> = Buf::new("pressure_inverse_diagonal");
/// Cells, blocked: least place of the body of water, 0 where air touches it or no row is.
pub const LABEL: Buf<u32> = Buf::new("pressure_label");
/// Blocked places of the pockets' cells, one pocket after the other.
pub const POCKET_CELLS: Buf<u32> = Buf::new("pressure_pocket_cells");
/// First and past the last of each pocket's.
pub const POCKET_RANGES: Buf<[u32; 2]> = Buf::new("pressure_pocket_ranges");
/// Records of the bricks, one a slot.
pub const BRICKS: Buf<PressureBrick> = Buf::new("pressure_bricks");
/// A sum a workgroup.
pub const SUMS: Buf<Real> = Buf::new("pressure_sums");
/// What the iterations decide, in f32.
pub const CONTROL: Buf<PressureControl> = Buf::new("pressure_control");
/// The same where the solve is in f64.
pub const CONTROL_F64: Buf<PressureControl64> = Buf::new("pressure_control");
/// What a projection notes.
pub const STATS: Buf<PressureStats> = Buf::new("pressure_stats");
/// Of every dispatch when it runs, by `Size`.
pub const SIZES: Buf<Workgroups> = Buf::new("pressure_sizes");
/// The same three times: of iterations, of the verification, and of what follows; zeros out of turn.
pub const GROUPS: Buf<Workgroups> = Buf::new("pressure_groups");
/// What a dispatch works on, by `Phase`.
pub const PHASES: Windows<PressurePhase> = Windows::new("phase", "pressure_phases");

/// The first `count` values of an array of the solve's own precision.
///
/// # Errors
/// The device.
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

/// The scalars of a solve and what its projection noted.
///
/// # Errors
/// The device.
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
