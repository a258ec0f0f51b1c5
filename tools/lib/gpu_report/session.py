"""Runs swell with time limits, and keeps the caches that several steps share."""

import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Callable, NamedTuple

# A step starts only while this part of its limit is left of the whole time.
LEAST_PART = 0.2

# Limits of steps are for GPUs; a software adapter, on cores that are shared, gets more.
SOFTWARE_FACTOR = 4

# Coarse enough for a software adapter: 1 620 particles of the quickstart by either solver.
COARSE = {"pbf": "solver.pbf.particle_spacing=0.5", "flip": "solver.flip.cell_size=1"}


class Failure(Exception):
    """What a step found wrong."""


class DoesNotFit(Exception):
    """The adapter is too small for a case: no fault."""


class Interrupted(BaseException):
    """A signal; not an Exception, so that no step takes it for its own failure."""


class Step(NamedTuple):
    group: str
    name: str
    limit: float  # seconds
    function: Callable  # takes the session; returns a dictionary with at least "summary"


class Ran(NamedTuple):
    code: int
    stdout: str
    stderr: str
    seconds: float

    def events(self):
        return [json.loads(line) for line in self.stdout.splitlines() if line.startswith("{")]

    def event(self, kind):
        """The last event of a kind."""
        found = [event for event in self.events() if event["event"] == kind]
        if not found:
            raise Failure(f"no event `{kind}` on standard output")
        return found[-1]


def last_line(text):
    """What a program said last, for a message."""
    lines = [line for line in text.splitlines() if line.strip() and line[0] != "{"]
    return lines[-1].strip()[:300] if lines else "it printed nothing"


class Session:
    def __init__(self, root, options, output):
        self.root = root
        self.binary = options.binary
        self.small = options.small
        self.software = options.software
        self.minutes = options.minutes
        self.output = output
        self.work = Path(tempfile.mkdtemp(prefix="swell-gpu-report-"))
        self.start = time.monotonic()
        self.step_end = self.start
        self.log = None
        self.caches = {}
        self.device = {}  # filled by the step `device`
        self.rows = []  # rows of every check: (subject, row)
        logs = output / "logs"
        shutil.rmtree(logs, ignore_errors=True)
        logs.mkdir()

    def left(self):
        """Seconds left of the whole time."""
        return self.start + self.minutes * 60 - time.monotonic()

    def begin(self, step):
        limit = step.limit * (SOFTWARE_FACTOR if self.software else 1)
        self.step_end = time.monotonic() + min(limit, self.left())
        name = re.sub(r"[^a-z0-9]+", "-", f"{step.group} {step.name}".lower()).strip("-")
        self.log = self.output / "logs" / f"{name}.log"

    def swell(self, *words, codes=(0,), env=None, stop_after=None):
        """Runs a command of swell and returns a `Ran`. Another exit code than `codes`, or the
        step's limit, is a Failure. With `stop_after` it gets SIGINT after that many frames."""
        words = [str(word) for word in words]
        began = time.monotonic()
        # Files instead of pipes: nothing is lost when a run is stopped while its events are read.
        paths = [self.work / "stdout", self.work / "stderr"]
        with open(paths[0], "w") as stdout, open(paths[1], "w") as stderr:
            process = subprocess.Popen(
                [str(self.binary)] + words,
                cwd=self.root,
                env={**os.environ, **(env or {})},
                stdin=subprocess.DEVNULL,
                stdout=stdout,
                stderr=stderr,
                start_new_session=True,
            )
        is_late = False
        try:
            if stop_after:
                self.stop_after_frames(process, paths[0], stop_after)
            process.wait(timeout=max(self.step_end - time.monotonic(), 0.1))
        except subprocess.TimeoutExpired:
            is_late = True
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        texts = [path.read_text(encoding="utf-8", errors="replace") for path in paths]
        ran = Ran(process.returncode, *texts, time.monotonic() - began)
        self.note(words, ran)
        if is_late:
            raise Failure(f"`swell {words[0]}` took longer than the step's limit")
        if ran.code not in codes:
            said = last_line(ran.stderr) if ran.stderr.strip() else last_line(ran.stdout)
            raise Failure(f"`swell {words[0]}` ended with {ran.code}: {said}")
        return ran

    def stop_after_frames(self, process, stdout, count):
        """Sends SIGINT once the events on standard output report so many frames."""
        while process.poll() is None and time.monotonic() < self.step_end:
            if stdout.read_text(encoding="utf-8").count('"event":"frame"') >= count:
                process.send_signal(signal.SIGINT)
                return
            time.sleep(0.002)

    def note(self, words, ran):
        with open(self.log, "a", encoding="utf-8") as log:
            log.write(f"$ swell {' '.join(words)}\n{ran.stdout}{ran.stderr}")
            log.write(f"exit code {ran.code} after {ran.seconds:.2f} s\n\n")

    def new_folder(self, name):
        """A path in the work folder that nothing has used."""
        count = sum(1 for _ in self.work.iterdir())
        return self.work / f"{count:03}-{name}"

    def bake(self, scene, solver, frames, *words, **keywords):
        """Bakes into a new cache; returns its folder and the `Ran` with its events."""
        cache = self.new_folder(f"{scene}-{solver}")
        cache.mkdir()
        ran = self.swell(
            *("bake", f"scenes/{scene}.toml", "--solver", solver, "--frames", frames),
            *("-o", cache, "--progress", "json"),
            *words,
            **keywords,
        )
        return cache, ran

    def cache(self, scene, solver, last, *words):
        """Frames 1 to `last` of a scene, baked once for all steps that ask for the same."""
        key = (scene, solver, last, words)
        if key not in self.caches:
            self.caches[key], _ = self.bake(scene, solver, f"1-{last}", *words)
        return self.caches[key]

    def quickstart(self, solver):
        """The cache on which checks run, and its last frame: of the shipped quickstart, which the
        baselines need as well, or with --small of a coarse one."""
        if self.small:
            return self.cache("quickstart", solver, 4, "--set", COARSE[solver]), 4
        return self.cache("quickstart", solver, 24), 24

    def remove_work(self):
        shutil.rmtree(self.work, ignore_errors=True)


def run_step(session, step):
    """The result of a step, whatever happens in it; only a signal ends it otherwise."""
    began = time.monotonic()
    result = {"group": step.group, "name": step.name, "status": "passed"}
    if session.left() < step.limit * LEAST_PART:
        left = f"{max(session.left(), 0):.0f} s were left of {session.minutes:g} min"
        result.update(status="not run", summary=left)
    else:
        session.begin(step)
        try:
            result.update(step.function(session))
        except Failure as error:
            is_cut = session.left() <= 0
            result.update(status="not run" if is_cut else "failed", summary=str(error))
            if is_cut:
                result["summary"] = f"cut off by --minutes {session.minutes:g}"
        except DoesNotFit as error:
            result.update(status="does not fit", summary=str(error))
        except Exception as error:  # a fault of the tool must not end the other steps
            result.update(status="failed", summary=f"{type(error).__name__}: {error}")
    result["seconds"] = round(time.monotonic() - began, 2)
    return result
