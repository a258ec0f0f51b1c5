"""Reading, measuring and comparing, each with what has to be refused or noticed. Run by tools/lib/python-package."""

import json

import numpy as np
import pytest

import cases
import measure
import results
from results import Fault, Row, Timed

GOOD = {"device": "x", "particles": 8, "seconds": [0.5, 0.25], "substeps": 2}


def test_a_timed_run_is_read():
    assert results.sample(json.dumps(GOOD), 8)["seconds"] == [0.5, 0.25]


@pytest.mark.parametrize(
    "spoiled",
    [
        "",
        "59582 particles",
        "[1.0]",
        json.dumps({**GOOD, "particles": 7}),
        json.dumps({**GOOD, "seconds": []}),
        json.dumps({**GOOD, "seconds": [0.5, -0.25]}),
        json.dumps({**GOOD, "seconds": [float("nan")]}),
        json.dumps({**GOOD, "seconds": ["soon"]}),
        json.dumps({"particles": 8}),
        json.dumps(GOOD)[:-9],
    ],
)
def test_a_spoiled_run_is_refused(spoiled):
    with pytest.raises(Fault):
        results.sample(spoiled, 8)


def test_a_bake_has_all_of_its_frames():
    event = '{"event":"frame","frame":1,"seconds":0.5}'
    text = f'{{"event":"start"}}\n{event}\n{event}\n'
    assert results.bake_seconds(text, 2) == [0.5, 0.5]
    for spoiled in (f"{event}\n", text.replace("0.5", "NaN"), text + "killed\n"):
        with pytest.raises(Fault):
            results.bake_seconds(spoiled, 2)


def test_ratios_are_of_the_same_round():
    ours, theirs = Timed("swell", [1.0, 2.0, 4.0]), Timed("peer", [3.0, 4.0, 20.0])
    table = results.speed_table("case", "s", "peer", [ours], theirs, "")
    assert "| swell | 2.00 (1.00 to 4.00) | 3.00 (2.00 to 5.00) |" in table
    with pytest.raises(ValueError):
        results.speed_table("case", "s", "peer", [ours], Timed("peer", [3.0]), "")


def test_a_peer_that_is_not_there_is_said():
    table = results.speed_table("case", "s", "Peer", [Timed("swell", [1.0])], None, "could not be installed (pip)")
    assert "Peer: could not be installed (pip)" in table


def row(program, seconds, density, level):
    return Row(program, "as set", {"density": density, "level": level}, [seconds])


def test_the_cheapest_that_is_no_worse():
    peer = row("Peer", 6.0, 0.02, -0.01)
    coarse, dear, good = row("swell, a", 1.0, 0.03, 0.0), row("swell, b", 4.0, 0.01, 0.01), row("swell, c", 2.0, 0.02, 0.005)
    rows = [peer, coarse, dear, good]
    assert results.cheapest(peer, rows, "tank") == "swell, c, as set: 3.00 (3.00 to 3.00)"
    assert results.cheapest(coarse, rows, "tank") == "none is as good"
    # A level that is off the other way is as wrong.
    good.errors["level"] = -0.02
    assert results.cheapest(peer, rows, "tank").startswith("swell, b")
    # What both hold to a thousandth is no difference.
    peer.errors["density"], dear.errors["density"] = 1e-6, 9e-4
    assert results.cheapest(peer, rows, "tank").startswith("swell, b")
    dear.failed = "fails: it burst"
    assert results.cheapest(peer, rows, "tank") == "none is as good"
    assert "fails: it burst" in results.error_table("case", "tank", rows)


def test_tables_stand_between_their_marks():
    page = f"before\n{results.BEGIN}\nold\n{results.END}after\n"
    assert results.place(page, "new", "page") == f"before\n{results.BEGIN}\nnew\n{results.END}after\n"
    for spoiled in (page.replace("peers", "peer"), page.replace(results.END, ""), page + page):
        with pytest.raises(Fault):
            results.place(spoiled, "new", "page")


def test_cases_have_the_counts_that_the_tables_say():
    assert [case.particles for case in cases.speeds(False)] == [59582, 903168]
    for small in (False, True):
        for case in cases.errors(small):
            for setting in case.settings:
                # A frame is a whole number of a peer's steps.
                steps = case.job(setting)["steps"] if setting.step else case.frames
                assert case.seconds_of(steps, setting) == pytest.approx(case.frames / case.frames_per_second)


CASE = {"box": [12, 18, 12], "water": [12, 12, 12], "spacing": 0.1, "particle_spacing": 0.1, "frames_per_second": 60, "frames": 2, "particles": 1728}


def lattice(factor=1.0):
    places = 0.1 * (np.arange(12) + 0.5)
    at = np.stack(np.meshgrid(places, places, places, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.hstack([at * [1.0, factor, 1.0], np.zeros_like(at)])


def test_a_lattice_is_at_rest():
    found = measure.tank(CASE, [lattice(), lattice()])
    # The spline's sum over a lattice of half its support is 1.0001.
    assert found["density"] < 2e-4
    assert found["level"] < 1e-12
    assert found["speed"] == 0.0


def test_pressed_and_moving_water_is_not():
    spoiled = lattice(0.98)
    spoiled[7, 4] = -3.0
    found = measure.tank(CASE, [lattice(), spoiled])
    # Density goes with 1 / 0.98, level with 0.98.
    assert found["density"] == pytest.approx(1.0 / 0.98 - 1.0, rel=0.2)
    assert found["level"] == pytest.approx(0.02)
    assert found["speed"] == pytest.approx(3.0)


def test_a_front_as_published_has_no_error():
    case = {"water": [10, 20, 5], "spacing": 0.1, "frames_per_second": 100}
    times, places = zip(*measure.MARTIN_AND_MOYCE)
    frames = []
    for number in range(1, 77):
        rows = np.zeros((4, 6))
        rows[:, 1] = 1.0
        rows[:, 0] = np.interp(number / 100 * np.sqrt(2 * measure.GRAVITY), times, places)
        frames.append(rows)
    found = measure.dam(case, frames)
    # What is between two frames lies on a line between them.
    assert found["front"] < 2e-3
    assert found["energy"] == pytest.approx(0.0)
    for rows in frames:
        rows[:, 0] *= 1.1
        rows[:, 3] = 1.0
    found = measure.dam(case, frames)
    assert found["front"] == pytest.approx(0.1, abs=3e-3)
    assert found["energy"] == pytest.approx(0.5 / measure.GRAVITY)


def test_frames_of_a_peer_are_whole(tmp_path):
    file = tmp_path / "frames.bin"
    rows = np.stack([lattice(), lattice()]).astype("<f4")
    rows.tofile(file)
    assert measure.measured({**CASE, "kind": "tank"}, file)["density"] < 2e-4
    rows[1, 5, 0] = np.nan
    for spoiled in (rows, rows[:1], rows.ravel()[:-1]):
        spoiled.tofile(file)
        with pytest.raises(ValueError):
            measure.measured({**CASE, "kind": "tank"}, file)
