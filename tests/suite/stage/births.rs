//! Births of whitewater from one breaking wave at three resolutions.

use std::fs;

use swell::{cache::CacheReader, domain::whitewater};

use crate::support::job::Job;

/// A bore of 2 m that a wall drives over water of 1.2 m, plunges and runs into the end of its
/// channel, 2 m wide.
const WAVE: &str = "[shot]\nname = \"wave\"\nframes = 48\nframes_per_second = 24\n\
    [domain]\nmin = [0, 0, 0]\nmax = [16, 8, 2]\n\
    [[water.block]]\nmin = [0, 0, 0]\nmax = [10, 1.2, 2]\n\
    [[wave_maker]]\nwall = \"-x\"\nmotion = { kind = \"table\", points = \
    [[0, 0], [0.4, 0.6], [0.8, 2.2], [1.2, 3.8], [1.6, 4.8]] }\n\
    [solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = 0.4\ncfl = 1.0\n\
    [solver.pbf]\nparticle_spacing = 0.2\niteration = \"red_black\"\niterations = 4\n";
/// Spacings of the water's particles, metres: a factor of two, in two steps.
const SPACINGS: [f64; 3] = [0.2, 0.141_42, 0.1];
/// By how much the number of births, or of particles at the end, may differ from the mean of the
/// three resolutions. A breaking wave is chaotic: its crests give 19 700, 22 700 and 25 400 births at
/// these spacings, and 21 600 at the next.
const ALLOWED: f64 = 0.2;

/// Numbers of births in all frames, and of particles in the last.
fn counts(job: &Job, stream: &str) -> [f64; 2] {
    let reader = CacheReader::open(&job.path(stream)).unwrap();
    let frames = reader.first_frame() + 1..=reader.last_frame();
    let born = |frame| {
        reader.entry(frame).unwrap().report["born"]
            .as_f64()
            .unwrap()
    };
    let last = reader.read(reader.last_frame()).unwrap();
    let left: usize = whitewater::census(&last).iter().sum();
    [frames.map(born).sum(), left as f64]
}

/// The same settings give as much whitewater at each resolution: by trapped air alone, by crests
/// alone, and by both. Negative control: rates of a water particle, which are those of an area d²
/// and of a volume d³ times what of them is in a square metre and in a cubic metre.
///
/// Slow (a minute): three bakes of 48 frames, the finest of 24 000 particles.
#[test]
fn a_breaking_wave_has_as_much_whitewater_at_three_spacings() {
    let job = Job::of(&[("wave.toml", WAVE)]);
    let [coarse, ..] = SPACINGS;
    let (air, crests) = (800.0, 12_000.0);
    let made = |k: usize, name: &str, rates: [f64; 2]| {
        let [air, crests] = rates;
        job.write(
            &format!("{name}.toml"),
            &format!(
                "radius = [0.004, 0.014]\n[emission]\ntrapped_air_rate = {air}\n\
                 wave_crest_rate = {crests}\n[foam]\ncrowd = 2000\n"
            ),
        );
        job.expect(0, &format!("whitewater w{k} --settings {name}.toml"));
        counts(&job, &format!("w{k}/whitewater/{name}"))
    };
    let all: Vec<[[f64; 2]; 4]> = (0..SPACINGS.len())
        .map(|k| {
            let cell = 2.0 * SPACINGS[k];
            job.expect(
                0,
                &format!("bake wave.toml --set solver.flip.cell_size={cell} -o w{k}"),
            );
            let finer = coarse / SPACINGS[k];
            let a_particle = [air * finer.powi(2), crests * finer.powi(3)];
            [
                made(k, "air", [air, 0.0]),
                made(k, "crests", [0.0, crests]),
                made(k, "both", [air, crests]),
                made(k, "particle", a_particle),
            ]
        })
        .collect();
    let mean = |stream: usize, what: usize| {
        all.iter().map(|at| at[stream][what]).sum::<f64>() / all.len() as f64
    };
    assert!(
        all[0].as_flattened().iter().all(|count| *count > 500.0),
        "{all:?}"
    );
    let off =
        |k: usize, stream: usize, what: usize| all[k][stream][what] / mean(stream, what) - 1.0;
    for k in 0..SPACINGS.len() {
        for (stream, what) in [(0, 0), (1, 0), (2, 0), (2, 1)] {
            let off = off(k, stream, what);
            assert!(
                off.abs() < ALLOWED,
                "{k}, {stream}, {what}: {off} of {all:?}"
            );
        }
    }
    assert!(off(0, 3, 0) < -3.0 * ALLOWED && off(2, 3, 0) > 3.0 * ALLOWED);
}

/// Rates, radii and crowd that follow from the shot are the same at each resolution, within what
/// the volume of whole layers of particles differs by: half a layer of 6 at the coarsest.
#[test]
fn what_a_shot_gives_does_not_depend_on_the_spacing() {
    let job = Job::of(&[("wave.toml", WAVE)]);
    let given = |k: usize| {
        let cell = 2.0 * SPACINGS[k];
        let bake = format!("bake wave.toml --set solver.flip.cell_size={cell} -o w{k} --frames 1");
        job.expect(0, &bake);
        job.expect(0, &format!("whitewater w{k}"));
        let assets = job.path(&format!("w{k}/whitewater/default/assets"));
        let written = fs::read_to_string(assets.join("whitewater.toml")).unwrap();
        let table: toml::Table = written.parse().unwrap();
        let rates = ["trapped_air_rate", "wave_crest_rate"].map(|key| &table["emission"][key]);
        let others = [&table["radius"][0], &table["foam"]["crowd"]];
        [rates, others]
            .concat()
            .into_iter()
            .map(|it| it.as_float().unwrap())
            .collect::<Vec<_>>()
    };
    let coarse = given(0);
    for k in 1..SPACINGS.len() {
        for (value, coarse) in given(k).into_iter().zip(&coarse) {
            assert!(
                (value / coarse - 1.0).abs() < 1.0 / 12.0,
                "{k}: {value} {coarse}"
            );
        }
    }
}
