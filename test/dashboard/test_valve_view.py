# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A valve as it is shown: its values and signals, and what is asked before its baseline changes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulated_plant import values_of_valve

from valve_friction_ros.dashboard import Status, view_of
from valve_friction_ros.dashboard.live_state import identifier_in
from valve_friction_ros.dashboard.live_strip import LiveStrip, envelope
from valve_friction_ros.health import BaselineLack, Lack, Level, StatusSignal
from valve_friction_ros.wording import lack_remedies

NODE = "/fv_101/identifier"


def view(level=0, message="friction normal", hardware_id="FV-101", **values):
    return view_of(NODE, Status(f"{NODE}: friction", level, hardware_id, message, values))


def test_all_that_an_identifier_says_is_read():
    name, level, tag, message, values = values_of_valve(4)  # a valve whose friction has grown
    shown = view_of(identifier_in(name), Status(name, level, tag, message, values))
    assert (shown.tag, shown.level, shown.signal) == (tag, Level.WARN, StatusSignal("M"))
    assert shown.sentence == message
    assert shown.ratio.low < shown.ratio.value < shown.ratio.high
    assert shown.drift.expected == "2027-02-11"
    by_name = {one.name: one for one in shown.parameters}
    assert by_name["static_friction"].reason == "no slip jump was seen"
    assert math.isnan(by_name["static_friction"].value)
    assert by_name["mass"].verdict == "fixed"
    assert by_name["spring_preload"].unit == "N"
    band = (float(values[f"dead_band{of} [%]"]) for of in ("", " half width"))
    assert shown.dead_band[1:4] == (*band, "%")
    (baseline,) = shown.baseline
    assert baseline.name == "coulomb_friction"
    # What has no place of its own is in exactly one list.
    names = [one.name for some in shown.groups().values() for one in some]
    assert len(names) == len(set(names))
    assert {"rms", "moves", "reversals", "buffered samples"} <= set(names)


def test_the_time_of_the_estimate_is_utc():
    shown = view(estimate_time="2026-03-04T05:06:07.250000Z")
    assert shown.identified == 1_772_600_767_250_000_000


def test_a_shelved_alarm_ends_at_a_time_that_each_zone_can_write():
    shelved = {"alarm stuck": "shelved", "alarm stuck level": "ERROR"}
    (alarm,) = view(**shelved, **{"alarm stuck until [time]": "2026-03-04T05:06:07Z"}).alarms
    assert alarm.until == 1_772_600_767_000_000_000
    assert not alarm.is_told


def test_changes_since_the_baseline_are_rounded_to_their_intervals():
    shown = view(
        **{
            "lag change [s]": "0.01",
            "lag change low [s]": "-0.02",
            "lag change high [s]": "0.04",
            "asymmetry change [%]": "0.002098",
            "asymmetry change low [%]": "-0.09119",
            "asymmetry change high [%]": "0.09548",
            "viscous_asymmetry change [1]": "0.1",
            "reversals": "7",
        }
    ).groups()
    assert shown["changes"] == (
        ("lag", "0.010 (−0.020 to 0.040)", "s"),
        ("asymmetry", "0.002 (−0.091 to 0.095)", "%"),
        ("viscous asymmetry", "0.1", ""),
    )
    assert [one.name for one in shown["usage"]] == ["reversals"]


def test_long_times_and_large_numbers_have_no_exponent():
    times = {"time_watched [s]": "86400.25", "time_near_seat [s]": "599.5"}
    shown = view(**times, **{"travelled_distance [m]": "123456.5"}).groups()["usage"]
    assert {one.name: " ".join(one[1:]) for one in shown} == {
        "time watched": "24 h",
        "time near seat": "599.5 s",
        "travelled distance": "123500 m",
    }


@pytest.mark.parametrize(
    ("of", "name", "value", "healthy"),
    [
        ("sliding_friction", "sliding_friction", 824.0, 301.0),
        ("coulomb_friction", "coulomb_friction", 904.0, 290.0),
        ("mass", "coulomb_friction", 904.0, 290.0),
    ],
)
def test_the_friction_beside_a_ratio_is_the_one_that_it_is_of(of, name, value, healthy):
    values = {"friction_ratio": "2.74", "friction_ratio of": of}
    for one, now, before in (
        ("coulomb_friction", "904", "290"),
        ("sliding_friction", "824", "301"),
    ):
        values |= {f"{one} [N]": now, f"{one} half width [N]": "12", f"{one} verdict": "identified"}
        values[f"baseline_{one} [N]"] = before
    shown = view(**values)
    assert (shown.friction.name, shown.friction.value) == (name, value)
    assert shown.healthy.value == healthy


