//! From solids to velocities at faces: cut cells, particle-to-grid transfer, extrapolation.

use glam::DVec3;

use crate::{
    comparison::{Io, PassResult},
    solids::{FLOWED, GRID, SHAPED, TURNED},
    table::{each, pair},
};
use swell_domain::{
    boundary::{Boundary, Shape},
    flip::VON_KARMAN,
    signed_distance::SignedDistance,
};
use swell_reference::flip::{
    Depth, FlipSubstep, LEAST_FILM, Model, OpenSpace, Sensitivity, Solid,
    cut_cells as reference_cut_cells, extrapolate as reference_extrapolate,
    find_change as reference_find_change, find_depth, find_excess as reference_find_excess,
    find_water as reference_find_water, friction_rates, gather_centers as reference_gather_centers,
    gather_faces as reference_gather_faces, growth_over, is_near_half, let_in as reference_let_in,
    sensitivity, wall_friction as reference_wall_friction,
};
use swell_scene::flip::Surface;
use swell_solve::flip::buffers;

use super::{FlipState, elements::neighborhood, rows::*};

/// Change of the velocity of a closed face, as a part of the fastest node of a shape that changes,
/// by which another solid is taken to be the nearest.
const CHANGES: f64 = 1e-3;

/// Distances up to this many times a cell plus a node spacing decide how solids cut cells.
const REACH_OF_SHAPES: f64 = 4.0;

/// Number of particles in the 27 cells around one, and the range of their velocities.
struct Neighborhood {
    count: f64,
    low: DVec3,
    high: DVec3,
}

impl FlipState {
    fn about(&self, element: usize) -> Neighborhood {
        let (bricks, sorted) = (&self.elements().bricks, self.sorted());
        let mut about = Neighborhood {
            count: 0.0,
            low: DVec3::splat(f64::INFINITY),
            high: DVec3::splat(f64::NEG_INFINITY),
        };
        for offset in neighborhood() {
            for i in sorted.of(bricks.near(element as u32, offset)) {
                let v = sorted.cloud.velocity[i];
                let affine = sorted.cloud.affine.get(i);
                // Faces are at most 1.5 cells away along each axis.
                let reach = affine.map_or(0.0, |c| {
                    let rows = [0, 1, 2].map(|k| c.row(k).abs().element_sum());
                    2.0 * self.model.cell_size() * rows.into_iter().fold(0.0, f64::max)
                });
                about.count += 1.0;
                about.low = about.low.min(v - reach);
                about.high = about.high.max(v + reach);
            }
        }
        about
    }

    /// Returns the error of a solid's distance on the device, metres.
    pub(super) fn distance_error(&self) -> f64 {
        let solids = self.boundary.distance.iter().chain(&self.boundary.moving);
        let origin = self.scene.domain.min;
        let extent = self.scene.domain.size().abs().max_element();
        let of = |grid: &SignedDistance| {
            let first = (grid.origin - origin).abs().max_element();
            GRID.of([extent + first, first, grid.spacing])
        };
        let placed = solids.map(of).fold(0.0, f64::max);
        let reach = REACH_OF_SHAPES * (self.model.cell_size() + self.scene.particle_spacing());
        let placed = match self.boundary.shape_nodes() {
            0 => placed,
            _ => SHAPED.of([placed, reach]),
        };
        // Outside its grid a solid has no effect.
        let solids = self.scene.moving_solids.iter().zip(&self.boundary.moving);
        let turned = solids.filter(|(solid, _)| solid.turns());
        let turned = turned.map(|(solid, grid)| {
            let pose = solid.pose(&self.bodies, self.elements().substep.start);
            let centre = (pose.centre - origin).length();
            TURNED.of([placed, grid.reach(pose.rest), centre])
        });
        turned.fold(placed, f64::max)
    }

    /// Returns the reference's open space with the solids' distances shifted by `shift` and their
    /// nodes by `place`, metres.
    fn shifted_room(&self, shift: f64, place: DVec3) -> OpenSpace {
        self.with_shifted_solids(shift, place, |model, step| {
            reference_cut_cells(model, step, &self.elements().bricks)
        })
    }

