"""Cases that swell and its peers run: what is the same for all, and for each program its settings.

A peer's runner gets a job, a JSON file:

    water, box       particles (PBF) or cells (FLIP) along each axis; the water fills the box's least corner
    spacing          of these, metres
    velocity         of the water at the start, m/s
    step, steps      seconds, number of steps
    warm_up          steps that are not timed
    every            steps after which places and velocities are appended to frames.bin beside the job: 6 floats a particle; 0: never
    settings         of the solver, in its own words

and writes a result: version, particles, seconds of each step.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

SPLISHSPLASH, MANTAFLOW = "splishsplash", "mantaflow"
PEERS = {SPLISHSPLASH: "SPlisHSPlasH", MANTAFLOW: "Mantaflow"}
WARM_UP = 2
# A reader of the table wants the same words for the same thing.
GPU, CPU = "swell, GPU", "swell, f64 on the CPU"
# Mantaflow corrects no density and ends a solve sooner.
LIGHT = "swell, GPU, tolerance 1e-3, no density correction"


@dataclass(frozen=True)
class Setting:
    """A program and how it is set, for one case."""

    program: str
    words: str
    # Of a peer's runner; of swell keys of its scene.
    keys: dict[str, Any]
    step: float


@dataclass(frozen=True)
class Speed:
    """The same count, spacing, step and iterations, timed step by step."""

    name: str
    words: str
    unit: str
    # Whether the unit is of a particle; of a frame otherwise.
    is_each: bool
    water: tuple[int, int, int]
    box: tuple[int, int, int]
    step: float
    steps: int
    # Arguments of swell's benchmark, by device.
    bench: dict[str, list[str]]
    peer: Setting

    @property
    def particles(self) -> int:
        x, y, z = self.water
        return x * y * z * (1 if self.is_each else 8)

    def job(self) -> dict[str, Any]:
        return {
            "water": self.water, "box": self.box, "spacing": 0.1, "velocity": [2.0, 0.0, 0.0], "step": self.step,
            "steps": self.steps + WARM_UP, "warm_up": WARM_UP, "every": 0, "settings": self.peer.keys,
        }  # fmt: skip


@dataclass(frozen=True)
class Error:
    """The same water until the same time, by settings that cost more or less: errors against time."""

    name: str
    words: str
    kind: str  # tank or dam
    method: str  # pbf or flip
    water: tuple[int, int, int]
    box: tuple[int, int, int]
    spacing: float
    seconds: float
    frames_per_second: int
    settings: list[Setting] = field(default_factory=list)

    @property
    def frames(self) -> int:
        return round(self.seconds * self.frames_per_second)

    @property
    def particles(self) -> int:
        x, y, z = self.water
        return x * y * z * (1 if self.method == "pbf" else 8)

    def seconds_of(self, timed: int, setting: Setting) -> float:
        """What so many timed steps of a peer, or frames of swell, are of the shot."""
        return timed * (setting.step or 1.0 / self.frames_per_second)

    def job(self, setting: Setting) -> dict[str, Any]:
        every = round(1.0 / (self.frames_per_second * setting.step))
        return {
            "water": self.water, "box": self.box, "spacing": self.spacing, "velocity": [0.0, 0.0, 0.0], "step": setting.step,
            "steps": self.frames * every, "warm_up": 0, "every": every, "settings": setting.keys,
        }  # fmt: skip

    def scene(self, setting: Setting) -> str:
        """The scene as swell reads it; frames of one step where the solver has a fixed one, else as many as the flow asks for."""
        size, water = ([n * self.spacing for n in lengths] for lengths in (self.box, self.water))
        length = "particle_spacing" if self.method == "pbf" else "cell_size"
        keys = "".join(f"{key} = {value}\n" for key, value in setting.keys.items())
        return (
            f'[shot]\nname = "{self.kind}"\nframes = {self.frames}\nframes_per_second = {self.frames_per_second}\n'
            f"[domain]\nmin = [0.0, 0.0, 0.0]\nmax = {size}\n[[water.block]]\nmin = [0.0, 0.0, 0.0]\nmax = {water}\n"
            f'[solver]\nmethod = "{self.method}"\n[solver.{self.method}]\n{length} = {self.spacing}\n{keys}'
        )


def splishsplash(method: str, step: float, iterations: int = 0) -> Setting:
    """Its PBF with a fixed number of iterations, or its DFSPH with its own tolerances."""
    words = f"{method}, {iterations} iterations, {1 / step:.0f} steps a second" if iterations else f"{method}, {1 / step:.0f} steps a second"
    keys: dict[str, Any] = {"method": method}
    if iterations:
        keys |= {"minIterations": iterations, "maxIterations": iterations, "maxError": 1e-6, "velocityUpdateMethod": 0}
    return Setting(PEERS[SPLISHSPLASH], words, keys, step)


def mantaflow(step: float, accuracy: float) -> Setting:
    return Setting(PEERS[MANTAFLOW], f"accuracy {accuracy:g}, {1 / step:.0f} steps a second", {"accuracy": accuracy, "pic_blend": 0.05}, step)


def pbf(program: str, iterations: int, projection: bool = True) -> Setting:
    words = f"{iterations} iterations" + ("" if projection else ", no projection")
    return Setting(program, words, {"iterations": iterations, "grid_projection": str(projection).lower(), "max_substeps": 64}, 0.0)


def flip(program: str, tolerance: float) -> Setting:
    return Setting(program, f"tolerance {tolerance:g}", {"pressure": f"{{ tolerance = {tolerance} }}"}, 0.0)


LIGHT_KEYS = "density_correction = false\npressure = { tolerance = 1e-3 }"


def speeds(small: bool) -> list[Speed]:
    count, edge = (8192, 16) if small else (59582, 31)
    block, box = ((36, 24, 16), (40, 24, 16)) if small else ((36, 49, 64), (128, 77, 64))
    rate, steps = 240, 4 if small else 10
    pbf_bench = ["pbf", "--json", "--alone", "--rate", str(rate), "--frames", str(steps), str(count)]
    flip_bench = ["flip", "--json", "--box", "x".join(map(str, box)), "--frames"]
    frames = 4 if small else 8
    on_gpu = [*flip_bench, str(frames)]
    flip_benches = {GPU: on_gpu, LIGHT: [*on_gpu, "--set", LIGHT_KEYS], CPU: [*flip_bench, "4", "--device", "cpu"]}
    return [
        Speed(
            "pbf", f"PBF, {count} particles, h = 2 d, 4 iterations, steps of 1/{rate} s", "µs a particle and step", True,
            (2 * edge, edge, edge), (4 * edge, 2 * edge, edge), 1 / rate, steps,
            {GPU: pbf_bench, CPU: [*pbf_bench, "--device", "cpu"]}, splishsplash("PBF", 1 / rate, 4),
        ),
        Speed(
            "flip", f"FLIP, {8 * block[0] * block[1] * block[2]} particles in {'×'.join(map(str, box))} cells, steps of 1/60 s", "s a frame", False,
            block, box, 1 / 60, frames, flip_benches, mantaflow(1 / 60, 1e-3),
        ),
    ]  # fmt: skip


def errors(small: bool) -> list[Error]:
    # Small: the least that has an inside.
    tank, dam = ((12, 12, 12), 8) if small else ((16, 16, 16), 16)
    cells = (8, 8, 8) if small else (16, 16, 16)
    seconds = 0.5 if small else 1.0
    # Until the front of Martin and Moyce is at 4.11 a, T = t √(2 g / a) = 3.33; a = 1 m.
    end = 0.76
    column, flume = (dam, 2 * dam, dam // 2), (5 * dam, 3 * dam, dam // 2)

    def higher(water: tuple[int, int, int]) -> tuple[int, int, int]:
        return (water[0], water[1] * 3 // 2, water[2])

    def peers_pbf(rate: int) -> list[Setting]:
        return [splishsplash("PBF", 1 / rate, 4), splishsplash("PBF", 1 / rate, 16), splishsplash("DFSPH", 1 / rate)]

    swell_pbf = [pbf(GPU, 2), pbf(GPU, 4), pbf(GPU, 8), pbf(GPU, 8, projection=False), pbf(CPU, 4)]
    swell_flip = [flip(GPU, 1e-3), flip(GPU, 1e-5), flip(CPU, 1e-5)]
    return [
        Error("pbf-tank", f"{tank[0]}×{tank[1]}×{tank[2]} particles at rest, {seconds} s", "tank", "pbf", tank, higher(tank), 0.1, seconds, 60, swell_pbf + peers_pbf(240)),
        Error("pbf-dam", f"a column of {dam} × {2 * dam} particles breaks", "dam", "pbf", column, flume, 1 / dam, end, 100, swell_pbf + peers_pbf(400)),
        Error(
            "flip-tank", f"{cells[0]}×{cells[1]}×{cells[2]} cells of water at rest, {seconds} s", "tank", "flip", cells, higher(cells), 0.1, seconds, 60,
            swell_flip + [mantaflow(1 / 60, 1e-3), mantaflow(1 / 60, 1e-5)],
        ),
        Error(
            "flip-dam", f"a column of {dam} × {2 * dam} cells breaks", "dam", "flip", column, flume, 1 / dam, end, 100,
            swell_flip + [mantaflow(1 / 100, 1e-3), mantaflow(1 / 100, 1e-5), mantaflow(1 / 200, 1e-5)],
        ),
    ]  # fmt: skip
