//! Compares what two caches hold besides a frame's particles: the other streams, and the ledger's
//! lines.

use glam::DVec3;
use serde_json::{Value as Json, json};

use swell_cache::{
    CacheError, CacheReader, GridRecord, LedgerEntry, Look, ProbeRecord,
    stream::{Content, PARTICLES, STREAMS, Stream},
    vdb,
};
use swell_compare::streams::{self, Difference, ProbeRow, StreamDiff};
use swell_domain::{particles::Particles, probe::Rate};

use super::deep;

/// A frame in one of the two caches, with its particles as read.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    pub(super) cache: &'a CacheReader,
    pub(super) entry: &'a LedgerEntry,
    /// `None` if one of the two caches has not kept them.
    pub(super) particles: Option<&'a Particles>,
}

impl Side<'_> {
    /// Whether a bake began with this frame. It then has no report, and no values of probes that
    /// observe the solver.
    fn is_start(&self) -> bool {
        self.entry.report.is_null()
    }
}

/// Parts of streams that `a` has and `b` does not: `grids`, `grid NAME`, `probe NAME`.
pub(super) fn lone(a: &CacheReader, b: &CacheReader) -> Vec<String> {
    let lone = |stream: &Stream| stream.lone(a.manifest(), b.manifest());
    STREAMS.iter().flat_map(lone).collect()
}

