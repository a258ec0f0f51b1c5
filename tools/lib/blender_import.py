"""Runs in Blender on a .blend that tools/blender/import_swell.py saved: what stands there, against the cache. See tools/lib/blender-import.

What is expected is read by numpy from the frame files, and turned here by the words of docs/interchange.md: (x, y, z) becomes (x, -z, y).
The second argument is `tank` or `exported`, the .blend's name. With a third one thing is expected wrongly, and the run has to fail: `axes`, `handed`, `frame` or `velocity`.
"""

import sys
from pathlib import Path

import bpy
import numpy as np
# As modules of Python both stand behind bpy.
import bmesh
from mathutils import Vector

# Half of the last of a float's 24 bits, of coordinates below 4 m and speeds below 16 m/s.
TOLERANCE = 2.0**-21
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]])

room = Path(sys.argv[sys.argv.index("--") + 1])
scene_name = sys.argv[sys.argv.index("--") + 2]
spoiled = (sys.argv[sys.argv.index("--") + 3 :] or [""])[0]
failures = []


def check(holds, what):
    if not holds:
        failures.append(what)
        print(f"FAILED: {what}")


def rows(path, attributes=()):
    """Rows of a frame file by the layout of docs/cache.md."""
    names = ["x", "y", "z", "vx", "vy", "vz", "id", *attributes]
    kinds = [(name, "<u4" if name == "id" else "<f4") for name in names]
    return np.frombuffer(path.read_bytes().partition(b"end_header\n")[2], dtype=kinds)


def turn(x, y, z):
    if spoiled == "axes":
        return np.stack([x, y, z], axis=1)
    if spoiled == "handed":
        return np.stack([x, z, y], axis=1)
    return np.stack([x, -z, y], axis=1)


def values(data, name, key, width):
    found = np.empty(len(data.attributes[name].data) * width, dtype=np.int32 if key == "value" and name == "id" else np.float32)
    data.attributes[name].data.foreach_get(key, found)
    return found.reshape(-1, width) if width > 1 else found


def seen(kind, name):
    """What is seen of the scene now: evaluated objects of a kind whose name begins with a word."""
    graph = bpy.context.evaluated_depsgraph_get()
    # An instance is good for its turn of the loop alone.
    return [each.object for each in graph.object_instances if not each.is_instance and is_one(each.object, kind, name)]


def is_one(thing, kind, name):
    return thing.type == kind and thing.name.startswith(name)


def box_of(thing):
    """Least and greatest corner in the world."""
    box = np.array([thing.matrix_world @ Vector(corner) for corner in thing.bound_box])
    return box.min(axis=0), box.max(axis=0)


def seen_clouds(name, attributes):
    """What is seen of point clouds now, taken out of Blender: name, box, and arrays by attribute."""
    clouds = []
    for each in bpy.context.evaluated_depsgraph_get().object_instances:
        if is_one(each.object, "POINTCLOUD", name):
            data = each.object.data
            arrays = {key: values(data, key, "vector", 3) for key in ("position", "velocity")}
            arrays |= {key: values(data, key, "value", 1) for key in ("id", "radius", *attributes)}
            clouds.append((each.object.name, box_of(each.object), arrays))
    return clouds


def check_points(number, name, folder, shot, attributes=()):
    expected = rows(folder / f"frames/{shot}.{number + (spoiled == 'frame'):04}.ply", attributes)
    clouds = seen_clouds(f"{name}.", attributes)
    if len(expected) == 0 and not clouds:
        return 0
    check(len(clouds) == 1, f"frame {number}: {len(clouds)} clouds of {name}")
    if len(clouds) != 1:
        return 0
    [(found, (least, greatest), arrays)] = clouds
    check(found == f"{name}.{number:04}", f"frame {number}: {found} is seen")
    position, radius = arrays["position"], arrays["radius"]
    if len(position) != len(expected):
        check(False, f"frame {number}: {len(position)} points of {name}, and the file has {len(expected)}")
        return 0
    off = np.abs(position - turn(*(expected[axis] for axis in "xyz"))).max()
    check(off <= TOLERANCE, f"frame {number}: positions of {name} are off by {off}")
    scale = 2.0 if spoiled == "velocity" else 1.0
    velocity = scale * turn(*(expected[axis].astype(np.float64) for axis in ("vx", "vy", "vz")))
    off = np.abs(arrays["velocity"] - velocity).max()
    check(off <= TOLERANCE, f"frame {number}: velocities of {name} are off by {off}")
    for attribute in ("id", *attributes):
        check((arrays[attribute] == expected[attribute]).all(), f"frame {number}: {attribute} of {name}")
    wanted = expected["radius"] if "radius" in attributes else np.full(len(expected), np.float32(0.05))
    check((radius == wanted).all(), f"frame {number}: radii of {name}")
    # The box that Blender draws is that of the spheres.
    off = np.abs([least - (position - radius[:, None]).min(axis=0), greatest - (position + radius[:, None]).max(axis=0)]).max()
    check(off <= 2 * TOLERANCE, f"frame {number}: the box of {name} is off by {off}")
    return 1


