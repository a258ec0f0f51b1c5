"""Brings a range of frames of a swell cache into Blender: points with attributes, solids, meshes, OpenVDB.

    blender --background --python tools/blender/import_swell.py -- cache/quickstart/pbf --frames 40-72 --solids --save wave.blend

In an open Blender, add `tools/python/src` to sys.path, import this file and call its functions.

Blender has z up, and swell y: (x, y, z) becomes (x, -z, y), vectors too, in metres. Frame 48 of a cache is frame 48 of the scene.

A saved scene does without this script: a frame of points is an object of its own, which geometry nodes show at its frame, so the data
of all frames stands in the .blend. OpenVDB files stay where they are: the .blend has their paths.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

try:
    import numpy as np
except ImportError:
    # Blender would go on, and end with 0.
    print("import_swell: Blender's Python has no numpy (Debian, Ubuntu: apt-get install python3-numpy)", file=sys.stderr)
    sys.exit(4)

try:
    import swell
except ImportError:
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python/src"))
    import swell

# Turns y up to z up where an object's data keep swell's axes.
Z_UP = (math.pi / 2.0, 0.0, 0.0)
PLY_SCALARS = {
    "char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4", "float": "<f4", "double": "<f8",
    "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2", "int32": "<i4", "uint32": "<u4", "float32": "<f4", "float64": "<f8",
}  # fmt: skip


class ImportFault(Exception):
    """What was asked for cannot be brought in."""


def frame_range(text: str) -> list[int]:
    """Frames as swell's `--frames` has them: `7`, `1-240`, `1-240x2`, and lists of these with commas."""
    frames: list[int] = []
    for part in text.split(","):
        found = re.fullmatch(r"(\d+)(?:-(\d+)(?:[x:](\d+))?)?", part.strip())
        if found is None:
            raise argparse.ArgumentTypeError(f"`{part}` is no range of frames")
        first, last, step = int(found[1]), int(found[2] or found[1]), int(found[3] or 1)
        if last < first or step < 1:
            raise argparse.ArgumentTypeError(f"`{part}` is an empty range of frames")
        frames += range(first, last + 1, step)
    return sorted(set(frames))


def collection(name: str) -> Any:
    """A new collection in the scene."""
    made = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(made)
    return made


def add_socket(group: Any, kind: str, name: str, way: str) -> None:
    """A socket of a group of nodes; `way` is INPUT or OUTPUT. Blender 4 has another place for them than 3."""
    if hasattr(group, "interface"):
        group.interface.new_socket(name=name, in_out=way, socket_type=f"NodeSocket{kind}")
    else:
        (group.inputs if way == "INPUT" else group.outputs).new(f"NodeSocket{kind}", name)


def identifier(group: Any, name: str) -> str:
    """Key of a group's input in a modifier."""
    sockets = group.interface.items_tree if hasattr(group, "interface") else group.inputs
    return str(next(socket.identifier for socket in sockets if socket.name == name))


def frame_group(name: str) -> tuple[Any, Any]:
    """Geometry nodes with the inputs First and End, and the socket of the geometry that is empty but from the one scene frame until
    before the other. Keyed visibility would lose the modifiers of hidden objects where Blender 3.4 builds its dependencies anew."""
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for kind, socket in (("Geometry", "Geometry"), ("Int", "First"), ("Int", "End")):
        add_socket(group, kind, socket, "INPUT")
    add_socket(group, "Geometry", "Geometry", "OUTPUT")
    nodes, links = group.nodes, group.links
    source, clock = nodes.new("NodeGroupInput"), nodes.new("GeometryNodeInputSceneTime")
    # A shutter's parts of a frame belong to it.
    whole = nodes.new("ShaderNodeMath")
    whole.operation = "ROUND"
    links.new(clock.outputs["Frame"], whole.inputs[0])
    both = nodes.new("FunctionNodeBooleanMath")
    for place, (operation, socket) in enumerate((("GREATER_EQUAL", "First"), ("LESS_THAN", "End"))):
        compare = nodes.new("FunctionNodeCompare")
        compare.data_type, compare.operation = "FLOAT", operation
        links.new(whole.outputs[0], compare.inputs[0])
        links.new(source.outputs[socket], compare.inputs[1])
        links.new(compare.outputs[0], both.inputs[place])
    switch = nodes.new("GeometryNodeSwitch")
    switch.input_type = "GEOMETRY"
    asked, full = (next(each for each in switch.inputs if each.enabled and each.name == title) for title in ("Switch", "True"))
    links.new(both.outputs[0], asked)
    links.new(source.outputs["Geometry"], full)
    return group, next(each for each in switch.outputs if each.enabled)