/// Differences in one frame, in streams that both caches have.
pub(super) fn of_frame(sides: [Side<'_>; 2]) -> Result<Vec<StreamDiff>, CacheError> {
    let mut found = Vec::new();
    for stream in &STREAMS {
        match stream.content {
            // Particles are compared in the frame's own comparison, where a tolerance applies.
            Content::Particles => found.extend(deep_cells(stream, sides)),
            Content::SparseGrids => found.extend(grids(stream, sides)?),
            Content::Columns => found.extend(tables(stream, sides)),
        }
    }
    found.push(ledger(sides));
    found.retain(|diff| !diff.differences.is_empty());
    Ok(found)
}

/// Compares the water without particles, if both frames are there.
fn deep_cells(stream: &Stream, [a, b]: [Side<'_>; 2]) -> Option<StreamDiff> {
    let (of_a, of_b) = a.particles.zip(b.particles)?;
    let file = |side: Side<'_>| Some(side.entry.file(stream.name)?.file.clone());
    Some(StreamDiff {
        frame: a.entry.frame,
        stream: stream.name.to_owned(),
        files: [file(a)?, file(b)?],
        differences: deep::differences(&of_a.deep, &of_b.deep),
    })
}

/// Compares two intact grid files. Their bytes also contain program, shot and time, so where they
/// differ the values decide: grids depend only on the particles and are recomputed if this program
/// would write the same file.
fn grids(stream: &Stream, sides: [Side<'_>; 2]) -> Result<Option<StreamDiff>, CacheError> {
    let files = sides.map(|side| side.entry.file(stream.name));
    let asked = sides.map(|side| side.cache.manifest().grids.as_ref());
    let ([Some(file_a), Some(file_b)], [Some(of_a), Some(of_b)]) = (files, asked) else {
        return Ok(None);
    };
    let diff = |differences| {
        Ok(Some(StreamDiff {
            frame: sides[0].entry.frame,
            stream: stream.name.to_owned(),
            files: [file_a.file.clone(), file_b.file.clone()],
            differences,
        }))
    };
    if file_a.blake3 == file_b.blake3 {
        return Ok(None);
    }
    let [a, b] = [(of_a, sides[0]), (of_b, sides[1])].map(|(asked, side)| settings(asked, side));
    let settings = streams::keys("", &a, &b);
    if !settings.is_empty() {
        return diff(settings);
    }
    let bytes = vec![Difference::Bytes {
        a: file_a.bytes,
        b: file_b.bytes,
    }];
    let of = |side: Side<'_>| match side.particles {
        Some(particles) => side.cache.grids(side.entry, particles),
        None => Ok(None),
    };
    let [a, b] = sides.map(of);
    let (Some(a), Some(b)) = (a?, b?) else {
        return diff(bytes);
    };
    let hashes = [(&a, of_a), (&b, of_b)].map(|(grids, of)| vdb::content_hash(grids, of.precision));
    if let [Ok(a), Ok(b)] = hashes
        && a == b
    {
        return Ok(None);
    }
    let surface = a.surface.as_ref().zip(b.surface.as_ref());
    let velocity = a.velocity.as_ref().zip(b.velocity.as_ref());
    let mut found: Vec<_> = surface
        .map(|(a, b)| streams::grids("surface", a, b))
        .into_iter()
        .chain(velocity.map(|(a, b)| streams::grids("vel", a, b)))
        .collect();
    found.retain(|grid| grid.different > 0);
    if found.is_empty() {
        // The sign of a zero, or the values inside a level set.
        return diff(bytes);
    }
    diff(found.into_iter().map(Difference::Grid).collect())
}

/// The settings that decide where voxels lie and how they are stored.
fn settings(grids: &GridRecord, side: Side<'_>) -> Json {
    let origin = DVec3::from(grids.origin) + DVec3::from(side.cache.manifest().origin);
    json!({
        "voxel_size": grids.voxel_size,
        "origin": origin.to_array(),
        "precision": grids.precision.name(),
    })
}

/// Rows of the tables that both have, matched by name.
fn tables(stream: &Stream, [a, b]: [Side<'_>; 2]) -> Vec<StreamDiff> {
    let [of_a, of_b] = [a, b].map(|side| stream.tables(side.cache.manifest()));
    let table = |(i, x): (usize, &ProbeRecord)| {
        let j = of_b.iter().position(|y| y.name == x.name)?;
        let y = &of_b[j];
        let settings = |table: &ProbeRecord| {
            json!({
                "kind": table.kind, "at": table.at, "axis": table.axis, "quantile": table.quantile,
                "rate_hz": table.rate_hz, "window": table.window, "solid": table.solid,
            })
        };
        let [of_x, of_y] = [x, y].map(settings);
        let mut differences = streams::keys("", &of_x, &of_y);
        let looks = [(a, x, i), (b, y, j)].map(|(side, table, index)| {
            let values = side.entry.row(stream.name, index);
            table
                .looks(values, side.entry.clock.time)
                .collect::<Vec<_>>()
        });
        let mut rows = looks_apart([x, y], &looks);
        rows.retain(|difference| match difference {
            Difference::Value { a: x, b: y, .. } => {
                !(a.is_start() && x.is_null() || b.is_start() && y.is_null())
            }
            _ => true,
        });
        differences.extend(rows);
        Some(StreamDiff {
            frame: a.entry.frame,
            stream: format!("{} {}", stream.part, x.name),
            files: [x, y].map(|table| stream.table_file(&table.name)),
            differences,
        })
    };
    of_a.iter().enumerate().filter_map(table).collect()
}

/// Differences of the first sample that differs. If a table has more than one sample per frame, the
/// sample is named by its number in the frame, from 1, and its time and the number of samples are
/// compared too.
fn looks_apart(tables: [&ProbeRecord; 2], looks: &[Vec<Look<'_>>; 2]) -> Vec<Difference> {
    let [a, b] = looks;
    let is_many = tables.iter().any(|table| table.rate_hz != Rate::Frame);
    let of_look = |(k, (x, y)): (usize, (&Look<'_>, &Look<'_>))| {
        let mut found = streams::rows(
            ProbeRow {
                columns: &tables[0].columns,
                values: x.values,
            },
            ProbeRow {
                columns: &tables[1].columns,
                values: y.values,
            },
        );
        if is_many {
            let [a, b] = [x, y].map(|look| json!({ "time_s": look.time }));
            found.extend(streams::keys("", &a, &b));
            for difference in &mut found {
                if let Difference::Value { key, .. } = difference {
                    *key = format!("{key} of look {}", k + 1);
                }
            }
        }
        (!found.is_empty()).then_some(found)
    };
    let mut found = a
        .iter()
        .zip(b)
        .enumerate()
        .find_map(of_look)
        .unwrap_or_default();
    let [count_a, count_b] = [a, b].map(|looks| json!({ "looks": looks.len() }));
    found.extend(streams::keys("", &count_a, &count_b));
    found
}

/// Compares the clocks, the bodies and the solver's reports, and the checksums of the particle
/// files if the particles themselves are not compared.
fn ledger([a, b]: [Side<'_>; 2]) -> StreamDiff {
    let [x, y] = [a, b].map(|side| json!(side.entry.clock));
    let mut differences = streams::keys("clock", &x, &y);
    let [x, y] = [a, b].map(|side| {
        let bodies = side.entry.bodies.iter().map(|it| json!(it)).enumerate();
        let named = bodies.map(|(index, body)| (index.to_string(), body));
        serde_json::Value::Object(named.collect())
    });
    differences.extend(streams::keys("bodies", &x, &y));
    if !a.is_start() && !b.is_start() {
        differences.extend(streams::keys("report", &a.entry.report, &b.entry.report));
    }
    if a.particles.is_none() && has_same_stamps(a, b) {
        let hash = |side: Side<'_>| json!(side.entry.file(PARTICLES).map(|file| &file.blake3));
        differences.extend(streams::keys(
            "particles",
            &json!({ "blake3": hash(a) }),
            &json!({ "blake3": hash(b) }),
        ));
    }
    StreamDiff {
        frame: a.entry.frame,
        stream: "ledger".to_owned(),
        files: [0, 1].map(|_| CacheReader::LEDGER.to_owned()),
        differences,
    }
}

/// Whether equal particles give equal files in both caches: a file contains program, shot and
/// origin.
fn has_same_stamps(a: Side<'_>, b: Side<'_>) -> bool {
    let stamp = |side: Side<'_>| {
        let manifest = side.cache.manifest();
        let names =
            [&manifest.program, &manifest.program_version, &manifest.shot].map(String::clone);
        (names, manifest.origin)
    };
    stamp(a) == stamp(b)
}
