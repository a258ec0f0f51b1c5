"""Runs one case by SPlisHSPlasH, of which pySPlisHSPlasH is the Python module: JOB in, JSON out. See tools/lib/peers/cases.py for the job.

    python splishsplash.py JOB.json RESULT.json

Water is a lattice of spacing d = 2 r, support 4 r: what swell's PBF has. Walls are Akinci's, one layer of samples on a box.
"""

import ctypes
import importlib.metadata
import json
import sys
import time
from pathlib import Path

import numpy as np

# The wheel brings half of its own libGL, which fails in its initialiser where the system's is not there first.
ctypes.CDLL("libGL.so.1", mode=ctypes.RTLD_GLOBAL)
import pysplishsplash as sph  # noqa: E402

METHODS = {"PBF": 2, "DFSPH": 4}
# Volume maps (Bender 2019) let a tank at rest burst through its walls here, at cells of d as at cells of 2 d.
AKINCI_2012 = 0
# From the first particles to the samples of a wall, in d. One layer of samples weighs 1.4 times a layer of the lattice (its volumes are 1 / Σ W over the layer
# itself) and balances the lattice from 1.12 d; edges, where two layers meet, ask for a little more. In a tank of 16 × 20 × 16 at rest 12 steps of 1/240 s, 4
# iterations each, made from nothing 6.8 J/kg with walls at 1.00 d, 1.1 at 1.10, 0.09 at 1.15.
WALL = 1.15
CORNERS = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
FACES = [(1, 4, 3), (1, 2, 4), (5, 8, 6), (5, 7, 8), (1, 6, 2), (1, 5, 6), (3, 8, 7), (3, 4, 8), (1, 7, 5), (1, 3, 7), (2, 8, 4), (2, 6, 8)]


def scene(job, room):
    """The scene as SPlisHSPlasH reads it; the box that it names is written beside it."""
    d, (x, y, z) = job["spacing"], job["water"]
    out = (WALL - 0.5) * d
    low, high = [-out] * 3, [n * d + out for n in job["box"]]
    lines = ["v {} {} {}\n".format(*corner) for corner in CORNERS] + ["f {} {} {}\n".format(*face) for face in FACES]
    (room / "box.obj").write_text("".join(lines))
    method = job["settings"]["method"]
    solver = {k: v for k, v in job["settings"].items() if k != "method"}
    return {
        "Configuration": {
            "particleRadius": d / 2,
            "simulationMethod": METHODS[method],
            "gravitation": [0.0, -9.81, 0.0],
            "timeStepSize": job["step"],
            "cflMethod": 0,
            "boundaryHandlingMethod": AKINCI_2012,
            method: solver,
        },
        "Materials": [{"id": "Fluid", "density0": 1000.0, "viscosityMethod": 0}],
        "RigidBodies": [
            {
                "geometryFile": str(room / "box.obj"),
                "translation": [0.5 * (a + b) for a, b in zip(low, high)],
                "scale": [b - a for a, b in zip(low, high)],
                "isDynamic": False,
                "isWall": True,
            }
        ],
        # A block has a particle less along each axis than its length in diameters says.
        "FluidBlocks": [{"denseMode": 0, "start": [0.0, 0.0, 0.0], "end": [(n + 1) * d for n in (x, y, z)]}],
    }


def main(job_file, result_file):
    """Runs the job and writes what came out."""
    job = json.loads(Path(job_file).read_text())
    room = Path(job_file).resolve().parent
    scene_file = room / "scene.json"
    scene_file.write_text(json.dumps(scene(job, room)))
    base = sph.Exec.SimulatorBase()
    base.init(useGui=False, useCache=False, sceneFile=str(scene_file), outputDir=str(room / "output"), stopAt=(job["steps"] - 0.5) * job["step"])
    base.initSimulation()
    simulation = sph.Simulation.getCurrent()
    model = simulation.getFluidModel(0)
    count, d = model.numActiveParticles(), job["spacing"]
    lattice = np.stack(np.meshgrid(*(d * (np.arange(n) + 0.5) for n in job["water"]), indexing="ij"), axis=-1).reshape(-1, 3)
    if count != len(lattice):
        sys.exit(f"SPlisHSPlasH made {count} particles of {len(lattice)}")
    if abs(model.getVolume(0) / d**3 - 1.0) > 1e-5:
        sys.exit(f"a particle of SPlisHSPlasH has {model.getVolume(0)} m³ and not d³ = {d**3} m³: the cases would not be the same")
    at = np.array(model.getFieldBuffer("position"), copy=False)[:count]
    velocity = np.array(model.getFieldBuffer("velocity"), copy=False)[:count]
    at[:], velocity[:] = lattice, job["velocity"]
    solver = simulation.getTimeStep()
    seconds, iterations, last = [], [], None
    with open(room / "frames.bin", "wb") as dump:

        def after_step():
            nonlocal last
            now = time.perf_counter()
            # The first step comes after the building of walls, with no time of its own.
            if last is not None:
                seconds.append(now - last)
            iterations.append(solver.getNumIterations() if hasattr(solver, "getNumIterations") else 0)
            if job["every"] and len(iterations) % job["every"] == 0:
                np.hstack([at, velocity]).astype("<f4").tofile(dump)
            last = time.perf_counter()

        base.setTimeStepCB(after_step)
        base.runSimulation()
    result = {
        "version": importlib.metadata.version("pySPlisHSPlasH"),
        "particles": count,
        "seconds": seconds[job["warm_up"] :],
        "iterations": sum(iterations) / len(iterations),
    }
    Path(result_file).write_text(json.dumps(result))


main(*sys.argv[1:])
