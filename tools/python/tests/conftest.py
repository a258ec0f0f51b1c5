"""Small caches, baked once by the program that SWELL_BIN names (default target/release/swell); each test gets copies to spoil."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]

TANK = """
[shot]
name = "tank"
frames = 6
frames_per_second = 24
[domain]
min = [{x}, 0.0, 0.0]
max = [{x_end}, 2.0, 1.0]
[[water.block]]
min = [{x}, 0.0, 0.0]
max = [{x_water}, 1.0, 1.0]
[[solid]]
mesh = "{name}.obj"
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
[solver.flip]
cell_size = 0.2
transfer = "apic"
[grids]
surface = true
[[probe]]
kind = "elevation"
at = [{x_probe}, 0.5]
name = "gauge"
rate_hz = 100.0
window = 0.05
[[probe]]
kind = "front"
axis = "+x"
name = "front"
[[probe]]
kind = "elevation"
at = [{x_dry}, 0.5]
name = "dry"
{more}
"""


def pier(x: float) -> str:
    """A box that stands in the tank."""
    corners = [(x + 1.3, y, z) for y in (0.0, 0.3) for z in (0.3, 0.6)] + [(x + 1.6, y, z) for y in (0.0, 0.3) for z in (0.3, 0.6)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    return "".join(f"v {a} {b} {c}\n" for a, b, c in corners) + "".join(f"f {face}\n" for face in faces)


@dataclass(frozen=True)
class Swell:
    """The program."""

    program: Path

    def __call__(self, *arguments: object, code: int = 0) -> str:
        """Runs it; standard output."""
        words = [str(self.program), *map(str, arguments)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert done.returncode == code, f"{words}: exit {done.returncode}\n{done.stdout}{done.stderr}"
        return done.stdout

    def refuses(self, cache: Path) -> bool:
        """Whether `swell verify` finds the cache damaged."""
        done = subprocess.run([str(self.program), "verify", str(cache)], capture_output=True, text=True, check=False)
        assert done.returncode in (0, 4), done.stderr
        return done.returncode == 4


@pytest.fixture(scope="session")
def swell_bin() -> Swell:
    program = Path(os.environ.get("SWELL_BIN", ROOT / "target/release/swell")).resolve()
    assert program.is_file(), f"{program} is not there: cargo build --release, or set SWELL_BIN"
    return Swell(program)


@pytest.fixture(scope="session")
def baked(swell_bin: Swell, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Caches: `pbf` with streams of whitewater and wetness, `flip` with APIC's rows, `kept` with every fourth frame, `far` from the origin, `afloat`
    with a body far from it, `packed` by Zstandard."""
    room = tmp_path_factory.mktemp("baked")

    def bake(name: str, *arguments: object, x: float = 0.0, more: str = "") -> None:
        scene = room / f"{name}.toml"
        numbers = {"x": x, "x_end": x + 2.0, "x_water": x + 0.5, "x_probe": x + 0.25, "x_dry": x + 1.95}
        scene.write_text(TANK.format(**numbers, name=name, more=more))
        (room / f"{name}.obj").write_text(pier(x))
        swell_bin("bake", scene, "-o", room / name, "--progress", "none", *arguments)

    bake("pbf")
    bake("flip", "--solver", "flip")
    bake("kept", more='[keep]\nparticles = "every 4"')
    bake("far", x=8192.0)
    body = '[[body]]\nmesh = "afloat.obj"\ntranslate = [0.0, 0.5, 0.0]\ndensity = 500.0\nvelocity = [-0.5, 0.0, 0.0]'
    bake("afloat", x=8192.0, more=body)
    bake("packed", more='[keep]\ncompression = "zstd"')
    swell_bin("whitewater", room / "pbf", "--progress", "none")
    swell_bin("wet", room / "pbf", "--progress", "none")
    swell_bin("bake", room / "pbf.toml", "--from", f"{room / 'pbf'}:3", "-o", room / "branch", "--progress", "none")
    return room


@pytest.fixture
def copy(baked: Path, tmp_path: Path) -> Callable[[str], Path]:
    """A copy of a cache that a test may spoil."""

    def copied(name: str) -> Path:
        shutil.rmtree(tmp_path / name, ignore_errors=True)
        return Path(shutil.copytree(baked / name, tmp_path / name))

    return copied
