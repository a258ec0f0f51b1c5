"""What OpenEXR and OpenImageIO read of EXRs that swell wrote, against what the looks asked for. See tools/lib/exr-readers."""

import json
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR
import OpenImageIO as oiio

from pier import PIER

SCENE = """
[shot]
name = "pool"
frames = 2
frames_per_second = 24
[domain]
min = [0.0, 0.0, 0.0]
max = [2.0, 2.0, 1.0]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.8, 1.0, 1.0]
[[solid]]
mesh = "pier.obj"
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
"""

WIDTH, HEIGHT, OVER = 96, 54, 7
LIGHTS = ["reflection", "refraction", "scattering", "sun", "sky", "spray", "solids"]
OBJECTS = ["ground", "pier", "spray", "walls", "water"]

LOOK = """
[camera]
focal_length_mm = 30.0
position = [-2.0, 1.8, 2.2]
target = [1.0, 0.5, 0.5]
[image]
width = {width}
height = {height}
samples = 2
{image}
[water]
spray = {{ density_per_metre = 9.0, speed_m_per_s = 1.0 }}
[basin]
height_m = 0.4
[sky]
model = "hosek_wilkie"
[output]
formats = ["exr", "png"]
{output}
"""

ALL = """
aovs = ["Z", "N", "P", "forward", "thickness"]
colour_space = "acescg"
cryptomatte = true
lights = {lights}
"""

# Rec. 709 to ACEScg by Bradford, as OpenColorIO's built-in ACES configurations have it.
TO_ACESCG = np.array(
    [[0.613097, 0.339523, 0.047379], [0.070194, 0.916354, 0.013452], [0.020616, 0.109570, 0.869815]]
)
REC_709 = [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290]
ACESCG = [0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767]
# Half a step of a half's eleven bits.
HALF = 2.0**-11

failures = []


def check(holds, what):
    """Notes what does not hold."""
    if not holds:
        failures.append(what)
        print(f"FAILED: {what}")


def murmur3(data):
    """MurmurHash3_x86_32 with seed 0, from its author's description and not from swell's code."""
    mask = 0xFFFFFFFF

    def rotated(x, by):
        return (x << by | x >> (32 - by)) & mask

    def mixed(k):
        return rotated(k * 0xCC9E2D51 & mask, 15) * 0x1B873593 & mask

    h, whole = 0, len(data) // 4 * 4
    for i in range(0, whole, 4):
        h = (rotated(h ^ mixed(int.from_bytes(data[i : i + 4], "little")), 13) * 5 + 0xE6546B64) & mask
    h ^= mixed(int.from_bytes(data[whole:], "little")) ^ len(data)
    for shift, factor in [(16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)]:
        h = (h ^ h >> shift) * factor & mask
    return h


def id_bits(name):
    """As the Cryptomatte specification makes an id of a hash."""
    h = murmur3(name.encode())
    return h ^ 1 << 23 if h >> 23 & 255 in (0, 255) else h


def numbers(value):
    """A header's value as a flat list of numbers."""
    return [float(x) for x in np.asarray(value, dtype=float).ravel()]


def windows_of(header):
    """Display and data window, each as least and greatest pixel."""
    return [[list(map(int, corner)) for corner in header[name]] for name in ("displayWindow", "dataWindow")]


class Picture:
    """One EXR by both readers."""

    def __init__(self, path):
        self.path = path
        file = OpenEXR.File(str(path), separate_channels=True)
        self.header = file.header()
        self.channels = {name: channel.pixels for name, channel in file.channels().items()}
        self.agrees()

    def agrees(self):
        """Whether OpenImageIO finds the same."""
        name = self.path.name
        image = oiio.ImageInput.open(str(self.path))
        check(image is not None, f"{name}: OpenImageIO opens it: {oiio.geterror()}")
        spec = image.spec()
        check(set(spec.channelnames) == set(self.channels), f"{name}: channels of OpenImageIO: {spec.channelnames}")
        kinds = dict(zip(spec.channelnames, map(str, spec.channelformats or [spec.format] * spec.nchannels)))
        for k, channel in enumerate(spec.channelnames):
            found = image.read_image(0, 0, k, k + 1, oiio.FLOAT)[:, :, 0]
            ours = self.channels[channel]
            kind = "half" if ours.dtype == np.float16 else "float"
            check(kinds[channel] == kind, f"{name}: {channel} is {kinds[channel]} and {kind}")
            check(np.array_equal(found, ours.astype(np.float32)), f"{name}: {channel} is the same to both")
        display, data = windows_of(self.header)
        check([[spec.full_x, spec.full_y], [spec.full_x + spec.full_width - 1, spec.full_y + spec.full_height - 1]]
              == display, f"{name}: display window of OpenImageIO")
        check([[spec.x, spec.y], [spec.x + spec.width - 1, spec.y + spec.height - 1]] == data,
              f"{name}: data window of OpenImageIO")
        texts = ["shot", "software", "swell:cache_hash", "swell:look_hash", "swell:scene_hash", "frame"]
        for attribute in [*texts, *(key for key in self.header if key.startswith("cryptomatte/"))]:
            # OpenImageIO keeps the names of attributes that it does not know.
            found = spec.getattribute(attribute)
            check(found == self.header[attribute], f"{name}: {attribute} is {found} and {self.header[attribute]}")
        for attribute in ["worldToCamera", "worldToNDC", "chromaticities", "whiteLuminance"]:
            found = numbers(spec.getattribute(attribute))
            check(found == numbers(self.header[attribute]), f"{name}: {attribute} is the same to both")
        image.close()

    def light(self, layer=""):
        """Red, green and blue of the picture or of a layer."""
        names = [f"{layer}.{c}" if layer else c for c in "RGB"]
        return np.stack([self.channels[name].astype(np.float64) for name in names], axis=-1)


