"""Steps that measure: passes, whole frames, pictures, and the start of the program."""

import json
import statistics
from functools import partial
from typing import NamedTuple, Optional

from .pictures import look_of, render
from .session import COARSE, DoesNotFit, Failure, Step


class Case(NamedTuple):
    name: str
    solver: str
    key: Optional[str]  # set over scenes/wave-city.toml
    frames: int  # of the run that times passes
    whole: int  # frames of a second run for whole frames, or 0
    limit: float


SPACING, CELL = "solver.pbf.particle_spacing", "solver.flip.cell_size"
CASES = [
    Case("PBF 0.06 M", "pbf", f"{SPACING}=0.15", 8, 24, 30),
    Case("FLIP 0.9 M", "flip", f"{CELL}=0.1215", 6, 16, 60),
    Case("PBF 2 M", "pbf", f"{SPACING}=0.0465", 4, 8, 60),
    Case("PBF 0.5 M", "pbf", f"{SPACING}=0.0738", 6, 0, 40),
    Case("FLIP 10 M", "flip", f"{CELL}=0.0544", 3, 0, 100),
    Case("PBF 10 M", "pbf", f"{SPACING}=0.0272", 2, 0, 100),
    Case("wave-city", "pbf", None, 24, 0, 60),
]
SMALL_CASES = [
    Case("PBF 0.01 M", "pbf", f"{SPACING}=0.28", 2, 3, 30),
    Case("FLIP 0.01 M", "flip", f"{CELL}=0.56", 2, 3, 30),
]

# Frame of wave-city that is rendered, its width and height, samples a pixel, and name.
SIZES = [("1080p", (1920, 1080), 16), ("4K", (3840, 2160), 16)]
SMALL_SIZES = [("tiny", (160, 90), 2)]


def steps(small):
    cases = SMALL_CASES if small else CASES
    sizes = SMALL_SIZES if small else SIZES
    table = [("plan", 60, partial(compare_plan, cases[0]))]
    table += [(f"start {what}", 60, partial(measure_start, what)) for what in STARTS]
    early = [case for case in cases if "10 M" not in case.name and case.key]
    late = [case for case in cases if case not in early]
    table += [(case.name, case.limit, partial(measure_bake, case)) for case in early]
    for name, size, samples in sizes:
        for method in ("splats", "rays"):
            work = partial(measure_pictures, method, size, samples)
            table.append((f"{name} {method}", 90, work))
    table += [(case.name, case.limit, partial(measure_bake, case)) for case in late]
    return [Step("speed", *row) for row in table]


def compare_plan(case, session):
    """Bytes on the device by `inspect`, and by the bake that follows the plan."""
    words = ("--solver", case.solver, "--set", case.key)
    ran = session.swell("inspect", "scenes/wave-city.toml", *words, "--json")
    plan = json.loads(ran.stdout)
    _, ran = session.bake("wave-city", case.solver, "1-1", "--set", case.key)
    baked = ran.event("ready")["bytes"]
    if plan["misfit"] or baked != plan["device_bytes"]:
        raise Failure(f"inspect plans {plan['device_bytes']} bytes, the bake {baked}")
    return {"summary": f"{case.name}: {baked / 1e6:.1f} MB by inspect and by bake", "bytes": baked}


def measure_bake(case, session):
    words = ("--set", case.key) if case.key else ()
    # The arguments are right: exit code 2 says that the adapter is too small.
    _, ran = session.bake(
        "wave-city", case.solver, f"1-{case.frames}", "--time-passes", *words, codes=(0, 2)
    )
    if ran.code == 2:
        raise DoesNotFit(f"{case.name}: {ran.event('error')['message']}")
    measured = {"solver": case.solver, **measure_passes(ran)}
    if case.whole:
        _, ran = session.bake("wave-city", case.solver, f"1-{case.whole}", *words)
        seconds = [event["seconds"] for event in frames_of(ran)]
        measured["whole_ms_per_frame"] = statistics.median(seconds[1:]) * 1e3
    measured["summary"] = (
        f"{measured['particles']} particles: {measured['ms_per_frame']:.2f} ms a frame in passes, "
        f"{measured['ns_per_particle_step']:.2f} ns a particle-step"
    )
    return measured


