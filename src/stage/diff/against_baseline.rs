//! Compares a cache with a stored baseline, and writes baselines.

use std::{
    collections::BTreeMap,
    io,
    path::{Path, PathBuf},
};

use rayon::prelude::*;
use serde::Serialize;

use super::{
    DiffError, DiffRequest, adapter_of, aggregates, bake_of, of_caches, physics, scene_of,
};
use swell_cache::{CacheError, CacheReader};
use swell_compare::{
    baseline::{
        Baseline, BaselineDiff, BaselineFrame, FORMAT_VERSION, Lost, MeasuredFrame, particles_hash,
    },
    limits::default_tolerances,
};
use swell_domain::{
    frame_range::{FrameRange, ranges},
    output::{self, AtPath as _},
};

/// Result of writing a baseline.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct WrittenBaseline {
    /// The adapter whose hashes were stored.
    pub adapter: String,
    /// Number of frames, including the start.
    pub frames: usize,
    /// Whether the file already had the same hashes for this adapter.
    pub is_unchanged: bool,
    /// Adapters whose earlier hashes remain in the file.
    pub kept: Vec<String>,
    /// Adapters whose hashes were dropped because they belong to another scene or other frames.
    pub dropped: Vec<String>,
    /// Whether spreads were dropped for the same reason, and with them the limits derived from
    /// them.
    pub is_spread_dropped: bool,
    /// What distinguishes the bakes that the spreads are measured from; empty if none were
    /// measured.
    pub spread_from: Vec<String>,
}

/// Reads and checks a baseline.
pub(super) fn read(file: &Path) -> Result<Baseline, DiffError> {
    let text = swell_domain::text::read(file).at(file)?;
    let found: Result<Baseline, String> =
        serde_json::from_str(&text).map_err(|error| error.to_string());
    let checked = found.and_then(|found| found.check().map(|()| found));
    checked.map_err(|what| DiffError::Baseline {
        file: file.to_owned(),
        what,
    })
}

pub(super) fn compare(
    cache: &CacheReader,
    baseline: &Baseline,
    request: &DiffRequest,
) -> Result<BaselineDiff, DiffError> {
    let known: Vec<u32> = baseline.frames.iter().map(|frame| frame.frame).collect();
    let asked: Option<Vec<u32>> = request.frames.as_ref().map(|range| range.iter().collect());
    for &frame in asked.iter().flatten() {
        if !known.contains(&frame) {
            return Err(DiffError::usage(format!(
                "frame {frame}: {} has frames {}",
                request.b.display(),
                ranges(&known)
            )));
        }
        // A frame requested by number: if it is missing, that is an error and not a difference.
        cache.entry(frame)?;
    }
    let (there, only_baseline): (Vec<u32>, Vec<u32>) = asked
        .unwrap_or(known)
        .into_iter()
        .partition(|&frame| cache.entry(frame).is_ok());
    let measured = measure(cache, &there)?;
    let adapter = adapter_of(cache.manifest());
    let adapter = (!request.ignores_hashes).then_some(adapter.as_str());
    let (basis, faults) = baseline.compare(adapter, &measured);
    Ok(BaselineDiff {
        bake: bake_of(cache.manifest()),
        basis,
        ignores_hashes: request.ignores_hashes,
        known_adapters: baseline.hashes.keys().cloned().collect(),
        aggregates_from: baseline.aggregates_from.clone(),
        physics: physics(&request.b, &baseline.scene.join("\n"), cache.scene_toml())?,
        only_baseline,
        frames: baseline.pairs(adapter, &measured),
        faults,
    })
}

