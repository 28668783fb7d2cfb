"""What is asked before a baseline changes."""

import pytest
from simulated_plant import values_of_valve

from valve_friction_ros.dashboard import Status, view_of

pytest.importorskip("nicegui", reason="NiceGUI is not installed")

from valve_friction_ros.dashboard.pages.valve_actions import question_of, why_no_baseline


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


def test_without_an_estimate_no_baseline_can_be_set():
    assert why_no_baseline(view()) == ""
    lost = {
        f"{name} verdict": "not identifiable" for name in ("coulomb_friction", "sliding_friction")
    }
    assert "identify the valve first" in why_no_baseline(view(**lost))
    assert why_no_baseline(view(**lost, reason="the stem stood still")) == "the stem stood still"
