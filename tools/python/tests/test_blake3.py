"""BLAKE3 by numpy, against the published test vectors."""

from __future__ import annotations

import numpy as np
import pytest
from swell import _blake3

# From test_vectors/test_vectors.json of the BLAKE3 repository: hashes of so many bytes 0, 1, …, 250, 0, 1, …
PUBLISHED = {
    0: "af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262",
    1: "2d3adedff11b61f14c886e35afa036736dcd87a74d27b5c1510225d0f592e213",
    1023: "10108970eeda3eb932baac1428c7a2163b0e924c9a9e25b35bba72b28f70bd11",
    1024: "42214739f095a406f3fc83deb889744ac00df831c10daa55189b5d121c855af7",
    1025: "d00278ae47eb27b34faecf67b4fe263f82d5412916c1ffd97c8cb7fb814b8444",
    2048: "e776b6028c7cd22a4d0ba182a8bf62205d2ef576467e838ed6f2529b85fba24a",
    2049: "5f4d72f40d7a5f82b15ca2b2e44b1de3c2ef86c426c95c1af0b6879522563030",
    3072: "b98cb0ff3623be03326b373de6b9095218513e64f1ee2edd2525c7ad1e5cffd2",
    3073: "7124b49501012f81cc7f11ca069ec9226cecb8a2c850cfe644e327d22d3e1cd3",
    4097: "9b4052b38f1c5fc8b1f9ff7ac7b27cd242487b3d890d15c96a1c25b8aa0fb995",
    5121: "628bd2cb2004694adaab7bbd778a25df25c47b9d4155a55f8fbd79f2fe154cff",
    7169: "a003fc7a51754a9b3c7fae0367ab3d782dccf28855a03d435f8cfe74605e7817",
}


def pattern(length: int) -> bytes:
    return (np.arange(length) % 251).astype(np.uint8).tobytes()


@pytest.mark.parametrize("length", PUBLISHED)
def test_published_vectors(length: int) -> None:
    assert _blake3.hex_digests_by_numpy([pattern(length)]) == [PUBLISHED[length]]


def test_together_they_are_what_they_are_alone() -> None:
    assert _blake3.hex_digests_by_numpy([pattern(length) for length in PUBLISHED]) == list(PUBLISHED.values())
    assert _blake3.hex_digests_by_numpy([]) == []


@pytest.mark.parametrize("lanes", [1, 2, 3, 5])
def test_the_number_of_lanes_changes_nothing(lanes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_blake3, "_LANES", lanes)
    assert _blake3.hex_digests_by_numpy([pattern(length) for length in PUBLISHED]) == list(PUBLISHED.values())


def test_every_bit_counts() -> None:
    content = bytearray(pattern(3073))
    for place in (0, 63, 64, 1023, 1024, 3072):
        content[place] ^= 1
        assert _blake3.hex_digests_by_numpy([bytes(content)]) != [PUBLISHED[3073]]
        content[place] ^= 1
    assert _blake3.hex_digests_by_numpy([bytes(content)]) == [PUBLISHED[3073]]


def test_the_package_gives_the_same_where_it_is_installed() -> None:
    blake3 = pytest.importorskip("blake3", reason="the package blake3 is not installed: nothing to compare with")
    rng = np.random.default_rng(7)
    for length in rng.integers(0, 1 << 21, 8):
        message = rng.bytes(int(length))
        assert _blake3.hex_digests_by_numpy([message]) == [blake3.blake3(message).hexdigest()]
