# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A plant's valves: the store that one thread fills, and their search, filters and order."""

import itertools
import math
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulated_plant import hear, values_of_valve

from valve_friction_ros.dashboard import Plant, Selection, Status, Unread, selected
from valve_friction_ros.dashboard.history_cache import sparkline
from valve_friction_ros.dashboard.live_state import MOST_VALVES, ValveView
from valve_friction_ros.dashboard.plant_rows import (
    SORTS,
    STATES,
    RowFeed,
    interval_text,
    levels_in,
    quantity_texts,
    ratio_text,
    row_of,
    state_of,
    state_words,
    summary,
)
from valve_friction_ros.health import Level, Ratio
from valve_friction_ros.wording import lasting, number_and_width

DAY = 86_400_000_000_000


@pytest.fixture
def plant():
    """Nine made-up valves, of each kind one, heard at time 100 s; silent after 5 s."""
    made = Plant(silence=5.0)
    for index in range(9):
        hear(made, Status(*values_of_valve(index)), 100.0)
    return made


def test_a_valve_is_silent_after_a_while(plant):
    assert not any(one.is_silent for one in plant.valves(104.9))
    assert all(one.is_silent for one in plant.valves(105.1))
    hear(plant, Status(*values_of_valve(3)), 105.0)
    silent = [one.view.tag for one in plant.valves(106.0) if not one.is_silent]
    assert silent == ["FV-104"]


def hear_named(plant, *names, at, **fields):
    for name in names:
        status = Status(f"/{name}/identifier: friction", 0, "", "", {})
        hear(plant, status._replace(**fields), at)


def nodes_of(plant, now):
    return [one.view.node for one in plant.valves(now)]


def test_what_the_history_knows_is_missed():
    plant = Plant(5.0)
    plant.expect(
        [ValveView("/area_1/fv_101/identifier", "FV-101"), ValveView("/x/identifier", "X")]
    )
    hear(plant, Status(*values_of_valve(0)), 100.0)
    first, second = plant.valves(101.0)
    assert (first.silent_for, first.is_silent) == (1.0, False)
    assert (second.view.tag, second.silent_for, second.is_silent) == ("X", None, True)
    assert second.view.level is None


def test_names_from_outside_do_not_fill_the_memory():
    plant = Plant(5.0)
    hear_named(plant, *range(MOST_VALVES + 10), at=0.0)
    assert len(plant.valves(0.0)) == MOST_VALVES
    hear_named(plant, 3, at=1.0, message="late")
    assert plant.valve("/3/identifier", 1.0).view.sentence == "late"


def test_a_name_that_nothing_keeps_is_forgotten():
    plant = Plant(5.0)
    plant.expect([ValveView("/kept/identifier", "KEPT")])
    hear_named(plant, "kept", "passing", "late", at=0.0)
    hear_named(plant, "late", at=100.0)
    assert len(plant.valves(3599.0)) == 3
    assert nodes_of(plant, 3690.0) == ["/kept/identifier", "/late/identifier"]
    hear_named(plant, "new", at=3691.0)
    numbers = [one.number for one in plant.valves(3691.0)]
    assert len(set(numbers)) == 3  # none takes the number of another


def test_room_is_made_though_nobody_looks():
    plant = Plant(5.0)
    hear_named(plant, *range(MOST_VALVES), at=0.0)
    hear_named(plant, "new", at=4000.0)
    assert nodes_of(plant, 4000.0) == ["/new/identifier"]


def test_it_is_filled_while_it_is_drained():
    """Trap: a collection that changes while it is walked through."""
    plant, stop = Plant(5.0), threading.Event()

    def fill():
        for index in itertools.cycle(range(3000)):
            hear_named(plant, index, at=0.0)
            if stop.is_set():
                return

    with ThreadPoolExecutor() as pool:
        pool.submit(fill)
        drains = [pool.submit(lambda: [plant.valves(0.0) for _ in range(30)]) for _ in range(2)]
        try:
            assert all(one.result() for one in drains)
        finally:
            stop.set()


def news(plant, feed, now, wall=1000.0):
    return feed.news(plant.valves(now), lambda _: None, wall)


