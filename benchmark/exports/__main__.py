# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Exports of other programs with known truth, to test whether they are read, and read correctly.

`python -m benchmark.exports` draws the valves, writes the files, reads them and prints a table.
"""

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from benchmark.exports.programs import PROGRAMS
from benchmark.exports.truth import draw, read


def main() -> None:
    """Draw the exports and read them."""
    parser = argparse.ArgumentParser(prog="python -m benchmark.exports")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="write the files there")
    options = parser.parse_args()
    random = np.random.default_rng(options.seed)
    counts: Counter[str] = Counter()
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as scratch:
        for number, (program, truth) in enumerate(
            zip(PROGRAMS, draw(len(PROGRAMS), options.seed), strict=True), start=1
        ):
            folder = (options.keep or Path(scratch)) / program.__name__
            folder.mkdir(parents=True, exist_ok=True)
            outcome = read(program(truth, random), truth, folder)
            kind = outcome.kind if outcome.kind != "options" else f"{outcome.options} named"
            counts[kind] += 1
            print(f"{number:2d} {program.__name__:20s} {kind:8s} {outcome.message[-300:]}")
    print(dict(counts), f"{time.perf_counter() - begin:.1f} s")


if __name__ == "__main__":
    main()
