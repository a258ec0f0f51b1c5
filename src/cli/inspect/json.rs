//! `swell inspect --json`: the same for programs. Its keys are documented in `docs/commands.md` and
//! stable.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::{CACHE, InspectArgs, broken_off, file, look, refuse_options, study};
use crate::{Failure, bake, is_cache, output, pass_times};
use swell_scene::Scene;
use swell_stage::{
    inspect::{
        Adapter, LedgerEntry, Manifest, PARTICLES, Rounding, ScenePlan, adapters, cache, sizes,
    },
    replay::is_failed,
    time::{Timed, time},
};

/// Prints the object.
pub(super) fn run(args: &InspectArgs) -> Result<u8, Failure> {
    let (mut object, misfit) = match &args.subject {
        Some(directory) if is_failed(directory) => return Err(broken_off(directory)),
        Some(subject) if file::is_file(subject) => (file::object(args, subject)?, None),
        Some(subject) if study::is_study(subject) => (study::object(args, subject)?, None),
        Some(directory) if is_cache(directory) => {
            refuse_options(args, CACHE, directory)?;
            (of_cache(directory)?, None)
        }
        Some(file) if look::is_look(file) => of_look(args, file)?,
        Some(file) => of_scene(args, file)?,
        None => (json!({ "kind": "adapters" }), None),
    };
    if args.adapters {
        let found = adapters()?;
        object["adapters"] = found.iter().map(adapter).collect();
    }
    output::print(&format!("{object}\n"));
    misfit.map_or(Ok(0), Err)
}

fn adapter(adapter: &Adapter) -> Value {
    let limits = adapter.limits.iter();
    let limits: Map<String, Value> = limits
        .map(|(name, value)| ((*name).to_owned(), json!(value)))
        .collect();
    json!({
        "index": adapter.index, "name": adapter.name, "kind": adapter.kind,
        "driver": adapter.driver, "limits": limits,
        "pass_times": adapter.has_timestamps, "f64": adapter.has_f64,
        "rounding": adapter.rounding.as_ref().map_or(Value::Null, rounding),
    })
}

fn rounding(of: &Rounding) -> Value {
    json!({
        "division_ulp": of.division, "square_root_ulp": of.square_root,
        "inverse_square_root_ulp": of.inverse_square_root, "length_ulp": of.length,
        "exponential_ulp": of.exponential, "logarithm_ulp": of.logarithm, "power_ulp": of.power,
        "sine": of.sine, "contracts": of.contracts, "flushes_inputs": of.flushes_inputs,
        "flushes_results": of.flushes_results, "keeps_two_words": of.keeps_two_words(),
    })
}

fn of_scene(args: &InspectArgs, file: &Path) -> Result<(Value, Option<Failure>), Failure> {
    let scene = bake::load(file, &args.set, args.solver, args.allow_outside)?;
    let planned = super::of_scene(args, file, &scene)?;
    let mut object = scene_json(&planned);
    object["disk_bytes"] = json!(planned.bake.bytes()?);
    object["time"] = match args.time {
        Some(frames) if planned.misfit.is_none() => {
            timed_json(&scene, &time(&planned.bake, &args.gpu(), frames)?)
        }
        _ => Value::Null,
    };
    Ok((object, planned.misfit.map(Failure::from)))
}

fn scene_json(planned: &ScenePlan<'_>) -> Value {
    let (plan, bake) = (&planned.plan, &planned.bake);
    let (scene, start, volume) = (bake.scene, &bake.start, bake.volume());
    let passes = plan.parts().flat_map(|part| &part.passes);
    let passes = passes.map(|pass| json!({ "pass": pass.spec.name, "part": pass.owner }));
    let buffers = plan.parts().flat_map(|part| &part.buffers);
    let buffers = buffers
        .map(|it| json!({ "buffer": it.spec.name, "part": it.owner, "bytes": it.spec.bytes }));
    let parts = plan.shares(&[]);
    let parts = parts
        .iter()
        .map(|it| json!({ "part": it.owner, "passes": it.passes, "bytes": it.bytes }));
    let (device_bytes, list_bytes) = plan.bytes();
    json!({
        "kind": "scene",
        "shot": scene.shot.name,
        "frames": scene.shot.frames,
        "frames_per_second": scene.shot.frames_per_second,
        "solver": scene.solver.method().name(),
        "particles": start.particles.len(),
        "removed": start.removed,
        "volume": volume.made,
        "volume_asked": volume.asked,
        "boundary_samples": plan.counts.boundary_samples,
        "cells": plan.grid_dims,
        "entering": bake.entering(),
        "warnings": bake.warnings,
        "adapter": planned.adapter,
        "adapter_warning": planned.software_warning,
        "misfit": planned.misfit.as_ref().map(ToString::to_string),
        "passes": passes.collect::<Vec<_>>(),
        "buffers": buffers.collect::<Vec<_>>(),
        "parts": parts.collect::<Vec<_>>(),
        "device_bytes": device_bytes,
        "list_bytes": list_bytes,
    })
}