    /// Whether rounding may decide if a wall leaves a layer of the hat function around a cell's
    /// centre anything.
    fn has_wall_near_layer(&self, step: &FlipSubstep<'_>, element: usize) -> bool {
        let cell = self.elements().bricks.cell(element as u32);
        let place = PARTS.of([self.place()]);
        (0..3).any(|axis| {
            let center = f64::from(cell[axis]) + 0.5;
            let walls = [step.cut.min[axis], step.cut.max[axis]];
            walls.into_iter().any(|wall| {
                let off = (2.0 * wall - (2.0 * wall).round()).abs();
                (wall - center).abs() < 1.0 + place && off > 0.0 && off <= 2.0 * place
            })
        })
    }

    /// Calls `of` with solids whose distances are shifted by `shift` and whose nodes by `place`,
    /// metres.
    pub(super) fn with_shifted_solids<T>(
        &self,
        shift: f64,
        place: DVec3,
        of: impl FnOnce(&Model, &FlipSubstep<'_>) -> T,
    ) -> T {
        let moved = |grid: &SignedDistance| SignedDistance {
            origin: grid.origin + place,
            values: grid.values.iter().map(|&v| v + shift as f32).collect(),
            ..grid.clone()
        };
        let boundary = Boundary {
            samples: Vec::new(),
            distance: self.boundary.distance.as_ref().map(moved),
            moving: self.boundary.moving.iter().map(moved).collect(),
            moving_samples: Vec::new(),
            offsets: self.boundary.offsets.clone(),
            shapes: (self.boundary.shapes.iter())
                .map(|shape| {
                    let field = shape.as_ref()?.field.moved(place).shifted(shift);
                    let samples = None;
                    Some(Shape { field, samples })
                })
                .collect(),
        };
        let model = Model::new(&self.model.scene, &boundary);
        let step = model.step(&self.elements().substep, &self.absorbers, &self.bodies);
        of(&model, &step)
    }
}

/// Reads the layers of the hats of all cells; of those that no solid cuts they mean nothing.
fn open_layers(io: &Io<'_>, cells: usize) -> Result<Vec<[f64; 4]>, swell_solve::SolveError> {
    let packed = io.after.get(buffers::OPEN_LAYERS, cells)?;
    let unpacked = |[low, high]: [u32; 2]| {
        [low & 0xffff, low >> 16, high & 0xffff, high >> 16].map(|part| f64::from(part) / 65_535.0)
    };
    Ok(packed.into_iter().map(unpacked).collect())
}

pub(super) fn cut_cells(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    state.refresh_bodies(io)?;
    let has_moving = !state.boundary.moving.is_empty();
    let has_solids = state.boundary.distance.is_some() || has_moving;
    let (elements, step) = (state.elements(), state.step());
    let reference = reference_cut_cells(&state.model, &step, &elements.bricks);
    let error = state.distance_error();
    let others: Vec<OpenSpace> = [-error, error]
        .into_iter()
        .filter(|_| has_solids)
        .map(|shift| state.shifted_room(shift, DVec3::ZERO))
        .collect();
    // If several nodes are equally close to a cell's centre, the chosen one decides whether a solid
    // is near at all, and so whether its velocity appears at faces that it does not touch.
    let side = |k: usize, axis: usize| if k >> axis & 1 == 0 { error } else { -error };
    let rounded: Vec<OpenSpace> = (0..8)
        .filter(|_| has_moving)
        .map(|k| state.shifted_room(0.0, DVec3::new(side(k, 0), side(k, 1), side(k, 2))))
        .collect();
    let space = OpenSpace {
        kind: io.after.get(buffers::CELL_KIND, elements.cells)?,
        open: elements.planes(&io.after, buffers::FACE_OPEN)?,
        solid_flux: elements.scalars(&io.after, buffers::SOLID_FLUX)?,
        volume: match has_solids {
            true => elements.scalars(&io.after, buffers::OPEN_VOLUME)?,
            false => reference.volume.clone(),
        },
        layers: match has_solids {
            true => open_layers(io, elements.cells)?,
            false => reference.layers.clone(),
        },
        hats: match has_solids {
            true => elements.scalars(&io.after, buffers::OPEN_HATS)?,
            false => reference.hats.clone(),
        },
        weight: match has_solids {
            true => elements.planes(&io.after, buffers::FACE_WEIGHT)?,
            false => reference.weight.clone(),
        },
        closed_velocity: match has_moving {
            true => elements.planes(&io.after, buffers::CLOSED_VELOCITY)?,
            false => reference.closed_velocity.clone(),
        },
    };
    let has_shapes = state.boundary.shape_nodes() > 0;
    let shapes = step.solids.iter().filter_map(|solid| solid.shape.as_ref());
    let fastest_shape = shapes.map(|shape| shape.fastest).fold(0.0, f64::max);
    let cut = CUT.of([state.place()]);
    let wall = step.wall_velocity.map(|v| v.abs().max_element());
    let solid = step.solids.iter().map(Solid::fastest);
    let speed = solid.fold(wall[0].max(wall[1]), f64::max);
    let moved = |of: &dyn Fn(&OpenSpace) -> f64| others.iter().map(of).fold(0.0, f64::max);
    io.table.each(&KIND, elements.active(), |e| {
        let is_tie = others
            .iter()
            .any(|other| other.kind[e] != reference.kind[e]);
        (!is_tie).then(|| pair(e, space.kind[e], f64::from(reference.kind[e]), []))
    });
    io.table.each(&OPEN, elements.active(), |e| {
        let moved = moved(&|other| other.open[e].distance(reference.open[e]));
        pair(e, space.open[e], reference.open[e], [cut, moved])
    });
    let carried = |of: &dyn Fn(&OpenSpace) -> f64| {
        let rounded = rounded.iter().filter(|_| has_shapes).map(of);
        rounded.fold(moved(of), f64::max)
    };
    io.table.each(&FLUX, elements.active(), |e| {
        let moved = carried(&|other| (other.solid_flux[e] - reference.solid_flux[e]).abs());
        pair(
            e,
            space.solid_flux[e],
            reference.solid_flux[e],
            [cut, speed, moved],
        )
    });
    if has_solids {
        io.table.each(&VOLUME, elements.active(), |e| {
            let moved = moved(&|other| (other.volume[e] - reference.volume[e]).abs());
            pair(e, space.volume[e], reference.volume[e], [cut, moved])
        });
        io.table.each(&HATS, elements.active(), |e| {
            let moved = moved(&|other| (other.hats[e] - reference.hats[e]).abs());
            pair(e, space.hats[e], reference.hats[e], [cut, moved])
        });
        io.table.each(&FACE_WEIGHT, elements.active(), |e| {
            let moved = moved(&|other| other.weight[e].distance(reference.weight[e]));
            let growth = growth_over(&state.model, &step, &elements.bricks, e as u32);
            let turned = growth.map_or(0.0, |growth| error / growth);
            pair(
                e,
                space.weight[e],
                reference.weight[e],
                [cut, moved, turned],
            )
        });
        for k in 0..4 {
            io.table.each(&LAYERS, elements.active(), |e| {
                // Only cells that solids cut have layers.
                let has_layers = reference.hats[e] < 1.0 && space.hats[e] < 1.0;
                let part = |of: &OpenSpace| if has_layers { of.layers[e][k] } else { 1.0 };
                let moved = moved(&|other| (other.layers[e][k] - reference.layers[e][k]).abs());
                let is_tie = has_layers && state.has_wall_near_layer(&step, e);
                (!is_tie).then(|| pair(e, part(&space), part(&reference), [cut, moved]))
            });
        }
    }
    if has_moving {
        io.table.each(&CLOSED, elements.active(), |e| {
            let exact = reference.closed_velocity[e];
            // A shape's velocity changes with any move of its nodes: little, or much where another
            // solid becomes the nearest.
            let most = match has_shapes {
                true => CHANGES * fastest_shape,
                false => 0.0,
            };
            let mut answers = others.iter().chain(&rounded);
            let is_tie = answers.any(|other| other.closed_velocity[e].distance(exact) > most);
            let change = carried(&|other| other.closed_velocity[e].distance(exact));
            let shape = match has_shapes {
                true => FLOWED.of([fastest_shape, change]),
                false => 0.0,
            };
            let at = elements.bricks.cell(e as u32).map(|c| f64::from(c) + 0.5);
            let x = state.model.cell_size() * DVec3::from_array(at);
            let far = step.solids.iter().map(|solid| {
                solid.passage.spin.length() * (x.length() + solid.pose.centre.length())
            });
            let far = far.fold(0.0, f64::max);
            let magnitudes = [exact.length(), far, shape];
            (!is_tie).then(|| pair(e, space.closed_velocity[e], exact, magnitudes))
        });
    }
    state.space = Some(space);
    Ok(())
}

/// Compares the faces after the last of the three axes.
pub(super) fn gather_faces(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    if io.before.window(&buffers::AXES)?[0] < 2 {
        return Ok(());
    }
    let (elements, step) = (state.elements(), state.step());
    let (bricks, sorted) = (&elements.bricks, state.sorted());
    let reference = reference_gather_faces(&state.model, &step, bricks, sorted, state.space());
    let found = elements.faces(&io.after)?;
    let place = state.place();
    let error = |e: usize| {
        let Neighborhood { count, low, high } = state.about(e);
        if count == 0.0 {
            return 0.0;
        }
        let (range, most) = (high - low, low.abs().max(high.abs()));
        let along = |axis: usize| {
            let weight = reference.weight[e][axis];
            OF_FACE.of([place, count, weight, range[axis], most[axis]])
        };
        DVec3::from_array([0, 1, 2].map(along)).length()
    };
    let active = elements.active();
    let errors = each(active.clone(), error);
    let error = |e: usize| errors[e - active.start];
    io.table.each(&OLD, active.clone(), |e| {
        pair(e, found.change[e], reference.change[e], [error(e)])
    });
    io.table.each(&NEW, active.clone(), |e| {
        let magnitudes = [
            error(e),
            step.velocity_step.length(),
            reference.velocity[e].length(),
        ];
        pair(e, found.velocity[e], reference.velocity[e], magnitudes)
    });
    io.table.add_exact(
        &KNOWN,
        &found.layer[active.clone()],
        &reference.layer[active],
    );
    Ok(())
}

pub(super) fn gather_centers(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let settings = state.model.settings();
    let (elements, step, space) = (state.elements(), state.step(), state.space());
    let bricks = &elements.bricks;
    let mut reference =
        reference_gather_centers(&state.model, &step, bricks, state.sorted(), space);
    state.fill(&io.before, &mut reference)?;
    let share = 1.0 / f64::from(settings.particles_per_cell);
    let place = state.place();
    let error = |e: usize| {
        let count = state.about(e).count;
        // Half of the volume that is open around the cell: walls cut a different part of hat
        // functions than of cells.
        let part = |step: i32| if step == 0 { 0.75 } else { 0.125 };
        let open: f64 = neighborhood()
            .map(|offset| {
                let volume = space.volume[bricks.near(e as u32, offset) as usize];
                offset.into_iter().map(part).product::<f64>() * volume
            })
            .sum();
        let least = (0.5 * open.min(space.hats[e])).max(0.02);
        let relative = (count * share / least).min(reference[e].max(1.0));
        OF_CENTER.of([share, place, count, least, relative])
    };
    let active = elements.active();
    let errors = each(active.clone(), error);
    let error = |e: usize| errors[e - active.start];
    let density = elements.scalars(&io.after, buffers::DENSITY)?;
    io.table.each(&RELATIVE_DENSITY, active.clone(), |e| {
        pair(e, density[e], reference[e], [error(e)])
    });
    state.density = Some(density);
    Ok(())
}

/// Compares the pass, from the densities on the device.
pub(super) fn find_water(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step, space) = (state.elements(), state.step(), state.space());
    let (bricks, density) = (&elements.bricks, state.density());
    let depth = find_depth(&state.model, &step, bricks, space, density);
    let (reference, distances) = reference_find_water(&state.model, bricks, space, &depth);
    let cut = CUT.of([state.place()]);
    let active = elements.active();
    // Without averaging, a cell's own density leads to the same decision on both sides.
    let looked = each(active.clone(), |e| {
        let about = neighborhood().map(|offset| density[bricks.near(e as u32, offset) as usize]);
        let mean = OF_MEAN.of([about.fold(depth[e].share, f64::max)]);
        let is_tie = is_near_half(&step, bricks, space, e as u32, NEAR_HALF.of([cut, mean]));
        (mean, is_tie)
    });
    let looked = |e: usize| looked[e - active.start];
    let size = state.model.cell_size();
    let of_half = |e: usize| OF_HALF.of([looked(e).0]);
    let moved = |e: usize| {
        let Sensitivity { to_tilt, to_water } =
            sensitivity(&step, bricks, space, &depth[e], e as u32);
        let layers = OF_LAYERS.of([of_half(e), to_water]);
        surface_moved(
            depth[e].cells,
            OF_SHARE.of([layers, OF_SOLID.of([to_tilt])]),
        )
    };
    let is_averaged = |e: usize| depth[e].share != density[e];
    let is_near = |e: usize| {
        let Depth { share, cells, .. } = depth[e];
        let is_near_film = (share - LEAST_FILM).abs() <= of_half(e) || cells.abs() <= moved(e);
        (share - 0.5).abs() <= of_half(e) || (space.hats[e] < 1.0 && is_near_film)
    };
    let is_tie = |e: usize| looked(e).1 || (is_averaged(e) && is_near(e));
    let kind = io.after.get(buffers::CELL_KIND, elements.cells)?;
    io.table.each(&WATER, active.clone(), |e| {
        (!is_tie(e)).then(|| pair(e, kind[e], f64::from(reference[e]), []))
    });
    if state.model.settings().surface == Surface::GhostFluid {
        let distance = elements.scalars(&io.after, buffers::LIQUID_DISTANCE)?;
        io.table.each(&DISTANCE, active.clone(), |e| {
            (!is_tie(e)).then(|| pair(e, distance[e], distances[e], [moved(e), size]))
        });
    }
    let space = OpenSpace {
        kind,
        ..space.clone()
    };
    state.space = Some(space);
    Ok(())
}

