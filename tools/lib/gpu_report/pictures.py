"""Steps that render pictures, and look at their pixels."""

import re
import shutil
import struct
import zlib
from functools import partial

from .session import Failure, Step

# Looks of the two methods; both see the quickstart's and wave-city's water.
LOOKS = {"splats": "day", "rays": "crest"}

# Standard deviation of a channel, of 255, below which a picture counts as empty.
LEAST_DEVIATION = 8.0


def steps(small):
    del small  # sizes follow the session
    table = [(f"picture by {method}", 60, partial(render_twice, method)) for method in LOOKS]
    table.append(("control: an empty picture is seen", 5, see_empty_picture))
    return [Step("pictures", *row) for row in table]


def look_of(session, method, size, samples=None):
    """A copy of a method's look with that size."""
    looks = session.work / "looks"
    if not looks.exists():
        shutil.copytree(session.root / "scenes/looks", looks)
    text = (looks / f"{LOOKS[method]}.toml").read_text(encoding="utf-8")
    keys = dict(zip(("width", "height"), size))
    if samples:
        keys["samples"] = samples
    for key, value in keys.items():
        text, count = re.subn(rf"(?m)^{key} *=.*$", f"{key} = {value}", text)
        if count != 1:
            raise Failure(f"scenes/looks/{LOOKS[method]}.toml has not one `{key}`")
    file = looks / f"report-{method}-{size[0]}-{samples or 'as-shipped'}.toml"
    file.write_text(text, encoding="utf-8")
    return file


def render(session, cache, look, frames, *words, **keywords):
    folder = session.new_folder("pictures")
    ran = session.swell(
        *("render", cache, "--look", look, "--frames", frames, "-o", folder),
        *("--progress", "json"),
        *words,
        **keywords,
    )
    return sorted(folder.glob("*.png")), ran


def render_twice(method, session):
    """The last frame after another one and by itself: the same pixels, and not empty."""
    cache, last = session.quickstart("pbf")
    look = look_of(session, method, (160, 90) if session.small else (640, 360))
    after, _ = render(session, cache, look, f"{last - 1}-{last}")
    alone, _ = render(session, cache, look, last)
    if len(after) != 2 or len(alone) != 1:
        raise Failure(f"{len(after)} and {len(alone)} pictures instead of 2 and 1")
    deviation = check_not_empty(*read_png(alone[0].read_bytes()))
    ran = session.swell("diff", after[1], alone[0], codes=(0, 1))
    if ran.code == 1:
        raise Failure("the picture depends on whether another one was rendered before it")
    kept = session.output / f"picture-{method}.png"
    shutil.copyfile(alone[0], kept)
    spread = ", ".join(f"{value:.0f}" for value in deviation)
    return {
        "summary": f"same pixels in a range and alone; deviation {spread} of 255: {kept.name}",
        "deviation": deviation,
    }


def see_empty_picture(session):
    del session
    try:
        check_not_empty(3, bytes(3 * 64))
    except Failure as error:
        return {"summary": f"as it has to: {error}"}
    raise Failure("a black picture passes")


def check_not_empty(channels, pixels):
    """Standard deviation of each colour channel, in parts of 255."""
    deviation = []
    for channel in range(min(channels, 3)):
        values = pixels[channel::channels]
        mean = sum(values) / len(values)
        deviation.append((sum((v - mean) ** 2 for v in values) / len(values)) ** 0.5)
    if max(deviation) < LEAST_DEVIATION:
        raise Failure(f"the picture is empty: deviation {max(deviation):.2f} of 255")
    return deviation


def read_png(data):
    """Channels and pixels of a PNG of 8 bits a channel, not interlaced."""
    at, header, packed = 8, None, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", data[at + 8 : at + 8 + length])
        elif kind == b"IDAT":
            packed += data[at + 8 : at + 8 + length]
        at += 12 + length
    channels = {0: 1, 2: 3, 4: 2, 6: 4}.get(header[3] if header else None)
    if channels is None or header[2] != 8 or header[6] != 0:
        raise Failure("no PNG of 8 bits a channel")
    stride = header[0] * channels
    raw = zlib.decompress(packed)
    rows, above = [], bytearray(stride)
    for y in range(header[1]):
        begin = y * (stride + 1)
        above = unfilter(raw[begin], raw[begin + 1 : begin + 1 + stride], above, channels)
        rows.append(above)
    return channels, b"".join(rows)


def unfilter(kind, line, above, step):
    """A row of a PNG without its filter (PNG specification, section 9)."""
    row = bytearray(line)
    for x in range(len(row)):
        left = row[x - step] if x >= step else 0
        up = above[x]
        if kind == 1:
            row[x] = (row[x] + left) & 255
        elif kind == 2:
            row[x] = (row[x] + up) & 255
        elif kind == 3:
            row[x] = (row[x] + (left + up) // 2) & 255
        elif kind == 4:
            corner = above[x - step] if x >= step else 0
            row[x] = (row[x] + paeth(left, up, corner)) & 255
    return row


def paeth(left, up, corner):
    guess = left + up - corner
    return min((left, up, corner), key=lambda value: abs(guess - value))
