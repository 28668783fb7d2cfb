"""The notebook in `examples/`: its cells run in order, and say what its text promises."""

import json
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


def test_it_is_kept_without_results():
    """What a reader sees is what their own run gives."""
    for cell in NOTEBOOK["cells"]:
        assert cell.get("outputs", []) == []
        assert cell.get("execution_count") is None
