//! `swell inspect FILE`: a frame, a mesh, a VDB, a picture, USD or glTF.

use std::{
    fmt::{self, Write},
    path::Path,
};

use serde_json::{Value, json};

use super::{InspectArgs, refuse_options};
use crate::{Failure, count};
use swell_domain::bounds::Bounds;
use swell_stage::inspect::file::{
    FileContents, FrameFile, GridFile, MeshFile, PictureFile, Rig, describe, is_known,
};

/// Whether the name is that of a frame, mesh, VDB, picture, USD or glTF.
pub(super) fn is_file(file: &Path) -> bool {
    is_known(file)
}

fn contents(args: &InspectArgs, file: &Path) -> Result<FileContents, Failure> {
    refuse_options(args, "one file", file)?;
    Ok(describe(file)?)
}

/// Prints a description of `file`.
pub(super) fn show(out: &mut String, args: &InspectArgs, file: &Path) -> Result<(), Failure> {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    // Writing to a String cannot fail.
    let _ = match contents(args, file)? {
        FileContents::Frame(it) => show_frame(out, &name, &it),
        FileContents::Mesh(it) => show_mesh(out, &name, &it),
        FileContents::Grids(it) => show_grids(out, &name, &it),
        FileContents::Picture(it) => show_picture(out, &name, &it),
        FileContents::Rig(it) => show_rig(out, &name, &it),
    };
    Ok(())
}

fn show_bounds(out: &mut String, bounds: Option<Bounds>, unit: &str) -> fmt::Result {
    match bounds {
        Some(Bounds { min, max }) => writeln!(
            out,
            "from ({}, {}, {}) to ({}, {}, {}){unit}",
            min.x, min.y, min.z, max.x, max.y, max.z
        ),
        None => writeln!(out, "nothing in it"),
    }
}

fn show_frame(out: &mut String, name: &str, frame: &FrameFile) -> fmt::Result {
    let particles = count(frame.particles as u64, "particle");
    writeln!(out, "{name}: a frame of {particles}")?;
    for comment in &frame.comments {
        writeln!(out, "{comment}")?;
    }
    let attributes: Vec<&str> = frame.attributes.iter().map(String::as_str).collect();
    let columns = [&["position", "velocity", "id"], &attributes[..]].concat();
    writeln!(out, "{}", columns.join(", "))?;
    show_bounds(out, frame.bounds, " m from the scene's origin")?;
    writeln!(out, "up to {:.3} m/s", frame.fastest)
}

fn show_mesh(out: &mut String, name: &str, mesh: &MeshFile) -> fmt::Result {
    writeln!(
        out,
        "{name}: a mesh of {} and {}",
        count(mesh.triangles as u64, "triangle"),
        count(mesh.vertices as u64, "vertex").replace("vertexs", "vertices")
    )?;
    show_bounds(out, mesh.bounds, " in the file's own unit")?;
    match mesh.open_edges {
        0 => writeln!(out, "closed"),
        open => writeln!(out, "{} open", count(open as u64, "edge")),
    }
}

fn show_grids(out: &mut String, name: &str, grids: &[GridFile]) -> fmt::Result {
    writeln!(
        out,
        "{name}: OpenVDB, {}",
        count(grids.len() as u64, "grid")
    )?;
    writeln!(
        out,
        "\n{:16}  {:28}  {:12}  {:>12}  {:>10}  voxels from, to",
        "grid", "type", "class", "voxels", "size"
    )?;
    for grid in grids {
        let voxels = grid.voxels.map_or("-".to_owned(), |it| it.to_string());
        let size = grid.voxel_size.map_or("-".to_owned(), |[x, y, z]| {
            if x == y && y == z {
                format!("{x}")
            } else {
                format!("{x} {y} {z}")
            }
        });
        let extent = grid
            .extent
            .map_or("-".to_owned(), |[min, max]| format!("{min:?}, {max:?}"));
        writeln!(
            out,
            "{:16}  {:28}  {:12}  {voxels:>12}  {size:>10}  {extent}",
            grid.name, grid.kind, grid.class
        )?;
    }
    Ok(())
}

