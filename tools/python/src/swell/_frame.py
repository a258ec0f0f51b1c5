"""A frame: a binary PLY file, mapped into memory; compressed ones are unpacked."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import CacheError, Damaged
from ._files import Content, FileRecord
from ._ledger import Record

_HEADER_LIMIT = 1 << 16
_SCALARS = {"float": "<f4", "double": "<f8", "uint": "<u4"}
_FIXED = ["x", "y", "z", "vx", "vy", "vz", "id"]
_PACKED = ".zst"
_PLANES = "comment planes "
_DIFFERENCES = "comment differences "


class Frame:
    """The particles of one frame, in the order of their ids.

    Arrays are views of the file, which is mapped into memory: nothing is copied, pages are read when they are touched, and writing to
    them is an error. They stay valid as long as one of them lives. Rows are packed, so a view need not be aligned or contiguous;
    `np.ascontiguousarray(frame.position)` is a copy that is.

    World coordinates are right-handed with y up, in metres; `swell.z_up` turns them to z up.
    """

    def __init__(self, folder: Path, record: Record, file: FileRecord, attributes: list[str], check: bool) -> None:
        self._folder = folder
        self._file = file
        self._record = record
        content = file.map(folder)
        if check:
            file.check_digest(folder, content)
        if file.file.endswith(_PACKED):
            content = _decompress(content, self.path)
        self._rows = _parse(content, self.path, file.file.endswith(_PACKED))
        if len(self._rows) != record.particles:
            raise Damaged(self.path, f"{len(self._rows)} particles, and the ledger has {record.particles}")
        if list(self.attributes) != attributes:
            raise Damaged(self.path, f"its attributes are {list(self.attributes)}, and the manifest has {attributes}")

    @property
    def frame(self) -> int:
        """Number of the frame; 0 is a scene's own start."""
        return self._record.frame

    @property
    def time(self) -> float:
        """Simulated, seconds."""
        return self._record.time

    @property
    def record(self) -> Record:
        """The frame's line of the ledger."""
        return self._record

    @property
    def path(self) -> Path:
        """The file."""
        return self._folder / self._file.file

    @property
    def rows(self) -> NDArray[np.void]:
        """All fields as one structured array, (n,): `position`, `velocity`, `id` and the attributes."""
        return self._rows

    @property
    def position(self) -> NDArray[np.floating[Any]]:
        """(n, 3), metres, world coordinates: float32, or float64 where the scene stands far from the world's origin."""
        return self["position"]

    @property
    def velocity(self) -> NDArray[np.float32]:
        """(n, 3), m/s."""
        return self["velocity"]

    @property
    def id(self) -> NDArray[np.uint32]:
        """(n,), ascending. A particle keeps its id for life, and no id is given twice."""
        return self["id"]

    @property
    def attributes(self) -> tuple[str, ...]:
        """Names of what particles carry beside position, velocity and id; of whitewater `age`, `kind`, `life`, `radius`."""
        names = self._rows.dtype.names or ()
        return names[3:]

    def __getitem__(self, field: str) -> NDArray[Any]:
        """A field by its name: `frame["age"]`, (n,) float32."""
        if field not in (self._rows.dtype.names or ()):
            raise KeyError(f"{self.path} has no field {field!r}; it has {', '.join(self._rows.dtype.names or ())}")
        view: NDArray[Any] = self._rows[field]
        return view

    def __len__(self) -> int:
        return len(self._rows)

    def __repr__(self) -> str:
        return f"<swell.Frame {self.frame}: {len(self)} particles at {self.time:.6g} s, {self.path}>"

    def verify(self) -> None:
        """Reads the whole file again and raises `Damaged` where its BLAKE3 is not the ledger's."""
        self._file.check(self._folder)


def _decompress(content: Content, path: Path) -> bytes:
    """Zstandard by Python's own module (3.14), or by the package zstandard."""
    try:
        module = importlib.import_module("compression.zstd")
        unpack, fault = module.decompress, module.ZstdError
    except ImportError:
        try:
            module = importlib.import_module("zstandard")
        except ImportError as error:
            raise CacheError(path, "it is compressed, which takes Python 3.14 or the package zstandard: pip install swell[zstd]") from error
        unpack, fault = module.ZstdDecompressor().decompress, module.ZstdError
    try:
        return bytes(unpack(content))
    except fault as error:
        raise Damaged(path, f"Zstandard: {error}") from error


