"""Caches as swell baked them, against what swell itself says of them."""

from __future__ import annotations

import csv
import gc
import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest
import swell
from swell._ledger import _parse_record

from .conftest import Swell

FRAMES = range(7)


def plain_rows(path: Path, position: str = "f", attributes: int = 0) -> list[tuple[float, ...]]:
    """Rows of a frame file, one after the other by `struct`: the slow reader that the views are held against."""
    head, _, body = path.read_bytes().partition(b"end_header\n")
    assert head.startswith(b"ply\n")
    return list(struct.iter_unpack("<" + 3 * position + "3fI" + attributes * "f", body))


def test_particles_are_the_files(baked: Path) -> None:
    cache = swell.Cache(baked / "pbf")
    assert len(cache) == 7
    assert [frame.frame for frame in cache] == list(FRAMES)
    for frame in cache:
        rows = plain_rows(frame.path)
        assert len(rows) == len(frame) > 400
        assert frame.position.tolist() == [list(row[:3]) for row in rows]
        assert frame.velocity.tolist() == [list(row[3:6]) for row in rows]
        assert frame.id.tolist() == [row[6] for row in rows]
        assert frame.attributes == ()
        assert [frame.position.dtype, frame.velocity.dtype, frame.id.dtype] == list(map(np.dtype, ("<f4", "<f4", "<u4")))


def test_nothing_is_copied(baked: Path) -> None:
    frame = swell.Cache(baked / "pbf")[3]
    for view in (frame.position, frame.velocity, frame.id):
        assert np.shares_memory(view, frame.rows)
        assert not view.flags.owndata
        assert not view.flags.writeable
    assert not np.shares_memory(frame.position.copy(), frame.rows), "control"
    with pytest.raises(ValueError, match="read-only"):
        frame.position[0, 0] = 1.0
    # The memory is the file's: another mapping of it sees the same bytes at the same place.
    mapped = np.memmap(frame.path, dtype=np.uint8, mode="r")
    assert mapped[-frame.rows.nbytes :].tobytes() == frame.rows.tobytes()


def test_views_outlive_their_frame_and_cache(baked: Path) -> None:
    position = swell.Cache(baked / "pbf")[3].position
    gc.collect()
    assert position.tolist() == [list(row[:3]) for row in plain_rows(baked / "pbf/frames/tank.0003.ply")]


def test_time_spacing_scene_and_ledger(baked: Path) -> None:
    cache = swell.Cache(baked / "pbf")
    assert (cache.shot, cache.solver, cache.frames_per_second, cache.particle_spacing) == ("tank", "pbf", 24.0, 0.1)
    assert cache.scene["solver"]["pbf"]["particle_spacing"] == 0.1
    assert cache.scene["domain"]["max"] == [2.0, 2.0, 1.0]
    assert [frame.time for frame in cache] == pytest.approx([n / 24 for n in FRAMES], abs=1e-12)
    assert [record.frame for record in cache.ledger] == list(FRAMES)
    assert cache.ledger[0].report is None
    # Particles weigh rho d^3, so the ledger's kinetic energy is that of the frame's velocities, to the rounding of the f32 values.
    report = cache.ledger[6].report
    assert report is not None
    mass = cache.manifest["rest_density"] * cache.particle_spacing**3
    before = cache.ledger[5].report
    assert before is not None
    energy = 0.5 * mass * np.sum(cache[6].velocity.astype(np.float64) ** 2)
    assert energy == pytest.approx(report["kinetic_energy"], rel=1e-6)
    assert energy != pytest.approx(before["kinetic_energy"], rel=1e-3), "control"


def test_numbers_are_those_that_inspect_prints(baked: Path, swell_bin: Swell) -> None:
    printed = swell_bin("inspect", baked / "pbf")
    cache = swell.Cache(baked / "pbf")
    rows = re.findall(r"^ +(\d+) +(\d+) +[\d.]+ kB .* ([\d.]+) m/s", printed, re.MULTILINE)
    assert [int(row[0]) for row in rows] == list(FRAMES)[1:]
    for number, particles, speed in rows:
        frame = cache[int(number)]
        assert len(frame) == int(particles)
        fastest = np.linalg.norm(frame.velocity, axis=1).max()
        # Half of the last digit that is printed.
        assert abs(fastest - float(speed)) < 0.005 + 1e-6
    shown = re.search(r"^front +front_m +([\d.]+) +([\d.]+) +([\d.]+)", printed, re.MULTILINE)
    assert shown is not None
    front = cache.probes["front"]["front_m"]
    assert [front.min(), front.max(), front[-1]] == pytest.approx([float(text) for text in shown.groups()], abs=6e-7)