def test_what_is_missing_or_none_is_unknown():
    assert view(level=3).level is None
    assert view(level=2).level is Level.ERROR
    assert view(hardware_id="").tag == "fv_101"  # the namespace names the valve
    assert not view().dead_band.is_known


@pytest.mark.parametrize(
    ("name", "node"),
    [
        ("/fv_101/identifier: friction", NODE),
        ("/fv_101/identifier: temperature", None),
        ("cpu: friction", None),
        (": friction", None),
        ("/" + "x" * 300 + ": friction", None),
    ],
)
def test_only_identifiers_are_valves(name, node):
    assert identifier_in(name) == node


@given(
    level=st.integers(0, 255),
    words=st.text(max_size=50),
    values=st.dictionaries(
        st.one_of(
            st.text(max_size=30),
            st.sampled_from(
                ["NE 107", "friction_ratio", "dead_band [%]", "estimate_time", "limit_expected",
                 "coulomb_friction half width [N]", "coulomb_friction verdict",
                 "friction_drift [N/month]"]
            ),
        ),
        st.one_of(st.text(max_size=20), st.sampled_from(["nan", "inf", "-1", "0", "1e400"])),
    ),
)  # fmt: skip
def test_nothing_that_is_heard_is_an_error(level, words, values):
    """Anybody may publish: whatever comes is shown, without control characters."""
    shown = view_of(NODE, Status(words, level, words, words, values))
    assert shown.sentence.isprintable()
    assert shown.tag.isprintable()
    for some in shown.groups().values():
        assert all(one.text.isprintable() and one.name.isprintable() for one in some)


@pytest.fixture
def question_of():
    pytest.importorskip("nicegui", reason="NiceGUI is not installed")
    from valve_friction_ros.dashboard.pages.valve_page import question_of

    return question_of


def made_up(index=0, **changes):
    name, level, tag, message, values = values_of_valve(index)
    return view_of(f"/{index}/identifier", Status(name, level, tag, message, {**values, **changes}))


def test_a_new_estimate_is_another_question(question_of):
    before, after = made_up(), made_up(estimate_time="2031-01-01T00:00:00.000000Z")
    assert question_of(before, None) == question_of(made_up(), None)
    assert question_of(before, None) != question_of(after, None)


def test_a_restoration_asks_of_the_baselines_alone(question_of):
    asked = question_of(made_up(4), "none")  # a valve in an alarm
    assert (asked.new, asked.alarm) == ("none", "")
    assert asked == question_of(made_up(4, estimate_time="2031-01-01T00:00:00.000000Z"), "none")
    other = {"baseline_coulomb_friction [N]": "1"}
    assert asked != question_of(made_up(4, **other), "none")


def test_the_baseline_of_a_new_valve_is_set_from_its_estimate(question_of):
    asked = question_of(made_up(7), None)
    assert asked.old == "none"
    assert asked.new.startswith("Coulomb friction ")


@pytest.mark.parametrize(("index", "alarm"), [(0, ""), (4, "WARN")])
def test_who_sets_a_baseline_in_an_alarm_is_told(question_of, index, alarm):
    assert question_of(made_up(index), None).alarm == alarm


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
    dry, slid, valve = made_up(**said).lacks
    assert (dry.of, dry.lack) == ("coulomb_friction", Lack.VALUE)
    assert (slid.lack, slid.share, slid.largest) == (Lack.PRECISION, 0.41, 0.33)
    assert slid.words == "sliding friction is known to ±41 %, but a baseline requires ±33 %"
    assert (valve.of, valve.lack) == ("valve", Lack.HEALTH)


def test_an_identifier_of_before_lacks_an_estimate_at_most():
    assert made_up().lacks == ()
    lost = {f"{name} [N]": "nan" for name in ("coulomb_friction", "sliding_friction")}
    (one,) = made_up(**lost).lacks
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


SECOND = 1_000_000_000


