//! Validated PIC/FLIP settings.

use serde::{Deserialize, Serialize};

use swell_domain::{
    band::Band,
    deep::DeepGrid,
    flip::{APART, LEAST_APART, apart},
    named::read_by_name,
};

use super::Scene;

/// Attributes that APIC adds to particles: the matrix C of v(x) = v + C (x − x_p), 1/s, with
/// `affine_xy` = ∂v_x/∂y. A state without them starts from zero.
pub const AFFINE: [&str; 9] = [
    "affine_xx",
    "affine_xy",
    "affine_xz",
    "affine_yx",
    "affine_yy",
    "affine_yz",
    "affine_zx",
    "affine_zy",
    "affine_zz",
];

/// PIC/FLIP settings (Zhu and Bridson 2005).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flip {
    /// Δx, the edge of a grid cell, metres.
    pub cell_size: f64,
    /// Particles per full cell at rest, n; they start on a lattice of spacing Δx / ∛n.
    pub particles_per_cell: u32,
    /// Scheme of the transfer between particles and grid.
    pub transfer: Transfer,
    /// α: weight of the grid's velocity (PIC) against its change (FLIP). It acts as a viscosity α
    /// Δx² / (6 Δt). APIC ignores it and has its own dissipation.
    pub pic_blend: f64,
    /// Largest displacement per substep, in cells.
    pub cfl: f64,
    /// Largest number of substeps per frame. A scene that needs more is stopped; it is never
    /// stepped more coarsely.
    pub max_substeps: u32,
    /// Location of the zero pressure at the free surface.
    pub surface: Surface,
    /// Whether particles are moved to keep their initial density (Kugelstadt et al. 2019), which
    /// conserves the volume.
    pub density_correction: bool,
    /// Depth of the band below the free surface that has particles, cells; `None` has particles
    /// everywhere (narrow-band FLIP, Ferstl et al. 2016).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub band: Option<u32>,
    /// Settings of the pressure solve.
    pub pressure: Pressure,
}

impl Scene {
    /// Returns the band that has particles, if they are not everywhere.
    pub fn band(&self) -> Option<Band> {
        let flip = self.solver.flip()?;
        let grid = DeepGrid {
            origin: self.domain.min,
            cell_size: flip.cell_size,
            cells: self.domain.cells(flip.cell_size),
            per_edge: f64::from(flip.particles_per_cell).cbrt().round() as u32,
            band: flip.band?,
        };
        Some(Band {
            grid,
            periodic: self.periodic,
        })
    }
}

impl Flip {
    /// Returns the distance between neighbours on the initial lattice, metres.
    pub fn particle_spacing(&self) -> f64 {
        self.cell_size / f64::from(self.particles_per_cell).cbrt()
    }

    /// Returns the distance below which particles are pushed apart, metres.
    pub fn apart(&self) -> f64 {
        let part = if self.density_correction {
            APART
        } else {
            LEAST_APART
        };
        self.cell_size * apart(part * self.particle_spacing() / self.cell_size)
    }

    /// Returns twice the distance from a wall below which particles are pushed off it, metres.
    pub fn apart_from_walls(&self) -> f64 {
        self.cell_size * apart(APART * self.particle_spacing() / self.cell_size)
    }

    /// Returns the attributes of a particle beside position, velocity and id.
    pub fn attributes(&self) -> &'static [&'static str] {
        match self.transfer {
            Transfer::Flip => &[],
            Transfer::Apic => &AFFINE,
        }
    }
}

/// Transfer of velocities between particles and grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// Change of the grid velocity, blended with the grid velocity itself.
    Flip,
    /// Velocity and its affine part (Jiang et al. 2015).
    Apic,
}

impl Transfer {
    /// All transfers with the names used in scenes.
    pub const NAMED: [(&'static str, Self); 2] = [("flip", Self::Flip), ("apic", Self::Apic)];

    /// Returns the name used in scenes.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// Location of the zero pressure at the free surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// The centre of the first air cell.
    Voxel,
    /// The point where the surface crosses the line to that centre (Enright et al. 2003).
    GhostFluid,
}

impl Surface {
    /// All surfaces with the names used in scenes.
    pub const NAMED: [(&'static str, Self); 2] =
        [("voxel", Self::Voxel), ("ghost_fluid", Self::GhostFluid)];

    /// Returns the name used in scenes.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// Settings of the pressure solve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pressure {
    /// Preconditioner of the conjugate-gradient iteration.
    pub preconditioner: Preconditioner,
    /// Precision on the GPU; the CPU reference always uses `f64`.
    pub precision: Precision,
    /// Norm of the true residual over that of the right-hand side (Euclidean) at which
    /// the solve stops.
    pub tolerance: f64,
    /// Largest number of iterations. A solve that reaches it is reported as missed.
    pub max_iterations: u32,
}

/// Precision of the pressure solve. Face velocities and pressures are `f32` before and after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// `f32`; the true residual stalls near ε ‖A‖ ‖x‖ / ‖b‖.
    F32,
    /// Iterative refinement: `f32` iterations with recomputed residuals; the solution is the
    /// sum of two words.
    F32Refined,
    /// `f64`, on adapters that support it.
    F64,
}

impl Precision {
    /// All precisions with the names used in scenes.
    pub const NAMED: [(&'static str, Self); 3] = [
        ("f32", Self::F32),
        ("f32_refined", Self::F32Refined),
        ("f64", Self::F64),
    ];

    /// Returns the name used in scenes.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    /// Returns the number of 32-bit words per value of the iteration.
    pub fn words(self) -> usize {
        match self {
            Self::F32 | Self::F32Refined => 1,
            Self::F64 => 2,
        }
    }

    /// Returns the number of values whose sum is the solution in a cell.
    pub fn terms(self) -> usize {
        match self {
            Self::F32 | Self::F64 => 1,
            Self::F32Refined => 2,
        }
    }
}

/// Preconditioner of the conjugate-gradient iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preconditioner {
    /// No preconditioning.
    None,
    /// Diagonal scaling.
    Jacobi,
    /// Incomplete Poisson (Ament et al. 2010), for a system scaled to a unit diagonal.
    Ipp,
    /// One symmetric multigrid V-cycle (McAdams et al. 2010).
    Multigrid,
}

impl Preconditioner {
    /// All preconditioners with the names used in scenes.
    pub const NAMED: [(&'static str, Self); 4] = [
        ("none", Self::None),
        ("jacobi", Self::Jacobi),
        ("ipp", Self::Ipp),
        ("multigrid", Self::Multigrid),
    ];

    /// Returns the name used in scenes.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

read_by_name!(Transfer);
read_by_name!(Surface);
read_by_name!(Precision);
read_by_name!(Preconditioner);
