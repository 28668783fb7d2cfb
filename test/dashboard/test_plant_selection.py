"""Search, filters and order of a plant's valves."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulated_plant import hear

from valve_friction_ros.dashboard import Selection, Status, selected
from valve_friction_ros.dashboard.selection import SORTS, STATES, levels_in, state_of

NOW = 101.0


def tags(plant, selection=None, now=NOW):
    return [one.view.tag for one in selected(plant.valves(now), selection or Selection())]


def test_the_worst_come_first(plant):
    """Errors by their change, then warnings, then the good by theirs; those without ratio last."""
    order = tags(plant)
    assert set(order[:2]) == {"FV-106", "FV-107"}  # × 2.3 and × 0.41
    assert set(order[2:4]) == {"FV-105", "FV-109"}
    assert order[-1] == "FV-108"  # without a baseline


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
        "error": 2, "silent": 0, "warn": 2, "ok": 5, "unknown": 0,
    }  # fmt: skip
    heard = plant.valves(NOW)[0]
    assert state_of(replace(heard, view=replace(heard.view, level=None))) == "unknown"
