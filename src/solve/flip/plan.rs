//! Plan of FLIP's passes and buffers.

use crate::{
    effects::{self, forces},
    plan::{BufferTable, Counts, Plan, in_order},
    pressure::{self, bodies},
};
use swell_domain::{
    bricks::{CELLS, table_dims},
    flip::{layers, stored_cells},
    forces::Medium,
};
use swell_gpu::{buffer::BufferSpec, program::PassSpec, recording::Command, sort};
use swell_scene::{
    FlipScene,
    flip::{Precision, Surface, Transfer},
};

use super::{
    buffers::*,
    record::{Commands, FIRST_LAYER, WALL_FRICTION, contracts},
};

/// Faces of one component on one side of a cell that the cell's particles reach.
const FACES: usize = 9;

/// Plans FLIP with its projection for `scene`; `moves` says whether it moves particles.
pub(crate) fn plan(scene: &FlipScene, counts: Counts, moves: bool) -> Plan {
    let flip = scene.settings();
    let mut plan = Plan::bare(counts, scene.domain.cells(flip.cell_size));
    plan.moves = moves;
    let effects = effects::of_flip(scene, counts.bricks.cells());
    let mut table = buffers(&plan, scene);
    for (name, addition) in &effects {
        table.extend(name, addition.buffers.clone());
    }
    let settings = &flip.pressure;
    table.append(pressure::planned(
        settings,
        extent(&plan, scene),
        counts.bricks.slots,
    ));
    table.extend("bodies", bodies::planned(scene, plan.grid_dims));
    plan.declare(table);
    let commands = Commands::new(&plan, scene, &effects);
    let defines = conditions(&plan, scene);
    let plain = |name| PassSpec {
        name,
        defines: defines.clone(),
        constants: match name {
            WALL_FRICTION => vec![("NO_SLIP", f64::from(scene.no_slip_bits()))],
            _ => Vec::new(),
        },
    };
    plan.add_passes(in_order(commands.before_projection()).map(&plain), &effects);
    plan.add_passes(
        pressure::passes(
            settings,
            flip.surface,
            extent(&plan, scene),
            scene.is_periodic(),
        ),
        &[],
    );
    plan.add_passes(
        in_order(commands.between_projections()).map(&plain),
        &effects,
    );
    plan.add_passes(in_order(commands.after_projection()).map(&plain), &effects);
    plan
}

/// Returns every command of a substep, with those of projections on any brick layout.
pub(crate) fn commands(plan: &Plan, scene: &FlipScene) -> Vec<Command> {
    let flip = scene.settings();
    let effects = effects::of_flip(scene, plan.counts.bricks.cells());
    let commands = Commands::new(plan, scene, &effects);
    let projection = pressure::all_commands(flip.pressure.preconditioner, extent(plan, scene));
    let before = commands.before_projection().cloned();
    let between = commands.between_projections().cloned();
    let after = commands.after_projection().cloned();
    before
        .chain(projection)
        .chain(between)
        .chain(after)
        .collect()
}

/// Returns what the scene's projection does.
pub(super) fn extent(plan: &Plan, scene: &FlipScene) -> pressure::Extent {
    pressure::Extent {
        has_correction: scene.settings().density_correction,
        has_bodies: scene.has_bodies(),
        has_contraction: contracts(plan, scene),
    }
}

/// Returns whether particles that are too close to each other are pushed apart: with the density
/// correction, which only sees cells, and for a solver whose own corrections only act on
/// compression.
pub(super) fn pushes(plan: &Plan, scene: &FlipScene) -> bool {
    scene.settings().density_correction || !plan.moves
}

/// Returns the defines for all passes of the plan; a pass ignores those that it does not use.
fn conditions(plan: &Plan, scene: &FlipScene) -> Vec<&'static str> {
    let flip = scene.settings();
    let all = [
        ("SOLIDS", plan.has_solids()),
        ("MOVING_SOLIDS", plan.counts.moving_nodes > 0),
        ("SHAPES", plan.counts.shape_nodes > 0),
        ("APIC", flip.transfer == Transfer::Apic),
        ("GHOST_FLUID", flip.surface == Surface::GhostFluid),
        ("CORRECTION", flip.density_correction),
        ("PUSHED", pushes(plan, scene)),
        ("PERIODIC", scene.is_periodic()),
        ("PLACES", has_places(plan, scene)),
        ("BODIES", scene.has_bodies()),
        ("BAND", flip.band.is_some()),
        (forces::MESHES, forces::has_meshes(scene, Medium::Water)),
        ("CONTRACTS", contracts(plan, scene)),
        ("F64", flip.pressure.precision == Precision::F64),
    ];
    let holding = all.into_iter().filter(|(_, holds)| *holds);
    holding.map(|(define, _)| define).collect()
}

/// Returns whether the pass that pushes particles apart reads [`PLACE`].
fn has_places(plan: &Plan, scene: &FlipScene) -> bool {
    pushes(plan, scene) && plan.has_places(scene)
}

