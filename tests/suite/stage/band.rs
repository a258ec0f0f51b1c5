//! Bakes with a band of particles: resumed, branched, compared, and with the reference.

use crate::support::job::Job;
use swell::cache::CacheReader;

/// A column of water that falls apart beside deeper water, so that cells come into the band and
/// leave it.
const SCENE: &str = r#"
[shot]
name = "band"
frames = 6
frames_per_second = 24

[domain]
min = [-0.8, 0.5, 0.0]
max = [0.8, 3.7, 0.8]

[[water.block]]
min = [-0.8, 0.5, 0.0]
max = [0.8, 2.3, 0.8]

[[water.block]]
min = [-0.8, 2.3, 0.0]
max = [0.0, 2.9, 0.8]

[solver]
method = "flip"

[solver.flip]
cell_size = 0.1
cfl = 2.0
band = 4
"#;

fn job() -> Job {
    Job::of(&[("band.toml", SCENE)])
}

/// Bytes do not depend on where a bake stops, and a branch begins with the state of its frame.
fn resumes(device: &str, frames: u32, extra: &str) {
    let job = job();
    let bake = format!("bake band.toml --device {device} {extra}");
    job.expect(0, &format!("{bake} --frames 1-{frames} -o whole"));
    let whole = job.hash("whole");
    job.expect(0, &format!("{bake} --frames 1-2 -o parts"));
    job.expect(0, &format!("{bake} --frames 1-{frames} --resume -o parts"));
    assert_eq!(job.hash("parts"), whole);
    job.expect(0, "verify whole");
    job.expect(
        0,
        &format!("{bake} --frames 3-{frames} --from whole:2 -o branch"),
    );
    let [whole, branch] =
        ["whole", "branch"].map(|cache| CacheReader::open(&job.path(cache)).unwrap());
    for frame in 2..=frames {
        let (state, other) = (whole.state(frame).unwrap(), branch.state(frame).unwrap());
        assert!(state == other, "frame {frame}");
        // Cells came into the band, with particles that were never there before.
        assert!(state.deep.count() > 1000);
        let water = whole.read(frame).unwrap();
        assert_eq!(water.len(), state.amount());
        assert!(water.deep.is_empty());
    }
    let [first, last] = [0, frames].map(|frame| whole.state(frame).unwrap());
    assert!(last.id.last() > first.id.last(), "no particle was seeded");
}

#[test]
fn a_band_resumes_and_branches_with_the_same_bytes() {
    resumes("gpu", 6, "");
}

#[test]
fn a_band_that_is_compressed_resumes_with_the_same_bytes() {
    resumes("gpu", 4, "--set keep={compression=\"zstd\"}");
}

#[test]
fn a_band_of_the_reference_resumes_with_the_same_bytes() {
    resumes("cpu", 4, "");
}

/// `diff` sees a velocity in the depth that differs in its last bits.
#[test]
fn a_difference_in_the_depth_is_seen() {
    let job = job();
    job.expect(0, "bake band.toml --frames 1-2 -o a");
    job.expect(0, "bake band.toml --frames 1-2 -o b");
    job.expect(0, "diff a b");
    // Control: the same water with another band.
    job.expect(
        0,
        "bake band.toml --frames 1-2 --set solver.flip.band=5 -o c",
    );
    job.expect(1, "diff a c");
}

/// Densities near the band's end, where cells hold uneven numbers of particles, are those of the
/// reference. Control: cells up to the band's end count as they are filled.
#[test]
fn cells_near_the_end_of_a_band_count_as_full() {
    let job = job();
    job.copy_shaders("edited");
    job.edit(
        "edited/flip/gather_centers.wgsl",
        "const SEAM = 2.0;",
        "const SEAM = 0.0;",
    );
    job.expect(0, "bake band.toml --frames 1-5 -o cache");
    job.expect(0, "check cache --frames 2-5");
    let output = job.run("check cache --frames 5 --shaders edited");
    let said = String::from_utf8(output.stdout).unwrap();
    let mut rows = said
        .lines()
        .filter(|line| line.contains("relative density"));
    let row = rows.find(|line| line.starts_with("flip/gather_centers"));
    assert!(row.unwrap().ends_with("OUT"));
}
