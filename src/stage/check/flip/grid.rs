//! Particles and solids to the grid.

use glam::DVec3;
use rayon::prelude::*;

use super::{Checker, Layout, fields::*, pair, pair_of};
use crate::{
    compare::rounding::U,
    domain::{bricks::Bricks, signed_distance::SignedDistance},
    reference::flip::{
        Faces, Model, Room, Sorted, cut_cells, extrapolate, find_change, gather_centers,
        gather_faces,
    },
    solve::{SolveError, trace::Traced},
};

/// The 27 steps to a cell and its neighbours.
fn neighborhood() -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1])
}

/// Particles of the 27 cells about one, and the least and the greatest of their velocities.
struct About {
    count: f64,
    low: DVec3,
    high: DVec3,
}

fn about(bricks: &Bricks, sorted: &Sorted, element: u32, cell_size: f64) -> About {
    let mut about = About {
        count: 0.0,
        low: DVec3::splat(f64::INFINITY),
        high: DVec3::splat(f64::NEG_INFINITY),
    };
    for offset in neighborhood() {
        for i in sorted.of(bricks.near(element, offset)) {
            let v = sorted.cloud.velocity[i];
            let affine = sorted.cloud.affine.get(i);
            // Faces are at most 1.5 cells off along each axis.
            let reach = affine.map_or(0.0, |c| {
                let rows = [0, 1, 2].map(|k| c.row(k).abs().element_sum());
                2.0 * cell_size * rows.into_iter().fold(0.0, f64::max)
            });
            about.count += 1.0;
            about.low = about.low.min(v - reach);
            about.high = about.high.max(v + reach);
        }
    }
    about
}

/// Solids whose distances are off by `shift` and whose nodes by `place`, metres.
fn shifted(model: &Model, checker: &Checker<'_>, shift: f64, place: DVec3) -> Model {
    let moved = |grid: &SignedDistance| SignedDistance {
        origin: grid.origin + place,
        values: grid.values.iter().map(|&v| v + shift as f32).collect(),
        ..grid.clone()
    };
    let boundary = crate::domain::boundary::Boundary {
        samples: Vec::new(),
        distance: checker.boundary.distance.as_ref().map(moved),
        moving: checker.boundary.moving.iter().map(moved).collect(),
    };
    Model::new(&model.scene, &boundary)
}

