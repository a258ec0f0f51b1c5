"""`manifest.json` and `frames.jsonl`: what was baked, and a line a frame, chained by BLAKE3 back to the manifest."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ._blake3 import hex_digests
from ._errors import CacheError, Damaged, NotACache, UnknownFormat
from ._files import FileRecord, read_bytes

MANIFEST = "manifest.json"
LEDGER = "frames.jsonl"
PARTICLES = "particles"
PROBES = "probes"
BODIES = "bodies"
GRIDS = "grids"
FORMATS = (1, 2)
_NEEDED: dict[str, type | tuple[type, ...]] = {
    "program_version": str,
    "shot": str,
    "solver": str,
    "scene_hash": str,
    "frames_per_second": (int, float),
    "particle_spacing": (int, float),
    "rest_density": (int, float),
    "attributes": list,
    "files": list,
}
_CHAIN = re.compile(rb'^(.*),"chain":"([0-9a-f]{64})"\}$', re.DOTALL)
_DIGEST = re.compile(r"[0-9a-f]{64}")
_STEM = re.compile(r"(?![.-])[A-Za-z0-9._-]+")

# Values of a frame by probe; a column that had nothing to measure is None.
Rows = list[list[float | None]]


@dataclass(frozen=True)
class Record:
    """One line of the ledger: a frame."""

    frame: int
    """Number; 0 is a scene's own start."""
    time: float
    """Simulated, seconds."""
    particles: int
    """Number of particles in the frame's file."""
    files: dict[str, FileRecord]
    """By stream: `particles`, and `grids` where the scene asks for them. Also of particles that were not kept."""
    rows: dict[str, Rows]
    """Probes' values, as they stand in the ledger, and states of bodies; `Cache.probes` and `Cache.bodies` have them as arrays."""
    clock: dict[str, Any]
    """Frame, time, substeps in the frame, steps since the start."""
    report: dict[str, Any] | None
    """The solver's report of the frame; None of the first."""
    chain: str = field(repr=False)
    """BLAKE3 of the previous line's and this line's contents, hexadecimal."""


def read_manifest(folder: Path) -> tuple[dict[str, Any], str]:
    """The manifest and its BLAKE3."""
    path = folder / MANIFEST
    if not path.is_file():
        raise NotACache(folder, f"it holds no cache: it has no {MANIFEST}")
    content = read_bytes(path)
    try:
        manifest = json.loads(content)
    except ValueError as error:
        raise Damaged(path, f"it is no JSON: {error}") from error
    if not isinstance(manifest, dict):
        raise Damaged(path, "it is no JSON object")
    found = manifest.get("format_version")
    if type(found) is not int or found not in FORMATS:
        raise UnknownFormat(folder, f"it has cache format {found}, and this package reads {FORMATS[0]} to {FORMATS[1]}")
    for key, kind in _NEEDED.items():
        if not isinstance(manifest.get(key), kind):
            raise Damaged(path, f"it has no `{key}`, or not a right one")
    if not _STEM.fullmatch(manifest["shot"]):
        raise Damaged(path, f"shot name `{manifest['shot']}` is no file name")
    for table in manifest.get(PROBES, []) + manifest.get(BODIES, []):
        if not _STEM.fullmatch(str(table.get("name", ""))):
            raise Damaged(path, f"probe or body name `{table.get('name')}` is no file name")
    return manifest, hex_digests([content])[0]


def first_frame(manifest: dict[str, Any]) -> int:
    """0, or the frame of another cache that the bake began from."""
    parent = manifest.get("parent")
    return int(parent["frame"]) if parent else 0


def read_ledger(folder: Path, manifest: dict[str, Any], manifest_digest: str) -> tuple[list[Record], bool]:
    """Every whole line, its chain checked; and whether half a line stands behind them."""
    path = folder / LEDGER
    *lines, torn = read_bytes(path).split(b"\n")
    if not lines:
        raise Damaged(path, "it has no whole line")
    records = [_parse_line(path, number, line, manifest) for number, line in enumerate(lines, 1)]
    _check_chain(folder, lines, records, manifest_digest)
    return records, torn != b""


def _check_chain(folder: Path, lines: list[bytes], records: list[Record], manifest_digest: str) -> None:
    """Each line is held against the recorded chain of the line before: all at once, and where all hold the chain holds."""
    path = folder / LEDGER
    recorded = json.loads(lines[0]).get("manifest")
    if not isinstance(recorded, str) or not _DIGEST.fullmatch(recorded):
        raise Damaged(path, "line 1: it does not name the manifest's hash")
    before = [recorded, *(record.chain for record in records)]
    messages = []
    for number, (line, previous) in enumerate(zip(lines, before, strict=False), 1):
        parts = _CHAIN.match(line)
        if parts is None:
            raise Damaged(path, f"line {number}: it does not end with its chained hash")
        messages.append(bytes.fromhex(previous) + parts[1] + b"}")
    for number, (record, digest) in enumerate(zip(records, hex_digests(messages), strict=True), 1):
        if digest != record.chain:
            raise Damaged(path, f"line {number}: its chained hash is off")
    if recorded != manifest_digest:
        raise Damaged(folder / MANIFEST, "its BLAKE3 is not the one in the ledger")


def _parse_line(path: Path, number: int, line: bytes, manifest: dict[str, Any]) -> Record:
    try:
        value = json.loads(line)
        record = _parse_record(path, value, int(manifest["format_version"]))
        if manifest.get(BODIES):
            record.rows[BODIES] = _states(value["bodies"], manifest)
    except CacheError:
        raise
    except (KeyError, TypeError, ValueError) as error:
        raise Damaged(path, f"line {number}: {error!r}") from error
    frame = first_frame(manifest) + number - 1
    if record.frame != frame or record.clock.get("frame") != frame:
        raise Damaged(path, f"line {number}: it is not frame {frame}")
    packed = ".zst" if manifest.get("compression") == "zstd" else ""
    expected = f"frames/{manifest['shot']}.{frame:04}.ply{packed}"
    if PARTICLES not in record.files or record.files[PARTICLES].file != expected:
        raise Damaged(path, f"line {number}: its particles are not {expected}")
    for stream in (PROBES, BODIES):
        if len(record.rows.get(stream, [])) != len(manifest.get(stream, [])):
            raise Damaged(path, f"line {number}: its {stream} are not those that the manifest announces")
    return record


def _states(bodies: list[dict[str, Any]], manifest: dict[str, Any]) -> Rows:
    """States of the bodies as rows: centre in world coordinates, rotation, velocity, spin."""
    origin = manifest.get("origin", [0.0, 0.0, 0.0])
    return [
        [*(at + shift for at, shift in zip(body["centre"], origin, strict=True)), *body["turn"], *body["velocity"], *body["spin"]]
        for body in bodies
    ]


def _parse_record(path: Path, value: dict[str, Any], version: int) -> Record:
    if version == 1:
        # The streams of that time, each with a place of its own.
        files = {PARTICLES: {key: value[key] for key in ("file", "bytes", "blake3")}}
        if value.get("grids"):
            files[GRIDS] = value["grids"]
        rows = {PROBES: value["probes"]} if value.get("probes") else {}
    else:
        files, rows = value["files"], value.get("rows", {})
    return Record(
        frame=int(value["frame"]),
        time=float(value["clock"]["time"]),
        particles=int(value["particles"]),
        files={stream: FileRecord.parse(record, path) for stream, record in files.items()},
        rows=rows,
        clock=value["clock"],
        report=value["report"],
        chain=str(value["chain"]),
    )
