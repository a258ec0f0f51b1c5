//! `swell diff` of caches and baselines: differences are reported, equal inputs pass, and every
//! comparison fails when one side is spoiled.
mod spread;
mod streams;

use std::fs;

use crate::support::job::{Job, assert_has};
use crate::support::made_cache::{Made, SCENE, write_cache};
use serde_json::Value;
use swell::domain::particles::Particles;

/// Reverses the x velocity of particle 123 from frame 3 on.
fn flipped(frame: u32, particles: &mut Particles) {
    if frame >= 3 {
        particles.velocity[123][0] *= -1.0;
    }
}

#[test]
fn equal_caches_are_equal_and_a_flipped_velocity_is_found() {
    let job = Job::of(&[]);
    write_cache(&job.path("a"), &Made::default());
    write_cache(&job.path("b"), &Made::default());
    let said = job.expect(0, "diff a b");
    assert_has(
        &said,
        &["the same physics", "frames 0-4", "the same, bit for bit"],
    );

    let spoiled = Made {
        spoil: &flipped,
        ..Made::default()
    };
    write_cache(&job.path("spoiled"), &spoiled);
    let said = job.expect(1, "diff spoiled b");
    assert_has(
        &said,
        &[
            "first differing bit: frame 3, velocity of particle 123: A [-1.0",
            "OUT OF TOLERANCE",
        ],
    );
    let found = job.json(1, "diff spoiled b");
    assert_eq!(found["is_within"], false);
    let frames = found["diff"]["frames"].as_array().unwrap();
    assert_eq!(frames[2]["faults"].as_array().unwrap().len(), 0);
    let fault = &frames[3]["faults"][0];
    assert_eq!(
        (&fault["what"], &fault["measure"]),
        (&"velocity".into(), &"bits".into())
    );
    assert_eq!(fault["parting"]["particle"], 123);
    // A reversed velocity of 1 m/s has an error of 2 m/s; RMS over 800 particles: 2/√800.
    let deviation = &frames[3]["fields"][1]["deviation"];
    assert_eq!(deviation["max"], 2.0);
    let rms = deviation["rms"].as_f64().unwrap();
    assert!((rms - 2.0 / 800f64.sqrt()).abs() < 1e-12, "{rms}");
    // The reversed velocity has the same kinetic energy, which is why particles are compared.
    let energies = &frames[3]["aggregates"];
    assert_eq!(energies[0]["kinetic_energy"], energies[1]["kinetic_energy"]);
    // The frames before are the same.
    job.expect(0, "diff spoiled b --frames 0-2");
}

