# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Real machines without a spring: pneumatic cylinders, and EMPS, an electro-mechanical axis."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from benchmark.reality import package

EMPS = {"coulomb_friction": 20.3935, "viscous_friction": 203.5034}
"""IDIM-LS values of the data set's authors: N, and N·s/m."""

_NEAR, _NARROW = 0.10, 0.10
_NEAR_EMPS = 0.03
"""Largest error and half width of a cylinder's sliding friction; largest error of EMPS; shares."""


class RealRow(NamedTuple):
    """A number of a real machine beside what others say of it, SI unit.

    `words` are verdict or refusal; `met` tells whether it is as near and narrow as it must be.
    """

    machine: str
    name: str
    known: float
    value: float
    half_width: float
    words: str
    met: bool


def _row(
    machine: str, name: str, known: float, answer: package.Answer, near: float, narrow: float
) -> RealRow:
    number = answer.numbers.get(name)
    if number is None:
        return RealRow(machine, name, known, math.nan, math.nan, answer.refusal[:60], False)
    met = abs(number.value - known) <= near * known and number.half_width <= narrow * known
    return RealRow(machine, name, known, number.value, number.half_width, number.verdict, met)


def real_rows(folder: Path) -> Iterator[RealRow]:
    """Identify what the folders ``cylinders`` and ``emps`` hold; one that is absent is left out.

    Beside each cylinder ``half_loops.json`` holds half the distance, N, of the forces both ways.
    """
    known = folder / "cylinders" / "half_loops.json"
    if known.is_file():
        for machine, loop in json.loads(known.read_text(encoding="utf-8")).items():
            answer = package.identify_file(known.parent / f"{machine}.csv.gz")
            half = loop["half_loop_n"]
            yield _row(machine, "sliding_friction", half, answer, _NEAR, _NARROW)
    emps = folder / "emps" / "emps_identification.csv"
    if emps.is_file():
        answer = package.identify_file(emps)
        for name, value in EMPS.items():
            yield _row("EMPS", name, value, answer, _NEAR_EMPS, math.inf)
