"""Reads particle caches that swell baked.

    import swell

    cache = swell.Cache("cache/quickstart/pbf")
    frame = cache[48]
    frame.position                  # (n, 3) metres, a view of the file in memory: nothing is copied
    frame.velocity, frame.id        # (n, 3) m/s; (n,)
    cache.probes["gauge"]["elevation_m"]
    cache.streams["default"][48]["radius"]
    cache.verify()

World coordinates are right-handed with y up, in metres; `z_up` turns them. Every file is held against its BLAKE3.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._cache import Cache, Grids
from ._errors import CacheError, Damaged, MissingFrame, NotACache, UnknownFormat
from ._files import FileRecord
from ._frame import Frame
from ._ledger import Record
from ._probes import Probe

__all__ = [
    "Cache",
    "CacheError",
    "Damaged",
    "FileRecord",
    "Frame",
    "Grids",
    "MissingFrame",
    "NotACache",
    "Probe",
    "Record",
    "UnknownFormat",
    "z_up",
]

__version__ = "0.1.0"


def z_up(vectors: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """Positions or velocities (n, 3) with z up instead of y, still right-handed: (x, y, z) becomes (x, -z, y). A copy."""
    return np.stack([vectors[:, 0], -vectors[:, 2], vectors[:, 1]], axis=1)