pub(super) fn find_excess(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, density) = (state.elements(), state.density());
    let reference = reference_find_excess(&state.step(), &elements.bricks, state.space(), density);
    let excess = elements.scalars(&io.after, buffers::DENSITY_EXCESS)?;
    let cut = CUT.of([state.place()]);
    io.table.each(&EXCESS, elements.active(), |e| {
        let size = (density[e] - 1.0).abs().min(1.0) + density[e];
        pair(e, excess[e], reference[e], [size, cut])
    });
    Ok(())
}

/// Compares the pass, from the densities, the flux and the excess on the device.
pub(super) fn let_in(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, density) = (state.elements(), state.density());
    let corrects = state.model.settings().density_correction;
    let mut excess = match corrects {
        true => elements.scalars(&io.before, buffers::DENSITY_EXCESS)?,
        false => Vec::new(),
    };
    let mut reference = state.space().clone();
    reference.solid_flux = elements.scalars(&io.before, buffers::SOLID_FLUX)?;
    let (step, size) = (state.step(), state.model.cell_size());
    let inlets = state.model.scene.inlets(step.start, step.length);
    let bricks = &elements.bricks;
    reference_let_in(&inlets, size, bricks, &mut reference, density, &mut excess);
    let found = elements.scalars(&io.after, buffers::SOLID_FLUX)?;
    let rates = inlets.iter().map(|inlet| inlet.rate);
    let rate = size * rates.fold(0.0, f64::max);
    let cut = CUT.of([state.place()]);
    io.table.each(&LET_IN, elements.active(), |e| {
        let sizes = [
            rate * (1.0 + density[e]),
            cut,
            reference.solid_flux[e].abs(),
        ];
        pair(e, found[e], reference.solid_flux[e], sizes)
    });
    if corrects {
        let found = elements.scalars(&io.after, buffers::DENSITY_EXCESS)?;
        io.table.each(&LEFT_EXCESS, elements.active(), |e| {
            pair(e, found[e], excess[e], [])
        });
    }
    state.space = Some(OpenSpace {
        solid_flux: found,
        ..reference
    });
    Ok(())
}