def show_from_to(thing: Any, group: Any, first: int, end: int) -> None:
    """Gives an object a group of `frame_group`: it is seen from scene frame `first` until the frame before `end`."""
    modifier = thing.modifiers.new("swell", "NODES")
    modifier.node_group = group
    for socket, value in (("First", first), ("End", end)):
        modifier[identifier(group, socket)] = value


def add_attribute(mesh: Any, name: str, values: np.ndarray) -> None:
    """A point attribute: integers (n,), floats (n,) or vectors (n, 3)."""
    if values.ndim == 2:
        kind, key, values = "FLOAT_VECTOR", "vector", values.astype(np.float32)
    elif values.dtype.kind in "iu":
        # Blender has 32 bits with a sign; ids below 2^31 keep their value.
        kind, key, values = "INT", "value", values.astype(np.uint32).view(np.int32)
    else:
        kind, key, values = "FLOAT", "value", values.astype(np.float32)
    attribute = mesh.attributes.new(name=name, type=kind, domain="POINT")
    attribute.data.foreach_set(key, np.ascontiguousarray(values).ravel())


def points_mesh(frame: swell.Frame, name: str) -> Any:
    """A mesh of vertices alone, with `velocity` (m/s), `id` and what else the particles carry."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(frame))
    mesh.vertices.foreach_set("co", swell.z_up(frame.position).astype(np.float32).ravel())
    add_attribute(mesh, "velocity", swell.z_up(frame.velocity))
    add_attribute(mesh, "id", frame.id)
    for attribute in frame.attributes:
        add_attribute(mesh, attribute, frame[attribute])
    mesh.update()
    return mesh


def finish(group: Any, geometry: Any, material: Any) -> None:
    """Gives a group's geometry the attribute `speed` and a material, and ends the group. Cycles keeps the name `velocity` for motion blur, so
    materials are given its length."""
    nodes, links = group.nodes, group.links
    velocity = nodes.new("GeometryNodeInputNamedAttribute")
    velocity.data_type = "FLOAT_VECTOR"
    velocity.inputs["Name"].default_value = "velocity"
    length = nodes.new("ShaderNodeVectorMath")
    length.operation = "LENGTH"
    store = nodes.new("GeometryNodeStoreNamedAttribute")
    store.data_type, store.domain = "FLOAT", "POINT"
    store.inputs["Name"].default_value = "speed"
    paint = nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = material
    links.new(next(each for each in velocity.outputs if each.enabled and each.name == "Attribute"), length.inputs[0])
    links.new(length.outputs["Value"], next(each for each in store.inputs if each.enabled and each.name == "Value"))
    links.new(geometry, store.inputs["Geometry"])
    links.new(store.outputs[0], paint.inputs["Geometry"])
    links.new(paint.outputs[0], nodes.new("NodeGroupOutput").inputs["Geometry"])


def points_group(name: str, radius: float | None, material: Any) -> Any:
    """`frame_group` that turns vertices into a point cloud, with radius in metres or, where that is None, of the attribute `radius`."""
    group, shown = frame_group(name)
    nodes, links = group.nodes, group.links
    to_points = nodes.new("GeometryNodeMeshToPoints")
    if radius is None:
        named = nodes.new("GeometryNodeInputNamedAttribute")
        named.data_type = "FLOAT"
        named.inputs["Name"].default_value = "radius"
        value = next(socket for socket in named.outputs if socket.enabled and socket.name == "Attribute")
        links.new(value, to_points.inputs["Radius"])
    else:
        to_points.inputs["Radius"].default_value = radius
    links.new(shown, to_points.inputs["Mesh"])
    finish(group, to_points.outputs[0], material)
    return group


def speed_material(name: str, fastest: float, roughness: float = 0.5) -> Any:
    """Blue at rest to white at `fastest` m/s, by the attribute `speed`."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    speed = nodes.new("ShaderNodeAttribute")
    speed.attribute_name = "speed"
    scale = nodes.new("ShaderNodeMapRange")
    scale.inputs["From Max"].default_value = fastest
    ramp = nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color = (0.01, 0.06, 0.14, 1.0)
    ramp.color_ramp.elements[1].color = (0.9, 0.95, 1.0, 1.0)
    links.new(speed.outputs["Fac"], scale.inputs["Value"])
    links.new(scale.outputs["Result"], ramp.inputs["Fac"])
    shader = nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = roughness
    links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    return material


