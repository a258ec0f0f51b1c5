"""The beach of the wave tank."""

from .building import Mesh


def beach():
    """A slope from (12, 0) to (20, 2), carried on below the floor and past the walls of the tank."""
    mesh = Mesh()
    profile = [(11.2, -0.2), (20.2, 2.05), (20.2, -0.2)]
    near = [mesh.vertex(x, y, -0.2) for x, y in profile]
    far = [mesh.vertex(x, y, 3.2) for x, y in profile]
    mesh.triangles += [tuple(near), (far[0], far[2], far[1])]
    for i in range(3):
        j = (i + 1) % 3
        mesh.quad(near[j], near[i], far[i], far[j])
    return [mesh]