pub(super) fn wall_friction(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step) = (state.elements(), state.step());
    let (bricks, space) = (&elements.bricks, state.space());
    let before = elements.faces(&io.before)?;
    let rates = friction_rates(&state.model, &step, bricks, space, &before);
    let mut reference = before.clone();
    reference_wall_friction(&state.model, &step, bricks, space, &mut reference);
    let found = elements.faces(&io.after)?;
    let place = state.place();
    // Two components for each of four walls, each bounded by the largest speed around.
    let at_most = |e: usize| {
        let speed = elements.largest_about(e, |e| before.change[e].length());
        4.0 * 2f64.sqrt() * VON_KARMAN * VON_KARMAN * speed / state.model.cell_size()
    };
    io.table.each(&FRICTION, elements.active(), |e| {
        let (moved, slowed) = (step.length * at_most(e), step.length * rates[e].length());
        let magnitudes = [place, moved, slowed, before.velocity[e].length()];
        pair(e, found.velocity[e], reference.velocity[e], magnitudes)
    });
    Ok(())
}

pub(super) fn find_change(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    state.refresh_bodies(io)?;
    let elements = state.elements();
    let mut reference = elements.faces(&io.before)?;
    let before = reference.change.clone();
    reference_find_change(
        &state.model,
        &elements.bricks,
        state.space(),
        &mut reference,
    );
    let found = elements.faces(&io.after)?;
    let active = elements.active();
    io.table.each(&CHANGE, active.clone(), |e| {
        let size = reference.velocity[e].length() + before[e].length();
        pair(e, found.change[e], reference.change[e], [size])
    });
    io.table.add_exact(
        &LAYER,
        &found.layer[active.clone()],
        &reference.layer[active],
    );
    Ok(())
}

