//! What a scene may request of FLIP beyond the common case, and faults in the code
//! that only this runs.

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary, bounds::Bounds, motion::Motion, particles::Particles,
        signed_distance::SignedDistance,
    },
    scene::{
        Scene, Wall,
        effects::surface_tension,
        flip::{AFFINE, Preconditioner, Surface, Transfer},
    },
    stage::prepare::Start,
};

use super::{Control, band, bodies, control, flip::SYSTEM, shapes, tension::TENSION};
use crate::support::{D, flip_of as flip, lattice, mover, noise, turning};

/// A change of the common case, and the faults that its check must detect.
pub struct Variant {
    pub name: &'static str,
    pub change: fn(&mut Scene, &mut Start),
    pub controls: &'static [Control],
}

/// Noise of 1 m/s.
pub(super) fn stir(particles: &mut Particles) {
    for (k, v) in particles.velocity.iter_mut().enumerate() {
        *v = std::array::from_fn(|axis| noise(3 * k as u64 + axis as u64 + 7) as f32);
    }
}

fn apic(scene: &mut Scene, start: &mut Start) {
    flip(scene).transfer = Transfer::Apic;
    let n = start.particles.len();
    for (c, name) in AFFINE.into_iter().enumerate() {
        let slope = |k: usize| noise(50_000 + (9 * k + c) as u64) as f32;
        let values = (0..n).map(slope).collect();
        (start.particles.attributes).insert(name.to_owned(), values);
    }
}

/// As strong as gravity within a cell, on water away from the walls, with air on both sides.
fn tension(scene: &mut Scene, start: &mut Start) {
    for x in &mut start.particles.position {
        x[0] += 0.3;
    }
    scene.effects.surface_tension = Some(surface_tension::Settings { coefficient: 50.0 });
}

fn voxel(scene: &mut Scene, _: &mut Start) {
    flip(scene).surface = Surface::Voxel;
}

/// A box within the water that moves and turns, with particles around it.
fn moving_solid(scene: &mut Scene, start: &mut Start) {
    let bounds = Bounds {
        min: DVec3::new(0.33, 0.37, 0.21),
        max: DVec3::new(0.61, 0.58, 0.43),
    };
    let motion = Motion::ConstantVelocity {
        velocity: 0.8,
        until: None,
    };
    let solid = mover(bounds, DVec3::new(1.0, 0.3, 0.2).normalize(), motion);
    let solid = turning(solid, DVec3::new(0.2, -0.3, 1.0), 200.0);
    let grid = bounds.grown(4.0 * D);
    let distance = SignedDistance::from_mesh(&solid.placed.mesh, &grid, D).unwrap();
    scene.moving_solids.push(solid);
    start.boundary.moving.push(distance);
    let all = &start.particles;
    let is_out = |x: &[f32; 3]| {
        let x = DVec3::from_array(x.map(f64::from));
        x.cmplt(bounds.min - 0.01).any() || x.cmpgt(bounds.max + 0.01).any()
    };
    let kept: Vec<usize> = (0..all.len())
        .filter(|&k| is_out(&all.position[k]))
        .collect();
    start.particles = Particles {
        position: kept.iter().map(|&k| all.position[k]).collect(),
        velocity: kept.iter().map(|&k| all.velocity[k]).collect(),
        id: (0..kept.len() as u32).collect(),
        ..Particles::default()
    };
    touch(&mut start.particles, &bounds);
}

/// Puts particles against the upper sides of a box, which they run into.
pub(super) fn touch(particles: &mut Particles, bounds: &Bounds) {
    for k in 0..24 {
        let part = |n: u64| 0.5 + 0.5 * noise(700 + 3 * k as u64 + n);
        let mut x = bounds.min + DVec3::new(part(0), part(1), part(2)) * bounds.size();
        x[k % 3] = bounds.max[k % 3] + 0.02 * D;
        particles.position[k] = x.as_vec3().to_array();
        particles.velocity[k][k % 3] = -2.0;
    }
}

