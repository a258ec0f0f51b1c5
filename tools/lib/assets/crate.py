"""A crate that floats."""

from itertools import product

from .building import Mesh

# How much is cut off each edge, metres.
CHAMFER = 0.03


def crate():
    """A cube of edge 1 about the origin, with its edges cut off."""
    mesh = Mesh()
    corner = {}
    for signs in product((-1, 1), repeat=3):
        for axis in range(3):
            at = [0.5 * s if k == axis else (0.5 - CHAMFER) * s for k, s in enumerate(signs)]
            corner[signs, axis] = mesh.vertex(*at)

    def polygon(*indices):
        """A convex polygon, seen from outside."""
        a, b, c = (mesh.vertices[i] for i in indices[:3])
        u = [q - p for p, q in zip(a, b)]
        v = [q - p for p, q in zip(a, c)]
        normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        if sum(n * p for n, p in zip(normal, a)) < 0:
            indices = indices[::-1]
        mesh.triangles += [(indices[0], indices[k], indices[k + 1]) for k in range(1, len(indices) - 1)]

    for axis, side in product(range(3), (-1, 1)):
        others = [k for k in range(3) if k != axis]
        ring = []
        for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            signs = [side] * 3
            signs[others[0]], signs[others[1]] = s, t
            ring.append(corner[tuple(signs), axis])
        polygon(*ring)
    for first, second in ((0, 1), (0, 2), (1, 2)):
        along = 3 - first - second
        for s, t in product((-1, 1), repeat=2):
            ends = []
            for end in (-1, 1):
                signs = [end] * 3
                signs[first], signs[second] = s, t
                ends.append(tuple(signs))
            low, high = ends
            assert low[along] == -1
            polygon(corner[low, first], corner[high, first], corner[high, second], corner[low, second])
    for signs in product((-1, 1), repeat=3):
        polygon(*(corner[signs, axis] for axis in range(3)))
    return [mesh]
