"""Steps that compare what the adapter computes: with baselines, with itself, with f64."""

import json
import re
import shutil
from functools import partial

from .session import COARSE, Failure, Step

# The scenes of tests/baselines: last frame as in tools/regress, and last frame with --small.
BASELINES = {
    "quickstart": (24, 2),
    "dam-break": (8, 2),
    "wave-tank": (20, 2),
    "wave-city": (6, 1),
}

# Coarse starts of scenes with solids, drag, emitters, viscosity and surface tension. harbour by PBF
# is left out: on lavapipe, lists of its start differ from those of the reference.
STARTS = [
    ("wave-tank", "pbf", "solver.pbf.particle_spacing=0.3"),
    ("wave-tank", "flip", "solver.flip.cell_size=0.5"),
    ("breaker", "pbf", "solver.pbf.particle_spacing=0.4"),
    ("breaker", "flip", "solver.flip.cell_size=0.6"),
    ("harbour", "flip", "solver.flip.cell_size=0.5"),
    ("droplets", "pbf", "solver.pbf.particle_spacing=0.001"),
    ("droplets", "flip", "solver.flip.cell_size=0.002"),
]

# One constant in a pass of each solver, off by a thousandth: the row of that pass has to fail.
SPOILED = {
    "pbf": ("pbf/compute_lambda", "kernel_sum = 1.0;", "kernel_sum = 1.001;"),
    "flip": ("flip/survey", "dot(v, v)", "dot(v, v) * 1.001"),
}

# Names in scenes/studies/hard-cases.toml; each takes seconds on lavapipe.
HARD_SMALL = [
    "coincident particles",
    "isolated drops",
    "closed box, no air",
    "nothing to solve for",
]
HARD_CASES = HARD_SMALL + [
    "film one particle thick",
    "two pockets and a tank",
    "piston faster than the CFL limit",
    "wall a quarter of a cell thick, at 0.825",
    "gap of half a cell",
    "at rest about a hanging box",
    "over-dense start",
]


def steps(small):
    table = []
    for scene, lasts in BASELINES.items():
        for solver in SPOILED:
            work = partial(compare_with_baseline, scene, solver, lasts[small])
            table.append((f"baseline {scene} {solver}", 60, work))
    table.append(("control: other gravity misses a baseline", 30, miss_a_baseline))
    for solver in SPOILED:
        table += [
            (f"check {solver}", 60, partial(check_quickstart, solver)),
            (f"check {solver}, last substep", 60, partial(check_last_substep, solver)),
            (f"control: spoiled shader {solver}", 30, partial(see_spoiled_shader, solver)),
            (f"same bytes twice {solver}", 60, partial(bake_twice, solver)),
            (f"same bytes resumed {solver}", 60, partial(bake_interrupted, solver)),
        ]
    for scene, solver, key in STARTS:
        work = partial(check_start, scene, solver, key)
        table.append((f"check start of {scene} {solver}", 30, work))
    table += [
        ("hard cases", 90, run_hard_cases),
        ("whitewater", 60, make_whitewater),
        ("check pictures", 60, check_pictures),
    ]
    return [Step("correctness", *row) for row in table]


def compare_with_baseline(scene, solver, last, session):
    if (scene, last) == ("quickstart", BASELINES["quickstart"][0]):
        cache, last = session.quickstart(solver)
    else:
        cache, _ = session.bake(scene, solver, f"1-{last}")
    count = diff_with_baseline(session, scene, solver, cache, last)
    return {"summary": f"frames 0-{last}: {count} aggregates within tolerance"}


def diff_with_baseline(session, scene, solver, cache, last):
    """How many aggregates were compared; a Failure where one is out of tolerance."""
    baseline = f"tests/baselines/{scene}-{solver}.json"
    ran = session.swell(
        *("diff", cache, baseline, "--frames", f"0-{last}", "--ignore-hashes", "--json"),
        codes=(0, 1),
    )
    diff = json.loads(ran.stdout)["diff"]
    if ran.code == 1:
        first, rest = diff["faults"][0], len(diff["faults"]) - 1
        fault = first["fault"]
        raise Failure(
            f"frame {first['frame']}: {fault['what']} is off by {fault['value']:.3g}, allowed "
            f"{fault['limit']:.3g}; {rest} more"
        )
    compared = sum(len(frame["limits"]) for frame in diff["frames"])
    if compared == 0:
        raise Failure("no aggregate was compared")
    return compared


