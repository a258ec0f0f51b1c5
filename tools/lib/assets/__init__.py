"""The generator behind tools/make-assets: plane geometry, buildings, the city, the beach, the checks."""


class BrokenMesh(Exception):
    """A mesh that a solver cannot give an inside to, or that breaks what the city promises."""
