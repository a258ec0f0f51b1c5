"""What Partio reads of BGEOs that swell exported. See tools/lib/bgeo-reader."""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import partio

# How far from the world's origin the last scene stands, in metres: its NPY has 64 bits a coordinate, its BGEO 32.
FAR = 10000.0


def scene(method, away):
    """A block of water that falls into a pool, so that whitewater is born within a few frames."""
    return f"""
[shot]
name = "drop"
frames = 12
frames_per_second = 24
[domain]
min = [{away}, 0.0, 0.0]
max = [{away + 2.0}, 3.0, 1.0]
[[water.block]]
min = [{away}, 0.0, 0.0]
max = [{away + 2.0}, 0.5, 1.0]
[[water.block]]
min = [{away + 0.3}, 1.6, 0.3]
max = [{away + 0.7}, 2.4, 0.7]
[solver]
method = "{method}"
[solver.pbf]
particle_spacing = 0.1
[solver.flip]
cell_size = 0.2
transfer = "apic"
"""


# Of what a file begins with: magic, version, eight counts.
HEAD = 9 + 8 * 4


def must(condition, what):
    """Ends the run where something is not as it should be."""
    if not condition:
        sys.exit(f"bgeo reader: {what}")


def columns(npy, is_far):
    """What swell's NPY has, by the names that Partio gives: 32-bit words, a row a particle."""
    place = npy["position"].astype(np.float32) if is_far else npy["position"]
    must((npy["position"].dtype == np.float64) == is_far, "NPY: positions of a scene far from the origin have 64 bits, those of others 32")
    found = {"position": place, "v": npy["velocity"], "id": npy["id"]}
    found.update((name, npy[name]) for name in npy.dtype.names[3:])
    return {name: np.ascontiguousarray(value).reshape(len(npy), -1).view("<u4") for name, value in found.items()}


def differences(path, wanted):
    """What Partio reads otherwise: names, or `count`, or `attributes`."""
    data = partio.read(str(path))
    if data is None:
        return ["refused"]
    rows = len(next(iter(wanted.values())))
    kinds = {"position": partio.VECTOR, "v": partio.VECTOR, "id": partio.INT}
    handles = [data.attributeInfo(k) for k in range(data.numAttributes())]
    if [(it.name, it.type, it.count) for it in handles] != [
        (name, kinds.get(name, partio.FLOAT), value.shape[1]) for name, value in wanted.items()
    ] or data.numFixedAttributes():
        return ["attributes"]
    if data.numParticles() != rows:
        return ["count"]
    wrong = []
    for handle in handles:
        values = [data.get(handle, k) for k in range(rows)]
        found = np.array(values, np.int32 if handle.type == partio.INT else np.float32).view("<u4")
        if not np.array_equal(found, wanted[handle.name]):
            wrong.append(handle.name)
    return wrong


def spoil(path, to, at):
    """A copy with the lowest bit of one word turned."""
    data = bytearray(path.read_bytes())
    data[at + 3] ^= 1
    to.write_bytes(data)


def check(room, name, is_far):
    """One file, and what has to be seen when it is spoilt."""
    path = room / f"{name}.bgeo"
    wanted = columns(np.load(room / f"{name}.npy"), is_far)
    rows = len(wanted["id"])
    must(rows > 1, f"{path.name}: no particles")
    must(differences(path, wanted) == [], f"{path.name}: Partio has other {differences(path, wanted)}")
    # Written again by Partio it is the same file, so its header, the fourth coordinate and its end are those of Partio too.
    again = path.with_name("again.bgeo")
    partio.write(str(again), partio.read(str(path)))
    must(again.read_bytes() == path.read_bytes(), f"{path.name}: Partio writes it otherwise")
    # The controls: each attribute's last bit in the last row, the count, a file that ends early, rows in another order.
    row = 4 * (1 + sum(value.shape[1] for value in wanted.values()))
    size = path.stat().st_size
    must((size - 2 - row * rows) > HEAD, f"{path.name}: {size} bytes are too few")
    other = path.with_name("other.bgeo")
    at = size - 2 - row
    for attribute, value in wanted.items():
        spoil(path, other, at)
        must(differences(other, wanted) == [attribute], f"{path.name}: a bit of {attribute} is turned, and {differences(other, wanted)} is seen")
        # After the position stands a fourth coordinate.
        at += 4 * (value.shape[1] + (attribute == "position"))
    must(at == size - 2, f"{path.name}: its rows have other lengths")
    spoil(path, other, 9)
    must(differences(other, wanted) == ["count"], f"{path.name}: another count is not seen")
    # Partio does not refuse a file that ends early: it repeats what it read last.
    for kept in (size - 2 - row // 2, size - 2 - row, size // 2):
        other.write_bytes(path.read_bytes()[:kept])
        must(differences(other, wanted) != [], f"{path.name}: cut to {kept} of {size} bytes it is read as if it were whole")
    turned = {name: np.roll(value, 1, axis=0) for name, value in wanted.items()}
    must("id" in differences(path, turned), "the control: rows in another order")
    print(f"{path.name}: {rows} particles with {', '.join(wanted)}")


def main(swell):
    """Bakes, exports, reads."""
    with tempfile.TemporaryDirectory() as folder:
        room = Path(folder)

        def run(*words):
            subprocess.run([swell, *words, "--progress", "none"], cwd=room, check=True, stdout=subprocess.DEVNULL)

        for name, method, away in (("pbf", "pbf", 0.0), ("flip", "flip", 0.0), ("far", "pbf", FAR)):
            (room / f"{name}.toml").write_text(scene(method, away))
            run("bake", f"{name}.toml", "-o", name, "--device", "cpu")
            run("export", name, "--bgeo", f"{name}.%04d.bgeo", "--npy", f"{name}.%04d.npy")
            for frame in (1, 12):
                check(room, f"{name}.{frame:04}", away != 0.0)
        run("whitewater", "pbf", "--device", "cpu")
        run("export", "pbf", "--stream", "default", "--bgeo", "white.%04d.bgeo", "--npy", "white.%04d.npy")
        check(room, "white.0012", False)


main(str(Path(sys.argv[1]).resolve()))
print(f"bgeo reader: all is as it should be (numpy {np.__version__}, Python {sys.version.split()[0]})")
