"""A breakwater of rubble: a mound with a round head, attached to a wall."""

import math

from .building import Mesh

END = 7.0  # of the crest's middle line, which comes from z = -0.3
START = -0.3
CREST = 2.2
FLOOR = -0.2
HALF_CREST = 0.5
SLOPE = 4 / 3  # run over rise
STONE = 0.3


def noise(seed):
    """A number from -1 to 1 (splitmix64)."""
    mask = (1 << 64) - 1
    x = (seed * 0x9E3779B97F4A7C15 + 0x1234567) & mask
    x = ((x ^ x >> 30) * 0xBF58476D1CE4E5B9) & mask
    x = ((x ^ x >> 27) * 0x94D049BB133111EB) & mask
    return (x ^ x >> 31) / 2**63 - 1


def stations():
    """Places about the middle line: where on it, and the direction outward, from the wall round the head and back."""
    count = round((END - START) / STONE)
    along = [START + (END - START) * i / count for i in range(count + 1)]
    head = [math.pi * i / 14 for i in range(1, 14)]
    left = [(z, (-1.0, 0.0)) for z in along]
    right = [(z, (1.0, 0.0)) for z in reversed(along)]
    return left + [(END, (-math.cos(a), math.sin(a))) for a in head] + right


def breakwater():
    """One closed surface; stones stand out of its slopes by up to a tenth of a metre."""
    mesh = Mesh()
    reach = HALF_CREST + SLOPE * (CREST - FLOOR)
    steps = round((reach - HALF_CREST) / STONE)
    rings = [reach - (reach - HALF_CREST) * i / steps for i in range(steps + 1)] + [HALF_CREST / 2]
    around = stations()
    last = len(around) - 1

    def place(ring, station):
        z, (dx, dz) = around[station]
        off = rings[ring]
        y = min(CREST, CREST - (off - HALF_CREST) / SLOPE)
        if ring > 0 and 0 < station < last:
            seed = 3 * (ring * 1000 + station)
            off += 0.08 * noise(seed)
            y += 0.1 * noise(seed + 1)
        return mesh.vertex(off * dx, y, z + off * dz)

    grid = [[place(ring, station) for station in range(last + 1)] for ring in range(len(rings))]
    # On the middle line both sides meet, and all of the head in one point.
    tops, bottoms = {}, {}
    for z, _ in around:
        if z not in tops:
            tops[z] = mesh.vertex(0.0, CREST, z)
            bottoms[z] = mesh.vertex(0.0, FLOOR, z)
    for ring in range(len(rings) - 1):
        low, high = grid[ring], grid[ring + 1]
        for i in range(last):
            mesh.quad(low[i], low[i + 1], high[i + 1], high[i])
    for outer, middle, faces_up in ((grid[-1], tops, True), (grid[0], bottoms, False)):
        for i in range(last):
            a, b = middle[around[i][0]], middle[around[i + 1][0]]
            faces = [(outer[i], outer[i + 1], b)] + ([(outer[i], b, a)] if a != b else [])
            mesh.triangles += faces if faces_up else [(p, r, q) for p, q, r in faces]
    # The face at the wall: everything is seen from the middle of its foot.
    foot = bottoms[START]
    rim = [row[0] for row in grid] + [tops[START]] + [row[last] for row in reversed(grid)]
    mesh.triangles += [(foot, a, b) for a, b in zip(rim, rim[1:])]
    return [mesh]
