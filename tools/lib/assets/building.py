"""A building: a tree of tiers, turned into one closed surface."""

import itertools
from dataclasses import dataclass, field

from . import BrokenMesh
from .plane import contains, distance_to_edges, triangulate


@dataclass
class Tier:
    """An outline extruded from where it stands to `top`, and what stands on it.

    `top_plan` is the outline at the top where the walls lean. A tier on another may also go *down*:
    that is the roof floor behind a parapet. `roof` is None (flat), ("spire", rise) or
    ("ridge", rise, hip, axis) over a rectangle, with the ridge `hip` metres short of both ends and
    along axis 0 (x) or 1 (z).
    """

    plan: list
    top: float
    crown: list = field(default_factory=list)
    top_plan: list | None = None
    roof: tuple | None = None


class Mesh:
    """Vertices (x, y, z) and triangles of one closed surface."""

    def __init__(self):
        self.vertices = []
        self.triangles = []
        # By the first triangle that has it.
        self.materials = {}

    def loop(self, plan, y):
        """Adds an outline's vertices at height y."""
        first = len(self.vertices)
        self.vertices += [(x, y, z) for x, z in plan]
        return list(range(first, len(self.vertices)))

    def vertex(self, x, y, z):
        """Adds one vertex."""
        self.vertices.append((x, y, z))
        return len(self.vertices) - 1

    def quad(self, a, b, c, d):
        """Two triangles."""
        self.triangles += [(a, b, c), (a, c, d)]

    def wall(self, first, second):
        """The wall from one loop to the next on the way from the ground to the roof."""
        count = len(first)
        for i in range(count):
            j = (i + 1) % count
            self.quad(first[i], first[j], second[j], second[i])

    def plane(self, outer, holes=(), faces_down=False):
        """A level face with holes."""
        points = {i: (self.vertices[i][0], self.vertices[i][2]) for i in itertools.chain(outer, *holes)}
        for a, b, c in triangulate(points, outer, holes):
            self.triangles.append((a, c, b) if faces_down else (a, b, c))

    def roof(self, loop, kind, *shape):
        """A spire or a ridge over a loop."""
        corners = [self.vertices[i] for i in loop]
        x, y, z = (sum(corner[k] for corner in corners) / len(corners) for k in range(3))
        if kind == "spire":
            apex = self.vertex(x, y + shape[0], z)
            for a, b in zip(loop, loop[1:] + loop[:1]):
                self.triangles.append((a, b, apex))
            return
        rise, hip, axis = shape
        low_x, high_x = min(c[0] for c in corners), max(c[0] for c in corners)
        low_z, high_z = min(c[2] for c in corners), max(c[2] for c in corners)
        a, b, c, d = loop  # low x low z, low x high z, high x high z, high x low z: see rectangle()
        if axis == 1:
            low = self.vertex(x, y + rise, low_z + hip)
            high = self.vertex(x, y + rise, high_z - hip)
            self.quad(a, b, high, low)
            self.quad(c, d, low, high)
            self.triangles += [(b, c, high), (d, a, low)]
        else:
            low = self.vertex(low_x + hip, y + rise, z)
            high = self.vertex(high_x - hip, y + rise, z)
            self.quad(b, c, high, low)
            self.quad(d, a, low, high)
            self.triangles += [(a, b, low), (c, d, high)]

    def raise_tier(self, tier, below):
        """Walls and top of a tier, and all that stands on it."""
        top_plan = tier.top_plan or tier.plan
        top = self.loop(top_plan, tier.top)
        self.wall(below, top)
        if tier.roof:
            self.roof(top, *tier.roof)
            return
        for child in tier.crown:
            for point in child.plan:
                if not contains(top_plan, point) or distance_to_edges(point, top_plan) < 0.05:
                    raise BrokenMesh(f"a tier reaches over its support at {point}")
        holes = [self.loop(child.plan, tier.top) for child in tier.crown]
        self.plane(top, holes)
        for child, hole in zip(tier.crown, holes):
            self.raise_tier(child, hole)


def building(tier):
    """The closed mesh of a building that stands on the ground."""
    mesh = Mesh()
    ground = mesh.loop(tier.plan, 0.0)
    mesh.plane(ground, faces_down=True)
    mesh.raise_tier(tier, ground)
    return mesh
