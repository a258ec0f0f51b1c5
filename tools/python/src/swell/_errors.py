"""What goes wrong with a cache."""

from __future__ import annotations

from pathlib import Path


class CacheError(Exception):
    """A cache cannot be read as asked. `path` is the file or folder, `what` the fault."""

    def __init__(self, path: Path, what: str) -> None:
        super().__init__(f"{path}: {what}")
        self.path = path
        self.what = what


class NotACache(CacheError):
    """The folder has no manifest."""


class UnknownFormat(CacheError):
    """The cache is of a format that this package does not read."""


class MissingFrame(CacheError):
    """There is no such frame, or its particles were not kept."""


class Damaged(CacheError):
    """A file is missing, cut short, or not what the cache recorded."""
