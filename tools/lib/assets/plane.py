"""Plane geometry. Points are (x, z).

An outline is counter-clockwise seen from above (from +y), which is a positive area in (z, x), because
z cross x is +y.
"""

import math

from . import BrokenMesh


def cross(origin, a, b):
    """Twice the area of the triangle, positive when it is counter-clockwise seen from above."""
    return (a[1] - origin[1]) * (b[0] - origin[0]) - (a[0] - origin[0]) * (b[1] - origin[1])


def area(outline):
    """Signed area, positive when counter-clockwise seen from above."""
    pairs = zip(outline, outline[1:] + outline[:1])
    return sum(a[1] * b[0] - a[0] * b[1] for a, b in pairs) / 2


def rectangle(x0, z0, x1, z1):
    """An axis-aligned rectangle, counter-clockwise seen from above."""
    return [(x0, z0), (x0, z1), (x1, z1), (x1, z0)]


def regular(centre, radius, sides):
    """A regular polygon with a flat side towards -x."""
    step = 2 * math.pi / sides
    angles = [math.pi + (i + 0.5) * step for i in range(sides)]
    corners = [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]
    return corners if area(corners) > 0 else corners[::-1]


def chamfered(x0, z0, x1, z1, cut):
    """A rectangle whose four corners are cut off at 45 degrees."""
    return [
        (x0, z0 + cut), (x0, z1 - cut), (x0 + cut, z1), (x1 - cut, z1),
        (x1, z1 - cut), (x1, z0 + cut), (x1 - cut, z0), (x0 + cut, z0),
    ]  # fmt: skip


def inset(outline, distance):
    """The outline moved inward by `distance`; each vertex goes to where its two moved edges meet."""
    moved = []
    for before, here, after in zip(outline[-1:] + outline[:-1], outline, outline[1:] + outline[:1]):
        normals = []
        for a, b in ((before, here), (here, after)):
            dx, dz = b[0] - a[0], b[1] - a[1]
            length = math.hypot(dx, dz)
            normals.append((dz / length, -dx / length))
        (ax, az), (bx, bz) = normals
        scale = distance / (1 + ax * bx + az * bz)
        moved.append((here[0] + scale * (ax + bx), here[1] + scale * (az + bz)))
    return moved


def distance_to_edges(point, outline):
    """The least distance from a point to an outline's edges."""
    best = math.inf
    for a, b in zip(outline, outline[1:] + outline[:1]):
        dx, dz = b[0] - a[0], b[1] - a[1]
        along = ((point[0] - a[0]) * dx + (point[1] - a[1]) * dz) / (dx * dx + dz * dz)
        along = min(1.0, max(0.0, along))
        best = min(best, math.hypot(point[0] - a[0] - along * dx, point[1] - a[1] - along * dz))
    return best


def contains(outline, point):
    """Whether the point lies inside the outline (even-odd rule)."""
    inside = False
    for a, b in zip(outline, outline[1:] + outline[:1]):
        if (a[1] > point[1]) != (b[1] > point[1]):
            if point[0] < a[0] + (point[1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1]):
                inside = not inside
    return inside


def segments_touch(a, b, c, d):
    """Whether two segments without a common end cross or touch."""
    straddles_ab = cross(a, b, c) * cross(a, b, d) <= 1e-12
    straddles_cd = cross(c, d, a) * cross(c, d, b) <= 1e-12
    return straddles_ab and straddles_cd


def triangulate(points, outer, holes):
    """Triangles of a face with holes: holes are tied to the outline by bridges, then ears are cut.

    `points` maps an index to (x, z); `outer` and each of `holes` are loops of indices, all
    counter-clockwise seen from above. Returns index triples, counter-clockwise seen from above.
    """
    boundary = list(outer)
    waiting = [list(reversed(hole)) for hole in holes]
    while waiting:
        loops = [boundary] + waiting
        edges = [e for loop in loops for e in zip(loop, loop[1:] + loop[:1])]
        candidates = sorted(
            (math.dist(points[p], points[q]), which, i, j)
            for which, hole in enumerate(waiting)
            for i, p in enumerate(boundary)
            for j, q in enumerate(hole)
        )
        for _, which, i, j in candidates:
            p, q = boundary[i], waiting[which][j]
            rest = (e for e in edges if p not in e and q not in e)
            if not any(segments_touch(points[p], points[q], points[a], points[b]) for a, b in rest):
                break
        else:
            raise BrokenMesh("a hole that no bridge reaches")
        hole = waiting.pop(which)
        boundary[i + 1 : i + 1] = hole[j:] + hole[: j + 1] + [p]

    triangles = []
    while len(boundary) > 3:
        for k in range(len(boundary)):
            a, b, c = (boundary[(k + step) % len(boundary)] for step in (-1, 0, 1))
            corners = [points[a], points[b], points[c]]
            if cross(*corners) <= 1e-9:
                continue
            others = (points[i] for i in boundary if i not in (a, b, c))
            if not any(in_triangle(corners, other) for other in others):
                break
        else:
            raise BrokenMesh("a face without an ear")
        triangles.append((a, b, c))
        del boundary[k]
    triangles.append(tuple(boundary))
    return triangles


def in_triangle(corners, point):
    """Whether a point lies in a counter-clockwise triangle or on its border."""
    a, b, c = corners
    return min(cross(a, b, point), cross(b, c, point), cross(c, a, point)) >= -1e-12
