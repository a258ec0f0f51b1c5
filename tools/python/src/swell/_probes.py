"""What probes measured and where bodies were: arrays from the ledger, and the CSV files that follow from it."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import Damaged
from ._files import read_bytes
from ._ledger import PROBES, Record

_Values = list[float | None]


class Probe:
    """One probe: `probe["elevation_m"]` is an array with a value a look, NaN where there was nothing to measure.

    Or the states of a body, of which every frame has a row.
    """

    def __init__(self, record: Mapping[str, Any], index: int, ledger: list[Record], stream: str = PROBES) -> None:
        self._stream = stream
        self.name: str = record["name"]
        self.kind: str = record["kind"]
        """As scenes name it: `elevation`, `pressure`, …; `body` for a body."""
        self.at: list[float] = record["at"]
        """World coordinates that it looks at, metres."""
        self.rate_hz: float | str | None = record.get("rate_hz")
        """Looks a second, or `substep`; None where it looks at frames' ends."""
        window = record.get("window")
        measured: list[str] = record["columns"]
        self.columns: list[str] = [name for column in measured for name in _with_window(column, window)]
        """Names, each with its unit at the end. With a window each is followed by its mean, least and greatest value over it."""
        seen = _Window(float(window)) if window is not None else None
        frames: list[int] = []
        times: list[float] = []
        rows: list[_Values] = []
        for entry in ledger:
            for time, values in _looks(entry.rows[stream][index], entry.time, len(measured), self.rate_hz is not None):
                frames.append(entry.frame)
                times.append(time)
                rows.append(seen.take(time, values) if seen else values)
        self._rows = rows
        self.frame: NDArray[np.int64] = np.array(frames, dtype=np.int64)
        """(n,): the frame of each look."""
        self.time: NDArray[np.float64] = np.array(times, dtype=np.float64)
        """(n,): seconds from the shot's start."""
        self._table = np.array(rows, dtype=np.float64).reshape(len(rows), len(self.columns))

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        if column not in self.columns:
            raise KeyError(f"probe {self.name} has no column {column!r}; it has {', '.join(self.columns)}")
        return self._table[:, self.columns.index(column)]

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"<swell.Probe {self.name}: {self.kind}, {len(self)} looks at {', '.join(self.columns)}>"

    def text(self) -> str:
        """Text of `probes/NAME.csv` or `bodies/NAME.csv`, as it has to be."""
        lines = [",".join(["frame", "time_s", *self.columns])]
        for frame, time, values in zip(self.frame.tolist(), self.time.tolist(), self._rows, strict=True):
            lines.append(",".join([str(frame), _shown(time), *("" if value is None else _shown(value) for value in values)]))
        return "\n".join(lines) + "\n"

    def check(self, folder: Path) -> None:
        """Raises `Damaged` where the CSV file does not say what the ledger says."""
        path = folder / self._stream / f"{self.name}.csv"
        found, expected = read_bytes(path).split(b"\n"), self.text().encode().split(b"\n")
        if found != expected:
            same = next((k for k, (a, b) in enumerate(zip(found, expected, strict=False)) if a != b), min(len(found), len(expected)))
            raise Damaged(path, f"line {same + 1} is not what the ledger has (a bake that runs now may be writing it)")


def _looks(values: _Values, end: float, columns: int, has_rate: bool) -> list[tuple[float, _Values]]:
    """Looks of one frame, which ended at `end`: with a rate of its own each begins with its time."""
    if not has_rate:
        return [(end, values)] if values else []
    width = columns + 1
    looks = [values[first : first + width] for first in range(0, len(values), width)]
    return [(end if look[0] is None else float(look[0]), look[1:]) for look in looks]


def _with_window(column: str, window: object) -> list[str]:
    if window is None:
        return [column]
    name, _, unit = column.rpartition("_")
    return [column, *(f"{name}_{what}_{unit}" for what in ("mean", "min", "max"))]


def _shown(value: float) -> str:
    """The shortest decimals that read back as the same number, as swell writes them."""
    text = repr(float(value))
    if "e" not in text:
        return text
    digits, exponent = text.split("e")
    return f"{digits}e{int(exponent)}"


class _Window:
    """Mean, least and greatest value of each column over the `length` seconds up to each look: a value holds since the look before."""

    def __init__(self, length: float) -> None:
        self.length = length
        self.held: deque[tuple[float, float, _Values]] = deque()
        self.last: float | None = None

    def take(self, time: float, values: _Values) -> _Values:
        """A look's values, each followed by its three of the window."""
        since = time if self.last is None else self.last
        self.last = time
        self.held.append((since, time, values))
        begin = time - self.length
        # A look on the window's edge is out of it, and round-off must not let it in.
        edge = begin + 1e-9 * self.length
        while self.held and self.held[0][1] <= edge:
            self.held.popleft()
        row: _Values = []
        for column, value in enumerate(values):
            row += [value, *self._of(column, begin)]
        return row

    def _of(self, column: int, begin: float) -> _Values:
        seen = [(end - max(start, begin), value) for start, end, held in self.held if (value := held[column]) is not None]
        if not seen:
            return [None, None, None]
        # One after the other, as swell adds them: `sum` may round otherwise.
        total = weighted = 0.0
        for span, value in seen:
            total += span
            weighted += span * value
        mean = weighted / total if total > 0.0 else seen[-1][1]
        values = [value for _, value in seen]
        return [mean, min(values), max(values)]
