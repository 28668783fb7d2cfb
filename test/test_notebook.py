"""The notebook in `examples/`: its cells run in order, and say what its text promises."""

import ast
import json
import struct
from pathlib import Path

import matplotlib.pyplot as plt
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