fn buffers(plan: &Plan, scene: &FlipScene) -> BufferTable {
    let mut table = BufferTable::default();
    particles(plan, scene, &mut table);
    bricks(plan, scene, &mut table);
    if scene.is_worked_on() {
        let cells = plan.counts.bricks.wet * CELLS as usize;
        table.add("budget", BOUNDARY_WORK.sized(cells / 64));
    }
    table
}

fn particles(plan: &Plan, scene: &FlipScene, table: &mut BufferTable) {
    let flip = scene.settings();
    let n = plan.counts.particles;
    let vectors = [POSITION, VELOCITY, SORTED_POSITION];
    table.extend("flip", vectors.map(|buffer| buffer.sized(n)));
    let sorted_velocity = BufferSpec {
        bytes: is_drop(n).place(n),
        ..SORTED_VELOCITY.sized(n)
    };
    table.add("flip", sorted_velocity);
    table.add("flip", ID.sized(2 * n));
    let carried = if pushes(plan, scene) { 2 * n } else { n };
    table.watch("flip", CARRIED.sized(carried));
    if has_places(plan, scene) {
        table.add("flip", PLACE.sized(n));
    }
    let slopes = flip.attributes().len();
    if slopes > 0 {
        table.watch("flip", AFFINE.sized(slopes * n));
        table.add("flip", SORTED_AFFINE.sized(slopes * n));
    }
    let keys = [CELL_OF, SLOT_IN_CELL, PLACED, ORDER];
    table.extend("sort", keys.map(|buffer| buffer.sized(n)));
    table.add("sort", ELEMENT_COUNT.sized(1));
    table.add("flip", COUNTERS.sized(1));
}

/// Declares buffers whose size follows the number of bricks, which changes during a run.
fn bricks(plan: &Plan, scene: &FlipScene, table: &mut BufferTable) {
    let flip = scene.settings();
    let slots = plan.counts.bricks.slots;
    let wet = plan.counts.bricks.wet * CELLS as usize;
    let laden = plan.counts.bricks.laden * CELLS as usize;
    let all = slots * CELLS as usize;
    let dims = table_dims(stored_cells(plan.grid_dims, scene.periodic));
    let bricks = dims.iter().map(|&n| n as usize).product();
    table.add("flip", SURVEY_IS_WET.sized(bricks));
    let bends = if contracts(plan, scene) { slots } else { 0 };
    table.add("flip", BRICK_SLOT.sized(bricks + bends));
    table.add("flip", BRICKS.sized(slots));
    table.add("sort", CELL_START.sized(wet + 1));
    table.extend("sort", sort::scan_buffers(&CELL_START, wet));
    table.extend("flip", PARTIAL_SUMS.map(|sums| sums.sized(FACES * laden)));
    let planes = if flip.density_correction { 6 } else { 3 };
    table.watch("flip", FACE_VELOCITY.sized(planes * all));
    for planes in [FACE_CHANGE, FACE_OPEN] {
        table.watch("flip", planes.sized(3 * all));
    }
    table.extend(
        "flip",
        [FACE_LAYER, CELL_KIND].map(|cells| cells.sized(all)),
    );
    let planes = if contracts(plan, scene) { 2 } else { 1 };
    table.watch("flip", SOLID_FLUX.sized(planes * all));
    table.watch("flip", DENSITY.sized(all));
    if contracts(plan, scene) {
        table.add("flip", STRAIN_BEND.sized(slots));
    }
    if flip.density_correction {
        table.watch("flip", DENSITY_EXCESS.sized(all));
    }
    if flip.surface == Surface::GhostFluid {
        table.watch("flip", LIQUID_DISTANCE.sized(all));
    }
    if plan.has_solids() {
        table.watch("solids", OPEN_VOLUME.sized(all));
        table.watch("solids", OPEN_HATS.sized(all));
        table.add("solids", OPEN_LAYERS.sized(all));
        table.add("solids", FACE_WEIGHT.sized(3 * all));
        table.add("solids", SOLID_DISTANCE.sized(plan.counts.solid_floats()));
        if plan.counts.moving_nodes > 0 {
            table.watch("solids", CLOSED_VELOCITY.sized(3 * all));
            table.add("solids", POSED_SOLIDS.sized(1));
        } else {
            table.add("solids", SOLID_GRID.sized(1));
        }
    }
    if scene.has_inlets() {
        table.add("emitters", INLETS.sized(1));
    }
    if flip.band.is_some() {
        table.watch("flip", DEEP.sized(DEEP_VALUES * wet));
        table.add("flip", DEEP_SLOT.sized(slots));
        table.watch("flip", DEEP_DEPTH.sized(all));
    }
    let layers = layers(flip.cfl);
    table.add("flip", PARAMS.sized(1));
    table.add("flip", AXES.sized(3));
    table.add("flip", LAYERS.sized(layers));
    table.add("flip", GROUPS.sized(FIRST_LAYER + layers));
}