def test_a_browser_is_sent_what_has_changed(plant):
    feed = RowFeed(lambda node: f"/valve?node={node}")
    first = news(plant, feed, 101.0)
    assert [row["i"] for row in first["rows"]] == first["order"] == list(range(9))
    # The next beat changes counters that the table does not show: only the clock is sent.
    for index in range(9):
        hear(plant, Status(*values_of_valve(index, beat=1)), 102.0)
    again = news(plant, feed, 102.1, 1001.0)
    made = {row["i"] for row in again.pop("rows", [])}
    assert again == {"now": 1001.0}
    assert not made - set(range(9))
    silent = news(plant, feed, 110.0, 1009.0)
    assert {row["state"] for row in silent["rows"]} == {"silent"}
    assert {row["last"] for row in silent["rows"]} == {1001}
    assert news(plant, feed, 111.0, 1010.4) == {"now": 1010.4}


def test_a_page_is_sent_with_its_first_rows_and_the_others_follow(plant):
    feed = RowFeed(lambda node: f"/valve?node={node}")
    first = feed.news(plant.valves(101.0), lambda _: None, 1000.0, 4)
    assert [row["i"] for row in first["rows"]] == list(range(4))
    assert first["order"] == list(range(9))
    then = news(plant, feed, 101.0)
    assert [row["i"] for row in then["rows"]] == list(range(4, 9))
    assert "order" not in then
    assert news(plant, feed, 101.0) == {"now": 1000.0}


def test_a_table_reads_a_status_again_only_where_its_mark_has_changed():
    name, level, tag, message, values = values_of_valve(0)
    plant, reads, looks = Plant(5.0), [], []

    def tell(mark, beat):
        def read():
            reads.append(beat)
            return Status(name, level, tag, message, {**values, "reversals": str(beat)})

        def look():
            looks.append(mark)
            return mark

        plant.hear(Unread(name, read, look), 0.0)

    node = name.partition(":")[0]
    for beat, mark in enumerate((7, 7, 7, 8)):
        tell(mark, beat)
        for _ in range(3):  # of three open pages
            (heard,) = plant.valves(0.0)
        assert not heard.view.values
    assert reads == [0, 3]
    assert looks == [7, 7, 7, 8]
    tell(8, 4)
    (heard,) = plant.valves(0.0)
    whole = plant.valve(node, 0.0)
    assert whole.view.values["reversals"] == "4"  # who looks at one valve gets all of it
    assert plant.valve(node, 0.0).view is whole.view
    assert reads == [0, 3, 4]
    assert whole.revision == heard.revision


def test_a_row_has_fixed_keys_only(plant):
    """The browser library evaluates keys that begin with a colon: none is from outside."""
    hear(
        plant,
        Status("/x/identifier: friction", 1, ":evil", ":evil", {":evil": "alert(1)", "a": ":b"}),
        1,
    )
    keys = [tuple(row_of(one, None, 0.0, "")) for one in plant.valves(100.0)]
    assert len(set(keys)) == 1
    assert not any(key.startswith(":") for key in keys[0])


@pytest.mark.parametrize(
    ("value", "half_width", "texts"),
    [
        (612.3456, 14.8, ("612", "± 15")),
        (5.21113, 0.0028, ("5.211", "± 0.0028")),
        (-3.14159, 0.21, ("−3.14", "± 0.21")),
        (math.nan, 1.0, ("–", "")),
        (1.6, 0.0, ("1.6", "")),
        (3.2e-7, 4.1e-8, ("3.2e-07", "± 4.1e-08")),
        (3.2e-7, math.nan, ("3.2e-07", "")),
        (0.002, 0.00012, ("0.00200", "± 0.00012")),
        (600.0, 2e-9, ("600", "± 2e-09")),
        (1.234e300, 1e299, ("1.234e+300", "± 1e+299")),
        (-1.234e300, math.nan, ("−1.23e+300", "")),
        (12.0, 3e200, ("12", "± 3e+200")),
        (0.0, 0.5, ("0.00", "± 0.50")),
        (9074.0, 6113.0, ("9100", "± 6100")),
        (205_144.0, 951.0, ("205140", "± 950")),
        (103.0, 9.96, ("103", "± 10")),
    ],
)
def test_numbers_have_the_digits_that_their_intervals_leave(value, half_width, texts):
    assert number_and_width(value, half_width) == texts


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.021, "0.021 s"),
        (599.4, "599 s"),
        (1410.0, "23.5 min"),
        (86_400.0, "24 h"),
        (9e8, "10417 days"),
    ],
)
def test_a_duration_has_no_exponent(seconds, text):
    assert lasting(seconds) == text


