# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is asked before a baseline changes."""

import pytest
from simulated_plant import values_of_valve

from valve_friction_ros.dashboard import Status, view_of
from valve_friction_ros.health import BaselineLack, Lack
from valve_friction_ros.wording import lack_remedies

pytest.importorskip("nicegui", reason="NiceGUI is not installed")

from valve_friction_ros.dashboard.pages.valve_page import question_of


def view(index=0, **changes):
    name, level, tag, message, values = values_of_valve(index)
    return view_of(f"/{index}/identifier", Status(name, level, tag, message, {**values, **changes}))


def test_a_new_estimate_is_another_question():
    before, after = view(), view(estimate_time="2031-01-01T00:00:00.000000Z")
    assert question_of(before, None) == question_of(view(), None)
    assert question_of(before, None) != question_of(after, None)


def test_a_restoration_asks_of_the_baselines_alone():
    asked = question_of(view(), "none")
    assert asked.new == "none"
    assert asked == question_of(view(estimate_time="2031-01-01T00:00:00.000000Z"), "none")
    other = {"baseline_coulomb_friction [N]": "1"}
    assert asked != question_of(view(**other), "none")


def test_the_baseline_of_a_new_valve_is_set_from_its_estimate():
    asked = question_of(view(7), None)
    assert asked.old == "none"
    assert asked.new.startswith("coulomb friction ")


@pytest.mark.parametrize(("index", "alarm"), [(0, ""), (4, "WARN")])
def test_who_sets_a_baseline_in_an_alarm_is_told(index, alarm):
    assert question_of(view(index), None).alarm == alarm
    assert question_of(view(index), "none").alarm == ""


def test_what_is_missing_to_a_baseline_is_read_by_its_type():
    said = {
        "baseline_possible": "false",
        "baseline_lacks coulomb_friction": "VALUE",
        "baseline_lacks sliding_friction": "PRECISION",
        "baseline_lacks sliding_friction share [%]": "41",
        "baseline_lacks sliding_friction largest [%]": "33",
        "baseline_lacks valve": "HEALTH",
        "baseline_lacks moves": "what no identifier says",
    }
    dry, slid, valve = view(**said).lacks
    assert (dry.of, dry.lack) == ("coulomb_friction", Lack.VALUE)
    assert (slid.lack, slid.share, slid.largest) == (Lack.PRECISION, 0.41, 0.33)
    assert slid.words == "sliding friction is known to ±41 %, and a baseline needs ±33 %"
    assert (valve.of, valve.lack) == ("valve", Lack.HEALTH)


def test_an_identifier_of_before_lacks_an_estimate_at_most():
    assert view().lacks == ()
    lost = {f"{name} [N]": "nan" for name in ("coulomb_friction", "sliding_friction")}
    (one,) = view(**lost).lacks
    assert (one.of, one.lack) == ("result", Lack.RESULT)


@pytest.mark.parametrize("lack", Lack)
def test_each_lack_has_its_words_and_a_remedy(lack):
    assert BaselineLack("sliding_friction", lack).words
    assert lack_remedies([("sliding_friction", lack.name)])


def test_a_remedy_is_said_once_and_moves_need_patience():
    lacks = [("coulomb_friction", "VALUE"), ("sliding_friction", "PRECISION")]
    told = lack_remedies(lacks)
    assert len(told) == 2
    assert any("plan-test" in one for one in told)
    assert lack_remedies([*lacks, ("moves", "PRECISION")])[:2] == told
    assert "its moves will provide a baseline" in lack_remedies([*lacks, ("moves", "VALUE")])[2]
