"""BLAKE3 of many byte strings at once.

A cache records each of its files with a BLAKE3. Python's `hashlib` has none, so this module computes it with numpy: chunks of 1024
bytes are independent, and many of them go through each step together (O'Connor, Aumasson, Neves and Wilcox-O'Hearn 2020, "BLAKE3: one
function, fast everywhere", section 2). Where the package `blake3` is installed that one does the work; it is faster.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.uint32]
Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Data = bytes | memoryview


def _find_compiled() -> Callable[[Data], Any] | None:
    try:
        hasher: Callable[[Data], Any] = importlib.import_module("blake3").blake3
    except ImportError:
        return None
    return hasher


_compiled = _find_compiled()

_CHUNK = 1024
_BLOCK = 64
_BLOCKS = _CHUNK // _BLOCK
_CHUNK_START, _CHUNK_END, _PARENT, _ROOT = 1, 2, 4, 8
_IV = np.array(
    [0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A, 0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19],
    dtype=np.uint32,
)
_PERMUTATION = np.array([2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8])
_ROUNDS = 7
# Chunks that are compressed together: state and block fit a second-level cache.
_LANES = 8192


def hex_digests(messages: Sequence[Data]) -> list[str]:
    """BLAKE3 of each message, 64 hexadecimal digits each."""
    if _compiled is None:
        return hex_digests_by_numpy(messages)
    return [str(_compiled(message).hexdigest()) for message in messages]


def hex_digests_by_numpy(messages: Sequence[Data]) -> list[str]:
    """`hex_digests` without the package `blake3`. Many short messages take little longer than one."""
    roots = _roots(_chaining_values(messages))
    return [root.astype("<u4").tobytes().hex() for root in roots]


def _chaining_values(messages: Sequence[Data]) -> list[Words]:
    """Chaining values of each message's chunks, (8, chunks)."""
    found: list[list[Words]] = [[] for _ in messages]
    batch: list[tuple[int, Bytes, Ints, Ints, bool]] = []
    lanes = 0

    def flush() -> None:
        nonlocal batch, lanes
        if batch:
            chunks = batch[0][1] if len(batch) == 1 else np.concatenate([piece[1] for piece in batch])
            sizes = np.concatenate([piece[2] for piece in batch])
            counters = np.concatenate([piece[3] for piece in batch])
            is_root = np.concatenate([np.full(len(piece[1]), piece[4]) for piece in batch])
            values = _compress_chunks(chunks, sizes, counters, is_root)
            ends = np.cumsum([len(piece[1]) for piece in batch])[:-1]
            for piece, value in zip(batch, np.split(values, ends, axis=1), strict=True):
                found[piece[0]].append(value)
        batch, lanes = [], 0

    for index, message in enumerate(messages):
        for chunks, sizes, counters, is_root in _pieces(np.frombuffer(message, dtype=np.uint8)):
            if lanes + len(chunks) > _LANES:
                flush()
            batch.append((index, chunks, sizes, counters, is_root))
            lanes += len(chunks)
    flush()
    return [np.concatenate(values, axis=1) for values in found]


def _pieces(message: Bytes) -> Iterator[tuple[Bytes, Ints, Ints, bool]]:
    """A message in runs of at most `_LANES` chunks: bytes (n, 1024), length of each, number of each, whether it is the only chunk."""
    is_root = len(message) <= _CHUNK
    whole = len(message) // _CHUNK
    rest = message[whole * _CHUNK :]
    chunks = message[: whole * _CHUNK].reshape(whole, _CHUNK)
    for first in range(0, whole, _LANES):
        run = chunks[first : first + _LANES]
        yield run, np.full(len(run), _CHUNK), np.arange(first, first + len(run)), is_root
    if len(rest) > 0 or whole == 0:
        last = np.zeros((1, _CHUNK), dtype=np.uint8)
        last[0, : len(rest)] = rest
        yield last, np.array([len(rest)]), np.array([whole]), is_root


