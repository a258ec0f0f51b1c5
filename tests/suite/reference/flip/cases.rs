//! One substep for each situation that FLIP meets: moving water, walls, solids, pockets, effects.
use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary,
        bounds::Bounds,
        motion::{Motion, Spectrum},
        particles::Particles,
        signed_distance::SignedDistance,
    },
    scene::{
        Scene, Wall, WaveMaker, effects,
        flip::{AFFINE, Surface, Transfer},
        open_waves,
    },
};

use crate::support::{
    flip::{DX, block, flip, half_space, position, scene, tank},
    jitter, mover, noise, turning,
};

/// Frame before the substep; walls and solids are in motion by then.
pub const FRAME: u32 = 5;

/// A scene with one substep per frame.
pub struct Case {
    pub name: &'static str,
    pub scene: Scene,
    pub particles: Particles,
    pub boundary: Boundary,
}

fn case(name: &'static str, scene: Scene, particles: Particles) -> Case {
    let mut case = Case {
        name,
        scene,
        particles,
        boundary: Boundary::default(),
    };
    flip(&mut case.scene).pressure.tolerance = 1e-6;
    case
}

/// Adds velocities that vary over the water, about 0.5 m/s, and noise.
fn stir(particles: &mut Particles) {
    for k in 0..particles.len() {
        let x = 4.0 * position(particles, k);
        let v = DVec3::new(
            x.y.sin() + x.z.cos(),
            x.z.sin() * x.x.cos(),
            (x.x + x.y).cos(),
        );
        let rough = |c: u64| 0.1 * noise(9_000_000 + 3 * k as u64 + c);
        let v = 0.25 * v + DVec3::new(rough(0), rough(1), rough(2));
        particles.velocity[k] = v.as_vec3().to_array();
    }
}

pub fn still() -> Case {
    let (scene, particles) = tank([16, 20, 12], 11);
    case("still tank", scene, particles)
}

/// Water away from the walls, so that there are surfaces on all sides.
pub fn dam() -> Case {
    let scene = scene([18.0, 17.0, 12.0]);
    let mut particles = block([1, 2, 1], [8, 9, 9]);
    jitter(&mut particles, 0.02);
    stir(&mut particles);
    case("dam in motion", scene, particles)
}

pub fn voxel() -> Case {
    let mut case = dam();
    flip(&mut case.scene).surface = Surface::Voxel;
    Case {
        name: "voxel surface",
        ..case
    }
}

pub fn apic() -> Case {
    let mut case = dam();
    flip(&mut case.scene).transfer = Transfer::Apic;
    let n = case.particles.len();
    for (c, name) in AFFINE.into_iter().enumerate() {
        let slope = |k: usize| noise(50_000_000 + (9 * k + c) as u64) as f32;
        let values = (0..n).map(slope).collect();
        case.particles.attributes.insert(name.to_owned(), values);
    }
    Case {
        name: "apic",
        ..case
    }
}

fn kept(particles: &Particles, is_kept: impl Fn(DVec3) -> bool) -> Particles {
    let chosen: Vec<usize> = (0..particles.len())
        .filter(|&k| is_kept(position(particles, k)))
        .collect();
    Particles {
        position: chosen.iter().map(|&k| particles.position[k]).collect(),
        velocity: chosen.iter().map(|&k| particles.velocity[k]).collect(),
        id: (0..chosen.len() as u32).collect(),
        ..Particles::default()
    }
}

/// A slope through a tank.
pub fn slope() -> Case {
    let (scene, mut particles) = tank([16, 18, 14], 10);
    jitter(&mut particles, 0.02);
    stir(&mut particles);
    let n = DVec3::new(0.5, 0.8, 0.33).normalize();
    let particles = kept(&particles, |x| n.dot(x) > 0.61);
    Case {
        boundary: half_space(n, 0.6),
        ..case("mesh solid", scene, particles)
    }
}

