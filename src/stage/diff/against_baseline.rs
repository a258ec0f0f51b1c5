//! A cache against a stored baseline, and the baseline's writing.

use std::{collections::BTreeMap, fs, path::Path};

use rayon::prelude::*;
use serde::Serialize;

use super::{DiffError, adapter_of, aggregates, bake_of, gauge, physics, scene_of};
use crate::{
    cache::{CacheError, CacheReader},
    compare::baseline::{
        Baseline, BaselineFault, BaselineFrame, Basis, FORMAT_VERSION, Measured,
        default_tolerances, particles_hash,
    },
    domain::{aggregates::Aggregates, frame_range::FrameRange, tolerance::Limit},
};

/// What differs between a cache and a baseline.
#[derive(Clone, Debug, Serialize)]
pub struct BaselineDiff {
    /// What baked the cache, and on what.
    pub bake: String,
    /// Whether the baseline knows the cache's adapter, so that hashes decide.
    pub basis: Basis,
    /// Adapters whose hashes the baseline holds.
    pub known_adapters: Vec<String>,
    /// The adapter that the baseline's aggregates are from.
    pub aggregates_from: String,
    /// The first key of the scenes that differs, with the baseline's value and then the cache's.
    pub physics: Option<String>,
    /// Frames that the cache has not, of those that were asked for.
    pub only_baseline: Vec<u32>,
    /// What was compared.
    pub frames: Vec<FramePair>,
    /// Of the aggregates, by name.
    pub limits: BTreeMap<String, Limit>,
    /// In the order of the frames.
    pub faults: Vec<BaselineFault>,
}

/// One frame's aggregates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FramePair {
    /// Output frame.
    pub frame: u32,
    /// Of the cache and of the baseline.
    pub aggregates: [Aggregates; 2],
}

/// What became of a baseline that was written.
#[derive(Clone, Debug, Serialize)]
pub struct Written {
    /// The adapter whose hashes went in.
    pub adapter: String,
    /// Frames, the start among them.
    pub frames: usize,
    /// Whether its hashes were in the file, and the same.
    pub is_unchanged: bool,
    /// Adapters whose hashes stay: taken before this writing.
    pub kept: Vec<String>,
    /// Adapters whose hashes went, as they are of another scene or of other frames.
    pub dropped: Vec<String>,
}

/// Reads a baseline.
pub(super) fn read(file: &Path) -> Result<Baseline, DiffError> {
    let fault = |what: String| DiffError::Baseline {
        file: file.to_owned(),
        what,
    };
    let text = fs::read_to_string(file).map_err(|source| DiffError::File {
        file: file.to_owned(),
        source,
    })?;
    let found: Baseline = serde_json::from_str(&text).map_err(|error| fault(error.to_string()))?;
    found.check().map_err(fault)?;
    Ok(found)
}

pub(super) fn compare(
    cache: &CacheReader,
    baseline: &Baseline,
    file: &Path,
    frames: Option<&FrameRange>,
) -> Result<BaselineDiff, DiffError> {
    let known = baseline.frames.iter().map(|frame| frame.frame);
    let wanted: Vec<u32> = match frames {
        Some(frames) => frames.iter().collect(),
        None => known.clone().collect(),
    };
    if let Some(frame) = wanted
        .iter()
        .find(|&&frame| !known.clone().any(|k| k == frame))
    {
        return Err(DiffError::Usage(format!(
            "--frames {frame}: {} has frames {}",
            file.display(),
            ranges(&known.collect::<Vec<_>>())
        )));
    }
    if frames.is_some() {
        // Asked for by number: missing is an error and no difference.
        wanted
            .iter()
            .try_for_each(|&frame| cache.entry(frame).map(|_| ()))?;
    }
    let (there, only_baseline): (Vec<u32>, Vec<u32>) = wanted
        .into_iter()
        .partition(|&frame| cache.entry(frame).is_ok());
    let measured = measure(cache, &there)?;
    let adapter = adapter_of(cache.manifest());
    let (basis, faults) = baseline.compare(&adapter, &measured);
    let pair = |found: &Measured| {
        let frame = found.frame.frame;
        let expected = baseline.frames.iter().find(|f| f.frame == frame)?;
        Some(FramePair {
            frame,
            aggregates: [found.frame.aggregates, expected.aggregates],
        })
    };
    Ok(BaselineDiff {
        bake: bake_of(cache.manifest()),
        basis,
        known_adapters: baseline.hashes.keys().cloned().collect(),
        aggregates_from: baseline.aggregates_from.clone(),
        physics: physics(file, &baseline.scene.join("\n"), cache.scene_toml())?,
        only_baseline,
        limits: baseline.limits(),
        frames: measured.iter().filter_map(pair).collect(),
        faults,
    })
}