/// Caches of different devices: other bits are expected, other water is not.
#[test]
fn caches_of_different_devices_are_judged_by_aggregates() {
    let job = Job::of(&[]);
    write_cache(&job.path("b"), &Made::default());
    let nudged = |_: u32, particles: &mut Particles| particles.position[5][0] += 1e-6;
    let raised = |_: u32, particles: &mut Particles| {
        particles.position.iter_mut().for_each(|p| p[1] += 0.2);
    };
    type Spoil<'a> = &'a dyn Fn(u32, &mut Particles);
    let spoils: [(&str, &str, Spoil<'_>); 3] = [
        ("nudged", "another device", &nudged),
        ("raised", "another device", &raised),
        ("same", "a device", &nudged),
    ];
    for (name, device, spoil) in spoils {
        let made = Made {
            device,
            spoil,
            ..Made::default()
        };
        write_cache(&job.path(name), &made);
    }
    let said = job.expect(0, "diff nudged b");
    assert_has(
        &said,
        &[
            "by aggregates: on different devices roundings differ",
            "first differing bit: frame 0",
            "aggregates within the limits for different devices",
        ],
    );
    let limits = &job.json(0, "diff nudged b")["diff"]["device_limits"];
    assert!(limits["volume"]["relative"].is_number(), "{limits}");
    let said = job.expect(1, "diff raised b");
    assert_has(&said, &["out: ", "OUT OF TOLERANCE"]);
    // Negative control: on the same device every bit counts, and there are no such limits.
    let said = job.expect(1, "diff same b");
    assert!(!said.contains("by aggregates"), "{said}");
    // A tolerance judges what it names, on any device.
    job.write("tight.toml", "[position]\nmax = 1e-7\n");
    let said = job.expect(1, "diff nudged b --tolerance tight.toml");
    assert!(!said.contains("by aggregates"), "{said}");
}

#[test]
fn tolerances_come_from_a_file_and_judge_what_they_name() {
    let job = Job::of(&[]);
    write_cache(&job.path("b"), &Made::default());
    write_cache(
        &job.path("a"),
        &Made {
            spoil: &flipped,
            ..Made::default()
        },
    );
    job.write(
        "loose.toml",
        "[velocity]\nmax = 2.0\n[aggregates]\nkinetic_energy = { relative = 0 }\n",
    );
    assert_has(
        &job.expect(0, "diff a b --tolerance loose.toml"),
        &["within tolerance"],
    );
    job.write("tight.toml", "[velocity]\nmax = 1.9\n");
    let said = job.expect(1, "diff a b --tolerance tight.toml");
    assert_has(
        &said,
        &["frame 3, velocity: max 2, allowed 1.900; particle 123"],
    );
    job.write("other.toml", "[position]\nmax = 0\nrms = 0\np99 = 0\n");
    job.expect(0, "diff a b --tolerance other.toml");

    // An aggregate by itself: raising a layer raises the potential energy.
    let lift = |frame: u32, particles: &mut Particles| {
        if frame == 2 {
            particles.position[700][1] += 1.0;
        }
    };
    write_cache(
        &job.path("lifted"),
        &Made {
            spoil: &lift,
            ..Made::default()
        },
    );
    // One particle of 1 kg by 1 m: m g h = 9.81 J, of about 800 · 9.81 · 0.5 J.
    job.write(
        "energy.toml",
        "[aggregates]\npotential_energy = { absolute = 9.7 }\n",
    );
    let said = job.expect(1, "diff lifted b --tolerance energy.toml");
    assert_has(
        &said,
        &["frame 2, potential_energy: difference 9.810, allowed 9.7"],
    );
    job.write(
        "energy.toml",
        "[aggregates]\npotential_energy = { relative = 0.003 }\n",
    );
    job.expect(0, "diff lifted b --tolerance energy.toml");

    for (text, words) in [
        (
            "[velocty]\nmax = 1\n",
            &["t.toml:1", "nearest is \"velocity\""][..],
        ),
        (
            "[velocity]\nmax = -1\n",
            &["t.toml:2: velocity.max", "from 0"],
        ),
        (
            "[attributes.foam]\nmax = 1\n",
            &["limits foam", "position, velocity"],
        ),
        (
            "[pictures]\nmax = 1\n",
            &["only [pictures]", "[aggregates]"],
        ),
    ] {
        job.write("t.toml", text);
        assert_has(&job.expect(2, "diff a b --tolerance t.toml"), words);
    }
    assert_has(
        &job.expect(2, "diff a b --tolerance none.toml"),
        &["cannot read none.toml"],
    );
}

#[test]
fn ids_frames_and_settings_that_differ_are_told() {
    let job = Job::of(&[]);
    write_cache(&job.path("b"), &Made::default());
    let lose = |frame: u32, particles: &mut Particles| {
        if frame > 0 {
            for values in [&mut particles.position, &mut particles.velocity] {
                values.remove(40);
            }
            particles.id.remove(40);
        }
    };
    let other = SCENE.replace(
        "particle_spacing = 0.1",
        "particle_spacing = 0.1\niterations = 7",
    );
    let made = Made {
        scene: &other,
        spoil: &lose,
        last: 3,
        ..Made::default()
    };
    write_cache(&job.path("a"), &made);
    let said = job.expect(1, "diff a b");
    assert_has(
        &said,
        &[
            "solver.pbf.iterations was 4.0, is now 7.0",
            "frames only in B: 4",
            "frame 1: 799 in both, 0 only in A, 1 only in B (first id 40)",
            "no differing bit in the particles that both have",
            "frame 1, particles: 1 on only one side",
        ],
    );
    assert_has(&job.expect(1, "diff b a"), &["frames only in A: 4"]);
    // A different setting by itself is no fault.
    let made = Made {
        scene: &other,
        ..Made::default()
    };
    write_cache(&job.path("setting"), &made);
    assert_has(
        &job.expect(0, "diff setting b"),
        &["solver.pbf.iterations was 4.0"],
    );
    assert_has(
        &job.expect(4, "diff a b --frames 4"),
        &["has frames 0 to 3, not 4"],
    );
}

#[test]
fn a_baseline_knows_its_adapter_by_hashes_and_others_by_aggregates() {
    let job = Job::of(&[]);
    write_cache(&job.path("b"), &Made::default());
    let said = job.expect(0, "diff b --write-baseline base.json");
    assert_has(
        &said,
        &["base.json: 5 frames of a device (its driver 1.2, Vulkan)"],
    );
    assert_has(
        &job.expect(0, "diff b base.json"),
        &["by hashes", "within tolerance"],
    );

    // On another adapter aggregates are compared, which a reversed velocity does not change.
    let elsewhere = Made {
        device: "another device",
        spoil: &flipped,
        ..Made::default()
    };
    write_cache(&job.path("elsewhere"), &elsewhere);
    let said = job.expect(0, "diff elsewhere base.json");
    assert_has(
        &said,
        &[
            "by aggregates",
            "no hashes of this adapter, but of a device",
        ],
    );
    // On the adapter of the baseline the same particles fail by their hash.
    write_cache(
        &job.path("spoiled"),
        &Made {
            spoil: &flipped,
            ..Made::default()
        },
    );
    let said = job.expect(1, "diff spoiled base.json");
    assert_has(
        &said,
        &[
            "frame 3, the particles' hash differs",
            "much the same water",
        ],
    );
    job.expect(0, "diff spoiled base.json --frames 0-2");

    // Aggregates fail as well: the upper half of the water is thrown up on another adapter.
    let thrown = |_: u32, particles: &mut Particles| {
        for position in &mut particles.position {
            position[1] += if position[1] > 1.0 { 0.5 } else { 0.0 };
        }
    };
    let thrown = Made {
        device: "another device",
        spoil: &thrown,
        ..Made::default()
    };
    write_cache(&job.path("thrown"), &thrown);
    let said = job.expect(1, "diff thrown base.json");
    assert_has(&said, &["by aggregates", "potential_energy: difference"]);

    // One digit of one hash.
    let text = fs::read_to_string(job.path("base.json")).unwrap();
    let base: Value = serde_json::from_str(&text).unwrap();
    let adapter = "a device (its driver 1.2, Vulkan)";
    let hash = base["hashes"][adapter][2].as_str().unwrap();
    let digit = if hash.starts_with('0') { "1" } else { "0" };
    job.write(
        "off.json",
        &text.replace(hash, &format!("{digit}{}", &hash[1..])),
    );
    assert_has(
        &job.expect(1, "diff b off.json"),
        &["frame 2, the particles' hash"],
    );

    // A second adapter is added beside the first, whose aggregates are kept.
    let said = job.expect(0, "diff elsewhere --write-baseline base.json");
    assert_has(&said, &["hashes taken before and kept: a device"]);
    assert_has(
        &job.expect(0, "diff elsewhere base.json"),
        &["by hashes", "from a device"],
    );
    job.expect(0, "diff b base.json");
    // Written again it is the same file.
    let twice = fs::read(job.path("base.json")).unwrap();
    assert_has(
        &job.expect(0, "diff b --write-baseline base.json"),
        &["unchanged"],
    );
    assert_ne!(text.as_bytes(), twice);
    job.expect(0, "diff elsewhere --write-baseline base.json");
    // A bake of fewer frames lacks some.
    write_cache(
        &job.path("short"),
        &Made {
            last: 2,
            ..Made::default()
        },
    );
    assert_has(
        &job.expect(1, "diff short base.json"),
        &["frames only in B: 3-4"],
    );

    for (text, words) in [
        ("{}", &["not a baseline", "format_version"][..]),
        ("not json", &["not a baseline", "line 1"]),
        (
            &text.replace("\"volume\": {", "\"volum\": {"),
            &["not a baseline"],
        ),
        (
            &text.replacen(&format!("\"{hash}\","), "", 1),
            &["has 4 of 5 frames"],
        ),
    ] {
        job.write("bad.json", text);
        assert_has(&job.expect(4, "diff b bad.json"), words);
        // A file that is no baseline is not overwritten.
        job.expect(4, "diff b --write-baseline bad.json");
        assert_eq!(fs::read_to_string(job.path("bad.json")).unwrap(), text);
    }
    job.write("t.toml", "[velocity]\nmax = 1\n");
    assert_has(
        &job.expect(2, "diff b base.json --tolerance t.toml"),
        &["its own tolerances"],
    );
}

#[test]
fn a_baked_cache_is_its_own_baseline_and_another_setting_is_not() {
    let job = Job::of(&[]);
    job.write("small.toml", SCENE);
    job.expect(0, "bake small.toml -o a");
    job.expect(0, "bake small.toml -o b");
    job.expect(0, "diff a b");
    job.expect(0, "diff a --write-baseline base.json");
    job.expect(0, "diff b base.json");
    // The report names a changed setting and the frame where the difference begins.
    job.expect(0, "bake small.toml -o c --set solver.pbf.iterations=5");
    let said = job.expect(1, "diff c b");
    assert_has(
        &said,
        &[
            "solver.pbf.iterations was 4.0, is now 5.0",
            "first differing bit: frame 1, position of particle",
        ],
    );
    let said = job.expect(1, "diff c base.json");
    assert_has(
        &said,
        &[
            "by hashes",
            "solver.pbf.iterations was 4.0, is now 5.0",
            "frame 1",
        ],
    );
}
