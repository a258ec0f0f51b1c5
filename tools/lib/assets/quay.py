"""A quay with a culvert through it, and a mole and dolphins in the basin before it."""

from .building import Mesh, Tier, building
from .plane import rectangle, regular

FRONT = 3.0  # of the quay
TOP = 3.2
ENDS = (-0.3, 10.3)
FLOOR = -0.2
BACK = -0.3
CULVERT_Z = (4.32, 5.76)
CULVERT_Y = (1.92, 2.56)
MOLE_X = (8.0, 13.0)
MOLE_Z = (7.2, 8.4)
MOLE_TOP = 1.75
DOLPHINS = ((6.2, 1.9), (9.4, 1.9), (12.6, 1.9))
DOLPHIN_RADIUS = 0.3
DOLPHIN_TOP = 2.1
SIDES = 12


def quay():
    """A wall along z whose cross-section, seen along x, has a hole."""
    mesh = Mesh()
    outline = rectangle(ENDS[0], FLOOR, ENDS[1], TOP)
    hole = rectangle(CULVERT_Z[0], CULVERT_Y[0], CULVERT_Z[1], CULVERT_Y[1])
    back, front = mesh.loop(outline, BACK), mesh.loop(outline, FRONT)
    inner_back, inner_front = mesh.loop(hole, BACK), mesh.loop(hole, FRONT)
    mesh.plane(back, [inner_back], faces_down=True)
    mesh.plane(front, [inner_front])
    mesh.wall(back, front)
    mesh.wall(inner_front, inner_back)
    # What was made along y goes along x.
    mesh.vertices = [(y, z, x) for x, y, z in mesh.vertices]
    return mesh


def standing(plan, top):
    """A block that stands below the floor."""
    mesh = building(Tier(plan, top - FLOOR))
    mesh.vertices = [(x, y + FLOOR, z) for x, y, z in mesh.vertices]
    return mesh


def harbour():
    """Five closed surfaces."""
    mole = standing(rectangle(MOLE_X[0], MOLE_Z[0], MOLE_X[1], MOLE_Z[1]), MOLE_TOP)
    posts = [regular(place, DOLPHIN_RADIUS, SIDES) for place in DOLPHINS]
    return [quay(), mole, *(standing(post, DOLPHIN_TOP) for post in posts)]
