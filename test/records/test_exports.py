# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Exports of other programs: read without an option, or with those that the message names."""

from collections import Counter

import numpy as np
import pytest

from benchmark.exports.programs import PROGRAMS
from benchmark.exports.trial import read
from benchmark.exports.truth import draw

ASKED = {
    "aspen_long", "ignition_dataset", "grafana_raw", "labview", "without_units", "bad_beyond",
    "day_or_month", "rockwell", "second_sheet", "finnish",
}  # fmt: skip
"""Exports that do not say their units, what a column is, or whether day or month is first."""


@pytest.fixture(scope="module", params=[1, 2])
def outcomes(request, tmp_path_factory):
    pytest.importorskip("openpyxl")
    pytest.importorskip("pyarrow")
    random = np.random.default_rng(request.param)
    folder = tmp_path_factory.mktemp("exports")
    found = {}
    for program, truth in zip(PROGRAMS, draw(len(PROGRAMS), request.param), strict=True):
        place = folder / program.__name__
        place.mkdir()
        found[program.__name__] = read(program(truth, random), truth, place)
    return found


def test_none_is_read_wrongly(outcomes):
    assert not {name: one.message for name, one in outcomes.items() if one.kind == "wrong"}


def test_nearly_all_are_read(outcomes):
    assert not {name for name, one in outcomes.items() if one.kind == "refused"}
    counts = Counter(one.options for one in outcomes.values())
    assert counts[0] >= 41
    assert counts[0] + counts[1] >= 0.9 * len(outcomes)
    assert set(counts) <= {0, 1, 2}


def test_what_is_ambiguous_is_asked_for(outcomes):
    assert {name for name, one in outcomes.items() if one.kind == "options"} <= ASKED
    message = outcomes["without_units"].message
    assert "--pressure-unit" in message
    assert "--position-unit" in message
