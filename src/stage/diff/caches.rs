//! Compares two caches: their frames, the streams besides the particles, and the ledgers' lines.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::{
    DiffError, DiffRequest, adapter_of, aggregates, bake_of, of_caches, physics, scene_of, streams,
};
use swell_cache::{CacheError, CacheReader};
use swell_compare::{
    caches::CacheDiff,
    frames::{self, FrameDiff},
    limits::{StatedLimit, default_tolerances},
    streams::StreamDiff,
};
use swell_domain::{
    particles::Particles,
    tolerance::{ErrorLimit, Tolerance},
};

/// Limits of aggregates for caches of different devices, those of a baseline on an adapter that it
/// does not know; `None` for caches of the same device.
fn device_limits([a, b]: [&CacheReader; 2]) -> Option<BTreeMap<String, ErrorLimit>> {
    let (a, b) = (a.manifest(), b.manifest());
    let limits = default_tolerances(b.particle_spacing).into_iter();
    let limit = |(name, stated): (String, StatedLimit)| {
        let limit = ErrorLimit {
            absolute: stated.absolute,
            relative: stated.relative,
        };
        (name, limit)
    };
    (adapter_of(a) != adapter_of(b)).then(|| limits.map(limit).collect())
}

/// Refuses a tolerance that limits nothing here, because everything would pass it.
fn check_tolerance(tolerance: &Tolerance, caches: [&CacheReader; 2]) -> Result<(), DiffError> {
    if tolerance.fields.is_empty() && tolerance.aggregates.is_empty() {
        return Err(DiffError::usage(
            "the tolerance file has only [pictures]; two caches need [position], [velocity], \
             [attributes.NAME] or [aggregates]",
        ));
    }
    let attributes = caches.iter().flat_map(|c| &c.manifest().attributes);
    let known: Vec<&str> = ["position", "velocity"]
        .into_iter()
        .chain(attributes.map(String::as_str))
        .collect();
    let mut limited = tolerance.fields.keys();
    match limited.find(|name| !known.contains(&name.as_str())) {
        None => Ok(()),
        Some(name) => Err(DiffError::usage(format!(
            "the tolerance file limits {name}, which neither cache has; they have {}",
            known.join(", ")
        ))),
    }
}

pub(super) fn compare(
    [a, b]: [&CacheReader; 2],
    request: &DiffRequest,
) -> Result<CacheDiff, DiffError> {
    let tolerance = request.tolerance.as_ref();
    if let Some(tolerance) = tolerance {
        check_tolerance(tolerance, [a, b])?;
    }
    let device_limits = match tolerance {
        Some(_) => None,
        None => device_limits([a, b]),
    };
    let by_aggregates = device_limits.clone().map(|aggregates| Tolerance {
        aggregates,
        ..Tolerance::default()
    });
    let tolerance = tolerance.or(by_aggregates.as_ref());
    let [in_a, in_b] = [a, b]
        .map(|cache| -> BTreeSet<u32> { (cache.first_frame()..=cache.last_frame()).collect() });
    // What a branch does not have because it began later is not missing.
    let lone = |of: &BTreeSet<u32>, other: &BTreeSet<u32>| -> Vec<u32> {
        let begins = other.first().copied().unwrap_or(0);
        of.difference(other)
            .copied()
            .filter(|frame| *frame >= begins)
            .collect()
    };
    let (chosen, only_a, only_b): (Vec<u32>, _, _) = match &request.frames {
        Some(frames) => (frames.iter().collect(), Vec::new(), Vec::new()),
        None => (
            in_a.intersection(&in_b).copied().collect(),
            lone(&in_a, &in_b),
            lone(&in_b, &in_a),
        ),
    };
    for cache in [a, b] {
        cache.check_beside(&chosen)?;
        if let Some(frames) = &request.frames {
            frames
                .iter()
                .try_for_each(|frame| cache.kept(frame).map(|_| ()))?;
        }
    }
    let has_both = |frame: &u32| a.has_particles(*frame) && b.has_particles(*frame);
    let (chosen, without_particles): (Vec<u32>, Vec<u32>) = chosen.into_iter().partition(has_both);
    let (scene_a, scene_b) = (scene_of(a)?, scene_of(b)?);
    let gauge = of_caches(&scene_b, &[b, a])?;
    let frame = |&frame: &u32| {
        let (of_a, of_b) = (a.state(frame)?, b.state(frame)?);
        let beside = of_streams([a, b], frame, [Some(&of_a), Some(&of_b)])?;
        let [from, to] = [a, b].map(|cache| cache.manifest().origin.into());
        let of_a = of_a.about(from, to);
        let mut sums = [
            aggregates(a, &scene_a, &gauge, frame, &of_a.water())?,
            aggregates(b, &scene_b, &gauge, frame, &of_b.water())?,
        ];
        // A bake has no report of the frame that it began with, as is the case for a branch of the
        // other cache.
        if [a, b].iter().any(|cache| cache.first_frame() == frame) {
            for sum in &mut sums {
                sum.density_error = None;
            }
        }
        Ok((
            frames::compare(frame, [&of_a, &of_b], sums, tolerance),
            beside,
        ))
    };
    let found: Result<Vec<(FrameDiff, Vec<StreamDiff>)>, CacheError> =
        chosen.par_iter().map(frame).collect();
    let (frames, mut beside): (_, Vec<_>) = found?.into_iter().unzip();
    for &frame in &without_particles {
        beside.push(of_streams([a, b], frame, [None; 2])?);
    }
    beside.sort_by_key(|diffs| diffs.first().map_or(0, |diff| diff.frame));
    Ok(CacheDiff {
        bakes: [a, b].map(|cache| bake_of(cache.manifest())),
        physics: physics(b.dir(), b.scene_toml(), a.scene_toml())?,
        begins: [a, b].map(CacheReader::first_frame),
        only_a,
        only_b,
        frames,
        without_particles,
        streams_only_a: streams::lone(a, b),
        streams_only_b: streams::lone(b, a),
        streams: beside.into_iter().flatten().collect(),
        device_limits,
        streams_judged: tolerance.is_none(),
    })
}

/// Differences in a frame apart from its particles.
fn of_streams(
    caches: [&CacheReader; 2],
    frame: u32,
    particles: [Option<&Particles>; 2],
) -> Result<Vec<StreamDiff>, CacheError> {
    let side = |k: usize| -> Result<_, CacheError> {
        Ok(streams::Side {
            cache: caches[k],
            entry: caches[k].entry(frame)?,
            particles: particles[k],
        })
    };
    streams::of_frame([side(0)?, side(1)?])
}
