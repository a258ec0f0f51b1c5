"""Reads what benchmarks and peers print, and writes the tables of docs/performance.md. Standard library only."""

from __future__ import annotations

import json
import math
import statistics
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

BEGIN, END = "<!-- tools/bench peers -->\n", "<!-- end -->"
# Errors that a run is judged by, of each kind of case; what else is measured stands beside them.
JUDGED = {"tank": ("density", "level"), "dam": ("front", "energy")}
# Below a thousandth water is at rest in every program, and what is left is rounding.
FLOOR = 1e-3


class Fault(Exception):
    """Output that is not what was asked for."""


def sample(text: str, particles: int) -> dict[str, Any]:
    """The JSON object of a timed run: `seconds` of each step or frame, positive, of so many `particles`."""
    try:
        told = json.loads(text)
        seconds = [float(s) for s in told["seconds"]]
        count = int(told["particles"])
    except (ValueError, TypeError, KeyError) as error:
        raise Fault(f"no timed run: {error!r} in {text[:200]!r}") from error
    if count != particles:
        raise Fault(f"{count} particles where the case has {particles}")
    if not seconds or not all(math.isfinite(s) and s > 0.0 for s in seconds):
        raise Fault(f"seconds of steps: {seconds}")
    return {**told, "seconds": seconds}


def bake_seconds(text: str, frames: int) -> list[float]:
    """Of a bake's JSON events, what each frame took to compute."""
    found = []
    for line in text.splitlines():
        try:
            event = json.loads(line)
        except ValueError as error:
            raise Fault(f"no event of a bake: {line[:200]!r}") from error
        if event.get("event") == "frame":
            found.append(float(event["seconds"]))
    if len(found) != frames or not all(math.isfinite(s) and s > 0.0 for s in found):
        raise Fault(f"{len(found)} frames of {frames}, seconds {found}")
    return found


def spread(values: list[float], digits: int = 2) -> str:
    """Median, and least to most."""
    middle = statistics.median(values)
    return f"{middle:.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


@dataclass
class Timed:
    """A program's time in each round of a case of the same settings."""

    program: str
    rounds: list[float] = field(default_factory=list)


@dataclass
class Row:
    """A setting's errors and its time in each round: seconds a second of the shot."""

    program: str
    words: str
    errors: dict[str, float] = field(default_factory=dict)
    rounds: list[float] = field(default_factory=list)
    failed: str = ""

    @property
    def seconds(self) -> float:
        return statistics.median(self.rounds)


def markdown(titles: list[str], rows: list[list[str]]) -> str:
    lines = [titles, ["---"] * len(titles), *rows]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def speed_table(words: str, unit: str, peer: str, ours: list[Timed], theirs: Timed | None, missing: str) -> str:
    """The same settings: times, and the peer's over ours round by round."""
    rows = []
    for timed in ours:
        if theirs is None:
            ratio = f"{peer}: {missing}"
        else:
            ratio = spread([b / a for a, b in zip(timed.rounds, theirs.rounds, strict=True)])
        rows.append([timed.program, spread(timed.rounds), ratio])
    if theirs is not None:
        rows.append([theirs.program, spread(theirs.rounds), "1"])
    return f"{words}:\n\n" + markdown(["program", unit, f"time of {peer} over it"], rows)


def is_no_worse(row: Row, than: Row, kind: str) -> bool:
    """Whether neither of its errors is larger, down to the floor."""
    return not row.failed and all(abs(row.errors[name]) <= max(FLOOR, abs(than.errors[name])) for name in JUDGED[kind])


def cheapest(row: Row, rows: list[Row], kind: str) -> str:
    """Of the other programs' settings that are no worse, the one that costs least, with this row's time over its own."""
    is_ours = row.program.startswith("swell")
    others = [r for r in rows if r.program.startswith("swell") != is_ours]
    if not others or row.failed:
        return "–"
    good = [r for r in others if is_no_worse(r, row, kind)]
    if not good:
        return "none is as good"
    best = min(good, key=lambda r: r.seconds)
    ratios = [a / b for a, b in zip(row.rounds, best.rounds, strict=True)]
    return f"{best.program}, {best.words}: {spread(ratios)}"


def shown(name: str, value: float) -> str:
    """An error with its unit."""
    if name == "speed":
        return f"{value:.2g} m/s"
    percent = 100.0 * value
    return f"{percent:+.2g} %" if name == "energy" else f"{percent:.2g} %"


def error_table(words: str, kind: str, rows: list[Row]) -> str:
    """Errors against time, a line for each setting."""
    names = list(dict.fromkeys(name for row in rows for name in row.errors))
    lines = []
    for row in rows:
        if row.failed:
            lines.append([row.program, row.words, row.failed, *["–"] * (len(names) + 1)])
            continue
        told = [shown(name, row.errors[name]) for name in names]
        lines.append([row.program, row.words, *told, spread(row.rounds), cheapest(row, rows, kind)])
    titles = ["program", "settings", *names, "s a second of the shot", "the other's cheapest that is no worse, and time over its"]
    return f"{words}:\n\n" + markdown(titles, lines)


def place(page: str, text: str, name: str) -> str:
    """The page with this text between its markers."""
    if page.count(BEGIN) != 1 or END not in page.split(BEGIN)[1]:
        raise Fault(f"{name} has no place for the peers: `{BEGIN.strip()}` and `{END}`")
    before, rest = page.split(BEGIN)
    return f"{before}{BEGIN}\n{text}\n{END}{rest.split(END, 1)[1]}"


def write(path: Path, text: str) -> None:
    """Puts the tables into a page."""
    path.write_text(place(path.read_text(), text, path.name))
