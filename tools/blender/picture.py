"""Renders one frame of a saved scene with Cycles on the CPU: a camera, a sun and a sky around what import_swell.py brought in.

    blender --background wave.blend --python tools/blender/picture.py -- wave.png --frame 66 --camera 8,5.2,-1.5 --target 18,1.7,8.4

Camera and target are in swell's axes: metres, y up.
"""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

import bpy
from mathutils import Vector


def vector(text: str) -> Vector:
    """`x,y,z` with y up, turned to z up."""
    x, y, z = (float(word) for word in text.split(","))
    return Vector((x, -z, y))


def light(scene: bpy.types.Scene) -> None:
    """A sun of half a degree, 40 degrees high, and an even sky."""
    data = bpy.data.lights.new("sun", "SUN")
    data.energy, data.angle = 4.0, 0.009
    sun = bpy.data.objects.new("sun", data)
    # Lights shine along -z.
    sun.rotation_euler = Vector((-0.5, -0.6, 0.65)).to_track_quat("Z", "Y").to_euler()
    scene.collection.objects.link(sun)
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.22, 0.36, 0.55, 1.0)
    scene.world = world


def main(words: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog="picture.py")
    parser.add_argument("file", type=Path)
    parser.add_argument("--frame", type=int, required=True)
    parser.add_argument("--camera", type=vector, required=True)
    parser.add_argument("--target", type=vector, required=True)
    parser.add_argument("--focal", type=float, default=27.0, help="mm, of a film 36 mm wide")
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--samples", type=int, default=32)
    asked = parser.parse_args(words)
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.lens = asked.focal
    camera.location = asked.camera
    camera.rotation_euler = (asked.target - asked.camera).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera)
    scene.camera = camera
    light(scene)
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = asked.samples
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = (int(word) for word in asked.size.split("x"))
    scene.render.resolution_percentage = 100
    scene.render.filepath = str(asked.file.resolve())
    scene.render.image_settings.file_format = {".png": "PNG", ".jpg": "JPEG", ".exr": "OPEN_EXR"}[asked.file.suffix]
    scene.render.image_settings.quality = 88
    scene.frame_set(asked.frame)
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    try:
        main(sys.argv[sys.argv.index("--") + 1 :])
    except Exception:
        # Blender would end with 0.
        traceback.print_exc()
        sys.exit(1)
