"""What the scenes count on in each file."""

import itertools
import math

from . import BrokenMesh
from .breakwater import CREST, END, FLOOR, HALF_CREST, SLOPE, START
from .check import box, check_solids
from . import quay
from .city import ALLEY, BLOCKS_X, BLOCKS_Z, CITY_X, CITY_Z, CROSS_STREET, FOOTPRINTS, HEIGHTS
from .obj import from_obj

MAX_TRIANGLES = 6_000
MAX_BYTES = 1_000_000


def plan_gap(a, b):
    """Distance between two boxes seen from above."""
    apart = [max(a[0][k] - b[1][k], b[0][k] - a[1][k], 0.0) for k in (0, 2)]
    return math.hypot(*apart)


def check_city(text):
    """Refuses a city that is not what the scenes count on; returns a line about it."""
    vertices, triangles = from_obj(text)
    found = check_solids(vertices, triangles)
    boxes = [extent for extent, _ in found]

    def demand(holds, words):
        if not holds:
            raise BrokenMesh(f"city: {words}")

    low, high = box(vertices)
    demand(45 <= len(found) <= 70, f"{len(found)} buildings")
    demand(len(triangles) <= MAX_TRIANGLES, f"{len(triangles)} triangles")
    demand(len(text.encode()) < MAX_BYTES, f"{len(text.encode())} bytes")
    demand(low[0] >= CITY_X[0] and high[0] <= CITY_X[1], f"x from {low[0]} to {high[0]}")
    demand(low[2] >= CITY_Z[0] and high[2] <= CITY_Z[1], f"z from {low[2]} to {high[2]}")
    for extent in boxes:
        demand(extent[0][1] == 0, f"a building off the ground at {extent[0]}")
        demand(HEIGHTS[0] <= extent[1][1] <= HEIGHTS[1], f"a height of {extent[1][1]}")
        for k in (0, 2):
            width = extent[1][k] - extent[0][k]
            demand(FOOTPRINTS[0] - 1e-4 <= width <= FOOTPRINTS[1], f"a footprint of {width} at {extent[0]}")
    for a, b in itertools.combinations(boxes, 2):
        demand(plan_gap(a, b) >= ALLEY - 2e-4, f"an alley of {plan_gap(a, b)} at {a[0]}")
    for blocks, axis, least in ((BLOCKS_X, 0, CROSS_STREET), (BLOCKS_Z, 2, 0.7)):
        for (_, start), (end, _) in itertools.pairwise(blocks):
            demand(end - start >= least - 1e-9, f"a street of {end - start}")
            for extent in boxes:
                free = extent[1][axis] <= start + 1e-4 or extent[0][axis] >= end - 1e-4
                demand(free, f"a building in the street at {extent[0]}")
    return (
        f"{len(found)} buildings, {len(triangles)} triangles, {len(text.encode())} bytes, "
        f"{sum(inside for _, inside in found):.1f} m³, highest {high[1]:.2f} m"
    )


def check_beach(text):
    """Refuses a beach without the slope it promises; returns a line about it."""
    vertices, triangles = from_obj(text)
    [(extent, inside)] = check_solids(vertices, triangles)
    expected = (20.2 - 11.2) * (2.05 + 0.2) / 2 * 3.4
    if abs(inside - expected) > 1e-3:
        raise BrokenMesh(f"beach: {inside} m³ and not {expected}")
    if extent != ((11.2, -0.2, -0.2), (20.2, 2.05, 3.2)):
        raise BrokenMesh(f"beach: reaches {extent}")
    return f"{len(triangles)} triangles, {len(text.encode())} bytes, {inside:.2f} m³"


def check_crate(text):
    """Refuses a crate that is not a cube of edge 1 but for its edges; returns a line about it."""
    vertices, triangles = from_obj(text)
    [(extent, inside)] = check_solids(vertices, triangles)
    # An edge loses half the square of its chamfer.
    if not 0.99 < inside < 1:
        raise BrokenMesh(f"crate: {inside} m³")
    if any(abs(abs(side) - 0.5) > 1e-9 for corner in extent for side in corner):
        raise BrokenMesh(f"crate: reaches {extent}")
    return f"{len(triangles)} triangles, {len(text.encode())} bytes, {inside:.3f} m³"