def fast(frame: swell.Frame) -> float:
    """Speed that one particle of a hundred is above, m/s; 0 without particles."""
    speeds = np.linalg.norm(frame.velocity, axis=1)
    return float(np.quantile(speeds, 0.99)) if len(speeds) else 0.0


def top_speed(cache: swell.Cache, frames: Sequence[int]) -> float:
    """Speed that is drawn white, m/s: that of the fast water in the first or the last of these frames."""
    return max([1e-3, *(fast(cache[number]) for number in {*frames[:1], *frames[-1:]})])


def import_points(cache: swell.Cache, frames: Sequence[int], name: str, offset: int = 0) -> list[Any]:
    """Frames as point clouds, an object each, seen from its frame to the next one's; the objects."""
    if not frames:
        raise ImportFault(f"{cache.path} has particles of none of the frames asked for")
    step = min((after - before for before, after in zip(frames, frames[1:], strict=False)), default=1)
    ends = [*frames[1:], frames[-1] + step]
    has_radius = "radius" in cache.manifest["attributes"]
    material = speed_material(name, top_speed(cache, frames))
    group = points_group(f"{name} points", None if has_radius else 0.5 * cache.particle_spacing, material)
    into = collection(name)
    made = []
    for number, end in zip(frames, ends, strict=True):
        title = f"{name}.{number:04}"
        thing = bpy.data.objects.new(title, points_mesh(cache[number], title))
        into.objects.link(thing)
        show_from_to(thing, group, number + offset, end + offset)
        thing["swell_frame"] = number
        made.append(thing)
    return made


def import_grids(cache: swell.Cache, frames: Sequence[int], name: str, offset: int = 0) -> Any:
    """OpenVDB files of consecutive frames as one volume that follows the scene's frame; the object."""
    if not cache.grids:
        raise ImportFault(f"{cache.path} has no grids: its scene has no [grids]")
    numbers = [n for n in cache.grids if n in set(range(frames[0], frames[-1] + 1))]
    if not numbers:
        raise ImportFault(f"{cache.path} has grids of none of the frames asked for")
    paths = [cache.grids[number] for number in numbers]
    volume = bpy.data.volumes.new(name)
    volume.filepath = str(paths[0].resolve())
    volume.is_sequence = True
    volume.frame_start = numbers[0] + offset
    volume.frame_duration = len(numbers)
    # Blender counts the files of a sequence from 1.
    volume.frame_offset = numbers[0] - 1
    volume.sequence_mode = "CLIP"
    thing = bpy.data.objects.new(name, volume)
    thing.rotation_euler = Z_UP
    collection(name).objects.link(thing)
    return thing


