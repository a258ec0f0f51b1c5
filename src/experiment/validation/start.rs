//! Initial states of benchmarks that need more than blocks of water at rest.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use swell_domain::particles::Particles;
use swell_files::study::validation::{Benchmark, Measure};
use swell_scene::Scene;

/// Moves the scene's particles to the initial state of the benchmark and sets their velocities.
pub(super) fn prepare(benchmark: &Benchmark, scene: &Scene, particles: &mut Particles) {
    let (scale, corner) = (benchmark.scale, scene.domain.min);
    let at = |p: &[f32; 3]| Vec3::from_array(*p).as_dvec3() - corner;
    match benchmark.measure {
        Measure::StandingWave => {
            let k = TAU / scale.length;
            for p in &mut particles.position {
                let x = at(p);
                let moved = corner + x + standing(x, k, scale.depth, scale.height);
                *p = moved.as_vec3().to_array();
            }
        }
        Measure::TaylorGreen => {
            let k = PI / scale.length;
            let all = particles.position.iter().zip(&mut particles.velocity);
            for (p, v) in all {
                let ([sx, cx], [sy, cy]) = {
                    let x = at(p) * k;
                    ([x.x.sin(), x.x.cos()], [x.y.sin(), x.y.cos()])
                };
                let velocity = scale.speed * DVec3::new(sx * cy, -cx * sy, 0.0);
                *v = velocity.as_vec3().to_array();
            }
        }
        _ => {}
    }
}

/// Displacement of the water of a standing wave at its highest from its position at rest: by linear
/// theory with η = a cos kx, free of divergence and rotation.
fn standing(x: DVec3, k: f64, depth: f64, amplitude: f64) -> DVec3 {
    let scale = amplitude / (k * depth).sinh();
    DVec3::new(
        -scale * (k * x.y).cosh() * (k * x.x).sin(),
        scale * (k * x.y).sinh() * (k * x.x).cos(),
        0.0,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The displacement is η at the surface, vanishes across the floor and the walls, which are at
    /// crests of the wave, and is free of divergence by central differences.
    #[test]
    fn a_standing_wave_starts_as_linear_theory_has_it() {
        let (length, depth, amplitude) = (3.0, 1.0, 0.05);
        let k = TAU / length;
        let of = |x: f64, y: f64| standing(DVec3::new(x, y, 0.3), k, depth, amplitude);
        for x in [0.0, 0.4, 1.5, 2.9] {
            assert!((of(x, depth).y - amplitude * (k * x).cos()).abs() < 1e-15);
            assert!(of(x, 0.0).y.abs() < 1e-15);
            let h = 1e-4;
            for y in [0.2, 0.7] {
                let dx = (of(x + h, y).x - of(x - h, y).x) / (2.0 * h);
                let dy = (of(x, y + h).y - of(x, y - h).y) / (2.0 * h);
                // Second-order differences: k³ a h².
                assert!((dx + dy).abs() < 1e-8, "{dx} {dy}");
                assert!(x == 0.0 || x == 1.5 || (dx - dy).abs() > 1e-4, "control");
            }
        }
        assert!(of(0.0, 0.5).x.abs() < 1e-15 && of(length, 0.5).x.abs() < 1e-15);
    }
}