impl Checker<'_> {
    /// What a solid's distance errs by on the device, metres.
    pub(super) fn distance_error(&self) -> f64 {
        let solids = self.boundary.distance.iter().chain(&self.boundary.moving);
        let origin = self.scene.domain.min;
        let extent = self.scene.domain.size().abs().max_element();
        let of = |grid: &SignedDistance| {
            let first = (grid.origin - origin).abs().max_element();
            U * (7.0 * (extent + first) + first + 48.0 * grid.spacing)
        };
        solids.map(of).fold(0.0, f64::max)
    }

    pub(super) fn cut_cells(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let has_solids = self.boundary.distance.is_some() || !self.boundary.moving.is_empty();
        let layout = self.layout();
        let (step, sorted) = (self.step(), self.sorted());
        let twin = cut_cells(&self.model, &step, &layout.bricks, sorted);
        let error = self.distance_error();
        let room_of = |shift: f64, place: DVec3| {
            let model = shifted(&self.model, self, shift, place);
            let step = model.step(&layout.substep);
            cut_cells(&model, &step, &layout.bricks, sorted)
        };
        let others: Vec<Room> = [-error, error]
            .into_iter()
            .filter(|_| has_solids)
            .map(|shift| room_of(shift, DVec3::ZERO))
            .collect();
        let kind = self.cells::<u32>(traced, "cell_kind")?;
        let open = self.planes(traced, "face_open")?;
        let flux = self.scalars(traced, "solid_flux")?;
        let volume = match has_solids {
            true => self.scalars(traced, "open_volume")?,
            false => twin.volume.clone(),
        };
        let has_moving = !self.boundary.moving.is_empty();
        // Which of nodes that are as near to a cell's centre is looked at tells whether a solid is near at all, and so whether
        // its velocity stands at faces that it does not touch.
        let side = |k: usize, axis: usize| if k >> axis & 1 == 0 { error } else { -error };
        let rounded: Vec<Room> = (0..8)
            .filter(|_| has_moving)
            .map(|k| room_of(0.0, DVec3::new(side(k, 0), side(k, 1), side(k, 2))))
            .collect();
        let closed = match has_moving {
            false => twin.closed_velocity.clone(),
            true => self.planes(traced, "closed_velocity")?,
        };
        let base = 8.0 * self.place();
        let wall = step.wall_velocity.map(|v| v.abs().max_element());
        let solid = step.solids.iter().map(|s| s.velocity.length());
        let speed = solid.fold(wall[0].max(wall[1]), f64::max);
        let (mut kinds, mut ties) = (Vec::new(), 0);
        let (mut opens, mut fluxes, mut volumes) = (Vec::new(), Vec::new(), Vec::new());
        let (mut closings, mut turned) = (Vec::new(), 0);
        for e in self.active() {
            let is_tie = others.iter().any(|other| other.kind[e] != twin.kind[e]);
            if is_tie {
                ties += 1;
            } else {
                kinds.push(pair_of(e, f64::from(kind[e]), f64::from(twin.kind[e]), 0.0));
            }
            let moved = |of: &dyn Fn(&Room) -> f64| {
                let moved = others.iter().map(of).fold(0.0, f64::max);
                base + 3.0 * moved
            };
            let face = moved(&|other| other.open[e].distance(twin.open[e]));
            opens.push(pair(e, open[e], twin.open[e], face));
            let through = moved(&|other| (other.solid_flux[e] - twin.solid_flux[e]).abs());
            let tolerance = 6.0 * base * speed + through;
            fluxes.push(pair_of(e, flux[e], twin.solid_flux[e], tolerance));
            if has_moving {
                let exact = twin.closed_velocity[e];
                let mut answers = others.iter().chain(&rounded);
                if answers.any(|other| other.closed_velocity[e] != exact) {
                    turned += 1;
                } else {
                    closings.push(pair(e, closed[e], exact, 2.0 * U * exact.length()));
                }
            }
            if has_solids {
                let tolerance = moved(&|other| (other.volume[e] - twin.volume[e]).abs());
                volumes.push(pair_of(e, volume[e], twin.volume[e], tolerance));
            }
        }
        let room = Room {
            kind,
            open,
            solid_flux: flux,
            volume,
            closed_velocity: closed,
        };
        self.table.add(&KIND, &kinds, ties);
        self.table.add(&OPEN, &opens, 0);
        self.table.add(&FLUX, &fluxes, 0);
        if has_solids {
            self.table.add(&VOLUME, &volumes, 0);
        }
        if has_moving {
            self.table.add(&CLOSED, &closings, turned);
        }
        self.room = Some(room);
        Ok(())
    }

    /// After the last of the three axes.
    pub(super) fn gather_faces(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        if traced.uniform::<u32>("axis")? < 2 {
            return Ok(());
        }
        let Layout { bricks, .. } = self.layout();
        let (step, sorted) = (self.step(), self.sorted());
        let twin = gather_faces(&self.model, &step, bricks, sorted, self.room());
        let found = self.read_faces(traced)?;
        let place = self.place();
        let tolerance = |e: usize| {
            let about = about(bricks, sorted, e as u32, self.model.cell_size());
            if about.count == 0.0 {
                return DVec3::ZERO;
            }
            let most = about.low.abs().max(about.high.abs());
            let part = (12.0 * place * about.count / twin.weight[e]).min(DVec3::ONE);
            part * (about.high - about.low) + U * (about.count + 20.0) * most
        };
        let all: Vec<_> = self
            .active()
            .into_par_iter()
            .map(|e| {
                let old = tolerance(e).length();
                let new = old + 2.0 * U * (step.velocity_step.length() + twin.velocity[e].length());
                (
                    pair(e, found.change[e], twin.change[e], old),
                    pair(e, found.velocity[e], twin.velocity[e], new),
                )
            })
            .collect();
        let (old, new): (Vec<_>, Vec<_>) = all.into_iter().unzip();
        let known = self.active();
        self.table.add(&OLD, &old, 0);
        self.table.add(&NEW, &new, 0);
        self.table
            .add_exact(&KNOWN, &found.layer[known.clone()], &twin.layer[known]);
        Ok(())
    }

    pub(super) fn gather_centers(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let settings = self.model.settings();
        let Layout { bricks, .. } = self.layout();
        let (step, sorted, room) = (self.step(), self.sorted(), self.room());
        let twin = gather_centers(&self.model, &step, bricks, sorted, room);
        let found = self.scalars(traced, "density")?;
        let excess = match settings.density_correction {
            true => self.scalars(traced, "density_excess")?,
            false => Vec::new(),
        };
        let distance = match self.model.settings().surface {
            crate::scene::flip::Surface::GhostFluid => self.scalars(traced, "liquid_distance")?,
            crate::scene::flip::Surface::Voxel => Vec::new(),
        };
        let share = 1.0 / f64::from(settings.particles_per_cell);
        let place = self.place();
        let size = self.model.cell_size();
        let all: Vec<_> = self
            .active()
            .into_par_iter()
            .map(|e| {
                let count = about(bricks, sorted, e as u32, size).count;
                // Half of what the cells' open volumes leave: walls leave hats another part than cells.
                let part = |step: i32| if step == 0 { 0.75 } else { 0.125 };
                let open: f64 = neighborhood()
                    .map(|offset| {
                        let volume = room.volume[bricks.near(e as u32, offset) as usize];
                        offset.into_iter().map(part).product::<f64>() * volume
                    })
                    .sum();
                let least = (0.5 * open).max(0.02);
                let relative = (count * share / least).min(twin.density[e].max(1.0));
                let error = share * place * 9.0 * count / least
                    + relative * (U * (count + 40.0) + 16.0 * place);
                let dense = pair_of(e, found[e], twin.density[e], error);
                let over = excess
                    .get(e)
                    .map(|&value| pair_of(e, value, twin.excess[e], error));
                let off = distance.get(e).map(|&value| {
                    let exact = twin.distance[e];
                    let tolerance = surface_error(exact / size, error) * size;
                    pair_of(e, value, exact, tolerance)
                });
                (dense, over, off)
            })
            .collect();
        let dense: Vec<_> = all.iter().map(|all| all.0).collect();
        self.table.add(&DENSITY, &dense, 0);
        if !excess.is_empty() {
            let pairs: Vec<_> = all.iter().filter_map(|all| all.1).collect();
            self.table.add(&EXCESS, &pairs, 0);
        }
        if !distance.is_empty() {
            let pairs: Vec<_> = all.iter().filter_map(|all| all.2).collect();
            self.table.add(&DISTANCE, &pairs, 0);
        }
        Ok(())
    }

    pub(super) fn read_faces(&self, traced: Traced<'_>) -> Result<Faces, SolveError> {
        Ok(Faces {
            velocity: self.planes(traced, "face_velocity")?,
            change: self.planes(traced, "face_change")?,
            layer: self.cells(traced, "face_layer")?,
            weight: Vec::new(),
        })
    }

    pub(super) fn find_change(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let Some(mut twin) = self.faces.take() else {
            return Ok(());
        };
        let before = twin.change.clone();
        let Layout { bricks, .. } = self.layout();
        find_change(&self.model, bricks, self.room(), &mut twin);
        let found = self.read_faces(traced)?;
        let pairs: Vec<_> = (self.active())
            .map(|e| {
                let tolerance = U * (twin.velocity[e].length() + before[e].length());
                pair(e, found.change[e], twin.change[e], tolerance)
            })
            .collect();
        self.table.add(&CHANGE, &pairs, 0);
        let active = self.active();
        self.table
            .add_exact(&LAYER, &found.layer[active.clone()], &twin.layer[active]);
        Ok(())
    }

    pub(super) fn extrapolate(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let layer = traced.uniform::<u32>("layer")?;
        let Some(before) = self.faces.take() else {
            return Ok(());
        };
        let step = self.step();
        if layer > step.layers as u32 {
            return Ok(());
        }
        let Layout { bricks, .. } = self.layout();
        let mut twin = before.clone();
        extrapolate(&step, bricks, layer, &mut twin);
        let found = self.read_faces(traced)?;
        let largest = |e: usize| {
            let sides = (0..7).map(|k| {
                let mut offset = [0; 3];
                if k < 6 {
                    offset[k / 2] = k as i32 % 2 * 2 - 1;
                }
                let other = bricks.near(e as u32, offset) as usize;
                before.velocity[other].length() + before.change[other].length()
            });
            sides.fold(step.velocity_step.length(), f64::max)
        };
        let all: Vec<_> = self
            .active()
            .map(|e| {
                let tolerance = 12.0 * U * largest(e);
                (
                    pair(e, found.velocity[e], twin.velocity[e], tolerance),
                    pair(e, found.change[e], twin.change[e], tolerance),
                )
            })
            .collect();
        let (velocities, changes): (Vec<_>, Vec<_>) = all.into_iter().unzip();
        let active = self.active();
        self.table.add(&SPREAD_VELOCITY, &velocities, 0);
        self.table.add(&SPREAD_CHANGE, &changes, 0);
        self.table.add_exact(
            &SPREAD_LAYER,
            &found.layer[active.clone()],
            &twin.layer[active],
        );
        Ok(())
    }
}

/// What the distance of the surface, in cells, errs by where the density does by `error`: the density as a function of
/// it is s − s²/2, whose inverse is steep where the water is full.
fn surface_error(distance: f64, error: f64) -> f64 {
    let s = distance.abs().min(1.0);
    let slope = 1.0 - s;
    let moved = |by: f64| (1.0 - (slope * slope + by).max(0.0).sqrt() - s).abs();
    moved(2.0 * error).max(moved(-2.0 * error)) + 24.0 * U
}