def read_ply_mesh(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """A binary PLY mesh of triangles: positions (n, 3), other columns of the vertices by name, corners (m, 3)."""
    content = path.read_bytes()
    head, found, body = content.partition(b"end_header\n")
    lines = [line.split() for line in head.decode("ascii", "replace").splitlines()]
    if not found or ["format", "binary_little_endian", "1.0"] not in lines:
        raise ImportFault(f"{path} is no binary little-endian PLY file")
    columns: list[tuple[str, str]] = []
    counts: dict[str, int] = {}
    corner: list[str] = []
    element = ""
    for words in lines:
        if words[:1] == ["element"]:
            element = words[1]
            counts[element] = int(words[2])
        elif words[:1] == ["property"] and element == "vertex":
            columns.append((words[2], PLY_SCALARS[words[1]]))
        elif words[:2] == ["property", "list"] and element == "face":
            corner = words[2:4]
    vertices = np.frombuffer(body, dtype=columns, count=counts.get("vertex", 0))
    face = np.dtype([("size", PLY_SCALARS[corner[0]]), ("corners", PLY_SCALARS[corner[1]], 3)])
    faces = np.frombuffer(body, dtype=face, count=counts.get("face", 0), offset=vertices.nbytes)
    if vertices.nbytes + faces.nbytes != len(body) or not (faces["size"] == 3).all():
        raise ImportFault(f"{path} has faces that are no triangles")
    others = {name: vertices[name] for name, _ in columns if name not in "xyz"}
    return np.stack([vertices[axis] for axis in "xyz"], axis=1), others, faces["corners"]


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """An OBJ file: positions (n, 3), corners of all faces one after the other, corners of each face."""
    position: list[list[float]] = []
    corners: list[int] = []
    sizes: list[int] = []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            position.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            face = [int(word.split("/")[0]) for word in words[1:]]
            # Counted from 1, or backward from the newest.
            corners += [corner - 1 if corner > 0 else len(position) + corner for corner in face]
            sizes.append(len(face))
    return np.array(position).reshape(-1, 3), np.array(corners, dtype=np.int32), np.array(sizes, dtype=np.int32)


def read_mesh(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """`read_obj` of a PLY or OBJ file, with other columns of the vertices by name."""
    if path.suffix.lower() == ".obj":
        position, corners, sizes = read_obj(path)
        return position, {}, corners, sizes
    position, others, triangles = read_ply_mesh(path)
    return position, others, triangles.astype(np.int32).ravel(), np.full(len(triangles), 3, dtype=np.int32)


def polygon_mesh(name: str, position: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> Any:
    """A mesh from positions in swell's axes."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(position))
    mesh.vertices.foreach_set("co", swell.z_up(position).astype(np.float32).ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(sizes))
    mesh.polygons.foreach_set("loop_start", np.cumsum(sizes) - sizes)
    mesh.polygons.foreach_set("loop_total", sizes)
    mesh.update(calc_edges=True)
    return mesh


def water_mesh(path: Path, name: str) -> Any:
    """A mesh from a PLY or OBJ file; a PLY's `vx vy vz` become the attribute `velocity`, its other columns attributes."""
    position, others, corners, sizes = read_mesh(path)
    mesh = polygon_mesh(name, position, corners, sizes)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(sizes), dtype=bool))
    if {"vx", "vy", "vz"} <= others.keys():
        add_attribute(mesh, "velocity", swell.z_up(np.stack([others.pop(axis) for axis in ("vx", "vy", "vz")], axis=1)))
    for axis in ("nx", "ny", "nz"):
        # Blender makes normals of its own.
        others.pop(axis, None)
    for column, values in others.items():
        add_attribute(mesh, column, values)
    return mesh


def import_meshes(folder: Path, frames: Sequence[int] | None, name: str, offset: int = 0, fastest: float = 10.0) -> list[Any]:
    """A sequence `NAME.0048.ply` or `.obj` of one folder, an object a frame, white at `fastest` m/s; the objects."""
    files = {}
    for path in sorted(folder.iterdir()):
        found = re.fullmatch(r".*\.(\d+)\.(ply|obj)", path.name, re.IGNORECASE)
        if found and (frames is None or int(found[1]) in frames):
            files[int(found[1])] = path
    if not files:
        raise ImportFault(f"{folder} has no NAME.0001.ply or .obj of the frames asked for")
    numbers = sorted(files)
    group, shown = frame_group(name)
    finish(group, shown, speed_material(name, fastest, roughness=0.1))
    into = collection(name)
    made = []
    for number, end in zip(numbers, [*numbers[1:], numbers[-1] + 1], strict=True):
        title = f"{name}.{number:04}"
        thing = bpy.data.objects.new(title, water_mesh(files[number], title))
        into.objects.link(thing)
        show_from_to(thing, group, number + offset, end + offset)
        thing["swell_frame"] = number
        made.append(thing)
    return made


def import_solids(cache: swell.Cache) -> list[Any]:
    """The scene's solids that stand still, where they stand; of OBJ and binary PLY files."""
    made = []
    into = collection("solids")
    material = bpy.data.materials.new("solids")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.4, 0.34, 0.28, 1.0)
    for index, solid in enumerate(cache.scene.get("solid", [])):
        path = cache.assets[solid["mesh"].removeprefix("assets/")]
        if {"motion", "turn", "track"} & solid.keys() or path.suffix.lower() not in (".obj", ".ply"):
            print(f"import_swell: solid {index} ({path.name}) is left out: it moves (see --shot), or is neither OBJ nor PLY")
            continue
        position, _, corners, sizes = read_mesh(path)
        position = position.astype(np.float64) * solid["scale"]
        # About x, then y, then z.
        for axis, degrees in enumerate(solid["rotate_degrees"]):
            position = turned(position, axis, math.radians(degrees))
        mesh = polygon_mesh(f"solid {index}", position + solid["translate"], corners, sizes)
        mesh.materials.append(material)
        thing = bpy.data.objects.new(mesh.name, mesh)
        into.objects.link(thing)
        made.append(thing)
    return made


