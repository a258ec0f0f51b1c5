"""The figures of potential flow that the validation study is compared with; see tools/lib/potential-flow."""

import math
import sys
import tomllib
from pathlib import Path

import capytaine as cpt
import numpy as np
import shoaling

RHO, G = 1000.0, 9.81
# Relative difference that is not told apart: of the figures as the study writes them.
WITHIN = 0.005
# Difference of an elevation over the depth that is not told apart: what finer elements change.
BEACH_WITHIN = 0.001
# Panels along a side of the raft and from pole to pole of the ball.
PANELS = 24

STUDY = Path(__file__).resolve().parents[2] / "scenes" / "studies" / "validation.toml"


def free_oscillation(mesh, centre, dof, inertia, stiffness, depth):
    """Period in seconds, damping ratio, and added inertia of a body that is let go in calm water."""
    immersed = mesh.immersed_part(water_depth=depth)
    body = cpt.FloatingBody(immersed, dofs=cpt.rigid_body_dofs(rotation_center=centre), center_of_mass=centre)
    solver = cpt.BEMSolver()
    omega, added, damping = math.sqrt(stiffness / inertia), 0.0, 0.0
    for _ in range(20):
        problem = cpt.RadiationProblem(body=body, radiating_dof=dof, omega=omega, water_depth=depth, rho=RHO, g=G)
        result = solver.solve(problem)
        added, damping = result.added_mass[dof], result.radiation_damping[dof]
        last, omega = omega, math.sqrt(stiffness / (inertia + added))
        if abs(omega / last - 1) < 1e-5:
            break
    ratio = damping / (2 * math.sqrt(stiffness * (inertia + added)))
    return 2 * math.pi / (omega * math.sqrt(1 - ratio**2)), ratio, added


def raft():
    """The roll of a box of 0.4 m by 0.4 m, 0.2 m high, of half the water's density, in 0.5 m of water."""
    side, height, depth = 0.4, 0.2, 0.5
    mass = RHO / 2 * side * side * height
    inertia = mass / 12 * (side**2 + height**2)
    # Half immersed, its centre of mass lies in the waterline: centre of buoyancy to metacentre, less how deep that is.
    metacentric = side**2 / 12 / (height / 2) - height / 4
    mesh = cpt.mesh_parallelepiped(size=(side, side, height), resolution=(PANELS, PANELS, PANELS // 2), center=(0, 0, 0))
    period, _, added = free_oscillation(mesh, (0, 0, 0), "Roll", inertia, mass * G * metacentric, depth)
    return {"roll_period": period}, f"added inertia {added:.4f} kg m², metacentric height {1e3 * metacentric:.0f} mm"


def ball():
    """The heave of a ball of radius 0.15 m, half immersed, in water of three radii."""
    radius, depth = 0.15, 0.45
    mass = RHO * 2 / 3 * math.pi * radius**3
    stiffness = RHO * G * math.pi * radius**2
    mesh = cpt.mesh_sphere(radius=radius, center=(0, 0, 0), resolution=(PANELS, 2 * PANELS))
    period, ratio, added = free_oscillation(mesh, (0, 0, 0), "Heave", mass, stiffness, depth)
    left = math.exp(-2 * math.pi * ratio / math.sqrt(1 - ratio**2))
    return {"heave_period": period, "heave_left": left}, f"added mass {added:.3f} kg, damping ratio {ratio:.3f}"


def beach(benchmarks):
    """Compares the profile of a wave of H/d = 0.3 on 1:19.85 at t = 15 √(d/g) with the study's; returns whether it differs."""

    def points(name):
        found = next(benchmark for benchmark in benchmarks if benchmark["name"].startswith(name))
        return np.array(found["points"][0]["at"]).T

    distances, told = points("solitary wave before it breaks")
    tank = shoaling.Tank(0.3, 19.85)
    tank.advance(15)
    off = np.abs(tank.profile(distances) - told).max()
    is_off = off > BEACH_WITHIN
    elevation, _, _, x = tank.split(tank.state)
    crest = elevation.argmax()
    print(f"beach: crest of {elevation[crest]:.3f} d, {tank.shore - x[crest]:.2f} d before the shoreline")
    print(f"    elevations at most {off:.4f} d off those of the study{': DIFFERS' if is_off else ''}")
    distances, measured = points("solitary wave that breaks")

    def error(shift):
        return np.sqrt(np.mean((tank.profile(distances - shift) - measured) ** 2)) / measured.max()

    best = min(np.arange(-1.5, 1.5, 0.05), key=error)
    print(f"    the experiment is {error(0):.3f} off it, and {error(best):.3f} where it is moved by {best:.2f} d towards the shore")
    return is_off


def slope():
    """The run-up of a wave of H/d = 0.1 on a slope of 15°, whose crest is 9 depths from the wall and 11.686 from the shoreline."""
    cot = 3.732
    tank = shoaling.Tank(0.1, cot, crest=9.0, toe=20.686 - cot)
    return {"run_up": tank.advance(18)}, f"{2.831 * math.sqrt(cot) * 0.1**1.25:.4f} d by Synolakis's law"


def published(benchmarks):
    """What the study is held against, by quantity."""
    from_here = ("roll of a raft", "heave of a ball that floats", "solitary wave on a slope")
    gates = [gate for benchmark in benchmarks if benchmark["name"].startswith(from_here) for gate in benchmark["gate"]]
    return {gate["of"]: gate["published"] for gate in gates if "published" in gate}


def main():
    cpt.set_logging("ERROR")
    benchmarks = tomllib.loads(STUDY.read_text())["benchmark"]
    told, off = published(benchmarks), 0
    for of in (raft, ball, slope):
        found, words = of()
        print(f"{of.__name__}: {words}")
        for name, value in found.items():
            is_off = abs(value / told[name] - 1) > WITHIN
            off += is_off
            print(f"    {name} {value:.4f}, the study has {told[name]}{': DIFFERS' if is_off else ''}")
    off += beach(benchmarks)
    return 1 if off else 0


if __name__ == "__main__":
    sys.exit(main())
