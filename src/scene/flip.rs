//! PIC/FLIP settings, validated.

use serde::{Deserialize, Serialize};

use swell_domain::flip::{APART, LEAST_APART, apart};
use swell_domain::named::read_by_name;

/// Attributes that APIC declares: C of v(x) = v + C (x − x_p), 1/s, `affine_xy` = ∂v_x/∂y. A state without them
/// starts from zeros.
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
    /// Δx, metres.
    pub cell_size: f64,
    /// Particles that a full cell holds at rest; they start on a lattice of spacing Δx / ∛n.
    pub particles_per_cell: u32,
    /// What velocities carry from particles to the grid.
    pub transfer: Transfer,
    /// α: the part of the velocity taken from the grid rather than advanced by its change. Acts as a
    /// viscosity α Δx² / (6 Δt). Unused by APIC, which has its own.
    pub pic_blend: f64,
    /// Largest displacement in a substep, in cells.
    pub cfl: f64,
    /// Most substeps in a frame; a scene that needs more is stopped, never stepped more coarsely.
    pub max_substeps: u32,
    /// Where the pressure is zero.
    pub surface: Surface,
    /// Whether particles are moved so that their density stays that of the start (Kugelstadt et
    /// al. 2019); it keeps the volume.
    pub density_correction: bool,
    /// The linear solve.
    pub pressure: Pressure,
}

impl Flip {
    /// Distance between neighbours of the lattice at the start, metres.
    pub fn particle_spacing(&self) -> f64 {
        self.cell_size / f64::from(self.particles_per_cell).cbrt()
    }

    /// Particles that are nearer to each other are pushed apart, metres.
    pub fn apart(&self) -> f64 {
        let part = if self.density_correction {
            APART
        } else {
            LEAST_APART
        };
        self.cell_size * apart(part * self.particle_spacing() / self.cell_size)
    }

    /// Particles that are nearer to a wall than half of it are pushed off, metres.
    pub fn apart_from_walls(&self) -> f64 {
        self.cell_size * apart(APART * self.particle_spacing() / self.cell_size)
    }

    /// Attributes of a frame beyond positions, velocities and ids.
    pub fn attributes(&self) -> &'static [&'static str] {
        match self.transfer {
            Transfer::Flip => &[],
            Transfer::Apic => &AFFINE,
        }
    }
}

/// What velocities carry from particles to the grid and back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// The change of the grid's velocity, blended with the velocity itself.
    Flip,
    /// The velocity and its affine part (Jiang et al. 2015).
    Apic,
}

impl Transfer {
    /// With the names that scenes use.
    pub const NAMED: [(&'static str, Self); 2] = [("flip", Self::Flip), ("apic", Self::Apic)];

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// Where the pressure is zero at the free surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// At the centre of the first cell of air.
    Voxel,
    /// Where the surface crosses the way there (Enright et al. 2003).
    GhostFluid,
}

impl Surface {
    /// With the names that scenes use.
    pub const NAMED: [(&'static str, Self); 2] =
        [("voxel", Self::Voxel), ("ghost_fluid", Self::GhostFluid)];

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// The pressure solve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pressure {
    /// What precedes each conjugate-gradient iteration.
    pub preconditioner: Preconditioner,
    /// What it is solved in on the GPU; the CPU's reference is f64 whatever stands here.
    pub precision: Precision,
    /// True residual over the right-hand side, both in the Euclidean norm, at which it stops.
    pub tolerance: f64,
    /// Most iterations of a solve; one that ends there is reported as missed.
    pub max_iterations: u32,
}

/// What the projection's system is solved in. Face velocities and pressures are f32 before and after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// One f32 word: the true residual stalls near ε ‖A‖ ‖x‖ / ‖b‖.
    F32,
    /// Iterative refinement: f32 iterations for a solution of two words, from residuals that are computed afresh.
    F32Refined,
    /// f64, where the adapter has it.
    F64,
}

impl Precision {
    /// With the names that scenes use.
    pub const NAMED: [(&'static str, Self); 3] = [
        ("f32", Self::F32),
        ("f32_refined", Self::F32Refined),
        ("f64", Self::F64),
    ];

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    /// Words of 32 bits of a value of the iterations.
    pub fn words(self) -> usize {
        match self {
            Self::F32 | Self::F32Refined => 1,
            Self::F64 => 2,
        }
    }

    /// Values that the solution at a cell is the sum of.
    pub fn terms(self) -> usize {
        match self {
            Self::F32 | Self::F64 => 1,
            Self::F32Refined => 2,
        }
    }
}

/// Preconditioner of the conjugate gradients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preconditioner {
    /// The identity.
    None,
    /// The diagonal.
    Jacobi,
    /// Incomplete Poisson (Ament et al. 2010), for a system scaled to a unit diagonal.
    Ipp,
    /// One symmetric V-cycle (McAdams et al. 2010).
    Multigrid,
}

impl Preconditioner {
    /// With the names that scenes use.
    pub const NAMED: [(&'static str, Self); 4] = [
        ("none", Self::None),
        ("jacobi", Self::Jacobi),
        ("ipp", Self::Ipp),
        ("multigrid", Self::Multigrid),
    ];

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

read_by_name!(Transfer);
read_by_name!(Surface);
read_by_name!(Precision);
read_by_name!(Preconditioner);
