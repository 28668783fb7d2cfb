# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Search, filters and order of a plant's valves."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulated_plant import hear

from valve_friction_ros.dashboard import Selection, Status, selected
from valve_friction_ros.dashboard.plant_rows import (
    SORTS,
    STATES,
    levels_in,
    state_of,
    state_words,
    summary,
)
from valve_friction_ros.health import Level

NOW = 101.0


def tags(plant, selection=None, now=NOW):
    return [one.view.tag for one in selected(plant.valves(now), selection or Selection())]


def test_the_worst_come_first(plant):
    """Errors by their change, then warnings, then those without a baseline, then the good."""
    order = tags(plant)
    assert set(order[:2]) == {"FV-106", "FV-107"}  # × 2.3 and × 0.41
    assert set(order[2:4]) == {"FV-105", "FV-109"}
    assert order[4] == "FV-108"  # without a baseline


def test_a_valve_is_good_only_by_comparison_with_a_baseline(plant):
    good, new = plant.valves(NOW)[0], plant.valves(NOW)[7]
    assert (state_of(good), state_words(good)) == ("ok", "good")
    assert (new.view.level, state_of(new), state_words(new)) == (Level.OK, "unknown", "no baseline")
    unsure = replace(new, view=replace(new.view, parameters=()))
    assert (state_of(unsure), state_words(unsure)) == ("unknown", "unknown")


def test_all_good_is_said_of_good_valves_only():
    assert summary({"error": 0, "ok": 2}) == "2 valves, all good"
    assert summary({"unknown": 2, "ok": 0}) == "2 valves: 2 unknown"
    assert summary({"error": 1, "unknown": 2, "ok": 1, "unheard": 3}) == (
        "7 valves: 1 error, 2 unknown, 3 not heard"
    )
    assert summary({"ok": 0}) == "No valve yet"


def test_what_only_the_history_knows_comes_last(plant):
    plant.expect([("/x/identifier", "X")])
    assert tags(plant)[-1] == "X"
    assert tags(plant, Selection(states=frozenset({"unheard"}))) == ["X"]
    hear(plant, Status("/x/identifier: friction", 0, "X", "", {}), NOW)
    assert state_of(plant.valve("/x/identifier", NOW + 30.0)) == "silent"


@pytest.mark.parametrize(
    ("address", "query"),
    [
        ("http://127.0.0.1:8080/?q=fv&show=warn&tz=UTC", {"q": "fv", "show": "warn"}),
        ("http://127.0.0.1:8080/valve?q=fv", {}),
        ("http://[", {}),
        ("", {}),
    ],
)
def test_the_way_back_keeps_search_and_filters(address, query):
    assert Selection.from_address(address).to_query() == query


def test_a_silent_valve_comes_after_errors_and_before_warnings(plant):
    for number in (5, 6, 4):  # both errors and a warning are heard again, the others are silent
        valve = plant.valves(NOW)[number].view
        name = f"{valve.node}: friction"
        values = {"NE 107": valve.signal.value, "friction_ratio": "1.5"}
        hear(plant, Status(name, int(valve.level), valve.tag, valve.sentence, values), 110.0)
    order = tags(plant, now=111.0)
    assert set(order[:2]) == {"FV-106", "FV-107"}
    assert order[-1] == "FV-105"
    assert order[2] == "FV-109"  # of the silent ones the one that was in WARN


def test_search_needs_all_words_in_any_case(plant):
    assert tags(plant, Selection(search="GROWN packing")) == ["FV-105"]
    assert tags(plant, Selection(search="fv-103")) == ["FV-103"]
    assert tags(plant, Selection(search="/area_1/fv_103")) == ["FV-103"]
    assert tags(plant, Selection(search="fv-103 leak")) == []


def test_filters(plant):
    assert set(tags(plant, Selection(states=frozenset({"error"})))) == {"FV-106", "FV-107"}
    assert tags(plant, Selection(signals=frozenset({"S"}))) == ["FV-107"]
    assert tags(plant, Selection(states=frozenset({"warn"}), signals=frozenset({"S"}))) == []
    assert tags(plant, Selection(states=frozenset({"silent"})), now=200.0) == tags(plant, now=200.0)


@pytest.mark.parametrize("name", SORTS)
def test_an_order_turned_round_is_the_reverse(plant, name):
    order = tags(plant, Selection(sort=name))
    assert len(order) == 9
    assert tags(plant, Selection(sort=name, is_reversed=True)) == order[::-1]


def test_sorting_twice_by_a_column_turns_round():
    once = Selection().sorted_by("tag")
    assert (once.sort, once.is_reversed) == ("tag", False)
    assert once.sorted_by("tag").is_reversed
    assert not once.sorted_by("tag").sorted_by("ratio").is_reversed


@given(
    search=st.text(max_size=40),
    states=st.frozensets(st.sampled_from(STATES)),
    signals=st.frozensets(st.sampled_from("FCSM")),
    sort=st.sampled_from(list(SORTS)),
    is_reversed=st.booleans(),
    is_tiled=st.booleans(),
)
def test_the_address_holds_the_selection(search, states, signals, sort, is_reversed, is_tiled):
    one = Selection(search, states, signals, sort, is_reversed, is_tiled)
    assert Selection.from_query(one.to_query()) == one
    address = one.address({"tz": "Europe/Berlin"})
    assert address.startswith("/?")
    assert address.isascii()


@given(st.dictionaries(st.sampled_from(["q", "show", "ne", "sort", "view"]), st.text(max_size=30)))
def test_any_address_is_read(query):
    one = Selection.from_query(query)
    assert one.sort in SORTS
    assert one.states <= set(STATES)


def test_states_are_counted(plant):
    assert levels_in(plant.valves(NOW)) == {
        "error": 2, "silent": 0, "warn": 2, "unknown": 1, "ok": 4, "unheard": 0,
    }  # fmt: skip
    heard = plant.valves(NOW)[0]
    assert state_of(replace(heard, view=replace(heard.view, level=None))) == "unknown"
