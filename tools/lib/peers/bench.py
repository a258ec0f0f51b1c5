"""swell beside its peers: see tools/bench. Standard library only; what needs more runs in environments under target/peers."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cases
import results
from cases import MANTAFLOW, PEERS, SPLISHSPLASH, Error, Setting, Speed
from results import Fault, Row, Timed

ROOT = Path(__file__).resolve().parents[3]
HERE = Path(__file__).resolve().parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
ROOM = ROOT / "target/peers"
PAGE = ROOT / "docs/performance.md"
MEASURE = "numpy==2.2.6 blake3==1.0.8"
SPLISHSPLASH_WHEELS = "pySPlisHSPlasH==2.19.0 numpy==2.2.6"
# The longest run is a few minutes; what takes longer hangs.
LIMIT_S = 900


def say(text: str) -> None:
    print(f"peers: {text}", flush=True)


def ran(command: list[str | Path], **more: Any) -> subprocess.CompletedProcess[str]:
    """A command to its end; a fault with the end of what it said where it fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, **more)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Fault(f"{command[0]}: {error}") from error
    if done.returncode:
        told = (done.stderr.strip() or done.stdout.strip()).splitlines()[-3:]
        raise Fault(f"{Path(command[0]).name} ended with {done.returncode}: {' / '.join(told)}")
    return done