fn timed_json(scene: &Scene, timed: &Timed) -> Value {
    let [least, median, greatest] = timed.seconds;
    json!({
        "device": timed.device.to_string(),
        "frames": timed.frames,
        "seconds": { "least": least, "median": median, "greatest": greatest },
        "substeps": timed.substeps,
        "shot_seconds": median * f64::from(scene.shot.frames),
        "parts": pass_times::parts_json(&timed.shares),
    })
}

fn of_look(args: &InspectArgs, file: &Path) -> Result<(Value, Option<Failure>), Failure> {
    let (look, _, planned) = look::planned(args, file)?;
    let image = &look.spec().image;
    let passes = planned.passes.iter().map(|(pass, runs)| {
        json!({
            "pass": pass, "once": runs.once, "each_water": runs.water, "each_sample": runs.sample,
            "for_aovs": runs.aovs,
        })
    });
    let textures = planned.textures.iter().map(|(name, size, format, bytes)| {
        json!({ "texture": name, "texels": size, "format": format, "bytes": bytes })
    });
    let buffers = planned.buffers.iter();
    let buffers = buffers.map(|(name, bytes)| json!({ "buffer": name, "bytes": bytes }));
    let object = json!({
        "kind": "look",
        "width": image.width,
        "height": image.height,
        "samples": image.samples,
        "renderer": look::method(&look),
        "camera": look::camera(&look),
        "formats": look::formats(&look),
        "aovs": look::aovs(&look),
        "particles": planned.particles,
        "frame": planned.frame,
        "warnings": look.lints(),
        "adapter": planned.adapter,
        "adapter_warning": planned.software_warning,
        "misfit": planned.misfit.as_ref().map(ToString::to_string),
        "passes": passes.collect::<Vec<_>>(),
        "textures": textures.collect::<Vec<_>>(),
        "buffers": buffers.collect::<Vec<_>>(),
        "device_bytes": planned.bytes,
    });
    Ok((object, planned.misfit.map(Failure::from)))
}

fn of_cache(directory: &Path) -> Result<Value, Failure> {
    let (manifest, entries) = cache(directory)?;
    let sizes = sizes(directory)?;
    let newest = entries.last().map_or(0, |entry| entry.frame);
    let frames = entries.iter().map(|entry| frame(&manifest, entry, newest));
    let streams = sizes.streams.iter();
    let streams = streams.map(|(name, bytes)| json!({ "stream": name, "bytes": bytes }));
    let made = |streams: &[(String, u32, u64)]| -> Vec<Value> {
        (streams.iter())
            .map(|(name, last, bytes)| json!({ "name": name, "last": last, "bytes": bytes }))
            .collect()
    };
    let probes = manifest.probes.iter();
    let probes = probes.map(|it| json!({ "probe": it.name, "columns": it.columns }));
    let total: f64 = sizes.seconds.iter().sum();
    let baked = json!({
        "frames": sizes.seconds.len(), "total": total,
        "mean": total / sizes.seconds.len().max(1) as f64,
    });
    Ok(json!({
        "kind": manifest.stream_of().map_or("cache", |_| &*manifest.solver),
        "shot": manifest.shot,
        "solver": manifest.solver,
        "program": format!("{} {}", manifest.program, manifest.program_version),
        "device": manifest.device,
        "driver": manifest.driver,
        "backend": manifest.backend,
        "scene": manifest.scene_hash,
        "shaders": manifest.shaders,
        "parent": manifest.parent.as_ref().map(ToString::to_string),
        "frames_per_second": manifest.frames_per_second,
        "particle_spacing": manifest.particle_spacing,
        "warnings": manifest.warnings,
        "first": manifest.first_frame(),
        "last": newest,
        "frames": frames.collect::<Vec<_>>(),
        "probes": probes.collect::<Vec<_>>(),
        "streams": streams.collect::<Vec<_>>(),
        "whitewater": made(&sizes.whitewater),
        "wet": made(&sizes.wet),
        "disk_bytes": sizes.bytes,
        "device_bytes": sizes.device_bytes,
        "seconds": baked,
    }))
}

fn frame(manifest: &Manifest, entry: &LedgerEntry, newest: u32) -> Value {
    let is_there = manifest.has_particles(entry.frame, newest);
    let bytes = entry.file(PARTICLES).filter(|_| is_there);
    json!({
        "frame": entry.frame,
        "particles": entry.particles,
        "has_particles": is_there,
        "bytes": bytes.map_or(0, |file| file.bytes),
        "substeps": entry.clock.substeps,
        "time": entry.clock.time,
        "report": entry.report,
    })
}
