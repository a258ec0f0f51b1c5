"""A cache: the folder that `swell bake`, `swell whitewater` or `swell wet` wrote."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from ._blake3 import hex_digests
from ._errors import CacheError, Damaged, MissingFrame
from ._files import FileRecord, faults, read_bytes
from ._frame import Frame
from ._ledger import BODIES, GRIDS, LEDGER, MANIFEST, PARTICLES, Record, read_ledger, read_manifest
from ._probes import Probe

_SCENE = "scene.toml"
_FAILED_DIGEST = re.compile(rb'^  "blake3": "([0-9a-f]{64})",\n', re.MULTILINE)


class Cache:
    """An open cache, never written to.

    Opening reads and checks the manifest, the ledger's chain, the scene and its meshes. A frame's checksum is looked at when the frame
    is opened, and `verify` looks at all. `check=False` leaves out the checksums of frames, meshes and grids.

    Frames are addressed by their numbers, as file names have them: `cache[120]`. Iteration and `len` take the frames that have
    particles: all of them unless the scene has a `[keep]`. A bake may go on meanwhile; open the cache anew to see its new frames.
    """

    def __init__(self, path: str | os.PathLike[str], *, check: bool = True) -> None:
        self.path = Path(path)
        """The folder."""
        self._check = check
        self.manifest: dict[str, Any]
        """`manifest.json`: shot, solver, device, spacing (m), frames a second, density (kg/m³), …"""
        self.manifest, digest = read_manifest(self.path)
        self.ledger: list[Record]
        """A record a frame without gaps, the first frame's first; never empty."""
        self.ledger, self._is_torn = read_ledger(self.path, self.manifest, digest)
        self._files = [FileRecord.parse(value, self.path / MANIFEST) for value in self.manifest["files"]]
        scene = [record for record in self._files if record.file == _SCENE]
        if not scene:
            raise Damaged(self.path / MANIFEST, f"it names no {_SCENE}")
        for problem in faults(self.path, self._files if check else scene):
            raise problem

    @property
    def shot(self) -> str:
        """Name of the shot, which the files carry."""
        return str(self.manifest["shot"])

    @property
    def solver(self) -> str:
        """`pbf`, `flip`, `whitewater` or `wet`."""
        return str(self.manifest["solver"])

    @property
    def frames_per_second(self) -> float:
        """Frames a second of simulated time."""
        return float(self.manifest["frames_per_second"])

    @property
    def particle_spacing(self) -> float:
        """Distance of particles at rest, metres: each stands for its cube of water."""
        return float(self.manifest["particle_spacing"])

    @property
    def first_frame(self) -> int:
        """0, or the frame of another cache that the bake began from."""
        return self.ledger[0].frame

    @property
    def last_frame(self) -> int:
        """Newest frame of the ledger."""
        return self.ledger[-1].frame

    @cached_property
    def frames(self) -> list[int]:
        """Numbers of the frames that have particles, ascending."""
        return [record.frame for record in self.ledger if self._is_kept(record.frame)]

    @cached_property
    def scene(self) -> dict[str, Any]:
        """The scene as baked, every default written out."""
        path = self.path / _SCENE
        try:
            return tomllib.loads(read_bytes(path).decode())
        except ValueError as error:
            raise Damaged(path, f"it is no TOML: {error}") from error

    @cached_property
    def assets(self) -> dict[str, Path]:
        """The scene's own files (meshes of solids) by the names that `scene` gives them; those of whitewater's settings too."""
        names = [record.file for record in self._files if record.file != _SCENE]
        return {name.removeprefix("assets/"): self.path / name for name in names}

    @cached_property
    def probes(self) -> dict[str, Probe]:
        """Probes by name; empty where the scene has none."""
        records = self.manifest.get("probes", [])
        return {record["name"]: Probe(record, index, self.ledger) for index, record in enumerate(records)}

    @cached_property
    def bodies(self) -> dict[str, Probe]:
        """States of the bodies by name, as columns: centre of mass (world), rotation from the start as a quaternion, velocity, spin."""
        records = self.manifest.get(BODIES, [])
        return {record["name"]: Probe(record, index, self.ledger, BODIES) for index, record in enumerate(records)}

    @cached_property
    def grids(self) -> Grids:
        """OpenVDB files by frame number; empty where the scene asks for none."""
        return Grids(self.path, self.manifest.get("grids"), self.ledger, self._check)

    @cached_property
    def streams(self) -> Mapping[str, Cache]:
        """Streams of spray, foam and bubbles by name (`default`), each a cache of its own."""
        return self._made("whitewater")

    @cached_property
    def wet(self) -> Mapping[str, Cache]:
        """Streams of the wetness of solids by name (`default`), each a cache of its own with a point for each vertex."""
        return self._made("wet")

    def _made(self, kind: str) -> Mapping[str, Cache]:
        folders = sorted(path.parent for path in self.path.glob(f"{kind}/*/{MANIFEST}"))
        return {folder.name: Cache(folder, check=self._check) for folder in folders}

    def __getitem__(self, frame: int) -> Frame:
        """A frame by its number, its checksum checked."""
        record = self._record(frame)
        if not self._is_kept(frame):
            near = [min(self.frames, key=lambda n: (n > frame, frame - n)), min(self.frames, key=lambda n: (n < frame, n - frame))]
            what = f"frame {frame}: its particles were not kept (keep = {self.manifest['keep']}); frames {near[0]} and {near[1]} were"
            raise MissingFrame(self.path, what)
        return Frame(self.path, record, record.files[PARTICLES], self.manifest["attributes"], self._check)

    def __iter__(self) -> Iterator[Frame]:
        return (self[frame] for frame in self.frames)

    def __len__(self) -> int:
        return len(self.frames)

    def __contains__(self, frame: object) -> bool:
        return frame in self.frames

    def __repr__(self) -> str:
        return f"<swell.Cache {self.path}: {self.shot}, {self.solver}, frames {self.first_frame} to {self.last_frame}>"

    def verify(self) -> None:
        """Reads every file and raises the first fault, a `Damaged`. Streams of whitewater have a `verify` of their own."""
        for problem in self.survey():
            raise problem

    def survey(self) -> list[CacheError]:
        """Reads every file and gives all faults; none of a sound cache."""
        problems: list[CacheError] = []
        if self._is_torn:
            what = f"its last line is torn after frame {self.last_frame} (a bake that runs now may be writing it)"
            problems.append(Damaged(self.path / LEDGER, what))
        files = list(self._files)
        for entry in self.ledger:
            is_kept = self._is_kept(entry.frame)
            files += [record for stream, record in entry.files.items() if is_kept or stream != PARTICLES]
        problems += faults(self.path, files)
        for table in (*self.probes.values(), *self.bodies.values()):
            problems += _fault_of(table.check, self.path)
        if (self.path / "failed").exists():
            problems += _fault_of(_check_failed, self.path / "failed")
        return problems

    def _record(self, frame: int) -> Record:
        if not self.first_frame <= frame <= self.last_frame:
            raise MissingFrame(self.path, f"it has no frame {frame}, only {self.first_frame} to {self.last_frame}")
        return self.ledger[frame - self.first_frame]

    def _is_kept(self, frame: int) -> bool:
        keep = self.manifest.get("keep", "all")
        if keep == "all" or frame in (self.first_frame, self.last_frame):
            return True
        return keep != "none" and frame % int(str(keep).removeprefix("every ")) == 0


