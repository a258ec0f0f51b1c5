//! Bodies that the water moves, and faults in the passes over them.

use glam::DVec3;
use swell::{
    domain::{
        body::{Body, Freedom, MassProperties},
        bounds::Bounds,
        cut_cell::volume_offset,
        motion::Motion,
        signed_distance::SignedDistance,
    },
    scene::{
        Scene,
        moving_solid::{FreeBody, GivenMass},
    },
    stage::prepare::Start,
};

use super::{Control, control, flip::SYSTEM, variants::pocket};
use crate::support::{D, mover};

/// A body of `density` in place of a box.
fn body(scene: &mut Scene, start: &mut Start, bounds: Bounds, density: f64) {
    let mut solid = mover(bounds, DVec3::X, Motion::Still);
    let body = Body {
        mass: MassProperties::of_mesh(&solid.placed.mesh, density),
        velocity: [0.3, -0.4, 0.2, 1.0, -2.0, 0.5],
        freedom: Freedom::ALL,
        moorings: Vec::new(),
    };
    solid.slide = None;
    solid.body = Some(FreeBody {
        index: scene.bodies().count(),
        reach: 0.5 * bounds.size().length(),
        body,
        collides: false,
        given: GivenMass::default(),
    });
    let grid = bounds.grown(4.0 * D);
    let distance = SignedDistance::from_mesh(&solid.placed.mesh, &grid, D).unwrap();
    let volume = solid.placed.mesh.signed_volume();
    let offset = volume_offset(&distance, volume, scene.solver.cell_size());
    scene.moving_solids.push(solid);
    start
        .boundary
        .offsets
        .resize(start.boundary.moving.len(), 0.0);
    start.boundary.offsets.push(offset);
    start.boundary.moving.push(distance);
    start.particles.bodies = scene.bodies_at_start();
    let room = bounds.grown(0.01);
    let all = &start.particles.position;
    let keep: Vec<bool> = (all.iter())
        .map(|x| !room.contains(DVec3::from_array(x.map(f64::from))))
        .collect();
    start.particles.retain(&keep);
    start.particles.id = (0..start.particles.len() as u32).collect();
}

/// Two bodies beside each other, off the lattice.
pub fn bodies(scene: &mut Scene, start: &mut Start) {
    for (x, density) in [(0.07, 300.0), (0.67, 2000.0)] {
        let bounds = Bounds {
            min: DVec3::new(x, 0.47, 0.21),
            max: DVec3::new(x + 0.57, 0.98, 0.83),
        };
        body(scene, start, bounds, density);
    }
}

/// A body on the floor of sealed water.
pub fn trapped(scene: &mut Scene, start: &mut Start) {
    pocket(scene, start);
    let bounds = Bounds {
        min: DVec3::new(1.2, 0.0, 0.2),
        max: DVec3::new(1.6, 0.4, 0.6),
    };
    body(scene, start, bounds, 300.0);
}

pub const BODIES: &[Control] = &[
    control(
        "flip/couple_bodies",
        "let area = high - low",
        "let area = low - high",
        "flip/couple_bodies",
        &["area of bodies in cells", "moment of that area"],
    ),
    control(
        "flip/couple_bodies",
        "let way = cross(arm, area)",
        "let way = 1.01 * cross(arm, area)",
        "flip/couple_bodies",
        &["moment of that area"],
    ),
    control(
        "flip/couple_bodies",
        "0.5 * (low + high)",
        "0.4 * (low + high)",
        "flip/couple_bodies",
        &["weight between cells' centres and bodies"],
    ),
    control(
        "flip/couple_bodies",
        "near - offset",
        "near - 0.9 * offset",
        "flip/couple_bodies",
        &["weight between cells' centres and bodies"],
    ),
    control(
        "pressure/push_bodies",
        "sum += terms[k][local];",
        "sum += 1.001 * terms[k][local];",
        "pressure/push_bodies",
        &["sums of pressures over bodies"],
    )
    .and(SYSTEM),
    control(
        "pressure/move_bodies",
        "change += real(response)",
        "change += 1.001 * real(response)",
        "pressure/move_bodies",
        &["change of bodies' velocities"],
    )
    .and(SYSTEM),
    control(
        "pressure/couple",
        "pressure_correction[phase.stride + e] + added",
        "pressure_correction[phase.stride + e] + 1.001 * added",
        "pressure/couple",
        &["system times direction, with bodies"],
    )
    .and(SYSTEM),
    control(
        "pressure/couple",
        "pressure_residual[e] - added",
        "pressure_residual[e] - 1.001 * added",
        "pressure/couple",
        &["residual, with bodies"],
    )
    .and(SYSTEM),
    control(
        "pressure/carry_flux",
        "+= f32(sum)",
        "+= 1.001 * f32(sum)",
        "pressure/carry_flux",
        &["flux of bodies"],
    )
    .and(SYSTEM),
    control(
        "flip/carry_bodies",
        "+= added[axis]",
        "+= 1.001 * added[axis]",
        "flip/carry_bodies",
        &["velocity of closed faces"],
    ),
];

pub const TRAPPED: &[Control] = &[control(
    "pressure/center",
    "+= f32(mean)",
    "+= 1.01 * f32(mean)",
    "pressure/center",
    &["flux with what bodies squeeze out"],
)
.and(SYSTEM)];
