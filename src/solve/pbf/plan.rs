//! Plan of PBF's passes and buffers.

use crate::{
    effects::{self, forces},
    flip,
    plan::{BufferTable, Chunk, Counts, DeviceLimits, LIST_CAPACITY, Plan, in_order},
};
use swell_domain::{forces::Medium, sph::Calibration};
use swell_gpu::{buffer::BufferSpec, program::PassSpec, recording::Command, sort};
use swell_scene::{Iteration, PbfScene, Stop};

use super::{buffers::*, record::Commands};

/// Returns the constants for every pass that declares them.
pub(super) fn shared_constants(plan: &Plan) -> Vec<(&'static str, f64)> {
    let mut constants = vec![("LIST_CAPACITY", f64::from(LIST_CAPACITY))];
    constants.extend(plan.page.map(|page| ("PAGE", page as f64)));
    constants
}

/// Particles per block of lists; a chunk consists of whole blocks.
const LIST_BLOCK: usize = 512;

/// Groups of four neighbours in a list.
const LIST_FOURS: usize = LIST_CAPACITY as usize / 4;

/// Plans PBF for `scene`.
pub(crate) fn plan(scene: &PbfScene, counts: Counts, limits: DeviceLimits) -> Plan {
    let pbf = scene.settings();
    let calibration = Calibration::new(pbf.particle_spacing, pbf.support_ratio);
    let (size, support) = (scene.domain.size(), calibration.support_radius);
    let mut plan = Plan::bare(counts, scene.period().cells(size, support));
    plan.projection =
        (scene.of_projection()).map(|grid| Box::new(flip::plan::plan(&grid, counts, false)));
    choose_lists(&mut plan, limits);
    plan.page = page(places(&plan), limits);
    let effects = effects::of_pbf(scene, counts.particles);
    let commands = Commands::new(&plan, scene, &effects);
    let mut table = buffers(&plan, scene, commands.phases.len());
    for (name, addition) in &effects {
        table.extend(name, addition.buffers.clone());
    }
    let conditions = conditions(&plan, scene);
    plan.declare(table);
    let specs = in_order(commands.substep.iter().chain(&commands.measure)).map(|name| {
        let mut spec = own(name, scene);
        spec.defines.extend_from_slice(&conditions);
        spec
    });
    plan.add_passes(specs, &effects);
    plan
}

/// Returns every command of a substep and of a frame's final measurement.
pub(crate) fn commands(plan: &Plan, scene: &PbfScene) -> Vec<Command> {
    let effects = effects::of_pbf(scene, plan.counts.particles);
    let commands = Commands::new(plan, scene, &effects);
    [commands.substep, commands.measure].concat()
}

/// Returns the number of entries of [`PREDICTED`].
pub(super) fn places(plan: &Plan) -> usize {
    plan.counts.particles + plan.counts.boundary_samples + 1
}

/// Returns the number of entries that one binding holds, if one binding cannot hold them all.
fn page(places: usize, limits: DeviceLimits) -> Option<usize> {
    let page = limits.binding.min(limits.buffer) / PREDICTED.sized(1).bytes;
    let page = usize::try_from(page).unwrap_or(usize::MAX);
    (places > page).then_some(page)
}

/// Returns the buffers for [`PREDICTED`], split at the page.
fn place_buffers(places: usize, page: Option<usize>) -> Vec<BufferSpec> {
    let low = page.unwrap_or(places);
    let mut specs = vec![PREDICTED.sized(low)];
    if places > low {
        specs.push(PREDICTED_HIGH.sized(places - low));
    }
    specs
}

fn choose_lists(plan: &mut Plan, limits: DeviceLimits) {
    let particles = plan.counts.particles;
    let block_bytes = list_of(0).sized(LIST_BLOCK * LIST_FOURS).bytes;
    let total = particles.div_ceil(LIST_BLOCK) as u64 * block_bytes;
    let blocks = limits.binding.min(limits.buffer) / block_bytes;
    plan.has_lists = total <= limits.list_budget && blocks > 0;
    let step = match plan.has_lists {
        true => usize::try_from(blocks)
            .unwrap_or(usize::MAX)
            .saturating_mul(LIST_BLOCK),
        false => particles.max(1),
    };
    plan.chunks = (0..particles)
        .step_by(step)
        .map(|first| Chunk {
            first,
            count: step.min(particles - first),
        })
        .collect();
}

/// Returns whether lists are built from [`PLACE`].
fn has_places(plan: &Plan, scene: &PbfScene) -> bool {
    plan.has_lists && plan.has_places(scene)
}

