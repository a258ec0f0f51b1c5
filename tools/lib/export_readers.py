"""What OpenUSD, plyfile, meshio and numpy read of files that swell exported. See tools/lib/export-readers."""

import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

import meshio
import numpy as np
from plyfile import PlyData
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdValidation

from pier import PIER

SCENE = """
[shot]
name = "pool-1"
frames = 3
frames_per_second = 24
[domain]
min = [0.0, 0.0, 0.0]
max = [2.0, 2.0, 1.0]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.8, 1.0, 1.0]
[[solid]]
mesh = "pier.obj"
[[wave_maker]]
wall = "-x"
motion = { kind = "sine", stroke = 0.3, period = 0.5, ramp = 0.1 }
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
"""

EYE, TARGET = np.array([-2.0, 1.8, 2.2]), np.array([1.0, 0.5, 0.5])
FOCAL_MM, FILM_MM, WIDTH, HEIGHT = 30.0, 36.0, 96, 54

LOOK = f"""
[camera]
focal_length_mm = {FOCAL_MM}
film_back_mm = [{FILM_MM}, 20.25]
position = {EYE.tolist()}
target = {TARGET.tolist()}
lens = {{ f_stop = 2.8, focus_distance_m = 3.5 }}
[image]
width = {WIDTH}
height = {HEIGHT}
samples = 16
[sun]
azimuth_degrees = 25.0
elevation_degrees = 45.0
[sky]
model = "hosek_wilkie"
turbidity = 3.0
[[solids.material]]
name = "pier"
colour = [0.9, 0.8, 0.7]
texture = {{ file = "two.png", metres = 0.5 }}
"""

RIG = f"""
[camera]
file = "rig.usda"
film_back_mm = [{FILM_MM}, 20.25]
""" + LOOK[LOOK.index("[image]") :]

# Whitewater wherever water moves.
WHITE = """
radius = [0.02, 0.04]
[emission]
trapped_air = [0.001, 0.01]
wave_crest = [0.01, 0.1]
energy = [0.001, 0.1]
trapped_air_rate = 2e6
wave_crest_rate = 2e6
"""

SPACING = 0.1
SIZE = np.array([2.0, 2.0, 1.0])
FRAMES = [1, 2, 3]


def must(condition, what):
    """Ends the run where something is not as it should be."""
    if not condition:
        sys.exit(f"export readers: {what}")


def is_closed(triangles):
    """Whether each directed edge has its opposite once."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    key = edges[:, 0].astype(np.int64) << 32 | edges[:, 1]
    back = edges[:, 1].astype(np.int64) << 32 | edges[:, 0]
    return np.array_equal(np.sort(key), np.sort(back))


def volume(points, triangles):
    """Within a closed mesh."""
    a, b, c = (points[triangles[:, k]].astype(np.float64) for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0


def messages(stage):
    """What all of OpenUSD's validators have to say of a stage."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    must(len(validators) > 5, "OpenUSD has hardly any validators")
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    return [error.GetErrorAsString() for error in found]


def check_tables(room):
    """Tables against the cache's own frames, as plyfile reads them."""
    for frame in FRAMES:
        row = PlyData.read(room / f"cache/frames/pool-1.{frame:04}.ply")["vertex"].data
        place = np.stack([row[c] for c in "xyz"], axis=1)
        speed = np.stack([row[c] for c in ("vx", "vy", "vz")], axis=1)
        npy = np.load(room / f"p.{frame:04}.npy")
        must(np.array_equal(npy["position"], place), "NPY: positions")
        must(np.array_equal(npy["velocity"], speed), "NPY: velocities")
        must(np.array_equal(npy["id"], row["id"]), "NPY: ids")
        csv = np.genfromtxt(room / f"p.{frame:04}.csv", delimiter=",", names=True, dtype=None)
        must(np.array_equal(csv["x"].astype(np.float32), place[:, 0]), "CSV: x")
        must(np.array_equal(csv["vz"].astype(np.float32), speed[:, 2]), "CSV: vz")
        must(not np.array_equal(np.roll(npy["position"], 1, axis=0), place), "the control: rows in another order")