/// Writes the baseline of a cache.
///
/// An existing file keeps its tolerances and spreads if scene and frames are the same, and so the
/// hashes of other adapters. It keeps its aggregates if the new ones are within tolerance of them
/// and the file did not know the adapter. The caches in `spread` must differ from this one only in
/// rounding; they replace the spreads and the tolerances.
///
/// # Errors
/// [`DiffError`]; an existing file that is not a baseline is left untouched.
pub fn write_baseline(
    cache: &Path,
    file: &Path,
    frames: Option<&FrameRange>,
    spread: &[PathBuf],
) -> Result<WrittenBaseline, DiffError> {
    let cache = CacheReader::open(cache)?;
    let before = match file.try_exists() {
        Ok(false) => None,
        _ => Some(read(file)?),
    };
    let frames: Vec<u32> = match frames {
        Some(frames) => frames.iter().collect(),
        None => (cache.first_frame()..=cache.last_frame())
            .filter(|&frame| cache.has_particles(frame))
            .collect(),
    };
    let measured = measure(&cache, &frames)?;
    let adapter = adapter_of(cache.manifest());
    let hashes: Vec<String> = measured.iter().map(|m| m.hash.clone()).collect();
    let of_before = before.as_ref().and_then(|b| b.hashes.get(&adapter));
    let is_unchanged = of_before == Some(&hashes);
    let mut baseline = Baseline {
        format_version: FORMAT_VERSION,
        shot: cache.manifest().shot.clone(),
        solver: cache.manifest().solver.clone(),
        scene: cache.scene_toml().lines().map(str::to_owned).collect(),
        tolerances: default_tolerances(cache.manifest().particle_spacing),
        spread_from: Vec::new(),
        aggregates_from: adapter.clone(),
        frames: measured.iter().map(|m| m.frame.clone()).collect(),
        hashes: BTreeMap::new(),
    };
    let mut lost = Lost::default();
    if let Some(before) = before {
        let old_scene = before.scene.join("\n");
        let is_same_scene = physics(file, &old_scene, cache.scene_toml())?.is_none();
        lost = baseline.inherit(before, is_same_scene, &measured);
    }
    if !spread.is_empty() {
        take_spread(&mut baseline, &cache, spread, &frames)?;
    }
    baseline.hashes.insert(adapter.clone(), hashes);
    write(file, &baseline)?;
    let others = baseline.hashes.into_keys();
    Ok(WrittenBaseline {
        kept: others.filter(|other| *other != adapter).collect(),
        adapter,
        frames: frames.len(),
        is_unchanged,
        dropped: lost.hashes,
        is_spread_dropped: lost.has_spread && spread.is_empty(),
        spread_from: baseline.spread_from,
    })
}

/// Measures how far the frames of `cache` and those of bakes that differ only in rounding diverge.
fn take_spread(
    baseline: &mut Baseline,
    cache: &CacheReader,
    others: &[PathBuf],
    frames: &[u32],
) -> Result<(), DiffError> {
    let measured = |cache: &CacheReader| -> Result<Vec<BaselineFrame>, DiffError> {
        Ok(measure(cache, frames)?
            .into_iter()
            .map(|m| m.frame)
            .collect())
    };
    let expected = measured(cache)?;
    let counts = |frames: &[BaselineFrame]| frames.first().map(|frame| frame.particles);
    let bake = |path: &PathBuf| {
        let other = CacheReader::open(path)?;
        let bake = measured(&other)?;
        let refuse = |why: &str| {
            let path = path.display();
            Err(DiffError::usage(format!("spread of {path}: {why}")))
        };
        if other.manifest().solver != cache.manifest().solver {
            return refuse("another solver is not a difference in rounding");
        }
        if counts(&bake) != counts(&expected) {
            return refuse("another number of particles is not a difference in rounding");
        }
        let adapter = adapter_of(other.manifest());
        match physics(cache.dir(), cache.scene_toml(), other.scene_toml())? {
            Some(key) => Ok((key, bake)),
            None if adapter != adapter_of(cache.manifest()) => Ok((adapter, bake)),
            None => refuse("the same scene on the same adapter has no spread"),
        }
    };
    let bakes: Vec<_> = others.iter().map(bake).collect::<Result<_, _>>()?;
    baseline.take_spread(&expected, bakes, cache.manifest().particle_spacing);
    Ok(())
}

fn write(file: &Path, baseline: &Baseline) -> Result<(), DiffError> {
    let text = serde_json::to_string_pretty(baseline);
    let text = text.map_err(io::Error::from).at(file)? + "\n";
    Ok(output::write_named(file, text)?)
}

fn measure(cache: &CacheReader, frames: &[u32]) -> Result<Vec<MeasuredFrame>, DiffError> {
    cache.check_beside(frames)?;
    let scene = scene_of(cache)?;
    let gauge = of_caches(&scene, &[cache])?;
    let one = |&frame: &u32| {
        let particles = cache.read(frame)?;
        Ok(MeasuredFrame {
            hash: particles_hash(&particles),
            frame: BaselineFrame {
                frame,
                particles: particles.len(),
                aggregates: aggregates(cache, &scene, &gauge, frame, &particles)?,
                spread: None,
            },
        })
    };
    let measured: Result<_, CacheError> = frames.par_iter().map(one).collect();
    Ok(measured?)
}
