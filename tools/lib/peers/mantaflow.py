"""Runs one case by Mantaflow, as Blender has it built in: JOB in, JSON out. See tools/lib/peers/cases.py for the job.

    blender --background --factory-startup --python mantaflow.py -- JOB.json RESULT.json

Mantaflow is driven by itself, without Blender's modifier, so that no time goes to files and meshes: PIC/FLIP with all particles (Zhu and Bridson 2005), a level set of
particles, ghost-fluid pressure, in the order of swell's FLIP. Lengths are cells.
"""

import ctypes
import json
import os
import sys
import time
from pathlib import Path

import bpy

IN_RUNGE_KUTTA_4 = 2  # IntRK4, of which only Blender's own scripts know the name


def build_types():
    """Has a fluid object made once: not before that do Mantaflow's types in Blender have the methods of their bases."""
    bpy.ops.mesh.primitive_cube_add(size=1)
    domain = bpy.context.object
    domain.modifiers.new("fluid", "FLUID").fluid_type = "DOMAIN"
    settings = domain.modifiers["fluid"].domain_settings
    settings.domain_type, settings.resolution_max = "LIQUID", 8
    settings.cache_directory, settings.cache_type = str(ROOM / "blender"), "MODULAR"
    settings.cache_frame_start = settings.cache_frame_end = 1
    if bpy.ops.fluid.bake_data() != {"FINISHED"}:
        sys.exit("Blender could not bake its smallest liquid")


ROOM = Path(sys.argv[-2]).resolve().parent
build_types()
import manta  # noqa: E402


def floats_of(data, count):
    """What a std::vector of Mantaflow's holds: the pointer told is that of the vector, which begins with its data's."""
    first = ctypes.c_void_p.from_address(int(data.getDataPointer(), 16)).value
    return (ctypes.c_float * count).from_address(first)


class Tank:
    """Grids and particles of a case."""

    def __init__(self, job):
        self.job = job
        # A layer of walls around.
        cells = [n + 2 for n in job["box"]]
        self.solver = manta.Solver(name="tank", gridSize=manta.vec3(*cells), dim=3)
        self.solver.timestep = job["step"]
        make = self.solver.create
        self.flags, self.velocity, self.before, self.weights = (make(kind) for kind in (manta.FlagGrid, manta.MACGrid, manta.MACGrid, manta.MACGrid))
        self.pressure, self.surface, self.walls = make(manta.RealGrid), make(manta.LevelsetGrid), make(manta.LevelsetGrid)
        self.index, self.places = make(manta.ParticleIndexSystem), make(manta.IntGrid)
        self.particles = make(manta.BasicParticleSystem)
        self.particle_velocity = self.particles.create(manta.PdataVec3)
        self.flags.initDomain(boundaryWidth=0, phiWalls=self.walls)
        self.flags.fillGrid()
        x, y, z = ([1.0 + (k + 0.5) / 2.0 for k in range(2 * n)] for n in job["water"])
        for a in x:
            for b in y:
                for c in z:
                    self.particles.addParticle(manta.vec3(a, b, c))
        self.particle_velocity.setConst(manta.vec3(*(v / job["spacing"] for v in job["velocity"])))
        self.gravity = manta.vec3(0.0, -9.81 / job["spacing"], 0.0)

    def step(self):
        """Particles to grid, pressure, grid to particles, advection."""
        flags, velocity, parts, surface = self.flags, self.velocity, self.particles, self.surface
        settings = self.job["settings"]
        manta.gridParticleIndex(parts=parts, flags=flags, indexSys=self.index, index=self.places)
        manta.unionParticleLevelset(parts=parts, indexSys=self.index, flags=flags, index=self.places, phi=surface)
        manta.extrapolateLsSimple(phi=surface, distance=4, inside=True)
        manta.extrapolateLsSimple(phi=surface, distance=3)
        flags.updateFromLevelset(surface)
        manta.mapPartsToMAC(vel=velocity, flags=flags, velOld=self.before, parts=parts, partVel=self.particle_velocity, weight=self.weights)
        manta.extrapolateMACFromWeight(vel=velocity, distance=2, weight=self.weights)
        self.before.copyFrom(velocity)
        manta.addGravity(flags=flags, vel=velocity, gravity=self.gravity, scale=False)
        manta.setWallBcs(flags=flags, vel=velocity)
        manta.solvePressure(flags=flags, vel=velocity, pressure=self.pressure, phi=surface, cgAccuracy=settings["accuracy"])
        manta.setWallBcs(flags=flags, vel=velocity)
        manta.extrapolateMACSimple(flags=flags, vel=velocity, distance=4)
        manta.flipVelocityUpdate(
            vel=velocity, velOld=self.before, flags=flags, parts=parts, partVel=self.particle_velocity, flipRatio=1.0 - settings["pic_blend"]
        )
        parts.advectInGrid(flags=flags, vel=velocity, integrationMode=IN_RUNGE_KUTTA_4, deleteInObstacle=False, stopInObstacle=False)
        manta.pushOutofObs(parts=parts, flags=flags, phiObs=self.walls)
        self.solver.step()

    def write(self, dump):
        """Places and velocities as they are, six floats a particle: metres, m/s."""
        count, d = self.particles.pySize(), self.job["spacing"]
        # A particle is three floats and a flag.
        raw, speeds = floats_of(self.particles, 4 * count), floats_of(self.particle_velocity, 3 * count)
        rows = (ctypes.c_float * (6 * count))()
        for axis in range(3):
            rows[axis::6] = [(place - 1.0) * d for place in raw[axis::4]]
            rows[axis + 3 :: 6] = [speed * d for speed in speeds[axis::3]]
        dump.write(bytes(rows))


def main(job_file, result_file):
    """Runs the job and writes what came out."""
    job = json.loads(Path(job_file).read_text())
    manta.setDebugLevel(0)
    tank = Tank(job)
    wanted = 8 * job["water"][0] * job["water"][1] * job["water"][2]
    seconds = []
    with open(ROOM / "frames.bin", "wb") as dump:
        for step in range(1, job["steps"] + 1):
            begin = time.perf_counter()
            tank.step()
            seconds.append(time.perf_counter() - begin)
            if tank.particles.pySize() != wanted:
                sys.exit(f"Mantaflow has {tank.particles.pySize()} particles of {wanted}")
            if job["every"] and step % job["every"] == 0:
                tank.write(dump)
    result = {"version": f"Blender {bpy.app.version_string}", "particles": wanted, "seconds": seconds[job["warm_up"] :]}
    Path(result_file).write_text(json.dumps(result))
    sys.stdout.flush()
    # Mantaflow aborts where its grids outlive its solver, which is how Python ends.
    os._exit(0)


main(*sys.argv[-2:])
