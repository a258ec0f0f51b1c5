//! faer's sparse Cholesky factorisation, ordered by approximate minimum degree, with a size known
//! in advance.

use faer::{
    Conj, MatMut, Side,
    dyn_stack::{MemBuffer, MemStack},
    get_global_parallelism,
    sparse::{
        SparseColMat, Triplet,
        linalg::cholesky::{
            CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
            factorize_symbolic_cholesky,
        },
    },
};

use crate::ReferenceError;
use swell_domain::poisson::{NONE, System};

/// A = L Lᵀ of a system whose pockets are pinned.
pub(super) struct Factor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    /// Size of the factor's values plus the scratch memory of the factorisation.
    pub(super) bytes: u64,
}

fn fault(error: impl std::fmt::Debug) -> ReferenceError {
    ReferenceError::Factor(format!("{error:?}"))
}

impl Factor {
    /// Factorises the system; returns `None` if that would take more than `budget` bytes.
    pub(super) fn new(
        system: &System,
        pockets: &[Vec<u32>],
        budget: u64,
    ) -> Result<Option<Self>, ReferenceError> {
        let matrix = matrix(system, pockets)?;
        let symbolic = factorize_symbolic_cholesky(
            matrix.symbolic(),
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .map_err(fault)?;
        let par = get_global_parallelism();
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(par, Default::default());
        let length = symbolic.len_val();
        let bytes = (size_of::<f64>() * length + scratch.unaligned_bytes_required()) as u64;
        if bytes > budget {
            return Ok(None);
        }
        let mut values = Vec::new();
        values.try_reserve_exact(length).map_err(fault)?;
        values.resize(length, 0.0);
        let mut memory = MemBuffer::try_new(scratch).map_err(fault)?;
        symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix.as_ref(),
                Side::Lower,
                Default::default(),
                par,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(fault)?;
        Ok(Some(Self {
            symbolic,
            values,
            bytes,
        }))
    }

    /// Solves L Lᵀ x = b.
    pub(super) fn solve(&self, b: &[f64]) -> Vec<f64> {
        let par = get_global_parallelism();
        let mut x = b.to_vec();
        let rows = x.len();
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(1, par));
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut x, rows, 1),
            par,
            MemStack::new(&mut memory),
        );
        x
    }
}

/// Returns the lower triangle. One row of each pocket is treated as if air were beside it: if b has
/// no mean over the pocket, that sets the pressure there to 0 without affecting the other rows.
fn matrix(
    system: &System,
    pockets: &[Vec<u32>],
) -> Result<SparseColMat<usize, f64>, ReferenceError> {
    let rows = system.cell.len();
    let mut triplets = Vec::with_capacity(4 * rows);
    for (i, (neighbors, shared)) in system.neighbor.iter().zip(&system.coefficient).enumerate() {
        triplets.push(Triplet::new(i, i, system.diagonal[i]));
        for (&j, &shared) in neighbors.iter().zip(shared) {
            if j != NONE && (j as usize) < i {
                triplets.push(Triplet::new(i, j as usize, -shared));
            }
        }
    }
    // Duplicate entries add up.
    triplets.extend(pockets.iter().map(|pocket| {
        let row = pocket[0] as usize;
        Triplet::new(row, row, 1.0)
    }));
    SparseColMat::try_new_from_triplets(rows, rows, &triplets).map_err(fault)
}