@pytest.mark.parametrize("name", ["gauge", "front", "dry"])
def test_probes_are_the_csv_files(baked: Path, name: str) -> None:
    probe = swell.Cache(baked / "pbf").probes[name]
    with (baked / "pbf/probes" / f"{name}.csv").open() as file:
        head, *rows = csv.reader(file)
    assert head == ["frame", "time_s", *probe.columns]
    assert probe.frame.tolist() == [int(row[0]) for row in rows]
    assert probe.time.tolist() == [float(row[1]) for row in rows]
    for place, column in enumerate(probe.columns, 2):
        expected = [float(row[place] or "nan") for row in rows]
        np.testing.assert_array_equal(probe[column], expected)
    assert len(probe) == len(rows) >= 7


def test_what_the_probes_are_of(baked: Path) -> None:
    probes = swell.Cache(baked / "pbf").probes
    gauge = probes["gauge"]
    assert (gauge.kind, gauge.at, gauge.rate_hz) == ("elevation", [0.25, 0.5], 100.0)
    assert gauge.columns == ["elevation_m", "elevation_mean_m", "elevation_min_m", "elevation_max_m"]
    assert len(gauge) > 7, "more looks than frames, or the windows are not tried"
    assert np.isnan(probes["dry"]["elevation_m"]).all(), "no water comes there"
    assert probes["front"].rate_hz is None
    with pytest.raises(KeyError, match="elevation_m"):
        gauge["elevation"]


def test_bodies_are_the_csv_files(baked: Path) -> None:
    cache = swell.Cache(baked / "afloat")
    [(name, body)] = cache.bodies.items()
    with (baked / "afloat/bodies" / f"{name}.csv").open() as file:
        head, *rows = csv.reader(file)
    assert (name, body.kind, head) == ("afloat", "body", ["frame", "time_s", *body.columns])
    assert body.frame.tolist() == list(FRAMES)
    for place, column in enumerate(body.columns, 2):
        np.testing.assert_array_equal(body[column], [float(row[place]) for row in rows])
    # In world coordinates, to the left at first; a rotation has a length of one.
    assert (body["x_m"] > 8192.0).all() and body["x_m"][1] < body["x_m"][0]
    turn = np.array([body[f"turn_{axis}"] for axis in "xyzw"])
    np.testing.assert_allclose((turn**2).sum(axis=0), 1.0, rtol=1e-14)
    assert swell.Cache(baked / "pbf").bodies == {}


def test_grids_are_paths_of_sound_files(baked: Path) -> None:
    cache = swell.Cache(baked / "pbf")
    assert list(cache.grids) == list(FRAMES)
    assert cache.grids.names == ("surface",)
    assert cache.grids.voxel_size == 0.2
    assert cache.grids[4] == baked / "pbf/grids/tank.0004.vdb"
    with pytest.raises(swell.MissingFrame):
        cache.grids[7]


def test_wetness_has_a_value_for_each_vertex(baked: Path) -> None:
    stream = swell.Cache(baked / "pbf").wet["default"]
    assert stream.solver == "wet"
    [surface] = json.loads(stream.assets["wet.json"].read_text())["surfaces"]
    frame = stream[6]
    assert frame.attributes == ("wetness",)
    assert len(frame) == surface["vertices"] == len(stream[0])
    assert 0.0 <= frame["wetness"].min() and frame["wetness"].max() <= 1.0
    header = stream.assets[surface["file"]].read_bytes().split(b"end_header")[0].decode()
    assert f"element vertex {len(frame)}\n" in header
    assert swell.Cache(baked / "flip").wet == {}, "a bake without a stream"


