//! Checks of a traced substep: the comparisons of a solver's passes together with those of effects.

use swell_domain::{
    boundary::Boundary, particles::Particles, solver::Solver, substep::SubstepChoice,
};
use swell_gpu::adapter::Context;
use swell_scene::{FlipScene, PbfScene, step::projected_substep};
use swell_solve::{
    SolveError,
    flip::{Flip, buffers::BRICKS},
    pbf::Pbf,
    plan::Plan,
    trace::{Span, TraceFrame},
};

use super::{
    Checked, effects,
    engine::Engine,
    flip::{self, FlipState},
    pbf::{self, PbfState},
    table::CheckTable,
};

/// Traces a substep of the frame after `particles`, the state at the end of `frame`, and compares
/// it with the reference.
///
/// # Errors Returns an error if the device fails, a numerical budget is exceeded, or the frame does
/// not have the substep.
pub fn check_flip(
    context: &Context,
    scene: &FlipScene,
    plan: Plan,
    boundary: &Boundary,
    (frame, particles): (u32, &Particles),
    which: SubstepChoice,
) -> Result<Checked, SolveError> {
    let mut solver = Flip::new(context, scene, plan, boundary, false)?;
    solver.load(frame, particles)?;
    let mut engine = of_flip(FlipState::new(scene, boundary, (frame, particles)));
    let traced = solver.trace_frame(Span::Only(which), &mut |begun, traced| {
        engine.state.begin(begun);
        engine.observe(traced)
    })?;
    Ok(Checked {
        table: engine.finish(),
        substep: Some(traced),
    })
}

/// Traces a substep of the frame after `particles`, the state at the end of `frame`, and compares
/// it with the reference. `boundary` holds the solids for the reference, `uploaded` those for the
/// device; they differ only in tests.
///
/// # Errors Returns an error if the device fails, a numerical budget is exceeded, or the frame does
/// not have the substep.
pub fn check_pbf(
    context: &Context,
    scene: &PbfScene,
    plan: Plan,
    [boundary, uploaded]: [&Boundary; 2],
    (frame, particles): (u32, &Particles),
    which: SubstepChoice,
) -> Result<Checked, SolveError> {
    let mut solver = Pbf::new(context, scene, plan.clone(), uploaded, false)?;
    solver.load(frame, particles)?;
    let boundaries = (&particles.walls, &particles.bodies[..]);
    let substeps = scene.pbf_substeps(boundaries, frame, particles.max_speed())?;
    let length = scene.shot.frame_seconds();
    let time_step = length / f64::from(substeps);
    let number = match which {
        SubstepChoice::Number(number) => number,
        SubstepChoice::Last => substeps,
    };
    let end = f64::from(frame) * length + f64::from(number) * time_step;
    let own = [pbf::COMPARISONS, pbf::forces::COMPARISONS];
    let comparisons = [&own[..], &effects::pbf()].concat();
    let state = PbfState::new(scene, boundary, plan, boundaries, (end, time_step));
    let mut engine = Engine::new(state, comparisons);
    let mut of_grid = scene.of_projection().map(|grid| {
        let mut state = FlipState::new(&grid, boundary, (frame, particles));
        let before = if number > 1 {
            time_step
        } else {
            particles.substep
        };
        state.given_substep = Some(projected_substep(end - time_step, time_step, before));
        of_flip(state)
    });
    let traced =
        solver.trace_frame(Span::Only(which), &mut |begun, traced| match &mut of_grid {
            Some(of_grid) if traced.has(BRICKS.name()) => {
                of_grid.state.begin(begun);
                of_grid.observe(traced)
            }
            _ => {
                engine.state.stand(boundary, &begun.bodies);
                engine.observe(traced)
            }
        })?;
    engine.state.add_whole(boundary, &mut engine.table);
    let mut table = of_grid.map_or_else(CheckTable::default, Engine::finish);
    table.absorb(engine.finish());
    Ok(Checked {
        table,
        substep: Some(traced),
    })
}

fn of_flip(state: FlipState) -> Engine<FlipState> {
    Engine::new(state, [&flip::comparisons()[..], &effects::flip()].concat())
}
