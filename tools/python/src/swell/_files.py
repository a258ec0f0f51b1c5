"""Files of a cache, and the records that they are held against."""

from __future__ import annotations

import mmap
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from ._blake3 import hex_digests
from ._errors import CacheError, Damaged


# Bytes of a file; an empty one cannot be mapped.
Content = mmap.mmap | bytes
# Files that are mapped and hashed together.
_TOGETHER = 64


@dataclass(frozen=True)
class FileRecord:
    """A file as the cache recorded it: path from the cache's folder, length in bytes, BLAKE3 in hexadecimal."""

    file: str
    bytes: int
    blake3: str

    @classmethod
    def parse(cls, value: Any, source: Path) -> FileRecord:
        """From JSON; `source` is the file that says so."""
        try:
            record = cls(str(value["file"]), int(value["bytes"]), str(value["blake3"]))
        except (KeyError, TypeError, ValueError) as error:
            raise Damaged(source, f"a record of a file is not one: {value!r}") from error
        parts = PurePosixPath(record.file).parts
        if not parts or record.file.startswith("/") or ".." in parts or "\\" in record.file:
            raise Damaged(source, f"file name `{record.file}` leads out of the cache")
        return record

    def check(self, folder: Path) -> None:
        """Raises `Damaged` where the file is missing, of another length, or has another BLAKE3."""
        self.check_digest(folder, self.map(folder))

    def check_digest(self, folder: Path, content: Content) -> None:
        """Raises `Damaged` where the content's BLAKE3 is another."""
        for problem in _wrong(folder, [(self, content)]):
            raise problem

    def map(self, folder: Path) -> Content:
        """The file in memory, read only, pages as they are touched; its length is checked and no more."""
        path = folder / self.file
        try:
            with path.open("rb") as file:
                length = os.fstat(file.fileno()).st_size
                if length != self.bytes:
                    raise Damaged(path, f"it has {length} bytes, and the cache recorded {self.bytes}")
                return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if length else b""
        except FileNotFoundError as error:
            raise Damaged(path, "it is missing") from error
        except OSError as error:
            raise CacheError(path, f"it cannot be read: {error.strerror}") from error


def faults(folder: Path, records: Sequence[FileRecord]) -> list[CacheError]:
    """What `check` says of each of these files, in their order as far as they are there."""
    problems: list[CacheError] = []
    for first in range(0, len(records), _TOGETHER):
        found = []
        for record in records[first : first + _TOGETHER]:
            try:
                found.append((record, record.map(folder)))
            except CacheError as problem:
                problems.append(problem)
        problems += _wrong(folder, found)
    return problems


def _wrong(folder: Path, found: Sequence[tuple[FileRecord, Content]]) -> list[CacheError]:
    digests = hex_digests([memoryview(content) for _, content in found])
    wrong = [record for (record, _), digest in zip(found, digests, strict=True) if digest != record.blake3]
    return [Damaged(folder / record.file, "its BLAKE3 is off") for record in wrong]


def read_bytes(path: Path) -> bytes:
    """A file's content, or `Damaged` where it is missing."""
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        raise Damaged(path, "it is missing") from error
    except OSError as error:
        raise CacheError(path, f"it cannot be read: {error.strerror}") from error
