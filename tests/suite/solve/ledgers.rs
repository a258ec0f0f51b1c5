//! Reports in ledgers against sums that are written out here.

use glam::DVec3;
use swell::{
    cache::CacheReader,
    domain::{bounds::Bounds, solver::StepReport},
};

use crate::support::{
    flip::{position, velocity},
    job::Job,
    paper::{Paper, of_cells},
};

use super::independent::close;

const DAM: &str = r#"
[shot]
name = "dam"
frames = 4
frames_per_second = 30
[domain]
min = [0.0, 0.0, 0.0]
max = [1.6, 1.4, 0.8]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.8, 1.0, 0.8]
[solver]
[solver.pbf]
particle_spacing = 0.1
[solver.flip]
cell_size = 0.2
"#;

/// Mean, 99th percentile and largest of max(0, ρ − 1).
fn errors(densities: &[f64]) -> [f64; 3] {
    let mut errors: Vec<f64> = densities.iter().map(|rho| (rho - 1.0).max(0.0)).collect();
    errors.sort_by(f64::total_cmp);
    // Nearest-rank percentile: that many values are no larger.
    let rank = (99 * errors.len()).div_ceil(100);
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    [mean, errors[rank - 1], errors[errors.len() - 1]]
}

/// The ledger's report of each frame matches sums over its particles, computed in this file, for
/// either device. f32 sums of 34 terms err by 42 ε (pbf.rs), walls by 5e-7. FLIP's hats add
/// 2.4e-7 each, of 72 that count in a sum of 8: 2.2e-6, and f32 some 10 ε.
#[test]
fn ledgers_say_what_their_frames_come_to() {
    let job = Job::of(&[("dam.toml", DAM)]);
    let paper = Paper::new(0.1, 2.0);
    let walls = Bounds {
        min: DVec3::ZERO,
        max: DVec3::new(1.6, 1.4, 0.8),
    };
    for (solver, device) in [
        ("pbf", "gpu"),
        ("pbf", "cpu"),
        ("flip", "gpu"),
        ("flip", "cpu"),
    ] {
        let cache = format!("{solver}-{device}");
        let bake = format!(
            "bake dam.toml -o {cache} --set solver.method={solver} --device {device} \
             --set solver.pbf.grid_projection=false"
        );
        job.expect(0, &bake);
        let reader = CacheReader::open(&job.path(&cache)).unwrap();
        let places = |frame: u32| -> Vec<DVec3> {
            let state = reader.read(frame).unwrap();
            (0..state.len()).map(|k| position(&state, k)).collect()
        };
        for frame in 1..=4 {
            let state = reader.read(frame).unwrap();
            let report = reader.entry(frame).unwrap().report.clone();
            let report: StepReport = serde_json::from_value(report).unwrap();
            let (mut kinetic, mut potential, mut fastest) = (0.0, 0.0, 0.0f64);
            for k in 0..state.len() {
                let (x, v) = (position(&state, k), velocity(&state, k));
                // 1 kg each. Potential energy is taken at the middle of the frame's last substep,
                // as velocities are.
                let substep = 1.0 / (30.0 * f64::from(report.substeps));
                kinetic += (v.x * v.x + v.y * v.y + v.z * v.z) / 2.0;
                potential += 9.81 * (x.y - substep * v.y / 2.0);
                fastest = fastest.max((v.x * v.x + v.y * v.y + v.z * v.z).sqrt());
            }
            close(report.kinetic_energy, kinetic, 1e-12, "kinetic energy");
            close(
                report.potential_energy,
                potential,
                1e-12,
                "potential energy",
            );
            close(report.max_speed, fastest, 1e-12, "speed");
            let densities = match solver {
                "pbf" => {
                    let places = places(frame);
                    let fluid = paper.densities(&places).into_iter().zip(&places);
                    fluid
                        .map(|(rho, x)| rho + paper.of_walls(*x, &walls))
                        .collect()
                }
                _ => of_cells(&places(frame - 1), walls.max, 0.2),
            };
            assert!(solver == "pbf" || report.substeps == 1);
            let found = [
                report.density_error_mean,
                report.density_error_p99,
                report.density_error_max,
            ];
            let expected = errors(&densities);
            println!("{cache}, frame {frame}: {found:?} {expected:?}");
            let tolerance = if solver == "pbf" { 6e-6 } else { 1e-5 };
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < tolerance, "{found} {expected}");
                // An error of 1 % in any of them would be detected.
                assert!(frame < 4 || expected > 100.0 * tolerance, "{expected}");
            }
        }
    }
}