def check_meshes(room):
    """Meshes by plyfile and meshio."""
    for frame in FRAMES:
        count = len(np.load(room / f"p.{frame:04}.npy"))
        data = PlyData.read(room / f"m.{frame:04}.ply")
        vertex = data["vertex"].data
        points = np.stack([vertex[c] for c in "xyz"], axis=1)
        triangles = np.stack(data["face"].data["vertex_indices"])
        must(is_closed(triangles), f"frame {frame}: the mesh is open")
        must(not is_closed(triangles[1:]), "the control: a triangle less")
        ratio = volume(points, triangles) / (count * SPACING**3)
        must(abs(ratio - 1.0) <= 0.01, f"frame {frame}: the mesh holds {ratio} of the particles' volume")
        normals = np.stack([vertex[c] for c in ("nx", "ny", "nz")], axis=1)
        must(np.allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5), "normals are no unit vectors")
        speed = np.stack([vertex[c] for c in ("vx", "vy", "vz")], axis=1)
        must(np.isfinite(speed).all() and np.abs(speed).max() > 0.1, "PLY: velocities")
        for name in ("ply", "obj"):
            other = meshio.read(room / f"m.{frame:04}.{name}")
            must(np.array_equal(other.points.astype(np.float32), points), f"meshio: points of {name}")
            must(np.array_equal(other.cells_dict["triangle"], triangles), f"meshio: triangles of {name}")
        print(f"frame {frame}: {len(points)} vertices, {100 * ratio:.2f} % of the particles' volume")


def check_points(stage, room):
    """The points of a shot against the tables, and its units."""
    must(UsdGeom.GetStageMetersPerUnit(stage) == 1.0, "USD: units")
    must(UsdGeom.GetStageUpAxis(stage) == "Y", "USD: axis")
    must(stage.GetTimeCodesPerSecond() == 24.0 and stage.GetFramesPerSecond() == 24.0, "USD: frame rate")
    must((stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1.0, 3.0), "USD: range")
    water = UsdGeom.Points(stage.GetPrimAtPath("/pool_1/water"))
    for frame in FRAMES:
        npy = np.load(room / f"p.{frame:04}.npy")
        must(np.array_equal(np.array(water.GetPointsAttr().Get(frame)), npy["position"]), "USD: points")
        must(np.array_equal(np.array(water.GetVelocitiesAttr().Get(frame)), npy["velocity"]), "USD: velocities")
        must(np.array_equal(np.array(water.GetIdsAttr().Get(frame)), npy["id"]), "USD: ids")
        low, high = water.GetExtentAttr().Get(frame)
        width = (6 / np.pi) ** (1 / 3) * SPACING
        must(np.allclose(low, npy["position"].min(axis=0) - width / 2, atol=1e-6), "USD: extent")
        must(np.allclose(high, npy["position"].max(axis=0) + width / 2, atol=1e-6), "USD: extent")
    must(np.allclose(water.GetWidthsAttr().Get(), width), "USD: widths")
    must(water.GetWidthsInterpolation() == "constant", "USD: widths for all")
    one, two = (np.array(water.GetPointsAttr().Get(frame)) for frame in (1, 2))
    must(not np.array_equal(one, two), "the control: another frame")
    between = np.array(water.GetPointsAttr().Get(1.5))
    must(np.allclose(between, (one + two) / 2, atol=1e-6), "USD: between two frames points of the same ids are halfway")


