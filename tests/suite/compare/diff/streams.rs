//! Grids, probes and ledger lines are verified as they are read, and compared.

use std::fs;

use swell::domain::particles::Particles;

use crate::support::{
    job::{Job, assert_has},
    made_cache::{self, Made, write_cache},
};

/// Flips one bit of a file.
fn damage(job: &Job, file: &str) {
    let path = job.path(file);
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&path, bytes).unwrap();
}

/// A file and the function that damages it.
type Damage<'a> = (&'static str, &'a dyn Fn(&str));

#[test]
fn a_damaged_grid_or_probe_file_is_named() {
    let job = Job::of(&[]);
    for cache in ["a", "b"] {
        write_cache(&job.path(cache), &Made::watched());
    }
    assert_has(&job.expect(0, "diff a b"), &["the same, bit for bit"]);
    job.expect(0, "diff b --write-baseline base.json");
    job.write("loose.toml", "[velocity]\nmax = 1\n");
    let text = |name: &str| fs::read(job.path(name)).unwrap();
    let damages: [Damage<'_>; 5] = [
        ("grids/small.0002.vdb", &|file| damage(&job, file)),
        ("probes/far.csv", &|file| damage(&job, file)),
        ("probes/near.csv", &|file| {
            fs::write(
                job.path(file),
                [text(file), b"5,0.1,1.0,1.0\n".to_vec()].concat(),
            )
            .unwrap();
        }),
        ("probes/near.csv", &|file| {
            let whole = text(file);
            fs::write(job.path(file), &whole[..whole.len() - 1]).unwrap();
        }),
        ("grids/small.0004.vdb", &|file| {
            fs::remove_file(job.path(file)).unwrap()
        }),
    ];
    for (name, spoil) in damages {
        let file = format!("a/{name}");
        let whole = text(&file);
        spoil(&file);
        for words in [
            "diff a b",
            "diff b a",
            "diff a b --tolerance loose.toml",
            "diff a base.json",
            "diff a --write-baseline new.json",
        ] {
            assert_has(&job.expect(4, words), &[&file, "is damaged"]);
        }
        assert!(!job.path("new.json").exists());
        fs::write(job.path(&file), whole).unwrap();
        job.expect(0, "diff a b");
    }
    // Grids of frames that are not compared do not matter.
    damage(&job, "a/grids/small.0002.vdb");
    job.expect(0, "diff a b --frames 3-4");
}

#[test]
fn grids_that_differ_are_told_and_count() {
    let job = Job::of(&[]);
    write_cache(&job.path("b"), &Made::watched());
    let shifted = |frame: u32, particles: &mut Particles| {
        if frame >= 3 {
            particles.position[799][1] += 0.05;
        }
    };
    let made = Made {
        spoil: &shifted,
        ..Made::watched()
    };
    write_cache(&job.path("a"), &made);
    let said = job.expect(1, "diff a b");
    assert_has(
        &said,
        &[
            "out: grids not the same in frames 3-4; frame 3, grids/small.0003.vdb: surface: ",
            "the largest difference",
        ],
    );
    let found = job.json(1, "diff a b");
    let grids = &found["diff"]["streams"][0];
    assert_eq!(
        (&grids["frame"], &grids["stream"]),
        (&3.into(), &"grids".into())
    );
    // A particle raised by half a spacing moves the surface around it by at most that,
    // and not by zero.
    let surface = &grids["differences"][0];
    assert_eq!(surface["grid"], "surface");
    let largest = surface["largest"].as_f64().unwrap();
    assert!(largest > 0.001 && largest < 0.05, "{largest}");
    let different = surface["different"].as_u64().unwrap();
    assert!(different > 0 && different < surface["active"][1].as_u64().unwrap());
    // All earlier frames are the same, and a tolerance does not judge them.
    job.expect(0, "diff a b --frames 0-2");
    job.write("loose.toml", "[position]\nmax = 0.1\n");
    assert_has(
        &job.expect(0, "diff a b --tolerance loose.toml"),
        &[
            "\ngrids not the same in frames 3-4",
            "not judged",
            "within tolerance",
        ],
    );

    // Another version of the program writes other bytes for the same values.
    let made = Made {
        version: "0.1.1-next",
        ..Made::watched()
    };
    write_cache(&job.path("next"), &made);
    let bytes = |cache: &str| fs::read(job.path(cache).join("grids/small.0002.vdb")).unwrap();
    assert_ne!(bytes("next"), bytes("b"));
    assert_has(&job.expect(0, "diff next b"), &["the same, bit for bit"]);
    // Finer voxels are a different setting of the grids, and the grids differ.
    let mut made = Made::watched();
    made.grids.as_mut().unwrap().voxel_size = 0.05;
    write_cache(&job.path("finer"), &made);
    assert_has(
        &job.expect(1, "diff finer b"),
        &[
            "out: grids not the same in frames 0-4",
            "voxel_size: A 0.05, B 0.1",
        ],
    );
    // A stream on one side only.
    let mut made = Made::watched();
    made.grids.as_mut().unwrap().velocity = false;
    made.probes.pop();
    write_cache(&job.path("less"), &made);
    write_cache(&job.path("plain"), &Made::default());
    for (words, expected) in [
        (
            "diff plain b",
            &["grids only in B", "probe near only in B"][..],
        ),
        ("diff b plain", &["grids only in A", "probe far only in A"]),
        (
            "diff less b",
            &["grid vel only in B", "probe far only in B"],
        ),
    ] {
        let said = job.expect(1, words);
        assert_has(&said, expected);
        assert_has(
            &said,
            &["no differing bit in the particles", "OUT OF TOLERANCE"],
        );
    }
    assert_has(
        &job.expect(0, "diff plain b --tolerance loose.toml"),
        &["grids only in B", "not judged"],
    );
}

#[test]
fn probes_and_reports_that_differ_are_told_and_count() {
    let job = Job::of(&[]);
    write_cache(&job.path("b"), &Made::watched());
    let other = |frame: u32, probe: usize, column: usize| match (frame, probe, column) {
        (2.., 0, 1) => Some(7.25),
        (4, 1, _) => None,
        _ => made_cache::seen(frame, probe, column),
    };
    let made = Made {
        seen: &other,
        ..Made::watched()
    };
    write_cache(&job.path("a"), &made);
    let said = job.expect(1, "diff a b");
    assert_has(
        &said,
        &[
            "no differing bit in the particles",
            "out: probe near not the same in frames 2-4; frame 2, probes/near.csv: potential_j: \
             A 7.25, B 2.5",
            "out: probe far not the same in frames 4; frame 4, probes/far.csv: depth_m: A null, \
             B 4.0",
            "OUT OF TOLERANCE",
        ],
    );
    job.expect(0, "diff a b --frames 0-1");
    job.write("loose.toml", "[position]\nmax = 0\n");
    assert_has(
        &job.expect(0, "diff a b --tolerance loose.toml"),
        &["\nprobe near not the same", "not judged"],
    );

    let slower = |frame: u32| {
        let mut report = made_cache::report(frame);
        if frame >= 1 {
            report["iterations"] = 5.into();
        }
        report
    };
    let made = Made {
        report: &slower,
        ..Made::watched()
    };
    write_cache(&job.path("slower"), &made);
    assert_has(
        &job.expect(1, "diff slower b"),
        &[
            "out: ledger not the same in frames 1-4; frame 1, frames.jsonl: report.iterations: \
             A 5, B 4",
        ],
    );
}
