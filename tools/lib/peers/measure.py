"""What a run's particles say of its errors: one way to look for every program. See tools/lib/peers/cases.py.

    python measure.py CASE.json FRAMES    # FRAMES: frames.bin of a peer, or a cache of swell (needs tools/python/src on PYTHONPATH)

prints a JSON object of errors. Of a tank at rest, over the second half of the frames:

    density     mean of |ρ/ρ0 − 1| of particles with water all around, by the cubic spline of support 2 d
    level       root mean square of 2 ȳ/H − 1: of the water's height, told by its centre
    speed       largest, m/s

Of a column a × 2 a that breaks, a = 1 m:

    front       mean of |Z/Z' − 1| at Martin and Moyce's times; Z is where 99.5 % of the water is behind
    energy      of motion and height at the end over that at the start, less 1: nothing has been met by then that could take any
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.float64]
GRAVITY = 9.81
# Front Z = x / a at T = t √(2 g / a): Martin and Moyce 1952, n² = 2.
MARTIN_AND_MOYCE = [(0.84, 1.22), (1.43, 1.67), (1.98, 2.33), (2.51, 3.00), (2.98, 3.67), (3.33, 4.11)]
LOOKED_AT = 1000


def spline(r: Rows, spacing: float) -> Rows:
    """The cubic spline of support 2 spacings, with its factor."""
    q = r / (2.0 * spacing)
    inner, outer = 6.0 * (q**3 - q**2) + 1.0, 2.0 * np.maximum(1.0 - q, 0.0) ** 3
    return np.where(q <= 0.5, inner, outer) / (np.pi * spacing**3)


def density_error(at: Rows, spacing: float, size: list[float], height: float) -> float:
    """Mean of |ρ/ρ0 − 1| of particles that have their whole support in the water, a thousand of them."""
    margin = 2.0 * spacing
    high = np.array([size[0] - margin, height - 1.5 * margin, size[2] - margin])
    inside = np.flatnonzero(((at > margin) & (at < high)).all(axis=1))
    if len(inside) < 20:
        raise ValueError(f"{len(inside)} particles have water all around: the tank is no tank any more")
    chosen = at[inside[:: max(1, len(inside) // LOOKED_AT)]]
    errors = []
    for some in np.array_split(chosen, max(1, len(chosen) // 50)):
        near = at[((at > some.min(axis=0) - margin) & (at < some.max(axis=0) + margin)).all(axis=1)]
        distances = np.linalg.norm(some[:, None, :] - near[None, :, :], axis=2)
        errors.append(np.abs(spacing**3 * spline(distances, spacing).sum(axis=1) - 1.0))
    return float(np.concatenate(errors).mean())


def tank(case: dict[str, Any], frames: list[Rows]) -> dict[str, float]:
    """Errors of water at rest."""
    late = frames[len(frames) // 2 :]
    size = [n * case["spacing"] for n in case["box"]]
    height = case["water"][1] * case["spacing"]
    levels = [2.0 * float(rows[:, 1].mean()) / height - 1.0 for rows in late]
    some = late[:: max(1, len(late) // 8)]
    return {
        "density": float(np.mean([density_error(rows[:, :3], case["particle_spacing"], size, height) for rows in some])),
        "level": float(np.sqrt(np.mean(np.square(levels)))),
        "speed": max(float(np.linalg.norm(rows[:, 3:], axis=1).max()) for rows in late),
    }


def energy(rows: Rows) -> float:
    """Of motion and height, J/kg."""
    return float(0.5 * (rows[:, 3:] ** 2).sum(axis=1).mean() + GRAVITY * rows[:, 1].mean())


def dam(case: dict[str, Any], frames: list[Rows]) -> dict[str, float]:
    """Errors of a column of width 1 m that breaks."""
    width = case["water"][0] * case["spacing"]
    times = np.arange(1, len(frames) + 1) / case["frames_per_second"] * np.sqrt(2.0 * GRAVITY / width)
    fronts = [float(np.percentile(rows[:, 0], 99.5)) / width for rows in frames]
    off = [abs(np.interp(t, times, fronts) / z - 1.0) for t, z in MARTIN_AND_MOYCE]
    # The column's centre is a high.
    return {"front": float(np.mean(off)), "energy": energy(frames[-1]) / (GRAVITY * width) - 1.0}


def peers_frames(path: Path, particles: int) -> Iterator[Rows]:
    """Places and velocities of each frame of a peer."""
    rows = np.fromfile(path, "<f4").astype(np.float64)
    if rows.size == 0 or rows.size % (6 * particles):
        raise ValueError(f"{rows.size} numbers are no frames of {particles} particles")
    yield from rows.reshape(-1, particles, 6)


def swells_frames(path: Path, particles: int) -> Iterator[Rows]:
    """The same of a cache."""
    import swell

    for frame in swell.Cache(path):
        if frame.frame == 0:
            continue
        if len(frame) != particles:
            raise ValueError(f"frame {frame.frame} has {len(frame)} particles and not {particles}")
        yield np.hstack([frame.position, frame.velocity]).astype(np.float64)


def measured(case: dict[str, Any], path: Path) -> dict[str, float]:
    """Errors of the frames in this file or cache."""
    found = list((swells_frames if path.is_dir() else peers_frames)(path, case["particles"]))
    if len(found) != case["frames"]:
        raise ValueError(f"{len(found)} frames of {case['frames']}")
    for rows in found:
        if not np.isfinite(rows).all():
            raise ValueError("a place or velocity is no number")
    return (tank if case["kind"] == "tank" else dam)(case, found)


if __name__ == "__main__":
    try:
        print(json.dumps(measured(json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2]))))
    except ValueError as error:
        sys.exit(str(error))
