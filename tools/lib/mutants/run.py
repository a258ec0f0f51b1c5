"""Each fault switched on, and the tests that should see it."""

import os
import re
import shutil
import subprocess
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from .build import Tree, binary_of
from .lists import Mistake, Mutant

# Every shader has to parse and validate with the fault in it: what does not compile is caught by anything.
VALIDATES = "lib::gpu::variants::tests::every_pass_validates_in_every_variant"
# How `gpu::program` refuses a spoil whose text a shader lacks.
NOT_THERE = "which is to be replaced, is not in it"
# A fault that turns a loop endless is caught as well; no test of the suite takes a tenth of it.
SECONDS = 600


@dataclass(frozen=True)
class Result:
    """What became of one fault."""

    mutant: Mutant
    caught_by: str | None
    seconds: float

    @property
    def survived(self) -> bool:
        return self.caught_by is None and self.mutant.reason is None


def passes(tree: Tree, binaries: dict[str, Path], test: str, fault: dict[str, str]) -> bool:
    """Runs one test alone. Raises Mistake where there is no such test."""
    binary = binary_of(test)
    name = test.removeprefix(f"{binary}::")
    command = [str(binaries[binary]), name, "--exact", "--include-ignored"]
    environment = os.environ | {"CARGO_MANIFEST_DIR": str(tree.root), "RUST_BACKTRACE": "0"} | fault
    try:
        done = subprocess.run(
            command, cwd=tree.root, env=environment, capture_output=True, text=True, errors="replace", timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return False
    if NOT_THERE in done.stdout + done.stderr:
        # The mutant took the text that a control of the test itself replaces: nothing was seen of the mutant.
        return True
    if done.returncode == 0 and not re.search(r"^test result: ok\. 1 passed", done.stdout, re.MULTILINE):
        raise Mistake(f"there is no test {test}")
    return done.returncode == 0


def one_of(tree: Tree, binaries: dict[str, Path], mutant: Mutant) -> Result:
    """The first of the mutant's tests that fails caught it."""
    start = time.monotonic()
    if not mutant.is_shader:
        fault = {"SWELL_MUTANT": str(mutant.number)}
    else:
        folder = tree.work / mutant.name
        shutil.copytree(tree.shaders, folder, dirs_exist_ok=True)
        file = folder / Path(mutant.file).relative_to("shaders")
        file.write_text(file.read_text().replace(mutant.before, mutant.after))
        fault = {"SWELL_SHADERS": str(folder)}
    try:
        if mutant.is_shader and not passes(tree, binaries, VALIDATES, fault):
            raise Mistake(f"{mutant.name}: the shader with the fault in it does not validate")
        for test in mutant.caught_by:
            if not passes(tree, binaries, test, fault):
                return Result(mutant, test, time.monotonic() - start)
        return Result(mutant, None, time.monotonic() - start)
    finally:
        if mutant.is_shader:
            shutil.rmtree(folder)


def all_of(tree: Tree, mutants: list[Mutant], binaries: dict[str, Path], jobs: int) -> list[Result]:
    """Every test without a fault first, then every mutant, `jobs` at a time."""
    tests = sorted({name for mutant in mutants for name in mutant.caught_by} | {VALIDATES})
    tree.work.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(jobs) as pool:
        print(f"{len(tests)} tests without a fault", flush=True)
        sound = list(pool.map(lambda test: passes(tree, binaries, test, {}), tests))
        failing = [test for test, ok in zip(tests, sound) if not ok]
        if failing:
            raise Mistake("these tests fail without any fault: " + ", ".join(failing))
        print(f"{len(mutants)} mutants", flush=True)
        return list(pool.map(told(lambda mutant: one_of(tree, binaries, mutant)), mutants))


def told(judge: Callable[[Mutant], Result]) -> Callable[[Mutant], Result]:
    """The same, with a line for each result."""

    def judged(mutant: Mutant) -> Result:
        result = judge(mutant)
        words = result.caught_by or ("SURVIVES" if result.survived else f"stands: {mutant.reason}")
        print(f"{result.seconds:6.1f} s  {mutant.area}/{mutant.name}: {words}", flush=True)
        return result

    return judged
