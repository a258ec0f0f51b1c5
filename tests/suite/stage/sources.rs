//! Water that enters and leaves during a bake: ledger, ids, resumed and branched bakes, and the
//! step after an exchange.

use std::collections::BTreeSet;

use crate::support::job::Job;
use swell::cache::CacheReader;

/// A first emitter whose water all flows into the drain below it, so that the newest ids are gone
/// when the second emitter, which keeps a level in a mesh, begins.
const SOURCES: &str = r#"
[[emitter]]
min = [0.3, 1.9, 0.55]
max = [0.7, 2.2, 0.95]
velocity = [0.0, -3.0, 0.0]
until = 0.055

[[emitter]]
min = [-0.9, 1.9, 0.45]
max = [-0.5, 2.2, 0.95]
velocity = [0.5, 1.5, 0.0]
from = 0.09

[[emitter]]
mesh = { file = "box.obj", translate = [-1.1, 0.1, 0.0], scale = [0.8, 1.0, 1.0] }
level = 0.95
from = 0.09

[[drain]]
min = [0.2, 1.1, 0.45]
max = [0.8, 2.3, 1.05]
from = 0.055

[[drain]]
min = [-1.0, 0.5, 0.25]
max = [-0.2, 0.8, 1.25]
rate = 0.4
"#;

const FRAMES: u32 = 8;

fn job() -> Job {
    let job = Job::new();
    job.edit(
        "small.toml",
        "[solver]\n",
        &format!("{SOURCES}\n[solver]\n"),
    );
    job
}

/// Ids of each frame.
fn ids(reader: &CacheReader) -> Vec<Vec<u32>> {
    let frames = reader.first_frame()..=FRAMES;
    frames.map(|frame| reader.read(frame).unwrap().id).collect()
}

/// Checks that each frame's line counts what entered and left, and that no id is reused. Returns
/// the totals of both.
fn closes(ids: &[Vec<u32>], exchanges: &[[u64; 2]]) -> Result<[u64; 2], String> {
    let mut gone = BTreeSet::new();
    let mut newest = *ids[0].last().expect("water at the start");
    let mut all = [0, 0];
    for (k, pair) in ids.windows(2).enumerate() {
        let [before, now] =
            [&pair[0], &pair[1]].map(|ids| ids.iter().copied().collect::<BTreeSet<_>>());
        let entered: Vec<u32> = now.difference(&before).copied().collect();
        let left: Vec<u32> = before.difference(&now).copied().collect();
        let found = [entered.len() as u64, left.len() as u64];
        if found != exchanges[k] {
            return Err(format!("frame {}: {found:?} of {:?}", k + 1, exchanges[k]));
        }
        if let Some(id) = entered
            .iter()
            .find(|id| **id <= newest || gone.contains(*id))
        {
            return Err(format!("frame {}: {id} was given before", k + 1));
        }
        newest = newest.max(entered.last().copied().unwrap_or(0));
        gone.extend(left);
        all = [all[0] + found[0], all[1] + found[1]];
    }
    Ok(all)
}

fn exchanges(reader: &CacheReader) -> Vec<[u64; 2]> {
    let entries = reader.entries()[1..].iter();
    let count = |value: &serde_json::Value, key: &str| value["exchange"][key].as_u64().unwrap();
    entries
        .map(|entry| ["entered", "left"].map(|key| count(&entry.report, key)))
        .collect()
}

fn holds(solver: &str, device: &str) {
    let job = job();
    let bake = format!("bake small.toml --solver {solver} --device {device}");
    job.expect(0, &format!("{bake} -o whole"));
    job.expect(0, "verify whole");
    let reader = CacheReader::open(&job.path("whole")).unwrap();
    let (all, exchanges) = (ids(&reader), exchanges(&reader));
    let [entered, left] = closes(&all, &exchanges).unwrap();
    assert!(entered > 50 && left > 60, "{entered} {left}");
    // Negative controls: a particle that no line counts, and one with the id of a removed particle.
    let mut spoiled = all.clone();
    spoiled[4].pop();
    assert!(closes(&spoiled, &exchanges).is_err());
    let newest_gone = all[3].last().copied().unwrap();
    assert!(
        !all[6].contains(&newest_gone) && *all[6].last().unwrap() > newest_gone,
        "the newest ids have to be gone before the next come"
    );
    let mut spoiled = all;
    for ids in &mut spoiled[6..] {
        ids.pop();
        ids.push(newest_gone);
    }
    let said = closes(&spoiled, &exchanges).unwrap_err();
    assert!(said.contains("was given before"), "{said}");

    // Stopped while the newest ids are gone and no new ones exist, then resumed; and
    // begun from there.
    let whole = job.hash("whole");
    job.expect(0, &format!("{bake} --frames 1-5 -o parts"));
    job.expect(0, &format!("{bake} --resume -o parts"));
    assert_eq!(job.hash("parts"), whole);
    job.expect(0, &format!("{bake} --from whole:5 -o branch"));
    let branch = CacheReader::open(&job.path("branch")).unwrap();
    for frame in 5..=FRAMES {
        assert_eq!(branch.read(frame).unwrap(), reader.read(frame).unwrap());
    }
}

