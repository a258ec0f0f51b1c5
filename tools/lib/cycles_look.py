"""A picture by Cycles of a shot that swell exported to USD, against swell's own. See tools/lib/cycles-look.

With a second argument one thing is wrong, and the run has to fail: `sun`, `sky`, `texture` or `colour`.
"""

import re
import sys
from pathlib import Path

import bpy
import numpy as np

# Irradiance of the sky from spherical harmonics of order 2, off by up to 3 % (Ramamoorthi and Hanrahan 2001); the sky by how its texels of 0.7 degrees are interpolated.
LIT, SKY = 0.03, 0.01
EYE, TARGET, FOCAL, FILM, SIZE = np.array([7.2, 6.1, 6.6]), np.array([4.5, 5.2, 4.5]), 24.0, 36.0, (320, 180)
LOW, HIGH = np.array([4.0, 4.0, 4.0]), np.array([5.0, 5.0, 5.0])

folder, spoiled = Path(sys.argv[1]), (sys.argv[2:] or [""])[0]
failures = []


def check(holds, what):
    if not holds:
        failures.append(what)
        print(f"FAILED: {what}")


def picture(path):
    """Linear red, green, blue of an EXR, rows from the top."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)[::-1, :, :3]


def rays():
    """Unit directions of the pixels' centres."""
    forward = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    x = ((np.arange(SIZE[0]) + 0.5) / SIZE[0] - 0.5) * FILM / FOCAL
    y = (0.5 - (np.arange(SIZE[1]) + 0.5) / SIZE[1]) * FILM * SIZE[1] / SIZE[0] / FOCAL
    ways = forward + x[None, :, None] * right + y[:, None, None] * up
    return ways / np.linalg.norm(ways, axis=2, keepdims=True)


def inside(ways, axis):
    """Pixels on the box's face at the high end of an axis, and where they are there; 2 cm off its edges."""
    along = (HIGH[axis] - EYE[axis]) / ways[..., axis]
    at = EYE + along[..., None] * ways
    others = [k for k in range(3) if k != axis]
    within = [(at[..., k] > LOW[k] + 0.02) & (at[..., k] < HIGH[k] - 0.02) for k in others]
    return within[0] & within[1], at


def rendered():
    """The shot's picture by Cycles."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    text = (folder / "usd" / "box.usda").read_text()
    wrong = {
        "sky": ("rotateY = 90", "rotateY = 60"),
        "colour": (r"inputs:scale = \(0.9,", "inputs:scale = (0.8,"),
        # Mirrored, on the lines of texture coordinates.
        "texture": (r"primvars:st = .*", lambda line: re.sub(r"\((-?)([\d.]+),", lambda u: f"({'' if u[1] else '-'}{u[2]},", line[0])),
    }
    usd = folder / "usd" / "shown.usda"
    if spoiled in wrong:
        text, count = re.subn(*wrong[spoiled], text)
        assert count == 1, count
    usd.write_text(text)
    bpy.ops.wm.usd_import(filepath=str(usd), import_usd_preview=True)
    for thing in scene.objects:
        if thing.type == "CAMERA":
            scene.camera = thing
        if thing.type == "LIGHT":
            # Blender's importer multiplies a sun by 4 and takes its diameter for a radius.
            thing.data.energy /= 4.0
            thing.data.angle /= 2.0
            if spoiled == "sun":
                thing.rotation_euler.z += 0.3
    for material in bpy.data.materials:
        for node in material.node_tree.nodes:
            if node.type == "TEX_IMAGE":
                node.interpolation = "Closest"
    scene.frame_set(1)
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 256
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(folder / "cycles.exr")
    bpy.ops.render.render(write_still=True)
    return picture(folder / "cycles.exr")


own, theirs = picture(folder / "own" / "box.0001.exr"), rendered()
ways = rays()
said = []
for axis, name in ((0, "side +x"), (1, "top"), (2, "side +z")):
    mask, at = inside(ways, axis)
    # Away from the borders of texels, 5 cm of the texture's 0.2 by 0.2 m.
    for k in (k for k in range(3) if k != axis):
        part = np.mod(at[..., k], 0.2)
        mask &= (part > 0.06) & (part < 0.14)
    # Channels that a texel has little of take light from its neighbours within a pixel.
    bright = own[mask] > 0.5 * own[mask].max()
    off = (np.abs(theirs[mask] - own[mask]) / own[mask])[bright]
    check(mask.sum() > 100, f"{name}: {mask.sum()} pixels")
    check(np.percentile(off, 95) < LIT, f"{name}: 95 % of the pixels within {np.percentile(off, 95):.3f}")
    said.append(f"{name} {100 * np.percentile(off, 95):.1f} %")
sky = ways[..., 1] > 0.06
off = np.abs(theirs[sky] - own[sky]) / own[sky]
check(sky.sum() > 500 and np.percentile(off, 95) < SKY, f"sky: {sky.sum()} pixels within {np.percentile(off, 95):.4f}")
said.append(f"sky {100 * np.percentile(off, 95):.2f} %")
print(f"cycles look: Blender {bpy.app.version_string}, 95 % of the pixels of each part differ by less than: {', '.join(said)}")
sys.exit(1 if failures else 0)
