"""What is not as swell wrote it is refused, with the file's name; `swell verify` is the oracle."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import swell

from .conftest import Swell

Copy = Callable[[str], Path]


def flip(path: Path, place: int) -> None:
    content = bytearray(path.read_bytes())
    content[place] ^= 4
    path.write_bytes(content)


def looks(cache: Path) -> list[swell.CacheError]:
    """Faults, also of a cache that cannot be opened."""
    try:
        return swell.Cache(cache).survey()
    except swell.CacheError as error:
        return [error]


def checked_files(cache: Path) -> list[Path]:
    unhashed = ("timings.jsonl", "lock")
    files = sorted(path for path in cache.rglob("*") if path.is_file() and path.name not in unhashed)
    return [path for path in files if {"whitewater", "wet"}.isdisjoint(path.parts)]


@pytest.mark.parametrize("name", ["pbf", "flip", "kept", "far", "afloat", "branch", "pbf/whitewater/default", "pbf/wet/default"])
def test_sound_caches_are_sound(baked: Path, swell_bin: Swell, name: str) -> None:
    assert not swell_bin.refuses(baked / name)
    swell.Cache(baked / name).verify()


def test_a_bit_off_is_found_in_every_file(copy: Copy, swell_bin: Swell) -> None:
    cache = copy("pbf")
    files = checked_files(cache)
    assert len(files) == 2 + 2 + 7 + 7 + 3, "manifest, ledger, scene, mesh, frames, grids, probes"
    for path in files:
        sound = path.read_bytes()
        for place in (0, len(sound) // 3, len(sound) - 2):
            flip(path, place)
            problems = looks(cache)
            assert [problem.path for problem in problems] == [path], f"{path}, byte {place}: {problems}"
            assert isinstance(problems[0], swell.Damaged | swell.UnknownFormat)
            path.write_bytes(sound)
        flip(path, len(sound) // 3)
        assert swell_bin.refuses(cache)
        path.write_bytes(sound)
    assert looks(cache) == [], "control"


def test_every_missing_and_shortened_file_is_found(copy: Copy) -> None:
    cache = copy("pbf")
    for path in checked_files(cache):
        sound = path.read_bytes()
        path.unlink()
        [problem] = looks(cache)
        if path.name == "manifest.json":
            assert isinstance(problem, swell.NotACache)
        else:
            assert problem.path == path
            assert "missing" in problem.what
        path.write_bytes(sound[:-1])
        # Without the end of its last line the ledger lacks a frame, and the probes' files have one more.
        assert looks(cache)[0].path == path
        path.write_bytes(sound)
    assert looks(cache) == [], "control"


def test_a_damaged_frame_is_never_handed_out(copy: Copy) -> None:
    cache = copy("pbf")
    path = cache / "frames/tank.0003.ply"
    flip(path, -5)
    opened = swell.Cache(cache)
    with pytest.raises(swell.Damaged, match=r"tank\.0003\.ply: its BLAKE3 is off"):
        opened[3]
    assert len(opened[2]) == len(opened[4])
    unchecked = swell.Cache(cache, check=False)[3]
    with pytest.raises(swell.Damaged, match="BLAKE3"):
        unchecked.verify()
    swell.Cache(cache, check=False)[2].verify()


def test_a_frame_that_is_another_frame_of_the_cache(copy: Copy) -> None:
    cache = copy("pbf")
    (cache / "frames/tank.0003.ply").write_bytes((cache / "frames/tank.0002.ply").read_bytes())
    [problem] = looks(cache)
    assert problem.path.name == "tank.0003.ply"


def test_a_ledger_that_was_edited(copy: Copy) -> None:
    cache = copy("pbf")
    path = cache / "frames.jsonl"
    lines = path.read_bytes().splitlines(keepends=True)
    for edited, what in [
        ([lines[0], *lines[2:]], "line 2: it is not frame 1"),
        ([lines[0], lines[1].replace(b'"substeps":1', b'"substeps":2'), *lines[2:]], "line 2: its chained hash is off"),
        ([lines[0].replace(b'"manifest":"', b'"manifests":"'), *lines[1:]], "line 1"),
        ([], "no whole line"),
    ]:
        path.write_bytes(b"".join(edited))
        with pytest.raises(swell.Damaged) as caught:
            swell.Cache(cache)
        assert caught.value.path == path
        assert what in caught.value.what


def test_half_a_line_is_one_that_is_being_written(copy: Copy) -> None:
    cache = copy("pbf")
    with (cache / "frames.jsonl").open("ab") as file:
        file.write(b'{"frame":7,')
    opened = swell.Cache(cache)
    assert opened.last_frame == 6
    [problem] = opened.survey()
    assert "torn after frame 6" in problem.what


def test_probes_that_say_something_else(copy: Copy) -> None:
    cache = copy("pbf")
    path = cache / "probes/gauge.csv"
    lines = path.read_text().splitlines(keepends=True)
    # A value of the window, which stands in no ledger.
    lines[4] = lines[4].replace("\n", "1\n")
    path.write_text("".join(lines))
    with pytest.raises(swell.Damaged, match=r"gauge\.csv: line 5 "):
        swell.Cache(cache).verify()


def test_a_body_that_is_elsewhere(copy: Copy, swell_bin: Swell) -> None:
    cache = copy("afloat")
    path = cache / "bodies/afloat.csv"
    lines = path.read_text().splitlines(keepends=True)
    lines[3] = lines[3].replace(",819", ",818", 1)
    path.write_text("".join(lines))
    with pytest.raises(swell.Damaged, match=r"afloat\.csv: line 4 "):
        swell.Cache(cache).verify()
    assert swell_bin.refuses(cache)


def test_what_is_no_cache(copy: Copy, tmp_path: Path) -> None:
    with pytest.raises(swell.NotACache, match=r"manifest\.json"):
        swell.Cache(tmp_path)
    with pytest.raises(swell.NotACache):
        swell.Cache(tmp_path / "nothing")


@pytest.mark.parametrize("version", [0, 3, "2", None, True])
def test_other_formats_are_refused(copy: Copy, version: object) -> None:
    cache = copy("pbf")
    path = cache / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["format_version"] = version
    path.write_text(json.dumps(manifest))
    with pytest.raises(swell.UnknownFormat, match="this package reads 1 to 2"):
        swell.Cache(cache)


@pytest.mark.parametrize("frame", [-1, 7, 1000])
def test_frames_that_are_not_there(baked: Path, frame: int) -> None:
    with pytest.raises(swell.MissingFrame, match=f"no frame {frame}, only 0 to 6"):
        swell.Cache(baked / "pbf")[frame]


def test_errors_are_of_one_kind() -> None:
    kinds = (swell.Damaged, swell.MissingFrame, swell.NotACache, swell.UnknownFormat)
    assert all(issubclass(kind, swell.CacheError) for kind in kinds)
    error = swell.Damaged(Path("a/b.ply"), "it is missing")
    assert str(error) == f"{Path('a/b.ply')}: it is missing"


def test_a_bake_that_broke_off(baked: Path, swell_bin: Swell, tmp_path: Path) -> None:
    scene = tmp_path / "broken.toml"
    shutil.copy(baked / "pbf.obj", tmp_path)
    scene.write_text((baked / "pbf.toml").read_text() + "\n[budget]\nspeed = 2.0\n")
    cache = tmp_path / "broken"
    swell_bin("bake", scene, "-o", cache, "--progress", "none", code=5)
    assert (cache / "failed/report.json").is_file()
    swell.Cache(cache).verify()
    for name in ("report.json", "scene.toml", "start.ply"):
        sound = (cache / "failed" / name).read_bytes()
        flip(cache / "failed" / name, len(sound) // 2)
        assert [problem.path.name for problem in swell.Cache(cache).survey()] == [name]
        assert swell_bin.refuses(cache)
        (cache / "failed" / name).write_bytes(sound)
    swell.Cache(cache).verify()