/// All six walls, two of which cut cells of water.
fn no_slip(scene: &mut Scene, start: &mut Start) {
    scene.domain.max = DVec3::new(1.31, 6.4, 1.13);
    scene.no_slip = Wall::NAMED.iter().map(|named| named.1).collect();
    start.boundary = Boundary::default();
    start.particles = lattice([0.0; 3], [13, 6, 11], [D; 3]);
    stir(&mut start.particles);
}

/// A box of two bricks, full to its ceiling.
pub(super) fn pocket(scene: &mut Scene, start: &mut Start) {
    scene.domain.max = DVec3::new(3.2, 0.8, 0.8);
    start.boundary = Boundary::default();
    start.particles = lattice([0.0; 3], [32, 8, 8], [D; 3]);
    stir(&mut start.particles);
}

/// Four bricks in a row, so that the multigrid's last workgroup handles two levels, of two
/// bricks and of one.
fn channel(scene: &mut Scene, start: &mut Start) {
    scene.domain.max = DVec3::new(6.2, 1.4, 1.4);
    start.boundary = Boundary::default();
    start.particles = lattice([0.0; 3], [60, 6, 10], [D; 3]);
    stir(&mut start.particles);
}

/// Ten bricks in a row, so that a level of five has dispatches of its own.
fn long_channel(scene: &mut Scene, start: &mut Start) {
    scene.domain.max = DVec3::new(16.0, 1.4, 1.4);
    start.boundary = Boundary::default();
    start.particles = lattice([0.0; 3], [156, 6, 10], [D; 3]);
    stir(&mut start.particles);
}

/// Water below its minimum distance from the floor, next to a solid whose distances are half as
/// steep as they should be: each push goes half of the required length, and none of it upwards.
fn corner(_: &mut Scene, start: &mut Start) {
    let dims = [16, 10, 16];
    let value = |k: usize| (0.5 * (0.5 - (0.1 * (k % 16) as f64 - 0.15))) as f32;
    start.boundary.distance = Some(SignedDistance {
        origin: DVec3::new(-0.15, -0.1, -0.15),
        spacing: 0.1,
        dims,
        values: (0..dims.iter().product()).map(value).collect(),
    });
    start.particles = lattice([-0.01, -0.043, 0.0], [6, 6, 7], [0.09; 3]);
    stir(&mut start.particles);
}

fn preconditioner(scene: &mut Scene, kind: Preconditioner) {
    let pressure = &mut flip(scene).pressure;
    (pressure.preconditioner, pressure.max_iterations) = (kind, 400);
}

