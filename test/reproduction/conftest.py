# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One short run of the whole command, for all tests of what comes of it."""

import contextlib
import io
from pathlib import Path
from typing import NamedTuple

import pytest
from paper import command
from paper.experiments import Plan
from paper.programme import Programme

from valve_friction_ros.commands import main
from valve_friction_ros.model import IsaSteps

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
    original = command.run_programme
    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.setattr(command, "run_programme", run)
        patch.setattr(command, "_PLAN", SHORT)
        patch.setattr(command, "_SEEDS", 2)
        code = main.run(["reproduce-paper", "--output", str(output), "--seed", "3"])
    return Reproduced(code, printed.getvalue().splitlines(), output, kept[0], told)
