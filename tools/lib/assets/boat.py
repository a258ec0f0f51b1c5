"""A fishing boat that floats."""

from .building import Mesh

LENGTH = 5.0
BEAM = 1.9
# How far the keel, else at y = 0, rises at the bow and at the transom.
FOREFOOT, HEEL = 0.35, 0.12
# Of the gunwale amidships; at the bow it is higher.
GUNWALE, SHEER = 1.05, 0.45
# Stations from the transom to the bow, fractions of the length.
STATIONS = [0.0, 0.06, 0.12, 0.18, 0.24, 0.245, 0.249, 0.25, 0.31, 0.37, 0.43, 0.48, 0.483, 0.495, 0.51, 0.56, 0.62, 0.68, 0.74, 0.80, 0.85, 0.90, 0.94, 0.97, 1.0]
# The cabin's roof above the deck, its half width, and how far it is drawn in at the roof.
ROOF, SIDE, LEAN = 0.95, 0.62, 0.1
# Where its walls are glass, fractions of their height.
GLASS = (0.45, 0.85)
# Its height at stations, over the roof's; 0 at those that are not listed.
CABIN = {0.245: GLASS[0], 0.249: GLASS[1], 0.25: 1, 0.31: 1, 0.37: 1, 0.43: 1, 0.48: 1, 0.483: GLASS[1], 0.495: GLASS[0]}
# How far the stem leans forward at the gunwale.
RAKE = 0.5
# Points of a section from the keel to the gunwale.
RIBS = 8


def half_beam(s):
    """At the gunwale."""
    if s < 0.45:
        return BEAM / 2 * (0.84 + 0.16 * (1 - ((0.45 - s) / 0.45) ** 2))
    return BEAM / 2 * max(1 - ((s - 0.45) / 0.55) ** 2.4, 0.02)


def section(s):
    """Half a section at a station, from the keel over gunwale and deck to the middle: (height, half width)."""
    foot = HEEL * max(0.4 - s, 0) / 0.4 + FOREFOOT * max((s - 0.7) / 0.3, 0) ** 2
    top = GUNWALE + SHEER * max((s - 0.3) / 0.7, 0) ** 2
    beam = half_beam(s)
    # Full amidships, flared at the bow.
    full = 0.42 + 0.75 * max((s - 0.45) / 0.55, 0)
    points = []
    for k in range(RIBS + 1):
        t = k / RIBS
        points.append((foot + (top - foot) * t**1.35, beam * max(t**full, 0.02)))
    deck = top + 0.01
    side = min(SIDE, 0.75 * beam)
    for part in (0.0, *GLASS, 1.0):
        up = part * CABIN.get(s, 0)
        points.append((deck + ROOF * up + 0.01 * part, side - LEAN * up if up else side * (1 - 0.1 * part)))
    points.append((points[-1][0] + 0.03, 0.0))
    return points


def boat():
    """A hull with a deck and a cabin as one closed surface: the bow towards +x, the keel at y = 0."""
    mesh = Mesh()
    rings = []
    for s in STATIONS:
        half = section(s)
        low, high = half[0][0], half[RIBS][0]

        def vertex(y, z):
            lean = RAKE * max(s - 0.7, 0) / 0.3 * min((y - low) / (high - low), 1)
            return mesh.vertex(LENGTH * (s - 0.5) + lean, y, z)

        starboard = [vertex(y, z) for y, z in half]
        port = [vertex(y, -z) for y, z in half[-2::-1]]
        rings.append(starboard + port)
    parts = {"bottom": [], "hull": [], "deck": [], "cabin": [], "glass": []}
    count = len(rings[0])

    def part(k, first, last):
        k = min(k, count - 2 - k)
        if k < RIBS:
            return "bottom" if k <= RIBS // 2 else "hull"
        heights = [CABIN.get(STATIONS[i], 0) for i in (first, last)]
        if k == RIBS or not any(heights):
            return "deck"
        is_glass = k == RIBS + 2 if heights == [1, 1] else k > RIBS + 2 and set(heights) == set(GLASS)
        return "glass" if is_glass else "cabin"

    for first in range(len(rings) - 1):
        a, b = rings[first], rings[first + 1]
        for k in range(count - 1):
            parts[part(k, first, first + 1)] += [(a[k], b[k], b[k + 1]), (a[k], b[k + 1], a[k + 1])]
        # Between the two lowest points, on both sides of the keel.
        parts["bottom"] += [(a[-1], b[-1], b[0]), (a[-1], b[0], a[0])]
    for ring, is_bow in ((rings[0], False), (rings[-1], True)):
        for k in range(count // 2):
            quad = (ring[k], ring[k + 1], ring[count - 2 - k], ring[count - 1 - k])
            quad = quad[::-1] if is_bow else quad
            a, b, c, d = quad
            parts["hull"] += [t for t in ((a, b, c), (a, c, d)) if len(set(t)) == 3]
    for name, triangles in parts.items():
        mesh.materials[len(mesh.triangles)] = f"boat_{name}"
        mesh.triangles += triangles
    return [mesh]
