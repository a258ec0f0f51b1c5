"""What a mesh has to be, and the proof that the checks notice when it is not."""

import itertools

from . import BrokenMesh
from .building import Tier, building
from .plane import rectangle


def minus(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross3(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def components(triangles):
    """Triangles by connected piece, in order of their first triangle."""
    parent = {}

    def root(i):
        parent.setdefault(i, i)
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for a, b, c in triangles:
        parent[root(b)] = root(a)
        parent[root(c)] = root(a)
    pieces = {}
    for triangle in triangles:
        pieces.setdefault(root(triangle[0]), []).append(triangle)
    return list(pieces.values())


def check_topology(vertices, triangles):
    """Refuses what is not a closed manifold that faces one way."""
    if len(set(vertices)) != len(vertices):
        raise BrokenMesh("two vertices at one place")
    directed = set()
    for a, b, c in triangles:
        normal = cross3(minus(vertices[b], vertices[a]), minus(vertices[c], vertices[a]))
        if dot(normal, normal) < 1e-10:
            raise BrokenMesh(f"a triangle without area at {vertices[a]}")
        for edge in ((a, b), (b, c), (c, a)):
            if edge in directed:
                raise BrokenMesh(f"an edge used twice in one direction at {vertices[edge[0]]}")
            directed.add(edge)
    for a, b in directed:
        if (b, a) not in directed:
            raise BrokenMesh(f"an open edge at {vertices[a]}")
    # Around each vertex the triangles must close into a single fan.
    fans = {}
    for a, b, c in triangles:
        for here, after, before in ((a, b, c), (b, c, a), (c, a, b)):
            fans.setdefault(here, {})[after] = before
    if len(fans) != len(vertices):
        raise BrokenMesh("a vertex that no triangle uses")
    for here, fan in fans.items():
        start = next(iter(fan))
        length, at = 1, fan[start]
        while at != start:
            length, at = length + 1, fan[at]
        if length != len(fan):
            raise BrokenMesh(f"two fans meet at {vertices[here]}")


def volume(vertices, triangles):
    """Enclosed volume, m³, positive when the triangles face outward."""
    return sum(dot(vertices[a], cross3(vertices[b], vertices[c])) for a, b, c in triangles) / 6


def crosses(p, q, corners):
    """Whether the segment p q meets the triangle (Möller and Trumbore 1997); parallel ones do not."""
    direction = minus(q, p)
    edge1, edge2 = minus(corners[1], corners[0]), minus(corners[2], corners[0])
    h = cross3(direction, edge2)
    determinant = dot(edge1, h)
    if abs(determinant) < 1e-12:
        return False
    s = minus(p, corners[0])
    u = dot(s, h) / determinant
    k = cross3(s, edge1)
    v = dot(direction, k) / determinant
    t = dot(edge2, k) / determinant
    return min(u, v, 1 - u - v, t, 1 - t) >= -1e-9


def box(points):
    """Least and greatest corner."""
    return tuple(map(min, zip(*points))), tuple(map(max, zip(*points)))


def boxes_meet(a, b):
    """Whether two boxes overlap or touch."""
    return all(a[0][k] <= b[1][k] + 1e-9 and b[0][k] <= a[1][k] + 1e-9 for k in range(3))


def check_embedding(vertices, triangles):
    """Refuses an edge that meets a triangle which has none of its ends."""
    faces = [(t, [vertices[i] for i in t]) for t in triangles]
    faces = [(t, corners, box(corners)) for t, corners in faces]
    for a, b in {tuple(sorted(e)) for t in triangles for e in zip(t, t[1:] + t[:1])}:
        p, q = vertices[a], vertices[b]
        reach = box([p, q])
        for triangle, corners, extent in faces:
            if a in triangle or b in triangle or not boxes_meet(reach, extent):
                continue
            if crosses(p, q, corners):
                raise BrokenMesh(f"the surface cuts itself between {p} and {q}")


def check_solids(vertices, triangles):
    """Checks every connected piece; returns the pieces' bounding boxes and volumes."""
    check_topology(vertices, triangles)
    found = []
    for piece in components(triangles):
        inside = volume(vertices, piece)
        if inside <= 0:
            raise BrokenMesh(f"a piece faces inward near {vertices[piece[0][0]]}")
        check_embedding(vertices, piece)
        found.append((box([vertices[i] for t in piece for i in t]), inside))
    for (a, _), (b, _) in itertools.combinations(found, 2):
        if boxes_meet(a, b):
            raise BrokenMesh(f"two pieces meet near {a[0]}")
    return found


def prove_checks():
    """The checks pass a good box and refuse one broken in each way that they are for."""
    good = building(Tier(rectangle(0, 0, 1, 2), 3.0))
    vertices, triangles = good.vertices, good.triangles
    [(_, inside)] = check_solids(vertices, triangles)
    assert abs(inside - 6.0) < 1e-12, inside
    pushed_in = building(Tier(rectangle(0, 0, 1, 2), 3.0, roof=("spire", -4.0)))
    shifted = [(x + 0.5, y + 0.5, z + 0.5) for x, y, z in vertices]
    second = [tuple(i + len(vertices) for i in t) for t in triangles]
    tent = building(Tier(rectangle(0, 0, 1, 1), 1.0, roof=("spire", 1.0)))
    tip = len(tent.vertices) - 1
    hanging = [(x, 4.0 - y, z) for x, y, z in tent.vertices[:tip]]
    hung = [tuple(tip if i == tip else i + tip + 1 for i in t)[::-1] for t in tent.triangles]
    broken = [
        ("twice in one direction", vertices, [triangles[0][::-1]] + triangles[1:]),
        ("open edge", vertices, triangles[1:]),
        ("twice in one direction", vertices, triangles + triangles[:1]),
        ("faces inward", vertices, [t[::-1] for t in triangles]),
        ("cuts itself", pushed_in.vertices, pushed_in.triangles),
        ("two pieces meet", vertices + shifted, triangles + second),
        ("at one place", vertices + vertices[:1], triangles),
        ("no triangle uses", vertices + [(9.0, 9.0, 9.0)], triangles),
        ("without area", [(0.0, float(i), 0.0) for i in range(8)], triangles),
        ("two fans", tent.vertices + hanging, tent.triangles + hung),
    ]
    for words, points, faces in broken:
        try:
            check_solids(points, faces)
        except BrokenMesh as refusal:
            assert words in str(refusal), (words, refusal)
            continue
        raise AssertionError(f"the checks let through a mesh with: {words}")
