//! Measurements at a point, over a plane or over all water of a frame, the same for every solver.
//!
//! Height is along y. Sums run in the order of the particles, so that a frame always gives the
//! same numbers.

mod elevation;
mod fitted;
mod flux;
mod force;
mod front;
mod rate;
mod volume;

use glam::{DVec3, Vec3};

use super::particles::Particles;

pub use elevation::{elevation, elevations};
pub use fitted::fitted;
pub use flux::flux;
pub use force::{Patch, load, patches};
pub use front::{front, run_up, run_up_across};
pub use rate::Rate;
pub use volume::{enclosed_volume, volume};

/// Radius R of the surface's kernel, particle spacings (Zhu and Bridson 2005).
pub(crate) const SUPPORT: f64 = 2.0;

/// Returns the kinetic and potential energy, J, of particles of `mass` kg; potential energy is
/// relative to `lowest`. Velocities are at mid-substep and positions at its end (leapfrog), so
/// potential energy uses x − v Δt / 2: in free fall the error is (g Δt)² / 8 per kilogram. With
/// positions at the substep's end it would be g v Δt / 2. A deep cell counts as the particles that
/// it stands for, at its centre.
pub fn energies(particles: &Particles, mass: f64, gravity: DVec3, lowest: DVec3) -> (f64, f64) {
    let (mut kinetic, mut potential) = (0.0, 0.0);
    let mut add = |[x, v]: [DVec3; 2], mass: f64| {
        kinetic += 0.5 * mass * v.length_squared();
        potential -= mass * gravity.dot(x - 0.5 * particles.substep * v - lowest);
    };
    let deep = &particles.deep;
    for (x, v) in particles.position.iter().zip(&particles.velocity) {
        if deep.is_empty() || !deep.holds(*x) {
            add([x, v].map(|of| Vec3::from_array(*of).as_dvec3()), mass);
        }
    }
    let full = mass * f64::from(deep.grid.per_cell());
    for centre in deep.centres() {
        add(centre, full);
    }
    (kinetic, potential)
}

#[cfg(test)]
mod tests {
    use super::super::bounds::Bounds;
    use super::*;

    /// A block of n[0] × n[1] × n[2] particles from 0 on, d = 0.1.
    pub(super) fn block(n: [usize; 3], shift: DVec3) -> Particles {
        let mut particles = Particles::default();
        for k in 0..n[0] * n[1] * n[2] {
            let cell = [k % n[0], k / n[0] % n[1], k / (n[0] * n[1])];
            let x = DVec3::from_array(cell.map(|c| 0.1 * (c as f64 + 0.5))) + shift;
            particles.position.push(x.as_vec3().to_array());
            particles.velocity.push([3.0, 0.0, 4.0]);
            particles.id.push(k as u32);
        }
        particles
    }

    /// Wide enough that only the walls at 0 matter.
    pub(super) fn domain() -> Bounds {
        Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(1.2, 4.0, 1.2),
        }
    }

    #[test]
    fn energies_of_a_block() {
        let particles = block([4, 4, 4], DVec3::new(1.0, 2.0, 3.0));
        let gravity = DVec3::new(0.0, -10.0, 0.0);
        let (kinetic, potential) = energies(&particles, 2.0, gravity, DVec3::new(0.0, 1.0, 0.0));
        // 64 × 2 kg at 5 m/s, 1.2 m up.
        assert!((kinetic - 1600.0).abs() < 1e-9, "{kinetic}");
        assert!((potential - 1536.0).abs() < 1e-3, "{potential}");
    }

    /// A particle falls in leapfrog steps of several lengths; its velocity steps by half of the
    /// previous and half of the current one.
    #[test]
    fn free_fall_keeps_its_energy_to_second_order() {
        let gravity = DVec3::new(0.0, -10.0, 0.0);
        let (mut x, mut v, mut before) = (0.0f64, 0.0f64, 0.1);
        let mut most = [0.0f64; 2];
        for substep in [0.1, 0.1, 0.05, 0.05, 0.02, 0.1] {
            v -= 10.0 * 0.5 * (before + substep);
            x += substep * v;
            before = substep;
            let state = Particles {
                position: vec![[0.0, x as f32, 0.0]],
                velocity: vec![[0.0, v as f32, 0.0]],
                id: vec![0],
                substep,
                ..Particles::default()
            };
            // Control: positions as they are.
            let late = Particles {
                substep: 0.0,
                ..state.clone()
            };
            for (most, state) in most.iter_mut().zip([&state, &late]) {
                let (kinetic, potential) = energies(state, 1.0, gravity, DVec3::ZERO);
                *most = most.max((kinetic + potential).abs());
            }
        }
        // (g Δt)² / 8, and f32's rounding of 10 J.
        assert!(most[0] < 0.125 + 1e-5 && most[1] > 2.0, "{most:?}");
    }
}