pub const VARIANTS: &[Variant] = &[
    Variant {
        name: "APIC",
        change: apic,
        controls: &[
            control(
                "flip/reorder",
                "= affine[9u * source + k]",
                "= -affine[9u * source + k]",
                "flip/reorder",
                &["affine rows"],
            ),
            control(
                "flip/spread_faces",
                "v - slope.x * f.x",
                "v + slope.x * f.x",
                "flip/gather_faces",
                &["velocity at faces"],
            ),
            control(
                "flip/grid_to_particle",
                "= scale * slope_of(faces, u, a, b, of_c)",
                "= -scale * slope_of(faces, u, a, b, of_c)",
                "flip/grid_to_particle",
                &["affine rows"],
            ),
            control(
                "flip/grid_to_particle",
                "velocity[k] = u;",
                "velocity[k] = 1.001 * u;",
                "flip/grid_to_particle",
                &["velocity"],
            ),
        ],
    },
    Variant {
        name: "band",
        change: band::band,
        controls: band::BAND,
    },
    Variant {
        name: "surface tension",
        change: tension,
        controls: TENSION,
    },
    Variant {
        name: "voxel surface",
        change: voxel,
        controls: &[control(
            "pressure/build_system",
            "return 1.0;",
            "return 1.001;",
            "pressure/build_system",
            &["what air adds to the diagonal"],
        )
        .and(SYSTEM)],
    },
    Variant {
        name: "moving solid",
        change: moving_solid,
        controls: &[
            control(
                "flip/cut_cells",
                "(cut.upper_of_walls - upper) * cut.upper_velocity",
                "(cut.upper_of_walls - upper) * -cut.upper_velocity",
                "flip/cut_cells",
                &["flux of solids"],
            ),
            control(
                "flip/cut_cells",
                "closed_velocity[element] = closing.x",
                "closed_velocity[element] = 1.00001 * closing.x",
                "flip/cut_cells",
                &["velocity of closed faces"],
            ),
            control(
                "flip/advect",
                "f32(k + 1u) / f32(steps)",
                "f32(k) / f32(steps)",
                "flip/advect",
                &["position"],
            ),
            control(
                "flip/advect",
                "v = pushing + stopped",
                "v = -pushing + stopped",
                "flip/advect",
                &["velocity"],
            ),
            control(
                "flip/cut_cells",
                "cross(solid_spin, x - solid_centre)",
                "cross(x - solid_centre, solid_spin)",
                "flip/cut_cells",
                &["flux of solids", "velocity of closed faces"],
            ),
        ],
    },
    Variant {
        name: "shape that changes",
        change: shapes::shape,
        controls: shapes::SHAPES,
    },
    Variant {
        name: "bodies",
        change: bodies::bodies,
        controls: bodies::BODIES,
    },
    Variant {
        name: "trapped body",
        change: bodies::trapped,
        controls: bodies::TRAPPED,
    },
    Variant {
        name: "no-slip walls",
        change: no_slip,
        controls: &[
            control(
                "flip/wall_friction",
                "VON_KARMAN = 0.41",
                "VON_KARMAN = 0.42",
                "flip/wall_friction",
                &["velocity slowed by walls"],
            ),
            control(
                "flip/wall_friction",
                "- (k >> 1u) * unit(own)",
                "+ (k >> 1u) * unit(own)",
                "flip/wall_friction",
                &["velocity slowed by walls"],
            ),
            control(
                "flip/wall_friction",
                "1.5 - (place - params.cut_min)",
                "1.4 - (place - params.cut_min)",
                "flip/wall_friction",
                &["velocity slowed by walls"],
            ),
        ],
    },
    Variant {
        name: "pocket",
        change: pocket,
        controls: &[
            control(
                "pressure/sum_pockets",
                "pressure_pocket_sums[index] = total",
                "pressure_pocket_sums[index] = 1.001 * total",
                "pressure/sum_pockets",
                &["sums over parts of pockets"],
            )
            .and(&["pressure/center"]),
            control(
                "pressure/center",
                "-= mean",
                "-= 1.1 * mean",
                "pressure/center",
                &["values less their mean"],
            ),
            control(
                "pressure/merge_labels",
                "across(own + x, lower.x + 64u + x, l.out.xl);",
                "",
                "pressure/count_pockets",
                &["labels of water that no air touches", "pockets"],
            )
            .and(&["pressure/sum_pockets", "pressure/center", "pressure/reduce"]),
            control(
                "pressure/count_pockets",
                "atomicAdd(&pressure_stats.pockets, 1u)",
                "atomicAdd(&pressure_stats.pockets, 2u)",
                "pressure/count_pockets",
                &["pockets"],
            ),
        ],
    },
    Variant {
        name: "channel",
        change: channel,
        controls: &[
            control(
                "pressure/solve_coarse",
                "about.xu + above.upper.x",
                "about.xu + 1.01 * above.upper.x",
                "pressure/solve_coarse",
                &["correction"],
            ),
            control(
                "pressure/solve_coarse",
                "0.5 * sum_pair(flow)",
                "0.505 * sum_pair(flow)",
                "pressure/solve_coarse",
                &["residuals of the coarser levels"],
            ),
            // The way back up is omitted, the wrong colour restricted, one sweep replaces eight.
            control(
                "pressure/solve_coarse",
                "with_above(corrections_about(s), above_about(s))",
                "corrections_about(s)",
                "pressure/solve_coarse",
                &["correction"],
            ),
            control(
                "pressure/solve_coarse",
                "restrict_at(site_of(level, i, 0u));",
                "restrict_at(site_of(level, i, 1u));",
                "pressure/solve_coarse",
                &["correction", "residuals of the coarser levels"],
            ),
            control(
                "pressure/solve_coarse",
                "const SWEEPS = 8u;",
                "const SWEEPS = 1u;",
                "pressure/solve_coarse",
                &["correction"],
            ),
        ],
    },
    Variant {
        name: "long channel",
        change: long_channel,
        controls: &[
            control(
                "pressure/restrict",
                "0.5 * sum_pair(inflow",
                "0.5001 * sum_pair(inflow",
                "pressure/restrict",
                &["residual of the coarser level"],
            ),
            control(
                "pressure/restrict",
                "0.5 * (x + y + z)",
                "0.5 * (y + z - x)",
                "pressure/restrict",
                &["residual of the coarser level"],
            ),
            control(
                "pressure/restrict",
                "r.lo + flow.lo",
                "r.lo - flow.lo",
                "pressure/restrict",
                &["correction"],
            ),
            control(
                "pressure/restrict",
                "smoothed_about(alone(s))",
                "smoothed_about(s)",
                "pressure/restrict",
                &["correction"],
            ),
            control(
                "pressure/solve_coarse",
                "0.5 * (x + y + z)",
                "0.5 * (y + z - x)",
                "pressure/solve_coarse",
                &["residuals of the coarser levels"],
            ),
            control(
                "pressure/solve_coarse",
                "0.5 * sum_pair(inflow",
                "0.505 * sum_pair(inflow",
                "pressure/solve_coarse",
                &["residuals of the coarser levels"],
            ),
            control(
                "pressure/prolong",
                "select(above.lower, vec3r(0.0), is_new_lower)",
                "select(1.01 * above.lower, vec3r(0.0), is_new_lower)",
                "pressure/prolong",
                &["correction"],
            ),
        ],
    },
    Variant {
        name: "no preconditioner",
        change: |scene, _| preconditioner(scene, Preconditioner::None),
        controls: &[control(
            "pressure/precondition",
            "let z = r;",
            "let z = 1.001 * r;",
            "pressure/precondition",
            &["correction"],
        )],
    },
    Variant {
        name: "Jacobi",
        change: |scene, _| preconditioner(scene, Preconditioner::Jacobi),
        controls: &[
            control(
                "pressure/precondition",
                "pressure_inverse_diagonal[e] * r",
                "1.001 * pressure_inverse_diagonal[e] * r",
                "pressure/precondition",
                &["correction"],
            ),
            control(
                "pressure/build_system",
                "1.0 / row.diagonal",
                "1.001 / row.diagonal",
                "pressure/build_system",
                &["inverse diagonal"],
            ),
        ],
    },
    Variant {
        name: "IPP",
        change: |scene, _| preconditioner(scene, Preconditioner::Ipp),
        controls: &[
            control(
                "pressure/ipp_lower",
                "r.hi[c] + flow.hi[c]",
                "r.hi[c] - flow.hi[c]",
                "pressure/ipp_lower",
                &["first half"],
            ),
            control(
                "pressure/ipp_upper",
                "y.lo[c] + d.lo[c] * flow.lo[c]",
                "y.lo[c] - d.lo[c] * flow.lo[c]",
                "pressure/ipp_upper",
                &["correction"],
            ),
        ],
    },
    Variant {
        name: "corner of a wall and a solid",
        change: corner,
        controls: &[
            // The number of pushes is decided again after each push.
            control(
                "flip/advect",
                "k < rounds",
                "k < select(0u, CORNER_ROUNDS, is_near && any(x != clamp(x, low, high)))",
                "flip/advect",
                &["position"],
            ),
            control(
                "flip/advect",
                "to_world(gradient / steepness) * (params.contact_distance - distance)",
                "to_world(gradient / steepness) * (params.contact_distance - 1.01 * distance)",
                "flip/advect",
                &["position"],
            ),
        ],
    },
];
