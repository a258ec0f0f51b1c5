//! What two caches hold beside their particles: grids, probes, the ledger's lines.

use std::io;

use glam::DVec3;
use serde_json::json;

use crate::{
    cache::{CacheError, CacheReader, Entry, frame::Stamp, vdb},
    compare::streams::{self, Difference, Row, StreamDiff},
    domain::{particles::Particles, sparse_grid::Precision},
};

/// Streams that `a` has and `b` has not: `grids`, `grid NAME`, `probe NAME`.
pub(super) fn lone(a: &CacheReader, b: &CacheReader) -> Vec<String> {
    let (x, y) = (&a.manifest().grids, &b.manifest().grids);
    let mut found = Vec::new();
    match (x, y) {
        (Some(_), None) => found.push("grids".to_owned()),
        (Some(x), Some(y)) => {
            let pairs = [
                ("surface", x.surface, y.surface),
                ("vel", x.velocity, y.velocity),
            ];
            let lone = pairs.into_iter().filter(|&(_, x, y)| x && !y);
            found.extend(lone.map(|(name, ..)| format!("grid {name}")));
        }
        (None, _) => {}
    }
    let others = &b.manifest().probes;
    let is_lone = |name: &&String| !others.iter().any(|other| other.name == **name);
    let names = a.manifest().probes.iter().map(|probe| &probe.name);
    found.extend(names.filter(is_lone).map(|name| format!("probe {name}")));
    found
}

/// What differs in one frame, in streams that both have. `particles` are as they were read.
pub(super) fn of_frame(
    caches: [&CacheReader; 2],
    frame: u32,
    particles: [&Particles; 2],
) -> Result<Vec<StreamDiff>, CacheError> {
    let entries = [caches[0].entry(frame)?, caches[1].entry(frame)?];
    let mut found = Vec::new();
    let mut push = |stream: String, files: [String; 2], differences: Vec<Difference>| {
        if !differences.is_empty() {
            found.push(StreamDiff {
                frame,
                stream,
                files,
                differences,
            });
        }
    };
    if let [Some(a), Some(b)] = entries.map(|entry| entry.grids.as_ref()) {
        let files = [a.file.clone(), b.file.clone()];
        push(
            "grids".to_owned(),
            files,
            grids(caches, entries, particles)?,
        );
    }
    probes(caches, entries, &mut push);
    let ledger = [0, 1].map(|_| CacheReader::LEDGER.to_owned());
    push("ledger".to_owned(), ledger, lines(entries));
    Ok(found)
}

/// Two grid files that are sound. Their bytes name program, shot and time as well, so where they differ the values
/// decide: grids are a function of the particles, and are computed anew where this program would write the same file.
fn grids(
    caches: [&CacheReader; 2],
    entries: [&Entry; 2],
    particles: [&Particles; 2],
) -> Result<Vec<Difference>, CacheError> {
    let [Some(of_a), Some(of_b)] = caches.map(|cache| cache.manifest().grids.as_ref()) else {
        return Ok(Vec::new());
    };
    let [Some(file_a), Some(file_b)] = entries.map(|entry| entry.grids.as_ref()) else {
        return Ok(Vec::new());
    };
    if file_a.blake3 == file_b.blake3 {
        return Ok(Vec::new());
    }
    let place = |index: usize, origin: [f64; 3]| {
        let origin = DVec3::from(origin) + DVec3::from(caches[index].manifest().origin);
        json!(origin.to_array())
    };
    let settings = [
        ("voxel_size", json!(of_a.voxel_size), json!(of_b.voxel_size)),
        ("origin", place(0, of_a.origin), place(1, of_b.origin)),
        (
            "precision",
            json!(of_a.precision.name()),
            json!(of_b.precision.name()),
        ),
    ];
    let settings = settings
        .into_iter()
        .flat_map(|(key, a, b)| streams::keys(key, &a, &b));
    let settings: Vec<Difference> = settings.collect();
    if !settings.is_empty() {
        return Ok(settings);
    }
    let computed = [
        caches[0].grids(entries[0], particles[0])?,
        caches[1].grids(entries[1], particles[1])?,
    ];
    let [Some(a), Some(b)] = computed else {
        let (a, b) = (file_a.bytes, file_b.bytes);
        return Ok(vec![Difference::Bytes { a, b }]);
    };
    if content(&a, of_a.precision) == content(&b, of_b.precision) {
        return Ok(Vec::new());
    }
    let mut found = Vec::new();
    if let (Some(a), Some(b)) = (&a.surface, &b.surface) {
        found.push(streams::grids("surface", a, b));
    }
    if let (Some(a), Some(b)) = (&a.velocity, &b.velocity) {
        found.push(streams::grids("vel", a, b));
    }
    found.retain(|grid| grid.different > 0);
    if found.is_empty() {
        // A zero's sign, or what lies inside of a level set.
        let (a, b) = (file_a.bytes, file_b.bytes);
        return Ok(vec![Difference::Bytes { a, b }]);
    }
    Ok(found.into_iter().map(Difference::Grid).collect())
}

/// A hash of the values as a file keeps them, whatever wrote it.
fn content(grids: &vdb::Grids, precision: Precision) -> Option<blake3::Hash> {
    let stamp = Stamp {
        program: "",
        program_version: "",
        shot: "",
        frame: 0,
        time: 0.0,
        origin: DVec3::ZERO,
    };
    let written = vdb::encode(&mut io::sink(), &stamp, grids, precision);
    written.ok().map(|written| written.hash)
}

/// Whether a bake began with this frame: it has no report of it, and no value of a probe that looks at the solver's work.
fn is_start(entry: &Entry) -> bool {
    entry.report.is_null()
}

/// Rows of the probes that both have, by name.
fn probes(
    caches: [&CacheReader; 2],
    entries: [&Entry; 2],
    push: &mut impl FnMut(String, [String; 2], Vec<Difference>),
) {
    let [of_a, of_b] = caches.map(|cache| &cache.manifest().probes);
    for (i, a) in of_a.iter().enumerate() {
        let Some(j) = of_b.iter().position(|b| b.name == a.name) else {
            continue;
        };
        let b = &of_b[j];
        let values = |entry: &'_ Entry, index: usize| -> Vec<Option<f64>> {
            let rows = entry.probes.as_ref();
            let row = rows.and_then(|rows| rows.get(index));
            row.cloned().unwrap_or_default()
        };
        let [x, y] = [values(entries[0], i), values(entries[1], j)];
        let mut found = streams::keys("kind", &json!(a.kind), &json!(b.kind));
        found.extend(streams::keys("at", &json!(a.at), &json!(b.at)));
        let row = |columns, values| Row { columns, values };
        let mut rows = streams::rows(row(&a.columns, &x), row(&b.columns, &y));
        let [starts_a, starts_b] = entries.map(is_start);
        rows.retain(|difference| match difference {
            Difference::Value { a, b, .. } => {
                (!starts_a || !a.is_null()) && (!starts_b || !b.is_null())
            }
            _ => true,
        });
        found.extend(rows);
        push(format!("probe {}", a.name), [a.file(), b.file()], found);
    }
}

/// The clock, and what the solver reports.
fn lines([a, b]: [&Entry; 2]) -> Vec<Difference> {
    let [x, y] = [a, b].map(|entry| json!(entry.clock));
    let mut found = streams::keys("clock", &x, &y);
    if !is_start(a) && !is_start(b) {
        found.extend(streams::keys("report", &a.report, &b.report));
    }
    found
}