/// Returns the defines for all passes of the plan; a pass ignores those that it does not use.
fn conditions(plan: &Plan, scene: &PbfScene) -> Vec<&'static str> {
    let mut conditions = Vec::new();
    if plan.has_solids() {
        conditions.push("SOLIDS");
    }
    if plan.counts.moving_nodes > 0 {
        conditions.push("MOVING_SOLIDS");
    }
    if plan.counts.shape_nodes > 0 {
        conditions.push("SHAPES");
    }
    if plan.has_lists {
        conditions.push("NEIGHBOR_LIST");
    }
    if scene.is_periodic() {
        conditions.push("PERIODIC");
    }
    if has_places(plan, scene) {
        conditions.push("PLACES");
    }
    if scene.settings().grid_projection {
        conditions.push("PROJECTED");
    }
    if plan.page.is_some() {
        conditions.push("PAGED");
    }
    if forces::has_meshes(scene, Medium::Water) {
        conditions.push(forces::MESHES);
    }
    conditions
}

/// Returns the defines and constants of a single pass.
fn own(name: &'static str, scene: &PbfScene) -> PassSpec {
    let pbf = scene.settings();
    let is_adaptive = matches!(pbf.stop, Stop::DensityError { .. });
    let all: &[(&str, bool)] = match name {
        "pbf/predict" => &[("WALL_WORK", scene.has_movers())],
        "pbf/compute_lambda" => &[("DENSITY", is_adaptive)],
        "pbf/update_velocity" => &[("NEIGHBOR_EFFECTS", scene.effects.look_at_neighbors())],
        "pbf/exchange" => &[("CHEBYSHEV", pbf.iteration == Iteration::Chebyshev)],
        "pbf/compute_delta" => &[
            ("ARTIFICIAL_PRESSURE", pbf.artificial_pressure > 0.0),
            ("CHEBYSHEV", pbf.iteration == Iteration::Chebyshev),
            ("PRESSURE", scene.reads_multipliers()),
            ("WALL_WORK", scene.has_movers()),
        ],
        _ => &[],
    };
    let constants = match pbf.stop {
        Stop::DensityError { density_error, .. } if name == "pbf/decide" => {
            vec![("DENSITY_ERROR", density_error)]
        }
        _ => Vec::new(),
    };
    let holding = all.iter().filter(|(_, holds)| *holds);
    PassSpec {
        name,
        defines: holding.map(|(define, _)| *define).collect(),
        constants,
    }
}

fn buffers(plan: &Plan, scene: &PbfScene, phases: usize) -> BufferTable {
    let n = plan.counts.particles;
    let cells = cell_count(plan);
    let mut table = BufferTable::default();
    if plan.has_lists {
        for (index, chunk) in plan.chunks.iter().enumerate() {
            let fours = chunk.count.next_multiple_of(LIST_BLOCK) * LIST_FOURS;
            table.add("lists", list_of(index).sized(fours));
        }
        table.add("lists", NEIGHBOR_COUNT.sized(n));
        if has_places(plan, scene) {
            table.add("lists", PLACE.sized(n));
        }
    }
    table.add("sort", CELL_START.sized(cells + 1));
    table.extend("sort", sort::scan_buffers(&CELL_START, cells));
    let keys = [CELL_OF, SLOT_IN_CELL, PLACED, ORDER];
    table.extend("sort", keys.map(|buffer| buffer.sized(n)));
    table.add("sort", ELEMENT_COUNT.sized(1));

    table.add("pbf", PARAMS.sized(1));
    table.add("pbf", PHASES.sized(phases));
    table.extend("pbf", place_buffers(places(plan), plan.page));
    let vectors = [
        CORRECTED,
        POSITION,
        VELOCITY,
        START_POSITION,
        SORTED_VELOCITY,
    ];
    table.extend("pbf", vectors.map(|buffer| buffer.sized(n)));
    table.extend("pbf", [ID.sized(2 * n), DENSITY.sized(n)]);
    if scene.settings().grid_projection {
        table.add("pbf", IS_DROP.sized(2 * n));
    }
    table.add("pbf", COUNTERS.sized(1));
    if let Stop::DensityError { .. } = scene.settings().stop {
        table.add("pbf", CONTROL.sized(1));
        table.add("pbf", ERROR_SUMS.sized(n.div_ceil(256)));
    }
    let has_sums = scene.reads_multipliers();
    if has_sums && !scene.has_movers() {
        table.add("probes", LAMBDA_SUM.sized(n));
    }
    if scene.has_movers() {
        table.add("budget", WALL_WORK.sized((2 + usize::from(has_sums)) * n));
        table.add("budget", BOUNDARY_WORK.sized(n.div_ceil(64)));
    }
    if plan.has_solids() {
        let (velocities, grids) = match plan.counts.moving_nodes {
            0 => (0, SOLID_GRID.sized(1)),
            _ => (3 * plan.counts.boundary_samples, POSED_SOLIDS.sized(1)),
        };
        let distances = plan.counts.solid_floats();
        table.add("solids", SOLID_DISTANCE.sized(distances + velocities));
        table.add("solids", grids);
        table.add("solids", BOUNDARY_CELL_START.sized(cells + 1));
    }
    table
}

/// Returns the number of cells that particles are sorted into.
pub(crate) fn cell_count(plan: &Plan) -> usize {
    plan.grid_dims.iter().map(|&n| n as usize).product()
}
