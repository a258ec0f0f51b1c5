//! `swell inspect LOOK`

use std::{
    fmt::{self, Write},
    path::Path,
};
use swell_files::load_look_within;

use super::{InspectArgs, misplaced};
use crate::{Failure, bake, count, is_cache, size};
use swell_scene::look::{AovSpec, FitSpec, FormatSpec, Look, MethodSpec};
use swell_stage::render::{LookPlan, Subject, plan};

/// Tables that only looks have.
const TABLES: [&str; 4] = ["[camera]", "[image]", "[sun]", "[output]"];

/// Whether a file is a look, judged by its tables; false for an unreadable file.
pub(super) fn is_look(file: &Path) -> bool {
    let text = swell_domain::text::read(file).unwrap_or_default();
    let mut lines = text
        .lines()
        .map(|line| line.split('#').next().unwrap_or(""));
    lines.any(|line| TABLES.contains(&line.trim()))
}

/// Name of the render method.
pub(super) fn method(look: &Look) -> &'static str {
    match look.spec().renderer.method {
        MethodSpec::Ssfr => "ssfr",
        MethodSpec::Ray => "ray",
    }
}

/// Describes the camera in words.
pub(super) fn camera(look: &Look) -> String {
    let camera = &look.spec().camera;
    let lens = match look.lens(0.0) {
        Some([f_stop, _]) => format!("f/{f_stop}"),
        None => "a pinhole".to_owned(),
    };
    let moves = match (&camera.file, camera.keyframes.len() as u64) {
        (Some(file), _) => {
            let start = camera
                .start
                .map(|start| format!(", whose frame {start} is frame 1"));
            let start = start.unwrap_or_default();
            let words = FitSpec::NAMED.iter();
            let fit = words
                .filter(|(_, fit)| camera.fit == Some(*fit))
                .map(|(word, _)| format!(", fitted by {word}"));
            let fitted: String = fit.collect();
            return format!("from {}{start}{fitted}, {lens}", file.display());
        }
        (None, 0) => "still".to_owned(),
        (None, keyframes) => count(keyframes, "keyframe"),
    };
    let (film, shown) = (camera.film_back_mm, look.film_mm());
    let [[w, h], [x, y]] = [film, shown].map(|sides| sides.map(|mm| (100.0 * mm).round() / 100.0));
    let on = match [w, h] == [x, y] {
        true => String::new(),
        false => format!(" on film of {w} × {h} mm, where the image takes {x} × {y}"),
    };
    format!("of {} mm{on}, {lens}, {moves}", camera.focal_length_mm)
}

/// File formats of a picture.
pub(super) fn formats(look: &Look) -> Vec<&'static str> {
    let formats = look.spec().output.formats.iter();
    let name = |format: &FormatSpec| match format {
        FormatSpec::Png => "png",
        FormatSpec::Exr => "exr",
    };
    formats.map(name).collect()
}

/// Names of the additional channels.
pub(super) fn aovs(look: &Look) -> Vec<&'static str> {
    let name = |aov: &AovSpec| match aov {
        AovSpec::Z => "Z",
        AovSpec::N => "N",
        AovSpec::P => "P",
        AovSpec::Forward => "forward",
        AovSpec::Thickness => "thickness",
    };
    look.spec().output.aovs.iter().map(name).collect()
}

/// Prints the plan of the look in `file`.
pub(super) fn show(out: &mut String, args: &InspectArgs, file: &Path) -> Result<LookPlan, Failure> {
    let (look, subject, planned) = planned(args, file)?;
    // Writing to a String cannot fail.
    let _ = show_plan(out, &look, &subject, &planned, file);
    Ok(planned)
}

/// The look in `file`, its subject, and its plan.
pub(super) fn planned(
    args: &InspectArgs,
    file: &Path,
) -> Result<(Look, Subject, LookPlan), Failure> {
    let look = load_look_within(file, bake::reach(args.allow_outside))?;
    let has_scene_options = !args.set.is_empty() || args.solver.is_some();
    let subject = match &args.scene {
        Some(cache) if is_cache(cache) && !has_scene_options => Subject::Cache(cache.clone()),
        Some(scene) if !is_cache(scene) => {
            let scene = bake::load(scene, &args.set, args.solver, args.allow_outside)?;
            Subject::Scene(Box::new(scene))
        }
        None if !has_scene_options => Subject::Nothing,
        _ => {
            let is = "a look: --scene names its scene";
            return Err(misplaced("--set or --solver", "scenes", is, file));
        }
    };
    let planned = plan(&look, &subject, &args.gpu())?;
    Ok((look, subject, planned))
}

fn show_plan(
    out: &mut String,
    look: &Look,
    subject: &Subject,
    planned: &LookPlan,
    file: &Path,
) -> fmt::Result {
    let image = &look.spec().image;
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    writeln!(
        out,
        "{name}: {} × {} pixels, {}",
        image.width,
        image.height,
        count(image.samples.into(), "sample")
    )?;
    writeln!(out, "camera {}", camera(look))?;
    writeln!(
        out,
        "renderer {}, writes {}",
        method(look),
        [formats(look), aovs(look)].concat().join(", ")
    )?;
    for warning in look.lints() {
        writeln!(out, "warning: {warning}")?;
    }
    match subject {
        Subject::Nothing => writeln!(out, "for no scene: --scene adds solids and particles")?,
        Subject::Scene(scene) => writeln!(
            out,
            "for {}: {} particles at its start",
            scene.shot.name, planned.particles
        )?,
        Subject::Cache(cache) => {
            let particles = planned.particles;
            let frame = planned.frame.map_or(String::new(), |frame| {
                format!("; buffers are those of frame {frame}")
            });
            writeln!(
                out,
                "for {}: {particles} particles at most{frame}",
                cache.display()
            )?;
        }
    }
    match &planned.adapter {
        Some(name) => writeln!(out, "planned for {name}")?,
        None => writeln!(out, "planned for common limits: no adapter here")?,
    }
    if let Some(warning) = &planned.software_warning {
        writeln!(out, "warning: {warning}")?;
    }
    writeln!(
        out,
        "\npass                          once  each water  each sample  for AOVs"
    )?;
    for (pass, runs) in &planned.passes {
        writeln!(
            out,
            "{pass:28}  {:>4}  {:>10}  {:>11}  {:>8}",
            runs.once, runs.water, runs.sample, runs.aovs
        )?;
    }
    writeln!(
        out,
        "\ntexture                       texels           format               bytes"
    )?;
    for (texture, [width, height], format, bytes) in &planned.textures {
        let texels = format!("{width} × {height}");
        writeln!(out, "{texture:28}  {texels:15}  {format:13} {bytes:>12}")?;
    }
    writeln!(out, "\nbuffer                               bytes")?;
    for (buffer, bytes) in &planned.buffers {
        writeln!(out, "{buffer:28}  {bytes:>12}")?;
    }
    let pixels = f64::from(image.width) * f64::from(image.height);
    writeln!(
        out,
        "\n{} in all: {:.0} bytes a pixel",
        size(planned.bytes),
        planned.bytes as f64 / pixels
    )
}
