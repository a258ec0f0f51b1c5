"""Small pictures that repeat: concrete, rock, sand and plaster, as PNG of 256 colours.

They are stored without compression, so that no version of zlib writes other bytes.
"""

import struct
import zlib

SIDE = 256


def unit(*numbers):
    """A number in [0, 1) from whole numbers (splitmix64)."""
    mask = (1 << 64) - 1
    x = 0x1234567
    for number in numbers:
        x = (x + (number + 1) * 0x9E3779B97F4A7C15) & mask
        x = ((x ^ x >> 30) * 0xBF58476D1CE4E5B9) & mask
        x = ((x ^ x >> 27) * 0x94D049BB133111EB) & mask
        x ^= x >> 31
    return (x >> 11) / (1 << 53)


def noise(seed, across, down):
    """Value noise that repeats, `across` × `down` cells: a function of texel (x, y), from 0 to 1."""
    grid = [[unit(seed, i, j) for i in range(across)] for j in range(down)]

    def at(x, y):
        u, v = (x + 0.5) / SIDE * across, (y + 0.5) / SIDE * down
        i, j = int(u), int(v)
        s, t = u - i, v - j
        s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
        i, j, k, m = i % across, j % down, (i + 1) % across, (j + 1) % down
        top = grid[j][i] * (1 - s) + grid[j][k] * s
        low = grid[m][i] * (1 - s) + grid[m][k] * s
        return top * (1 - t) + low * t

    return at


def layers(seed, first, count, fade=0.5):
    """A sum of noises, each of cells half as wide, from 0 to 1."""
    parts = [(fade**k, noise(seed + k, first << k, first << k)) for k in range(count)]
    total = sum(weight for weight, _ in parts)
    return lambda x, y: sum(weight * at(x, y) for weight, at in parts) / total


def picture(value):
    """Rows of numbers from 0 to 255."""
    clip = lambda v: max(0, min(255, round(255 * v)))  # noqa: E731
    return [bytes(clip(value(x, y)) for x in range(SIDE)) for y in range(SIDE)]


def concrete():
    """Cast against boards, two panels across and one down, pitted, with run marks."""
    body, stain, run = layers(10, 8, 5), layers(20, 2, 3), noise(30, 64, 2)

    def value(x, y):
        v = 0.34 + 0.34 * body(x, y) + 0.22 * stain(x, y) + 0.16 * run(x, y)
        board = y // 32
        v += 0.10 * (unit(40, board) - 0.5)
        if y % 32 == 0:
            v -= 0.07
        # Joints of the panels: a dark groove beside a light edge.
        for place in (x % 128, y):
            if place < 2:
                v -= 0.28
            elif place < 3:
                v += 0.06
        if unit(41, x // 2, y // 2) < 0.004:
            v -= 0.25
        return v

    return picture(value), ((34, 33, 31), (150, 146, 138), (214, 210, 200))


def rock():
    """Broken stone: steep patches, veins, lichen-light spots."""
    body, vein, grain = layers(50, 8, 5, 0.7), layers(60, 7, 4, 0.6), layers(70, 32, 3)

    def value(x, y):
        ridge = 1 - abs(2 * vein(x, y) - 1)
        v = 0.02 + 0.76 * body(x, y) + 0.26 * grain(x, y)
        return v - 1.6 * max(0.0, ridge - 0.9)

    return picture(value), ((30, 28, 26), (118, 110, 100), (196, 188, 174))


def sand():
    """Fine grain over low ripples."""
    grain, slope, wave = layers(80, 64, 2), layers(90, 4, 4), layers(95, 2, 2)

    def value(x, y):
        bent = (y + 40 * wave(x, y)) / SIDE * 12
        ripple = abs(2 * (bent - int(bent)) - 1)
        return 0.26 + 0.36 * grain(x, y) + 0.22 * slope(x, y) + 0.14 * ripple

    return picture(value), ((92, 76, 54), (196, 172, 132), (232, 214, 178))


def plaster():
    """A rendered wall that has weathered: patches of other tones, run marks, a little unevenness."""
    patch, body, fine, run = layers(130, 4, 3), layers(100, 6, 4), layers(110, 32, 3), noise(120, 48, 2)

    def value(x, y):
        tone = 1.5 * (patch(x, y) - 0.5) + 0.7 * (body(x, y) - 0.5) + 0.22 * (run(x, y) - 0.5)
        return 0.5 + 0.8 * tone + 0.16 * (fine(x, y) - 0.5)

    return picture(value), ((98, 88, 76), (196, 184, 166), (240, 232, 218))


def to_png(rows, colours):
    """A PNG whose palette runs through three colours."""
    palette = b""
    for k in range(256):
        t = 2 * k / 255
        a, b = colours[int(t > 1)], colours[int(t > 1) + 1]
        t -= int(t > 1)
        palette += bytes(round(p * (1 - t) + q * t) for p, q in zip(a, b))
    raw = b"".join(b"\0" + row for row in rows)
    stored = b"\x78\x01"
    for start in range(0, len(raw), 65535):
        part = raw[start : start + 65535]
        stored += struct.pack("<BHH", start + 65535 >= len(raw), len(part), len(part) ^ 0xFFFF) + part
    stored += struct.pack(">I", zlib.adler32(raw))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", SIDE, SIDE, 8, 3, 0, 0, 0)
    chunks = chunk(b"IHDR", head) + chunk(b"PLTE", palette) + chunk(b"IDAT", stored) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + chunks


def textures():
    """Name and bytes of each picture."""
    made = (("concrete", concrete), ("rock", rock), ("sand", sand), ("plaster", plaster))
    return {f"{name}.png": to_png(*make()) for name, make in made}