def check_set(stage):
    """Solids and wave makers where they are."""
    pier = UsdGeom.Mesh(stage.GetPrimAtPath("/pool_1/solids/pier"))
    points = np.array(pier.GetPointsAttr().Get())
    must(np.allclose(points.min(axis=0), [1.3, 0, 0.3]) and np.allclose(points.max(axis=0), [1.7, 0.8, 0.7]), "USD: pier")
    triangles = np.array(pier.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    must(abs(volume(points, triangles) - 0.4 * 0.8 * 0.4) < 1e-6, "USD: the pier's faces look outward")
    maker = UsdGeom.Xformable(stage.GetPrimAtPath("/pool_1/wave_makers/wall_minus_x"))
    for frame in FRAMES:
        found = maker.ComputeLocalToWorldTransform(frame).ExtractTranslation()
        # Stroke 0.3 m, a sine of 0.5 s, which grows over the first 0.1 s.
        must(found[1] == 0.0 and found[2] == 0.0 and abs(found[0]) <= 0.3, "USD: way of the wave maker")
    ways = [maker.ComputeLocalToWorldTransform(frame).ExtractTranslation()[0] for frame in FRAMES]
    must(len(set(ways)) == 3, f"USD: the wave maker stands still: {ways}")
    wall = UsdGeom.Mesh(maker.GetPrim())
    corners = np.array(wall.GetPointsAttr().Get())
    must(np.all(corners[:, 0] == 0.0) and np.allclose(corners.max(axis=0), [0, 2, 1]), "USD: the wave maker's wall")
    a, b, c = corners[:3]
    must(np.cross(b - a, c - a)[0] > 0, "USD: the wave maker faces the water")


def check_wet(stage, room):
    """Wetness of the pier's vertices, against the stream's points as plyfile reads them."""
    pier = UsdGeom.Mesh(stage.GetPrimAtPath("/pool_1/solids/pier"))
    wetness = UsdGeom.PrimvarsAPI(pier).GetPrimvar("wetness")
    must(wetness.GetInterpolation() == "vertex", "USD: wetness by vertex")
    for frame in FRAMES:
        row = PlyData.read(room / f"cache/wet/default/frames/pool-1.{frame:04}.ply")["vertex"].data
        must(np.array_equal(np.array(wetness.Get(frame)), row["wetness"]), "USD: wetness")
        place = np.stack([row[c] for c in "xyz"], axis=1)
        must(np.array_equal(np.array(pier.GetPointsAttr().Get()), place), "USD: vertices of the wet pier")
    must(not np.array_equal(np.array(wetness.Get(3)), np.roll(row["wetness"], 1)), "the control: wetness of other vertices")
    triangles = np.array(pier.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    must(is_closed(triangles), "USD: the wet pier is open")
    must(abs(volume(place, triangles) - 0.4 * 0.8 * 0.4) < 1e-6, "USD: the wet pier holds what the pier does")


def pixel(point):
    """Where the look's camera has a point: parts of the picture's width and height from its middle, by its pose alone."""
    forward = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    depth = np.dot(point - EYE, forward)
    x = FOCAL_MM * np.dot(point - EYE, right) / depth / FILM_MM
    return np.array([x, FOCAL_MM * np.dot(point - EYE, up) / depth / (FILM_MM * HEIGHT / WIDTH)])


def check_camera(stage):
    """The camera's frustum against the look's own numbers."""
    schema = UsdGeom.Camera(stage.GetPrimAtPath("/pool_1/camera"))
    camera = schema.GetCamera(2)
    # Tenths of the scene's unit.
    must(abs(camera.horizontalAperture - FILM_MM / 100) < 1e-6, "USD: film")
    must(abs(camera.focalLength - FOCAL_MM / 100) < 1e-6, "USD: focal length")
    must(abs(camera.fStop - 2.8) < 1e-6 and abs(camera.focusDistance - 3.5) < 1e-6, "USD: lens")
    view = camera.frustum.ComputeViewMatrix() * camera.frustum.ComputeProjectionMatrix()
    for point in ([0.5, 0.2, 0.5], [1.0, 0.5, 0.5], [0.1, 1.0, 0.9]):
        found = view.Transform(Gf.Vec3d(*point))
        wanted = 2 * pixel(np.array(point))
        must(np.allclose([found[0], found[1]], wanted, atol=1e-5), f"USD: {point} at {found}, not at {wanted}")


def write_texture(path):
    """Two texels beside each other."""
    raw = b"\0" + bytes((250, 40, 40, 40, 40, 250))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", 2, 1, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


def check_look(stage, room):
    """Materials by OpenUSD's own resolution of bindings, texture coordinates by the words of docs/look.md, and the sun."""
    pier = stage.GetPrimAtPath("/pool_1/solids/pier")
    material, _ = UsdShade.MaterialBindingAPI(pier).ComputeBoundMaterial()
    must(material and material.GetPath() == "/pool_1/materials/pier", f"USD: the pier has {material}")
    surface, _, _ = material.ComputeSurfaceSource()
    must(surface.GetIdAttr().Get() == "UsdPreviewSurface", "USD: the pier's surface")
    source = surface.GetInput("diffuseColor").GetConnectedSources()[0][0].source
    texture = UsdShade.Shader(source.GetPrim())
    file = texture.GetInput("file").Get()
    must(Path(file.resolvedPath) == (room / file.path).resolve() and Path(file.resolvedPath).is_file(), f"USD: {file}")
    must(np.allclose(texture.GetInput("scale").Get(), [0.9, 0.8, 0.7, 1.0]), "USD: factor of the texture")
    water, _ = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath("/pool_1/water")).ComputeBoundMaterial()
    must(water.GetPath() == "/pool_1/materials/water", "USD: the water's material")
    mesh = UsdGeom.Mesh(pier)
    places = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    must(places.GetInterpolation() == "faceVarying", "USD: texture coordinates by corner")
    corners = np.array(mesh.GetPointsAttr().Get())[np.array(mesh.GetFaceVertexIndicesAttr().Get())].reshape(-1, 3, 3)
    normals = np.array(mesh.GetNormalsAttr().Get())
    must(mesh.GetNormalsInterpolation() == "uniform" and len(normals) == len(corners), "USD: normals by face")
    wanted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    must(np.allclose(normals, wanted / np.linalg.norm(wanted, axis=1)[:, None], atol=1e-6), "USD: normals")
    # The picture's right and upper sides as seen from in front: y is up, on level faces -z is.
    up = np.where(np.abs(normals[:, 1:2]) > 0.5, [[0.0, 0.0, -1.0]], [[0.0, 1.0, 0.0]])
    right = np.cross(np.where(np.abs(normals[:, 1:2]) > 0.5, [[0.0, 1.0, 0.0]], up), normals)
    right = np.where(np.abs(normals[:, 1:2]) > 0.5, normals[:, 1:2] * [[1.0, 0.0, 0.0]], right)
    # A picture of 2 by 1 texels is half as high as wide.
    wanted = np.stack([np.einsum("fcx,fx->fc", corners, right) / 0.5, np.einsum("fcx,fx->fc", corners, up) / 0.25], axis=2)
    found = np.array(places.Get()).reshape(-1, 3, 2)

    def off(wanted):
        gap = found - wanted
        return np.abs(gap - np.round(gap)).max()

    must(off(wanted) < 1e-5, f"USD: texture coordinates are off by {off(wanted)}")
    must(off(wanted * [-1.0, 1.0]) > 0.1, "the control: mirrored texture coordinates")
    sun = UsdLux.DistantLight(stage.GetPrimAtPath("/pool_1/lights/sun"))
    matrix = UsdGeom.Xformable(sun.GetPrim()).ComputeLocalToWorldTransform(1)
    shines = np.array(matrix.TransformDir(Gf.Vec3d(0, 0, -1)))
    azimuth, elevation = np.radians(25.0), np.radians(45.0)
    wanted = -np.array([np.cos(elevation) * np.cos(azimuth), np.sin(elevation), np.cos(elevation) * np.sin(azimuth)])
    must(np.allclose(shines, wanted, atol=1e-9), f"USD: the sun shines along {shines}")
    must(abs(np.linalg.det(np.array(matrix)) - 1) < 1e-9, "USD: the sun is mirrored or scaled")
    # White level ground has radiance 1 under that sun and sky, 0.82 of it by the sun.
    light = sun.GetIntensityAttr().Get() * np.array(sun.GetColorAttr().Get())
    share = np.dot(light, [0.2126, 0.7152, 0.0722]) * np.sin(elevation) / np.pi
    must(sun.GetNormalizeAttr().Get() and abs(share - 0.82) < 1e-3, f"USD: the sun gives {share}")
    sky = UsdLux.DomeLight(stage.GetPrimAtPath("/pool_1/lights/sky"))
    file = sky.GetTextureFileAttr().Get()
    must(Path(file.resolvedPath).is_file() and sky.GetTextureFormatAttr().Get() == "latlong", f"USD: {file}")


def write_rig(path):
    """A camera of OpenUSD's own, in centimetres with z up: a rig that turns, a lens that is focused, a film that is shifted."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.SetTimeCodesPerSecond(24)
    rig = UsdGeom.Xform.Define(stage, "/rig")
    rig.AddTranslateOp().Set(Gf.Vec3d(-200, -220, 180))
    turn = rig.AddRotateZOp()
    camera = UsdGeom.Camera.Define(stage, "/rig/camera")
    camera.AddRotateXYZOp().Set(Gf.Vec3f(72, 5, -40))
    camera.CreateHorizontalApertureAttr(36)
    camera.CreateVerticalApertureAttr(20.25)
    camera.CreateFStopAttr(2.8)
    for frame, value in ((1, 0.0), (3, 1.0)):
        turn.Set(6 * value, frame)
        for make, at, way in (
            (camera.CreateFocalLengthAttr, 30, 5),
            (camera.CreateFocusDistanceAttr, 350, -80),
            (camera.CreateHorizontalApertureOffsetAttr, 3, -4.5),
            (camera.CreateVerticalApertureOffsetAttr, -2, 1.25),
        ):
            make().Set(at + way * value, frame)
    stage.GetRootLayer().Save()


def check_rig(theirs, stage):
    """What swell made of a camera of OpenUSD's, by both frustums, in metres with y up."""
    rig = UsdGeom.Camera(theirs.GetPrimAtPath("/rig/camera"))
    ours = UsdGeom.Camera(stage.GetPrimAtPath("/pool_1/camera"))
    for frame in FRAMES:
        camera, wanted = ours.GetCamera(frame), rig.GetCamera(frame)
        must(abs(camera.fStop - wanted.fStop) < 1e-6, "USD camera: its f-number")
        must(abs(camera.focusDistance - 0.01 * wanted.focusDistance) < 1e-5, f"USD camera: focus {camera.focusDistance}")
        places = []
        for of, point in ((camera, Gf.Vec3d(0.6, 0.4, 0.3)), (wanted, Gf.Vec3d(60, -30, 40))):
            view = of.frustum.ComputeViewMatrix() * of.frustum.ComputeProjectionMatrix()
            places.append(view.Transform(point)[:2])
        must(np.allclose(*places, atol=1e-5), f"USD camera: at frame {frame} a point is at {places[0]}, not at {places[1]}")
    # The control: the shift of another frame is seen.
    must(not np.allclose(ours.GetCamera(1).frustum.window.min, ours.GetCamera(3).frustum.window.min, atol=1e-2), "the control: no shift")


def check_mesh_shot(stage, room):
    """The mesh of a shot against the PLY of its frame."""
    water = UsdGeom.Mesh(stage.GetPrimAtPath("/pool_1/water"))
    for frame in FRAMES:
        vertex = PlyData.read(room / f"m.{frame:04}.ply")["vertex"].data
        points = np.stack([vertex[c] for c in "xyz"], axis=1)
        must(np.array_equal(np.array(water.GetPointsAttr().Get(frame)), points), "USD: the mesh's points")
        triangles = np.array(water.GetFaceVertexIndicesAttr().Get(frame)).reshape(-1, 3)
        must(is_closed(triangles), "USD: the mesh is open")
        speed = np.stack([vertex[c] for c in ("vx", "vy", "vz")], axis=1)
        must(np.array_equal(np.array(water.GetVelocitiesAttr().Get(frame)), speed), "USD: the mesh's velocities")


def foam_at(row, wall, places, normals):
    """Coverage and mean age at vertices, from all discs and their images in the six walls, one of which a wave maker moves."""
    foam = row[row["kind"] == 1]
    disc = np.stack([foam[c] for c in "xyz"], axis=1).astype(np.float64)
    area, age = np.pi * foam["radius"].astype(np.float64) ** 2, foam["age"].astype(np.float64)
    mirrored = np.zeros_like(disc)
    radius = 2 * SPACING
    for axis in range(3):
        images = [(disc, area, age, mirrored)]
        low = wall if axis == 0 else 0.0
        for side, near in ((low, disc[:, axis] < low + radius), (SIZE[axis], disc[:, axis] > SIZE[axis] - radius)):
            image, across = disc[near].copy(), mirrored[near].copy()
            image[:, axis] = 2 * side - image[:, axis]
            across[:, axis] = 1.0
            images.append((image, area[near], age[near], across))
        disc, area, age, mirrored = (np.concatenate(parts) for parts in zip(*images))
    covers, ages = [], []
    for place, normal in zip(places.astype(np.float64), normals.astype(np.float64)):
        way = (disc - place) / radius
        off = way @ normal
        flat = np.maximum(1 - (np.einsum("ij,ij->i", way, way) - off**2), 0)
        near = np.clip(2 * np.abs(off) - 1, 0, 1)
        weight = area * flat**2 * (1 - near**2 * (3 - 2 * near)) * np.prod(1 - mirrored * normal**2, axis=1)
        covers.append(-np.expm1(-weight.sum() * 3 / (np.pi * radius**2)))
        ages.append((weight * age).sum() / weight.sum() if weight.sum() > 0 else 0)
    return np.array(covers), np.array(ages)


def check_foam(stage, room):
    """Foam on a mesh, as plyfile and OpenUSD read it, against sums over the stream's own frames."""
    water = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/pool_1/water"))
    maker = UsdGeom.Xformable(stage.GetPrimAtPath("/pool_1/wave_makers/wall_minus_x"))
    for frame in FRAMES:
        wall = maker.ComputeLocalToWorldTransform(frame).ExtractTranslation()[0]
        row = PlyData.read(room / f"cache/whitewater/white/frames/pool-1.{frame:04}.ply")["vertex"].data
        vertex = PlyData.read(room / f"foam.{frame:04}.ply")["vertex"].data
        plain = PlyData.read(room / f"m.{frame:04}.ply")["vertex"].data
        must(all(np.array_equal(plain[c], vertex[c]) for c in plain.dtype.names), "PLY: foam changes other values")
        places, normals = (np.stack([vertex[c] for c in names], axis=1) for names in (("x", "y", "z"), ("nx", "ny", "nz")))
        cover, age = foam_at(row, wall, places, normals)
        # Both are rounded to 32 bits, and the discs' positions are.
        must(np.allclose(vertex["foam"], cover, atol=1e-6), f"frame {frame}: coverage")
        # Where hardly a disc is within reach, rounding decides which.
        many = cover > 1e-6
        must(np.allclose(vertex["foam_age"][many], age[many], atol=1e-5), f"frame {frame}: age")
        for name in ("foam", "foam_age"):
            primvar = water.GetPrimvar(name)
            must(primvar.GetInterpolation() == "vertex", f"USD: interpolation of {name}")
            must(np.array_equal(np.array(primvar.Get(frame)), vertex[name]), f"USD: {name}")
    must(cover.max() > 0.1 and cover.min() == 0.0, f"the last frame has foam of {cover.max()} at most")
    twice = np.concatenate([row, row])
    must(not np.allclose(vertex["foam"], foam_at(twice, wall, places, normals)[0], atol=1e-3), "the control: twice the foam")


def check_whitewater(stage, room):
    """A stream's points beside the water against the stream's own frames."""
    check_points(stage, room)
    white = UsdGeom.Points(stage.GetPrimAtPath("/pool_1/whitewater"))
    for frame in FRAMES:
        row = PlyData.read(room / f"cache/whitewater/white/frames/pool-1.{frame:04}.ply")["vertex"].data
        row = row[row["kind"] != 2]
        points = np.stack([row[c] for c in "xyz"], axis=1)
        must(len(points) > 10 and np.array_equal(np.array(white.GetPointsAttr().Get(frame)), points), "USD: whitewater")
        must(np.array_equal(np.array(white.GetWidthsAttr().Get(frame)), 2 * row["radius"]), "USD: widths of whitewater")
        age = UsdGeom.PrimvarsAPI(white).GetPrimvar("age").Get(frame)
        must(np.array_equal(np.array(age), row["age"]), "USD: ages of whitewater")
    must(not np.array_equal(np.array(white.GetPointsAttr().Get(2)), points), "the control: another frame")


def main(swell):
    """Exports, reads, compares."""
    with tempfile.TemporaryDirectory() as folder:
        room = Path(folder)
        (room / "pool.toml").write_text(SCENE)
        (room / "pier.obj").write_text(PIER)
        (room / "look.toml").write_text(LOOK)
        write_texture(room / "two.png")

        def run(*words):
            subprocess.run([swell, *words], cwd=room, check=True, stdout=subprocess.DEVNULL)

        run("bake", "pool.toml", "-o", "cache", "--progress", "none")
        run(
            *("export", "cache", "--npy", "p.%04d.npy", "--csv", "p.%04d.csv", "--mesh", "m.%04d.ply"),
            *("--usd", "shot.usda", "--look", "look.toml"),
        )
        (room / "white.toml").write_text(WHITE)
        run("whitewater", "cache", "--settings", "white.toml", "--progress", "none")
        run("export", "cache", "--mesh", "foam.%04d.ply", "--usd", "foam.usda", "--usd-water", "mesh", "--foam", "white")
        run("export", "cache", "--usd", "both.usda", "--usd-whitewater", "white", "--kinds", "spray,foam")
        run("export", "cache", "--mesh", "m.%04d.obj", "--usd", "mesh@@@2@.usd", "--usd-water", "mesh")
        run("export", "cache", "--usd", "binary.usdc", "--look", "look.toml", "--python", sys.executable)
        run("wet", "cache", "--within", "0.4", "--progress", "none")
        run("export", "cache", "--usd", "wet.usda", "--wet", "default")
        write_rig(room / "rig.usda")
        (room / "rig.toml").write_text(RIG)
        run("export", "cache", "--usd", "by_rig.usda", "--look", "rig.toml")
        check_rig(Usd.Stage.Open(str(room / "rig.usda")), Usd.Stage.Open(str(room / "by_rig.usda")))
        check_tables(room)
        check_meshes(room)
        for name in ("shot.usda", "binary.usdc"):
            stage = Usd.Stage.Open(str(room / name))
            must(messages(stage) == [], f"{name}: OpenUSD says {messages(stage)}")
            check_points(stage, room)
            check_set(stage)
            check_camera(stage)
            check_look(stage, room)
        stage = Usd.Stage.Open(str(room / "wet.usda"))
        must(messages(stage) == [], f"wet.usda: OpenUSD says {messages(stage)}")
        check_wet(stage, room)
        stage = Usd.Stage.Open(str(room / "mesh@@@2@.usd"))
        must(messages(stage) == [], f"mesh@@@2@.usd: OpenUSD says {messages(stage)}")
        check_mesh_shot(stage, room)
        stage = Usd.Stage.Open(str(room / "foam.usda"))
        must(messages(stage) == [], f"foam.usda: OpenUSD says {messages(stage)}")
        check_foam(stage, room)
        stage = Usd.Stage.Open(str(room / "both.usda"))
        must(messages(stage) == [], f"both.usda: OpenUSD says {messages(stage)}")
        check_whitewater(stage, room)
        for name in ("shot.0002.usda", "shot.manifest.usda", "wet.0002.usda", "wet.manifest.usda", "mesh@@@2@.0003.usd", "foam.0003.usda", "binary.0001.usdc"):
            stage = Usd.Stage.Open(str(room / name))
            must(messages(stage) == [], f"{name}: OpenUSD says {messages(stage)}")
        must(Sdf.Layer.FindOrOpen(str(room / "binary.0001.usdc")).GetFileFormat().formatId == "usdc", "binary USD is text")
        # The control: the validators see what is not there.
        text = (room / "shot.0002.usda").read_text()
        spoiled = room / "spoiled.usda"
        spoiled.write_text(text.replace("    metersPerUnit = 1\n", "").replace('    defaultPrim = "pool_1"\n', ""))
        must(messages(Usd.Stage.Open(str(spoiled))) != [], "the control: no message of a layer without units")
    versions = f"OpenUSD {'.'.join(map(str, Usd.GetVersion()))}, meshio {meshio.__version__}, numpy {np.__version__}"
    print(f"export readers: all is as it should be ({versions}, Python {sys.version.split()[0]})")


main(str(Path(sys.argv[1]).resolve()))