class Grids(Mapping[int, Path]):
    """Grids of a cache: `cache.grids[120]` is the path of a frame's OpenVDB file, its checksum checked."""

    def __init__(self, folder: Path, record: Mapping[str, Any] | None, ledger: list[Record], check: bool) -> None:
        self._folder = folder
        self._check = check
        self._files = {entry.frame: entry.files[GRIDS] for entry in ledger if GRIDS in entry.files}
        asked = record or {}
        self.names: tuple[str, ...] = tuple(n for key, n in (("surface", "surface"), ("velocity", "vel")) if asked.get(key))
        """`surface` (level set, metres) and `vel` (m/s), as far as the scene asks for them."""
        self.voxel_size: float | None = asked.get("voxel_size")
        """Metres; None where there are no grids."""

    def __getitem__(self, frame: int) -> Path:
        if frame not in self._files:
            raise MissingFrame(self._folder, f"it has no grids of frame {frame}")
        if self._check:
            self._files[frame].check(self._folder)
        return self._folder / self._files[frame].file

    def __iter__(self) -> Iterator[int]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)


def _fault_of(check: Callable[[Path], None], folder: Path) -> list[CacheError]:
    try:
        check(folder)
    except CacheError as problem:
        return [problem]
    return []


def _check_failed(folder: Path) -> None:
    """`failed/`, where a bake broke off: its report has a checksum of itself, and those of the other two files."""
    path = folder / "report.json"
    content = read_bytes(path)
    recorded = _FAILED_DIGEST.search(content)
    if recorded is None or hex_digests([_FAILED_DIGEST.sub(b"", content)])[0] != recorded[1].decode():
        raise Damaged(path, "its BLAKE3 is off")
    for value in json.loads(content)["files"]:
        FileRecord.parse(value, path).check(folder)