def check_grids(number, cache):
    [volume] = seen("VOLUME", "tank grids")
    grids = volume.data.grids
    check(grids.load(), f"frame {number}: {grids.error_message}")
    wanted = cache / f"grids/tank.{number:04}.vdb"
    check(Path(grids.frame_filepath) == wanted, f"frame {number}: {grids.frame_filepath} is read, not {wanted}")
    names = {grid.name: grid.data_type for grid in grids}
    check(names == {"surface": "FLOAT", "vel": "VECTOR_FLOAT"}, f"frame {number}: grids {names}")
    # Blender's own mesh of the level set stands about the water, whose particles are half a spacing of 0.1 m within its surface; the
    # surface is known to a voxel of 0.2 m.
    water = rows(cache / f"frames/tank.{number:04}.ply")
    position = turn(*(water[axis] for axis in "xyz"))
    [mesh] = seen("MESH", "surface of the grids")
    vertices = np.empty(3 * len(mesh.data.vertices), dtype=np.float32)
    mesh.data.vertices.foreach_get("co", vertices)
    vertices = np.array([mesh.matrix_world @ Vector(vertex) for vertex in vertices.reshape(-1, 3)]).reshape(-1, 3)
    check(len(vertices) > 50, f"frame {number}: {len(vertices)} vertices of the level set")
    for what, end in (("least", np.min), ("greatest", np.max)):
        off = np.abs(end(vertices, axis=0) - end(position, axis=0)).max()
        check(off < 0.05 + 0.2, f"frame {number}: the level set's {what} corner is off by {off} m")


def mesh_grids():
    """An object with Blender's mesh of the level set."""
    [volume] = [thing for thing in bpy.data.objects if thing.type == "VOLUME"]
    thing = bpy.data.objects.new("surface of the grids", bpy.data.meshes.new("surface of the grids"))
    bpy.context.scene.collection.objects.link(thing)
    modifier = thing.modifiers.new("mesh", "VOLUME_TO_MESH")
    modifier.object = volume
    modifier.grid_name = "surface"
    modifier.threshold = 0.0


def check_mesh(number, name):
    meshes = [mesh for mesh in seen("MESH", f"{name}.") if len(mesh.data.vertices) > 0]
    check([mesh.name for mesh in meshes] == [f"{name}.{number:04}"], f"frame {number}: meshes {[m.name for m in meshes]}")
    for mesh in meshes:
        position = np.empty(3 * len(mesh.data.vertices), dtype=np.float32)
        mesh.data.vertices.foreach_get("co", position)
        expected = CORNERS + [number, 0.0, 0.0]
        off = np.abs(position.reshape(-1, 3) - turn(*expected.T)).max()
        check(off <= TOLERANCE, f"frame {number}: vertices of {mesh.name} are off by {off}")
        centre = position.reshape(-1, 3).mean(axis=0)
        outward = [polygon.normal.dot(polygon.center - Vector(centre)) > 0.0 for polygon in mesh.data.polygons]
        check(len(outward) == 4 and all(outward), f"frame {number}: {mesh.name} is inside out")
        if "velocity" in mesh.data.attributes:
            velocity = values(mesh.data, "velocity", "vector", 3)
            check(np.abs(velocity - turn(*(2.0 * CORNERS).T)).max() <= TOLERANCE, f"frame {number}: velocities of {mesh.name}")


def check_solid():
    [solid] = seen("MESH", "solid 0")
    position = np.empty(3 * len(solid.data.vertices), dtype=np.float32)
    solid.data.vertices.foreach_get("co", position)
    # The box of the scene, a quarter turn about y: (x, y, z) becomes (z, y, -x), then moved.
    box = np.array([[x, y, z] for x in (0.0, 0.2) for y in (0.0, 0.3) for z in (0.0, 0.4)])
    expected = turn(box[:, 2] + 1.3, box[:, 1], -box[:, 0] + 0.7)
    found = position.reshape(-1, 3)
    apart = np.abs(found[:, None, :] - expected[None, :, :]).max(axis=2).min(axis=1).max()
    check(len(found) == 8 and apart <= 1e-6, f"the solid is off by {apart}")


