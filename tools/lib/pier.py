"""A box that stands in the water, as a mesh for scenes of tools that try readers."""

PIER = (
    "v 1.3 0.0 0.3\nv 1.7 0.0 0.3\nv 1.7 0.8 0.3\nv 1.3 0.8 0.3\n"
    "v 1.3 0.0 0.7\nv 1.7 0.0 0.7\nv 1.7 0.8 0.7\nv 1.3 0.8 0.7\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n"
)