def rendered(room, swell, name, image, output):
    """Frame 2 of the pool with a look."""
    look = room / f"{name}.toml"
    look.write_text(LOOK.format(width=WIDTH, height=HEIGHT, image=image, output=output))
    subprocess.run(
        [swell, "render", room / "cache", "--look", look, "--frames", "2", "-o", room / name, "--progress", "json"],
        check=True, stdout=subprocess.DEVNULL,
    )
    return Picture(room / name / "pool.0002.exr")


def check_header(full, plain, room):
    """Attributes and windows."""
    for picture, space in [(full, ACESCG), (plain, REC_709)]:
        header = picture.header
        check(np.allclose(numbers(header["chromaticities"]), space, atol=1e-6), f"{picture.path}: chromaticities")
        check(header["frame"] == 2 and header["shot"] == "pool", f"{picture.path}: frame and shot")
        check(header["framesPerSecond"] == 24, f"{picture.path}: frames a second")
        check(20e3 < header["whiteLuminance"] < 27e3, f"{picture.path}: whiteLuminance {header['whiteLuminance']}")
        record = json.loads((picture.path.parent / "render.json").read_text())
        for key in ["look_hash", "scene_hash"]:
            check(header[f"swell:{key}"] == record[key], f"{picture.path}: {key}")
    shown = [[0, 0], [WIDTH - 1, HEIGHT - 1]]
    wide = [[-OVER, -OVER], [WIDTH - 1 + OVER, HEIGHT - 1 + OVER]]
    check(windows_of(plain.header) == [shown, shown], "windows of the plain picture")
    check(windows_of(full.header) == [shown, wide], "windows with overscan")
    check(numbers(full.header["worldToNDC"]) == numbers(plain.header["worldToNDC"]), "overscan leaves the camera as it is")


def check_camera(full):
    """Places in the world, through the header's matrix, are at their pixels of the display window."""
    p = np.stack([full.channels[f"P.{axis}"] for axis in "XYZ"], axis=-1).astype(np.float64)
    seen = full.channels["Z"] < 1e29
    matrix = np.array(numbers(full.header["worldToNDC"])).reshape(4, 4)

    def off(matrix):
        at = np.concatenate([p, np.ones_like(p[..., :1])], axis=-1) @ matrix
        at = at[..., :2] / at[..., 3:] * [WIDTH, HEIGHT]
        rows, columns = np.indices(seen.shape)
        return np.abs(at - np.stack([columns, rows], axis=-1) - 0.5 + OVER)[seen].max()

    # The far ground is known to 24 bits of hundreds of metres.
    check(off(matrix) < 0.01, f"places are {off(matrix)} pixels from where the camera puts them")
    check(off(matrix * 1.01) < 0.01 and off(matrix @ np.diag([1.01, 1, 1, 1])) > 0.1, "the control of places")