pub(super) fn extrapolate(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let layer = io.before.window(&buffers::LAYERS)?[0];
    let (elements, step) = (state.elements(), state.step());
    if layer > step.layers as u32 {
        return Ok(());
    }
    let before = elements.faces(&io.before)?;
    let mut reference = before.clone();
    reference_extrapolate(&step, &elements.bricks, layer, &mut reference);
    let found = elements.faces(&io.after)?;
    let largest = |e: usize| {
        let sides = (0..7).map(|k| {
            let mut offset = [0; 3];
            if k < 6 {
                offset[k / 2] = k as i32 % 2 * 2 - 1;
            }
            let other = elements.bricks.near(e as u32, offset) as usize;
            before.velocity[other].length() + before.change[other].length()
        });
        sides.fold(step.velocity_step.length(), f64::max)
    };
    let active = elements.active();
    io.table.each(&SPREAD_VELOCITY, active.clone(), |e| {
        pair(e, found.velocity[e], reference.velocity[e], [largest(e)])
    });
    io.table.each(&SPREAD_CHANGE, active.clone(), |e| {
        pair(e, found.change[e], reference.change[e], [largest(e)])
    });
    io.table.add_exact(
        &SPREAD_LAYER,
        &found.layer[active.clone()],
        &reference.layer[active],
    );
    Ok(())
}