def asset_names(text: str) -> list[str]:
    """The files beside a layer that a value of it names; a name with an @ stands between three, and @@@ in it behind a backslash."""
    found = re.findall(r"@@@\./((?:\\@@@|@{0,2}(?!@).)*?)@@@|@\./([^@]*)@", text)
    return [long.replace("\\@@@", "@@@") or short for long, short in found]


def usd_prims(path: Path) -> dict[str, dict[str, Any]]:
    """Prims of a layer that `swell export --usd` wrote as text, by path. Attributes are text, and where they have samples, text by frame."""
    lines = iter(path.read_text(encoding="utf-8").splitlines())
    if next(lines, "") != "#usda 1.0":
        raise ImportFault(f"{path} is no USD as text; swell export --usd writes it to a .usda")
    prims: dict[str, dict[str, Any]] = {}
    named, inside = "", []
    for line in map(str.strip, lines):
        prim = re.match(r'(?:def|over)(?: \w+)? "(.*)"', line)
        attribute = re.match(r"(?:uniform )?[\w\[\]]+ ([\w:]+)(\.timeSamples)? = (.*)", line)
        if prim:
            named = prim[1]
        elif line == "{":
            inside.append(named)
            prims["/".join(inside)] = {}
        elif line == "}":
            inside.pop()
        elif attribute and attribute[2]:
            samples = iter(lambda: next(lines).strip().rstrip(","), "}")
            prims["/".join(inside)][attribute[1]] = {int(frame): value for frame, _, value in (each.partition(": ") for each in samples)}
        elif attribute:
            prims["/".join(inside)][attribute[1]] = attribute[3]
        if line == "(" or line.endswith(" ("):
            # Metadata: which layers are played when, and how attributes are interpolated.
            metadata = iter(lambda: next(lines).strip(), ")")
            layers = [asset_names(each) for each in metadata if each.startswith("asset[] assetPaths")]
            prims.setdefault("", {"layers": []})["layers"] += [name for found in layers for name in found]
    return prims


def numbers(text: str) -> np.ndarray:
    """All numbers of a value of USD."""
    return np.array(re.findall(r"[-+.\w]+", text), dtype=np.float64)


def import_shot(path: Path, offset: int = 0) -> list[Any]:
    """The solids and wave makers of a shot of `swell export --usd`, as they move, with a key a frame; for a Blender that reads no USD."""
    layers = {"": usd_prims(path)}
    layers |= {name: usd_prims(path.parent / name) for name in layers[""][""]["layers"]}
    into = collection("moving")
    bpy.context.preferences.edit.keyframe_new_interpolation_type = "LINEAR"
    made = []
    for prim, own in layers[""].items():
        shot, *way = prim.split("/")
        if len(way) != 2 or way[0] not in ("solids", "wave_makers"):
            continue
        rest = numbers(own.get("xformOp:translate:rest", "(0, 0, 0)"))
        corners, sizes = (numbers(own[key]).astype(np.int32) for key in ("faceVertexIndices", "faceVertexCounts"))
        mesh = polygon_mesh(way[1], numbers(own["points"]).reshape(-1, 3) + rest, corners, sizes)
        thing = bpy.data.objects.new(mesh.name, mesh)
        into.objects.link(thing)
        thing.rotation_mode = "QUATERNION"
        origin = numbers(layers[""][shot].get("xformOp:translate", "(0, 0, 0)"))
        thing.location = swell.z_up(origin[None])[0]
        # A wave maker's places stand in the layers of the frames.
        for layer in layers.values():
            attributes = layer.get(prim, {})
            for frame, value in dict(attributes.get("xformOp:translate") or {}).items():
                thing.location = swell.z_up((numbers(value) + origin)[None])[0]
                thing.keyframe_insert("location", frame=frame + offset)
            for frame, value in dict(attributes.get("xformOp:orient") or {}).items():
                w, x, y, z = numbers(value)
                thing.rotation_quaternion = (w, x, -z, y)
                thing.keyframe_insert("rotation_quaternion", frame=frame + offset)
        made.append(thing)
    return made