def check_light(full, plain):
    """Parts add up, and ACEScg is Rec. 709 by the published matrix."""
    whole = full.light()
    parts = [full.light(light) for light in LIGHTS]
    allowed = sum(np.abs(part) for part in parts) * HALF + np.abs(whole) * HALF + (len(parts) + 1) * 2.0**-25
    check((np.abs(sum(parts) - whole) <= allowed).all(), "layers of light add up to the picture")
    check((np.abs(sum(parts[1:]) - whole) > allowed).any(), "the control: without one they do not")
    inside = whole[OVER:-OVER, OVER:-OVER]
    source = plain.light()
    # A mirrored ray and the smoothing reach past the frame's edge: with splats the middle alone is the same.
    middle = np.s_[HEIGHT // 4 : -HEIGHT // 4, WIDTH // 4 : -WIDTH // 4]
    expected = source @ TO_ACESCG.T
    close = np.abs(inside - expected)[middle] <= 3 * HALF * expected.max(axis=-1, keepdims=True)[middle]
    check(close.mean() > 0.99, f"ACEScg is Rec. 709 by the published matrix at {close.mean():.4f} of the pixels")
    raw = np.abs(inside - source)[middle] <= 3 * HALF * expected.max(axis=-1, keepdims=True)[middle]
    check(raw.mean() < 0.5, "the control: it is not Rec. 709")


def check_mattes(full):
    """Key, manifest, ids and coverages."""
    key = f"cryptomatte/{id_bits('CryptoObject'):08x}"[:-1]
    header = full.header
    check(header[f"{key}/name"] == "CryptoObject", "name of the mattes")
    check(header[f"{key}/hash"] == "MurmurHash3_32", "hash of the mattes")
    check(header[f"{key}/conversion"] == "uint32_to_float32", "conversion of the mattes")
    manifest = json.loads(header[f"{key}/manifest"])
    check(manifest == {name: f"{id_bits(name):08x}" for name in OBJECTS}, f"manifest {manifest}")
    pairs = [(f"CryptoObject{k:02}.{a}", f"CryptoObject{k:02}.{b}") for k in range(3) for a, b in ["RG", "BA"]]
    known = {struct.unpack("<f", struct.pack("<I", id_bits(name)))[0] for name in OBJECTS}
    total, last = 0.0, np.inf
    for ids, covers in pairs:
        ids, cover = full.channels[ids], full.channels[covers]
        check(set(np.unique(ids[cover > 0]).tolist()) <= known, f"ids of {covers}")
        check((cover <= last).all(), f"{covers} is no larger than the rank before")
        total, last = total + cover.astype(np.float64), cover
    sky = full.channels["Z"] > 1e29
    check((total <= 1 + 1e-6).all(), "no pixel is covered twice")
    far = sky[1:-1, 1:-1] & sky[:-2, 1:-1] & sky[2:, 1:-1]
    near = ~(sky[1:-1, 1:-1] | sky[:-2, 1:-1] | sky[2:, 1:-1] | sky[1:-1, :-2] | sky[1:-1, 2:])
    check(np.abs(total[1:-1, 1:-1] - 1)[near].max() < 1e-6, "without sky coverages add up to one")
    check(near.sum() > 1000, f"pixels without sky: {near.sum()}")
    check(murmur3(b"hello") == 0x248BFA47, "the hash's own vector")


def main(swell):
    """Bakes, renders, reads."""
    with tempfile.TemporaryDirectory() as folder:
        room = Path(folder)
        (room / "pool.toml").write_text(SCENE)
        (room / "pier.obj").write_text(PIER)
        subprocess.run([swell, "bake", room / "pool.toml", "-o", room / "cache", "--progress", "json"],
                       check=True, stdout=subprocess.DEVNULL)
        everything = ALL.format(lights=json.dumps(LIGHTS))
        full = rendered(room, swell, "full", f"overscan = {OVER}", everything)
        plain = rendered(room, swell, "plain", "", "")
        part = rendered(room, swell, "part", "crop = [20, 10, 60, 40]", 'solids = "holdout"\naovs = ["Z"]')
        names = {*"RGBA", "Z", "forward.u", "forward.v", "thickness.Y"}
        names |= {f"{layer}.{axis}" for layer in "NP" for axis in "XYZ"}
        names |= {f"{light}.{c}" for light in LIGHTS for c in "RGB"}
        names |= {f"CryptoObject{k:02}.{c}" for k in range(3) for c in "RGBA"}
        check(set(full.channels) == names, f"channels: {sorted(set(full.channels) ^ names)} are on one side alone")
        check(set(plain.channels) == set("RGBA"), f"channels of the plain picture: {sorted(plain.channels)}")
        check_header(full, plain, room)
        check_camera(full)
        check_light(full, plain)
        check_mattes(full)
        check(windows_of(part.header) == [[[0, 0], [WIDTH - 1, HEIGHT - 1]], [[20, 10], [59, 39]]], "windows of a crop")
        alpha = part.channels["A"].astype(np.float64)
        check(((alpha >= 0) & (alpha <= 1)).all() and (alpha == 0).any() and (alpha == 1).any(), "coverage of a hold-out")
        check((part.light()[alpha == 0] == 0).all(), "what is held out is black")
    if failures:
        sys.exit(f"{len(failures)} of what readers find is not as it should be")
    print("exr readers: OpenEXR", OpenEXR.__version__, "and OpenImageIO", oiio.VERSION_STRING, "read all that was written")


main(sys.argv[1])
