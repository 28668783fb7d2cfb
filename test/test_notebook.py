# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The notebook in `examples/`: its cells run in order, and say what its text promises."""

import ast
import json
import struct
from datetime import datetime, timezone
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
NOTEBOOK = json.loads((EXAMPLES / "from_recording_to_decision.ipynb").read_text(encoding="utf-8"))


def test_it_goes_from_a_recording_to_a_decision(monkeypatch, capsys):
    monkeypatch.chdir(EXAMPLES)
    names: dict[str, object] = {}
    for number, cell in enumerate(NOTEBOOK["cells"]):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"cell {number}", "exec"), names)
    plt.close("all")
    coulomb = names["result"].parameters["coulomb_friction"]
    assert coulomb.value == pytest.approx(400.0, abs=coulomb.half_width)
    printed = capsys.readouterr().out
    assert "friction has grown" in printed
    assert "dead band 13.7 % of the travel" in printed
    assert "the record very strongly favours the first model: it is 1e" in printed
    low, high, middle = (names[name] for name in ("low", "high", "middle"))
    assert np.all(low <= high)
    assert np.mean((low <= middle) & (middle <= high)) > 0.9
    changes = names["again"].difference(names["result"])
    assert set(changes) >= {"coulomb_friction", "spring_constant", "sliding_friction"}
    assert all(abs(change) < half_width for change, half_width in changes.values())
    date = datetime(2026, 10, 1, 6, tzinfo=timezone.utc)
    assert names["again"].recording.start_time == pytest.approx(date.timestamp(), abs=1e-3)


def test_its_last_lines_are_shown(monkeypatch):
    """Jupyter shows what the last line of a cell is, unless it ends with a semicolon."""
    monkeypatch.chdir(EXAMPLES)
    names: dict[str, object] = {}
    shown = []
    for cell in NOTEBOOK["cells"]:
        if cell["cell_type"] != "code":
            continue
        source = "".join(cell["source"])
        *before, last = ast.parse(source).body
        if isinstance(last, ast.Expr) and not source.rstrip().endswith(";"):
            exec(compile(ast.Module(before, []), "cell", "exec"), names)
            shown.append(eval(compile(ast.Expression(last.value), "cell", "eval"), names))
        else:
            exec(compile(source, "cell", "exec"), names)
    plt.close("all")
    (picture,) = [one for one in shown if one is not None]
    png = picture._repr_png_()
    assert png.startswith(b"\x89PNG")
    width, height = struct.unpack(">II", png[16:24])
    assert (width, height) == (1210, 935)
    assert len(png) < 500_000


def test_the_documentation_shows_its_main_picture():
    page = (EXAMPLES.parent / "doc" / "start" / "notebook.md").read_text(encoding="utf-8")
    assert "](../notebook.png)" in page
    picture = EXAMPLES.parent / "doc" / "notebook.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size < 100_000


def test_it_is_kept_without_results():
    """What a reader sees is what their own run gives."""
    for cell in NOTEBOOK["cells"]:
        assert cell.get("outputs", []) == []
        assert cell.get("execution_count") is None