@given(count=st.integers(0, 3000), columns=st.integers(1, 80), seed=st.integers(0, 2**32 - 1))
def test_each_column_keeps_its_extremes(count, columns, seed):
    random = np.random.default_rng(seed)
    times = np.sort(-random.uniform(0, 10, count))
    values = random.standard_normal(count)
    thinned = envelope(times, values, columns, 10.0)
    assert thinned.times.size <= max(2 * columns, 0) or thinned.times.size == count
    assert (np.diff(thinned.times) >= 0).all()
    assert set(thinned.values) <= set(values)
    column = np.clip(((times + 10) * columns / 10).astype(int), 0, columns - 1)
    kept = np.clip(((thinned.times + 10) * columns / 10).astype(int), 0, columns - 1)
    for one in np.unique(column):
        assert thinned.values[kept == one].max() == values[column == one].max()
        assert thinned.values[kept == one].min() == values[column == one].min()


def test_a_bag_that_begins_again_empties_the_signal():
    strip = LiveStrip(60.0)
    strip.add(0, np.array([50, 51]) * SECOND, np.array([1.0, 1.0]))
    strip.add(0, np.array([10, 11]) * SECOND, np.array([2.0, 2.0]))
    assert set(strip.strips(100)[0].values) == {2.0}


class Clock:
    now = 1000.0

    def __call__(self):
        return self.now


def test_the_axis_goes_on_when_the_samples_stop():
    clock = Clock()
    strip = LiveStrip(60.0, clock=clock)
    assert strip.note() == "No samples have been received yet."
    for signal in (0, 1):
        strip.add(signal, np.array([1, 2, 3]) * SECOND, np.array([1.0, 2.0, 3.0]))
    clock.now += 1.0
    assert strip.note() == ""
    assert strip.strips(100)[0].times.tolist() == [-2.0, -1.0, 0.0]
    clock.now += 9.0
    assert strip.note() == "no sample for 10 s"
    assert strip.strips(100)[1].times.tolist() == [-12.0, -11.0, -10.0]
    clock.now += 49.0
    assert strip.strips(100)[0].times.tolist() == [-60.0, -59.0]
    clock.now += 60.0
    assert strip.strips(100)[0].times.size == 0


def test_a_signal_that_stops_alone_is_named():
    clock = Clock()
    strip = LiveStrip(60.0, clock=clock)
    strip.add(0, np.array([1]) * SECOND, np.array([1.0]))
    assert strip.note() == "no stem"
    strip.add(1, np.array([1]) * SECOND, np.array([1.0]))
    clock.now += 7.0
    strip.add(1, np.array([8]) * SECOND, np.array([1.0]))
    assert strip.note() == "no pressure for 7 s"
    strip.trouble = "no such topic"
    assert strip.note() == "no such topic"


def test_nothing_is_drawn_anew_without_samples():
    """While samples come each counts; then the axis goes on each second, until all has left."""
    clock = Clock()
    strip = LiveStrip(60.0, clock=clock)
    none = strip.revision
    strip.add(0, np.array([1]) * SECOND, np.array([1.0]))
    seen = [strip.revision]
    assert seen[0] != none
    for _ in range(500):
        clock.now += 0.2
        seen.append(strip.revision)
    assert seen == sorted(seen)
    assert len(set(seen[:6])) == 1
    assert 55 <= len(set(seen)) <= 62
    assert len(set(seen[-190:])) == 1
    strip.add(0, np.array([101]) * SECOND, np.array([1.0]))
    assert strip.revision != seen[-1]


@given(sizes=st.lists(st.integers(1, 400), max_size=40), most=st.integers(1, 700))
def test_the_newest_samples_are_kept_whatever_the_packets(sizes, most):
    strip, sent = LiveStrip(1.0, most), 0
    for size in sizes:
        numbers = np.arange(sent, sent + size)
        strip.add(0, numbers * 2_000_000, numbers.astype(float))  # 500 Hz
        sent += size
    kept = strip.strips(10_000)[0].values
    assert kept.tolist() == list(range(max(0, sent - min(most, 501)), sent))


def test_the_loop_is_stem_over_pressure():
    strip = LiveStrip(60.0)
    time = np.arange(0, 20, 0.01)
    stamps = (time * SECOND).astype(np.int64)
    strip.add(0, stamps, 1e5 + 1e4 * time)
    strip.add(1, stamps[::3] + 2_000_000, 1e-3 * (time[::3] + 0.002))  # slower, and a little later
    loop = strip.loop(300)
    assert 100 < loop.times.size <= 300
    np.testing.assert_allclose(loop.values, 1e-3 * (loop.times - 1e5) / 1e4, atol=1e-6)
    assert LiveStrip(60.0).loop(300).times.size == 0