def _rows_of_planes(body: memoryview, size: int, block: int, width: int = 0) -> bytes:
    """Rows of `size` bytes from blocks of byte planes, `block` rows each but the last; with a `width`, the first three columns, of so many
    bytes, are differences."""
    rows = np.empty((len(body) // size, size), dtype=np.uint8)
    for first in range(0, len(rows), block):
        part = rows[first : first + block]
        start = first * size
        part[:] = np.frombuffer(body, np.uint8, part.size, start).reshape(size, len(part)).T
        for axis in range(3 if width else 0):
            column = part[:, axis * width : (axis + 1) * width]
            bits = np.ascontiguousarray(column).view(f"<u{width}")[:, 0]
            column[:] = _added_up(bits).view(np.uint8).reshape(column.shape)
    return rows.tobytes()


def _added_up(bits: NDArray[Any]) -> NDArray[Any]:
    """Values of a block's column from their differences: 2 d, or -2 d - 1 of negative ones, of integers ordered as floats are."""
    one = bits.dtype.type(1)
    top = bits.dtype.type(1 << (8 * bits.dtype.itemsize - 1))
    ordered = np.cumsum(np.where(bits & one, ~(bits >> one), bits >> one), dtype=bits.dtype)
    return np.where(ordered & top, ordered ^ top, ~ordered).astype(bits.dtype)


def _parse(content: Content, path: Path, is_packed: bool) -> NDArray[np.void]:
    head = content[:_HEADER_LIMIT]
    end = head.find(b"end_header\n")
    if not head.startswith(b"ply\n") or end < 0:
        raise Damaged(path, "it is no PLY file")
    start = end + len(b"end_header\n")
    lines = head[:end].decode("ascii", "replace").splitlines()
    if lines[1:2] != ["format binary_little_endian 1.0"]:
        raise Damaged(path, "not binary little-endian PLY 1.0")
    planes = [line.removeprefix(begin) for begin in (_PLANES, _DIFFERENCES) for line in lines if line.startswith(begin)]
    has_differences = any(line.startswith(_DIFFERENCES) for line in lines)
    if [block.isdecimal() and int(block) > 0 for block in planes] != [True] * is_packed:
        raise Damaged(path, "its PLY header is not one of swell's")
    words = [line.split(" ") for line in lines[2:] if not line.startswith("comment ")]
    if ["element", "deep"] in [line[:2] for line in words]:
        raise CacheError(path, "it has deep cells without particles (solver.flip.band), which only the program reads: use swell export")
    try:
        [element, *properties] = words
        count = int(element[2]) if element[:2] == ["element", "vertex"] else -1
        kinds = {name: np.dtype(_SCALARS[kind]) for key, kind, name in properties if key == "property"}
    except (ValueError, KeyError, IndexError) as error:
        raise Damaged(path, "its PLY header is not one of swell's") from error
    if count < 0 or list(kinds)[:7] != _FIXED or len(kinds) != len(properties):
        raise Damaged(path, "its PLY header is not one of swell's")
    dtype = _row(kinds)
    if len(content) - start != count * dtype.itemsize:
        raise Damaged(path, f"its header promises {count} particles of {dtype.itemsize} bytes, and {len(content) - start} bytes follow")
    if is_packed:
        width = kinds["x"].itemsize if has_differences else 0
        content, start = _rows_of_planes(memoryview(content)[start:], dtype.itemsize, int(planes[0]), width), 0
    return np.frombuffer(content, dtype=dtype, count=count, offset=start)


def _row(kinds: Mapping[str, np.dtype[Any]]) -> np.dtype[np.void]:
    """A packed row: its three columns of position, and of velocity, are one field each."""
    fields: list[Any] = [("position", kinds["x"], (3,)), ("velocity", kinds["vx"], (3,)), ("id", kinds["id"])]
    fields += [(name, kind) for name, kind in kinds.items() if name not in _FIXED]
    return np.dtype(fields)