def miss_a_baseline(session):
    last = 2 if session.small else BASELINES["dam-break"][0]
    cache, _ = session.bake("dam-break", "pbf", f"1-{last}", "--set", "water.gravity=[0,-9.9,0]")
    try:
        diff_with_baseline(session, "dam-break", "pbf", cache, last)
    except Failure as error:
        return {"summary": f"as it has to: {error}"}
    raise Failure("a bake with 1 % more gravity passes as the baseline's")


def check(session, *words):
    """The result of `swell check --json`, with the exit code."""
    ran = session.swell("check", *words, "--json", codes=(0, 1))
    result = json.loads(ran.stdout)
    result["code"] = ran.code
    if not result["rows"]:
        raise Failure("the check compared nothing")
    return result


def passing_check(session, subject, *words):
    """A check that has to hold. Its rows are kept for the table of those nearest to tolerance."""
    result = check(session, *words)
    session.rows += [(subject, row) for row in result["rows"] if row["worst"] and not row["over"]]
    over = [row for row in result["rows"] if row["over"]]
    if over or not result["within"]:
        named = ", ".join(f"{row['pass']} ({row['name']})" for row in over[:5])
        raise Failure(f"{len(over)} of {len(result['rows'])} rows out of tolerance: {named}")
    nearest = max(row["worst"]["ratio"] for row in result["rows"] if row["worst"])
    return {
        "summary": f"{len(result['rows'])} rows within tolerance, the nearest at {nearest:.2f}",
        "rows": len(result["rows"]),
    }


def check_quickstart(solver, session):
    cache, last = session.quickstart(solver)
    return passing_check(session, f"quickstart {solver}", cache, "--frames", f"1,{last}")


def check_last_substep(solver, session):
    cache, last = session.quickstart(solver)
    frame = last - 1
    words = (cache, "--frames", frame, "--substep", "last")
    return passing_check(session, f"quickstart {solver}, last substep", *words)


def check_start(scene, solver, key, session):
    words = (f"scenes/{scene}.toml", "--solver", solver, "--set", key)
    return passing_check(session, f"{scene} {solver}, start", *words)


def see_spoiled_shader(solver, session):
    name, old, new = SPOILED[solver]
    shaders = session.new_folder(f"shaders-{solver}")
    shutil.copytree(session.root / "shaders", shaders)
    file = shaders / f"{name}.wgsl"
    text = file.read_text(encoding="utf-8")
    if text.count(old) != 1:
        raise Failure(f"shaders/{name}.wgsl has not one `{old}` to spoil")
    file.write_text(text.replace(old, new), encoding="utf-8")
    # A coarse cache: what is looked for does not depend on size.
    cache = session.cache("quickstart", solver, 4, "--set", COARSE[solver])
    result = check(session, cache, "--frames", 4, "--shaders", shaders)
    over = sorted({row["pass"] for row in result["rows"] if row["over"]})
    if result["code"] != 1 or name not in over:
        raise Failure(f"the row of {name} does not fail with `{new}`; failing: {over or 'none'}")
    return {"summary": f"`{new}` fails the rows of {', '.join(over)}", "failing": over}


def bake_twice(solver, session):
    first, last = session.quickstart(solver)
    again, _ = session.bake("quickstart", solver, f"1-{last}", *sets(session, solver))
    compare_bits(session, again, first)
    return {"summary": f"{last} frames are the same, bit for bit"}


