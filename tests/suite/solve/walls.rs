//! Effect of walls on the density of FLIP's grid.

use crate::support::{
    context,
    flip::{self as rig, DX, half_space},
    jitter,
};
use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary,
        motion::Motion,
        particles::Particles,
        poisson::{AIR, FLUID},
        solver::Solver,
    },
    gpu::adapter::InjectedFault,
    reference::flip::{Flip, Trace, survey},
    scene::{Scene, Wall, WaveMaker, step},
};

/// One substep of the f64 reference that begins at `start`, seconds.
fn traced(scene: &Scene, particles: &Particles, start: f64) -> Trace {
    let mut reference = Flip::new(&scene.with_flip().unwrap(), &Boundary::default());
    reference.load(0, particles).unwrap();
    one_substep(&mut reference, start)
}

fn one_substep(reference: &mut Flip, start: f64) -> Trace {
    let cloud = reference.cloud();
    let found = survey(reference.model(), &cloud);
    let step = step::Substep {
        start,
        length: 1e-3,
        kick: 1e-3,
        displacement: 1.0,
    };
    reference.substep(&cloud, &found.is_wet, &step).unwrap()
}

/// Sum of the density over all cells of a box.
fn held(trace: &Trace, cells: [i64; 3]) -> f64 {
    let along = |axis: usize| 0..cells[axis];
    let all = along(0).flat_map(|x| along(1).flat_map(move |y| along(2).map(move |z| [x, y, z])));
    let density = &trace.centers.density;
    all.map(|cell| density[trace.bricks.element(cell) as usize])
        .sum()
}

/// Hats sum to one wherever a particle is, because the part that falls behind a wall is returned by
/// its mirror image: cells hold as much as there are particles, for any arrangement. (Each of 27
/// hats has 2.4e-7 of a weight beyond its own.) Otherwise a density correction would thin all water
/// by what walls hide.
#[test]
fn cells_hold_what_their_particles_are_also_at_walls() {
    let cells = [8, 10, 8];
    let (scene, mut particles) = rig::tank([8, 10, 8], 6);
    jitter(&mut particles, 0.02);
    // Keeps particles 0.225 cells away from walls, the distance to which water is pushed.
    let size = scene.domain.size();
    for x in &mut particles.position {
        let kept =
            DVec3::from_array(x.map(f64::from)).clamp(DVec3::splat(0.225 * DX), size - 0.225 * DX);
        *x = kept.as_vec3().to_array();
    }
    let count = particles.len() as f64 / 8.0;
    let error = |trace: &Trace| (held(trace, cells) / count - 1.0).abs();
    let found = traced(&scene, &particles, 0.0);
    assert!(error(&found) < 27.0 * 2.4e-7 * 1.5, "{}", error(&found));
    // Negative control: one more particle.
    let mut more = particles.clone();
    more.position.push([0.4, 0.3, 0.4]);
    more.velocity.push([0.0; 3]);
    more.id.push(particles.len() as u32);
    assert!(error(&traced(&scene, &more, 0.0)) > 1e-4);
}

/// A tank whose first wall has moved in by `part` of a cell after a second, with its water.
fn cut(part: f64) -> (Scene, Particles) {
    let (mut scene, mut particles) = rig::tank([8, 8, 8], 6);
    scene.wave_makers = vec![WaveMaker {
        absorption: None,
        wall: Wall::NAMED[0].1,
        motion: Motion::ConstantVelocity {
            velocity: part * DX,
            until: Some(1.0),
        },
    }];
    for x in &mut particles.position {
        x[0] += (part * DX) as f32;
    }
    (scene, particles)
}

/// Tolerance of densities: positions up to 0.8 m in f32 are off by 3e-7 cells and weights by 2.4e-7
/// of a hat, for some 27 of them in a row over a particle's eighth, at worst all with the same
/// sign.
const DENSITY: f64 = 2e-5;

/// A lattice that extends up to a wall is water of density 1, whatever part of a cell the wall cuts
/// off, in cells whose centres are in front of the wall. Particles are a quarter of a cell from the
/// wall and half a cell from each other; the lattice's hats sum to one anywhere (they are linear
/// between whole cells, of which the lattice spacing is a half).
#[test]
fn water_before_a_wall_that_cuts_cells_has_its_density() {
    for part in [0.1, 0.25, 0.4, 0.5] {
        let (scene, mut particles) = cut(part);
        particles
            .position
            .iter_mut()
            .for_each(|x| x[0] = x[0].min(0.8));
        let trace = traced(&scene, &particles, 1.0);
        let density = |x: i64| trace.centers.density[trace.bricks.element([x, 2, 4]) as usize];
        for x in 0..4 {
            assert!(
                (density(x) - 1.0).abs() < DENSITY,
                "{part}, {x}: {}",
                density(x)
            );
        }
    }
}