def test_a_ratio_of_any_size_is_short():
    assert [ratio_text(one) for one in (1.234, 0.0, 0.0004, 3e200)] == [
        "1.23", "0.00", "0.0004", "3e+200"
    ]  # fmt: skip
    assert interval_text(Ratio.between(1.05, math.nan, math.nan), " to ") == ""
    assert interval_text(Ratio.between(1.05, 1.0, 1.1), " to ") == "1.00 to 1.10"


def valve(**changes):
    """A row and the view of a made-up valve with other values."""
    name, level, tag, message, values = values_of_valve(0)
    plant = Plant(5.0)
    hear(plant, Status(name, level, tag, message, {**values, **changes}), 0.0)
    (heard,) = plant.valves(0.0)
    return row_of(heard, None, 0.0, ""), heard


def test_a_friction_that_the_record_does_not_determine_is_no_number():
    row, _ = valve()
    assert row["fcof"] == "F_c"
    assert row["dead"] != "–"
    open_ = {"coulomb_friction verdict": "not identifiable", "dead_band [%]": "nan"}
    row, heard = valve(**open_)
    assert (row["fcof"], row["fc"]) == ("sliding", quantity_texts(heard.view.friction)[0])
    assert heard.view.friction.name == "sliding_friction"
    assert (row["dead"], row["deadw"]) == ("–", "")
    row, heard = valve(**open_, **{"sliding_friction verdict": "not identifiable"})
    assert (row["fc"], row["fcw"], row["fcof"]) == ("–", "", "")
    assert SORTS["friction"](heard)[0] == math.inf


def test_frictions_are_sorted_by_what_is_shown():
    _, sliding = valve(**{"coulomb_friction [N]": "nan", "sliding_friction [N]": "512"})
    assert SORTS["friction"](sliding)[0] == -512


def test_a_sparkline_grows_upwards():
    drawn = sparkline([0, DAY, 2 * DAY, 3 * DAY], [1.0, 1.2, 1.4, 2.0])
    heights = [float(step.split()[1]) for step in drawn.path[1:].split("L")]
    assert heights == sorted(heights, reverse=True)
    assert drawn.days == 3
    assert drawn.base.startswith(f"M0 {heights[0]}")
    assert sparkline([0], [1.0]) is None
    assert sparkline([0, DAY], [float("nan"), -1.0]) is None


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
    assert summary({"ok": 0}) == "No valves yet"


def test_what_only_the_history_knows_comes_last(plant):
    plant.expect([ValveView("/x/identifier", "X")])
    assert tags(plant)[-1] == "X"
    assert tags(plant, Selection(states=frozenset({"unheard"}))) == ["X"]
    hear_named(plant, "x", at=NOW)
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


@pytest.mark.parametrize(
    ("chosen", "shown"),
    [
        ({"search": "GROWN packing"}, {"FV-105"}),  # all words, in any case
        ({"search": "fv-103"}, {"FV-103"}),
        ({"search": "/area_1/fv_103"}, {"FV-103"}),
        ({"search": "fv-103 leak"}, set()),
        ({"states": frozenset({"error"})}, {"FV-106", "FV-107"}),
        ({"states": frozenset({"silent"})}, set()),
        ({"signals": frozenset({"S"})}, {"FV-107"}),
        ({"states": frozenset({"warn"}), "signals": frozenset({"S"})}, set()),
    ],
)
def test_search_and_filters(plant, chosen, shown):
    assert set(tags(plant, Selection(**chosen))) == shown


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