#[test]
fn pbf_bakes_in_which_water_comes_and_goes_close_and_go_on() {
    holds("pbf", "gpu");
}

#[test]
fn flip_bakes_in_which_water_comes_and_goes_close_and_go_on() {
    holds("flip", "gpu");
}

#[test]
fn reference_bakes_in_which_water_comes_and_goes_close_and_go_on() {
    holds("pbf", "cpu");
    holds("flip", "cpu");
}

/// The step after water entered agrees with the reference pass, with another particle count
/// than at the start.
#[test]
fn the_step_after_an_exchange_is_the_references() {
    for solver in ["pbf", "flip"] {
        let job = job();
        job.expect(0, &format!("bake small.toml --solver {solver} -o whole"));
        let reader = CacheReader::open(&job.path("whole")).unwrap();
        let counts = [0, 3, 7].map(|frame| reader.read(frame).unwrap().len());
        assert!(
            counts[1..].iter().all(|count| *count != counts[0]),
            "{counts:?}"
        );
        let said = job.expect(0, "check whole --frames 3-7x4");
        assert!(said.contains("within tolerance"), "{said}");
        // So do the stages that read the cache.
        job.write(
            "tuned.toml",
            "[emission]\ntrapped_air = [0.01, 0.1]\nwave_crest = [0.2, 2.0]\nenergy = [0.02, 0.5]\n\
             trapped_air_rate = 1e5\nwave_crest_rate = 2.5e5\n",
        );
        job.expect(0, "whitewater whole --settings tuned.toml");
        job.expect(0, "verify whole/whitewater/tuned");
        job.expect(0, "check whole/whitewater/tuned --frames 3-7x4");
        job.expect(0, "render whole --look look.toml --frames 1-8 -o pictures");
    }
}

/// Particles of each frame of a cache.
fn counts(job: &Job, cache: &str) -> Vec<usize> {
    let reader = CacheReader::open(&job.path(cache)).unwrap();
    let frames = reader.first_frame()..=reader.last_frame();
    frames
        .map(|frame| reader.read(frame).unwrap().len())
        .collect()
}

/// With drains the particle count cannot be predicted: the bake ends after the frame that exceeds
/// its budget, and can be resumed with a higher one.
#[test]
fn a_bake_with_more_particles_than_its_budget_ends_there() {
    let job = job();
    let bake = "bake small.toml --solver flip --device cpu";
    job.expect(0, &format!("{bake} -o whole"));
    let counts = counts(&job, "whole");
    let most = *counts.iter().max().unwrap();
    let frame = counts.iter().position(|count| *count == most).unwrap();
    assert!(frame > 1, "{counts:?}");
    let limited =
        |limit: usize| format!("{bake} -o limited --resume --set budget.particles={limit}");
    let said = job.expect(5, &limited(most - 1));
    let expected = format!(
        "frame {frame}: the count of particles with what entered is {most}, \
         and budget.particles is {}; emitters brought them; the last good frame is kept",
        most - 1
    );
    assert!(said.contains(&expected), "{said}");
    let reader = CacheReader::open(&job.path("limited")).unwrap();
    assert_eq!(reader.last_frame() as usize, frame - 1);
    let said = job.expect(5, "check limited/failed");
    assert!(said.contains("budget.particles"), "{said}");
    // Negative control: one more.
    job.expect(0, &limited(most));
    assert!(!job.path("limited/failed").exists());
    let [whole, limited] =
        ["whole", "limited"].map(|cache| CacheReader::open(&job.path(cache)).unwrap());
    for frame in 0..=FRAMES {
        assert_eq!(whole.read(frame).unwrap(), limited.read(frame).unwrap());
    }
}

/// Without drains the minimum that emitters add is known, so the bake is refused before
/// anything is written.
#[test]
fn a_bake_that_is_known_to_have_more_particles_is_refused_before_it_begins() {
    let job = job();
    let begin = SOURCES.find("[[drain]]").unwrap();
    job.edit("small.toml", &SOURCES[begin..], "");
    // The amount that a level emitter adds is unknown, and only adds to it.
    let level = SOURCES.find("[[emitter]]\nmesh").unwrap();
    job.edit("small.toml", &SOURCES[level..begin], "");
    let bake = "bake small.toml --solver flip --device cpu";
    job.expect(0, &format!("{bake} -o whole"));
    let counts = counts(&job, "whole");
    let [first, .., last] = counts[..] else {
        panic!("{counts:?}")
    };
    let frame = counts.iter().position(|count| *count == last).unwrap();
    assert!(last > first && frame > 0, "{counts:?}");
    let limited = |limit: usize| format!("{bake} -o limited --set budget.particles={limit}");
    let said = job.expect(2, &limited(first - 1));
    let expected = format!(
        "budget.particles is {}: the start has {first} particles",
        first - 1
    );
    assert!(said.contains(&expected), "{said}");
    let said = job.expect(2, &limited(last - 1));
    let expected = format!("there are {last} particles or more after frame {frame}");
    assert!(said.contains(&expected), "{said}");
    assert!(!job.path("limited").exists());
    // Negative control: one more, and a shorter bake.
    job.expect(
        0,
        &format!("{} --frames 1-{}", limited(last - 1), frame - 1),
    );
    job.expect(0, &limited(last).replace("limited", "other"));
}
