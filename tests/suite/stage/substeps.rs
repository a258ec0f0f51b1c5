//! The length of the last substep is part of the state.

use swell::cache::CacheReader;

use crate::support::job::Job;

/// A falling column: its speed requires more substeps from frame to frame.
const FALL: &str = r#"
[shot]
name = "fall"
frames = 8
frames_per_second = 24
[domain]
min = [0.0, 0.0, 0.0]
max = [1.6, 1.6, 0.8]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.6, 1.2, 0.8]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
cfl = 1.0
[solver.pbf]
particle_spacing = 0.1
"#;

/// A bake that is resumed, begun from a frame or checked where the next substep is shorter
/// continues like the unbroken one.
#[test]
fn a_bake_goes_on_after_a_substep_of_another_length() {
    let job = Job::of(&[("fall.toml", FALL)]);
    for (solver, device) in [
        ("flip", "gpu"),
        ("pbf", "gpu"),
        ("flip", "cpu"),
        ("pbf", "cpu"),
    ] {
        let name = format!("{solver}-{device}");
        let bake = format!("bake fall.toml --solver {solver} --device {device}");
        job.expect(0, &format!("{bake} --frames 1-8 -o {name}"));
        let reader = CacheReader::open(&job.path(&name)).unwrap();
        let substep = |frame: u32| reader.read(frame).unwrap().substep;
        let change = |frame: &u32| substep(*frame) > 1.05 * substep(frame + 1);
        let at = (2..7)
            .find(change)
            .expect("a frame after which they are shorter");
        job.expect(0, &format!("{bake} --frames 1-{at} -o {name}-parts"));
        job.expect(0, &format!("{bake} --frames 1-8 --resume -o {name}-parts"));
        assert_eq!(
            job.hash(&format!("{name}-parts")),
            job.hash(&name),
            "{name}"
        );
        let begin = format!("{bake} --frames {}-8 --from {name}:{at}", at + 1);
        job.expect(0, &format!("{begin} -o {name}-branch"));
        let branch = CacheReader::open(&job.path(&format!("{name}-branch"))).unwrap();
        assert_eq!(branch.read(8).unwrap(), reader.read(8).unwrap(), "{name}");
        if device == "gpu" {
            job.expect(0, &format!("check {name} --frames {at}-{}", at + 1));
        }
    }
}