/// Without a density correction there are no mirror images, and a cell is full relative to what
/// walls leave of its hats: of a lattice, 7/8 in the cell in front of a wall that cuts none, 1/2 in
/// one whose centre is in the wall. The hats there are 3/4, 3/4 and 1/4 of a particle of two, or
/// 3/4 and 1/4; the integrals are the same.
#[test]
fn cells_at_walls_are_full_without_images_too() {
    for part in [0.0, 0.5] {
        let (mut scene, particles) = cut(part);
        rig::flip(&mut scene).density_correction = false;
        let trace = traced(&scene, &particles, 1.0);
        for x in 0..4 {
            let density = trace.centers.density[trace.bricks.element([x, 2, 4]) as usize];
            assert!((density - 1.0).abs() < DENSITY, "{part}, {x}: {density}");
        }
    }
}

/// Distance between the water and a wall that advances by 0.7 cells per substep, averaged over the
/// second half of its path, in cells: from the wall to the nearest particle.
fn gap<S: Solver>(mut solver: S) -> f64
where
    S::Error: std::fmt::Debug,
{
    let (mut sum, frames) = (0.0, 12);
    for frame in 1..=frames {
        let (state, report) = solver.advance().unwrap();
        assert_eq!(report.substeps, 1);
        let nearest = state.position.iter().map(|x| f64::from(x[0]));
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        if frame > frames / 2 {
            sum += nearest / DX - 0.7 * f64::from(frame);
        }
    }
    sum / f64::from(frames / 2)
}

/// Particles are pushed off walls by half of the lattice spacing, a quarter of a cell, from the
/// current position of the walls and not from their next one.
#[test]
fn water_before_a_wall_that_comes_leaves_no_gap() {
    let context = context();
    let (mut scene, particles) = rig::tank([24, 10, 4], 5);
    rig::flip(&mut scene).cfl = 3.0;
    scene.shot.frames_per_second = 24.0;
    scene.wave_makers = vec![WaveMaker {
        absorption: None,
        wall: Wall::NAMED[0].1,
        motion: Motion::ConstantVelocity {
            velocity: 0.7 * DX * 24.0,
            until: None,
        },
    }];
    let mut twin = Flip::new(&scene.with_flip().unwrap(), &Boundary::default());
    twin.load(0, &particles).unwrap();
    let found = [gap(rig::solver(&context, &scene, &particles)), gap(twin)];
    println!("{found:?}");
    assert!(found.iter().all(|gap| *gap < 0.15), "{found:?}");
    // Negative control: measured from the walls' next position.
    let mut spoiled = context.clone();
    spoiled.spoil = Some(InjectedFault {
        pass: "flip/push_apart",
        from: "x - params.cut_min * params.cell_size",
        to: "x - params.wall_min",
    });
    let gap = gap(rig::solver(&spoiled, &scene, &particles));
    println!("{gap}");
    assert!(gap > 0.3, "{gap}");
}

/// A cell whose centre is inside a wall gets the kind of the water in front of it, beside a solid
/// as well: at the wall of [`cut`] that takes 0.7 of a cell, with a solid floor aligned with the
/// grid under the water. The sliver in front of that wall holds no particle.
#[test]
fn the_sliver_at_a_wall_is_water_beside_a_solid_too() {
    let (mut scene, mut particles) = cut(0.7);
    let floor = half_space(DVec3::Y, 2.0 * DX);
    particles
        .position
        .retain(|x| x[0] > (1.4 * DX) as f32 && x[0] < 0.75);
    let count = particles.position.len();
    particles.velocity.truncate(count);
    particles.id.truncate(count);
    for x in &mut particles.position {
        x[1] += (2.0 * DX) as f32;
    }
    scene.domain.max.y += 2.0 * DX;
    for boundary in [Boundary::default(), floor] {
        let mut reference = Flip::new(&scene.with_flip().unwrap(), &boundary);
        reference.load(0, &particles).unwrap();
        let trace = one_substep(&mut reference, 1.0);
        let kind = |x: i64, y: i64| trace.space.kind[trace.bricks.element([x, y, 4]) as usize];
        for y in 2..6 {
            assert_eq!((kind(0, y), kind(1, y)), (FLUID, FLUID), "{y}");
        }
        // Control: above the water both are air.
        assert_eq!((kind(0, 8), kind(1, 8)), (AIR, AIR));
    }
}