def bake_interrupted(solver, session):
    """A bake that gets SIGINT after a quarter of its frames and is resumed."""
    whole, last = session.quickstart(solver)
    words = sets(session, solver)
    frames = f"1-{last}"
    cache, ran = session.bake(
        "quickstart", solver, frames, *words, codes=(0, 130), stop_after=max(last // 4, 1)
    )
    if ran.code == 0:
        # A fast card was done before the signal came.
        cache, ran = session.bake("quickstart", solver, f"1-{last // 2}", *words)
    stopped = ran.event("end")["last_frame"]
    session.swell(
        *("bake", "scenes/quickstart.toml", "--solver", solver, "--frames", frames, "-o", cache),
        *("--resume", "--progress", "json"),
        *words,
    )
    compare_bits(session, cache, whole)
    session.swell("verify", cache)
    how = "interrupted" if ran.code == 130 else "ended"
    return {"summary": f"{how} after frame {stopped}, resumed: same bits to frame {last}"}


def sets(session, solver):
    return ("--set", COARSE[solver]) if session.small else ()


def compare_bits(session, cache, reference):
    ran = session.swell("diff", cache, reference, codes=(0, 1))
    if ran.code == 1:
        differing = [line for line in ran.stdout.splitlines() if "frame" in line]
        raise Failure(f"other bits: {' '.join(differing[:1])[:200]}")


def run_hard_cases(session):
    text = (session.root / "scenes/studies/hard-cases.toml").read_text(encoding="utf-8")
    head, *cases = text.split("[[case]]")
    chosen = []
    for name in HARD_SMALL if session.small else HARD_CASES:
        found = [case for case in cases if f'\nname = "{name}"\n' in case]
        if len(found) != 1:
            raise Failure(f"hard-cases.toml has not one case `{name}`")
        chosen += found
    study = session.new_folder("hard.toml")
    text = "[[case]]".join([head] + chosen)
    study.write_text(text.replace("../..", str(session.root)), encoding="utf-8")
    words = ("-o", session.new_folder("hard"), "--progress", "plain")
    ran = session.swell("study", study, *words, codes=(0, 1))
    said = re.findall(r"^marks: .*", ran.stdout + ran.stderr, re.MULTILINE)
    if ran.code == 1 or not said:
        raise Failure(f"{len(chosen)} cases: {said[0] if said else 'no marks'}")
    return {"summary": f"{len(chosen)} cases, {said[0]}"}


def make_whitewater(session):
    """On the whole shot, coarse: nothing is born before the wave breaks."""
    cache = session.cache("quickstart", "flip", 72, "--set", COARSE["flip"])
    ran = session.swell("whitewater", cache, "--progress", "json")
    born = sum(event["born"] for event in ran.events() if event["event"] == "frame")
    if born == 0:
        raise Failure("nothing was born in 72 frames")
    stream = cache / "whitewater/default"
    session.swell("verify", stream)
    result = passing_check(session, "whitewater", stream, "--frames", "48,70")
    return {"summary": f"{born} born; {result['summary']}", "born": born}


def check_pictures(session):
    cache, last = session.quickstart("pbf")
    look = session.root / "scenes/looks/day.toml"
    words = ("--render", "--look", look, "--frames", last, "--json")
    ran = session.swell("check", cache, *words, codes=(0, 1))
    result = json.loads(ran.stdout)
    measured = {}
    for row in result["rows"]:
        surface = row["surface"]
        measured[row["method"]] = {
            "depth_p95_spacings": surface["depth"][1],
            "normal_median_degrees": surface["normal"][0],
            "overlap": surface["overlap"],
        }
    summary = "; ".join(
        f"{method}: depth {of['depth_p95_spacings']:.3f} spacings at 95 %, "
        f"normal {of['normal_median_degrees']:.2f}°, overlap {of['overlap']:.3f}"
        for method, of in measured.items()
    )
    if ran.code == 1 or not result["within"] or not measured:
        raise Failure(f"beyond the pass mark: {summary}")
    # Rays have a pass mark of the program; splats are only refused where they miss the water.
    if min(of["overlap"] for of in measured.values()) < 0.9:
        raise Failure(f"the water's outline is elsewhere: {summary}")
    return {"summary": summary, "measured": measured}