def check_boat(text):
    """Refuses a boat whose sides differ; returns a line about it."""
    vertices, triangles = from_obj(text)
    [(extent, inside)] = check_solids(vertices, triangles)
    if any(not any((x, y, -z) == other for other in vertices) for x, y, z in vertices):
        raise BrokenMesh("boat: its sides differ")
    if extent[0][1] != 0 or not 5 < extent[1][0] - extent[0][0] < 6:
        raise BrokenMesh(f"boat: reaches {extent}")
    return f"{len(triangles)} triangles, {len(text.encode())} bytes, {inside:.2f} m³"


def check_drop(text):
    """Refuses a drop that is not about as large as its sphere; returns a line about it."""
    vertices, triangles = from_obj(text)
    [(extent, inside)] = check_solids(vertices, triangles)
    # An inscribed polyhedron of 1280 triangles holds less than the sphere, by about a hundredth.
    if not 0.98 < inside / (4 / 3 * math.pi) < 1:
        raise BrokenMesh(f"drop: {inside} m³")
    if any(abs(abs(side) - 1) > 1e-2 for corner in extent for side in corner):
        raise BrokenMesh(f"drop: reaches {extent}")
    return f"{len(triangles)} triangles, {len(text.encode())} bytes, {inside:.2f} m³"


def check_breakwater(text):
    """Refuses a breakwater that is not about as large as its plain mound; returns a line about it."""
    vertices, triangles = from_obj(text)
    [(extent, inside)] = check_solids(vertices, triangles)
    rise = CREST - FLOOR
    reach = HALF_CREST + SLOPE * rise
    # A prism of the profile, and half of a cone without its tip.
    prism = rise * (HALF_CREST + reach) * (END - START)
    head = math.pi * rise / 6 * (HALF_CREST**2 + HALF_CREST * reach + reach**2)
    if abs(inside / (prism + head) - 1) > 0.02:
        raise BrokenMesh(f"breakwater: {inside} m³ and not {prism + head}")
    if extent[0][1] != FLOOR or not CREST <= extent[1][1] <= CREST + 0.1:
        raise BrokenMesh(f"breakwater: reaches {extent}")
    return f"{len(triangles)} triangles, {len(text.encode())} bytes, {inside:.2f} m³"


def check_harbour(text):
    """Refuses a harbour whose culvert is not free; returns a line about it."""
    vertices, triangles = from_obj(text)
    found = check_solids(vertices, triangles)

    def area(low, high):
        return (high[0] - low[0]) * (high[1] - low[1])

    wall = area((quay.ENDS[0], quay.FLOOR), (quay.ENDS[1], quay.TOP))
    hole = area((quay.CULVERT_Z[0], quay.CULVERT_Y[0]), (quay.CULVERT_Z[1], quay.CULVERT_Y[1]))
    mole = area((quay.MOLE_X[0], quay.MOLE_Z[0]), (quay.MOLE_X[1], quay.MOLE_Z[1]))
    post = quay.SIDES / 2 * math.sin(2 * math.pi / quay.SIDES) * quay.DOLPHIN_RADIUS**2
    expected = [(wall - hole) * (quay.FRONT - quay.BACK), mole * (quay.MOLE_TOP - quay.FLOOR)]
    expected += [post * (quay.DOLPHIN_TOP - quay.FLOOR)] * len(quay.DOLPHINS)
    volumes = [inside for _, inside in found]
    if len(volumes) != len(expected) or any(abs(a / b - 1) > 1e-3 for a, b in zip(volumes, expected)):
        raise BrokenMesh(f"harbour: {volumes} m³ and not {expected}")
    return f"{len(triangles)} triangles, {len(text.encode())} bytes, {sum(volumes):.2f} m³"