fn show_rig(out: &mut String, name: &str, rig: &Rig) -> fmt::Result {
    writeln!(
        out,
        "{name}: {}, {}",
        if rig.format == "usd" { "USD" } else { "glTF" },
        count(rig.cameras.len() as u64, "camera"),
    )?;
    for camera in &rig.cameras {
        writeln!(out, "camera    {camera}")?;
    }
    for moving in &rig.moving {
        writeln!(out, "animated  {moving}")?;
    }
    match &rig.elsewhere {
        Some(warning) => writeln!(out, "warning: {warning}"),
        None => Ok(()),
    }
}

fn show_picture(out: &mut String, name: &str, picture: &PictureFile) -> fmt::Result {
    let ([width, height], (data, corner)) = (picture.size, picture.data);
    writeln!(
        out,
        "{name}: {} of {width} × {height} pixels, {}",
        picture.format.to_uppercase(),
        picture.compression
    )?;
    if data != picture.size || corner != [0, 0] {
        writeln!(
            out,
            "{} × {} rendered, from ({}, {}) on",
            data[0], data[1], corner[0], corner[1]
        )?;
    }
    for (channel, kind) in &picture.channels {
        writeln!(out, "   {channel:20}  {kind}")?;
    }
    let attributes = &picture.attributes;
    let texts = [
        ("software", &attributes.software),
        ("shot", &attributes.shot),
        ("scene", &attributes.scene_hash),
        ("frame's cache", &attributes.cache_hash),
        ("look", &attributes.look_hash),
    ];
    if !attributes.cache_hash.is_empty() {
        writeln!(out, "frame {}", attributes.frame)?;
    }
    for (name, text) in texts.iter().filter(|(_, text)| !text.is_empty()) {
        writeln!(out, "{name} {text}")?;
    }
    Ok(())
}

/// The description for programs.
pub(super) fn object(args: &InspectArgs, file: &Path) -> Result<Value, Failure> {
    let bounds = |bounds: &Option<Bounds>| {
        bounds.map(|it| json!({ "min": it.min.to_array(), "max": it.max.to_array() }))
    };
    Ok(match contents(args, file)? {
        FileContents::Frame(it) => json!({
            "kind": "frame", "particles": it.particles, "attributes": it.attributes,
            "bounds": bounds(&it.bounds),
            "fastest": it.fastest, "comments": it.comments,
        }),
        FileContents::Mesh(it) => json!({
            "kind": "mesh", "vertices": it.vertices, "triangles": it.triangles,
            "bounds": bounds(&it.bounds),
            "open_edges": it.open_edges,
        }),
        FileContents::Grids(grids) => {
            let grids = grids.iter().map(|it| {
                json!({
                    "grid": it.name, "type": it.kind, "class": it.class, "voxels": it.voxels,
                    "extent": it.extent,
                    "voxel_size": it.voxel_size,
                })
            });
            json!({ "kind": "vdb", "grids": grids.collect::<Vec<_>>() })
        }
        FileContents::Picture(it) => picture_json(&it),
        FileContents::Rig(it) => json!({
            "kind": it.format, "cameras": it.cameras, "animated": it.moving,
            "warnings": it.elsewhere.iter().collect::<Vec<_>>(),
        }),
    })
}

fn picture_json(picture: &PictureFile) -> Value {
    let channels = picture.channels.iter();
    let channels = channels.map(|(name, kind)| json!({ "channel": name, "type": kind }));
    let attributes = &picture.attributes;
    let text = |text: &String| (!text.is_empty()).then(|| text.clone());
    let is_ours = !attributes.cache_hash.is_empty();
    json!({
        "kind": "picture",
        "format": picture.format,
        "width": picture.size[0],
        "height": picture.size[1],
        "data": { "size": picture.data.0, "corner": picture.data.1 },
        "channels": channels.collect::<Vec<_>>(),
        "compression": picture.compression,
        "frame": is_ours.then_some(attributes.frame),
        "shot": text(&attributes.shot),
        "software": text(&attributes.software),
        "scene": text(&attributes.scene_hash),
        "cache": text(&attributes.cache_hash),
        "look": text(&attributes.look_hash),
    })
}