pub fn wall() -> Case {
    let (mut scene, mut particles) = tank([16, 16, 8], 7);
    stir(&mut particles);
    // Keeps particles beyond the wall, which is in the second cell by then.
    let particles = kept(&particles, |x| x.x > 0.13);
    let side = Wall::NAMED.iter().find(|(name, _)| *name == "-x");
    scene.wave_makers.push(WaveMaker {
        absorption: None,
        wall: side.unwrap().1,
        motion: Motion::ConstantVelocity {
            velocity: 2.5,
            until: Some(1.0),
        },
    });
    case("moving wall", scene, particles)
}

pub fn moving_solid() -> Case {
    let (mut scene, mut particles) = tank([18, 16, 14], 9);
    jitter(&mut particles, 0.02);
    stir(&mut particles);
    let bounds = Bounds {
        min: DVec3::new(0.33, 0.27, 0.41),
        max: DVec3::new(0.81, 0.74, 0.93),
    };
    let motion = Motion::ConstantVelocity {
        velocity: 0.8,
        until: None,
    };
    let solid = mover(bounds, DVec3::new(1.0, 0.3, 0.2), motion);
    let solid = turning(solid, DVec3::new(0.2, -0.3, 1.0), 40.0);
    let now = solid.pose(&[], f64::from(FRAME) * scene.shot.frame_seconds());
    let grid = bounds.grown(2.0 * DX);
    let distance = SignedDistance::from_mesh(&solid.placed.mesh, &grid, 0.5 * DX).unwrap();
    let particles = kept(&particles, |x| {
        let x = now.back(x);
        x.cmplt(bounds.min - 0.02).any() || x.cmpgt(bounds.max + 0.02).any()
    });
    scene.moving_solids.push(solid);
    Case {
        boundary: Boundary {
            moving: vec![distance],
            ..Boundary::default()
        },
        ..case("moving solid", scene, particles)
    }
}

/// A box full to its ceiling: no air touches the water.
pub fn pocket() -> Case {
    let (scene, mut particles) = tank([12, 9, 10], 9);
    jitter(&mut particles, 0.02);
    stir(&mut particles);
    case("pocket", scene, particles)
}

/// An implicit viscosity solve between two projections, over a slope and between walls of which
/// some are no-slip.
pub fn viscous() -> Case {
    let mut case = slope();
    case.scene.effects.viscosity = Some(effects::viscosity::Settings::newtonian(20.0));
    case.scene.no_slip = [0, 4].map(|k| Wall::NAMED[k].1).to_vec();
    Case {
        name: "viscous",
        ..case
    }
}

pub fn effects() -> Case {
    let mut case = dam();
    case.scene.effects.viscosity = Some(effects::viscosity::Settings::xsph(0.1));
    case.scene.effects.vorticity_confinement =
        Some(effects::vorticity_confinement::Settings { strength: 0.5 });
    case.scene.effects.surface_tension =
        Some(effects::surface_tension::Settings { coefficient: 10.0 });
    case.scene.effects.drag = Some(effects::drag::Settings {
        drop_radius: 1e-3,
        wind: [5.0, 1.0, -2.0],
    });
    case.scene.effects.absorbing_zone = Some(effects::absorbing_zone::Settings {
        walls: vec![Wall::NAMED[1].1],
        length: 0.6,
        period: 0.5,
    });
    case.scene.effects.generation_zone = Some(effects::generation_zone::Settings {
        walls: vec![Wall::NAMED[0].1],
        length: 0.6,
        waves: open_waves::Waves::Sea(open_waves::Sea {
            significant_height: 0.05,
            seed: 1,
            spectrum: Spectrum::Jonswap,
            peak_enhancement: None,
            peak_period: 0.8,
            shortest_period: None,
            depth: 0.5,
            simulated_depth: None,
            ramp: Some(0.0),
            direction_degrees: 20.0,
            spreading: Some(10.0),
        }),
    });
    Case {
        name: "effects",
        ..case
    }
}