def frames_of(ran):
    return [event for event in ran.events() if event["event"] == "frame"]


def measure_passes(ran):
    """Sums over all passes of a bake with --time-passes."""
    ready, frames, event = ran.event("ready"), frames_of(ran), ran.event("passes")
    passes = event["passes"]
    seconds = sum(each["seconds"] for each in passes)
    substeps = sum(frame["report"]["substeps"] for frame in frames)
    if not (seconds > 0 and substeps > 0):
        raise Failure("no pass was timed")
    moved = sum(each["bytes"] or 0 for each in passes)
    slowest = sorted(passes, key=lambda each: -each["seconds"])[:6]
    bandwidth = event["bandwidth"]
    return {
        "particles": ready["particles"],
        "device_bytes": ready["bytes"],
        "frames": len(frames),
        "substeps": substeps,
        "ms_per_frame": seconds / len(frames) * 1e3,
        "ms_per_substep": seconds / substeps * 1e3,
        "ns_per_particle_step": seconds / substeps / ready["particles"] * 1e9,
        "gb_per_s": moved / seconds / 1e9,
        "bandwidth_gb_per_s": bandwidth and bandwidth / 1e9,
        "part_of_bandwidth": bandwidth and moved / seconds / bandwidth,
        "slowest": [describe_pass(each, seconds, bandwidth) for each in slowest],
    }


def describe_pass(each, total, bandwidth):
    rate = (each["bytes"] or 0) / each["seconds"] if each["seconds"] else 0
    return {
        "pass": each["pass"],
        "part_of_time": each["seconds"] / total,
        "ms_per_run": each["seconds"] / each["runs"] * 1e3,
        "gb_per_s": rate / 1e9,
        "part_of_bandwidth": bandwidth and rate / bandwidth,
        "waits_for": each["waits_for"],
    }


def measure_pictures(method, size, samples, session):
    """The second of two frames: the first one compiles."""
    if session.small:
        cache, last = session.quickstart("pbf")
    else:
        last = 60
        cache = session.cache("wave-city", "pbf", last)
    look = look_of(session, method, size, samples)
    _, ran = render(session, cache, look, f"{last - 1}-{last}")
    first, second = [event["seconds"] for event in frames_of(ran)]
    return {
        "summary": f"{second * 1e3:.0f} ms a frame with {samples} samples, the first "
        f"{first * 1e3:.0f} ms",
        "first_ms": first * 1e3,
        "ms_per_frame": second * 1e3,
        "samples": samples,
    }


# What is started: a bake of one frame by each solver, and one picture.
STARTS = ["bake pbf", "bake flip", "picture by splats"]


def measure_start(what, session):
    """The whole command, with shader caches of drivers that are empty, and again."""
    cache = session.cache("quickstart", "pbf", 4, "--set", COARSE["pbf"])
    look = look_of(session, "splats", (160, 90))
    folder = session.new_folder("shader-cache")
    folder.mkdir()
    names = ("XDG_CACHE_HOME", "MESA_SHADER_CACHE_DIR", "__GL_SHADER_DISK_CACHE_PATH")
    env = {name: str(folder) for name in names}

    def once():
        if what.startswith("picture"):
            return render(session, cache, look, 4, env=env)[1].seconds
        solver = what.split()[-1]
        words = ("--set", COARSE[solver])
        return session.bake("quickstart", solver, "1-1", *words, env=env)[1].seconds

    cold, warm = once(), min(once(), once())
    return {
        "summary": f"{cold:.2f} s cold, {warm:.2f} s warm",
        "cold_seconds": cold,
        "warm_seconds": warm,
    }
