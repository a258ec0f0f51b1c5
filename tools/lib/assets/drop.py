"""A round drop."""

from math import sqrt

from .building import Mesh

# Times that each triangle of an icosahedron is cut into four.
CUTS = 3


def drop():
    """A sphere of radius 1 about the origin."""
    mesh = Mesh()
    golden = (1 + sqrt(5)) / 2

    def on_sphere(x, y, z):
        size = sqrt(x * x + y * y + z * z)
        return mesh.vertex(x / size, y / size, z / size)

    ring = [(s * 1.0, t * golden, 0.0) for t in (1, -1) for s in (-1, 1)]
    corners = [on_sphere(*c) for turn in range(3) for c in ((p[-turn % 3], p[(1 - turn) % 3], p[(2 - turn) % 3]) for p in ring)]
    faces = [
        (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
        (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
        (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1),
    ]  # fmt: skip
    triangles = [tuple(corners[i] for i in face) for face in faces]
    for _ in range(CUTS):
        middles = {}

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                p, q = mesh.vertices[a], mesh.vertices[b]
                middles[key] = on_sphere(*(u + v for u, v in zip(p, q)))
            return middles[key]

        cut = []
        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            cut += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = cut
    mesh.triangles += triangles
    return [mesh]
