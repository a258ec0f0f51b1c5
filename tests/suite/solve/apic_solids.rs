//! APIC beside solids that cut cells: its affine rows stay bounded where faces are almost closed.

use swell::cache::CacheReader;

use crate::support::job::Job;

const SCENE: &str = include_str!("../../hard_cases/36-beach-1in20.toml");
const BOX: &str = include_str!("../../hard_cases/box.obj");

/// `key` of the ledger's reports, by frame from 1 on.
fn reported(job: &Job, cache: &str, key: &str) -> Vec<f64> {
    let reader = CacheReader::open(&job.path(cache)).unwrap();
    let entries = reader.entries()[1..].iter();
    entries
        .map(|entry| entry.report[key].as_f64().unwrap())
        .collect()
}

/// Water at rest on a beach of 1:20 calms down. Negative control: with rows divided by the sum of
/// the open weights, as the interpolation is, it is faster and faster.
#[test]
fn apic_on_a_beach_comes_to_rest() {
    let job = Job::of(&[("beach.toml", SCENE), ("box.obj", BOX)]);
    let bake = "bake beach.toml --solver flip --set solver.flip.transfer=apic";
    job.expect(0, &format!("{bake} --frames 1-40 -o cache"));
    let energy = reported(&job, "cache", "kinetic_energy");
    let speed = reported(&job, "cache", "max_speed");
    let fastest = speed[31..].iter().fold(0.0, |most: f64, v| most.max(*v));
    println!("{fastest} m/s, {} J and {} J", energy[7], energy[39]);
    // The mark of hard case 36 for water at rest.
    assert!(fastest < 0.02, "{fastest}");
    assert!(energy[39] < energy[7], "{energy:?}");
    job.copy_shaders("divided");
    job.edit(
        "divided/flip/grid_to_particle.wgsl",
        "let scale = params.inverse_cell_size;",
        "let scale = params.inverse_cell_size * per_whole;",
    );
    job.expect(
        0,
        &format!("{bake} --frames 1-40 -o spoiled --shaders divided"),
    );
    let spoiled = reported(&job, "spoiled", "max_speed");
    assert!(spoiled[39] > 1.0, "{spoiled:?}");
}
