# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `reproduce-paper`: run the programme of the paper, an example with the package."""

import argparse
import importlib
import sys
from pathlib import Path


def _examples() -> Path:
    """Find the folder of the examples, in the sources or in the installation."""
    package = Path(__file__).resolve().parents[1]
    for above in package.parents:
        for folder in (above / "examples", above / "share" / package.name / "examples"):
            if (folder / "paper" / "command.py").is_file():
                return folder
    raise ValueError(
        f"the reproduction is not part of the installed {package.name}: run this command in its "
        "sources, where it lies in examples/paper"
    )


def run(options: argparse.Namespace) -> int:
    """Run the programme and write the report."""
    folder = str(_examples())
    if folder not in sys.path:
        sys.path.append(folder)
    code: int = importlib.import_module("paper.command").run(options)
    return code