/// Returns the change of the surface distance, in cells, if the density changes by `error`: the
/// density as a function of the distance is s − s²/2, whose inverse is steep where the cell is
/// full.
fn surface_moved(distance: f64, error: f64) -> f64 {
    let s = distance.abs().min(1.0);
    let slope = 1.0 - s;
    let moved = |by: f64| (1.0 - (slope * slope + by).max(0.0).sqrt() - s).abs();
    moved(2.0 * error).max(moved(-2.0 * error))
}

#[cfg(test)]
mod tests {
    use super::{OF_HALF, surface_moved};
    use swell_compare::rounding::U;

    /// The steps of `flip/find_water`, in f32.
    fn device(density: f32) -> f64 {
        let off = density - 0.5;
        f64::from(off.signum() * (1.0 - (1.0 - 2.0 * off.abs()).max(0.0).sqrt()))
    }

    fn exact(density: f32) -> f64 {
        let off = f64::from(density) - 0.5;
        off.signum() * (1.0 - (1.0 - 2.0 * off.abs()).sqrt())
    }

    #[test]
    fn the_surfaces_distance_is_within_its_bound_where_there_is_next_to_no_water() {
        let mut is_needed = false;
        for density in (1..2000).map(|i| 1.1f32.powi(-i / 8) / (1.0 + i as f32 / 3e3)) {
            let (found, expected) = (device(density), exact(density));
            let within =
                |error: f64| (found - expected).abs() <= surface_moved(expected, error) + 24.0 * U;
            assert!(within(OF_HALF.of([0.0])), "{density}: {found} {expected}");
            is_needed |= !within(16.0 * U * f64::from(density));
        }
        assert!(is_needed, "a bound by the density alone holds as well");
    }
}