def environment(name: str, wanted: str) -> Path:
    """The Python of a virtual environment with these packages."""
    folder = ROOM / name
    told = folder / "wanted"
    if not told.exists() or told.read_text() != wanted:
        say(f"installing {wanted} into {folder.relative_to(ROOT)}")
        shutil.rmtree(folder, ignore_errors=True)
        ran([sys.executable, "-m", "venv", folder])
        ran([folder / "bin/python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *wanted.split()])
        told.write_text(wanted)
    return folder / "bin/python"


def splishsplash() -> tuple[list[str | Path], str]:
    """How SPlisHSPlasH's runner is started, and its version."""
    python = environment(SPLISHSPLASH, SPLISHSPLASH_WHEELS)
    return [python, "-B", HERE / "splishsplash.py"], SPLISHSPLASH_WHEELS.split()[0].replace("==", " ")


def mantaflow() -> tuple[list[str | Path], str]:
    """The same of Mantaflow's: Blender, which Debian's package has where there is none."""
    if shutil.which("blender") is None:
        say("no blender; installing it (Debian, Ubuntu)")
        script = 'say() { echo "peers: $*"; }; fail() { echo "$*" >&2; exit 3; }; . tools/lib/as-root.sh; apt_install blender'
        ran(["bash", "-c", script], cwd=ROOT)
    version = ran(["blender", "--version"]).stdout.splitlines()[0]
    return ["blender", "--background", "--factory-startup", "--python-exit-code", "3", "--python", HERE / "mantaflow.py", "--"], version


INSTALL: dict[str, Callable[[], tuple[list[str | Path], str]]] = {SPLISHSPLASH: splishsplash, MANTAFLOW: mantaflow}


@dataclass
class Peer:
    """A peer that can be run, or why it cannot."""

    name: str
    command: list[str | Path]
    version: str
    missing: str = ""


def installed(name: str) -> Peer:
    try:
        command, version = INSTALL[name]()
        peer = Peer(name, command, version)
        # A package that installs and cannot run is none that is there.
        smallest = {
            "water": [4, 4, 4], "box": [8, 8, 4], "spacing": 0.1, "velocity": [0.0] * 3, "step": 0.001, "steps": 3, "warm_up": 0, "every": 0,
            "settings": cases.splishsplash("PBF", 0.001, 2).keys if name == SPLISHSPLASH else cases.mantaflow(0.001, 1e-3).keys,
        }  # fmt: skip
        run_peer(peer, smallest, 64 if name == SPLISHSPLASH else 512)
        return peer
    except Fault as fault:
        say(f"{PEERS[name]} cannot be had: {fault}")
        return Peer(name, [], "", f"could not be installed ({fault})")


def room_of(name: str) -> Path:
    """An empty folder for a run."""
    folder = ROOM / "run" / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def run_peer(peer: Peer, job: dict[str, Any], particles: int) -> tuple[dict[str, Any], Path]:
    """Runs a job, and gives its result and the folder with what it left."""
    folder = room_of(peer.name)
    (folder / "job.json").write_text(json.dumps(job))
    # OpenMP's threads that wait by spinning take the cores from each other where anything else runs: with 13 processes beside it 7.2 µs a particle and step
    # for SPlisHSPlasH's PBF, and 4.8 where they sleep.
    threads = {"OMP_NUM_THREADS": str(os.cpu_count()), "OMP_WAIT_POLICY": "passive"}
    ran([*peer.command, folder / "job.json", folder / "result.json"], env={**os.environ, **threads}, cwd=folder)
    if not (folder / "result.json").exists():
        raise Fault(f"{PEERS[peer.name]} left no result")
    return results.sample((folder / "result.json").read_text(), particles), folder


def run_bench(words: list[str], particles: int) -> dict[str, Any]:
    name, *arguments = words
    done = ran(["cargo", "bench", "--locked", "--quiet", "--bench", name, "--", *arguments], cwd=ROOT)
    return results.sample(done.stdout, particles)


def middle_of(case: Speed, told: dict[str, Any]) -> float:
    """A step's median in the case's unit."""
    seconds = sorted(told["seconds"])
    middle = seconds[len(seconds) // 2]
    return 1e6 * middle / case.particles if case.is_each else middle


class Comparison:
    """All runs of all rounds."""

    def __init__(self, peers: dict[str, Peer], small: bool) -> None:
        self.peers = peers
        self.python = environment("measure", MEASURE)
        self.speeds = [case for case in cases.speeds(small) if self.is_wanted(case.peer)]
        self.errors = [case for case in cases.errors(small) if any(self.is_wanted(s) for s in case.settings)]
        self.timed = {case.name: {program: Timed(program) for program in [*case.bench, case.peer.program]} for case in self.speeds}
        self.rows = {case.name: [Row(s.program, s.words) for s in case.settings] for case in self.errors}
        self.device = ""

    def peer(self, setting: Setting) -> Peer | None:
        """The peer that a setting is of, where it was asked for."""
        return next((p for p in self.peers.values() if PEERS[p.name] == setting.program), None)

    def is_wanted(self, setting: Setting) -> bool:
        return self.peer(setting) is not None

    def round(self) -> None:
        """Everything once, programs in turn."""
        for case in self.speeds:
            for program, words in case.bench.items():
                told = run_bench(words, case.particles)
                if program == cases.GPU:
                    self.device = told["device"]
                self.add_speed(case, program, told)
            peer = self.peer(case.peer)
            if peer and not peer.missing:
                self.add_speed(case, case.peer.program, run_peer(peer, case.job(), case.particles)[0])
        for error in self.errors:
            for setting, row in zip(error.settings, self.rows[error.name], strict=True):
                self.run_setting(error, setting, row)

    def add_speed(self, case: Speed, program: str, told: dict[str, Any]) -> None:
        value = middle_of(case, told)
        self.timed[case.name][program].rounds.append(value)
        say(f"{case.name}, {program}: {value:.3f} {case.unit}")

    def run_setting(self, case: Error, setting: Setting, row: Row) -> None:
        """Runs a setting and measures what it left; a setting that fails is a line that says so."""
        if row.failed:
            return
        peer = self.peer(setting)
        is_ours = setting.program.startswith("swell")
        if not is_ours and (peer is None or peer.missing):
            row.failed = peer.missing if peer else "not asked for"
            return
        try:
            seconds, left = self.bake(case, setting) if is_ours else self.left_by(peer, case, setting)
            row.rounds.append(sum(seconds) / case.seconds_of(len(seconds), setting))
            if not row.errors:
                row.errors = self.measured(case, left)
        except Fault as fault:
            row.failed = f"fails: {fault}"
            say(f"{case.name}, {setting.program}, {setting.words}: {row.failed}")
            return
        say(f"{case.name}, {setting.program}, {setting.words}: {row.rounds[-1]:.2f} s a second, {row.errors}")

    def left_by(self, peer: Peer | None, case: Error, setting: Setting) -> tuple[list[float], Path]:
        assert peer is not None
        told, folder = run_peer(peer, case.job(setting), case.particles)
        return told["seconds"], folder / "frames.bin"

    def bake(self, case: Error, setting: Setting) -> tuple[list[float], Path]:
        folder = room_of("swell")
        (folder / "scene.toml").write_text(case.scene(setting))
        device = "cpu" if setting.program == cases.CPU else "gpu"
        swell = TARGET / "release/swell"
        done = ran([swell, "bake", folder / "scene.toml", "-o", folder / "cache", "--device", device, "--progress", "json"])
        return results.bake_seconds(done.stdout, case.frames), folder / "cache"

    def measured(self, case: Error, left: Path) -> dict[str, float]:
        """Errors of what a run left, by measure.py."""
        # FLIP's cells have two particles along each axis.
        told = {
            "kind": case.kind, "water": case.water, "box": case.box, "spacing": case.spacing, "frames": case.frames, "particles": case.particles,
            "particle_spacing": case.spacing if case.method == "pbf" else case.spacing / 2, "frames_per_second": case.frames_per_second,
        }  # fmt: skip
        file = ROOM / "run/case.json"
        file.write_text(json.dumps(told))
        paths = {**os.environ, "PYTHONPATH": str(ROOT / "tools/python/src")}
        return dict(json.loads(ran([self.python, "-B", HERE / "measure.py", file, left], env=paths).stdout))

    def text(self, rounds: int) -> str:
        """The part of the page."""
        parts = [machine(self.peers, self.device, rounds)]
        for case in self.speeds:
            timed = self.timed[case.name]
            theirs = timed[case.peer.program]
            peer = self.peer(case.peer)
            ours = [timed[program] for program in case.bench]
            missing = peer.missing if peer else ""
            parts.append(results.speed_table(case.words, case.unit, case.peer.program, ours, None if missing else theirs, missing))
        parts += [results.error_table(f"{c.method.upper()}, {c.words}", c.kind, self.rows[c.name]) for c in self.errors]
        return "\n".join(parts)


def machine(peers: dict[str, Peer], device: str, rounds: int) -> str:
    """Versions and machine, a paragraph."""
    info = Path("/proc/cpuinfo")
    models = [line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")] if info.exists() else []
    cpu = models[0] if models else os.uname().machine
    told = [f"{PEERS[p.name]}: {p.missing or p.version}" for p in peers.values()]
    swell = " ".join(word.strip() for word in ran([TARGET / "release/swell", "--version"]).stdout.splitlines()[:2])
    day = time.strftime("%Y-%m-%d")
    words = f"Made by `tools/bench peers` on {day}: {swell}; {'; '.join(told)}. {os.cpu_count()} cores of {cpu}; swell's GPU is {device}."
    busy = f"Load of the machine at the end: {os.getloadavg()[1]:.0f}."
    return f"{words} Medians of {rounds} rounds, all programs in turn in each, with the least and most; ratios are of one round. {busy}\n"


def main() -> int:
    parser = argparse.ArgumentParser(prog="tools/bench peers", description="Runs the same water by swell and by its peers, in turn, and writes docs/performance.md.")
    parser.add_argument("--only", choices=list(PEERS), help="one peer; prints, and leaves the page as it is")
    parser.add_argument("--rounds", type=int, default=3, metavar="N", help="how often all of it is run (3)")
    parser.add_argument("--small", action="store_true", help="small cases, to try it out; prints, and leaves the page as it is")
    arguments = parser.parse_args()
    if arguments.rounds < 1:
        parser.error("--rounds: at least 1")
    ROOM.mkdir(parents=True, exist_ok=True)
    peers = {name: installed(name) for name in ([arguments.only] if arguments.only else PEERS)}
    try:
        subprocess.run(["bash", "-c", "source tools/lib/stages.sh; require_rust; tools/lib/vulkan-driver"], cwd=ROOT, check=True)
        say("building swell and its benchmarks")
        subprocess.run(["cargo", "build", "--release", "--locked"], cwd=ROOT, check=True)
        subprocess.run(["cargo", "bench", "--no-run", "--locked", "--bench", "pbf", "--bench", "flip"], cwd=ROOT, check=True)
        comparison = Comparison(peers, arguments.small)
        for number in range(arguments.rounds):
            say(f"round {number + 1} of {arguments.rounds}")
            comparison.round()
        text = comparison.text(arguments.rounds)
        print(f"\n{text}")
        if not arguments.only and not arguments.small:
            results.write(PAGE, text)
            say(f"wrote {PAGE.relative_to(ROOT)}")
    except (Fault, subprocess.CalledProcessError) as fault:
        say(f"FAILED: {fault}")
        return 1
    missing = [PEERS[peer.name] for peer in peers.values() if peer.missing]
    if missing:
        say(f"FAILED: {' and '.join(missing)} could not be installed; the table says why")
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