def test_whitewater_is_a_cache_of_its_own(baked: Path) -> None:
    stream = swell.Cache(baked / "pbf").streams["default"]
    assert stream.solver == "whitewater"
    frame = stream[6]
    assert frame.attributes == ("age", "kind", "life", "radius")
    rows = plain_rows(frame.path, attributes=4)
    assert len(rows) > 50
    for place, name in enumerate(frame.attributes, 7):
        assert frame[name].tolist() == [row[place] for row in rows]
        assert np.shares_memory(frame[name], frame.rows)
    assert set(frame["kind"].tolist()) <= {0.0, 1.0, 2.0}
    report = frame.record.report
    assert report is not None
    counted = [int((frame["kind"] == kind).sum()) for kind in range(3)]
    assert counted == [report["spray"], report["foam"], report["bubbles"]]
    assert len(stream[0]) == 0, "a frame without particles"
    assert stream[0].position.shape == (0, 3)
    with pytest.raises(KeyError, match="age, kind"):
        frame["speed"]


def test_attributes_of_apic(baked: Path) -> None:
    cache = swell.Cache(baked / "flip")
    assert cache.solver == "flip"
    frame = cache[6]
    assert len(frame.attributes) == 9
    rows = plain_rows(frame.path, attributes=9)
    for place, name in enumerate(frame.attributes, 7):
        assert frame[name].tolist() == [row[place] for row in rows]


def test_far_from_the_origin_positions_are_double(baked: Path) -> None:
    far = swell.Cache(baked / "far")[0]
    assert far.position.dtype == np.float64
    assert far.position.tolist() == [list(row[:3]) for row in plain_rows(far.path, position="d")]
    near = swell.Cache(baked / "pbf")[0].position
    assert np.abs(far.position - [8192.0, 0.0, 0.0] - near).max() < 1e-6


def test_frames_that_were_kept(baked: Path) -> None:
    cache = swell.Cache(baked / "kept")
    assert cache.frames == [0, 4, 6]
    assert [frame.frame for frame in cache] == [0, 4, 6]
    assert 4 in cache
    assert 3 not in cache
    assert len(cache.ledger) == 7
    assert list(cache.grids) == list(FRAMES)
    assert len(cache.probes["front"]) == 7
    with pytest.raises(swell.MissingFrame, match=r"frame 3: .*every 4.*frames 0 and 4 were"):
        cache[3]
    assert cache.survey() == []


def test_a_branch_begins_with_its_frame(baked: Path) -> None:
    cache = swell.Cache(baked / "branch")
    assert (cache.first_frame, cache.last_frame) == (3, 6)
    assert cache[6].position.tolist() == swell.Cache(baked / "pbf")[6].position.tolist()
    with pytest.raises(swell.MissingFrame, match="no frame 2, only 3 to 6"):
        cache[2]
    assert cache.survey() == []


def test_z_up_turns_and_does_not_mirror(baked: Path) -> None:
    frame = swell.Cache(baked / "pbf")[6]
    turned = swell.z_up(frame.position)
    assert turned[:, 2].tolist() == frame.position[:, 1].tolist()
    axes = swell.z_up(np.eye(3))
    assert np.linalg.det(axes) == 1.0
    # Water falls: down is -y before and -z after.
    assert frame.velocity[:, 1].mean() < -0.1
    assert swell.z_up(frame.velocity)[:, 2].mean() < -0.1


def test_lines_of_format_1_are_read() -> None:
    """Its ledger has a place of its own for each stream."""
    new = {"frame": 1, "particles": 2, "clock": {"frame": 1, "time": 0.5}, "report": None, "chain": "c"}
    file = {"file": "frames/a.0001.ply", "bytes": 3, "blake3": "d"}
    grid = {"file": "grids/a.0001.vdb", "bytes": 4, "blake3": "e"}
    rows = [[1.0, None]]
    second = new | {"files": {"particles": file, "grids": grid}, "rows": {"probes": rows}}
    first = new | file | {"grids": grid, "probes": rows}
    ledger = Path("frames.jsonl")
    assert _parse_record(ledger, first, 1) == _parse_record(ledger, second, 2)
