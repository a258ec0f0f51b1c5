"""The example of docs/interchange.md runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from .conftest import ROOT


def test_the_example_runs(baked: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = (ROOT / "docs/interchange.md").read_text()
    [example] = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    # The tank in place of the quickstart, which has more frames.
    example = example.replace("cache/quickstart/pbf", str(baked / "pbf")).replace("[48]", "[6]")
    exec(compile(example, "docs/interchange.md", "exec"), {})
    printed = capsys.readouterr().out
    assert printed.startswith("tank pbf 24.0 0.1\n")
    for expected in ("elevation_min_m", "'age', 'kind', 'life', 'radius'", "tank.0006.vdb", "pbf-"):
        assert expected in printed
    with pytest.raises(AttributeError):
        exec(compile(example.replace(".particle_spacing", ".spacing"), "control", "exec"), {})
