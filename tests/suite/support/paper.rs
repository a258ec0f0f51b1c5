//! PBF's sums as the papers define them, over all pairs and over lattices in f64, independent of
//! the program's code.
use std::f64::consts::PI;

use glam::{DVec3, IVec3};
use swell::domain::bounds::Bounds;

/// The kernels of Müller et al. 2003, scaled so that a lattice of particles has rest density.
pub struct Paper {
    /// Support radius h, metres.
    pub h: f64,
    pub d: f64,
    /// Volume of a particle, m/ρ0, m³.
    pub volume: f64,
    /// Σ_k |∇_k C|² in the bulk, 1/m².
    pub squares: f64,
    /// Σ_j (λ_i + λ_j) ∇C divided by ∇λ in the bulk.
    pub linear: f64,
    /// Relative density that the lattice beyond a face of the domain contributes.
    pub deficit: f64,
}

impl Paper {
    pub fn new(d: f64, ratio: f64) -> Self {
        let mut paper = Self {
            h: ratio * d,
            d,
            volume: 1.0,
            squares: 0.0,
            linear: 0.0,
            deficit: 0.0,
        };
        let line = || (-4..=4).map(f64::from);
        let lattice: Vec<DVec3> = line()
            .flat_map(|x| line().flat_map(move |y| line().map(move |z| d * DVec3::new(x, y, z))))
            .collect();
        let density = |paper: &Self, is_in: &dyn Fn(&&DVec3) -> bool| -> f64 {
            let all = lattice.iter().filter(is_in);
            all.map(|x| paper.density(*x)).sum()
        };
        paper.volume = 1.0 / density(&paper, &|_| true);
        paper.deficit = density(&paper, &|x| x.y < 0.0);
        for x in lattice.iter().filter(|x| x.length() > 0.0) {
            let slope = paper.gradient(-*x);
            paper.squares += slope.length_squared();
            paper.linear += slope.x * x.x;
        }
        paper
    }

    /// V W of poly6 at `x` = x_i − x_j.
    pub fn density(&self, x: DVec3) -> f64 {
        let h = self.h;
        let room = (h * h - x.length_squared()).max(0.0);
        self.volume * 315.0 / (64.0 * PI * h.powi(9)) * room.powi(3)
    }

    /// V ∇_i W of spiky at `x` = x_i − x_j, 1/m.
    pub fn gradient(&self, x: DVec3) -> DVec3 {
        let (h, r) = (self.h, x.length());
        if r == 0.0 {
            return DVec3::ZERO;
        }
        let slope = -45.0 / (PI * h.powi(6)) * (h - r).max(0.0).powi(2);
        self.volume * slope * x / r
    }

    /// Poly6 integrated over the half-space beyond a plane `z` away: discs of 315/256 (1 − t²)⁴ /
    /// h, by the midpoint rule, whose error is below 2 / n² = 5e-7.
    pub fn beyond(&self, z: f64) -> f64 {
        let (n, q) = (2000, (z / self.h).min(1.0));
        let step = (1.0 - q) / f64::from(n);
        let disc = |k: u32| (1.0 - (q + (f64::from(k) + 0.5) * step).powi(2)).powi(4) * step;
        315.0 / 256.0 * (0..n).map(disc).sum::<f64>()
    }

    /// Factor by which the half-space beyond a wall half a spacing away equals the lattice that it
    /// represents.
    pub fn wall_scale(&self) -> f64 {
        self.deficit / self.beyond(0.5 * self.d)
    }

    /// Relative density at `x` due to the walls of a box: one minus the product of the fractions
    /// that each wall leaves free.
    pub fn of_walls(&self, x: DVec3, walls: &Bounds) -> f64 {
        let free = |z: f64| 1.0 - self.wall_scale() * self.beyond(z);
        let axis = |k: usize| free(x[k] - walls.min[k]) * free(walls.max[k] - x[k]);
        1.0 - axis(0) * axis(1) * axis(2)
    }

    /// Relative densities by a sum over all pairs.
    pub fn densities(&self, points: &[DVec3]) -> Vec<f64> {
        let of = |x: &DVec3| points.iter().map(|y| self.density(*x - *y)).sum();
        points.iter().map(of).collect()
    }

    /// Corrections of a Jacobi iteration far from walls (Macklin and Müller 2013, eqs. 8 to 14): λ
    /// = −max(C, 0) / (Σ |∇C|² + ε), then Δx = ω Σ (λ_i + λ_j − k (W / W(0.2 h))⁴ / Σ |∇C|²_bulk)
    /// ∇W, limited to half a spacing.
    pub fn corrections(&self, points: &[DVec3], relaxation: f64, repulsion: f64) -> Vec<DVec3> {
        let gradient = |i: usize, j: usize| self.gradient(points[i] - points[j]);
        let n = points.len();
        let densities = self.densities(points);
        let lambda: Vec<f64> = (0..n)
            .map(|i| {
                let own: DVec3 = (0..n).map(|j| gradient(i, j)).sum();
                let others: f64 = (0..n).map(|j| gradient(i, j).length_squared()).sum();
                let squares = own.length_squared() + others + 1e-3 * self.squares;
                -(densities[i] - 1.0).max(0.0) / squares
            })
            .collect();
        let reference = self.density(DVec3::new(0.2 * self.h, 0.0, 0.0));
        let artificial = |i: usize, j: usize| {
            let part = self.density(points[i] - points[j]) / reference;
            repulsion / self.squares * part.powi(4)
        };
        let delta = |i: usize| -> DVec3 {
            let pair = |j: usize| (lambda[i] + lambda[j] - artificial(i, j)) * gradient(i, j);
            let delta = relaxation * (0..n).map(pair).sum::<DVec3>();
            delta.clamp_length_max(0.5 * self.d)
        };
        (0..n).map(delta).collect()
    }
}

/// Densities of the cells of water by hat functions. Mirror images behind a wall return the part of
/// a hat that lies there: between the wall and the centre of the cell beside it, the hat stays at
/// one.
pub fn of_cells(places: &[DVec3], size: DVec3, dx: f64) -> Vec<f64> {
    let cells = (size / dx).round().as_ivec3();
    let mut densities = Vec::new();
    for k in 0..cells.x * cells.y * cells.z {
        let cell = IVec3::new(k % cells.x, k / cells.x % cells.y, k / (cells.x * cells.y));
        let along = |x: &DVec3, axis: usize| {
            let off = x[axis] / dx - f64::from(cell[axis]) - 0.5;
            let is_first = cell[axis] == 0 && off < 0.0;
            let is_last = cell[axis] + 1 == cells[axis] && off > 0.0;
            match is_first || is_last {
                true => 1.0,
                false => (1.0 - off.abs()).max(0.0),
            }
        };
        let hats = |x: &DVec3| along(x, 0) * along(x, 1) * along(x, 2);
        let density = places.iter().map(hats).sum::<f64>() / 8.0;
        // A cell that is less than half full is air.
        if density >= 0.5 {
            densities.push(density);
        }
    }
    densities
}