def turned(position: np.ndarray, axis: int, angle: float) -> np.ndarray:
    """Positions turned about an axis by an angle in radians, right-handed."""
    after, last = (axis + 1) % 3, (axis + 2) % 3
    result = position.copy()
    result[:, after] = math.cos(angle) * position[:, after] - math.sin(angle) * position[:, last]
    result[:, last] = math.sin(angle) * position[:, after] + math.cos(angle) * position[:, last]
    return result


def set_scene(cache: swell.Cache, frames: Sequence[int], offset: int) -> None:
    """Frame rate and range of the scene, in metres."""
    scene = bpy.context.scene
    rate = cache.frames_per_second
    # Blender has a whole number over a base.
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = max(1, round(rate)) / rate
    scene.frame_start, scene.frame_end = frames[0] + offset, frames[-1] + offset
    scene.unit_settings.system = "METRIC"
    scene.frame_set(frames[0] + offset)


def arguments(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="import_swell.py", description="Brings frames of a swell cache into Blender.")
    parser.add_argument("cache", type=Path)
    parser.add_argument("--frames", type=frame_range, help="40-72, 40-72x2, 48; left out: all that have particles")
    parser.add_argument("--no-points", action="store_true", help="leave out the particles")
    parser.add_argument("--whitewater", action="append", default=[], metavar="NAME", help="a stream of spray, foam and bubbles")
    parser.add_argument("--grids", action="store_true", help="the OpenVDB files of the cache, as one volume")
    parser.add_argument("--meshes", type=Path, metavar="FOLDER", help="a sequence of PLY or OBJ files")
    parser.add_argument("--solids", action="store_true", help="the scene's solids that stand still")
    parser.add_argument("--shot", type=Path, metavar="FILE.usda", help="all solids and wave makers as they move, from swell export --usd FILE.usda")
    parser.add_argument("--offset", type=int, default=0, help="scene frame less frame of the cache")
    parser.add_argument("--add", action="store_true", help="keep what the start-up file has; left out: the scene begins empty")
    parser.add_argument("--save", type=Path, metavar="FILE.blend")
    return parser.parse_args(words)


def main(words: Sequence[str]) -> None:
    """The command line; raises what `run` turns into an exit code."""
    asked = arguments(words)
    if not asked.add:
        bpy.ops.wm.read_homefile(use_empty=True)
    cache = swell.Cache(asked.cache)
    frames = cache.frames if asked.frames is None else [n for n in asked.frames if n in cache]
    missing = sorted(set(asked.frames or ()) - set(frames))
    if missing and not asked.no_points:
        cache[missing[0]]
    if not asked.no_points:
        import_points(cache, frames, cache.shot, asked.offset)
    for stream in asked.whitewater:
        if stream not in cache.streams:
            raise ImportFault(f"{cache.path} has no whitewater `{stream}`; it has {', '.join(cache.streams) or 'none'}")
        import_points(cache.streams[stream], frames, f"{cache.shot} {stream}", asked.offset)
    if asked.grids:
        import_grids(cache, asked.frames or frames, f"{cache.shot} grids", asked.offset)
    if asked.meshes is not None:
        import_meshes(asked.meshes, asked.frames, f"{cache.shot} mesh", asked.offset, top_speed(cache, frames))
    if asked.solids:
        import_solids(cache)
    if asked.shot is not None:
        import_shot(asked.shot, asked.offset)
    set_scene(cache, asked.frames or frames, asked.offset)
    if asked.save is not None:
        bpy.ops.wm.save_as_mainfile(filepath=str(asked.save.resolve()))
    print(f"import_swell: frames {frames[0]} to {frames[-1]} of {cache.path}" if frames else "import_swell: done")


def run(words: Sequence[str]) -> int:
    """Exit code of the command line: 4 where a file is at fault, as swell has it."""
    try:
        main(words)
    except (swell.CacheError, ImportFault, OSError) as error:
        print(f"import_swell: {error}", file=sys.stderr)
        return 4
    except Exception:
        # Blender would end with 0.
        traceback.print_exc()
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(run(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []))