def check_moving(number):
    """A box that turns by 20 degrees a frame about z through a pivot, and a wall that goes 0.005 m a frame: solids come with a key a frame."""
    time = number + (spoiled == "frame")
    angle = np.radians(20.0 * time)
    corners = np.array([[x, y, z] for x in (0.9, 1.1) for y in (1.2, 1.5) for z in (0.2, 0.6)]) - [1.0, 1.2, 0.3]
    about = np.stack([np.cos(angle) * corners[:, 0] - np.sin(angle) * corners[:, 1], np.sin(angle) * corners[:, 0] + np.cos(angle) * corners[:, 1], corners[:, 2]], axis=1)
    wall = np.array([[0.005 * time, y, z] for y in (0.0, 2.0) for z in (0.0, 1.0)])
    for name, expected in (("box_2", about + [1.0, 1.2, 0.3]), ("wall_minus_x", wall)):
        [thing] = seen("MESH", name)
        found = np.array([thing.matrix_world @ vertex.co for vertex in thing.data.vertices])
        apart = np.abs(found[:, None, :] - turn(*expected.T)[None, :, :]).max(axis=2)
        # Floats of a float's turn.
        off = max(apart.min(axis=0).max(), apart.min(axis=1).max())
        check(off <= 4 * TOLERANCE, f"frame {number}: {name} is off by {off}")


def check_exported(number, cache):
    """Meshes of `swell export`: they stand about the particles, hold their volume, and are not mirrored, which would make it negative."""
    [mesh] = [mesh for mesh in seen("MESH", "tank mesh.") if len(mesh.data.vertices) > 0]
    check(mesh.name == f"tank mesh.{number:04}", f"frame {number}: {mesh.name} is seen")
    water = rows(cache / f"frames/tank.{number + (spoiled == 'frame'):04}.ply")
    position = turn(*(water[axis] for axis in "xyz"))
    vertices = np.empty(3 * len(mesh.data.vertices), dtype=np.float32)
    mesh.data.vertices.foreach_get("co", vertices)
    vertices = vertices.reshape(-1, 3)
    # Particles are half a spacing of 0.1 m within the surface, and the kernels a little off that.
    off = np.abs([vertices.min(axis=0) - position.min(axis=0) + 0.05, vertices.max(axis=0) - position.max(axis=0) - 0.05]).max()
    check(off < 0.05, f"frame {number}: the mesh is off the particles' box by {off} m")
    shape = bmesh.new()
    shape.from_mesh(mesh.data)
    volume = shape.calc_volume(signed=True) / (len(water) * 0.1**3)
    shape.free()
    check(abs(volume - 1.0) < 0.05, f"frame {number}: the mesh holds {volume} of the particles' volume")
    # Of water that falls together, mesh and particles have about the same mean velocity.
    velocity = values(mesh.data, "velocity", "vector", 3).mean(axis=0)
    mean = turn(*(water[axis] for axis in ("vx", "vy", "vz"))).mean(axis=0) * (2.0 if spoiled == "velocity" else 1.0)
    check(np.abs(velocity - mean).max() < 0.25 * np.abs(mean).max(), f"frame {number}: velocities {velocity} of the mesh, {mean} of the particles")


def main():
    cache = room / "cache"
    if not bpy.data.filepath:
        # Blender as a module of Python opens no file by itself.
        bpy.ops.wm.open_mainfile(filepath=str(room / f"{scene_name}.blend"))
    if scene_name == "exported":
        for number in (2, 3, 4, 5, 3):
            bpy.context.scene.frame_set(number)
            check_exported(number, cache)
        print(f"blender import: {len(failures)} faults")
        return
    scene = bpy.context.scene
    check(abs(scene.render.fps / scene.render.fps_base - 24.0) < 1e-6, f"{scene.render.fps}/{scene.render.fps_base} frames a second")
    check((scene.frame_start, scene.frame_end) == (2, 5), f"scene frames {scene.frame_start} to {scene.frame_end}")
    mesh_grids()
    counted = 0
    for number in (2, 3, 4, 5, 3):
        scene.frame_set(number)
        counted += check_points(number, "tank", cache, "tank")
        counted += check_points(number, "tank default", cache / "whitewater/default", "tank", ("age", "kind", "life", "radius"))
        check_grids(number, cache)
        check_mesh(number, "tank mesh")
        check_solid()
        check_moving(number)
    # Water at five turns of the loop, whitewater at two at least: it begins with frame 4.
    check(counted >= 7, f"{counted} clouds were looked at")
    for number in (1, 6):
        scene.frame_set(number)
        check(not seen_clouds("tank", ()), f"frame {number}: points are seen")
    print(f"blender import: {len(failures)} faults")


main()
sys.exit(1 if failures else 0)
