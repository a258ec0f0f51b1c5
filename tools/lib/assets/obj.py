"""Wavefront OBJ text, out and in."""


def number(value):
    """A tenth of a millimetre, without trailing zeros and never a negative zero."""
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def to_obj(title, name, meshes):
    """The text of an OBJ file with one object a mesh."""
    lines = [f"# {title}", "# Metres, y up. Written by tools/make-assets; edit that, not this."]
    offset = 1
    for index, mesh in enumerate(meshes, 1):
        lines.append(f"o {name}_{index:02}" if len(meshes) > 1 else f"o {name}")
        lines += ["v " + " ".join(map(number, vertex)) for vertex in mesh.vertices]
        for index, triangle in enumerate(mesh.triangles):
            if index in mesh.materials:
                lines.append(f"usemtl {mesh.materials[index]}")
            lines.append("f " + " ".join(str(i + offset) for i in triangle))
        offset += len(mesh.vertices)
    return "\n".join(lines) + "\n"


def from_obj(text):
    """Vertices and triangles of such a text."""
    vertices, triangles = [], []
    for line in text.splitlines():
        word, *rest = line.split()
        if word == "v":
            vertices.append(tuple(map(float, rest)))
        elif word == "f":
            triangles.append(tuple(int(i) - 1 for i in rest))
    return vertices, triangles
