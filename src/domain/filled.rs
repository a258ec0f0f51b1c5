//! The water of a state whose particles lie in a band, as particles everywhere.

use std::borrow::Cow;

use glam::DVec3;

use super::{parallel, particles::Particles};

impl Particles {
    /// Returns the number of particles, counting each deep cell as those that it stands for.
    pub fn amount(&self) -> usize {
        if self.deep.is_empty() {
            return self.len();
        }
        let held = self
            .position
            .iter()
            .filter(|x| self.deep.holds(**x))
            .count();
        self.len() - held + self.deep.count() * self.deep.grid.per_cell() as usize
    }

    /// Returns the water as particles everywhere, like [`Self::filled`]; without deep cells as it
    /// is.
    pub fn water(&self) -> Cow<'_, Self> {
        match self.deep.is_empty() {
            true => Cow::Borrowed(self),
            false => Cow::Owned(self.clone().filled()),
        }
    }

    /// Returns the water as particles everywhere: deep cells give a lattice of particles, which
    /// move with the velocity between their faces. A point of the lattice has the same id, from 2³¹
    /// on, in every state; attributes are 0. They replace what particles are left in these cells.
    #[must_use]
    pub fn filled(mut self) -> Self {
        if self.deep.is_empty() {
            return self;
        }
        let deep = std::mem::take(&mut self.deep);
        let keep = parallel::map_slice(&self.position, |x| !deep.holds(*x));
        self.retain(&keep);
        let grid = deep.grid;
        let n = grid.per_edge;
        let band = grid.band as f32;
        let points: Vec<(u32, [[f32; 3]; 2])> = parallel::flat_map(0..deep.cell.len(), |k| {
            let count = if deep.depth[k] > band { n.pow(3) } else { 0 };
            let faces = if count > 0 {
                deep.faces(k)
            } else {
                [[0.0; 2]; 3]
            };
            let (corner, id) = (deep.cell[k], grid.first_id(deep.cell[k]));
            (0..count).map(move |point| {
                let at = [point % n, point / n % n, point / (n * n)];
                let part = at.map(|k| (f64::from(k) + 0.5) / f64::from(n));
                let place = DVec3::from_array(corner.map(f64::from)) + DVec3::from_array(part);
                let x = grid.origin + grid.cell_size * place;
                let between = |axis: usize| {
                    let ([low, high], t) = (faces[axis], part[axis] as f32);
                    low + t * (high - low)
                };
                (id + point, [x.as_vec3().to_array(), [0, 1, 2].map(between)])
            })
        });
        for (id, [x, v]) in points {
            self.id.push(id);
            self.position.push(x);
            self.velocity.push(v);
        }
        for column in self.attributes.values_mut() {
            column.resize(self.position.len(), 0.0);
        }
        self
    }
}
