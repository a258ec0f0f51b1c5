"""Compressed frames: the particles of the plain ones, or a clear word where they cannot be unpacked."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import swell
from numpy.typing import NDArray
from swell import _frame

HAS_ZSTD = sys.version_info >= (3, 14) or importlib.util.find_spec("zstandard") is not None


@pytest.mark.skipif(HAS_ZSTD, reason="needs a Python without Zstandard")
def test_without_zstandard_it_says_what_to_install(baked: Path) -> None:
    with pytest.raises(swell.CacheError, match=r"pip install swell\[zstd\]"):
        swell.Cache(baked / "packed")[3]
    swell.Cache(baked / "packed").verify()


@pytest.mark.skipif(not HAS_ZSTD, reason="run again by tools/lib/python-package with the package zstandard")
def test_particles_are_those_of_plain_frames(baked: Path) -> None:
    packed, plain = swell.Cache(baked / "packed"), swell.Cache(baked / "pbf")
    assert len(packed) == len(plain) == 7
    for one, other in zip(packed, plain, strict=True):
        assert one.path.name == f"tank.{one.frame:04}.ply.zst"
        assert one.rows.tobytes() == other.rows.tobytes()
    assert packed[0].rows.tobytes() != plain[1].rows.tobytes(), "control"


@pytest.mark.skipif(not HAS_ZSTD, reason="run again by tools/lib/python-package with the package zstandard")
def test_a_spoiled_stream_is_refused(copy: Callable[[str], Path]) -> None:
    cache = copy("packed")
    path = cache / "frames/tank.0003.ply.zst"
    sound = path.read_bytes()
    for bytes_ in (sound[:-1] + bytes([sound[-1] ^ 1]), b"\0" * len(sound)):
        path.write_bytes(bytes_)
        with pytest.raises(swell.Damaged, match="BLAKE3"):
            swell.Cache(cache)[3]
    with pytest.raises(swell.Damaged, match="Zstandard"):
        swell.Cache(cache, check=False)[3]


def test_planes_are_turned_to_rows_block_by_block() -> None:
    rows = np.arange(5 * 3, dtype=np.uint8).reshape(5, 3)
    planes = rows[:2].T.tobytes() + rows[2:4].T.tobytes() + rows[4:].T.tobytes()
    assert _frame._rows_of_planes(memoryview(planes), 3, 2) == rows.tobytes()
    assert _frame._rows_of_planes(memoryview(planes), 3, 5) != rows.tobytes(), "control"


@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_differences_are_added_up_block_by_block(kind: str) -> None:
    fields = [("x", f"<{kind}"), ("y", f"<{kind}"), ("z", f"<{kind}"), ("id", "<u4")]
    values = np.array([(1.0, -2.5, 0.0, 1), (1.0000001, 0.0, -0.0, 2), (-0.0, np.inf, 7.0, 5), (3.0, -1e-30, 7.0, 9)], dtype=fields)
    width = int(kind[1:])

    def differences(column: NDArray[Any]) -> NDArray[Any]:
        whole, top = 1 << 8 * width, 1 << 8 * width - 1
        ordered = [whole - 1 - bits if bits & top else bits | top for bits in map(int, column.view(f"<u{width}"))]
        steps = [(this - last + top) % whole - top for last, this in zip([0, *ordered], ordered, strict=False)]
        return np.array([(2 * step if step >= 0 else -2 * step - 1) for step in steps], dtype=f"<u{width}")

    def planes(block: NDArray[Any]) -> bytes:
        columns = [differences(np.ascontiguousarray(block[axis])) for axis in "xyz"] + [np.ascontiguousarray(block["id"])]
        return b"".join(column.view(np.uint8).reshape(len(block), -1).T.tobytes() for column in columns)

    size = values.dtype.itemsize
    packed = memoryview(planes(values[:3]) + planes(values[3:]))
    assert _frame._rows_of_planes(packed, size, 3, width) == values.tobytes()
    assert _frame._rows_of_planes(packed, size, 3) != values.tobytes(), "control"
