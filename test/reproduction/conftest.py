"""One short run of the whole command, for all tests of what comes of it."""

import contextlib
import io
from pathlib import Path
from typing import NamedTuple

import pytest

from valve_friction_ros.commands import main, reproduce_paper
from valve_friction_ros.model import IsaSteps
from valve_friction_ros.reproduction.experiments import Plan
from valve_friction_ros.reproduction.programme import Programme

SHORT = Plan(
    square_periods=2, triangle_periods=2.5, sine_periods=1, isa=IsaSteps(sizes=(0.02, 0.2))
)


class Reproduced(NamedTuple):
    code: int
    lines: list[str]
    output: Path
    programme: Programme
    told: list[str]


@pytest.fixture(scope="session")
def reproduced(tmp_path_factory):
    """The command, run for real on short records; its programme is kept."""
    kept, told = [], []

    def run(benches, plan, seeds, progress):
        def telling(what):
            told.append(what)
            progress(what)

        kept.append(original(benches, plan, seeds, telling))
        return kept[0]

    output = tmp_path_factory.mktemp("paper") / "new" / "folder"
    original = reproduce_paper.run_programme
    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.setattr(reproduce_paper, "run_programme", run)
        patch.setattr(reproduce_paper, "_PLAN", SHORT)
        patch.setattr(reproduce_paper, "_SEEDS", 2)
        code = main.run(["reproduce-paper", "--output", str(output), "--seed", "3"])
    return Reproduced(code, printed.getvalue().splitlines(), output, kept[0], told)