def _compress_chunks(chunks: Bytes, sizes: Ints, counters: Ints, is_root: NDArray[np.bool_]) -> Words:
    """Chaining values (8, n) of n chunks."""
    words = chunks.view("<u4").astype(np.uint32, copy=False)
    values = np.repeat(_IV[:, None], len(chunks), axis=1)
    blocks = np.maximum(1, -(-sizes // _BLOCK))
    for block in range(_BLOCKS):
        lane = np.flatnonzero(blocks > block)
        if len(lane) == 0:
            break
        is_last = blocks[lane] == block + 1
        start = _CHUNK_START if block == 0 else 0
        flags: Ints = start + _CHUNK_END * is_last.astype(np.int64) + _ROOT * (is_last & is_root[lane])
        size = np.minimum(_BLOCK, sizes[lane] - block * _BLOCK)
        message = words[lane, 16 * block : 16 * (block + 1)].T.copy()
        values[:, lane] = _compress(values[:, lane], message, counters[lane], size, flags)
    return values


def _roots(nodes: list[Words]) -> list[Words]:
    """Roots of the trees over each message's chunks: neighbours are joined, level by level, and a last odd one moves up."""
    while any(node.shape[1] > 1 for node in nodes):
        open_ones = [index for index, node in enumerate(nodes) if node.shape[1] > 1]
        pairs = [nodes[index].shape[1] // 2 for index in open_ones]
        left = np.concatenate(
            [nodes[index][:, 0 : 2 * count : 2] for index, count in zip(open_ones, pairs, strict=True)], axis=1
        )
        right = np.concatenate(
            [nodes[index][:, 1 : 2 * count : 2] for index, count in zip(open_ones, pairs, strict=True)], axis=1
        )
        is_root = np.repeat([nodes[index].shape[1] == 2 for index in open_ones], pairs)
        total = left.shape[1]
        joined = _compress(
            np.repeat(_IV[:, None], total, axis=1),
            np.concatenate([left, right]),
            np.zeros(total, dtype=np.int64),
            np.full(total, _BLOCK),
            np.where(is_root, _PARENT | _ROOT, _PARENT),
        )
        for index, above in zip(open_ones, np.split(joined, np.cumsum(pairs)[:-1], axis=1), strict=True):
            odd = nodes[index][:, 2 * above.shape[1] :]
            nodes[index] = np.concatenate([above, odd], axis=1)
    return [node[:, 0] for node in nodes]


def _compress(values: Words, message: Words, counters: Ints, sizes: Ints, flags: Ints) -> Words:
    """The compression of n blocks: chaining values (8, n), words (16, n) -> chaining values (8, n)."""
    count = values.shape[1]
    a, b = values[:4].copy(), values[4:].copy()
    c = np.repeat(_IV[:4, None], count, axis=1)
    d = np.stack([counters & 0xFFFFFFFF, counters >> 32, sizes, flags]).astype(np.uint32)
    spare = np.empty_like(a)
    order = np.arange(16)
    for _ in range(_ROUNDS):
        _mix(a, b, c, d, message[order[0:8:2]], message[order[1:8:2]], spare)
        # The diagonals of the state become its columns, and back.
        b, c, d = b[[1, 2, 3, 0]], c[[2, 3, 0, 1]], d[[3, 0, 1, 2]]
        _mix(a, b, c, d, message[order[8::2]], message[order[9::2]], spare)
        b, c, d = b[[3, 0, 1, 2]], c[[2, 3, 0, 1]], d[[1, 2, 3, 0]]
        order = order[_PERMUTATION]
    return np.concatenate([a ^ c, b ^ d])


def _mix(a: Words, b: Words, c: Words, d: Words, x: Words, y: Words, spare: Words) -> None:
    """The quarter round of the four columns, in place."""
    for word, (turn_d, turn_b) in ((x, (16, 12)), (y, (8, 7))):
        a += b
        a += word
        d ^= a
        _turn_right(d, turn_d, spare)
        c += d
        b ^= c
        _turn_right(b, turn_b, spare)


def _turn_right(words: Words, bits: int, spare: Words) -> None:
    np.left_shift(words, np.uint32(32 - bits), out=spare)
    np.right_shift(words, np.uint32(bits), out=words)
    words |= spare