/// Writes the baseline of a cache. In a file that stands there, tolerances stay as they are; hashes of other
/// adapters stay where scene and frames are the same; aggregates stay where these are within tolerance of
/// them and of an adapter that the file did not know.
///
/// # Errors
/// [`DiffError`]; a file that is there and no baseline is left alone.
pub fn write_baseline(
    cache: &Path,
    file: &Path,
    frames: Option<&FrameRange>,
) -> Result<Written, DiffError> {
    let cache = CacheReader::open(cache)?;
    let before = match file.try_exists() {
        Ok(false) => None,
        _ => Some(read(file)?),
    };
    let frames: Vec<u32> = match frames {
        Some(frames) => frames.iter().collect(),
        None => (cache.first_frame()..=cache.last_frame()).collect(),
    };
    let measured = measure(&cache, &frames)?;
    let adapter = adapter_of(cache.manifest());
    let hashes: Vec<String> = measured.iter().map(|m| m.hash.clone()).collect();
    let of_before = before.as_ref().and_then(|b| b.hashes.get(&adapter));
    let is_new_adapter = of_before.is_none();
    let is_unchanged = of_before == Some(&hashes);
    let mut baseline = Baseline {
        format_version: FORMAT_VERSION,
        shot: cache.manifest().shot.clone(),
        solver: cache.manifest().solver.clone(),
        scene: cache.scene_toml().lines().map(str::to_owned).collect(),
        tolerances: default_tolerances(cache.manifest().particle_spacing),
        aggregates_from: adapter.clone(),
        frames: measured.iter().map(|m| m.frame.clone()).collect(),
        hashes: BTreeMap::new(),
    };
    let mut dropped = Vec::new();
    if let Some(before) = before {
        let old_scene = before.scene.join("\n");
        let is_same_scene = physics(file, &old_scene, cache.scene_toml())?.is_none();
        let numbers = before.frames.iter().map(|frame| frame.frame);
        if is_same_scene && numbers.eq(frames.iter().copied()) {
            let (basis, faults) = before.compare(&adapter, &measured);
            if is_new_adapter && basis == Basis::Aggregates && faults.is_empty() {
                baseline.aggregates_from = before.aggregates_from;
                baseline.frames = before.frames;
            }
            baseline.hashes = before.hashes;
        } else {
            dropped = before.hashes.into_keys().collect();
            dropped.retain(|other| *other != adapter);
        }
        baseline.tolerances = before.tolerances;
    }
    baseline.hashes.insert(adapter.clone(), hashes);
    write(file, &baseline)?;
    let others = baseline.hashes.into_keys();
    Ok(Written {
        kept: others.filter(|other| *other != adapter).collect(),
        adapter,
        frames: frames.len(),
        is_unchanged,
        dropped,
    })
}

fn write(file: &Path, baseline: &Baseline) -> Result<(), DiffError> {
    let fault = |source| DiffError::File {
        file: file.to_owned(),
        source,
    };
    let mut text = serde_json::to_vec_pretty(baseline).map_err(|error| fault(error.into()))?;
    text.push(b'\n');
    fs::write(file, text).map_err(fault)
}

fn measure(cache: &CacheReader, frames: &[u32]) -> Result<Vec<Measured>, DiffError> {
    let scene = scene_of(cache)?;
    let gauge = gauge(&scene, &[cache])?;
    let one = |&frame: &u32| {
        let particles = cache.read(frame)?;
        Ok(Measured {
            hash: particles_hash(&particles),
            frame: BaselineFrame {
                frame,
                particles: particles.len(),
                aggregates: aggregates(cache, &gauge, scene.water.gravity, frame, &particles)?,
            },
        })
    };
    let measured: Result<_, CacheError> = frames.par_iter().map(one).collect();
    Ok(measured?)
}

/// Ascending numbers as a person writes them: `0-4, 7`.
pub fn ranges(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| a.checked_add(1) == Some(*b));
    let run = |run: &[u32]| match run {
        [first, .., last] => format!("{first}-{last}"),
        other => other.iter().map(u32::to_string).collect(),
    };
    runs.map(run).collect::<Vec<_>>().join(", ")
}
